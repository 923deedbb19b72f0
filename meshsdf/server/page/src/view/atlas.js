/**
 * Bricks of 9^3 nodes side by side in one volume on the graphics card.
 *
 * The volume grows by layers of bricks; what it holds is copied there by the card itself. The format
 * is sRGB, so that the card blends premultiplied colours in linear light.
 */

import { Box3, ClampToEdgeWrapping, Data3DTexture, LinearFilter, RGBAFormat, SRGBColorSpace, UnsignedByteType, Vector3 } from "three"; // prettier-ignore

export const SIDE = 9;
export const ACROSS = 28; // bricks in a row, and rows in a layer: 252 nodes, which every card allows
const PER_LAYER = ACROSS * ACROSS;
const BYTES_PER_LAYER = 4 * (SIDE * ACROSS) ** 2 * SIDE;
const MOST_BYTES = 512 * 2 ** 20;
const MOST_BYTES_SMALL = 128 * 2 ** 20; // on machines with little memory
const FIRST_LAYERS = 2;
const STAGED = ACROSS; // bricks that go up in one call at most

export class Atlas {
  /** @param {import("three").WebGLRenderer} renderer */
  constructor(renderer) {
    this.renderer = renderer;
    const gl = renderer.getContext();
    const most = /** @type {WebGL2RenderingContext} */ (gl).MAX_3D_TEXTURE_SIZE;
    const memory = /** @type {any} */ (navigator).deviceMemory ?? 8;
    const bytes = memory <= 4 ? MOST_BYTES_SMALL : MOST_BYTES;
    this.mostLayers = Math.min(Math.floor(gl.getParameter(most) / SIDE), Math.floor(bytes / BYTES_PER_LAYER));
    this.layers = Math.min(FIRST_LAYERS, this.mostLayers);
    this.texture = volume(this.layers);
    renderer.initTexture(this.texture);
    /** @type {number[]} */
    this.free = [];
    this.used = 0; // slots below are taken or free again
    this.staged = new Uint8Array(4 * SIDE ** 3 * STAGED);
    this.staging = new Data3DTexture(this.staged, SIDE * STAGED, SIDE, SIDE);
    this.staging.format = RGBAFormat;
  }

  /** How many bricks it can ever hold. */
  get capacity() {
    return this.mostLayers * PER_LAYER;
  }

  /**
   * A slot for a brick.
   *
   * @returns {number} -1 if all are taken
   */
  take() {
    const slot = this.free.pop();
    if (slot !== undefined) return slot;
    if (this.used === this.layers * PER_LAYER && !this.#grow()) return -1;
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
    const row = 4 * SIDE * STAGED;
    for (let begin = 0; begin < ordered.length; ) {
      const first = ordered[begin].slot;
      let n = 0;
      while (ordered[begin + n]?.slot === first + n && (n === 0 || (first + n) % ACROSS)) {
        bricks.unpack(ordered[begin + n].entry, this.staged, 4 * SIDE * n, row, row * SIDE);
        n += 1;
      }
      const box = new Box3(new Vector3(0, 0, 0), new Vector3(SIDE * n, SIDE, SIDE));
      this.renderer.copyTextureToTexture(this.staging, this.texture, box, slotPlace(first));
      begin += n;
    }
  }

  /** Forget all bricks. */
  clear() {
    this.free = [];
    this.used = 0;
  }

  dispose() {
    this.texture.dispose();
  }

  #grow() {
    const layers = Math.min(2 * this.layers, this.mostLayers);
    if (layers === this.layers) return false;
    const larger = volume(layers);
    const gl = this.renderer.getContext();
    while (gl.getError() !== gl.NO_ERROR); // what went wrong before is not of this
    this.renderer.initTexture(larger);
    if (gl.getError() !== gl.NO_ERROR) {
      larger.dispose();
      this.mostLayers = this.layers; // the card's memory is full
      return false;
    }
    this.renderer.copyTextureToTexture(this.texture, larger);
    this.texture.dispose();
    this.texture = larger;
    this.layers = layers;
    return true;
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

/** @param {number} layers */
function volume(layers) {
  const texture = new Data3DTexture(null, SIDE * ACROSS, SIDE * ACROSS, SIDE * layers);
  texture.format = RGBAFormat;
  texture.type = UnsignedByteType;
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.generateMipmaps = false;
  texture.source.dataReady = false; // there is nothing to fill it with yet
  texture.needsUpdate = true;
  return texture;
}
