// What-if: move the numbers of a loop, and see at once what the loop would do.

import { getJson } from "./api.js";
import { choice, shortNumber, slider } from "./controls.js";
import { h, number, problem } from "./dom.js";
import { color, linePlot } from "./plots.js";
import { Simulation, getPacked } from "./simulation.js";

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
  const cyclesTable = h("div", { class: "scroll" });
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
  const kinds = { false: "Self-regulating", true: "Integrating" };
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
    cyclesDelay = setTimeout(() => simulation.ask("cycles", values, 100, drawCycles, drawNoCycles), CYCLES_DELAY_MS);
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
  function drawCycles(found, newerAsked) {
    if (newerAsked) return;
    cycles = found.cycles;
    cyclesText.textContent = found.sentence;
    cyclesTable.replaceChildren(...(cycles.length ? [tableOfCycles(cycles)] : []));
    plots.redraw();
  }
  /** No prediction; a wrong number is told once, above the plots. */
  function drawNoCycles(text) {
    const told = trouble.textContent === text;
    cyclesText.textContent = told ? "" : `No prediction: ${text}`;
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
    h("button", { type: "button", onclick: () => setAll({ model: "kano", S: Math.min(1, start.settings.S / 2), J: Math.min(0.5, start.settings.S / 4), compensator: "none" }) }, "Repaired valve"),
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
        start.remarks.map((text) => h("p", { class: "note" }, text)),
        trouble,
        actions,
        h("div", { class: "card" }, plots.elements),
        h("section", { class: "card", "aria-label": "Predicted limit cycles" }, h("h2", {}, "Predicted limit cycles"), cyclesText, cyclesTable),
      ),
      panel,
    ),
  );
  changed();
  return () => {
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

/** PV and OP over time, the record in grey behind, and lines at the amplitude of each stable limit cycle. */
function drawPlots(record, pvUnit, cyclesOf) {
  let middle = { pv: 0, op: 0 };
  const common = (name) => ({
    xLabel: "Time [s]",
    sync: "whatif",
    yRange: (_, low, high) => withRecord(low, high, record?.[name]),
    draw: (plot) => {
      drawRecord(plot, record, name);
      drawAmplitudes(plot, cyclesOf(), middle[name], name === "pv" ? "amplitude_pv" : "amplitude_op");
    },
  });
  const ghost = record ? [{ label: "Record", kind: "ghost", stroke: () => color("ghost") }] : [];
  const pv = linePlot({ ...common("pv"), title: "PV over time", yLabel: `PV [${pvUnit || "PV units"}]`, height: 250, data: [[0, 1], [null, null], [null, null], ...ghost.map(() => [null, null])], series: [{ label: "Set point", kind: "sp" }, { label: "PV, simulated", kind: "pv", width: 2 }, ...ghost] });
  const op = linePlot({ ...common("op"), title: "OP and valve position over time", yLabel: "OP [% of span]", height: 270, data: [[0, 1], [null, null], [null, null], ...ghost.map(() => [null, null])], series: [{ label: "OP (controller output)", kind: "op", width: 2 }, { label: "Valve position", kind: "mv", width: 2 }, ...ghost] });
  return {
    elements: [h("h2", {}, "Process variable"), pv.figure, h("h2", {}, "Controller output and valve position"), op.figure],
    width: () => pv.figure.clientWidth || 800,
    draw(trend, values) {
      middle = { pv: values.sp, op: trend.op_swing.middle };
      const empty = record ? [new Array(trend.time.length).fill(null)] : [];
      pv.setData([trend.time, new Float32Array(trend.time.length).fill(values.sp), trend.pv, ...empty]);
      op.setData([trend.time, trend.op, trend.mv, ...empty]);
      const grey = record ? " Grey: the record." : "";
      pv.setSentence(`PV moves between ${ends(trend.pv_swing)} about the set point of ${shortNumber(values.sp)}.${grey}`);
      op.setSentence(`OP moves between ${ends(trend.op_swing)} %; the valve position stays where it is until OP has moved far enough.${grey}`);
    },
    redraw() {
      pv.plot?.redraw(false);
      op.plot?.redraw(false);
    },
    destroy() {
      pv.destroy();
      op.destroy();
    },
  };
}

const ends = (swing) => [swing.middle - swing.amplitude, swing.middle + swing.amplitude].map((value) => Number(value.toPrecision(4))).join(" and ");

/** Range of the y axis that holds the simulated signal and the record. */
function withRecord(low, high, recorded) {
  if (low === null || low === undefined) [low, high] = [0, 1];
  if (recorded) for (const value of recorded) if (value < low) low = value; else if (value > high) high = value;
  const room = 0.08 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

function drawRecord(plot, record, name) {
  if (!record?.[name]) return;
  const context = plot.ctx;
  context.save();
  context.globalCompositeOperation = "destination-over";
  context.beginPath();
  context.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height);
  context.clip();
  context.beginPath();
  let open = false;
  for (let k = 0; k < record.time.length; k += 1) {
    const value = record[name][k];
    if (Number.isNaN(value)) open = false;
    else {
      const [x, y] = [plot.valToPos(record.time[k], "x", true), plot.valToPos(value, "y", true)];
      if (open) context.lineTo(x, y);
      else context.moveTo(x, y);
      open = true;
    }
  }
  context.strokeStyle = color("ghost");
  context.lineWidth = 2.5 * devicePixelRatio;
  context.stroke();
  context.restore();
}

/** Dotted lines at the highest and lowest value of each stable limit cycle. */
function drawAmplitudes(plot, cycles, middle, name) {
  if (!cycles) return;
  const context = plot.ctx;
  const { left, top, width, height } = plot.bbox;
  context.save();
  context.strokeStyle = color("model");
  context.lineWidth = devicePixelRatio;
  context.setLineDash([2 * devicePixelRatio, 5 * devicePixelRatio]);
  for (const cycle of cycles.filter((one) => one.kind === "cycle" && one.stable)) {
    for (const sign of [-1, 1]) {
      const y = plot.valToPos(middle + sign * cycle[name], "y", true);
      if (y < top || y > top + height) continue;
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(left + width, y);
      context.stroke();
    }
  }
  context.restore();
}

const SHAPES = { stable: "●", unstable: "○", boundary: "×" };

function tableOfCycles(cycles) {
  const rows = cycles.map((cycle) => {
    const kind = cycle.kind === "boundary" ? "boundary" : cycle.stable ? "stable" : "unstable";
    return h(
      "tr",
      {},
      h("td", {}, h("span", { "aria-hidden": "true" }, `${SHAPES[kind]} `), kind),
      h("td", { class: "number" }, `${shortNumber(cycle.period_s)} s`),
      h("td", { class: "number" }, number(cycle.amplitude_op, "%")),
      h("td", { class: "number" }, number(cycle.amplitude_pv)),
      h("td", {}, cycle.exact ? "exact" : "describing function"),
    );
  });
  const head = ["Limit cycle", "Period", "OP amplitude", "PV amplitude", "Solved by"].map((text, k) => h("th", { scope: "col", class: k > 0 && k < 4 ? "number" : null }, text));
  return h(
    "table",
    {},
    h("caption", { class: "caption" }, "A stable limit cycle lasts; from an unstable one or a boundary the loop moves to a stable one or to rest. Dotted lines in the plots: the amplitude of the stable ones."),
    h("thead", {}, h("tr", {}, head)),
    h("tbody", {}, rows),
  );
}
