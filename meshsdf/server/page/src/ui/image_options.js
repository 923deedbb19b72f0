/** The ways a picture can be laid on the model, and the controls that each has. */

import { longestSide } from "../tool.js";
import { bar, choice, PERCENT, plainNumber, select, sentence } from "./controls.js";
import { unitOf } from "./brush_card.js";
import { around, axesOf, flatParams, matrixOf, plus, SIDES, times, turned } from "./placement.js";

/** @typedef {import("./placement.js").Vec3} Vec3 */
/** @typedef {import("./placement.js").Camera} Camera */

/** What each projection is called, and what it does, in words. */
export const PROJECTION_WORDS = /** @type {Record<string, [name: string, hint: string]>} */ ({
  camera: [
    "From this view",
    "Move, size and turn the picture over the view. What is hidden stays clean.",
  ],
  decal: ["Sticker", "Click on the model where the sticker is to be."],
  planar: [
    "Along a direction",
    "Click on the model where its middle is to be. It goes through to the other side.",
  ],
  triplanar: ["From three sides", "For patterns that repeat all over."],
  cylindrical: ["Around an axis", "Wraps once around."],
  spherical: ["All around", "For panoramas; the picture's upper and lower borders become points."],
});

/**
 * @typedef {object} Settings
 * @property {number} size of the image's width, world units
 * @property {number} angle degrees
 * @property {number} depth of a sticker, in widths
 * @property {number} steepest degrees
 * @property {string} side "view", "x", "y" or "z"
 * @property {string} axis
 * @property {string} wrap
 * @property {number} sharpness
 * @property {number} height of what is wrapped around, in heights of the box
 * @property {number} fade of the picture while it is placed
 * @property {Vec3 | null} point
 * @property {Vec3 | null} normal
 */

/** @param {Record<string, any>} facts @returns {Settings} */
export function firstSettings(facts) {
  return {
    size: Number((0.4 * longestSide(facts)).toPrecision(2)), angle: 0, depth: 0.5, steepest: 80,
    side: "view", axis: "y", wrap: "repeat", sharpness: 4, height: 1, fade: 0.8, point: null, normal: null,
  }; // prettier-ignore
}

/** Which controls each projection has, in their order. */
export const CONTROLS = /** @type {Record<string, (keyof Settings)[]>} */ ({
  camera: ["fade", "steepest"],
  decal: ["size", "angle", "depth", "steepest"],
  planar: ["side", "size", "angle", "wrap"],
  triplanar: ["axis", "size", "angle", "sharpness", "wrap"],
  cylindrical: ["axis", "height", "angle", "wrap"],
  spherical: ["axis", "angle"],
});

/**
 * @param {keyof Settings} name
 * @param {Settings} settings
 * @param {Record<string, any>} facts
 * @param {(patch: Partial<Settings>, done: boolean) => void} onchange
 * @returns {HTMLElement}
 */
export function settingField(name, settings, facts, onchange) {
  const value = /** @type {any} */ (settings[name]);
  const change = (/** @type {any} */ found, done = true) => onchange({ [name]: found }, done);
  const number = (/** @type {any} */ options) => bar({ value, onchange: change, ...options }).node;
  const longest = longestSide(facts);
  const pick = (/** @type {string} */ label, /** @type {string[]} */ values) =>
    choice({
      label, value, onchange: change,
      choices: values.map((one) => ({ value: one, label: one.length === 1 ? one.toUpperCase() : sentence(one) })),
    }).node; // prettier-ignore
  if (name === "side") return pick("Along", ["view", "x", "y", "z"]);
  if (name === "axis") return pick("Axis that stands upright", ["x", "y", "z"]);
  if (name === "wrap") {
    const words = {
      repeat: "Repeat",
      mirror: "Repeat, mirrored",
      clamp: "Stretch the border",
      transparent: "Nothing",
    };
    const choices = Object.entries(words).map(([one, label]) => ({ value: one, label }));
    return select({ label: "Beside it", value, choices, onchange: change }).node;
  }
  if (name === "size") {
    return number({
      label: "Width",
      least: longest / 200,
      most: longest * 2,
      log: true,
      open: true,
      unit: unitOf(facts),
      words: plainNumber,
    });
  }
  if (name === "angle")
    return number({ label: "Turn", least: -180, most: 180, step: 1, unit: "°" });
  if (name === "steepest") {
    const tip = "Where the surface turns away farther than this, nothing is put on it";
    return number({ label: "Steepest", least: 5, most: 90, step: 1, unit: "°", tip });
  }
  if (name === "sharpness") {
    return number({
      label: "Sharpness",
      least: 1,
      most: 32,
      log: true,
      words: plainNumber,
      tip: "How suddenly one side gives way to the next",
    });
  }
  if (name === "fade") return number({ ...PERCENT, label: "Seen while placing" });
  if (name === "depth")
    return number({
      label: "Depth",
      least: 0.05,
      most: 3,
      log: true,
      words: plainNumber,
      unit: "widths",
    });
  return number({
    label: "Height",
    least: 0.05,
    most: 4,
    log: true,
    words: plainNumber,
    unit: "of the box",
  });
}

/**
 * The server's parameters of every projection but the camera's.
 *
 * @param {string} kind
 * @param {Settings} settings
 * @param {{ratio: number, box: [Vec3, Vec3], camera: Camera}} scene ratio: of height to width
 * @returns {Record<string, any>}
 */
export function projectionParams(kind, settings, { ratio, box, camera }) {
  const middle = /** @type {Vec3} */ ([0, 1, 2].map((i) => (box[0][i] + box[1][i]) / 2));
  const width = settings.size;
  const height = settings.size * ratio;
  if (kind === "decal") {
    const axes = turned(axesOf(settings.normal ?? viewed(camera), camera.up), settings.angle);
    const flat = flatParams("decal", axes, settings.point ?? middle, width, height);
    return { ...flat, depth: settings.depth * width, steepest: settings.steepest };
  }
  if (kind === "planar") {
    const side = SIDES[settings.side] ?? { out: viewed(camera), up: camera.up };
    const axes = turned(axesOf(side.out, side.up), settings.angle);
    return {
      ...flatParams("planar", axes, settings.point ?? middle, width, height),
      wrap: settings.wrap,
    };
  }
  const axes = turned(around(settings.axis), settings.angle);
  if (kind === "triplanar") {
    const flat = { width, height, matrix: matrixOf(axes, middle) };
    return { ...flat, sharpness: settings.sharpness, wrap: settings.wrap };
  }
  if (kind === "spherical") return { matrix: matrixOf(axes, middle) };
  const along = { x: 0, y: 1, z: 2 }[settings.axis] ?? 1;
  const side = box[1][along] - box[0][along];
  const low = plus(middle, times(axes.out, -side / 2));
  return { height: settings.height * side, wrap: settings.wrap, matrix: matrixOf(axes, low) };
}

/** @param {Camera} camera @returns {Vec3} from what is looked at to the eye */
const viewed = ({ eye, target }) => [eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]];
