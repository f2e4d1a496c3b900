// Groups: loops of an audit that share an oscillation; the likeliest root, trends in phase order, spectra.

import { getJson } from "./api.js";
import { VERDICTS, chip, verdictChip } from "./chips.js";
import { counted, duration, h, number, probability, svg } from "./dom.js";
import { setChoice } from "./set_choice.js";
import { xyPlot } from "./xyplot.js";

export const title = "Groups";
const COLORS = ["pv", "op", "mv", "violet", "ochre", "alert", "sp", "model"];
const ROW_HEIGHT = 34;
const WIDTH = 600;

export async function render(root, { parts, signal }) {
  root.append(h("h1", {}, "Groups"));
  const { element, current } = await setChoice("groups", parts[0], signal, (one) => one.is_audit);
  root.append(element);
  if (!current) {
    root.append(h("p", {}, "Groups are found by an audit of many loops. Open one above, or start the server with one: ", h("code", {}, "stiction serve AUDIT"), "."));
    return null;
  }
  const wait = h("p", { class: "note", role: "status" }, "Loading …");
  root.append(wait);
  const { groups } = await getJson(`/api/sets/${current.id}/groups`, signal);
  wait.remove();
  root.append(h("p", { class: "note" }, groups.length
    ? `${groups.length} ${groups.length === 1 ? "group shares" : "groups share"} an oscillation. Put the source right first, then look again: the loops that follow need no work of their own.`
    : "No loops share an oscillation."));
  const destroy = [];
  for (const group of groups) root.append(groupCard(group, current.id, destroy));
  return () => destroy.forEach((one) => one());
}

function groupCard(group, setId, destroy) {
  const colors = new Map(group.members.map((one, k) => [one.tag, COLORS[k % COLORS.length]]));
  const byTag = new Map(group.members.map((one) => [one.tag, one]));
  const loopLink = (tag) => (byTag.has(tag) ? h("a", { href: `#/loop/${setId}/${byTag.get(tag).key}` }, tag) : tag);
  const roots = group.leading_roots;
  const first = roots.length === 1 ? ["Put this right first: ", loopLink(roots[0])] : ["One of these two is the source: ", loopLink(roots[0]), " or ", loopLink(roots[1]), ". Put the first in manual for three periods; if the second goes on swinging, it is the source."];
  const card = h("section", { class: "card", "aria-label": `Group ${group.number}` },
    h("h2", {}, `Group ${group.number}: ${counted(group.members.length, "loop")}, period ${duration(group.period_s)}`),
    h("p", { class: "lead" }, first),
    ...roots.map((tag) => h("p", {}, roots.length > 1 ? `Why ${tag}: ` : "", group.roots.find((one) => one.tag === tag)?.why ?? "")),
    followerMap(group, loopLink),
    named("Perhaps also, too irregular to say: ", group.perhaps_also),
    named("Similar periods, connection not shown: ", group.similar),
    h("details", {}, h("summary", {}, "Trends, spectra and numbers"),
      h("div", { class: "columns" }, stackedTrends(group, colors, loopLink), spectra(group, colors, destroy)),
      rootTable(group, loopLink), memberTable(group, loopLink)));
  return card;
}

/** The source, and an arrow to each follower with the connections between. */
function followerMap(group, loopLink) {
  const sources = new Set(group.leading_roots);
  const followers = group.members.filter((one) => !sources.has(one.tag));
  if (!followers.length) return null;
  return h("div", { class: "source-map" },
    h("div", { class: "map-source" }, group.leading_roots.map((tag) => h("div", {}, h("span", { class: "map-loop" }, loopLink(tag)), " ", h("span", { class: "note" }, byTag(group, tag)?.since ?? "")))),
    h("ul", { class: "map-followers" }, followers.map((one) => h("li", {}, h("span", { class: "map-loop" }, loopLink(one.tag)), " ", h("span", { class: "note" }, [one.through, one.since].filter(Boolean).join("; "))))));
}

const byTag = (group, tag) => group.members.find((one) => one.tag === tag);

function named(words, tags) {
  return tags?.length ? h("p", { class: "note" }, words, tags.slice(0, 20).join(", "), tags.length > 20 ? ` and ${tags.length - 20} more` : "") : null;
}

function stackedTrends(group, colors, loopLink) {
  const drawn = group.members.filter((one) => one.tag in group.trends);
  const lines = drawn.map((one) => {
    const [at, values] = group.trends[one.tag];
    const points = values.map((value, k) => `${(at[k] * WIDTH).toFixed(1)},${(ROW_HEIGHT / 2 - value * (ROW_HEIGHT - 8)).toFixed(1)}`).join(" ");
    const line = svg("polyline", { points, class: `stack-${colors.get(one.tag)}` });
    return h("div", { class: "stack-row" }, h("span", { class: "stack-name" }, loopLink(one.tag)), svg("svg", { viewBox: `0 0 ${WIDTH} ${ROW_HEIGHT}`, preserveAspectRatio: "none", "aria-hidden": "true" }, line));
  });
  return h("figure", { class: "plot" }, h("h3", {}, "Trends"), h("div", { class: "stack" }, lines),
    h("figcaption", {}, `${counted(drawn.length, "loop")} over ${duration(group.shown_s)}, the likeliest source first, each over its own range. All repeat every ${duration(group.period_s)}.`));
}

function spectra(group, colors, destroy) {
  const drawn = group.members.filter((one) => one.tag in group.spectra).slice(0, COLORS.length);
  const plot = xyPlot({
    title: "Spectra",
    sentence: `Amplitude over frequency, the largest of each loop is 1. All have a peak at 1, a period of ${duration(group.period_s)}; peaks at 3 and 5 point to a sticky valve.`,
    curves: drawn.map((one) => ({ name: one.tag, x: group.spectra[one.tag][0], y: group.spectra[one.tag][1], color: colors.get(one.tag), width: 1.4 })),
    xLabel: "Frequency / frequency of the group [-]",
    yLabel: "Amplitude [-]",
    xRange: [0, 6],
    yRange: [0, 1.05],
    height: 260,
  });
  destroy.push(plot.destroy);
  return h("div", {}, h("h3", {}, "Spectra"), plot.figure);
}

function rootTable(group, loopLink) {
  const rows = group.roots.slice(0, 5).map((one) => h("tr", {},
    h("td", {}, loopLink(one.tag)), h("td", { class: "number" }, probability(one.probability)), h("td", {}, one.why)));
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Likely sources" }, h("h3", {}, "Likely sources"),
    h("table", {},
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Loop"), h("th", { scope: "col", class: "number" }, "Probability"), h("th", { scope: "col" }, "Reasons"))),
      h("tbody", {}, rows)));
}

function memberTable(group, loopLink) {
  const heads = ["Loop", "Verdict", "Period", "Regularity", "Coherence", "Phase"];
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Members" },
    h("table", {}, h("thead", {}, h("tr", {}, heads.map((head, k) => h("th", { scope: "col", class: k > 1 ? "number" : null }, head)))),
      h("tbody", {}, group.members.map((one) => h("tr", {},
        h("td", {}, loopLink(one.tag)), h("td", {}, one.status === "diagnosed" ? chip(...VERDICTS[one.verdict]) : verdictChip({ status: one.status })),
        h("td", { class: "number" }, duration(one.period_s)), h("td", { class: "number" }, number(one.regularity)), h("td", { class: "number" }, number(one.coherence)), h("td", { class: "number" }, `${Math.round(one.phase_deg)}°`))))));
}
