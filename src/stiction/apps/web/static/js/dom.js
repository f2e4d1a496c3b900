// Elements from data. All text goes in as text, never as markup, so that no tag of a plant can become HTML.

/** Make an element: h("p", {class: "note"}, "text", child). `on<event>` attributes are listeners. */
export function h(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key in element && typeof value !== "string") element[key] = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** Make an SVG element. */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Say something to screen readers and in the status line. */
export function announce(text) {
  document.getElementById("status").textContent = text;
}

/** A message about something that went wrong. */
export function problem(text) {
  return h("p", { class: "problem", role: "alert" }, text);
}

/** A number with three significant digits; a dash when it is not known. */
export function number(value, unit = "", digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = Math.abs(value) >= 1000 ? Math.round(value).toString() : Number(value.toPrecision(digits)).toString();
  return unit ? `${text}\u00a0${unit}` : text;
}

/** A duration in the unit that a person would use. */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  if (seconds >= 3 * 86400) return number(seconds / 86400, "d");
  if (seconds >= 7200) return number(seconds / 3600, "h");
  if (seconds >= 120) return number(seconds / 60, "min");
  return number(seconds, "s");
}

/** A count with its noun: counted(1, "loop") is "1 loop". */
export function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? "" : "s"}`;
}

/** A probability with two decimals, never as 0 or 1. */
export function probability(value) {
  const text = value.toFixed(2);
  return { "0.00": "<0.01", "1.00": ">0.99" }[text] ?? text;
}

const CLOCK = new Intl.DateTimeFormat("sv-SE", { dateStyle: "short", timeStyle: "short" });
const ZONE = new Intl.DateTimeFormat("en-GB", { timeZoneName: "short" });

/** A time of the server in the time zone of this computer, with its name. */
export function clockTime(text) {
  const time = new Date(text);
  const zone = ZONE.formatToParts(time).find((part) => part.type === "timeZoneName").value;
  return `${CLOCK.format(time)} ${zone}`;
}

/** A box that scrolls sideways; the keyboard can reach and move it. */
export function scrollBox(label, ...children) {
  return h("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, ...children);
}
