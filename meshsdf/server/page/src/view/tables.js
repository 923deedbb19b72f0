/**
 * The octree's tables as textures of whole numbers: pages, groups and sheets stay as they are;
 * what every entry shows in a picture changes, and only those rows go up that did.
 */

import { Box2, DataTexture, IntType, NearestFilter, RGIntegerFormat, RedIntegerFormat, ShortType, UnsignedIntType, Vector2 } from "three"; // prettier-ignore

export const SHIFT = 12; // a row has 2^12 numbers: a page, or the states of as many entries
const WIDTH = 1 << SHIFT;

const UNIFORM_BIT = 0x40000000;
const BRICK_BIT = 0x80000000;

/** What all pictures share. */
export class Tables {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {import("./octree.js").Octree} octree
   */
  constructor(renderer, octree) {
    const gl = /** @type {WebGL2RenderingContext} */ (renderer.getContext());
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const rows = Math.max(octree.pages.length, octree.nEntries) / WIDTH;
    if (most < WIDTH || rows > most) {
      const what = `this graphics card holds tables of ${most} rows; the texture needs ${Math.ceil(rows)}`;
      throw Object.assign(new Error(what), { what, fix: "paint at a lower resolution" });
    }
    this.pages = table(octree.pages, Int32Array, 1, RedIntegerFormat, IntType);
    this.groups = table(octree.groups, Int32Array, 2, RGIntegerFormat, IntType);
    this.sheets = table(octree.sheets, Int16Array, 2, RGIntegerFormat, ShortType);
    for (const one of [this.pages, this.groups, this.sheets]) renderer.initTexture(one);
  }

  dispose() {
    for (const one of [this.pages, this.groups, this.sheets]) one.dispose();
  }
}

/** What every entry shows in one picture. */
export class States {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {number} nEntries
   */
  constructor(renderer, nEntries) {
    this.renderer = renderer;
    this.texture = table(new Uint32Array(2 * nEntries), Uint32Array, 2, RGIntegerFormat, UnsignedIntType);
    const { data, width, height } = this.texture.image;
    this.words = /** @type {Uint32Array} */ (data);
    this.bytes = new Uint8Array(this.words.buffer);
    this.source = new DataTexture(this.words, width, height, RGIntegerFormat, UnsignedIntType);
    renderer.initTexture(this.texture);
    /** @type {Map<number, [number, number]>} first and last changed number of rows */
    this.changed = new Map();
  }

  /** @param {number} entry */
  setAbsent(entry) {
    this.words[2 * entry] = 0;
    this.#mark(entry);
  }

  /**
   * @param {number} entry
   * @param {Uint8Array} bytes four, as they came
   */
  setUniform(entry, bytes) {
    this.words[2 * entry] = UNIFORM_BIT;
    this.bytes.set(bytes, 8 * entry + 4);
    this.#mark(entry);
  }

  /**
   * @param {number} entry
   * @param {import("three").Vector3} place node (0, 0, 0) in the atlas
   */
  setBrick(entry, place) {
    this.words[2 * entry] = BRICK_BIT;
    this.words[2 * entry + 1] = place.x | (place.y << 10) | (place.z << 20);
    this.#mark(entry);
  }

  /** Send up what changed. */
  upload() {
    for (const [row, [first, last]] of this.changed) {
      const box = new Box2(new Vector2(first, row), new Vector2(last + 1, row + 1));
      this.renderer.copyTextureToTexture(this.source, this.texture, box, box.min);
    }
    this.changed.clear();
  }

  dispose() {
    this.texture.dispose();
  }

  /** @param {number} entry */
  #mark(entry) {
    const row = entry >> SHIFT;
    const column = entry & (WIDTH - 1);
    const range = this.changed.get(row);
    if (!range) this.changed.set(row, [column, column]);
    else if (column < range[0]) range[0] = column;
    else if (column > range[1]) range[1] = column;
  }
}

/**
 * @template {Int32Array | Int16Array | Uint32Array} T
 * @param {T} values
 * @param {new (length: number) => T} Kind
 * @param {number} parts numbers in a texel
 * @param {import("three").PixelFormat} format
 * @param {import("three").TextureDataType} type
 */
function table(values, Kind, parts, format, type) {
  const rows = Math.max(1, Math.ceil(values.length / parts / WIDTH));
  const padded = new Kind(parts * WIDTH * rows);
  padded.set(values);
  const texture = new DataTexture(/** @type {any} */ (padded), WIDTH, rows, format, type);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}
