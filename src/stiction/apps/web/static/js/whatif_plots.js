// Plots and table of the what-if screen: the simulated loop over the record, and its predicted limit cycles.

import { shortNumber } from "./controls.js";
import { h, number } from "./dom.js";
import { color, linePlot } from "./plots.js";

/** Amplitude of OP up to which the loop is said to rest [% of span]. */
const REST_AMPLITUDE = 0.01;

/** PV and OP over time, the record in grey under it, and lines at the amplitude of each stable limit cycle. */
export function drawPlots(record, pvUnit, cyclesOf) {
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
    elements: [
      h("div", { class: "whatif-near" }, h("h2", {}, "Process variable"), pv.figure),
      h("div", { class: "whatif-far" }, h("h2", {}, "Controller output and valve position"), op.figure),
    ],
    width: () => pv.figure.clientWidth || 800,
    draw(trend, values) {
      middle = { pv: values.sp, op: trend.op_swing.middle };
      const empty = record ? [new Array(trend.time.length).fill(null)] : [];
      pv.setData([trend.time, new Float32Array(trend.time.length).fill(values.sp), trend.pv, ...empty]);
      op.setData([trend.time, trend.op, trend.mv, ...empty]);
      const grey = record ? " Grey: the record." : "";
      pv.setSentence(`PV moves between ${ends(trend.pv_swing)} about the set point of ${shortNumber(values.sp)}.${grey}`);
      const motion = trend.op_swing.amplitude > REST_AMPLITUDE ? `OP moves between ${ends(trend.op_swing)} %; the valve position stays where it is until OP has moved far enough.` : "OP and the valve position are at rest.";
      op.setSentence(motion + grey);
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

export function tableOfCycles(cycles) {
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
