/**
 * The octree that the texture lives in, and how a point finds its brick: the twin of the shader.
 *
 * An entry is one sheet of one brick of 8^3 cells; entries of all levels are numbered through, finest
 * level first. Every level has one root page of 16^3 upper pages of 16^3 lower pages of 16^3 bricks.
 */

import { decodeOctahedral } from "../net/octahedral.js";

export const NO_ENTRY = -1;
export const FIRST_GROUP = -3;
export const PAGE_CELLS = 4096;

/**
 * @typedef {object} Octree
 * @property {number} texel spacing of the finest nodes
 * @property {number} nLevels
 * @property {number} nEntries
 * @property {Int32Array} heads (levels, 4): first brick that the root page covers, root page
 * @property {Int32Array} pages (pages, 4096)
 * @property {Int32Array} groups (groups, 2): first entry and number of the sheets of a brick
 * @property {Int16Array} sheets (entries, 2): octahedral mean normals
 * @property {Uint8Array} levels (entries)
 * @property {Int32Array} bricks (entries, 3)
 */

const KINDS = /** @type {const} */ ({ i32: Int32Array, i16: Int16Array, u8: Uint8Array });

/**
 * The octree of what GET /api/octree gives: a JSON head that names the arrays, then these.
 *
 * @param {ArrayBuffer} buffer
 * @returns {Octree}
 */
export function decodeOctree(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  /** @type {(name: string) => any} */
  const array = (name) => {
    const { type, shape, at } = head.arrays[name];
    const Kind = KINDS[/** @type {keyof typeof KINDS} */ (type)];
    const size = shape.reduce((/** @type {number} */ a, /** @type {number} */ b) => a * b, 1);
    return new Kind(buffer, 4 + length + at, size);
  };
  return {
    texel: head.texel,
    nLevels: head.levels,
    nEntries: head.entries,
    heads: array("heads"),
    pages: array("pages"),
    groups: array("groups"),
    sheets: array("sheets"),
    levels: array("levels"),
    bricks: array("bricks"),
  };
}

/**
 * What the page table says of a brick.
 *
 * @param {Octree} octree
 * @param {number} level
 * @param {number} bx
 * @param {number} by
 * @param {number} bz
 */
export function findCode({ heads, pages }, level, bx, by, bz) {
  const x = bx - heads[4 * level];
  const y = by - heads[4 * level + 1];
  const z = bz - heads[4 * level + 2];
  if ((x | y | z) & ~4095) return NO_ENTRY;
  let page = heads[4 * level + 3];
  for (const shift of [8, 4, 0]) {
    const cell = (((x >> shift) & 15) << 8) | (((y >> shift) & 15) << 4) | ((z >> shift) & 15);
    page = pages[PAGE_CELLS * page + cell];
    if (page < 0 && shift > 0) return NO_ENTRY;
  }
  return page;
}

/**
 * The entry of a brick whose sheet looks most the way of a normal.
 *
 * @param {Octree} octree
 * @param {number} level
 * @param {readonly number[]} brick
 * @param {readonly number[]} normal
 */
export function findEntry(octree, level, [bx, by, bz], normal) {
  const code = findCode(octree, level, bx, by, bz);
  if (code > FIRST_GROUP) return code;
  const group = FIRST_GROUP - code;
  const first = octree.groups[2 * group];
  let best = NO_ENTRY;
  let most = -Infinity;
  for (let entry = first; entry < first + octree.groups[2 * group + 1]; entry++) {
    const [x, y, z] = decodeOctahedral(octree.sheets[2 * entry], octree.sheets[2 * entry + 1]);
    const dot = x * normal[0] + y * normal[1] + z * normal[2];
    if (dot > most) [best, most] = [entry, dot];
  }
  return best;
}

/**
 * The finest brick with something to show at a point, from a level on.
 *
 * @param {Octree} octree
 * @param {(entry: number) => boolean} isThere
 * @param {readonly number[]} point
 * @param {readonly number[]} normal
 * @param {number} [from]
 * @returns {{entry: number, level: number, local: [number, number, number]} | null} local: place in
 *     the brick, 0 to 8
 */
export function findBrick(octree, isThere, point, normal, from = 0) {
  for (let level = from; level < octree.nLevels; level++) {
    const scale = 1 / (octree.texel * 2 ** level);
    const nodes = point.map((value) => value * scale);
    const brick = nodes.map((value) => Math.floor(value / 8));
    const entry = findEntry(octree, level, brick, normal);
    if (entry >= 0 && isThere(entry)) {
      const [x, y, z] = nodes.map((value, axis) => value - 8 * brick[axis]);
      return { entry, level, local: [x, y, z] };
    }
  }
  return null;
}
