/** The few controls that all panels are made of: bars to drag, choices, switches, buttons. */

import { element, setVars } from "./element.js";
import { icon } from "./icons.js";

let lastId = 0;
/** @param {string} word */
export const uniqueId = (word) => `${word}-${++lastId}`;

/**
 * @typedef {object} BarOptions
 * @property {string} label
 * @property {number} least
 * @property {number} most
 * @property {number} value
 * @property {number} [step] of the arrow keys and of rounding; a hundredth of the range if not given
 * @property {boolean} [log] whether equal ways on the bar are equal ratios
 * @property {boolean} [signed] whether the bar fills from its middle
 * @property {boolean} [open] whether numbers beyond the ends of the bar may be typed
 * @property {string} [unit]
 * @property {(value: number) => string} [words] number to text
 * @property {(text: string) => number} [read] text to number
 * @property {string} [tip]
 * @property {(value: number, done: boolean) => void} onchange done: let go, or typed
 */

const STEPS = 1000; // places on a bar
const FAR = 10; // arrow steps with Shift

/** A bar that fills as one drags; its number can be typed. */
class Bar {
  /** @param {BarOptions} options */
  constructor(options) {
    this.options = options;
    this.value = options.value;
    this.words = options.words ?? plainNumber;
    this.read = options.read ?? numberOf;
    this.range = element("input", {
      type: "range", min: "0", max: String(STEPS), step: "any", "aria-label": options.label,
    }); // prettier-ignore
    this.number = element("input", {
      type: "text", class: "bar-number", inputMode: "decimal", autocomplete: "off",
      spellcheck: false, "aria-label": `${options.label}, number`,
    }); // prettier-ignore
    const hidden = { "aria-hidden": "true" };
    this.node = element(
      "div",
      { class: "bar", title: options.tip },
      this.range,
      element("span", { class: "bar-label", ...hidden }, options.label),
      this.number,
      options.unit ? element("span", { class: "bar-unit", ...hidden }, options.unit) : null,
    );
    this.#listen();
    this.#show();
  }

  /** @param {number} value */
  set(value) {
    if (value === this.value) return;
    this.value = value;
    this.#show();
  }

  #listen() {
    const { range, number } = this;
    range.addEventListener("input", () => this.#take(this.#fromPlace(Number(range.value)), false));
    range.addEventListener("change", () => this.#take(this.#fromPlace(Number(range.value)), true));
    range.addEventListener("keydown", (event) => this.#arrow(event));
    number.addEventListener("focus", () => number.select());
    number.addEventListener("blur", () => (number.value = this.words(this.value)));
    number.addEventListener("change", () => {
      const found = this.read(number.value);
      if (Number.isFinite(found)) this.#take(found, true);
      number.value = this.words(this.value);
    });
    number.addEventListener("keydown", (event) => {
      if (event.key === "Escape") number.value = this.words(this.value);
      if (event.key === "Enter" || event.key === "Escape") number.blur();
    });
  }

  /** @param {KeyboardEvent} event */
  #arrow(event) {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const { least, most, step, log } = this.options;
    const one = STEPS / 100;
    const far = step && !log ? Math.max((STEPS * step) / (most - least), one) : one;
    const place = this.#toPlace() + way * far * (event.shiftKey ? FAR : 1);
    this.#take(this.#fromPlace(Math.min(Math.max(place, 0), STEPS)), true);
  }

  /** @param {number} found @param {boolean} done */
  #take(found, done) {
    const { least, most, open, log } = this.options;
    const low = open && !log ? -Infinity : least;
    this.value = Math.min(Math.max(found, low), open ? Infinity : most);
    this.#show();
    this.options.onchange(this.value, done);
  }

  #toPlace() {
    const { least, most, log } = this.options;
    const share = log
      ? Math.log(this.value / least) / Math.log(most / least)
      : (this.value - least) / (most - least);
    return STEPS * Math.min(Math.max(share || 0, 0), 1);
  }

  /** @param {number} place */
  #fromPlace(place) {
    const { least, most, log, step } = this.options;
    const share = place / STEPS;
    const found = log ? least * (most / least) ** share : least + share * (most - least);
    return step ? Math.round(found / step) * step : found;
  }

  #show() {
    const { unit } = this.options;
    const text = this.words(this.value);
    const place = this.#toPlace();
    this.range.value = String(place);
    this.range.setAttribute("aria-valuetext", unit ? `${text} ${unit}` : text);
    if (document.activeElement !== this.number) this.number.value = text;
    const share = (100 * place) / STEPS;
    const from = this.options.signed ? 50 : 0;
    setVars(this.node, { fill: `${share}%`, from: `${Math.min(share, from)}%`, way: `${Math.abs(share - from)}%` });
  }
}

/** @param {BarOptions} options */
export const bar = (options) => new Bar(options);

/** @param {string} text with a comma or a point */
export const numberOf = (text) => Number.parseFloat(text.replace(",", "."));

/**
 * Three meaningful digits, without an exponent where people read one badly.
 *
 * @param {number} value
 */
export function plainNumber(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e6) return value.toExponential(2);
  return String(Number(value.toPrecision(3)));
}

/** @type {Pick<BarOptions, "least" | "most" | "step" | "unit" | "words" | "read">} */
export const PERCENT = {
  least: 0,
  most: 1,
  step: 0.01,
  unit: "%",
  words: (value) => String(Math.round(100 * value)),
  read: (text) => numberOf(text) / 100,
};

/**
 * A few choices side by side, of which one is chosen.
 *
 * @template {string} T
 * @param {{label: string, choices: {value: T, label: string, icon?: string, tip?: string}[], value: T, onchange: (value: T) => void}} options
 */
export function choice({ label, choices, value, onchange }) {
  const buttons = choices.map((one) =>
    element(
      "button",
      {
        type: "button", role: "radio", class: "choice-one", "data-value": one.value,
        "aria-label": one.icon ? one.label : undefined, title: one.tip,
        onclick: () => choose(one.value, true),
      },
      one.icon ? icon(one.icon) : one.label,
    ),
  ); // prettier-ignore
  const node = element(
    "div",
    { class: "choice", role: "radiogroup", "aria-label": label },
    buttons,
  );
  node.addEventListener("keydown", (event) => {
    const way = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const at = choices.findIndex((one) => one.value === value);
    const next = choices[(at + way + choices.length) % choices.length];
    choose(next.value, true);
    buttons[choices.indexOf(next)].focus();
  });
  /** @param {T} chosen @param {boolean} tell */
  function choose(chosen, tell) {
    value = chosen;
    buttons.forEach((button, i) => {
      const isChosen = choices[i].value === value;
      button.setAttribute("aria-checked", String(isChosen));
      button.tabIndex = isChosen ? 0 : -1;
    });
    if (tell) onchange(value);
  }
  choose(value, false);
  return { node, set: (/** @type {T} */ chosen) => choose(chosen, false) };
}

/**
 * A list that unfolds.
 *
 * @param {{label: string, choices: {value: string, label: string}[], value: string, shown?: boolean, onchange: (value: string) => void}} options
 */
export function select({ label, choices, value, shown = true, onchange }) {
  const list = element(
    "select",
    { "aria-label": label, onchange: () => onchange(list.value) },
    choices.map((one) => element("option", { value: one.value }, one.label)),
  );
  list.value = value;
  const node = element(
    "label",
    { class: "select" },
    shown ? element("span", { class: "row-label" }, label) : null,
    element("span", { class: "select-box" }, list, icon("chevron")),
  );
  return {
    node,
    set: (/** @type {string} */ chosen) => {
      list.value = chosen;
    },
  };
}

/**
 * On or off.
 *
 * @param {{label: string, value: boolean, tip?: string, onchange: (value: boolean) => void}} options
 */
export function toggle({ label, value, tip, onchange }) {
  const box = element("input", {
    type: "checkbox", role: "switch", checked: value, onchange: () => onchange(box.checked),
  }); // prettier-ignore
  const node = element(
    "label",
    { class: "toggle", title: tip },
    element("span", { class: "row-label" }, label),
    box,
  );
  return {
    node,
    set: (/** @type {boolean} */ on) => {
      box.checked = on;
    },
  };
}

/**
 * @param {{icon: string, label: string, key?: string, class?: string, disabled?: boolean, onclick: (event: MouseEvent) => void}} options
 */
export function iconButton({ icon: name, label, key, onclick, ...rest }) {
  return element(
    "button",
    {
      type: "button", "aria-label": label, "data-tip": key ? `${label}  ·  ${key}` : label,
      ...rest, class: `icon-button ${rest.class ?? ""}`, onclick,
    },
    icon(name),
  ); // prettier-ignore
}

/**
 * @param {string} label
 * @param {() => void} onclick
 * @param {string} [style] "primary", "quiet"
 */
export function button(label, onclick, style = "") {
  return element("button", { type: "button", class: `button ${style}`, onclick }, label);
}

/**
 * "color-dodge" to "Color dodge".
 *
 * @param {string} name
 */
export function sentence(name) {
  const words = name.replaceAll(/[-_]/g, " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}
