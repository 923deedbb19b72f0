/** Pictures of normals and heights: what their bytes mean, and what the graphics card is given. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { ABSENT, FrameError, MASK_BYTES, TEXELS, UNIFORM, pictureOf } from "../src/net/protocol.js";
import { Bricks, HeightBricks } from "../src/view/bricks.js";
import { FORMATS, halfBits, halfValue, straight } from "../src/view/formats.js";

test("the flags of a message say which picture it brings", () => {
  assert.deepEqual([0, 1, 2, 3, 4, 5].map(pictureOf), ["base", "base", "normal", "normal", "height", "height"]);
  assert.throws(() => pictureOf(6), FrameError);
});

/** The number of half precision by its definition: sign, five bits of exponent, ten of fraction. */
function slowHalf(/** @type {number} */ bits) {
  const sign = bits >> 15 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = (bits & 1023) / 1024;
  return sign * (exponent ? (1 + fraction) * 2 ** (exponent - 15) : fraction * 2 ** -14);
}

test("halves are read by their definition, and written to the nearest", () => {
  for (let bits = 0; bits < 65536; bits++) {
    if (((bits >> 10) & 31) < 31) assert.equal(halfValue(bits), slowHalf(bits));
  }
  for (let n = 0; n <= 65535; n += 13) {
    const value = n / 65535;
    const bits = halfBits(value);
    for (const other of [bits - 1, bits + 1]) {
      if (other < 0) continue;
      assert.ok(Math.abs(slowHalf(bits) - value) <= Math.abs(slowHalf(other) - value), `${value}`);
    }
  }
  assert.deepEqual([halfBits(0), halfBits(1)], [0, 0x3c00]);
});

/**
 * A brick of heights: node (i, j, k) is i - 4 + j / 8 high, and only even nodes are there if asked.
 *
 * @param {boolean} [isSparse]
 */
function slope(isSparse = false) {
  const mask = new Uint8Array(MASK_BYTES);
  const nodes = [];
  for (let bit = 0; bit < 729; bit++) {
    if (isSparse && bit % 2) continue;
    mask[bit >> 3] |= 1 << (bit & 7);
    const height = Math.floor(bit / 81) - 4 + (Math.floor(bit / 9) % 9) / 8;
    const size = halfBits(Math.abs(height)) | (height < 0 ? 0x8000 : 0);
    nodes.push(size & 255, size >> 8, 255, 255);
  }
  return Uint8Array.from([...mask, ...nodes]);
}

const heightIn = (/** @type {Bricks} */ bricks, /** @type {number[]} */ local) => straight(bricks.sample(0, local));

test("heights are blended between nodes; those that are not there do not count", () => {
  const bricks = new HeightBricks(2);
  bricks.put({ entry: 0, version: 1, state: TEXELS, data: slope() });
  for (const local of [[0, 0, 0], [8, 8, 8], [2.25, 7.5, 0.75], [3.5, 3, 5.5]]) {
    assert.ok(Math.abs(heightIn(bricks, local) - (local[0] - 4 + local[1] / 8)) < 1e-12);
  }
  bricks.put({ entry: 0, version: 2, state: TEXELS, data: slope(true) });
  assert.equal(heightIn(bricks, [2, 2, 2]), -1.75);
  // Of the cell's corners four are there; their mean is that of all eight, as the slope is even
  assert.ok(Math.abs(heightIn(bricks, [2.5, 2.5, 2.5]) - (2.5 - 4 + 2.5 / 8)) < 1e-12);
  assert.equal(straight(undefined), 0);
});

test("a uniform height is one number, of as much as there is of it", () => {
  const bricks = new HeightBricks(1);
  const bits = halfBits(0.75) | 0x8000;
  const half = [0x00, 0x80]; // a coverage of nearly one half
  bricks.put({ entry: 0, version: 1, state: UNIFORM, data: Uint8Array.of(bits & 255, bits >> 8, ...half) });
  assert.ok(Math.abs(heightIn(bricks, [1, 2, 3]) + 1.5) < 1e-4);
});

test("the largest height of all bricks is known, and forgotten with its brick", () => {
  const bricks = new HeightBricks(3);
  assert.equal(bricks.reach(), 0);
  bricks.put({ entry: 0, version: 1, state: TEXELS, data: slope() });
  assert.equal(bricks.reach(), 5);
  const bits = halfBits(6.5) | 0x8000;
  bricks.put({ entry: 2, version: 2, state: UNIFORM, data: Uint8Array.of(bits & 255, bits >> 8, 255, 255) });
  assert.equal(bricks.reach(), 6.5);
  bricks.put({ entry: 2, version: 3, state: ABSENT, data: new Uint8Array(0) });
  assert.equal(bricks.reach(), 5);
  assert.ok(!bricks.put({ entry: 3, version: 4, state: ABSENT, data: new Uint8Array(0) }));
});

test("the card is given halves, x fastest, and nothing where no node is", () => {
  const bricks = new HeightBricks(1);
  bricks.put({ entry: 0, version: 1, state: TEXELS, data: slope(true) });
  const row = 2 * 11;
  const image = new Uint16Array(row * 9 * 9).fill(77);
  bricks.unpack(0, image, 2, row, 9 * row);
  for (let bit = 0; bit < 729; bit++) {
    const [i, j, k] = [Math.floor(bit / 81), Math.floor(bit / 9) % 9, bit % 9];
    const at = 2 + 2 * i + row * j + 9 * row * k;
    const found = [...image.subarray(at, at + 2)];
    if (bit % 2) assert.deepEqual(found, [0, 0]);
    else assert.deepEqual([slowHalf(found[0]), found[1]], [i - 4 + j / 8, 0x3c00]);
  }
  assert.equal(image[0], 77);
});

test("normals have signs, which the card's bytes have not", () => {
  const bricks = new Bricks(1, FORMATS.normal);
  const mask = new Uint8Array(MASK_BYTES);
  mask[0] = 1;
  const data = Uint8Array.from([...mask, 0x81, 0, 127, 255]); // -127, 0, 127
  bricks.put({ entry: 0, version: 1, state: TEXELS, data });
  assert.deepEqual(bricks.sample(0, [0, 0, 0]), [-1, 0, 1, 1]);
  const image = new Uint8Array(4 * 729);
  bricks.unpack(0, image, 0, 36, 324);
  assert.deepEqual([...image.subarray(0, 8)], [1, 128, 255, 255, 128, 128, 128, 0]);
  // As the shader reads them back
  assert.deepEqual([...image.subarray(0, 3)].map((byte) => (byte - 128) / 127), [-1, 0, 1]);
});
