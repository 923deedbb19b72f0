/**
 * The newest brick of every entry of one picture, as it came over the wire.
 *
 * The graphics card has only copies: what it loses, or has no room for, is here.
 */

import { ABSENT, BRICK_NODES, MASK_BYTES, TEXELS, UNIFORM } from "../net/protocol.js";
import { FORMATS, heightOf } from "./formats.js";
import { findBrick } from "./octree.js";

/** @typedef {import("../net/protocol.js").Brick} Brick */
/** @typedef {import("./formats.js").Format} Format */

export class Bricks {
  /**
   * @param {number} nEntries
   * @param {Format} [format]
   */
  constructor(nEntries, format = FORMATS.base) {
    this.format = format;
    this.states = new Uint8Array(nEntries);
    /** @type {(Uint8Array | undefined)[]} */
    this.data = new Array(nEntries);
    this.count = 0; // of those with texels
  }

  /**
   * @param {Brick} brick
   * @returns {boolean} whether there is such an entry
   */
  put({ entry, state, data }) {
    if (entry >= this.states.length) return false;
    this.count += Number(state === TEXELS) - Number(this.states[entry] === TEXELS);
    this.states[entry] = state;
    this.data[entry] = state === ABSENT ? undefined : data.slice();
    return true;
  }

  /** @param {number} entry */
  has(entry) {
    return this.states[entry] !== ABSENT;
  }

  /** The same bricks, which do not change with these. */
  copy() {
    const other = new Bricks(0, this.format);
    other.states = this.states.slice();
    other.data = this.data.slice();
    other.count = this.count;
    return other;
  }

  /** Entries that have a brick. */
  known() {
    return [...this.data.keys()].filter((entry) => this.has(entry));
  }

  /**
   * The bytes of a brick: four of a uniform one, else its mask and nodes.
   *
   * @param {number} entry that has a brick
   */
  bytes(entry) {
    return /** @type {Uint8Array} */ (this.data[entry]);
  }

  /**
   * Unpack a brick's 9^3 nodes, x fastest, into rows of an image, as the card holds them.
   *
   * @param {number} entry of state TEXELS
   * @param {Uint8Array | Uint16Array} out
   * @param {number} first number of node (0, 0, 0) in it
   * @param {number} row numbers from a node to the next along y
   * @param {number} slice numbers along z
   */
  unpack(entry, out, first, row, slice) {
    const { parts, clear, pack } = this.format;
    const data = this.bytes(entry);
    let at = MASK_BYTES;
    for (let bit = 0; bit < BRICK_NODES; bit++) {
      // On the wire z is fastest: bit 81 i + 9 j + k
      const i = Math.floor(bit / 81);
      const j = Math.floor(bit / 9) % 9;
      const to = first + parts * i + row * j + slice * (bit % 9);
      if ((data[bit >> 3] >> (bit & 7)) & 1) {
        pack(data, at, out, to);
        at += 4;
      } else for (let part = 0; part < parts; part++) out[to + part] = clear[part];
    }
  }

  /**
   * All bricks in rising order of their entries, as the server's checksum of what is shown has them:
   * entry, state, number of nodes, and what followed on the wire.
   *
   * @returns {Uint8Array<ArrayBuffer>}
   */
  content() {
    const known = this.known();
    const sizes = known.map((entry) => 8 + this.bytes(entry).length);
    const all = new Uint8Array(sizes.reduce((sum, size) => sum + size, 0));
    const view = new DataView(all.buffer);
    let at = 0;
    known.forEach((entry, n) => {
      const data = this.bytes(entry);
      const state = this.states[entry];
      view.setUint32(at, entry, true);
      view.setUint8(at + 4, state);
      view.setUint16(at + 6, state === TEXELS ? (data.length - MASK_BYTES) / 4 : 0, true);
      all.set(data, at + 8);
      at += sizes[n];
    });
    return all;
  }

  /**
   * What is shown at a point.
   *
   * @param {import("./octree.js").Octree} octree
   * @param {readonly number[]} point
   * @param {readonly number[]} normal of the face
   * @returns {{values: import("./formats.js").Four, level: number, entry: number} | null} values
   *     times coverage, coverage
   */
  valuesAt(octree, point, normal) {
    const found = findBrick(octree, (entry) => this.has(entry), point, normal);
    if (!found) return null;
    const { entry, level, local } = found;
    return { values: this.sample(entry, local), level, entry };
  }

  /**
   * What a brick shows at a place in it, as the graphics card blends it.
   *
   * @param {number} entry
   * @param {readonly number[]} local 0 to 8
   * @returns {import("./formats.js").Four} values times coverage, coverage
   */
  sample(entry, local) {
    const data = this.bytes(entry);
    const { decode } = this.format;
    if (this.states[entry] === UNIFORM) return decode(data, 0);
    /** @type {import("./formats.js").Four} */
    const sum = [0, 0, 0, 0];
    const low = local.map((value) => Math.min(Math.max(Math.floor(value), 0), 7));
    const part = local.map((value, axis) => value - low[axis]);
    for (let corner = 0; corner < 8; corner++) {
      const d = [corner >> 2, (corner >> 1) & 1, corner & 1];
      let weight = 1;
      for (let axis = 0; axis < 3; axis++) weight *= d[axis] ? part[axis] : 1 - part[axis];
      const bit = 81 * (low[0] + d[0]) + 9 * (low[1] + d[1]) + low[2] + d[2];
      if (weight && (data[bit >> 3] >> (bit & 7)) & 1) {
        const values = decode(data, MASK_BYTES + 4 * bitsBefore(data, bit));
        values.forEach((value, n) => (sum[n] += weight * value));
      }
    }
    return sum;
  }
}

/** The bricks of the picture of heights, which know how far these reach. */
export class HeightBricks extends Bricks {
  /** @param {number} nEntries */
  constructor(nEntries) {
    super(nEntries, FORMATS.height);
    this.reaches = new Float32Array(nEntries); // largest |height| in every brick
  }

  /** @param {Brick} brick */
  put(brick) {
    if (!super.put(brick)) return false;
    this.reaches[brick.entry] = brick.state === ABSENT ? 0 : this.#reachOf(brick.entry);
    return true;
  }

  /** The largest |height| of all. */
  reach() {
    return this.reaches.reduce((most, one) => Math.max(most, one), 0);
  }

  /** @param {number} entry */
  #reachOf(entry) {
    const data = this.bytes(entry);
    let most = 0;
    for (let at = this.states[entry] === TEXELS ? MASK_BYTES : 0; at < data.length; at += 4) {
      most = Math.max(most, Math.abs(heightOf(data, at)));
    }
    return most;
  }
}

/**
 * @param {Uint8Array} mask
 * @param {number} bit
 */
function bitsBefore(mask, bit) {
  let count = 0;
  for (let byte = 0; byte < bit >> 3; byte++) count += ones(mask[byte]);
  return count + ones(mask[bit >> 3] & ((1 << (bit & 7)) - 1));
}

/** @param {number} byte */
function ones(byte) {
  let count = 0;
  for (let rest = byte; rest; rest &= rest - 1) count += 1;
  return count;
}
