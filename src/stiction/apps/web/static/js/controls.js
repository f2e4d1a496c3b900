// Sliders, each with a number field; both show and set one quantity.

import { h } from "./dom.js";

const STEPS = 1000;
const DECADES = 1;

/** A number as short text: five significant digits, no needless zeros. */
export function shortNumber(value) {
  return Number(Number(value).toPrecision(5)).toString();
}

/** Ends of a slider for a quantity whose usual value is `value`; a logarithmic slider keeps the sign of the value. */
function sliderEnds(quantity, value, widest) {
  if (quantity.scale === "log") {
    const size = Math.abs(value) || Math.max(quantity.low, 0.1);
    return [size / 10 ** DECADES, size * 10 ** DECADES];
  }
  const top = Math.max(3 * Math.abs(value), widest ?? 1);
  const step = 10 ** Math.floor(Math.log10(top));
  return [Math.max(quantity.low, quantity.low < 0 ? -top : 0), Math.min(quantity.high, Math.ceil(top / step) * step)];
}

/**
 * Make a slider with its number field.
 *
 * `quantity` is {label, unit, low, high, scale}; `usual` sets the ends of the slider, and `widest` the least upper end of
 * a linear one. `onInput(value)` is called at each move. Returns {element, value, set(value), setUsual(value), show(bool)}.
 */
export function slider({ name, quantity, value, usual = value, widest, onInput }) {
  let ends = sliderEnds(quantity, usual, widest);
  let current = value;
  const id = `control-${name}`;
  const unit = quantity.unit === "-" ? "" : quantity.unit;
  const range = h("input", { type: "range", id, min: "0", max: String(STEPS), step: "1", class: "slider", "data-name": name });
  const field = h("input", { type: "text", inputmode: "decimal", autocomplete: "off", class: "number-field", "aria-label": `${quantity.label}, number`, "data-name": name });
  const element = h(
    "div",
    { class: "control" },
    h("label", { for: id, class: "control-label" }, quantity.label, unit ? h("span", { class: "unit" }, ` [${unit}]`) : null),
    h("div", { class: "control-inputs" }, range, field),
  );

  function toPosition(number) {
    if (quantity.scale !== "log") return (STEPS * (number - ends[0])) / (ends[1] - ends[0]);
    const size = Math.max(Math.abs(number), ends[0]);
    return (STEPS * Math.log(size / ends[0])) / Math.log(ends[1] / ends[0]);
  }
  function toValue(position) {
    const share = position / STEPS;
    if (quantity.scale !== "log") return Number((ends[0] + share * (ends[1] - ends[0])).toPrecision(4));
    const sign = current < 0 || (current === 0 && usual < 0) ? -1 : 1;
    return Number((sign * ends[0] * (ends[1] / ends[0]) ** share).toPrecision(4));
  }
  function showRange() {
    range.value = String(Math.round(Math.min(Math.max(toPosition(current), 0), STEPS)));
    range.setAttribute("aria-valuetext", `${shortNumber(current)} ${unit}`);
  }
  range.addEventListener("input", () => {
    current = toValue(Number(range.value));
    field.value = shortNumber(current);
    field.removeAttribute("aria-invalid");
    range.setAttribute("aria-valuetext", `${shortNumber(current)} ${unit}`);
    onInput(current);
  });
  field.addEventListener("change", () => {
    const number = Number(field.value.trim().replace(",", "."));
    const wrong = field.value.trim() === "" || Number.isNaN(number);
    field.toggleAttribute("aria-invalid", wrong);
    if (wrong) {
      onInput(field.value.trim());
      return;
    }
    current = number;
    showRange();
    onInput(current);
  });
  const set = (number) => {
    current = number;
    field.value = shortNumber(number);
    field.removeAttribute("aria-invalid");
    showRange();
  };
  set(value);
  return {
    element,
    get value() {
      return current;
    },
    set,
    setUsual(number) {
      usual = number;
      ends = sliderEnds(quantity, number, widest);
      showRange();
    },
    show(visible) {
      element.hidden = !visible;
    },
  };
}

/** A list to choose from; `choices` is {value: label}. Returns {element, set(value)}. */
export function choice({ name, label, choices, value, onInput }) {
  const id = `control-${name}`;
  const select = h("select", { id, "data-name": name }, Object.entries(choices).map(([key, text]) => h("option", { value: key }, text)));
  select.value = value;
  select.addEventListener("change", () => onInput(select.value));
  const element = h("div", { class: "control" }, h("label", { for: id, class: "control-label" }, label), select);
  return { element, set: (next) => (select.value = next) };
}
