"use strict";
(() => {
  const ROW = 30;
  const { columns, rows } = JSON.parse(document.getElementById("data-rows").textContent);
  const at = Object.fromEntries(columns.map((name, k) => [name, k]));
  const SHOWN = [
    ["tag", "Loop", "16%"], ["area", "Area", "9%"], ["verdict", "Verdict", "13%"], ["probability", "Probability", "9%"],
    ["loop_state", "State", "11%"], ["oscillation_cause", "Cause", "9%"], ["S", "S [%]", "7%"],
    ["period_s", "Period", "9%"], ["group", "Group", "6%"], ["priority", "Priority", "8%"], ["label", "Note", "10%"],
  ];
  const NUMBERS = new Set(["probability", "S", "period_s", "group", "priority"]);
  const WORDS = { stiction: "▲ stiction", undecided: "? cannot tell", no_stiction: "● no stiction" };
  const [scroll, head, body, find, verdict, shown] = ["scroll", "head", "body", "find", "verdict", "shown"].map((id) =>
    document.getElementById(id),
  );
  const texts = rows.map((row) =>
    ["tag", "area", "status", "loop_state", "oscillation_cause", "label", "reason"].map((name) => row[at[name]]).join(" ").toLowerCase(),
  );
  let order = rows.map((_, k) => k);
  let sorted = { name: "priority", down: true };
  let filtered = order;

  const plain = (value) => (value === null || value === "" ? "–" : String(value).replaceAll("_", " "));
  const verdictText = (row) => (row[at.status] === "diagnosed" ? WORDS[row[at.verdict]] : plain(row[at.status]));
  function cellText(row, name) {
    if (name === "verdict") return verdictText(row);
    return plain(row[columns.length][name] ?? row[at[name]]);
  }

  function sort(name) {
    sorted = { name, down: sorted.name === name ? !sorted.down : NUMBERS.has(name) };
    const k = at[name];
    const sign = sorted.down ? -1 : 1;
    const empty = (value) => value === null || value === "";
    const compare = new Intl.Collator(undefined, { numeric: true }).compare;
    const keys = rows.map((row) => row[k]);
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
      if (verdict.value && !(rows[k][at.status] === "diagnosed" && rows[k][at.verdict] === verdict.value)) return false;
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
    const first = Math.max(0, Math.floor(scroll.scrollTop / ROW) - 8);
    const last = Math.min(filtered.length, first + Math.ceil(scroll.clientHeight / ROW) + 16);
    const drawn = filtered.slice(first, last).map((k, i) => {
      const row = document.createElement("tr");
      row.className = "row";
      row.tabIndex = 0;
      row.dataset.k = k;
      row.setAttribute("aria-rowindex", first + i + 2);
      for (const [name] of SHOWN) {
        const cell = row.insertCell();
        cell.textContent = cellText(rows[k], name);
        cell.className = NUMBERS.has(name) ? "number" : "";
        if (name === "verdict" && rows[k][at.status] === "diagnosed" && rows[k][at.verdict] === "stiction") cell.className = "stiction";
        if (name === "tag" || name === "label") cell.title = cell.textContent;
      }
      return row;
    });
    body.replaceChildren(space(first * ROW), ...drawn, space((filtered.length - last) * ROW));
  }

  function open(k) {
    const row = rows[k];
    document.getElementById("details-title").textContent = row[at.tag];
    const list = document.createElement("dl");
    for (const name of columns) {
      if (name === "tag" || name === "page") continue;
      const term = document.createElement("dt");
      const value = document.createElement("dd");
      term.textContent = name.replaceAll("_", " ");
      value.textContent = plain(row[columns.length][name] ?? row[at[name]]);
      list.append(term, value);
    }
    const parts = [list];
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
  verdict.addEventListener("change", filter);
  filter();
})();
