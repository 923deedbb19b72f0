/** Symmetry of a brush: mirrors, and repetition around an axis. */

import { setTool } from "../tool.js";
import { bar, choice } from "./controls.js";
import { element } from "./element.js";

/** @typedef {import("../tool.js").Tool} Tool */

const AXES = ["x", "y", "z"];
const MOST_COPIES = 64; // as the server has it: turns times mirrors
const MOST_TURNS = 16;

/**
 * The mirrors, which are used often, and the turns, which are not.
 *
 * @param {import("../store.js").Store} store
 */
export function symmetryRows(store) {
  const now = () => /** @type {Tool} */ (store.get().tool).symmetry;
  const change = (/** @type {Partial<Tool["symmetry"]>} */ patch) => {
    setTool(store, { symmetry: limited({ ...now(), ...patch }) });
  };
  const mirrors = AXES.map((axis) =>
    element(
      "button",
      {
        type: "button", class: "chip-button", title: `Mirror across ${axis}`,
        "aria-label": `Mirror across ${axis}`, onclick: () => change({ mirror: mirrored(now().mirror, axis) }),
      },
      axis.toUpperCase(),
    ),
  ); // prettier-ignore
  const turns = bar({
    label: "Turns", least: 1, most: MOST_TURNS, step: 1, value: now().radial,
    tip: "How often a stroke is repeated around an axis", onchange: (radial) => change({ radial }),
  }); // prettier-ignore
  const axis = choice({
    label: "Axis of the turns", value: now().axis,
    choices: AXES.map((one) => ({ value: one, label: one.toUpperCase(), tip: `Around ${one}` })),
    onchange: (value) => change({ axis: value }),
  }); // prettier-ignore
  const center = choice({
    label: "Centre of the symmetry", value: "middle",
    choices: [
      { value: "middle", label: "Middle", tip: "Through the middle of the mesh's box" },
      { value: "origin", label: "Origin", tip: "Through the origin of the mesh's coordinates" },
    ],
    onchange: (value) => change({ center: centerOf(store, value) }),
  }); // prettier-ignore
  const chips = element(
    "div",
    { class: "chip-buttons", role: "group", "aria-label": "Mirror" },
    mirrors,
  );
  const label = (/** @type {string} */ words, /** @type {HTMLElement} */ control) =>
    element("div", { class: "row" }, element("span", { class: "row-label" }, words), control);
  const centerRow = label("Centre", center.node);
  const axisRow = label("Axis", axis.node);
  /** @param {Tool} tool */
  const showMirrors = ({ symmetry }) => {
    mirrors.forEach((one, i) => {
      one.setAttribute("aria-pressed", String(symmetry.mirror.includes(AXES[i])));
    });
  };
  /** @param {Tool} tool */
  const showTurns = ({ symmetry }) => {
    turns.set(symmetry.radial);
    axis.set(symmetry.axis);
    axisRow.hidden = symmetry.radial === 1;
    centerRow.hidden = symmetry.radial === 1 && symmetry.mirror === "";
    center.set(same(symmetry.center, centerOf(store, "origin")) ? "origin" : "middle");
  };
  return [
    { node: label("Mirror", chips), show: showMirrors },
    { node: element("div", { class: "rows" }, turns.node, axisRow, centerRow), show: showTurns },
  ];
}

/**
 * Add or take away a mirror; letters stay in order.
 *
 * @param {string} mirror
 * @param {string} axis
 */
export function mirrored(mirror, axis) {
  return AXES.filter((one) => mirror.includes(one) !== (one === axis)).join("");
}

/**
 * As many turns as the server allows beside the mirrors.
 *
 * @param {Tool["symmetry"]} symmetry
 */
export function limited(symmetry) {
  const most = MOST_COPIES / 2 ** symmetry.mirror.length;
  return {
    ...symmetry,
    radial: Math.min(Math.max(Math.round(symmetry.radial), 1), most, MOST_TURNS),
  };
}

/**
 * A point in the mesh's own coordinates, which brushes are described in.
 *
 * @param {import("../store.js").Store} store
 * @param {string} name
 * @returns {[number, number, number]}
 */
function centerOf(store, name) {
  const box = store.get().facts?.box;
  if (name === "origin" || !box) return [0, 0, 0];
  const middle = [0, 1, 2].map((axis) => (box[0][axis] + box[1][axis]) / 2);
  return /** @type {[number, number, number]} */ (middle);
}

/** @param {readonly number[]} a @param {readonly number[]} b */
const same = (a, b) => a.every((value, i) => Math.abs(value - b[i]) < 1e-9);
