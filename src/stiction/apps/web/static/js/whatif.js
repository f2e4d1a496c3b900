// What-if: move the numbers of a loop, and see at once what the loop would do.

import { getJson } from "./api.js";
import { choice, slider } from "./controls.js";
import { h, problem, scrollBox } from "./dom.js";
import { Simulation, getPacked } from "./simulation.js";
import { drawPlots, tableOfCycles } from "./whatif_plots.js";

export const title = "What-if";

const MAIN = { Valve: ["S", "J", "r"], Controller: ["Kc", "Ti", "Td"], Process: ["gain", "tau", "dead_time"] };
const MORE = ["lag", "noise", "duration", "dt", "sp", "op", "op_low", "op_high"];
const ADDRESS_DELAY_MS = 300;
const CYCLES_DELAY_MS = 120;
const ADDRESS_DIGITS = 6;

/** Least upper end of a linear slider, from the loop as it was identified. */
function widestOf(start) {
  const band = Math.max(10, 2 * start.S);
  const pace = Math.max(start.tau, start.dead_time, start.dt);
  return { S: band, J: band, Td: pace, dead_time: pace, lag: pace, noise: Math.max(Math.abs(start.gain) * 0.1, 3 * start.noise) };
}

/** A repaired valve: 0.5 % of deadband and 0.5 % of resolution are left, and no more than half of S. */
function repaired({ S, J }) {
  const part = Math.min(0.5, S / 4);
  const jump = Math.min(J, part);
  return { model: "kano", S: part + jump, J: jump, compensator: "none" };
}

/** The settings in an address: names of the start only, as texts. The server checks their values. */
function valuesOf(query, start) {
  const values = { ...start };
  for (const [name, text] of query) if (name in start) values[name] = typeof start[name] === "number" && text.trim() !== "" && !Number.isNaN(Number(text)) ? Number(text) : text;
  return values;
}

export async function render(root, { query, signal }) {
  const options = await getJson("/api/whatif/options", signal);
  const loop = query.get("key") === null ? null : { set: query.get("set") ?? "", key: query.get("key") };
  const heading = h("h1", {}, "What if?");
  const waiting = h("p", { class: "note" }, loop ? "The loop is identified from its record. This takes some seconds …" : "");
  root.append(heading, waiting);
  const example = { settings: options.example, remarks: [], record: null, sentence: "", tag: "", pv_unit: "" };
  const path = loop && `/api/whatif/start/${encodeURIComponent(loop.set)}/${encodeURIComponent(loop.key)}`;
  const start = loop ? await getPacked(path, signal).finally(() => waiting.remove()) : example;
  waiting.remove();
  if (start.tag) heading.textContent = `What if? ${start.tag}`;
  return drawScreen(root, { options, loop, start, values: valuesOf(query, start.settings) });
}

function drawScreen(root, { options, loop, start, values }) {
  const record = start.record;
  const widest = widestOf(start.settings);
  const answer = h("p", { class: "answer", id: "whatif-answer", role: "status" }, "The simulation is starting …");
  const cyclesText = h("p", { class: "cycles-sentence", role: "status" });
  const cyclesTable = scrollBox("Table of limit cycles");
  const trouble = h("div", { class: "trouble" });
  const plots = drawPlots(record, start.pv_unit, () => cycles);
  const controls = {};
  let cycles = null;

  const setValue = (name) => (value) => {
    values[name] = value;
    if (name === "model") controls.r.show(value === "srinivasan");
    changed();
  };
  const addSlider = (name) =>
    (controls[name] = slider({ name, quantity: options.quantities[name], value: values[name], usual: start.settings[name], widest: widest[name], onInput: setValue(name) })).element;
  controls.model = choice({ name: "model", label: "Valve model", choices: options.models, value: values.model, onInput: setValue("model") });
  controls.compensator = choice({ name: "compensator", label: "Compensator", choices: options.compensators, value: values.compensator, onInput: setValue("compensator") });
  const kinds = { false: "Self-regulating", true: "Integrating (gain per second)" };
  controls.integrating = choice({ name: "integrating", label: "Kind of process", choices: kinds, value: String(values.integrating), onInput: (text) => setValue("integrating")(text === "true") });
  const group = (name, ...children) => h("fieldset", { class: "card controls-group" }, h("legend", {}, name), children);
  const panel = h(
    "form",
    { class: "controls screen-only", "aria-label": "Settings of the loop", onsubmit: (event) => event.preventDefault() },
    group("Valve", controls.model.element, MAIN.Valve.map(addSlider)),
    group("Controller", MAIN.Controller.map(addSlider)),
    group("Process", controls.integrating.element, MAIN.Process.map(addSlider)),
    group("Compensator", controls.compensator.element, h("p", { class: "caption" }, "Its settings follow from S, J and the sampling period.")),
    h("details", { class: "card" }, h("summary", {}, "More settings"), MORE.map(addSlider)),
  );
  controls.r.show(values.model === "srinivasan");

  const simulation = new Simulation("/api/whatif/socket", (text) => showTrouble(text));
  function showTrouble(text) {
    trouble.replaceChildren(...(text ? [problem(text)] : []));
  }
  let addressDelay = 0;
  let cyclesDelay = 0;
  let generation = 0;
  function changed() {
    simulation.ask("trend", values, plots.width(), drawTrend, (text) => {
      showTrouble(text);
      answer.textContent = "These settings cannot be simulated.";
      cyclesText.textContent = "";
      cyclesTable.replaceChildren();
      root.dispatchEvent(new CustomEvent("drawn"));
    });
    cycles = null;
    cyclesText.textContent = "Calculating …";
    clearTimeout(cyclesDelay);
    generation += 1;
    const asked = generation;
    const ifCurrent = (draw) => (found) => asked === generation && draw(found);
    cyclesDelay = setTimeout(() => simulation.ask("cycles", values, 100, ifCurrent(drawCycles), ifCurrent(drawNoCycles)), CYCLES_DELAY_MS);
    clearTimeout(addressDelay);
    addressDelay = setTimeout(writeAddress, ADDRESS_DELAY_MS);
  }
  function writeAddress() {
    const params = new URLSearchParams(loop ?? {});
    for (const [name, value] of Object.entries(values)) params.set(name, typeof value === "number" ? Number(value.toPrecision(ADDRESS_DIGITS)) : value);
    history.replaceState(null, "", `#/whatif?${params}`);
  }
  function drawTrend(trend) {
    showTrouble("");
    answer.textContent = trend.sentence;
    plots.draw(trend, values);
    root.dispatchEvent(new CustomEvent("drawn"));
  }
  function drawCycles(found) {
    cycles = found.cycles;
    cyclesText.textContent = found.sentence;
    cyclesTable.replaceChildren(...(cycles.length ? [tableOfCycles(cycles)] : []));
    plots.redraw();
  }
  /** No prediction; a wrong number is shown once, above the plots. */
  function drawNoCycles(text) {
    const isShown = trouble.textContent === text;
    cyclesText.textContent = isShown ? "" : `No prediction: ${text}`;
    cyclesTable.replaceChildren();
  }
  function setAll(next) {
    for (const [name, value] of Object.entries(next)) {
      values[name] = value;
      controls[name]?.set(name === "integrating" ? String(value) : value);
    }
    controls.r.show(values.model === "srinivasan");
    changed();
  }
  const actions = h(
    "p",
    { class: "row screen-only" },
    h("button", { type: "button", class: "primary", onclick: () => setAll(start.settings) }, loop ? "Reset to identified" : "Reset to the example"),
    h("button", { type: "button", onclick: () => setAll(repaired(start.settings)) }, "Repaired valve"),
    h("button", { type: "button", onclick: (event) => copyAddress(event.target, writeAddress) }, "Copy link"),
  );
  root.append(
    h(
      "div",
      { class: "whatif" },
      h(
        "div",
        { class: "whatif-picture" },
        answer,
        start.sentence ? h("p", { class: "record-sentence" }, h("span", { class: "record-key", "aria-hidden": "true" }), start.sentence) : null,
        start.remarks.map((text) => h("p", { class: "note" }, `As identified: ${text}`)),
        trouble,
        actions,
        h("div", { class: "card whatif-plots" }, plots.elements),
        h("section", { class: "card whatif-far", "aria-label": "Predicted limit cycles" }, h("h2", {}, "Predicted limit cycles"), cyclesText, cyclesTable),
      ),
      panel,
    ),
  );
  const answerSize = new ResizeObserver(() => root.style.setProperty("--answer-height", `${answer.offsetHeight}px`));
  answerSize.observe(answer);
  changed();
  return () => {
    answerSize.disconnect();
    clearTimeout(addressDelay);
    clearTimeout(cyclesDelay);
    simulation.close();
    plots.destroy();
  };
}

async function copyAddress(button, writeAddress) {
  writeAddress();
  try {
    await navigator.clipboard.writeText(location.href);
    button.textContent = "Link copied";
  } catch {
    button.textContent = "Copy the address above";
  }
  setTimeout(() => (button.textContent = "Copy link"), 2000);
}
