/**
 * The part of the view that must be drawn anew: a rectangle, since graphics cards clip by one.
 *
 * While one paints, little more than the brush changes. What a changed brick may show is bounded by
 * its box; coarser bricks count only where they can be seen, since every dab changes all above it.
 */

import { Vector3 } from "three";
import { findCode } from "./octree.js";

const RIM = 4; // pixels around, for lines and smoothed edges
const SLOPE = 0.25; // cosine of the most slanted view that counts; what is seen from flatter waits
const MOST_BRICKS = 1500; // more than that is most of the view anyway
const FILL = 0.7; // of the view: a larger part is drawn as all of it

/** @typedef {{x: number, y: number, width: number, height: number}} Part pixels from the lower left */

export class Region {
  #all = true;
  #low = [Infinity, Infinity];
  #high = [-Infinity, -Infinity];

  addAll() {
    this.#all = true;
  }

  /**
   * A ball around a point.
   *
   * @param {import("./orbit.js").Orbit} orbit
   * @param {Vector3} center
   * @param {number} radius
   */
  addBall(orbit, center, radius) {
    const { x, y, isBehind } = orbit.project(center);
    if (isBehind) return this.addAll();
    const pixels = (1.25 * radius) / orbit.pixelAt(center);
    this.#add(x - pixels, y - pixels);
    this.#add(x + pixels, y + pixels);
  }

  /**
   * What a message of bricks may change.
   *
   * @param {import("./orbit.js").Orbit} orbit
   * @param {import("./octree.js").Octree} octree
   * @param {(entry: number) => boolean} isBare whether coarser bricks show in an entry's place
   * @param {readonly {entry: number}[]} changed
   * @param {number} spread how far beyond the bricks they may show
   */
  addBricks(orbit, octree, isBare, changed, spread) {
    if (changed.length > MOST_BRICKS) this.addAll();
    if (this.#all) return;
    const corner = new Vector3();
    for (const { entry } of changed) {
      const level = octree.levels[entry];
      const size = 8 * octree.texel * 2 ** level;
      const [bx, by, bz] = octree.bricks.subarray(3 * entry, 3 * entry + 3);
      corner.set((bx + 0.5) * size, (by + 0.5) * size, (bz + 0.5) * size);
      const footprint = orbit.pixelAt(corner) / SLOPE / octree.texel;
      const isSeen = level <= Math.ceil(Math.log2(Math.max(footprint, 1)));
      if (!isSeen && isCovered(octree, isBare, level, bx, by, bz)) continue;
      for (let n = 0; n < 8; n++) {
        const d = [n >> 2, (n >> 1) & 1, n & 1];
        corner.set((bx + d[0]) * size, (by + d[1]) * size, (bz + d[2]) * size);
        corner.add(new Vector3(...d).multiplyScalar(2).subScalar(1).multiplyScalar(spread));
        const { x, y, isBehind } = orbit.project(corner);
        if (isBehind) return this.addAll();
        this.#add(x, y);
      }
    }
  }

  /**
   * The part to draw; afterwards there is none.
   *
   * @param {number} width
   * @param {number} height
   * @returns {"all" | Part | null}
   */
  take(width, height) {
    const [low, high] = [this.#low, this.#high];
    const isAll = this.#all;
    this.#all = false;
    this.#low = [Infinity, Infinity];
    this.#high = [-Infinity, -Infinity];
    if (isAll) return "all";
    const x = Math.max(Math.floor(low[0] - RIM), 0);
    const y = Math.max(Math.floor(height - high[1] - RIM), 0);
    const right = Math.min(Math.ceil(high[0] + RIM), width);
    const top = Math.min(Math.ceil(height - low[1] + RIM), height);
    if (!(right > x && top > y)) return null;
    const part = { x, y, width: right - x, height: top - y };
    return part.width * part.height > FILL * width * height ? "all" : part;
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  #add(x, y) {
    this.#low = [Math.min(this.#low[0], x), Math.min(this.#low[1], y)];
    this.#high = [Math.max(this.#high[0], x), Math.max(this.#high[1], y)];
  }
}

/**
 * Whether finer bricks show wherever a brick would.
 *
 * @param {import("./octree.js").Octree} octree
 * @param {(entry: number) => boolean} isBare
 * @param {number} level
 * @param {number} bx
 * @param {number} by
 * @param {number} bz
 */
function isCovered(octree, isBare, level, bx, by, bz) {
  if (level === 0) return false;
  for (let n = 0; n < 8; n++) {
    const [x, y, z] = [2 * bx + (n >> 2), 2 * by + ((n >> 1) & 1), 2 * bz + (n & 1)];
    const code = findCode(octree, level - 1, x, y, z);
    if (code === -1) continue;
    const first = code >= 0 ? code : octree.groups[2 * (-3 - code)];
    const count = code >= 0 ? 1 : octree.groups[2 * (-3 - code) + 1];
    for (let entry = first; entry < first + count; entry++) if (isBare(entry)) return false;
  }
  return true;
}
