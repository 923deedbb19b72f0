/**
 * Bricks of 9^3 nodes of one picture side by side in one volume on the graphics card.
 *
 * The volume grows by layers of bricks. Its sides are powers of two, so that places in it are exact
 * and a brick looks the same in every slot. Colours are sRGB there, so that the card blends them in
 * linear light; heights are pairs of halves, which every WebGL 2 filters, too.
 */

import { Box3, ClampToEdgeWrapping, Data3DTexture, HalfFloatType, LinearFilter, NoColorSpace, RGBAFormat, RGFormat, SRGBColorSpace, UnsignedByteType, Vector3 } from "three"; // prettier-ignore

export const SIDE = 9;
const WIDTH = 256; // nodes, which every card allows
export const ACROSS = Math.floor(WIDTH / SIDE); // bricks in a row, and rows in a layer
const PER_LAYER = ACROSS * ACROSS;
const BYTES_PER_NODE = 4; // of every picture
const MOST_BYTES = 512 * 2 ** 20;
const MOST_BYTES_SMALL = 128 * 2 ** 20; // on machines with little memory
const FIRST_DEPTH = { base: 32, normal: 16, height: 16 }; // nodes
const STAGED = ACROSS; // bricks that go up in one call at most

/** @typedef {import("./formats.js").Format} Format */

export class Atlas {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {Format} format
   */
  constructor(renderer, format) {
    this.renderer = renderer;
    this.format = format;
    const gl = renderer.getContext();
    const most = /** @type {WebGL2RenderingContext} */ (gl).MAX_3D_TEXTURE_SIZE;
    const memory = /** @type {any} */ (navigator).deviceMemory ?? 8;
    const bytes = memory <= 4 ? MOST_BYTES_SMALL : MOST_BYTES;
    const depth = Math.min(gl.getParameter(most), bytes / (BYTES_PER_NODE * WIDTH ** 2));
    this.mostDepth = 2 ** Math.floor(Math.log2(depth));
    this.depth = Math.min(FIRST_DEPTH[format.name], this.mostDepth);
    this.texture = volume(this.depth, format);
    renderer.initTexture(this.texture);
    /** @type {number[]} */
    this.free = [];
    this.used = 0; // slots below are taken or free again
    const { Kind, parts } = format;
    this.staged = new Kind(parts * SIDE ** 3 * STAGED);
    this.staging = new Data3DTexture(/** @type {any} */ (this.staged), SIDE * STAGED, SIDE, SIDE);
  }

  /** How many bricks it can ever hold. */
  get capacity() {
    return Math.floor(this.mostDepth / SIDE) * PER_LAYER;
  }

  /** How many bricks it holds before it grows. */
  get room() {
    return Math.floor(this.depth / SIDE) * PER_LAYER;
  }

  /**
   * A slot for a brick.
   *
   * @returns {number} -1 if all are taken
   */
  take() {
    const slot = this.free.pop();
    if (slot !== undefined) return slot;
    if (this.used === this.room) return -1;
    this.used += 1;
    return this.used - 1;
  }

  /** @param {number} slot */
  give(slot) {
    this.free.push(slot);
  }

  /**
   * Fill slots; those that lie side by side go up in one call.
   *
   * @param {{slot: number, entry: number}[]} places
   * @param {import("./bricks.js").Bricks} bricks
   */
  upload(places, bricks) {
    const ordered = [...places].sort((a, b) => a.slot - b.slot);
    const { parts } = this.format;
    const row = parts * SIDE * STAGED;
    for (let begin = 0; begin < ordered.length; ) {
      const first = ordered[begin].slot;
      let n = 0;
      while (ordered[begin + n]?.slot === first + n && (n === 0 || (first + n) % ACROSS)) {
        bricks.unpack(ordered[begin + n].entry, this.staged, parts * SIDE * n, row, row * SIDE);
        n += 1;
      }
      const box = new Box3(new Vector3(0, 0, 0), new Vector3(SIDE * n, SIDE, SIDE));
      this.renderer.copyTextureToTexture(this.staging, this.texture, box, slotPlace(first));
      begin += n;
    }
  }

  /**
   * Make room for more bricks; what is there keeps its slots.
   *
   * @param {() => void} refill called if what was there must go up again
   * @returns {boolean} whether there is more room
   */
  grow(refill) {
    const depth = Math.min(2 * this.depth, this.mostDepth);
    if (depth === this.depth) return false;
    const larger = volume(depth, this.format);
    const gl = this.renderer.getContext();
    while (gl.getError() !== gl.NO_ERROR); // what went wrong before is not of this
    this.renderer.initTexture(larger);
    if (gl.getError() !== gl.NO_ERROR) {
      larger.dispose();
      this.mostDepth = this.depth; // the card's memory is full
      return false;
    }
    // Copies pass through what can be drawn into, which halves need not be
    const isCopied = this.format.Kind === Uint8Array;
    if (isCopied) this.renderer.copyTextureToTexture(this.texture, larger);
    this.texture.dispose();
    this.texture = larger;
    this.depth = depth;
    if (!isCopied) refill();
    return true;
  }

  dispose() {
    this.texture.dispose();
    this.staging.dispose();
  }
}

/**
 * Node (0, 0, 0) of a slot.
 *
 * @param {number} slot
 */
export function slotPlace(slot) {
  return new Vector3(
    SIDE * (slot % ACROSS),
    SIDE * (Math.floor(slot / ACROSS) % ACROSS),
    SIDE * Math.floor(slot / PER_LAYER),
  );
}

/**
 * @param {number} depth
 * @param {Format} format
 */
function volume(depth, { name, Kind }) {
  const texture = new Data3DTexture(null, WIDTH, WIDTH, depth);
  const isHalves = Kind === Uint16Array;
  texture.format = isHalves ? RGFormat : RGBAFormat;
  texture.type = isHalves ? HalfFloatType : UnsignedByteType;
  texture.colorSpace = name === "base" ? SRGBColorSpace : NoColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.generateMipmaps = false;
  texture.source.dataReady = false; // there is nothing to fill it with yet
  texture.needsUpdate = true;
  return texture;
}
