// Compare: what is new, worse, same, better and gone since another audit.

import { getJson } from "./api.js";
import { chip } from "./chips.js";
import { clockTime, h, number, svg } from "./dom.js";
import { setChoice } from "./set_choice.js";

export const title = "Compare";
const CHANGES = { new: ["alert", "New"], worse: ["alert", "Worse"], same: ["unknown", "Same"], better: ["good", "Better"], gone: ["good", "Gone"] };
const SHOWN = 500;
const WIDTH = 120;
const HEIGHT = 26;

export async function render(root, { parts, signal }) {
  root.append(h("h1", {}, "Compare"));
  const { element, current, sets } = await setChoice("compare", parts[0], signal, (one) => one.is_audit);
  const others = sets.filter((one) => one !== current);
  if (!others.length) {
    root.append(element, h("p", {}, "A comparison needs two audits. Open another one above, or start the server with both: ", h("code", {}, "stiction serve AUDIT EARLIER_AUDIT"), "."));
    return null;
  }
  const other = others.find((one) => one.id === parts[1]) ?? others[0];
  const choice = h("select", { "aria-label": "Earlier audit", onchange: () => (location.hash = `#/compare/${current.id}/${choice.value}`) }, others.map((one) => h("option", { value: one.id, selected: one === other }, one.name)));
  root.append(h("div", { class: "row tools" }, element, h("span", {}, "against"), choice));
  const { rows, started, started_before: before } = await getJson(`/api/sets/${current.id}/compare/${other.id}`, signal);
  const count = (change) => rows.filter((row) => row.change === change).length;
  const filter = h("select", { "aria-label": "Change" }, h("option", { value: "" }, "All changes"), Object.entries(CHANGES).map(([name, [, word]]) => h("option", { value: name }, word)));
  const body = h("tbody", {});
  const largest = 1.05 * Math.max(1e-9, ...rows.flatMap((row) => [row.S, row.S_high, row.S_before, row.S_high_before]).filter(Number.isFinite));
  const draw = () => body.replaceChildren(...rows.filter((row) => !filter.value || row.change === filter.value).slice(0, SHOWN).map((row) => line(row, current.id, largest)));
  filter.addEventListener("change", draw);
  draw();
  const heads = ["Loop", "Change", "Why", "Before", "Now", "S before", "S now", `S with its 95 % interval, 0 to ${number(largest, "%")}`, "Priority before", "Priority now"];
  root.append(
    h("p", { class: "lead" }, Object.entries(CHANGES).map(([name, [, word]]) => `${count(name)} ${word.toLowerCase()}`).join(", ") + "."),
    h("p", { class: "note" }, `Audit of ${day(started)} against the one of ${day(before)}. Loops without a finding in both are not listed.`),
    h("div", { class: "row tools" }, filter),
    h("div", { class: "scroll card", tabindex: "0", role: "region", "aria-label": "Changes" },
      h("table", {}, h("thead", {}, h("tr", {}, heads.map((head, k) => h("th", { scope: "col", class: [5, 6, 8, 9].includes(k) ? "number" : null }, head)))), body)));
  if (rows.length > SHOWN) root.append(h("p", { class: "note" }, `The first ${SHOWN} of ${rows.length} are shown; choose a change.`));
  return null;
}

const priority = (value) => (Number.isFinite(value) ? value.toFixed(2) : "–");
const day = (text) => (text ? clockTime(text) : "unknown date");

function line(row, setId, largest) {
  return h("tr", {},
    h("td", { class: "tag" }, row.key === null ? row.tag : h("a", { href: `#/loop/${setId}/${row.key}` }, row.tag)),
    h("td", {}, chip(...CHANGES[row.change])), h("td", {}, row.why), h("td", {}, row.finding_text_before || "–"), h("td", {}, row.finding_text || "–"),
    h("td", { class: "number" }, number(row.S_before, "%", 2)), h("td", { class: "number" }, number(row.S, "%", 2)), h("td", {}, intervals(row, largest)),
    h("td", { class: "number" }, priority(row.priority_before)), h("td", { class: "number" }, priority(row.priority)));
}

/** S before (above) and now (below) with their intervals; all rows have one scale, from 0 to `largest`. */
function intervals(row, largest) {
  const pairs = [[row.S_before, row.S_low_before, row.S_high_before], [row.S, row.S_low, row.S_high]];
  if (pairs.every(([S]) => S === null || S === undefined)) return "–";
  const x = (value) => ((value / largest) * (WIDTH - 8) + 4).toFixed(1);
  const marks = pairs.flatMap(([S, low, high], k) => {
    if (S === null || S === undefined) return [];
    const y = k === 0 ? 8 : 18;
    const bar = low === null || low === undefined ? [] : [svg("line", { x1: x(low), x2: x(high), y1: y, y2: y })];
    return [...bar, svg("circle", { cx: x(S), cy: y, r: 3.5, class: k === 0 ? "before" : "now" })];
  });
  return svg("svg", { class: "intervals", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, width: WIDTH, height: HEIGHT, role: "img", "aria-label": `S before ${number(row.S_before, "%")}, now ${number(row.S, "%")}` }, ...marks);
}
