// A table of any length of which only the rows in view are in the page. Rows are sorted by heading, opened by Enter.

import { h } from "./dom.js";

const ROW_HEIGHT = 72;
const CARD_HEIGHT = 216;
const narrow = matchMedia("(max-width: 700px)");
const rowHeight = () => (narrow.matches ? CARD_HEIGHT : ROW_HEIGHT);
const EXTRA_ROWS = 6;

/**
 * Make a table. `columns` is [{name, label, cell(row) -> Node or text, value(row) -> number, text or null, number, hint}];
 * `open(row)` is called on Enter or a click; `shown(rows)` gets the rows in view after each drawing; `resorted()` is called
 * when the user sorts.
 */
export function virtualTable({ columns, label, open, shown = () => {}, resorted = () => {} }) {
  let rows = [];
  let sortName = null;
  let isDescending = false;
  let active = 0;
  let first = -1;
  let last = -1;
  const buttons = new Map();
  const head = h("tr", {}, columns.map((column) => {
    const button = column.isPicture ? column.label : h("button", { class: "sort", type: "button", title: column.hint ?? null, onclick: () => sortBy(column.name) }, column.label);
    const cell = h("th", { scope: "col", class: column.number ? "number" : null, role: "columnheader" }, button);
    cell.style.width = column.width ?? "";
    if (!column.isPicture) buttons.set(column.name, cell);
    return cell;
  }));
  const above = h("tr", { "aria-hidden": "true", class: "spacer" }, h("td", { colspan: String(columns.length) }));
  const below = h("tr", { "aria-hidden": "true", class: "spacer" }, h("td", { colspan: String(columns.length) }));
  const body = h("tbody", {}, above, below);
  const table = h("table", { class: "virtual", role: "table", "aria-label": label }, h("thead", {}, head), body);
  const element = h("div", { class: "virtual-box", tabindex: "0", role: "region", "aria-label": `${label}: arrow keys move, Enter opens` }, table);
  element.addEventListener("scroll", () => draw(false), { passive: true });
  element.addEventListener("keydown", (event) => {
    if (event.target !== element) return;
    const page = Math.max(1, Math.floor(element.clientHeight / rowHeight()) - 2);
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -rows.length, End: rows.length };
    if (event.key in steps) {
      event.preventDefault();
      move(active + steps[event.key]);
    } else if (event.key === "Enter" && rows[active]) open(rows[active]);
  });
  const watcher = new ResizeObserver(() => draw(false));
  watcher.observe(element);

  function move(to) {
    active = Math.min(Math.max(to, 0), rows.length - 1);
    const top = active * rowHeight();
    const headHeight = table.tHead.offsetHeight;
    if (top < element.scrollTop) element.scrollTop = top;
    else if (top + rowHeight() > element.scrollTop + element.clientHeight - headHeight) element.scrollTop = top + rowHeight() + headHeight - element.clientHeight;
    draw(true);
  }

  function compare(column) {
    const sign = isDescending ? -1 : 1;
    return (one, other) => {
      const a = column.value(one);
      const b = column.value(other);
      if (a === b) return one.key - other.key;
      if (a === null || a === undefined || a === "") return 1;
      if (b === null || b === undefined || b === "") return -1;
      return typeof a === "number" && typeof b === "number" ? sign * (a - b) : sign * collator.compare(String(a), String(b));
    };
  }

  /** Sort a list of rows as the table is sorted. */
  function sorted(list) {
    const column = columns.find((one) => one.name === sortName);
    return column ? list.sort(compare(column)) : list;
  }

  function order() {
    sorted(rows);
    for (const [name, cell] of buttons) cell.setAttribute("aria-sort", name !== sortName ? "none" : isDescending ? "descending" : "ascending");
  }

  /** Sort by a column; a second time the other way round. Numbers begin with the largest. */
  function sortBy(name, descending) {
    const column = columns.find((one) => one.name === name);
    isDescending = descending ?? (name === sortName ? !isDescending : Boolean(column?.number));
    sortName = name;
    order();
    resorted();
    active = 0;
    element.scrollTop = 0;
    draw(true);
  }

  /** Show rows that are in the order of `sorted`. */
  function setRows(next, keepPlace = false) {
    rows = next;
    if (!keepPlace) {
      active = 0;
      element.scrollTop = 0;
    }
    draw(true);
  }

  function draw(isForced) {
    const height = element.clientHeight || 600;
    const from = Math.max(0, Math.floor(element.scrollTop / rowHeight()) - EXTRA_ROWS);
    const to = Math.min(rows.length, from + Math.ceil(height / rowHeight()) + 2 * EXTRA_ROWS);
    if (!isForced && from === first && to === last) return;
    [first, last] = [from, to];
    above.firstChild.style.height = `${from * rowHeight()}px`;
    below.firstChild.style.height = `${(rows.length - to) * rowHeight()}px`;
    const visible = rows.slice(from, to);
    body.replaceChildren(above, ...visible.map((row, k) => drawRow(row, from + k)), below);
    table.setAttribute("aria-rowcount", String(rows.length + 1));
    shown(visible);
  }

  function drawRow(row, index) {
    const line = h("tr", { role: "row", "aria-rowindex": String(index + 2), class: index === active ? "active" : null, onclick: (event) => event.target.closest("a, button") || open(row) },
      columns.map((column) => {
        const content = column.cell(row);
        const cell = h("td", { class: column.number ? "number" : column.className ?? null, role: "cell" }, h("div", { class: "cell-text" }, content));
        if (typeof content === "string" && content.length > 40) cell.title = content;
        if (column.number || column.name === "label") cell.dataset.head = column.label;
        if (content === "" || content === "–") cell.dataset.empty = "";
        return cell;
      }));
    line.dataset.key = row.key;
    return line;
  }

  return { element, setRows, sorted, sortBy, rows: () => rows, redraw: () => draw(true), sorting: () => ({ name: sortName, descending: isDescending }), destroy: () => watcher.disconnect() };
}

const collator = new Intl.Collator("en", { numeric: true, sensitivity: "base" });
