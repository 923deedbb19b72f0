/**
 * What the four bytes of a node mean in each picture, and what the graphics card is given for them.
 *
 * Values are premultiplied by how much of them there is (alpha, or a channel's coverage), which is
 * the last number: so they are blended right by adding up.
 */

import { PICTURES } from "../net/protocol.js";

/** @typedef {import("../net/protocol.js").PictureName} PictureName */
/** @typedef {[number, number, number, number]} Four */

/**
 * @typedef {object} Format
 * @property {PictureName} name
 * @property {(data: Uint8Array, at: number) => Four} decode bytes from `at` on: values, coverage
 * @property {number} parts numbers that the card holds of a node, one or two bytes each
 * @property {typeof Uint8Array | typeof Uint16Array} Kind of these numbers
 * @property {readonly number[]} clear what the card is given for a node that is not there
 * @property {(data: Uint8Array, at: number, out: Uint8Array | Uint16Array, to: number) => void} pack
 *     write what the card is given for a node
 */

const LINEAR = Float64Array.from({ length: 256 }, (_, byte) => {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});
const BIAS = 128; // of the bytes of normals on the card

/** @param {number} byte */
const signed = (byte) => (byte << 24) >> 24;

/** @param {Uint8Array} data @param {number} at */
const word = (data, at) => data[at] | (data[at + 1] << 8);

/** @type {Record<PictureName, Format>} */
export const FORMATS = {
  base: {
    name: "base",
    decode: (data, at) => [
      LINEAR[data[at]],
      LINEAR[data[at + 1]],
      LINEAR[data[at + 2]],
      data[at + 3] / 255,
    ],
    parts: 4,
    Kind: Uint8Array,
    clear: [0, 0, 0, 0],
    pack(data, at, out, to) {
      out[to] = data[at];
      out[to + 1] = data[at + 1];
      out[to + 2] = data[at + 2];
      out[to + 3] = data[at + 3];
    },
  },
  normal: {
    name: "normal",
    decode: (data, at) => [
      signed(data[at]) / 127,
      signed(data[at + 1]) / 127,
      signed(data[at + 2]) / 127,
      data[at + 3] / 255,
    ],
    parts: 4,
    Kind: Uint8Array,
    clear: [BIAS, BIAS, BIAS, 0],
    pack(data, at, out, to) {
      for (let axis = 0; axis < 3; axis++) out[to + axis] = signed(data[at + axis]) + BIAS;
      out[to + 3] = data[at + 3];
    },
  },
  height: {
    name: "height",
    decode: (data, at) => [halfValue(word(data, at)), 0, 0, word(data, at + 2) / 65535],
    parts: 2,
    Kind: Uint16Array,
    clear: [0, 0],
    pack(data, at, out, to) {
      out[to] = word(data, at);
      out[to + 1] = halfBits(word(data, at + 2) / 65535);
    },
  },
};

/** Formats by the numbers of their pictures. */
export const ALL_FORMATS = PICTURES.map((name) => FORMATS[name]);

/**
 * The number that 16 bits stand for in half precision; infinities read as large ones.
 *
 * @param {number} bits
 */
export function halfValue(bits) {
  const exponent = (bits >> 10) & 31;
  const fraction = (bits & 1023) + (exponent > 0 ? 1024 : 0);
  const size = fraction * 2 ** (Math.max(exponent, 1) - 25);
  return bits & 0x8000 ? -size : size;
}

/**
 * The half-precision number nearest to one from 0 to 65504.
 *
 * @param {number} value
 */
export function halfBits(value) {
  const exponent = Math.max(Math.floor(Math.log2(value)), -14);
  // 1024 ... 2048 steps, less if subnormal; 2048 carry over into the exponent
  return ((exponent + 14) << 10) + Math.round(value * 2 ** (10 - exponent));
}

/**
 * The height that four bytes stand for; 0 where there is nothing.
 *
 * @param {Uint8Array} data
 * @param {number} at
 */
export function heightOf(data, at) {
  const coverage = word(data, at + 2);
  return coverage ? (halfValue(word(data, at)) * 65535) / coverage : 0;
}

/**
 * The first value that premultiplied numbers stand for; 0 where there is nothing.
 *
 * @param {readonly number[]} [sum] values, coverage
 */
export function straight([value, , , coverage] = [0, 0, 0, 0]) {
  return coverage > 0 ? value / coverage : 0;
}
