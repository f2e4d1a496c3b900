// The page "Now": it follows the watch without a reload by hand, and acknowledges alarms.

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
  const who = window.prompt("Your name", window.localStorage.getItem("author") ?? "");
  if (!who) return;
  window.localStorage.setItem("author", who);
  await sendJson("POST", "/now", { alarm, who });
  await refresh();
});

setInterval(() => refresh().catch(() => {}), EVERY_MS);
