// The page "Now": it is loaded anew when the watch has news, and what people do with alarms is sent from it.

import { sendJson } from "./api.js";

const EVERY_MS = 5000;
const main = document.getElementById("main");

let shown = null;

/** Load the page anew where the server has another one; no script makes markup from text. */
async function refresh() {
  const answer = await fetch("/now", { credentials: "same-origin" });
  if (!answer.ok) return;
  const text = await answer.text();
  if (shown !== null && text !== shown) window.location.reload();
  shown = text;
}

main.addEventListener("click", async (event) => {
  const alarm = event.target.dataset?.alarm;
  if (!alarm) return;
  const { action } = event.target.dataset;
  const until = action === "shelve" ? window.prompt("Shelve until (YYYY-MM-DD)") : "";
  const text = action === "comment" ? window.prompt("Comment") : "";
  if (until === null || text === null) return;
  const who = window.prompt("Your name", window.localStorage.getItem("author") ?? "");
  if (!who) return;
  window.localStorage.setItem("author", who);
  try {
    await sendJson("POST", "/now", { alarm, action, who, until, text });
  } catch (error) {
    window.alert(error.message);
  }
  await refresh();
});

refresh().catch(() => {});
setInterval(() => refresh().catch(() => {}), EVERY_MS);
