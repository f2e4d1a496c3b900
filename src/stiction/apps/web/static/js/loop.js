// Loop: the sentence first, then trends, reasons, valve and process, evidence, data, remedies and notes.

import { fetchFile, getJson, saveFile } from "./api.js";
import { chip, VERDICTS } from "./chips.js";
import { h, number, problem } from "./dom.js";
import { notesCard } from "./notes.js";
import { trendPlots } from "./trend_plots.js";
import { xyPlot } from "./xyplot.js";

export const title = "Loop";
const SEVERITIES = { ok: ["good", "passed"], warn: ["unknown", "warning"], reject: ["alert", "rejected"] };
const SHOWN_BARS = 8;

export async function render(root, { parts: [set, key], signal }) {
  const path = `/api/sets/${encodeURIComponent(set)}/loops/${encodeURIComponent(key)}`;
  root.append(h("p", { class: "note", role: "status" }, "The loop is being diagnosed …"));
  const loop = await getJson(path, signal);
  document.title = `${loop.tag} · stiction`;
  root.replaceChildren(
    h("nav", { class: "screen-only", "aria-label": "Back" }, h("a", { href: `#/loops/${set}` }, "← All loops")),
    headline(loop));
  const destroy = [];
  const trends = h("section", { class: "card", "aria-label": "Trends" }, h("h2", {}, "Trends"), h("p", { class: "note" }, "Loading …"));
  root.append(trends);
  root.append(h("div", { class: "columns" }, pvOverOp(loop, destroy), contributions(loop)));
  root.append(h("div", { class: "columns" }, valveCard(loop, set, key, path), notesCard(path, signal)));
  root.append(evidenceCard(loop), h("div", { class: "columns" }, dataCard(loop), originCard(loop, path)));
  try {
    const plots = await trendPlots(`${path}/trend`, loop.state.stretches, signal);
    destroy.push(plots.destroy);
    trends.replaceChildren(h("h2", {}, "Trends"), plots.element);
  } catch (error) {
    if (error.name === "AbortError") return null;
    trends.replaceChildren(h("h2", {}, "Trends"), problem(error.message));
  }
  return () => destroy.forEach((one) => one());
}

function headline(loop) {
  const [kind, word] = VERDICTS[loop.verdict] ?? ["plain", loop.verdict_label];
  const state = loop.state.name === "in_control" ? null : h("p", {}, h("strong", {}, `${loop.state.title}. `), loop.state.why, " ", loop.state.action);
  return h("header", { class: `card verdict verdict-${kind}` },
    h("div", { class: "row" }, h("h1", {}, loop.tag), chip(kind, word), h("button", { class: "screen-only print", onclick: () => print() }, "Print")),
    h("p", { class: "lead" }, `${loop.headline}.`),
    h("p", {}, h("strong", {}, "What to do: "), loop.action),
    h("p", { class: "note" }, `${loop.confidence}. ${loop.reason}`),
    state,
    h("dl", { class: "facts" }, loop.facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))));
}

function pvOverOp(loop, destroy) {
  const card = h("section", { class: "card", "aria-label": "PV over OP" }, h("h2", {}, "PV over OP"));
  const data = loop.pvop;
  if (!data) {
    card.append(h("p", { class: "note" }, "The record has no PV and OP at the same time."));
    return card;
  }
  const part = data.periods ? `The last ${data.periods} periods.` : "The whole record.";
  const band = data.band ? ` The shaded band is S = ${number(data.S, loop.units.op)}: within it OP moves and the valve rests.` : "";
  const plot = xyPlot({
    title: "PV over OP",
    sentence: `${part}${band} A sticky valve draws a parallelogram with flat sides, a good valve an ellipse.`,
    curves: [{ name: "PV over OP", x: data.op, y: data.pv, color: "pv", width: 1.4, legend: false }],
    xLabel: `OP [${loop.units.op}]`,
    yLabel: `PV [${loop.units.pv}]`,
    shaded: data.band ? [data.band] : [],
    height: 330,
    legend: false,
  });
  destroy.push(plot.destroy);
  card.append(plot.figure);
  return card;
}

function contributions(loop) {
  const card = h("section", { class: "card", "aria-label": "Why this verdict" }, h("h2", {}, "Why this verdict"));
  if (!loop.contributions.length) {
    card.append(h("p", {}, loop.reason));
    return card;
  }
  const shown = loop.contributions.slice(0, SHOWN_BARS);
  const largest = Math.max(...shown.map((one) => Math.abs(one.log_odds)), 0.1);
  const bar = (one) => {
    const share = (Math.abs(one.log_odds) / largest) * 50;
    const fill = h("span", { class: one.log_odds >= 0 ? "bar for" : "bar against" });
    fill.style.width = `${share}%`;
    fill.style.left = one.log_odds >= 0 ? "50%" : `${50 - share}%`;
    return h("span", { class: "bar-box", "aria-hidden": "true" }, fill);
  };
  const rows = shown.map((one) => h("tr", {}, h("th", { scope: "row", title: one.formula }, one.label), h("td", {}, bar(one)), h("td", { class: "number" }, `${one.log_odds >= 0 ? "+" : "−"}${Math.abs(one.log_odds).toFixed(2)}`)));
  const more = loop.contributions.length - shown.length;
  card.append(
    h("table", { class: "bars" }, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Feature"), h("th", { scope: "col" }, "against — for stiction"), h("th", { scope: "col", class: "number" }, "Log odds"))), h("tbody", {}, rows)),
    h("p", { class: "caption" }, `${loop.contributions_sentence}${more > 0 ? ` ${more} smaller ones are not shown.` : ""}`));
  return card;
}

function valveCard(loop, set, key, path) {
  const result = h("div", { "aria-live": "polite" });
  const button = h("button", {}, "Compare repair, retuning and compensation");
  button.addEventListener("click", async () => {
    button.disabled = true;
    result.replaceChildren(h("p", { class: "note" }, "The remedies are simulated; this takes some seconds …"));
    try {
      showRemedies(result, await getJson(`${path}/remedies`));
    } catch (error) {
      result.replaceChildren(problem(error.message));
      button.disabled = false;
    }
  });
  return h("section", { class: "card", "aria-label": "Valve and process" },
    h("h2", {}, "Valve and process"),
    loop.identified.length ? definitionTable(loop.identified) : h("p", { class: "note" }, "No valve was identified, so S and J are not known."),
    loop.identified.length && loop.verdict === "no_stiction" ? h("p", { class: "note" }, "This is the best sticky-valve fit. The verdict does not rely on it.") : null,
    h("div", { class: "row screen-only" }, h("a", { class: "button", href: `#/whatif?set=${encodeURIComponent(set)}&key=${encodeURIComponent(key)}` }, "Try it: what if?"), button),
    result);
}

function showRemedies(box, found) {
  const table = found.rows.length
    ? h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Remedies" },
        h("table", {}, h("thead", {}, h("tr", {}, found.columns.map((name, k) => h("th", { scope: "col", class: k > 0 && k < 5 ? "number" : null }, name)))),
          h("tbody", {}, found.rows.map((row) => h("tr", {}, row.map((cell, k) => h("td", { class: k > 0 && k < 5 ? "number" : null }, cell)))))))
    : null;
  box.replaceChildren(...[
    h("p", { class: "lead" }, `${found.headline}.`), h("p", {}, found.reason), found.risk ? h("p", {}, found.risk) : null, table,
    table ? h("p", { class: "caption" }, "Simulated with the identified loop. PV std: change against doing nothing; valve travel: times that of doing nothing; price: weighted sum of both, 1 is doing nothing.") : null,
    found.retuning ? h("p", { class: "note" }, found.retuning) : null,
  ].filter(Boolean));
}

function evidenceCard(loop) {
  const card = h("section", { class: "card not-printed", "aria-label": "Published methods" }, h("h2", {}, "Published methods"));
  if (!loop.evidence.length) {
    card.append(h("p", { class: "note" }, "No published method was applied to this record."));
    return card;
  }
  const votes = loop.evidence.filter((one) => one.valid).map((one) => one.vote);
  const count = (vote) => votes.filter((one) => one === vote).length;
  card.append(
    h("p", { class: "caption" }, `The condition of ${votes.length} methods is met: ${count("stiction")} vote for stiction, ${count("no_stiction")} against it, ${count("undecided")} cannot tell. The probability does not use their votes.`),
    h("details", {}, h("summary", {}, "Show the methods"),
      h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Methods" },
        h("table", {}, h("thead", {}, h("tr", {}, ["Method", "Index", "Threshold", "Vote", "Condition", "Why", "Source"].map((name, k) => h("th", { scope: "col", class: k === 1 || k === 2 ? "number" : null }, name)))),
          h("tbody", {}, loop.evidence.map((one) => h("tr", {},
            h("td", {}, one.method), h("td", { class: "number" }, number(one.index)), h("td", { class: "number" }, number(one.threshold)),
            h("td", {}, one.valid ? chip(VERDICTS[one.vote]?.[0] ?? "plain", one.vote_label) : one.vote_label), h("td", {}, one.valid ? "met" : "not met"), h("td", {}, one.why), h("td", {}, one.source))))))));
  return card;
}

function dataCard(loop) {
  const troubled = loop.checks.filter((one) => one.severity !== "ok");
  const passed = loop.checks.filter((one) => one.severity === "ok");
  const line = (one) => h("li", {}, chip(...SEVERITIES[one.severity] ?? ["plain", one.severity]), " ", h("strong", {}, one.name), `: ${one.why}`);
  return h("section", { class: "card", "aria-label": "Data" }, h("h2", {}, "Data"),
    troubled.length ? h("ul", { class: "checks" }, troubled.map(line)) : h("p", {}, "All data checks pass."),
    h("details", { class: "screen-only" }, h("summary", {}, `${passed.length} checks passed`), h("ul", { class: "checks" }, passed.map(line))));
}

function originCard(loop, path) {
  const message = h("div", { "aria-live": "polite" });
  const button = h("button", {}, "Save the full report (HTML)");
  button.addEventListener("click", async () => {
    button.disabled = true;
    message.replaceChildren(h("p", { class: "note" }, "The report is being written …"));
    try {
      saveFile(await fetchFile("GET", `${path}/report`));
      message.replaceChildren(h("p", { class: "note" }, "The report opens in a browser without this server."));
    } catch (error) {
      message.replaceChildren(problem(error.message));
    }
    button.disabled = false;
  });
  return h("section", { class: "card", "aria-label": "Origin" }, h("h2", {}, "Origin"), definitionTable(loop.origin), h("div", { class: "row screen-only" }, button), message);
}

function definitionTable(rows) {
  return h("table", { class: "definitions" }, h("tbody", {}, rows.map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, value)))));
}
