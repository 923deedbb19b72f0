/** The picker's square and hue bar: two sliders in a plane, and one along a line. */

import { fromOklch, fromPick, largestChroma, toHex } from "../color.js";
import { element, oncePerFrame, setVars } from "./element.js";

/** @typedef {import("../color.js").Pick} Pick */

const SIDE = 48; // samples along the square; the browser smooths between them
const HUES = 90;

/**
 * Lightness upwards, vividness to the right.
 *
 * @param {(patch: Partial<Pick>, done: boolean) => void} onchange
 */
export function colorSquare(onchange) {
  const canvas = element("canvas", { width: SIDE, height: SIDE });
  const thumb = element("span", { class: "square-thumb" });
  const node = slider("square", "Lightness and vividness", 100, canvas, thumb);
  let pick = { l: 0, s: 0, h: -1 };
  const paint = oncePerFrame((/** @type {number} */ hue) => drawSquare(canvas, hue));
  drag(node, (x, y, done) => onchange({ s: x, l: 1 - y }, done));
  node.addEventListener("keydown", (event) => {
    const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[
      event.key
    ];
    if (!way) return;
    event.preventDefault();
    const step = event.shiftKey ? 0.1 : 0.01;
    onchange({ s: inside(pick.s + way[0] * step), l: inside(pick.l + way[1] * step) }, true);
  });
  return {
    node,
    /** @param {Pick} now */
    set(now) {
      if (now.h !== pick.h) paint(now.h);
      pick = now;
      setVars(thumb, { x: `${100 * now.s}%`, y: `${100 * (1 - now.l)}%`, c: toHex(fromPick(now)) });
      const percent = [now.l, now.s].map((v) => Math.round(100 * v));
      node.setAttribute("aria-valuenow", String(percent[0]));
      node.setAttribute("aria-valuetext", `lightness ${percent[0]} %, vividness ${percent[1]} %`);
    },
  };
}

/** @param {(patch: Partial<Pick>, done: boolean) => void} onchange */
export function hueBar(onchange) {
  const canvas = element("canvas", { width: HUES, height: 1 });
  const thumb = element("span", { class: "hue-thumb" });
  const node = slider("hue", "Hue", 360, canvas, thumb);
  drawHues(canvas);
  let hue = 0;
  drag(node, (x, _, done) => onchange({ h: Math.min(360 * x, 359.99) }, done));
  node.addEventListener("keydown", (event) => {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    onchange({ h: (hue + way * (event.shiftKey ? 15 : 2) + 360) % 360 }, true);
  });
  return {
    node,
    /** @param {Pick} now */
    set(now) {
      hue = now.h;
      setVars(thumb, { x: `${now.h / 3.6}%`, c: hueColor(now.h) });
      node.setAttribute("aria-valuenow", String(Math.round(now.h)));
    },
  };
}

/**
 * @param {string} name
 * @param {string} label
 * @param {number} most
 * @param {...HTMLElement} children
 */
function slider(name, label, most, ...children) {
  const range = { "aria-valuemin": "0", "aria-valuemax": String(most) };
  const about = { class: name, role: "slider", tabindex: "0", "aria-label": label };
  return element("div", { ...about, ...range }, children);
}

/** @param {number} hue */
const hueColor = (hue) => toHex(fromOklch(0.74, Math.min(0.14, largestChroma(0.74, hue)), hue));

/** @param {number} value */
const inside = (value) => Math.min(Math.max(value, 0), 1);

/** @param {HTMLCanvasElement} canvas @param {number} hue */
function drawSquare(canvas, hue) {
  const context = canvas.getContext("2d");
  if (!context) return;
  const picture = context.createImageData(SIDE, SIDE);
  for (let y = 0; y < SIDE; y++) {
    const l = 1 - y / (SIDE - 1);
    const most = largestChroma(l, hue);
    for (let x = 0; x < SIDE; x++) {
      put(picture.data, y * SIDE + x, fromOklch(l, (most * x) / (SIDE - 1), hue));
    }
  }
  context.putImageData(picture, 0, 0);
}

/** @param {HTMLCanvasElement} canvas */
function drawHues(canvas) {
  const context = canvas.getContext("2d");
  if (!context) return;
  for (let x = 0; x < HUES; x++) {
    context.fillStyle = hueColor((360 * x) / (HUES - 1));
    context.fillRect(x, 0, 1, 1);
  }
}

/** @param {Uint8ClampedArray} data @param {number} at @param {readonly number[]} rgb linear */
function put(data, at, rgb) {
  const hex = toHex(rgb);
  for (let i = 0; i < 3; i++)
    data[4 * at + i] = Number.parseInt(hex.slice(1 + 2 * i, 3 + 2 * i), 16);
  data[4 * at + 3] = 255;
}

/**
 * Follow a pointer that is held down, as shares of the node's box.
 *
 * @param {HTMLElement} node
 * @param {(x: number, y: number, done: boolean) => void} fn
 */
function drag(node, fn) {
  const tell = (/** @type {PointerEvent} */ event) => {
    const box = node.getBoundingClientRect();
    const done = event.type !== "pointerdown" && event.type !== "pointermove";
    fn(
      inside((event.clientX - box.left) / box.width),
      inside((event.clientY - box.top) / box.height),
      done,
    );
  };
  node.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    node.setPointerCapture(event.pointerId);
    node.focus({ preventScroll: true });
    tell(event);
  });
  node.addEventListener(
    "pointermove",
    (event) => node.hasPointerCapture(event.pointerId) && tell(event),
  );
  node.addEventListener("pointerup", tell);
}
