/**
 * The newest brick of every entry, as it came over the wire.
 *
 * The graphics card has only copies: what it loses, or has no room for, is here.
 */

import { ABSENT, BRICK_NODES, MASK_BYTES, TEXELS, UNIFORM } from "../net/protocol.js";

/** @typedef {import("../net/protocol.js").Brick} Brick */

const DECODED = Float64Array.from({ length: 256 }, (_, byte) => {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});

export class Bricks {
  /** @param {number} nEntries */
  constructor(nEntries) {
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

  /**
   * The four bytes of a uniform brick.
   *
   * @param {number} entry
   */
  color(entry) {
    return this.#dataOf(entry);
  }

  /**
   * Unpack a brick's 9^3 nodes, x fastest, into rows of an image.
   *
   * @param {number} entry of state TEXELS
   * @param {Uint8Array} out RGBA
   * @param {number} first byte of node (0, 0, 0)
   * @param {number} row bytes from a node to the next along y
   * @param {number} slice bytes along z
   */
  unpack(entry, out, first, row, slice) {
    const data = this.#dataOf(entry);
    let at = MASK_BYTES;
    for (let bit = 0; bit < BRICK_NODES; bit++) {
      // On the wire z is fastest: bit 81 i + 9 j + k
      const i = Math.floor(bit / 81);
      const j = Math.floor(bit / 9) % 9;
      const to = first + 4 * i + row * j + slice * (bit % 9);
      if ((data[bit >> 3] >> (bit & 7)) & 1) {
        out[to] = data[at];
        out[to + 1] = data[at + 1];
        out[to + 2] = data[at + 2];
        out[to + 3] = data[at + 3];
        at += 4;
      } else out[to] = out[to + 1] = out[to + 2] = out[to + 3] = 0;
    }
  }

  /**
   * All bricks in rising order of their entries, as the server's checksum of what is shown has them:
   * entry, state, number of colours, and what followed on the wire.
   *
   * @returns {Uint8Array<ArrayBuffer>}
   */
  content() {
    const known = [...this.data.keys()].filter((entry) => this.has(entry));
    const sizes = known.map((entry) => 8 + this.#dataOf(entry).length);
    const all = new Uint8Array(sizes.reduce((sum, size) => sum + size, 0));
    const view = new DataView(all.buffer);
    let at = 0;
    known.forEach((entry, n) => {
      const data = this.#dataOf(entry);
      const state = this.states[entry];
      view.setUint32(at, entry, true);
      view.setUint8(at + 4, state);
      view.setUint16(at + 6, state === TEXELS ? (data.length - MASK_BYTES) / 4 : 0, true);
      all.set(data, at + 8);
      at += sizes[n];
    });
    return all;
  }

  /** @param {number} entry that has a brick */
  #dataOf(entry) {
    return /** @type {Uint8Array} */ (this.data[entry]);
  }

  /**
   * What a brick shows at a place in it, as the graphics card blends it.
   *
   * @param {number} entry
   * @param {readonly number[]} local 0 to 8
   * @returns {[number, number, number, number]} linear, premultiplied
   */
  sample(entry, local) {
    const data = this.#dataOf(entry);
    /** @type {[number, number, number, number]} */
    const sum = [0, 0, 0, 0];
    const add = (/** @type {number} */ at, /** @type {number} */ weight) => {
      for (let c = 0; c < 3; c++) sum[c] += weight * DECODED[data[at + c]];
      sum[3] += (weight * data[at + 3]) / 255;
    };
    if (this.states[entry] === UNIFORM) {
      add(0, 1);
      return sum;
    }
    const low = local.map((value) => Math.min(Math.max(Math.floor(value), 0), 7));
    const part = local.map((value, axis) => value - low[axis]);
    for (let corner = 0; corner < 8; corner++) {
      const d = [corner >> 2, (corner >> 1) & 1, corner & 1];
      let weight = 1;
      for (let axis = 0; axis < 3; axis++) weight *= d[axis] ? part[axis] : 1 - part[axis];
      const bit = 81 * (low[0] + d[0]) + 9 * (low[1] + d[1]) + low[2] + d[2];
      if (weight && (data[bit >> 3] >> (bit & 7)) & 1) {
        add(MASK_BYTES + 4 * bitsBefore(data, bit), weight);
      }
    }
    return sum;
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
