/**
 * A stroke in the making: places of the pointer become samples on the surface.
 *
 * Between two of them the way is followed in steps of a few pixels, so that quick strokes lie on the
 * surface, too. Where the pointer leaves it, or jumps from one part to another behind it, the stroke
 * ends and a new one begins: no paint flows through the air.
 */

import { brushOf } from "../tool.js";

const STEP = 6; // pixels between places on the way; more apart for large brushes
const STEP_SHARE = 0.25; // of the brush's radius on the screen
const MOST_STEPS = 48;
const LEAST_WAY = 0.02; // of the radius: nearer samples say nothing new
const JUMP = 12; // times the way that the pointer went, on a surface seen so much from the side
const FLUSH = 8; // milliseconds between messages

/** @typedef {import("./surface.js").Hit} Hit */
/** @typedef {{x: number, y: number, pressure: number, time: number}} Place on the canvas */

/**
 * @typedef {object} Means that strokes are made with
 * @property {import("../net/session.js").Session} session
 * @property {(x: number, y: number) => Hit | null} hit
 * @property {(hit: Hit) => number} pixelAt size of a pixel there
 */

export class Stroke {
  /**
   * @param {Means} means
   * @param {import("../tool.js").Tool} tool
   * @param {number} layer
   */
  constructor(means, tool, layer) {
    this.means = means;
    this.tool = tool;
    this.layer = layer;
    /** @type {Place | null} */
    this.last = null;
    /** @type {Hit | null} */
    this.lastHit = null;
    this.isOpen = false;
    this.count = 0; // samples of all pieces
    /** @type {number[] | null} of a clone: the same for all pieces */
    this.offset = null;
    /** @type {import("../net/protocol.js").Sample[]} */
    this.waiting = [];
    this.time = 0; // of the last sample
    this.flushed = -Infinity;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /**
   * The pointer is at a place.
   *
   * @param {Place} place
   */
  add(place) {
    if (this.tool.kind === "fill" && this.count > 0) return;
    const before = this.last;
    this.last = place;
    if (!before) return this.#sample(place, 0);
    const way = Math.hypot(place.x - before.x, place.y - before.y);
    const steps = Math.min(Math.max(Math.ceil(way / this.#step()), 1), MOST_STEPS);
    for (let n = 1; n <= steps; n++) {
      const t = n / steps;
      const mix = (/** @type {"x" | "y" | "pressure" | "time"} */ key) =>
        before[key] + t * (place[key] - before[key]);
      const between = { x: mix("x"), y: mix("y"), pressure: mix("pressure"), time: mix("time") };
      this.#sample(between, way / steps);
    }
  }

  end() {
    this.#close();
  }

  cancel() {
    clearTimeout(this.timer);
    this.waiting = [];
    if (this.isOpen) this.means.session.cancel();
    this.isOpen = false;
  }

  /** Pixels from one place on the way to the next. */
  #step() {
    const radius = this.lastHit ? this.tool.radius / this.means.pixelAt(this.lastHit) : 0;
    return Math.max(STEP, STEP_SHARE * radius);
  }

  /**
   * @param {Place} place
   * @param {number} way pixels from the place before
   */
  #sample(place, way) {
    const hit = this.means.hit(place.x, place.y);
    const isGradient = this.tool.kind === "gradient"; // only its ends count
    if (!hit) return isGradient ? undefined : this.#close();
    const { lastHit } = this;
    if (this.isOpen && lastHit && !isGradient) {
      const gone = hit.point.distanceTo(lastHit.point);
      const expected = JUMP * way * this.means.pixelAt(hit);
      if (gone > Math.max(expected, this.tool.radius / 2)) this.#close();
      else if (gone < LEAST_WAY * this.tool.radius) return;
    }
    if (!this.isOpen) this.#open(hit);
    const dt = this.count ? place.time - this.time : 0;
    this.waiting.push({
      point: hit.point.toArray(),
      normal: hit.normal.toArray(),
      pressure: place.pressure,
      dt,
    });
    this.time = place.time;
    this.lastHit = hit;
    this.count += 1;
    this.#schedule();
  }

  /** @param {Hit} hit */
  #open(hit) {
    const brush = brushOf(this.tool);
    if (this.tool.kind === "clone" && this.tool.source) {
      const { source } = this.tool;
      this.offset ??= hit.point.toArray().map((value, axis) => source[axis] - value);
      brush.offset = this.offset;
    }
    this.means.session.begin(this.layer, brush);
    this.isOpen = true;
  }

  #close() {
    if (!this.isOpen) return;
    this.#flush();
    this.means.session.end();
    this.isOpen = false;
    this.lastHit = null;
  }

  #schedule() {
    const wait = this.flushed + FLUSH - performance.now();
    if (wait <= 0) return this.#flush();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#flush(), wait);
  }

  #flush() {
    clearTimeout(this.timer);
    if (!this.waiting.length || !this.isOpen) return;
    this.means.session.dabs(this.waiting);
    this.waiting = [];
    this.flushed = performance.now();
  }
}
