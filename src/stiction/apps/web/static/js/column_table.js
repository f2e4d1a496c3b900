// The table in which the loop, the role and the unit of each column can be corrected.

import { h, svg } from "./dom.js";

const ROLES = [["", "not used"], ["pv", "PV (process variable)"], ["op", "OP (controller output)"], ["sp", "SP (set point)"], ["mv", "valve position"], ["mode", "mode"], ["bad", "bad status"], ["quality", "quality"], ["valve_signal", "signal to the valve"]];
const SHOWN = 150;
const WIDTH = 130;
const HEIGHT = 30;

/** A small line; gaps stay gaps. `label` is for screen readers; with `half` the scale goes from -half to +half. */
export function sparkline(values, label, width = WIDTH, height = HEIGHT, half = 0) {
  const known = (values ?? []).filter((value) => value !== null);
  if (!known.length) return h("span", { class: "note" }, "no numbers");
  const low = half ? -half : Math.min(...known);
  const range = half ? 2 * half : Math.max(...known) - low || 1;
  let path = "";
  let isDown = false;
  values.forEach((value, k) => {
    if (value === null) isDown = false;
    else {
      const x = 1 + (k / Math.max(1, values.length - 1)) * (width - 2);
      const level = Math.min(1, Math.max(0, (value - low) / range));
      path += `${isDown ? "L" : "M"}${x.toFixed(1)} ${(height - 2 - level * (height - 4)).toFixed(1)}`;
      isDown = true;
    }
  });
  return svg("svg", { class: "spark", viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": label }, svg("path", { d: path }));
}

/** The table of columns. `rows()` gives all columns as they are now. */
export function columnTable(columns) {
  const rows = columns.map((column) => ({ ...column }));
  const body = h("tbody", {});
  const count = h("span", { class: "note" });
  const filter = h("input", { type: "search", "aria-label": "Filter the columns", placeholder: "Filter", oninput: draw });
  const field = (row, name, label, size) =>
    h("input", { type: "text", size, value: String(row[name] ?? ""), "aria-label": `${label} of ${row.tag}`, onchange: (event) => (row[name] = event.target.value) });

  function draw() {
    const wanted = filter.value.trim().toLowerCase();
    const matching = rows.filter((row) => !wanted || `${row.tag} ${row.description} ${row.loop}`.toLowerCase().includes(wanted));
    count.textContent = matching.length > SHOWN ? `${SHOWN} of ${matching.length} columns are shown; type a part of a name.` : "";
    body.replaceChildren(
      ...matching.slice(0, SHOWN).map((row) => {
        const role = h("select", { "aria-label": `Role of ${row.tag}`, onchange: () => (row.role = role.value) }, ROLES.map(([value, text]) => h("option", { value }, text)));
        if (!ROLES.some(([value]) => value === row.role)) role.append(h("option", { value: row.role }, row.role));
        role.value = row.role ?? "";
        return h("tr", {},
          h("td", {}, row.tag || "(no heading)", row.description ? h("div", { class: "note" }, row.description) : null),
          h("td", {}, sparkline(row.preview, `Preview of ${row.tag}`)),
          h("td", {}, field(row, "loop", "Loop", 14)),
          h("td", {}, role),
          h("td", {}, field(row, "unit", "Unit", 8)),
          h("td", {}, field(row, "low", "Value at 0 %", 6)),
          h("td", {}, field(row, "high", "Value at 100 %", 6)));
      }),
    );
  }
  draw();
  const heads = ["Column", "Preview", "Loop", "Role", "Unit", "At 0 %", "At 100 %"];
  const table = h("table", {}, h("thead", {}, h("tr", {}, heads.map((head) => h("th", { scope: "col" }, head)))), body);
  const tools = columns.length > 12 ? [h("div", { class: "row" }, filter, count)] : [];
  const element = h("div", {}, ...tools, h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Columns" }, table));
  const plain = ({ preview, description, ...row }) => Object.fromEntries(Object.entries(row).map(([name, value]) => [name, String(value ?? "")]));
  return { element, rows: () => rows.map(plain) };
}
