/**
 * What pointers on the canvas mean: painting, turning, shifting, zooming, taking a colour.
 *
 * Mouse: left paints (on the background it turns), right turns, middle or shift with right shifts,
 * the wheel zooms; with alt a click takes the colour and a drag turns. A pen always paints, its
 * eraser erases. One finger paints or turns, as chosen; two turn and zoom, three shift.
 */

import { Vector3 } from "three";
import { pickColor, setSource } from "../tool.js";
import { Stroke } from "./stroke.js";

const CLICK = 4; // pixels that a click may move
const SECOND_FINGER = 220; // milliseconds: a second finger that comes so soon was meant from the first
const WHEEL = 0.0016; // of a zoom's logarithm for a pixel of the wheel
const PINCH_WHEEL = 0.01; // the same, of a trackpad's pinch
const LINE = 16; // pixels of a wheel that counts in lines
const ERASER = 32; // bit of a pen's buttons

/** @typedef {"paint" | "turn" | "shift" | "pinch" | "pick" | "tap"} Mode */
/** @typedef {{x: number, y: number}} Spot */

/**
 * @typedef {object} Stage what gestures act on
 * @property {HTMLCanvasElement} canvas
 * @property {import("../store.js").Store} store
 * @property {import("./orbit.js").Orbit} orbit
 * @property {import("./stroke.js").Means} means
 * @property {(hit: import("./surface.js").Hit) => import("../store.js").Vec3} colorAt linear
 * @property {(spot: Spot | null) => void} hover where the brush would paint
 * @property {() => void} moved the camera has another goal
 */

export class Gestures {
  /** @param {Stage} stage */
  constructor(stage) {
    this.stage = stage;
    /** @type {Map<number, Spot>} pointers that are down */
    this.down = new Map();
    /** @type {Mode | null} */
    this.mode = null;
    this.leader = -1; // the pointer that the gesture began with
    this.leaderType = "";
    /** @type {Spot & {time: number}} */
    this.start = { x: 0, y: 0, time: 0 };
    /** @type {Stroke | null} */
    this.stroke = null;
    this.ending = new AbortController();
    const { canvas } = stage;
    const options = { signal: this.ending.signal };
    canvas.style.touchAction = "none";
    canvas.addEventListener("pointerdown", (event) => this.#press(event), options);
    canvas.addEventListener("pointermove", (event) => this.#move(event), options);
    if ("onpointerrawupdate" in canvas) {
      canvas.addEventListener("pointerrawupdate", (event) => this.#raw(/** @type {PointerEvent} */ (event)), options);
    }
    canvas.addEventListener("pointerup", (event) => this.#lift(event), options);
    canvas.addEventListener("pointercancel", (event) => this.#lift(event), options);
    canvas.addEventListener("pointerleave", () => this.stage.hover(null), options);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault(), options);
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { ...options, passive: false });
  }

  dispose() {
    this.cancelStroke();
    this.ending.abort();
  }

  /** Take back the stroke that is being painted. */
  cancelStroke() {
    this.stroke?.cancel();
    this.#endStroke();
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const { canvas, hover } = this.stage;
    if (this.mode === "paint" && this.leaderType === "pen") return; // the palm of the hand that paints
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    const spot = this.#spot(event);
    this.down.set(event.pointerId, spot);
    if (this.down.size > 1) return this.#addFinger(event);
    this.leader = event.pointerId;
    this.leaderType = event.pointerType;
    this.start = { ...spot, time: event.timeStamp };
    this.mode = this.#modeOf(event, spot);
    if (this.mode === "paint") this.#beginStroke(event, spot);
    else if (this.mode === "pick") this.#pick(spot);
    else if (event.pointerType === "touch") hover(null);
  }

  /**
   * @param {PointerEvent} event
   * @param {Spot} spot
   * @returns {Mode}
   */
  #modeOf(event, spot) {
    const { view, placing, tool, connection } = this.stage.store.get();
    if (event.button === 1 || (event.button === 2 && event.shiftKey)) return "shift";
    if (event.button === 2) return "turn";
    if (event.altKey || view.aim === "source") return "tap";
    const turns = placing || (view.drag === "orbit" && event.pointerType !== "pen");
    if (turns || !tool || connection === "closed") return "turn";
    if (!this.stage.means.hit(spot.x, spot.y)) return "turn";
    return tool.kind === "eyedropper" ? "pick" : "paint";
  }

  /** @param {PointerEvent} event */
  #addFinger(event) {
    if (this.mode === "paint") {
      const isEarly = event.timeStamp - this.start.time < SECOND_FINGER;
      if (isEarly) this.cancelStroke();
      else this.#endStroke();
    }
    this.mode = event.pointerType === "touch" ? "pinch" : this.mode === "paint" ? null : this.mode;
    this.stage.hover(null);
  }

  /** @param {PointerEvent} event */
  #raw(event) {
    if (this.mode === "paint" && event.pointerId === this.leader) this.#paint(event);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const { orbit, moved, hover } = this.stage;
    const spot = this.#spot(event);
    const before = this.down.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch" && this.down.size === 0) hover(spot);
      return;
    }
    const dx = spot.x - before.x;
    const dy = spot.y - before.y;
    if (this.mode === "pinch") return this.#pinch(event.pointerId, spot);
    this.down.set(event.pointerId, spot);
    if (event.pointerId !== this.leader) return;
    if (this.mode === "paint") {
      if (!("onpointerrawupdate" in this.stage.canvas)) this.#paint(event);
      hover(spot);
    } else if (this.mode === "pick") {
      this.#pick(spot);
      hover(spot);
    } else if (this.mode === "shift") orbit.pan(dx, dy);
    else if (this.mode === "turn") orbit.turn(dx, dy);
    else if (this.mode === "tap") {
      if (Math.hypot(spot.x - this.start.x, spot.y - this.start.y) > CLICK) this.mode = "turn";
      return;
    } else return;
    if (this.mode === "turn" || this.mode === "shift") moved();
  }

  /** @param {PointerEvent} event */
  #lift(event) {
    const spot = this.down.get(event.pointerId);
    if (!spot) return;
    this.down.delete(event.pointerId);
    if (event.pointerId === this.leader) {
      if (this.mode === "paint") {
        if (event.type === "pointercancel") this.cancelStroke();
        else this.#endStroke();
      } else if (this.mode === "tap") this.#tap(spot);
    }
    // What fingers that are still down do is over, too: a pinch does not end in a stroke
    if (this.down.size === 0) this.mode = null;
    else if (this.mode !== "pinch") this.mode = null;
  }

  /**
   * @param {number} id
   * @param {Spot} spot
   */
  #pinch(id, spot) {
    const { orbit, moved, means } = this.stage;
    const before = spread(this.down);
    this.down.set(id, spot);
    const after = spread(this.down);
    const dx = after.x - before.x;
    const dy = after.y - before.y;
    if (this.down.size >= 3) orbit.pan(dx, dy);
    else if (this.down.size === 2) {
      orbit.turn(dx, dy);
      const factor = before.size > 0 && after.size > 0 ? before.size / after.size : 1;
      orbit.zoom(factor, means.hit(after.x, after.y)?.point ?? null);
    }
    moved();
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const { orbit, moved } = this.stage;
    const pixels = event.deltaMode === 1 ? LINE * event.deltaY : event.deltaY;
    const rate = event.ctrlKey ? PINCH_WHEEL : WHEEL;
    orbit.zoom(Math.exp(Math.min(Math.max(pixels * rate, -1), 1)), this.#under(this.#spot(event)));
    moved();
  }

  /**
   * What a zoom keeps in its place: the surface there, or the air beside it as far away as the target.
   *
   * @param {Spot} spot
   */
  #under({ x, y }) {
    const { orbit, means } = this.stage;
    const hit = means.hit(x, y);
    if (hit) return hit.point;
    const ray = orbit.ray(x, y);
    const away = new Vector3().subVectors(orbit.pose.target, ray.origin).dot(ray.direction);
    return ray.at(Math.max(away, 0), new Vector3());
  }

  /**
   * @param {PointerEvent} event
   * @param {Spot} spot
   */
  #beginStroke(event, spot) {
    const { store, means } = this.stage;
    const { tool, layer } = store.get();
    if (!tool || layer < 0 || (tool.kind === "clone" && !tool.source)) {
      this.mode = null;
      return;
    }
    const isEraser = event.pointerType === "pen" && (event.buttons & ERASER) !== 0;
    this.stroke = new Stroke(means, isEraser ? { ...tool, kind: "erase" } : tool, layer);
    store.set({ stroking: true });
    this.stroke.add({ ...spot, pressure: pressureOf(event), time: event.timeStamp });
    this.stage.hover(spot);
  }

  /** @param {PointerEvent} event */
  #paint(event) {
    const all = event.getCoalescedEvents?.() ?? [];
    for (const one of all.length ? all : [event]) {
      this.stroke?.add({ ...this.#spot(one), pressure: pressureOf(one), time: one.timeStamp });
    }
  }

  #endStroke() {
    this.stroke?.end();
    this.stroke = null;
    if (this.mode === "paint") this.mode = null;
    if (this.stage.store.get().stroking) this.stage.store.set({ stroking: false });
  }

  /** @param {Spot} spot */
  #tap(spot) {
    const { store, means } = this.stage;
    const hit = means.hit(spot.x, spot.y);
    if (!hit) return;
    const { view, tool } = store.get();
    if (view.aim === "source" || tool?.kind === "clone") setSource(store, hit.point.toArray());
    else this.#pick(spot);
  }

  /** @param {Spot} spot */
  #pick(spot) {
    const hit = this.stage.means.hit(spot.x, spot.y);
    if (hit) pickColor(this.stage.store, this.stage.colorAt(hit));
  }

  /**
   * @param {MouseEvent} event
   * @returns {Spot} pixels from the canvas' corner
   */
  #spot(event) {
    const { left, top } = this.stage.canvas.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }
}

/** @param {PointerEvent} event */
function pressureOf(event) {
  // A mouse says half of what it cannot know; fingers often 0
  return event.pointerType === "pen" ? event.pressure : 1;
}

/**
 * Middle of the pointers, and how far they are from it.
 *
 * @param {Map<number, Spot>} down
 */
function spread(down) {
  const spots = [...down.values()];
  const x = spots.reduce((sum, spot) => sum + spot.x, 0) / spots.length;
  const y = spots.reduce((sum, spot) => sum + spot.y, 0) / spots.length;
  const size = spots.reduce((sum, spot) => sum + Math.hypot(spot.x - x, spot.y - y), 0);
  return { x, y, size };
}
