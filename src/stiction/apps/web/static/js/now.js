// The page "Now": it follows the watch without a reload by hand, and what people do with alarms is sent from it.

import { sendJson } from "./api.js";

const EVERY_MS = 5000;
const main = document.getElementById("main");

async function refresh() {
  const answer = await fetch("/now", { credentials: "same-origin" });
  if (!answer.ok) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.getElementById("main");
  if (fresh && fresh.innerHTML !== main.innerHTML) main.replaceChildren(...fresh.childNodes);
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

setInterval(() => refresh().catch(() => {}), EVERY_MS);
