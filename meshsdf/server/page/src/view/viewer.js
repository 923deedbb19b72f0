/** What the page, and whoever tests it, may ask of the view. */

import { Orbit } from "./orbit.js";
import { View } from "./view.js";

/** @typedef {import("../net/protocol.js").PictureName} PictureName */
/** @typedef {import("../store.js").Vec3} Vec3 */

/**
 * @typedef {object} Picked
 * @property {Vec3} point
 * @property {Vec3} normal
 * @property {number} spacing of the texels stored there
 */

/**
 * @typedef {object} Viewer
 * @property {() => void} focus on what is under the cursor, or on everything
 * @property {() => void} resetView
 * @property {(side: string) => void} look "front", "back", "left", "right", "top" or "bottom"
 * @property {(clientX: number, clientY: number) => Picked | null} pick
 * @property {() => {eye: Vec3, target: Vec3, up: Vec3, fov: number, aspect: number, width: number,
 *     height: number}} camera
 * @property {() => void} cancelStroke
 * @property {() => number[]} renderedEntries whose bricks are on the graphics card
 * @property {(clientX: number, clientY: number) => {point: Vec3, faceNormal: Vec3,
 *     color: number[]} | null} exactColor linear, premultiplied, from the bricks themselves
 * @property {() => {width: number, height: number, data: Uint8Array}} pixels drawn anew without
 *     the cursor; RGBA, the lowest row first
 * @property {(clientX: number, clientY: number) => number | null} exactHeight in finest texels, from
 *     the bricks themselves
 * @property {(picture?: PictureName) => Promise<string>} digest of all bricks of a picture, as GET
 *     /api/digest has it; of the colours, which it calls "shown", if not said
 * @property {() => Record<string, number>} stats
 * @property {() => void} dispose
 */

/**
 * @param {HTMLCanvasElement} canvas
 * @param {import("../store.js").Store} store
 * @param {import("../net/session.js").Session} session
 * @returns {Viewer}
 */
export function createViewer(canvas, store, session) {
  const view = new View(canvas, store, session);
  return {
    focus: () => view.focus(),
    resetView: () => view.turn((orbit) => orbit.reset()),
    look: (side) => view.turn((orbit) => orbit.look(side)),
    pick: (x, y) => pick(view, x, y),
    camera: () => camera(view),
    cancelStroke: () => view.gestures?.cancelStroke(),
    renderedEntries: () => renderedEntries(view),
    exactColor: (x, y) => exactColor(view, x, y),
    pixels: () => pixels(view),
    exactHeight: (x, y) => exactHeight(view, x, y),
    digest: (picture = "base") => digest(view, picture),
    stats: () => stats(view),
    dispose: () => view.dispose(),
  };
}

/**
 * @param {View} view
 * @param {number} clientX
 * @param {number} clientY
 */
function hitOnPage(view, clientX, clientY) {
  const { left, top } = view.canvas.getBoundingClientRect();
  return view.hit(clientX - left, clientY - top);
}

/**
 * @param {View} view
 * @param {number} x
 * @param {number} y
 * @returns {Picked | null}
 */
function pick(view, x, y) {
  const hit = hitOnPage(view, x, y);
  if (!hit || !view.model) return null;
  const { point, normal } = hit;
  return { point: point.toArray(), normal: normal.toArray(), spacing: view.model.spacing(hit) };
}

/**
 * @param {View} view
 * @param {number} x
 * @param {number} y
 */
function exactColor(view, x, y) {
  const hit = hitOnPage(view, x, y);
  if (!hit) return null;
  const color = view.model?.look(hit)?.values ?? [0, 0, 0, 0];
  return { point: hit.point.toArray(), faceNormal: hit.faceNormal.toArray(), color };
}

/**
 * @param {View} view
 * @param {number} x
 * @param {number} y
 */
function exactHeight(view, x, y) {
  const hit = hitOnPage(view, x, y);
  return hit && (view.model?.heightAt(hit) ?? null);
}

/** @param {View} view */
function camera(view) {
  const { camera, pose, width, height } = view.orbit ?? new Orbit(view.scene.position, 1);
  const { elements: m } = camera.matrixWorld;
  return {
    eye: camera.position.toArray(),
    target: pose.target.toArray(),
    up: /** @type {Vec3} */ ([m[4], m[5], m[6]]),
    fov: camera.fov,
    aspect: camera.aspect,
    width,
    height,
  };
}

/** @param {View} view */
function renderedEntries(view) {
  const found = [];
  const slots = view.model?.painting.base.slots.entries() ?? [];
  for (const [entry, slot] of slots) if (slot >= 0) found.push(entry);
  return found;
}

/** @param {View} view */
function pixels(view) {
  const { nCursors } = view.cursor.uniforms;
  const before = nCursors.value;
  nCursors.value = 0;
  view.draw("all");
  nCursors.value = before;
  const gl = view.renderer.getContext();
  const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
  const data = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
  view.redraw();
  return { width, height, data };
}

/** @param {View} view */
function stats({ frame, frames, parts, model }) {
  const base = model?.painting.base;
  const heights = model?.painting.pictures.height;
  return {
    frames,
    parts,
    bricks: base?.bricks.count ?? 0,
    resident: base?.resident ?? 0,
    capacity: base?.atlas?.capacity ?? 0,
    heights: heights?.bricks.count ?? 0,
    residentHeights: heights?.resident ?? 0,
    heightRoom: heights?.atlas?.room ?? 0,
    levels: model?.octree.nLevels ?? 0,
    isMoving: Number(frame !== 0),
  };
}

/**
 * @param {View} view
 * @param {PictureName} picture
 */
async function digest({ model }, picture) {
  const content = model?.painting.pictures[picture].bricks.content() ?? new Uint8Array(0);
  const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", content));
  return Array.from(hash, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
