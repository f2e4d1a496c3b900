"use strict";
(() => {
  const narrow = matchMedia("(max-width: 700px)");
  const rowHeight = () => (narrow.matches ? 190 : 64);
  const { columns, rows, S_title } = JSON.parse(document.getElementById("data-rows").textContent);
  const at = Object.fromEntries(columns.map((name, k) => [name, k]));
  const SHOWN = [
    ["tag", "Loop", "14%"], ["area", "Area", "7%"], ["finding_text", "Finding", "16%"], ["next_step", "Next step", "36%"],
    ["S", S_title, "7%"], ["period_s", "Period", "7%"], ["priority", "Priority", "7%"], ["label", "Note", "6%"],
  ];
  const TITLES = {
    area: "Area", finding_text: "Finding", next_step: "Next step", S: S_title, period_s: "Period", priority: "Priority",
    priority_reason: "Why this priority", reason: "Why", label: "Note",
  };
  const NUMBERS = new Set(["S", "period_s", "priority"]);
  const SIGNS = { alert: "▲ ", unknown: "? ", good: "● ", plain: "" };
  const LEVELS = { alert: 0, unknown: 1, plain: 2, good: 3 };
  const [scroll, head, body, find, level, shown] = ["scroll", "head", "body", "find", "level", "shown"].map((id) =>
    document.getElementById(id),
  );
  const texts = rows.map((row) =>
    ["tag", "area", "finding_text", "next_step", "status", "loop_state", "oscillation_cause", "label", "reason"].map((name) => row[at[name]]).join(" ").toLowerCase(),
  );
  let order = rows.map((_, k) => k);
  let sorted = { name: "priority", down: true };
  let filtered = order;

  const plain = (value) => (value === null || value === "" ? "–" : String(value).replaceAll("_", " "));
  const levelOf = (row) => row[columns.length].level;
  const isDone = (row) => row[at.finding_text] !== "";
  function cellText(row, name) {
    if (name === "finding_text") return isDone(row) ? SIGNS[levelOf(row)] + row[at.finding_text] : plain(row[at.status]);
    return plain(row[columns.length][name] ?? row[at[name]]);
  }

  function sort(name) {
    sorted = { name, down: sorted.name === name ? !sorted.down : NUMBERS.has(name) };
    const k = at[name];
    const sign = sorted.down ? -1 : 1;
    const empty = (value) => value === null || value === "";
    const compare = new Intl.Collator(undefined, { numeric: true }).compare;
    const keys = rows.map((row) => (name === "finding_text" ? (isDone(row) ? LEVELS[levelOf(row)] : 4) : row[k]));
    order = rows.map((_, i) => i).sort((a, b) => {
      const [x, y] = [keys[a], keys[b]];
      if (empty(x) || empty(y)) return empty(x) - empty(y) || a - b;
      return (typeof x === "number" ? sign * (x - y) : sign * compare(x, y)) || a - b;
    });
    filter();
  }

  function filter() {
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
    filtered = order.filter((k) => {
      if (level.value && !(isDone(rows[k]) && levelOf(rows[k]) === level.value)) return false;
      return words.every((word) => texts[k].includes(word));
    });
    shown.textContent = `${filtered.length} of ${rows.length} loops`;
    scroll.scrollTop = 0;
    drawHead();
    draw();
  }

  function drawHead() {
    head.replaceChildren(
      ...SHOWN.map(([name, title, width]) => {
        const cell = document.createElement("th");
        const button = document.createElement("button");
        cell.scope = "col";
        cell.style.width = width;
        cell.className = NUMBERS.has(name) ? "number" : "";
        if (sorted.name === name) cell.setAttribute("aria-sort", sorted.down ? "descending" : "ascending");
        button.type = "button";
        button.textContent = title;
        button.dataset.name = name;
        const arrow = document.createElement("span");
        arrow.className = "arrow";
        arrow.setAttribute("aria-hidden", "true");
        button.append(arrow);
        button.addEventListener("click", () => {
          sort(name);
          head.querySelector(`[data-name="${name}"]`).focus();
        });
        cell.append(button);
        return cell;
      }),
    );
  }

  function space(height) {
    const row = document.createElement("tr");
    row.className = "space";
    row.setAttribute("aria-hidden", "true");
    const cell = row.insertCell();
    cell.colSpan = SHOWN.length;
    cell.style.height = `${height}px`;
    return row;
  }

  function draw() {
    const first = Math.max(0, Math.floor(scroll.scrollTop / rowHeight()) - 8);
    const last = Math.min(filtered.length, first + Math.ceil(scroll.clientHeight / rowHeight()) + 16);
    const drawn = filtered.slice(first, last).map((k, i) => {
      const row = document.createElement("tr");
      row.className = "row";
      row.tabIndex = 0;
      row.dataset.k = k;
      row.setAttribute("aria-rowindex", first + i + 2);
      for (const [name] of SHOWN) {
        const cell = row.insertCell();
        const text = document.createElement("div");
        text.className = "cell-text";
        text.textContent = cellText(rows[k], name);
        cell.append(text);
        cell.className = `${NUMBERS.has(name) ? "number " : ""}${name}${name === "finding_text" ? ` ${levelOf(rows[k])}` : ""}`;
        cell.dataset.head = SHOWN.find((one) => one[0] === name)[1];
        if (text.textContent === "–") cell.dataset.empty = "";
        if (name === "priority") cell.title = rows[k][at.priority_reason];
        else cell.title = text.textContent;
      }
      return row;
    });
    body.replaceChildren(space(first * rowHeight()), ...drawn, space((filtered.length - last) * rowHeight()));
  }

  function open(k) {
    const row = rows[k];
    document.getElementById("details-title").textContent = row[at.tag];
    const [list, more] = [document.createElement("dl"), document.createElement("dl")];
    for (const name of columns) {
      if (["tag", "page", "finding"].includes(name)) continue;
      const term = document.createElement("dt");
      const value = document.createElement("dd");
      term.textContent = TITLES[name] ?? name.replaceAll("_", " ");
      value.textContent = plain(row[columns.length][name] ?? row[at[name]]);
      (name in TITLES ? list : more).append(term, value);
    }
    const fold = document.createElement("details");
    const summary = document.createElement("summary");
    summary.textContent = "All numbers";
    fold.append(summary, more);
    const parts = [list, fold];
    if (row[at.page]) {
      const link = document.createElement("a");
      link.href = `loops/${row[at.page]}.html`;
      link.textContent = "Open the full page of this loop";
      parts.push(link);
    }
    document.getElementById("details-body").replaceChildren(...parts);
    document.getElementById("details").showModal();
  }

  body.addEventListener("click", (event) => {
    const row = event.target.closest("tr.row");
    if (row) open(Number(row.dataset.k));
  });
  body.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target.dataset.k) open(Number(event.target.dataset.k));
    const next = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    if (next && event.target[next]?.dataset.k) {
      event.preventDefault();
      event.target[next].focus();
    }
  });
  let waiting = false;
  scroll.addEventListener("scroll", () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      draw();
    });
  });
  find.addEventListener("input", filter);
  level.addEventListener("change", filter);
  filter();
})();
