// Blocks of a page: the finding, headings, texts, tables, bars and figures, from the plain data that the server sends.

import { chip, VERDICTS } from "./chips.js";
import { h, scrollBox } from "./dom.js";
import { xyPlot } from "./xyplot.js";

const MARKS = { good: ["✓", "good"], alert: ["✗", "alert"], unknown: ["?", "unknown"] };
/** Rows of a table above which it is folded. */
const MAX_OPEN_ROWS = 10;
/** Characters of a text above which its column gets width. */
const LONG_TEXT = 40;

function cell({ text, mark, number }) {
  if (!mark) return h("td", { class: number ? "number" : text.length > LONG_TEXT ? "long" : null }, text);
  const [shape, word] = MARKS[mark];
  return h("td", { class: `mark-${mark}` }, h("span", { "aria-hidden": "true" }, `${shape} `), h("span", { class: "hidden-text" }, `${word}: `), text);
}

function table({ columns, rows, caption }) {
  const numbers = columns.map((_, k) => rows.every((row) => row[k].number));
  const heads = columns.map((text, k) => (text ? h("th", { scope: "col", class: numbers[k] ? "number" : null }, text) : h("td", {})));
  const box = scrollBox(
    caption || "Table",
    h(
      "table",
      {},
      caption ? h("caption", { class: "caption" }, caption) : null,
      h("thead", {}, h("tr", {}, heads)),
      h("tbody", {}, rows.map((row) => h("tr", {}, row.map(cell)))),
    ),
  );
  return rows.length > MAX_OPEN_ROWS ? h("details", { class: "screen-only" }, h("summary", {}, `Show the ${rows.length} rows`), box) : box;
}

function figure(block) {
  const last = block.panels.length - 1;
  const height = Math.max(140, block.height / block.panels.length);
  const plots = block.panels.map((panel, k) =>
    xyPlot({
      title: panel.label ? `${block.title}: ${panel.label}` : block.title,
      curves: panel.series,
      xLabel: k === last ? block.x_label : "",
      yLabel: panel.label,
      height,
      xRange: block.x_range,
      yRange: panel.range,
      shaded: block.shaded,
      sentence: k === last ? block.caption : "",
    }),
  );
  return {
    element: h("div", { class: "report-figure" }, h("h3", {}, block.title), plots.map((plot) => plot.figure)),
    destroy: () => plots.forEach((plot) => plot.destroy()),
  };
}

/** Bars from a line at 0, as a table that a screen reader can read. */
function bars({ title, caption, x_label, names, x, text }) {
  const [low, high] = [Math.min(...x, 0), Math.max(...x, 0)];
  const share = (value) => (value / (high - low || 1)) * 100;
  const zero = share(-low);
  const bar = (value) => {
    const fill = h("span", { class: value >= 0 ? "bar for" : "bar against" });
    fill.style.width = `${share(Math.abs(value))}%`;
    fill.style.left = `${value >= 0 ? zero : zero - share(-value)}%`;
    const line = h("span", { class: "bar-zero" });
    line.style.left = `${zero}%`;
    return h("span", { class: "bar-box", "aria-hidden": "true" }, fill, line);
  };
  const rows = names.map((name, k) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, bar(x[k])), h("td", { class: "number" }, text[k])));
  const head = h("tr", {}, h("td", {}), h("th", { scope: "col", class: "number", colSpan: 2 }, x_label));
  return h("div", { class: "report-figure" }, h("h3", {}, title), h("table", { class: "bars" }, h("thead", {}, head), h("tbody", {}, rows)), h("p", { class: "caption" }, caption));
}

/** The finding on a loop; `tools` are buttons beside its name. */
function headline(block, tools = []) {
  const [kind, word] = VERDICTS[block.verdict];
  return h("header", { class: `card verdict verdict-${block.mark}` },
    h("div", { class: "row" }, h("h1", {}, block.name), chip(kind === "good" ? "plain" : kind, word), tools),
    h("p", { class: "lead" }, `${block.line}.`),
    block.action ? h("p", {}, h("strong", {}, "What to do: "), block.action) : null,
    h("p", { class: "note" }, block.confidence ? `${block.confidence}. ` : "", block.reason),
    h("dl", { class: "facts" }, block.facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))));
}

function definitions({ rows }) {
  return h("table", { class: "definitions" }, h("tbody", {}, rows.map(([name, values]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, values.map((value) => h("div", {}, value)))))));
}

/** Draw one block. Returns {element, destroy()}. */
export function drawBlock(block, tools) {
  const keep = (element) => ({ element, destroy() {} });
  if (block.type === "headline") return keep(headline(block, tools));
  if (block.type === "heading") return keep(h(`h${block.level + 1}`, {}, block.text));
  if (block.type === "text") return keep(h("p", { class: block.kind === "plain" ? null : block.kind }, block.text));
  if (block.type === "definitions") return keep(definitions(block));
  if (block.type === "table") return keep(table(block));
  if (block.type === "bars") return keep(bars(block));
  if (block.type === "figure") return figure(block);
  const parts = block.blocks.map((one) => drawBlock(one));
  const destroy = () => parts.forEach((part) => part.destroy());
  const elements = parts.map((part) => part.element);
  if (block.type === "collapsible") return { element: h("details", {}, h("summary", {}, block.title), elements), destroy };
  return { element: h("div", { class: "columns" }, elements), destroy };
}
