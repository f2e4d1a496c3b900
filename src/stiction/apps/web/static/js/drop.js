// Files: drop or choose files, see what was read, correct the columns, diagnose.

import { fetchFile, getJson, saveFile, sendJson, uploadFile } from "./api.js";
import { columnTable } from "./column_table.js";
import { announce, counted, duration, h, number, problem } from "./dom.js";

export const title = "Files";
const POLL_MS = 250;
const SHOWN_LOOPS = 50;
const PASTED_NAME = "pasted table.txt";

/** Files of a drop, those in folders included, each with the path that the folder gives it. */
async function droppedFiles(items) {
  const files = [];
  async function walk(entry, path) {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      if (!file.name.startsWith(".")) files.push({ file, name: path + file.name });
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!entries.length) return;
      for (const one of entries) await walk(one, `${path}${entry.name}/`);
    }
  }
  const entries = [...items].map((item) => item.webkitGetAsEntry?.() ?? item.getAsFile()).filter(Boolean);
  for (const entry of entries) {
    if (entry instanceof File) files.push({ file: entry, name: entry.name });
    else await walk(entry, "");
  }
  return files;
}

function optionFields() {
  const field = (name, label, hint) => h("label", {}, label, h("input", { name, type: "text", placeholder: hint, autocomplete: "off" }));
  const form = h(
    "form",
    { class: "row", onsubmit: (event) => event.preventDefault() },
    field("dt", "Sampling period [s]", "from the time stamps"),
    field("time_format", "Format of the time", "%d.%m.%Y %H:%M:%S"),
    h("label", {}, "Day first (01/02 is the first of February)",
      h("select", { name: "day_first" }, h("option", { value: "" }, "as found"), h("option", { value: "yes" }, "yes"), h("option", { value: "no" }, "no"))),
    field("timezone", "Time zone", "Europe/Berlin"),
    field("delimiter", "Delimiter", "as found"),
    field("decimal", "Decimal mark", "as found"),
    field("sheet", "Sheet", "all"),
    field("op_low", "OP at 0 %", "0"),
    field("op_high", "OP at 100 %", "100"),
  );
  const values = () => Object.fromEntries(new FormData(form).entries());
  return { element: h("details", {}, h("summary", {}, "How the files are written"), form), values };
}

export async function render(root, { signal }) {
  const list = h("div", { class: "sources" });
  const uploads = h("div", { class: "uploads" });
  const options = optionFields();
  const picker = h("input", { type: "file", multiple: true, hidden: true, "aria-label": "Files", onchange: () => send([...picker.files].map((file) => ({ file, name: file.name }))) });
  const folderPicker = h("input", { type: "file", multiple: true, hidden: true, "aria-label": "Folder", onchange: () => send([...folderPicker.files].map((file) => ({ file, name: file.webkitRelativePath }))) });
  folderPicker.webkitdirectory = true;
  const paste = h("textarea", { rows: 3, "aria-label": "Table copied from a spreadsheet", placeholder: "Paste a table copied from a spreadsheet: time, PV, OP, SP with headings" });
  const zone = h(
    "section",
    { class: "card drop-zone", "aria-label": "Drop zone" },
    h("p", { class: "drop-lead" }, "Drop trend files or folders here"),
    h("p", { class: "note" }, "CSV and other text, Excel, Parquet, MATLAB; also gz, zst, zip. They stay on this computer."),
    h("div", { class: "row center" },
      h("button", { class: "primary", onclick: () => picker.click() }, "Choose files"),
      h("button", { onclick: () => folderPicker.click() }, "Choose a folder")),
    picker, folderPicker,
    h("details", { class: "paste" }, h("summary", {}, "Paste a table (or press Ctrl+V anywhere here)"), paste,
      h("button", { onclick: () => paste.value.trim() && send([{ file: new Blob([paste.value]), name: PASTED_NAME }]) }, "Read the pasted table")),
    options.element,
  );
  // Files may be dropped, and a table pasted, anywhere on this screen: a browser would open a file that misses the zone.
  let maxBytes = Infinity;
  const listen = (type, listener) => document.addEventListener(type, listener, { signal });
  listen("dragover", (event) => {
    event.preventDefault();
    zone.classList.add("over");
  });
  listen("dragleave", () => zone.classList.remove("over"));
  listen("drop", async (event) => {
    event.preventDefault();
    zone.classList.remove("over");
    send(await droppedFiles(event.dataTransfer.items));
  });
  listen("paste", (event) => {
    const text = event.clipboardData.getData("text/plain");
    if (event.target.closest("input, textarea, select") || !text.trim().includes("\n")) return;
    send([{ file: new Blob([text]), name: PASTED_NAME }]);
  });

  async function send(files) {
    const ids = [];
    uploads.querySelectorAll(".problem").forEach((one) => one.parentElement.remove());
    for (const { file, name } of files) {
      const bar = h("progress", { max: 1, value: 0, "aria-label": `Upload of ${name}` });
      const line = h("div", { class: "upload" }, h("span", {}, name), bar);
      uploads.append(line);
      try {
        if (file.size > maxBytes) throw new Error(`${name} is larger than ${maxBytes / 1e6} MB. Start the server with it: stiction serve FILE.`);
        const answer = await uploadFile(`/api/files?name=${encodeURIComponent(name)}`, file, (share) => (bar.value = share), signal);
        ids.push(answer.id);
        line.remove();
      } catch (error) {
        line.replaceChildren(problem(error.message));
      }
    }
    picker.value = folderPicker.value = "";
    if (!ids.length) return;
    try {
      watch(await sendJson("POST", "/api/readings", { files: ids, options: options.values() }));
    } catch (error) {
      uploads.append(h("div", {}, problem(error.message)));
    }
  }

  /** Show a drop when its files are read. */
  async function watch(reading) {
    const box = h("section", { class: "card", "aria-label": "Files read" });
    list.prepend(box);
    try {
      while (reading.running && !signal.aborted) {
        box.replaceChildren(h("p", {}, `Reading ${reading.files.length === 1 ? "the file" : `${reading.files.length} files`} …`), h("progress", { "aria-label": "Files read" }));
        await new Promise((resolve) => setTimeout(resolve, POLL_MS));
        reading = await getJson(`/api/readings/${reading.id}`, signal);
      }
      if (!signal.aborted) showReading(box, reading, options);
    } catch (error) {
      if (error.name !== "AbortError") box.replaceChildren(problem(error.message));
    }
  }

  root.append(h("h1", {}, "Is the valve sticking?"), h("p", { class: "note" }, "Drop one to three hours of PV, OP and SP, every 1 to 5 seconds, uncompressed."), zone, uploads, list);
  const { readings, max_file_bytes: limit } = await getJson("/api/readings", signal);
  maxBytes = limit;
  for (const reading of readings) watch(reading);
}

/** What came of a drop: loops, troubles, assumptions, and the table of columns to correct. */
function showReading(box, reading, options) {
  const { files, loops, error, failures, columns } = reading;
  const message = h("div", {});
  const button = h("button", { class: "primary" }, reading.added ? "Show the loops" : `Diagnose ${loops.length === 1 ? "the loop" : counted(loops.length, "loop")}`);
  button.hidden = !loops.length;
  button.addEventListener("click", async () => {
    button.disabled = true;
    try {
      const { set, keys } = await sendJson("POST", `/api/readings/${reading.id}/diagnose`, {});
      location.hash = keys.length === 1 ? `#/loop/${set}/${keys[0]}` : `#/loops/${set}`;
    } catch (failure) {
      message.replaceChildren(problem(failure.message));
      button.disabled = false;
    }
  });
  const names = files.length > 3 ? `${files.slice(0, 3).join(", ")} and ${files.length - 3} more` : files.join(", ");
  // Troubles first: a file that cannot be read must not be overlooked below many others.
  const troubles = error ? [problem(error)] : failures.map(problem);
  box.replaceChildren(h("h2", {}, names), ...troubles, h("div", { class: "row diagnose-row" }, button), message, ...loopTable(loops), ...remarks(reading), columns.length ? columnPart(box, reading, options) : "");
  announce(error ?? `${files.length === 1 ? "The file is" : `${files.length} files are`} read.`);
}

function columnPart(box, reading, options) {
  const table = columnTable(reading.columns);
  const message = h("div", {});
  const again = h("button", {}, "Read again with these columns");
  again.addEventListener("click", async () => {
    again.disabled = true;
    try {
      const rows = table.rows();
      const next = await sendJson("POST", `/api/readings/${reading.id}`, { rows, options: options.values() });
      if (next.error) next.columns = next.columns.length ? next.columns.map((old, i) => ({ ...old, ...rows[i] })) : rows;
      showReading(box, next, options);
    } catch (error) {
      message.replaceChildren(problem(error.message));
      again.disabled = false;
    }
  });
  const save = h("button", { onclick: async () => saveFile(await fetchFile("POST", "/api/map", { rows: table.rows() })) }, "Download the map");
  return h("details", { open: Boolean(reading.error) }, h("summary", {}, "Which column is which"), table.element, h("div", { class: "row" }, again, save), message);
}

/** What was found: one row for each loop. */
function loopTable(loops) {
  const rows = loops.slice(0, SHOWN_LOOPS).map((loop) =>
    h("tr", {},
      h("td", {}, loop.tag),
      h("td", { class: "number" }, String(loop.samples)),
      h("td", { class: "number" }, duration(loop.dt)),
      h("td", { class: "number" }, duration(loop.samples * loop.dt)),
      h("td", { class: "number" }, number(loop.bad_percent, "%")),
      h("td", { class: "number" }, String(loop.gaps)),
      h("td", {}, Object.entries(loop.columns).map(([signal, column]) => `${signal.toUpperCase()} = ${column}`).join(", "))),
  );
  const heads = ["Loop", "Samples", "Every", "Length", "Missing", "Gaps", "Columns"];
  const found = loops.length === 1 ? "One loop was found." : `${loops.length} loops were found${loops.length > SHOWN_LOOPS ? `; the first ${SHOWN_LOOPS} are listed` : ""}.`;
  if (!loops.length) return [];
  return [
    h("p", {}, found),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Loops found" },
      h("table", {}, h("thead", {}, h("tr", {}, heads.map((head, i) => h("th", { class: i > 0 && i < 6 ? "number" : null, scope: "col" }, head)))), h("tbody", {}, rows))),
  ];
}

/** Texts in place of numbers, and what was assumed. */
function remarks(source) {
  const bad = source.loops.flatMap((loop) => Object.entries(loop.bad_values).map(([text, n]) => `${n} × "${text}" in ${loop.tag}`)).slice(0, 5);
  return [
    bad.length ? h("p", { class: "note" }, `Texts in place of numbers: ${bad.join("; ")}.`) : null,
    source.assumptions?.length ? h("ul", { class: "note" }, source.assumptions.slice(0, 20).map((text) => h("li", {}, text))) : null,
  ].filter(Boolean);
}
