// Line plots with uPlot: colours of the page, light and dark, one sentence each, zoom that linked plots share.

import uPlot from "/static/vendor/uPlot.esm.js";
import { h } from "./dom.js";

const DASHES = { pv: [], sp: [8, 4], op: [], mv: [3, 3], model: [7, 3, 2, 3], ghost: [] };
/** Clock times of the x axis, 24 hours: step [s], text, and texts at the start of a new year, month, day, minute, second. */
const CLOCK = [
  [31536000, "{YYYY}", null, null, null, null, null, null, 1],
  [2419200, "{MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [86400, "{DD} {MMM}", "\n{YYYY}", null, null, null, null, null, 1],
  [3600, "{HH}:{mm}", "\n{DD} {MMM} {YYYY}", null, "\n{DD} {MMM}", null, null, null, 1],
  [60, "{HH}:{mm}", "\n{DD} {MMM} {YYYY}", null, "\n{DD} {MMM}", null, null, null, 1],
  [1, "{HH}:{mm}:{ss}", "\n{DD} {MMM} {YYYY}", null, "\n{DD} {MMM}", null, null, null, 1],
  [0.001, ":{ss}.{fff}", "\n{DD} {MMM} {HH}:{mm}", null, "\n{DD} {MMM} {HH}:{mm}", null, "\n{HH}:{mm}", null, 1],
];
/** Sizes of the plots on an A4 page [px]. */
const PRINT_WIDTH = 750;
const PRINT_HALF = 360;
const PRINT_HEIGHT = 140;
const RESIZE_DELAY_MS = 60;
export const live = new Set();

/** Call `resize(width)` when the width of a box changes, but not while the page is printed. Returns {begin(), end()}. */
export function widthWatcher(box, resize) {
  let delay = 0;
  let drawn = 0;
  function check() {
    const width = box.clientWidth;
    if (!width || width === drawn || matchMedia("print").matches) return;
    drawn = width;
    resize(width);
  }
  const observer = new ResizeObserver(() => {
    clearTimeout(delay);
    delay = setTimeout(check, RESIZE_DELAY_MS);
  });
  return {
    begin() {
      drawn = box.clientWidth;
      observer.observe(box);
    },
    end() {
      clearTimeout(delay);
      observer.disconnect();
    },
  };
}

/** The value of a colour of the page, such as color("pv"). */
export function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export function axis(label, options = {}) {
  return {
    label,
    stroke: () => color("muted"),
    grid: { stroke: () => color("grid"), width: 1 },
    ticks: { stroke: () => color("line"), width: 1 },
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
    labelSize: 20,
    ...options,
  };
}

function seriesOptions({ label, kind = "pv", width = 1.5, points = false, dash, step = false, stroke, show = true }) {
  return {
    label,
    show,
    stroke: () => stroke?.() ?? color(kind),
    width,
    dash: dash ?? DASHES[kind] ?? [],
    points: { show: points },
    paths: step ? uPlot.paths.stepped({ align: 1 }) : undefined,
    spanGaps: false,
    value: (_, value) => (value === null || value === undefined ? "–" : Number(value.toPrecision(5)).toString()),
  };
}

/**
 * Draw lines over a common x. Returns {figure, plot, setData(data), setSentence(text), destroy()}.
 *
 * `title` and `sentence` name and describe the picture; `series` is [{label, kind: "pv"|"op"|"mv"|"sp"|"model", ...}]; `data` is
 * [x, y1, y2, ...] with null for a gap; `xLabel`, `yLabel` are the axes; `height` in pixels; `sync` is a key that linked
 * plots share (cursor); `onZoom(from, to)` is called after a zoom by the mouse, with NaN after a double click;
 * `xTime` draws the x axis as a clock (x in seconds since 1970); `legend: false` leaves the legend out.
 */
export function linePlot(options) {
  const { title, sentence = "", series, data, xLabel, yLabel, height = 220, sync, onZoom, xTime = false, legend = true } = options;
  const caption = h("figcaption", {}, sentence);
  const box = h("div", { class: "plot-box" });
  const figure = h("figure", { class: "plot", role: "group", "aria-label": title }, box, caption);
  let plot = null;
  const setup = {
    width: 600,
    height,
    tzDate: xTime ? (seconds) => uPlot.tzDate(new Date(seconds * 1e3), "Etc/UTC") : undefined,
    legend: { show: legend, live: true },
    cursor: { drag: { x: true, y: false, setScale: !onZoom }, sync: sync ? { key: sync, setSeries: false } : undefined },
    scales: { x: { time: xTime, ...(options.xRange ? { range: options.xRange } : {}) }, y: options.yRange ? { range: options.yRange } : {} },
    axes: [axis(xLabel, xTime ? { values: CLOCK } : {}), axis(yLabel, { size: 62 })],
    series: [{ label: options.xName ?? "Time" }, ...series.map(seriesOptions)],
    hooks: {
      setSelect: [
        (one) => {
          if (!onZoom || one.select.width < 4) return;
          onZoom(one.posToVal(one.select.left, "x"), one.posToVal(one.select.left + one.select.width, "x"));
          one.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        },
      ],
      ...(options.draw ? { draw: [options.draw] } : {}),
    },
  };
  if (onZoom) setup.cursor.bind = { dblclick: () => () => onZoom(NaN, NaN) };
  const watcher = widthWatcher(box, (width) => plot.setSize({ width, height }));
  // uPlot needs the width of a box that is in the page.
  const draw = () => {
    if (plot || !box.isConnected) return;
    plot = new uPlot({ ...setup, width: Math.max(120, box.clientWidth) }, current, box);
    live.add(plot);
    watcher.begin();
  };
  let current = data;
  requestAnimationFrame(draw);
  return {
    figure,
    get plot() {
      draw();
      return plot;
    },
    setData(next, resetScales = true) {
      current = next;
      draw();
      plot?.setData(next, resetScales);
    },
    setSentence(text) {
      caption.textContent = text;
    },
    destroy() {
      watcher.end();
      if (plot) {
        live.delete(plot);
        plot.destroy();
      }
    },
  };
}

/** Fit the plots to an A4 page before it is printed, and to the screen again afterwards. */
addEventListener("beforeprint", () => {
  for (const plot of live) {
    plot.screenSize = { width: plot.width, height: plot.height };
    plot.setSize({ width: plot.root.closest(".columns") ? PRINT_HALF : PRINT_WIDTH, height: Math.min(plot.height, PRINT_HEIGHT) });
  }
});
addEventListener("afterprint", () => {
  for (const plot of live) if (plot.screenSize) plot.setSize(plot.screenSize);
});

/** Draw all plots in the new colours; uPlot itself keeps the colours of the legend. */
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const plot of live) {
    plot.redraw(false, true);
    plot.root.querySelectorAll(".u-series").forEach((entry, k) => {
      const marker = entry.querySelector(".u-marker");
      const { stroke } = plot.series[k];
      if (marker && stroke) marker.style.borderColor = typeof stroke === "function" ? stroke(plot, k) : stroke;
    });
  }
});
