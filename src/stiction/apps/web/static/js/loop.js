// Loop: the finding first, then trends, and the sections of the report, with remedies and notes.

import { fetchFile, getJson, saveFile } from "./api.js";
import { h, problem } from "./dom.js";
import { notesCard } from "./notes.js";
import { drawBlock } from "./report_blocks.js";
import { trendPlots } from "./trend_plots.js";

export const title = "Loop";
/** Sections that are printed; the others are in the report. */
const PRINTED = ["Trends", "Why this verdict", "Valve and process"];

export async function render(root, { parts: [set, key], signal }) {
  const path = `/api/sets/${encodeURIComponent(set)}/loops/${encodeURIComponent(key)}`;
  root.append(h("p", { class: "note", role: "status" }, "The loop is being diagnosed …"));
  const loop = await getJson(path, signal);
  document.title = `${loop.tag} · stiction`;
  const drawn = [];
  const draw = (block, tools) => {
    drawn.push(drawBlock(block, tools));
    return drawn.at(-1).element;
  };
  const print = h("button", { class: "screen-only print", onclick: () => window.print() }, "Print");
  const plots = h("div", {}, h("p", { class: "note" }, "Loading …"));
  root.replaceChildren(
    h("nav", { class: "screen-only", "aria-label": "Back" }, h("a", { href: `#/loops/${set}` }, "← All loops")),
    draw(loop.headline, [print]),
    card("Trends", loop.trends.map((block) => draw(block)), plots));
  const extras = { "Valve and process": () => remedies(set, key, path, draw), Origin: () => report(path) };
  for (const { title: name, blocks } of loop.sections) root.append(card(name, blocks.map((block) => draw(block)), extras[name]?.()));
  root.append(notesCard(path, signal));
  try {
    const trends = await trendPlots(`${path}/trend`, loop.stretches, signal, loop.diagnosis?.oscillation?.oscillating ? loop.diagnosis.oscillation.period_s : null);
    drawn.push(trends);
    plots.replaceChildren(trends.element);
    await trends.open();
  } catch (error) {
    if (error.name === "AbortError") return null;
    plots.replaceChildren(problem(error.message));
  }
  return () => drawn.forEach((one) => one.destroy());
}

function card(name, ...content) {
  return h("section", { class: PRINTED.includes(name) ? "card" : "card not-printed", "aria-label": name }, h("h2", {}, name), content);
}

/** A button that does some work and shows what comes of it below. */
function workButton(text, waiting, work) {
  const result = h("div", { "aria-live": "polite" });
  const button = h("button", {}, text);
  button.addEventListener("click", async () => {
    button.disabled = true;
    result.replaceChildren(h("p", { class: "note" }, waiting));
    try {
      result.replaceChildren(...(await work()));
    } catch (error) {
      result.replaceChildren(problem(error.message));
    }
    button.disabled = false;
  });
  return [button, result];
}

function remedies(set, key, path, draw) {
  const [button, result] = workButton("Compare repair, retuning and compensation", "The remedies are simulated; this takes some seconds …", async () => {
    const { blocks } = await getJson(`${path}/remedies`);
    return blocks.map((block) => draw(block));
  });
  const whatif = h("a", { class: "button", href: `#/whatif?set=${encodeURIComponent(set)}&key=${encodeURIComponent(key)}` }, "Try it: what if?");
  return [h("div", { class: "row screen-only" }, whatif, button), result];
}

function report(path) {
  const [button, result] = workButton("Save the full report (HTML)", "The report is being written …", async () => {
    saveFile(await fetchFile("GET", `${path}/report`));
    return [h("p", { class: "note" }, "The report opens in a browser without this server.")];
  });
  return [h("div", { class: "row screen-only" }, button), result];
}
