// The choice between the open audits and the dropped files.

import { getJson, sendJson } from "./api.js";
import { announce, h } from "./dom.js";

/** The sets that fit, the one that the address names or the first, and an element to choose another. */
export async function setChoice(screen, wanted, signal, fits = () => true) {
  const answer = await getJson("/api/sets", signal);
  const sets = answer.sets.filter(fits);
  const current = sets.find((one) => one.id === wanted) ?? sets[0] ?? null;
  const select = h("select", { "aria-label": "Set of loops", onchange: () => (location.hash = `#/${screen}/${select.value}`) },
    sets.map((one) => h("option", { value: one.id, selected: one === current }, one.name)));
  const chosen = sets.length > 1 ? select : h("span", { class: "note" }, current?.name ?? "");
  const element = h("span", { class: "row" }, chosen, openAudit(screen, current, answer.closed));
  return { element, current, sets };
}

/** A choice of the audits beside the open ones; the one that is chosen is opened. */
function openAudit(screen, current, closed) {
  if (!closed.length) return null;
  const choice = h("select", { "aria-label": "Open another audit", onchange: async () => {
    try {
      const opened = await sendJson("POST", "/api/sets", { name: choice.value });
      location.hash = screen === "compare" && current ? `#/compare/${current.id}/${opened.id}` : `#/${screen}/${opened.id}`;
    } catch (error) {
      choice.selectedIndex = 0;
      choice.title = error.message;
      announce(error.message);
    }
  } }, h("option", { value: "" }, "Open another audit …"), closed.map((name) => h("option", { value: name }, name)));
  return choice;
}
