// The choice between the open audits and the dropped files.

import { getJson } from "./api.js";
import { h } from "./dom.js";

/** The sets that fit, the one that the address names or the first, and an element to choose another. */
export async function setChoice(screen, wanted, signal, fits = () => true) {
  const sets = (await getJson("/api/sets", signal)).sets.filter(fits);
  const current = sets.find((one) => one.id === wanted) ?? sets[0] ?? null;
  const select = h("select", { "aria-label": "Set of loops", onchange: () => (location.hash = `#/${screen}/${select.value}`) },
    sets.map((one) => h("option", { value: one.id, selected: one === current }, one.name)));
  const element = sets.length > 1 ? select : h("span", { class: "note" }, current?.name ?? "");
  return { element, current, sets };
}
