/** What the brush paints on: colour, height or mask; and what it lays there if not colour. */

import { COLORING, channels, setTool, takeChannel } from "../tool.js";
import { bar, choice, numberOf, plainNumber } from "./controls.js";
import { element } from "./element.js";

/** @typedef {import("../store.js").Store} Store */
/** @typedef {import("../tool.js").Tool} Tool */
/** @typedef {import("./brush_card.js").Row} Row */

const MOST_TEXELS = 8; // on the bar; more can be typed
const STEP = 0.25;
const WORDS = /** @type {const} */ ({
  base: { label: "Colour", tip: "Paint the layer's colour" },
  height: { label: "Height", tip: "Raise and lower the surface  ·  T" },
  mask: { label: "Mask", tip: "Paint how much of the layer is shown" },
});

/** Kinds that work on every channel. */
const KINDS = ["paint", "erase", "blur", "smudge", "clone", "fill", "gradient"];

/** @param {Store} store @returns {Row} */
export function channelRow(store) {
  const tool = /** @type {Tool} */ (store.get().tool);
  const offered = channels(store.get().facts);
  const channel = choice({
    label: "Paint on", value: tool.channel,
    choices: offered.map((value) => ({ value, ...WORDS[value] })),
    onchange: (value) => takeChannel(store, value),
  }); // prettier-ignore
  const node = element("div", { class: "row channels" }, channel.node);
  return {
    node,
    kinds: KINDS,
    needs: () => offered.length > 1,
    show: (now) => channel.set(now.channel),
  };
}

/** What is laid on heights and masks. @param {Store} store @returns {Row[]} */
export function layRows(store) {
  const tool = /** @type {Tool} */ (store.get().tool);
  const amount = amountBar(store);
  const adds = choice({
    label: "Heights", value: tool.adds ? "add" : "set",
    choices: [
      { value: "add", label: "Raise by", tip: "Add to the height that is there; below 0 it goes in" },
      { value: "set", label: "Bring to", tip: "Make everything this high" },
    ],
    onchange: (value) => setTool(store, { adds: value === "add" }),
  }); // prettier-ignore
  const reveal = choice({
    label: "Mask", value: tool.value > 0.5 ? "show" : "hide",
    choices: [
      { value: "hide", label: "Hide", tip: "Hide the layer where you paint" },
      { value: "show", label: "Show", tip: "Show the layer where you paint" },
    ],
    onchange: (value) => setTool(store, { value: value === "show" ? 1 : 0 }),
  }); // prettier-ignore
  return [
    {
      node: amount.node,
      kinds: COLORING,
      needs: (now) => now.channel === "height",
      show: (now) => amount.set(now.amount),
    },
    {
      node: adds.node,
      kinds: COLORING,
      needs: (now) => now.channel === "height",
      show: (now) => adds.set(now.adds ? "add" : "set"),
    },
    {
      node: element("div", { class: "row" }, element("span", { class: "row-label" }, "The layer"), reveal.node),
      kinds: COLORING,
      needs: (now) => now.channel === "mask",
      show: (now) => reveal.set(now.value > 0.5 ? "show" : "hide"),
    },
  ];
}

/** How far heights go out, or in. @param {Store} store */
export function amountBar(store) {
  return bar({
    label: "Height", least: -MOST_TEXELS, most: MOST_TEXELS, step: STEP, signed: true, open: true,
    value: store.get().tool?.amount ?? 0, unit: "texels", words: signedNumber,
    read: (text) => numberOf(text.replace("\u2212", "-")),
    tip: "Out of the surface, or into it below 0  ·  X turns it round",
    onchange: (value) => setTool(store, { amount: value }),
  }); // prettier-ignore
}

/**
 * A number that says which way it goes.
 *
 * @param {number} value
 */
export function signedNumber(value) {
  const sign = value > 0 ? "+" : value < 0 ? "\u2212" : "";
  return sign + plainNumber(Math.abs(value));
}
