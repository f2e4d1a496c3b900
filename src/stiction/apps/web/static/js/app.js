// Start of the page: sign in, draw the menu, open the screen that the address names.

import { ServerError, getJson, signIn } from "./api.js";
import { announce, h, problem } from "./dom.js";
import { SCREENS } from "./screens.js";

const main = document.getElementById("main");
const menu = document.getElementById("menu");
let cleanUp = null;
let opening = null;
let beginning = { screen: "drop", watch: false };

/** The screen, the parts of the path after it, and the query of an address such as #/loop/12?from=0. */
function parseAddress() {
  const [path, query = ""] = location.hash.replace(/^#\/?/, "").split("?", 2);
  const [name, ...parts] = path.split("/").map(decodeURIComponent);
  return { name, parts, query: new URLSearchParams(query) };
}

function drawMenu(current) {
  menu.replaceChildren(
    ...SCREENS.filter((one) => one.menu !== false).map((one) =>
      h("a", { href: `#/${one.name}`, "aria-current": one.name === current ? "page" : null }, one.label),
    ),
    ...(beginning.watch ? [h("a", { href: "/now" }, "Now")] : []),
  );
}

async function openScreen() {
  opening?.abort();
  opening = new AbortController();
  const { signal } = opening;
  const address = parseAddress();
  let { name } = address;
  if (!name) {
    location.replace(`#/${beginning.screen}`);
    return;
  }
  const screen = SCREENS.find((one) => one.name === name);
  drawMenu(name);
  await cleanUp?.();
  cleanUp = null;
  if (!screen) {
    main.replaceChildren(problem(`There is no screen "${name}". Choose one from the menu.`));
    return;
  }
  const root = h("div", { class: `screen screen-${name}` });
  try {
    const page = await import(screen.module);
    if (signal.aborted) return;
    main.replaceChildren(root);
    document.title = `${page.title} · stiction`;
    cleanUp = (await page.render(root, { parts: address.parts, query: address.query, signal })) ?? null;
    if (signal.aborted) await cleanUp?.();
    else announce(`${page.title} is shown.`);
  } catch (error) {
    if (error.name === "AbortError" || signal.aborted) return;
    if (!(error instanceof ServerError)) console.error(error);
    main.replaceChildren(root);
    root.append(problem(error.message));
  }
}

async function start() {
  try {
    if (!(await signIn())) {
      main.replaceChildren(
        problem("This browser is not signed in. Open the address that stiction serve printed, with its #token."),
      );
      return;
    }
  } catch (error) {
    main.replaceChildren(problem(error.message));
    return;
  }
  beginning = await getJson("/api/start").catch(() => beginning);
  window.addEventListener("hashchange", openScreen);
  document.querySelector(".skip").addEventListener("click", (event) => {
    event.preventDefault();
    main.focus();
  });
  await openScreen();
}

start();
