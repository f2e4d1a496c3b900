// Trends of one loop: PV and SP above, OP and valve position below, linked and zoomed together by the server.

import { getJson } from "./api.js";
import { duration, h, number } from "./dom.js";
import { color, linePlot } from "./plots.js";

const SIGNALS = {
  pv: { label: "PV", kind: "pv" },
  sp: { label: "SP", kind: "sp", step: true, width: 1.2 },
  model: { label: "PV, simulated", kind: "model", width: 1.2 },
  op: { label: "OP", kind: "op" },
  mv: { label: "valve position, measured", kind: "mv" },
  position: { label: "valve position, estimated", kind: "mv", dash: [2, 3] },
};
const UPPER = ["pv", "sp", "model"];
const LOWER = ["op", "mv", "position"];
const ZOOM = 2;
const MOVE = 0.5;
const CYCLES = 8;
const SPANS = [["10 min", 600], ["1 h", 3600], ["8 h", 28800], ["1 d", 86400], ["7 d", 604800]];

/**
 * `path` is the address of the trend; `stretches` are [{state, from, to}] in seconds since the first sample. With a
 * `period` [s] the last CYCLES of it are shown first.
 */
export async function trendPlots(path, stretches, signal, period = null) {
  const first = await getJson(`${path}?points=${width()}`, signal);
  const { about } = first;
  const length = Math.max(about.dt, (about.samples - 1) * about.dt);
  const hasClock = about.start !== null;
  const [unitName, unit] = hasClock ? ["", 1] : length >= 7200 ? ["h", 3600] : length >= 300 ? ["min", 60] : ["s", 1];
  const offset = hasClock ? about.start : 0;
  const toAxis = (seconds) => offset + seconds / unit;
  const toSeconds = (x) => (x - offset) * unit;
  let range = [0, length];
  let request = null;

  const plots = [UPPER, LOWER].map((names, k) => {
    const present = names.filter((name) => name in first.signals);
    if (!present.length) return null;
    const unitText = k === 0 ? about.pv_unit || "engineering units" : about.op_unit;
    const plot = linePlot({
      title: k === 0 ? "PV and set point over time" : "OP and valve position over time",
      series: present.map((name) => SIGNALS[name]),
      data: dataOf(first, present),
      xLabel: k === 1 ? (hasClock ? "Time" : `Time [${unitName}]`) : undefined,
      yLabel: k === 0 ? `${present.includes("sp") ? "PV, SP" : "PV"} [${unitText}]` : `OP [${unitText}]`,
      height: k === 0 ? 240 : 230,
      sync: "trend",
      xTime: hasClock,
      xRange: () => range.map(toAxis),
      onZoom: (from, to) => show(Number.isNaN(from) ? [0, length] : [toSeconds(from), toSeconds(to)]),
      draw: (one) => shadeStretches(one, stretches, toAxis),
    });
    return { plot, present };
  }).filter(Boolean);

  function dataOf(trend, present) {
    return [trend.time.map(toAxis), ...present.map((name) => trend.signals[name])];
  }

  const sentence = h("p", { class: "caption" });
  function describe(trend) {
    const where = trend.to - trend.from >= length - about.dt ? "The whole record" : `From ${duration(trend.from)} to ${duration(trend.to)} of ${duration(length)}`;
    const pv = trend.signals.pv?.filter((value) => value !== null) ?? [];
    const op = trend.signals.op?.filter((value) => value !== null) ?? [];
    const swing = pv.length && op.length ? ` PV moves between ${number(Math.min(...pv))} and ${number(Math.max(...pv), about.pv_unit)}, OP between ${number(Math.min(...op))} and ${number(Math.max(...op), "%")}.` : "";
    const left = stretches.length ? ` Shaded: ${[...new Set(stretches.map((one) => one.state.replaceAll("_", " ")))].join(", ")}.` : "";
    sentence.textContent = `${where}: ${about.note}, one every ${duration(about.dt)}${trend.thinned ? "; each pixel shows the smallest and the largest value" : ""}.${swing}${left} Drag over a stretch to zoom; a double click shows all.`;
  }
  describe(first);

  /** Show a window [s]; a later one replaces it while it is on its way. */
  async function show([from, to]) {
    const span = Math.min(length, Math.max(to - from, 2 * about.dt));
    const start = Math.min(Math.max(from, 0), length - span);
    range = [start, start + span];
    request?.abort();
    const own = (request = new AbortController());
    signal.addEventListener("abort", () => own.abort());
    try {
      const trend = await getJson(`${path}?from=${range[0]}&to=${range[1]}&points=${width()}`, own.signal);
      for (const { plot, present } of plots) plot.setData(dataOf(trend, present));
      describe(trend);
    } catch (error) {
      if (error.name !== "AbortError") sentence.textContent = error.message;
    }
  }

  const button = (text, label, change) => h("button", { "aria-label": label, title: label, onclick: () => show(change(range[0], range[1] - range[0])) }, text);
  const spans = [
    ...(period && CYCLES * period < length ? [[`${CYCLES} cycles`, CYCLES * period]] : []),
    ...SPANS.filter(([, span]) => span < length && span > 20 * about.dt),
    ["Whole record", length],
  ];
  const picker = h("select", { "aria-label": "Time shown", onchange: () => {
    const span = spans[picker.selectedIndex][1];
    show([range[1] - span, range[1]]);
  } }, spans.map(([name]) => h("option", {}, name)));
  picker.selectedIndex = spans.length - 1;
  if (period && CYCLES * period < length) {
    picker.selectedIndex = 0;
  }
  const tools = h("div", { class: "row screen-only zoom-tools", role: "group", "aria-label": "Zoom" },
    picker, button("Whole record", "Show the whole record", () => [0, length]),
    button("+", "Zoom in", (from, span) => [from + (span - span / ZOOM) / 2, from + (span + span / ZOOM) / 2]),
    button("−", "Zoom out", (from, span) => [from - (span * (ZOOM - 1)) / 2, from + span + (span * (ZOOM - 1)) / 2]),
    button("←", "Earlier", (from, span) => [from - span * MOVE, from - span * MOVE + span]),
    button("→", "Later", (from, span) => [from + span * MOVE, from + span * MOVE + span]));
  const element = h("div", { class: "trends" }, tools, plots.map((one) => one.plot.figure), sentence);
  const open = () => (picker.selectedIndex < spans.length - 1 ? show([length - spans[picker.selectedIndex][1], length]) : null);
  return { element, show, open, about, destroy: () => plots.forEach((one) => one.plot.destroy()) };
}

function width() {
  return Math.round(Math.min(2000, Math.max(300, document.getElementById("main").clientWidth - 100)));
}

function shadeStretches(plot, stretches, toAxis) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.fillStyle = color("unknown");
  ctx.globalAlpha = 0.13;
  for (const one of stretches) {
    const left = Math.max(bbox.left, plot.valToPos(toAxis(one.from), "x", true));
    const right = Math.min(bbox.left + bbox.width, plot.valToPos(toAxis(one.to), "x", true));
    if (right > left) ctx.fillRect(left, bbox.top, right - left, bbox.height);
  }
  ctx.restore();
}
