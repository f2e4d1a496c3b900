// Chips: a word, a shape and a colour for a verdict, a state or a note.

import { h, svg } from "./dom.js";

const SHAPES = {
  alert: "M6 0 12 11H0z",
  good: "M6 0a6 6 0 1 1 0 12A6 6 0 0 1 6 0z",
  unknown: "M6 0 12 6 6 12 0 6z",
  plain: "M1 1h10v10H1z",
};
export const VERDICTS = { stiction: ["alert", "Stiction"], no_stiction: ["good", "No stiction"], undecided: ["unknown", "Cannot tell"] };
export const STATES = {
  in_control: "in control", manual: "manual", saturated: "at a limit", not_in_command: "not in command", shut_in: "shut in",
  valve_not_responding: "valve does not respond", pv_frozen: "PV frozen", signals_swapped: "signals swapped",
  signals_unrelated: "signals unrelated", bad_data: "bad data",
};
export const STATUSES = { waiting: "Waiting", running: "In work", screened: "Screened only", failed: "Not diagnosed", crashed: "Crashed", error: "Not diagnosed", skipped: "Not judged" };
export const CAUSES = { valve: "valve", tuning: "tuning", external: "external load", sensor: "sensor", dead_zone: "dead zone", none: "none" };

export function chip(kind, text) {
  const shape = svg("svg", { viewBox: "0 0 12 12", "aria-hidden": "true" }, svg("path", { d: SHAPES[kind] }));
  return h("span", { class: `chip chip-${kind}` }, shape, text);
}

/** The chip of a row of the table of loops. */
export function verdictChip(row) {
  const [kind, text] = verdictWord(row);
  return chip(kind, text);
}

/** Shape and word of a row's verdict, or of its status when there is none. */
export function verdictWord(row) {
  return VERDICTS[row.verdict] ?? ["plain", STATUSES[row.status] ?? row.status ?? ""];
}
