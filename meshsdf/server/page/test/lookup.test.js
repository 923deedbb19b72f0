/** Which brick a point finds, and what it shows there; the octree is made by hand. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { encodeOctahedral } from "../src/net/octahedral.js";
import { ABSENT, MASK_BYTES, TEXELS, UNIFORM } from "../src/net/protocol.js";
import { Bricks } from "../src/view/bricks.js";
import { decodeOctree, findBrick, findCode, findEntry } from "../src/view/octree.js";
import { mostWanted, worths } from "../src/view/residency.js";

/**
 * Two levels: fine bricks (-1, 0, 0), of two sheets, and (300, 0, 0); above them (-1, 0, 0) and
 * (150, 0, 0).
 */
function someOctree() {
  const pages = new Int32Array(4096 * 9).fill(-1);
  const put = (/** @type {number} */ page, /** @type {number} */ x, /** @type {number} */ value) => {
    pages[4096 * page + 256 * x] = value;
  };
  put(0, 0, 1); // fine: the root page begins at brick -1
  put(1, 0, 2);
  put(2, 0, -3); // the first group
  put(0, 1, 3);
  put(3, 301 / 16 & 15, 4);
  put(4, 301 & 15, 2);
  put(5, 0, 6);
  put(6, 0, 7);
  put(7, 0, 3);
  put(6, 151 >> 4, 8);
  put(8, 151 & 15, 4);
  const directions = [[0, 0, 1], [0, 0, -1], [0, 0, 1], [0, 0, 0], [0, 1, 0]]; // prettier-ignore
  return {
    texel: 0.5,
    nLevels: 2,
    nEntries: 5,
    heads: Int32Array.of(-1, 0, 0, 0, -1, 0, 0, 5),
    pages,
    groups: Int32Array.of(0, 2),
    sheets: Int16Array.from(directions.flatMap((one) => encodeOctahedral(one))),
    levels: Uint8Array.of(0, 0, 0, 1, 1),
    bricks: Int32Array.of(-1, 0, 0, -1, 0, 0, 300, 0, 0, -1, 0, 0, 150, 0, 0),
  };
}

test("the page table is read through its three floors", () => {
  const octree = someOctree();
  assert.equal(findCode(octree, 0, -1, 0, 0), -3);
  assert.equal(findCode(octree, 0, 300, 0, 0), 2);
  assert.equal(findCode(octree, 1, 150, 0, 0), 4);
  for (const brick of [[-2, 0, 0], [0, 0, 0], [299, 0, 0], [4095, 0, 0], [-1, -1, 0], [-1, 0, 5000]]) {
    assert.equal(findCode(octree, 0, brick[0], brick[1], brick[2]), -1);
  }
});

test("of two sheets the one counts that looks the way of the face; the first on a tie", () => {
  const octree = someOctree();
  assert.equal(findEntry(octree, 0, [-1, 0, 0], [0.1, 0, 0.9]), 0);
  assert.equal(findEntry(octree, 0, [-1, 0, 0], [0.1, 0, -0.9]), 1);
  assert.equal(findEntry(octree, 0, [-1, 0, 0], [1, 0, 0]), 0);
});

test("what is not there shows the level above", () => {
  const octree = someOctree();
  const there = new Set([1, 3]);
  const find = (/** @type {number[]} */ normal) =>
    findBrick(octree, (entry) => there.has(entry), [-0.75, 1, 2], normal);
  assert.deepEqual(find([0, 0, -1]), { entry: 1, level: 0, local: [6.5, 2, 4] });
  assert.deepEqual(find([0, 0, 1]), { entry: 3, level: 1, local: [7.25, 1, 2] });
  assert.equal(findBrick(octree, () => true, [50, 0, 0], [0, 0, 1]), null);
});

test("an octree is read from its bytes", () => {
  const octree = someOctree();
  const kinds = { heads: "i32", pages: "i32", groups: "i32", sheets: "i16", levels: "u8", bricks: "i32" };
  /** @type {Record<string, any>} */
  const arrays = {};
  const parts = [];
  let at = 0;
  for (const [name, type] of Object.entries(kinds)) {
    const array = /** @type {any} */ (octree)[name];
    const data = Buffer.from(array.buffer, array.byteOffset, array.byteLength);
    arrays[name] = { type, shape: [array.length], at };
    parts.push(data, Buffer.alloc(-data.length & 3));
    at += data.length + (-data.length & 3);
  }
  let head = JSON.stringify({ texel: 0.5, levels: 2, entries: 5, arrays });
  head += " ".repeat(-head.length & 3);
  const length = Buffer.alloc(4);
  length.writeUInt32LE(head.length);
  const whole = Uint8Array.from(Buffer.concat([length, Buffer.from(head), ...parts]));
  assert.deepEqual(decodeOctree(whole.buffer), octree);
});

/** A brick of which node (i, j, k) has the colour (i, j, k) times 28, and only even nodes if asked. */
function ramp(isSparse = false) {
  const mask = new Uint8Array(MASK_BYTES);
  const colors = [];
  for (let bit = 0; bit < 729; bit++) {
    const node = [Math.floor(bit / 81), Math.floor(bit / 9) % 9, bit % 9];
    if (isSparse && bit % 2) continue;
    mask[bit >> 3] |= 1 << (bit & 7);
    colors.push(...node.map((value) => 28 * value), 255);
  }
  return Uint8Array.from([...mask, ...colors]);
}

const linear = (/** @type {number} */ byte) =>
  byte / 255 <= 0.04045 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4;

test("a brick is blended between its eight nodes in linear light", () => {
  const bricks = new Bricks(2);
  bricks.put({ entry: 0, version: 1, state: TEXELS, data: ramp() });
  assert.equal(bricks.count, 1);
  for (const local of [[0, 0, 0], [8, 8, 8], [2.25, 7.5, 0.75], [7.999, 3, 5.5]]) {
    const [r, g, b, a] = bricks.sample(0, local);
    assert.ok(Math.abs(a - 1) < 1e-12);
    [r, g, b].forEach((value, axis) => {
      const low = Math.min(Math.floor(local[axis]), 7);
      const t = local[axis] - low;
      const expected = (1 - t) * linear(28 * low) + t * linear(28 * (low + 1));
      assert.ok(Math.abs(value - expected) < 1e-12);
    });
  }
  bricks.put({ entry: 0, version: 2, state: UNIFORM, data: Uint8Array.of(255, 0, 51, 51) });
  assert.deepEqual(bricks.sample(0, [3, 3, 3]), [1, 0, linear(51), 0.2]);
  assert.equal(bricks.count, 0);
  bricks.put({ entry: 0, version: 3, state: ABSENT, data: new Uint8Array(0) });
  assert.ok(!bricks.has(0));
  assert.ok(!bricks.put({ entry: 2, version: 1, state: ABSENT, data: new Uint8Array(0) }));
});

test("bricks are told by their bytes, whatever order they came in", () => {
  const bricks = new Bricks(9);
  bricks.put({ entry: 7, version: 4, state: UNIFORM, data: Uint8Array.of(1, 2, 3, 4) });
  bricks.put({ entry: 3, version: 5, state: UNIFORM, data: Uint8Array.of(9, 9, 9, 9) });
  bricks.put({ entry: 5, version: 6, state: TEXELS, data: ramp(true) });
  bricks.put({ entry: 3, version: 7, state: ABSENT, data: new Uint8Array(0) });
  const content = Buffer.from(bricks.content());
  assert.equal(content.subarray(0, 8).toString("hex"), "0500000002006d01"); // 365 colours
  assert.deepEqual(Uint8Array.from(content.subarray(8, -12)), ramp(true));
  assert.equal(content.subarray(-12).toString("hex"), "070000000100000001020304");
});

test("a brick is laid out for the card with x fastest, nodes that are missing clear", () => {
  const bricks = new Bricks(1);
  bricks.put({ entry: 0, version: 1, state: TEXELS, data: ramp(true) });
  const row = 4 * 11;
  const image = new Uint8Array(row * 9 * 9).fill(77);
  bricks.unpack(0, image, 4, row, 9 * row);
  for (let bit = 0; bit < 729; bit++) {
    const [i, j, k] = [Math.floor(bit / 81), Math.floor(bit / 9) % 9, bit % 9];
    const at = 4 + 4 * i + row * j + 9 * row * k;
    const expected = bit % 2 ? [0, 0, 0, 0] : [28 * i, 28 * j, 28 * k, 255];
    assert.deepEqual([...image.subarray(at, at + 4)], expected);
  }
  assert.equal(image[0], 77);
});

test("where room is scarce, the large and the near on the screen come first", () => {
  const octree = someOctree();
  const everywhere = new Float32Array(24);
  const worth = worths(octree, { eye: [1210, 2, 40], planes: everywhere });
  const states = Uint8Array.of(TEXELS, TEXELS, TEXELS, UNIFORM, TEXELS);
  assert.deepEqual([...mostWanted(states, TEXELS, worth, 2)], [4, 2]);
  assert.equal(mostWanted(states, TEXELS, worth, 9).length, 4);
  const onlyLeft = new Float32Array(24);
  onlyLeft.set([-1, 0, 0, 0]); // x < 0 is seen
  const other = worths(octree, { eye: [1210, 2, 40], planes: onlyLeft });
  assert.ok(other[0] === worth[0] && other[2] < worth[2]);
});
