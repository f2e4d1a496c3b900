// Curves in a plane: each has its own x and y, with markers, labels and shaded parts. uPlot draws the axes.

import uPlot from "/static/vendor/uPlot.esm.js";
import { h } from "./dom.js";
import { axis, color, live, widthWatcher } from "./plots.js";

const DASHES = { solid: [], dash: [8, 4], dot: [2, 3], dashdot: [7, 3, 2, 3], longdash: [12, 4], longdashdot: [12, 4, 2, 4] };

/** Colours of the reports -> colours of the page, which change with light and dark. */
const NAMES = { "#0072B2": "pv", "#D55E00": "op", "#00735A": "mv", "#5A6270": "sp", "#1B1F24": "model", "#B3261E": "alert", "#22272E": "ink", "#7A4FA3": "violet", "#8A6D00": "ochre" };

/** The colour of a curve: a name of the page such as "op", or a colour of the reports. */
export function curveColor(text) {
  const name = NAMES[text] ?? text;
  return color(name) || text || color("ink");
}

function extent(curves, part) {
  let [low, high] = [Infinity, -Infinity];
  for (const curve of curves) for (const value of curve[part]) if (value !== null && !Number.isNaN(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  if (!(low <= high)) return [0, 1];
  const room = part === "y" ? 0.06 * (high - low) || 0.5 : 0;
  return [low - room, high + room || low + 1];
}

function drawCurve(plot, curve) {
  const context = plot.ctx;
  const scale = devicePixelRatio;
  context.strokeStyle = context.fillStyle = curveColor(curve.color);
  context.lineWidth = (curve.width ?? 1.5) * scale;
  context.setLineDash((DASHES[curve.dash ?? "solid"] ?? []).map((one) => one * scale));
  if (curve.mode !== "markers") {
    context.beginPath();
    let open = false;
    for (let k = 0; k < curve.x.length; k += 1) {
      const [x, y] = [curve.x[k], curve.y[k]];
      if (x === null || y === null || Number.isNaN(x) || Number.isNaN(y)) {
        open = false;
        continue;
      }
      const [left, top] = [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)];
      if (open) context.lineTo(left, top);
      else context.moveTo(left, top);
      open = true;
    }
    context.stroke();
    return;
  }
  context.setLineDash([]);
  context.lineWidth = 2 * scale;
  const size = 5 * scale;
  for (let k = 0; k < curve.x.length; k += 1) {
    const [x, y] = [plot.valToPos(curve.x[k], "x", true), plot.valToPos(curve.y[k], "y", true)];
    drawMarker(context, curve.symbol ?? "circle", x, y, size);
    if (curve.text?.[k]) {
      context.font = `${12 * scale}px system-ui, sans-serif`;
      context.save();
      context.strokeStyle = color("card");
      context.lineWidth = 4 * scale;
      context.strokeText(curve.text[k], x + 1.4 * size, y + 2.6 * size);
      context.restore();
      context.fillText(curve.text[k], x + 1.4 * size, y + 2.6 * size);
    }
  }
}

function drawMarker(context, symbol, x, y, size) {
  context.beginPath();
  if (symbol.startsWith("circle")) context.arc(x, y, size, 0, 2 * Math.PI);
  else if (symbol === "x") {
    context.moveTo(x - size, y - size);
    context.lineTo(x + size, y + size);
    context.moveTo(x - size, y + size);
    context.lineTo(x + size, y - size);
  } else if (symbol.startsWith("diamond")) {
    context.moveTo(x, y - size);
    context.lineTo(x + size, y);
    context.lineTo(x, y + size);
    context.lineTo(x - size, y);
    context.closePath();
  } else context.rect(x - size, y - size, 2 * size, 2 * size);
  if (symbol.endsWith("-open") || symbol === "x") context.stroke();
  else context.fill();
}

function followDrag(plot, onDrag) {
  plot.over.classList.add("draggable");
  plot.over.addEventListener("pointerdown", (event) => {
    plot.over.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  plot.over.addEventListener("pointermove", (event) => {
    if (plot.over.hasPointerCapture(event.pointerId)) onDrag(event.movementX, event.movementY, plot);
  });
}

function legendOf(curves) {
  const names = new Set();
  const entries = curves.filter((curve) => curve.name && curve.legend !== false && !names.has(curve.name) && names.add(curve.name));
  return h("ul", { class: "legend" }, entries.map((curve) => h("li", {}, legendKey(curve), curve.name)));
}

function legendKey(curve) {
  const canvas = h("canvas", { width: 34 * devicePixelRatio, height: 12 * devicePixelRatio, "aria-hidden": "true" });
  const context = canvas.getContext("2d");
  const scale = devicePixelRatio;
  context.strokeStyle = context.fillStyle = curveColor(curve.color);
  context.lineWidth = Math.max(2, curve.width ?? 2) * scale;
  if (curve.mode === "markers") {
    context.lineWidth = 2 * scale;
    drawMarker(context, curve.symbol ?? "circle", 17 * scale, 6 * scale, 4 * scale);
  } else {
    context.setLineDash((DASHES[curve.dash ?? "solid"] ?? []).map((one) => one * scale));
    context.beginPath();
    context.moveTo(0, 6 * scale);
    context.lineTo(34 * scale, 6 * scale);
    context.stroke();
  }
  return canvas;
}

/**
 * Draw curves. Returns {figure, plot, setCurves(curves, ranges), setSentence(text), destroy()}.
 *
 * A curve is {name, x, y, color, dash, width, mode: "lines"|"markers", symbol, text, legend}; NaN or null is a gap.
 * `xRange` and `yRange` fix the axes; `shaded` is [[from, to], ...] along x; `onDrag(dx, dy, plot)` gets each move of a drag
 * [px] in place of the zoom.
 */
export function xyPlot({ title, sentence = "", curves, xLabel, yLabel, height = 320, xRange = null, yRange = null, shaded = [], legend = true, onDrag = null }) {
  const caption = h("figcaption", {}, sentence);
  const box = h("div", { class: "plot-box" });
  const keys = h("div", {});
  const figure = h("figure", { class: "plot", role: "group", "aria-label": title }, box, keys, caption);
  let plot = null;
  const bounds = () => ({ x: xRange ?? extent(curves, "x"), y: yRange ?? extent(curves, "y") });
  function paint(one) {
    const context = one.ctx;
    const { left, top, width, height: tall } = one.bbox;
    context.save();
    context.beginPath();
    context.rect(left, top, width, tall);
    context.clip();
    for (const [from, to] of shaded) {
      const [start, end] = [one.valToPos(from, "x", true), one.valToPos(to, "x", true)];
      context.fillStyle = color("line");
      context.globalAlpha = 0.6;
      context.fillRect(start, top, end - start, tall);
      context.globalAlpha = 1;
    }
    for (const curve of curves) drawCurve(one, curve);
    context.restore();
  }
  function draw() {
    if (plot || !box.isConnected) return;
    const { x, y } = bounds();
    const setup = {
      width: Math.max(160, box.clientWidth),
      height,
      legend: { show: false },
      cursor: { points: { show: false }, drag: onDrag ? { x: false, y: false } : { x: true, y: true, uni: 30 } },
      scales: { x: { time: false }, y: {} },
      axes: [xLabel ? axis(xLabel) : axis(undefined, { labelSize: 0, size: 30 }), axis(yLabel, { size: 62 })],
      series: [{}, { show: true, stroke: "transparent", points: { show: false } }],
      hooks: { draw: [paint] },
    };
    plot = new uPlot(setup, [x, y], box);
    fit();
    if (onDrag) followDrag(plot, onDrag);
    live.add(plot);
    watcher.begin();
    if (legend) keys.replaceChildren(legendOf(curves));
  }
  function fit() {
    const { x, y } = bounds();
    plot.batch(() => {
      plot.setData([x, y], false);
      plot.setScale("x", { min: x[0], max: x[1] });
      plot.setScale("y", { min: y[0], max: y[1] });
    });
  }
  const watcher = widthWatcher(box, (width) => plot.setSize({ width, height }));
  const darkness = matchMedia("(prefers-color-scheme: dark)");
  const recolor = () => legend && plot && keys.replaceChildren(legendOf(curves));
  darkness.addEventListener("change", recolor);
  requestAnimationFrame(draw);
  return {
    figure,
    get plot() {
      draw();
      return plot;
    },
    setCurves(next, ranges = {}) {
      const names = curves.map((curve) => curve.name).join();
      curves = next;
      if ("xRange" in ranges) xRange = ranges.xRange;
      if ("yRange" in ranges) yRange = ranges.yRange;
      if (ranges.shaded) shaded = ranges.shaded;
      draw();
      if (!plot) return;
      fit();
      if (legend && names !== curves.map((curve) => curve.name).join()) keys.replaceChildren(legendOf(curves));
    },
    setSentence(text) {
      caption.textContent = text;
    },
    destroy() {
      watcher.end();
      darkness.removeEventListener("change", recolor);
      if (plot) {
        live.delete(plot);
        plot.destroy();
      }
    },
  };
}
