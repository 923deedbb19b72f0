/** Fields for parameters that the server describes: name, type, default, least, most, words. */

import { toHex } from "../color.js";
import { bar, plainNumber, select, sentence, toggle } from "./controls.js";
import { element } from "./element.js";

/**
 * @typedef {object} Parameter
 * @property {string} name
 * @property {string} type "length", "number", "share", "count", "seed", "point", "direction", "color", "switch", "choice"
 * @property {any} default
 * @property {number | null} [least]
 * @property {number | null} [most]
 * @property {string[]} [choices]
 * @property {string} [words]
 */

/** @typedef {(value: any, done: boolean) => void} Change */

/**
 * @param {Parameter} parameter
 * @param {any} value
 * @param {Change} onchange
 * @returns {HTMLElement}
 */
export function parameterField(parameter, value, onchange) {
  const label = sentence(parameter.name);
  const [type, choices = ""] = parameter.type.split(":");
  const tip = parameter.words ? sentence(parameter.words) : undefined;
  if (type === "color") return colorField(label, tip, value, onchange);
  if (type === "switch")
    return toggle({ label, tip, value, onchange: (on) => onchange(on, true) }).node;
  if (type === "choice") {
    const names = parameter.choices ?? choices.split("|");
    return select({
      label, value, choices: names.map((one) => ({ value: one, label: sentence(one) })),
      onchange: (chosen) => onchange(chosen, true),
    }).node; // prettier-ignore
  }
  if (type === "seed") return seedField(label, tip, value, onchange);
  if (type === "point" || type === "direction") return tripleField(label, tip, value, onchange);
  return bar({ label, tip, value, onchange, ...rangeOf(parameter, type) }).node;
}

/**
 * What a bar offers: the server's limits where they are near, else a range around the default.
 *
 * @param {Parameter} parameter
 * @param {string} type
 * @returns {{least: number, most: number, step?: number, log?: boolean, open?: boolean, words?: (value: number) => string}}
 */
export function rangeOf(parameter, type) {
  const { least, most } = parameter;
  const usual = Math.abs(Number(parameter.default)) || 1;
  if (type === "share") return { least: 0, most: 1, step: 0.01 };
  if (type === "count")
    return { least: least ?? 1, most: Math.min(most ?? 32, 12), step: 1, open: true };
  if (type === "length") {
    return { least: usual / 20, most: usual * 20, log: true, open: true, words: plainNumber };
  }
  const low = isNear(least) ? least : Math.min(0, -usual * (parameter.default < 0 ? 3 : 0));
  const high = isNear(most) ? most : usual * 3;
  return { least: low, most: high, open: true, words: plainNumber };
}

/** @param {number | null | undefined} limit @returns {limit is number} */
const isNear = (limit) => typeof limit === "number" && Math.abs(limit) < 1e6;

/** @param {string} label @param {string | undefined} tip @param {any} value @param {Change} onchange */
function colorField(label, tip, value, onchange) {
  const text = typeof value === "string" ? value : toHex(value);
  const box = element("input", {
    type: "color", value: text, "aria-label": label,
    oninput: () => onchange(box.value, false), onchange: () => onchange(box.value, true),
  }); // prettier-ignore
  return element(
    "label",
    { class: "row color-field", title: tip },
    element("span", { class: "row-label" }, label),
    box,
  );
}

/** @param {string} label @param {string | undefined} tip @param {number} value @param {Change} onchange */
function seedField(label, tip, value, onchange) {
  const box = numberBox(label, value, (found) => take(Math.max(Math.round(found), 0)));
  const take = (/** @type {number} */ found) => {
    box.value = String(found);
    onchange(found, true);
  };
  const next = element(
    "button",
    {
      type: "button",
      class: "chip-button wide",
      onclick: () => take((Number(box.value) || 0) + 1),
    },
    "Another",
  );
  return element(
    "div",
    { class: "row", title: tip },
    element("span", { class: "row-label" }, label),
    box,
    next,
  );
}

/** @param {string} label @param {string | undefined} tip @param {number[]} value @param {Change} onchange */
function tripleField(label, tip, value, onchange) {
  const now = [...value];
  const boxes = ["x", "y", "z"].map((axis, i) =>
    numberBox(`${label}, ${axis}`, now[i], (found) => {
      now[i] = found;
      if (now.some((one) => one !== 0) || !/direction|axis$/i.test(label)) onchange([...now], true);
    }),
  );
  return element(
    "div",
    { class: "row triple", role: "group", "aria-label": label, title: tip },
    element("span", { class: "row-label" }, label),
    boxes,
  );
}

/** @param {string} label @param {number} value @param {(value: number) => void} onchange */
function numberBox(label, value, onchange) {
  const box = element("input", {
    type: "text", inputMode: "decimal", class: "number", value: plainNumber(value), "aria-label": label,
    autocomplete: "off",
    onchange: () => {
      const found = Number.parseFloat(box.value.replace(",", "."));
      box.setAttribute("aria-invalid", String(!Number.isFinite(found)));
      if (Number.isFinite(found)) onchange(found);
    },
    onfocus: () => box.select(),
    onkeydown: (/** @type {KeyboardEvent} */ event) => event.key === "Enter" && box.blur(),
  }); // prettier-ignore
  return box;
}
