// Loops: the table of all loops of a set, worst first; filters, progress, export of what is shown.

import { fetchFile, getJson, saveFile, sendJson } from "./api.js";
import { CAUSES, STATES, chip, verdictWord } from "./chips.js";
import { sparkline } from "./column_table.js";
import { counted, duration, h, number, problem } from "./dom.js";
import { setChoice } from "./set_choice.js";
import { virtualTable } from "./virtual_table.js";

export const title = "Loops";
const POLL_MS = 700;
const SLOW_POLL_MS = 4000;
const TYPING_MS = 40;
/** Scale of the small trends of OP [% of span]; as SPARK_HALF_RANGE of the report. */
const SPARK_HALF = 10;
const RANKS = { alert: 0, unknown: 1, plain: 2, good: 3 };
const LEVELS = { alert: "Fault of the loop", unknown: "Open question", plain: "Cause elsewhere", good: "Nothing found" };
const memory = new Map();
const loaded = new Map();

const stateWord = (row) => (row.loop_state ? STATES[row.loop_state] ?? row.loop_state.replaceAll("_", " ") : "");
const causeWord = (row) => (row.oscillation_cause ? CAUSES[row.oscillation_cause] ?? row.oscillation_cause : "");
const findingWord = (row) => (row.level ? row.finding_text : verdictWord(row)[1]);
const levelWord = (row) => LEVELS[row.level] ?? verdictWord(row)[1];
const findingRank = (row) => (row.level in RANKS ? RANKS[row.level] : 4) - 0.5 * (row.probability ?? 0);
const stepWord = (row) => row.next_step ?? row.error ?? "";

function columnsOf(setId, all, sparks) {
  const has = (name) => all.some((row) => row[name]);
  const text = (name, label, value, more = {}) => ({ name, label, value, cell: (row) => value(row) ?? "", ...more });
  const numeric = (name, label, hint, more = {}) => ({ name, label, hint, number: true, value: (row) => row[name] ?? null, cell: (row) => row.texts?.[name] ?? "–", ...more });
  const exported = { isExportOnly: true };
  const allPercent = all.every((row) => (row.op_unit ?? "% of span") === "% of span");
  const columns = [
    { name: "tag", label: "Loop", value: (row) => row.tag, cell: (row) => h("a", { href: `#/loop/${setId}/${row.key}` }, row.tag), className: "tag", width: "14%" },
    has("area") && text("area", "Area", (row) => row.area, { width: "7%" }),
    { name: "finding", label: "Finding", value: findingRank, text: findingWord, cell: (row) => chip(row.level ?? "plain", findingWord(row)), className: "finding", width: "18%" },
    text("next", "Next step", stepWord, { className: "long", width: "34%" }),
    numeric("S", allPercent ? "S [%]" : "S", "Deadband plus stickband", { width: "5%" }),
    numeric("period_s", "Period", "Period of the oscillation", { width: "7%" }),
    has("priority") && { ...numeric("priority", "Priority", "Severity times the probability of a fault, with the severity of the loops that follow"), width: "7%", cell: (row) => h("span", { title: row.priority_reason ?? "" }, row.texts?.priority ?? "–") },
    { name: "spark", label: "OP trend", hint: `The last two hours of OP about its mean, ±${SPARK_HALF} % of span in every row`, value: () => null, cell: (row) => trendCell(row, sparks), isPicture: true, width: "9%", className: "picture" },
    has("label") && { name: "label", label: "Note", value: (row) => row.label ?? "", cell: (row) => (row.label ? chip("plain", row.label) : ""), width: "9%", className: "label" },
    new Set(all.map((row) => row.source)).size > 1 && text("source", "File", (row) => row.source, { width: "9%", className: "file" }),
    text("verdict", "Verdict", (row) => verdictWord(row)[1], exported),
    numeric("probability", "Probability", "Probability of stiction", exported),
    numeric("J", "J", "Slip jump", exported),
    text("loop_state", "State", stateWord, exported),
    text("oscillation_cause", "Cause", causeWord, exported),
    text("priority_reason", "Why this priority", (row) => row.priority_reason, exported),
  ];
  return columns.filter(Boolean);
}

function trendCell(row, sparks) {
  const values = row.spark ?? sparks.get(row.key);
  const isPercent = (row.op_unit ?? "% of span") === "% of span";
  if (values && values.every((value) => value === null)) return h("span", { class: "note" }, "does not move");
  return values ? sparkline(values, `Trend of OP of ${row.tag}`, 110, 28, isPercent ? SPARK_HALF : 0) : "";
}

export async function render(root, { parts, signal }) {
  root.append(h("h1", {}, "Loops"));
  const { element: setElement, current, sets } = await setChoice("loops", parts[0], signal);
  if (parts[0] && !sets.some((one) => one.id === parts[0])) root.append(problem("This audit is not open. Another set of loops is shown."));
  if (!current) {
    root.append(h("p", {}, "There is no loop yet. ", h("a", { href: "#/drop" }, "Drop a file"), " first."));
    return null;
  }
  const setId = current.id;
  const wait = h("p", { class: "note", role: "status" }, "Loading the table …");
  root.append(wait);
  // Rows stay in memory, so that the table is there at once when the user comes back.
  const stored = loaded.get(setId) ?? { rows: new Map(), sparks: new Map(), version: 0 };
  loaded.set(setId, stored);
  const { rows, sparks } = stored;
  let ordered = null; // all rows in the order of the table
  let answer = await getJson(`/api/sets/${setId}/rows?since=${stored.version}`, signal);
  wait.remove();
  take(answer);
  const all = [...rows.values()];
  const columns = columnsOf(setId, all, sparks);
  const table = virtualTable({ columns: columns.filter((column) => !column.isExportOnly), label: "Loops", open: (row) => (location.hash = `#/loop/${setId}/${row.key}`), shown: fetchSparks, resorted: () => (ordered = null) });
  const filters = memory.get(setId) ?? { text: "", area: "", finding: "", state: "" };
  const search = h("input", { type: "search", placeholder: "Filter by text", "aria-label": "Filter by text", value: filters.text });
  const choices = {
    area: choice("Area", [...new Set(all.map((row) => row.area).filter(Boolean))].sort(), filters.area),
    finding: choice("Finding", [...Object.values(LEVELS), "Screened only", "Not diagnosed", "Waiting"], filters.finding),
    state: choice("State", [...new Set(all.map(stateWord).filter(Boolean))].sort(), filters.state),
  };
  choices.area.parentElement.hidden = choices.area.options.length < 3;
  const count = h("span", { class: "note", role: "status" });
  const progress = progressBar(setId, signal);
  const message = h("div", {});
  const empty = h("p", { class: "note" }, "No loops yet. Loops appear here when their files are read; ", h("a", { href: "#/drop" }, "Files"), " shows what was read, and takes more files.");
  const exports = ["xlsx", "csv", "parquet"].map((format) =>
    h("button", { onclick: () => exportShown(format).catch((error) => message.replaceChildren(problem(error.message))) }, format));
  root.append(
    h("div", { class: "row tools" }, setElement, search, ...Object.values(choices).map((one) => one.parentElement), count, h("span", { class: "row exports" }, "Export", exports)),
    progress.element, message, empty, table.element);

  function take(next) {
    stored.version = next.version;
    if (next.rows.length) ordered = null;
    stored.progress = next.progress ?? stored.progress;
    stored.confirmed = next.confirmed ?? stored.confirmed;
    for (const row of next.rows) {
      row.words = `${row.tag} ${row.area ?? ""} ${findingWord(row)} ${verdictWord(row)[1]} ${stateWord(row)} ${causeWord(row)} ${row.label ?? ""} ${stepWord(row)} ${row.source ?? ""}`.toLowerCase();
      rows.set(row.key, row);
    }
  }

  function filter(keepPlace = false) {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const { area, finding, state } = Object.fromEntries(Object.entries(choices).map(([name, one]) => [name, one.value]));
    memory.set(setId, { text: search.value, area, finding, state, sorting: table.sorting() });
    ordered ??= table.sorted([...rows.values()]);
    const matching = ordered.filter((row) =>
      words.every((word) => row.words.includes(word)) && (!area || row.area === area) && (!finding || levelWord(row) === finding) && (!state || stateWord(row) === state));
    table.setRows(matching, keepPlace);
    empty.hidden = rows.size > 0;
    const { confirmed = 0, refuted = 0 } = stored.confirmed ?? {};
    const notes = confirmed + refuted ? `; notes confirm ${confirmed} of ${confirmed + refuted} verdicts "stiction"` : "";
    count.textContent = (matching.length === rows.size ? counted(rows.size, "loop") : `${matching.length} of ${counted(rows.size, "loop")}`) + notes;
  }

  async function fetchSparks(visible) {
    const missing = visible.filter((row) => !row.spark && !sparks.has(row.key) && row.has_signals).map((row) => row.key);
    if (!missing.length) return;
    for (const key of missing) sparks.set(key, null);
    try {
      const { sparks: found } = await getJson(`/api/sets/${setId}/sparks?keys=${missing.join(",")}`, signal);
      for (const [key, values] of Object.entries(found)) sparks.set(Number(key), values);
      if (!signal.aborted) table.redraw();
    } catch {
      for (const key of missing) sparks.delete(key);
    }
  }

  async function exportShown(format) {
    const written = columns.filter((column) => !column.isPicture);
    const body = {
      format,
      columns: written.map((column) => ({ name: column.name === "period_s" ? "Period [s]" : column.label, type: column.number ? "number" : "text" })),
      rows: table.rows().map((row) => written.map((column) => (column.text ?? column.value)(row) ?? null)),
    };
    saveFile(await fetchFile("POST", "/api/export", body));
  }

  let typing = 0;
  search.addEventListener("input", () => {
    clearTimeout(typing);
    typing = setTimeout(() => filter(), TYPING_MS);
  });
  for (const one of Object.values(choices)) one.addEventListener("change", () => filter());
  table.sortBy(filters.sorting?.name ?? (all.some((row) => row.priority) ? "priority" : "finding"), filters.sorting?.descending);
  filter();
  progress.show(stored.progress);

  let timer = 0;
  async function poll() {
    try {
      answer = await getJson(`/api/sets/${setId}/rows?since=${stored.version}`, signal);
      take(answer);
      progress.show(stored.progress);
      if (answer.rows.length && !all.length) window.dispatchEvent(new HashChangeEvent("hashchange")); // its columns are known now
      else if (answer.rows.length) filter(true);
      message.replaceChildren();
    } catch (error) {
      if (error.name === "AbortError") return;
      message.replaceChildren(problem(error.message));
    }
    if (!signal.aborted) timer = setTimeout(poll, stored.progress?.running ? POLL_MS : SLOW_POLL_MS);
  }
  timer = setTimeout(poll, POLL_MS);
  return () => {
    clearTimeout(timer);
    memory.set(setId, { ...memory.get(setId), sorting: table.sorting() });
    table.destroy();
  };
}

function choice(label, options, value) {
  const select = h("select", { "aria-label": label }, h("option", { value: "" }, `${label}: all`), options.map((one) => h("option", { value: one, selected: one === value }, one)));
  h("span", {}, select);
  return select;
}

function progressBar(setId, signal) {
  const text = h("span", {});
  const bar = h("progress", { "aria-label": "Loops diagnosed" });
  const button = h("button", {});
  const element = h("div", { class: "row progress-row", hidden: true }, bar, text, button);
  let isRunning = false;
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      show(await sendJson("POST", `/api/sets/${setId}/run`, { run: !isRunning }, signal));
    } catch (error) {
      text.textContent = error.message;
    }
    button.disabled = false;
  });
  function show(progress) {
    if (!progress) return;
    element.hidden = progress.done >= progress.total;
    if (element.hidden) return;
    isRunning = progress.running;
    bar.max = progress.total;
    bar.value = progress.done;
    const rate = progress.per_second ? `, ${number(progress.per_second)} loops a second, ${duration(progress.left_s)} left` : "";
    text.textContent = `${progress.done} of ${counted(progress.total, "loop")} diagnosed${isRunning ? rate : ", stopped"}`;
    button.textContent = isRunning ? "Stop" : "Go on";
  }
  return { element, show };
}
