// Notes of a loop: append-only; the newest counts. When another note was saved meanwhile, both texts are shown.

import { ServerError, getJson, sendJson } from "./api.js";
import { announce, clockTime, h, problem } from "./dom.js";

/** The card of notes; `path` is the address of the loop. */
export function notesCard(path, signal) {
  const list = h("ol", { class: "notes" });
  const message = h("div", { "aria-live": "polite" });
  const label = h("select", { name: "label" });
  const text = h("textarea", { name: "note", rows: 2, maxlength: "2000" });
  const author = h("input", { name: "author", type: "text", maxlength: "100", autocomplete: "name", value: localStorage.getItem("author") ?? "" });
  const save = h("button", { class: "primary", type: "submit" }, "Save the note");
  let newestTime = "";
  const form = h("form", { class: "note-form screen-only" },
    h("div", { class: "row" }, h("label", {}, "Mark", label), h("label", {}, "Name", author)), h("label", { class: "wide" }, "Note", text), save);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    send();
  });

  function show(answer) {
    newestTime = answer.newest_time;
    if (!label.options.length) label.append(...answer.labels.map((one) => h("option", { value: one }, one)));
    list.replaceChildren(...answer.notes.map((one) => h("li", {}, h("strong", {}, one.label), one.note ? ` – ${one.note}` : "", h("span", { class: "note" }, ` ${one.author ? `${one.author}, ` : ""}${clockTime(one.time)}`))));
    if (!answer.notes.length) list.replaceChildren(h("li", { class: "note" }, "No note yet."));
    remark.textContent = answer.remark;
  }

  async function send() {
    save.disabled = true;
    localStorage.setItem("author", author.value);
    try {
      show(await sendJson("POST", `${path}/notes`, { label: label.value, note: text.value, author: author.value, newest_time: newestTime }, signal));
      text.value = "";
      message.replaceChildren();
      announce("The note is saved.");
    } catch (error) {
      if (error instanceof ServerError && error.status === 409) showConflict(error.body);
      else message.replaceChildren(problem(error.message));
    }
    save.disabled = false;
  }

  /** Another note was saved meanwhile: show both, and let the user choose. */
  function showConflict({ theirs, yours, newest_time: newest, error }) {
    const line = (who, one) => h("p", {}, h("strong", {}, `${who}: `), one.label, one.note ? ` – ${one.note}` : "", one.author ? ` (${one.author})` : "");
    message.replaceChildren(h("div", { class: "problem", role: "alert" }, h("p", {}, error), line("Saved meanwhile", theirs), line("Yours", yours),
      h("div", { class: "row" },
        h("button", { type: "button", onclick: () => { newestTime = newest; send(); } }, "Save mine too; it counts then"),
        h("button", { type: "button", onclick: async () => { message.replaceChildren(); show(await getJson(`${path}/notes`, signal)); } }, "Keep the other one"))));
  }

  const remark = h("p", { class: "caption screen-only" });
  const card = h("section", { class: "card", "aria-label": "Notes" }, h("h2", {}, "Notes"), list, form, message, remark);
  getJson(`${path}/notes`, signal).then(show).catch((error) => error.name !== "AbortError" && message.replaceChildren(problem(error.message)));
  return card;
}
