// Textbook: what sticky valves do, and why loops cycle.

import { getJson } from "./api.js";
import { choice, slider } from "./controls.js";
import { h, problem, scrollBox } from "./dom.js";
import { drawBlock } from "./report_blocks.js";
import { Simulation } from "./simulation.js";
import { xyPlot } from "./xyplot.js";

export const title = "Textbook";

/** Settings of the sections where they differ from the paper's example. */
const STARTS = { ramp: { S: 5, J: 2, r: 0.5, rate: 0.2, height: 20 }, loop: {}, jump: {} };
const WIDEST = {
  ramp: { S: 10, J: 10, height: 40 },
  loop: { S: 2, J: 2, amplitude: 2, dead_time: 4 },
  jump: { pulse: 4, length: 20 },
};
const STEMS = {
  Ideal: ["sp", "dash"],
  "Stenman (one parameter)": ["violet", "dashdot"],
  "Kano, Choudhury (S, J)": ["mv", "solid"],
  "He (fs, fd)": ["pv", "longdash"],
  "Three parameters (eq. 5)": ["alert", "dash"],
  "Physical (Table I)": ["ochre", "dot"],
};
const SHOWN_AT_FIRST = ["Kano, Choudhury (S, J)", "He (fs, fd)", "Physical (Table I)"];
const PAPER = "Issues in Modeling Stiction in Process Control Valves, R. Srinivasan, R. Rengaswamy, U. Nallasivam, V. Rajavelu, American Control Conference, 2008";
const ADDRESS_DELAY_MS = 300;
const PIXELS_PER_E = 180;

export async function render(root, { query, signal }) {
  const options = await getJson("/api/textbook/options", signal);
  const trouble = h("div", { class: "trouble" });
  const simulation = new Simulation("/api/textbook/socket", showTrouble);
  function showTrouble(text) {
    trouble.replaceChildren(...(text ? [problem(text)] : []));
  }
  const settings = Object.fromEntries(Object.keys(STARTS).map((section) => [section, { ...options.example, ...STARTS[section] }]));
  for (const [key, text] of query) {
    const [section, name] = key.split(".", 2);
    if (name in (settings[section] ?? {})) settings[section][name] = text.trim() !== "" && !Number.isNaN(Number(text)) ? Number(text) : text;
  }
  let delay = 0;
  const context = {
    options,
    simulation,
    settings,
    ask: (kind, section, width, onAnswer) =>
      simulation.ask(kind, settings[section], width, (answer, newerAsked) => {
        showTrouble("");
        onAnswer(answer, newerAsked);
        root.dispatchEvent(new CustomEvent("drawn", { detail: kind }));
      }, showTrouble),
    changed() {
      clearTimeout(delay);
      delay = setTimeout(() => history.replaceState(null, "", `#/textbook?${addressOf(settings, options)}`), ADDRESS_DELAY_MS);
    },
  };
  root.append(
    h("h1", {}, "Textbook: sticky valves and the oscillations that they cause"),
    h("p", {}, `After “${PAPER}”. Every curve is computed as you move the sliders; stiction paper shows the tables and figures of the paper.`),
    trouble,
  );
  const sections = [rampSection(context), loopSection(context), jumpSection(context)];
  root.append(...sections.map((one) => one.element));
  for (const one of sections) one.start();
  return () => {
    clearTimeout(delay);
    simulation.close();
    for (const one of sections) one.destroy();
  };
}

/** The settings that differ from where the screen starts. */
function addressOf(settings, options) {
  const params = new URLSearchParams();
  for (const [section, values] of Object.entries(settings))
    for (const [name, value] of Object.entries(values)) if (value !== { ...options.example, ...STARTS[section] }[name]) params.set(`${section}.${name}`, value);
  return params;
}

function sliders(context, section, names, onChange) {
  const controls = {};
  for (const name of names)
    controls[name] = slider({
      name: `${section}-${name}`,
      quantity: context.options.quantities[name],
      value: context.settings[section][name],
      usual: { ...context.options.example, ...STARTS[section] }[name],
      widest: WIDEST[section][name],
      onInput(value) {
        context.settings[section][name] = value;
        context.changed();
        onChange(name);
      },
    });
  return controls;
}

const elements = (controls) => Object.values(controls).map((one) => one.element);

function section(heading, text, picture, controls) {
  return h(
    "section",
    { class: "card textbook-section" },
    h("h2", {}, heading),
    h("p", {}, text),
    h("div", { class: "textbook-columns" }, h("div", { class: "textbook-picture" }, picture), h("form", { class: "controls screen-only", "aria-label": `Settings: ${heading}`, onsubmit: (event) => event.preventDefault() }, controls)),
  );
}

/** Every valve model under the same ramp; drag the ramp to change its rate and height. */
function rampSection(context) {
  const values = context.settings.ramp;
  const shown = new Set(SHOWN_AT_FIRST);
  let answer = null;
  const ask = () => context.ask("ramp", "ramp", time.figure.clientWidth || 600, draw);
  const controls = sliders(context, "ramp", ["S", "J", "r", "rate", "height"], ask);
  const time = xyPlot({ title: "OP and valve position over time", curves: [], xLabel: "Time [s]", yLabel: "% of span", height: 330, onDrag: dragRamp, sentence: "Drag the ramp: up and down for its height, left and right for its rate." });
  const signature = xyPlot({ title: "Valve position over OP", curves: [], xLabel: "OP (controller output) [% of span]", yLabel: "Valve position [% of span]", height: 330, sentence: "The signature of each model: the width of the loop is S, and a step is a slip jump." });
  const rows = h("tbody", {});
  function dragRamp(dx, dy, plot) {
    const { low, high } = context.options.quantities.height;
    const perPixel = (plot.scales.y.max - plot.scales.y.min) / plot.over.clientHeight;
    values.height = Number(Math.min(high, Math.max(low, values.height - dy * perPixel)).toPrecision(4));
    values.rate = Number((values.rate * Math.exp(-dx / PIXELS_PER_E)).toPrecision(4));
    controls.height.set(values.height);
    controls.rate.set(values.rate);
    context.changed();
    ask();
  }
  function draw(next) {
    const names = answer ? Object.keys(answer.position) : [];
    answer = next;
    if (names.join() !== Object.keys(next.position).join()) fillRows();
    for (const [name, text] of Object.entries(next.behaviour)) rows.querySelector(`[data-model="${CSS.escape(name)}"]`).textContent = text;
    drawCurves();
  }
  function drawCurves() {
    const stems = Object.entries(answer.position).filter(([name]) => shown.has(name));
    const line = ([name, mv], x) => ({ name, x, y: mv, color: STEMS[name][0], dash: STEMS[name][1], width: 2 });
    time.setCurves([{ name: "OP", x: answer.time, y: answer.op, color: "op", width: 1.5 }, ...stems.map((one) => line(one, answer.time))]);
    signature.setCurves(stems.map((one) => line(one, answer.op)));
  }
  function fillRows() {
    rows.replaceChildren(
      ...Object.keys(answer.position).map((name) => {
        const box = h("input", { type: "checkbox", checked: shown.has(name), onchange: (event) => (event.target.checked ? shown.add(name) : shown.delete(name), drawCurves()) });
        return h("tr", {}, h("td", {}, h("label", { class: "check" }, box, name)), h("td", { "data-model": name }));
      }),
    );
  }
  const table = h("table", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Model (shown)"), h("th", { scope: "col" }, "What it does on the rising ramp"))), rows);
  const element = section(
    "A valve under a ramp",
    "All models have the same S and J. A slow ramp shows which of them go in stairs, a fast one which of them follow.",
    [h("div", { class: "columns" }, time.figure, signature.figure), scrollBox("What each model does", table)],
    elements(controls),
  );
  return { element, start: ask, destroy: () => (time.destroy(), signature.destroy()) };
}

/** The describing function of a valve, and the Nyquist plot with the limit cycles. */
function loopSection(context) {
  const values = context.settings.loop;
  let nyquist = null;
  let inverse = null;
  const sine = xyPlot({ title: "A sine at the valve, and the stem", curves: [], xLabel: "Phase [degrees]", yLabel: "% of span", height: 330, xRange: [0, 360], sentence: "" });
  const plane = xyPlot({ title: "Nyquist plot", curves: [], xLabel: "Real part", yLabel: "Imaginary part", height: 380 });
  const sentence = h("p", { class: "answer", role: "status" });
  const table = h("div", {});
  const askSine = () => context.ask("sine", "loop", 600, drawSine);
  const askLoop = () => {
    sentence.textContent = "Limit cycles: calculating …";
    context.ask("nyquist", "loop", 600, drawLoop);
  };
  const controls = sliders(context, "loop", ["S", "J", "amplitude", "gain_factor", "dead_time"], (name) => {
    if (["S", "J", "amplitude"].includes(name)) askSine();
    if (name !== "amplitude") askLoop();
  });
  const model = choice({ name: "loop-model", label: "Valve model", choices: context.options.models, value: values.model, onInput: (name) => ((values.model = name), context.changed(), askSine(), askLoop()) });
  function drawSine(answer) {
    inverse = answer.inverse;
    const line = (name, y, color, dash) => ({ name, x: answer.phase, y, color, dash, width: 2 });
    sine.setCurves([line("OP", answer.op, "op", "solid"), line("Valve position", answer.position, "mv", "solid"), line("Its fundamental", answer.fundamental, "model", "dot")]);
    sine.setSentence(answer.sentence);
    drawPlane();
  }
  function drawLoop(answer, newerAsked) {
    if (newerAsked) return;
    nyquist = answer.figure;
    sentence.textContent = answer.sentence;
    table.replaceChildren(drawBlock(answer.table).element);
    plane.setSentence(`${nyquist.caption} The square is -1/N at the amplitude of the sine.`);
    drawPlane();
  }
  function drawPlane() {
    if (!nyquist) return;
    const [panel] = nyquist.panels;
    const point = inverse ? [{ name: "-1/N(A) at the chosen amplitude", x: [inverse[0]], y: [inverse[1]], color: "op", mode: "markers", symbol: "square" }] : [];
    const widened = (range, value) => (range && inverse ? [Math.min(range[0], 1.1 * value), Math.max(range[1], 1.1 * value)] : range);
    plane.setCurves([...panel.series, ...point], { xRange: widened(nyquist.x_range, inverse?.[0]), yRange: widened(panel.range, inverse?.[1]) });
  }
  const element = section(
    "Why the loop cycles: the describing function",
    "The fundamental of the stem over the sine that drives it is N(A). Where L(jω) meets -1/N(A) the loop can cycle. At the start: the example of the paper, with d = 0.5 %.",
    [sentence, h("div", { class: "columns" }, sine.figure, plane.figure), table],
    [model.element, ...elements(controls)],
  );
  return { element, start: () => (askSine(), askLoop()), destroy: () => (sine.destroy(), plane.destroy()) };
}

/** The example loop of the paper in a limit cycle, and the pulse that moves it to another. */
function jumpSection(context) {
  const sentence = h("p", { class: "answer", role: "status" });
  const panels = { op: "OP [%]", mv: "Stem [%]", pv: "PV" };
  const sentences = {
    op: "OP: amplitude and period change when the loop moves to another limit cycle.",
    mv: "Stem: the levels at which it rests before and after the pulse (shaded).",
    pv: "PV: it follows the stem through the process.",
  };
  const plots = Object.entries(panels).map(([name, label]) => [name, xyPlot({ title: `${label} over time`, curves: [], xLabel: name === "pv" ? "Time [s]" : "", yLabel: label, height: name === "pv" ? 180 : 165, legend: false, sentence: sentences[name] })]);
  const ask = () => context.ask("jump", "jump", plots[0][1].figure.clientWidth || 800, draw);
  const controls = sliders(context, "jump", ["pulse", "length"], ask);
  function draw(answer) {
    sentence.textContent = answer.sentence;
    for (const [name, plot] of plots) plot.setCurves([{ name, x: answer.time, y: answer[name], color: name, width: 1.5 }], { shaded: [answer.pulse], xRange: [100, 500] });
  }
  const element = section(
    "From one limit cycle to another",
    "The example loop of the paper has several stable limit cycles. A pulse of load of the right size moves it from one to another, as in Fig. 8.",
    [sentence, ...plots.map(([, plot]) => plot.figure)],
    elements(controls),
  );
  return { element, start: ask, destroy: () => plots.forEach(([, plot]) => plot.destroy()) };
}
