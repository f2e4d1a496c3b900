// Blocks of a report: headings, texts, tables and figures, from the plain data that the server sends.

import { h, scrollBox } from "./dom.js";
import { xyPlot } from "./xyplot.js";

const MARKS = { good: ["✓", "agrees"], alert: ["✗", "differs"], unknown: ["?", "unknown"] };

function cell({ text, mark }) {
  if (!mark) return h("td", {}, text);
  const [shape, word] = MARKS[mark];
  return h("td", { class: `mark-${mark}` }, h("span", { "aria-hidden": "true" }, `${shape} `), h("span", { class: "hidden-text" }, `${word}: `), text);
}

function table({ columns, rows, caption }) {
  return scrollBox(
    caption || "Table",
    h(
      "table",
      {},
      caption ? h("caption", { class: "caption" }, caption) : null,
      h("thead", {}, h("tr", {}, columns.map((text) => (text ? h("th", { scope: "col" }, text) : h("td", {}))))),
      h("tbody", {}, rows.map((row) => h("tr", {}, row.map(cell)))),
    ),
  );
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
    element: h("div", { class: "report-figure" }, h("h4", {}, block.title), plots.map((plot) => plot.figure)),
    destroy: () => plots.forEach((plot) => plot.destroy()),
  };
}

/** Draw one block. Returns {element, destroy()}. */
export function drawBlock(block) {
  const keep = (element) => ({ element, destroy() {} });
  if (block.type === "heading") return keep(h(`h${block.level + 1}`, {}, block.text));
  if (block.type === "text") return keep(h("p", {}, block.text));
  if (block.type === "table") return keep(table(block));
  if (block.type === "figure") return figure(block);
  const parts = block.blocks.map(drawBlock);
  return { element: h("div", { class: "columns" }, parts.map((part) => part.element)), destroy: () => parts.forEach((part) => part.destroy()) };
}
