/**
 * All pictures of a texture on the graphics card: colours, normals and heights.
 *
 * They share the octree's tables; where the same entry lies in the volumes of two pictures, and
 * whether it has a brick there, has nothing to do with one another.
 */

import { Bricks, HeightBricks } from "./bricks.js";
import { FORMATS } from "./formats.js";
import { PaintTexture } from "./paint_texture.js";
import { SHIFT, Tables } from "./tables.js";

/** @typedef {import("../net/protocol.js").PictureName} PictureName */

export class Painting {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {import("./octree.js").Octree} octree
   */
  constructor(renderer, octree) {
    this.renderer = renderer;
    this.octree = octree;
    this.tables = new Tables(renderer, octree);
    this.heightBricks = new HeightBricks(octree.nEntries);
    const picture = (/** @type {Bricks} */ bricks) => new PaintTexture(renderer, octree, bricks);
    /** @type {Record<PictureName, PaintTexture>} */
    this.pictures = {
      base: picture(new Bricks(octree.nEntries)),
      normal: picture(new Bricks(octree.nEntries, FORMATS.normal)),
      height: picture(this.heightBricks),
    };
    this.reach = 0; // largest |height|, in finest texels
    const none = () => ({ value: /** @type {any} */ (null) });
    this.uniforms = {
      pages: none(), groups: none(), sheets: none(),
      baseStates: none(), normalStates: none(), heightStates: none(),
      baseAtlas: none(), normalAtlas: none(), heightAtlas: none(),
      heads: { value: octree.heads },
      perTexel: { value: 1 / octree.texel },
    }; // prettier-ignore
    this.defines = { SHIFT, LEVELS: octree.nLevels };
    this.pictures.base.wake();
    this.#bind();
  }

  get base() {
    return this.pictures.base;
  }

  /**
   * Whether a picture has something to show.
   *
   * @param {PictureName} name
   */
  has(name) {
    return this.pictures[name].states !== null;
  }

  /** Make everything on the card anew, after it lost all it had. */
  allocate() {
    this.tables = new Tables(this.renderer, this.octree);
    for (const picture of this.#all()) picture.allocate();
    this.pictures.base.wake();
    this.#bind();
  }

  /**
   * Show what a message brought.
   *
   * @param {readonly import("../net/protocol.js").Brick[]} bricks
   * @param {PictureName} name
   */
  take(bricks, name) {
    this.pictures[name].take(bricks);
    this.#bind();
  }

  /**
   * Keep what a message brought while the card is lost.
   *
   * @param {readonly import("../net/protocol.js").Brick[]} bricks
   * @param {PictureName} name
   */
  keep(bricks, name) {
    for (const brick of bricks) this.pictures[name].bricks.put(brick);
  }

  get isCrowded() {
    return this.#all().some((picture) => picture.isCrowded);
  }

  /** @param {import("./residency.js").Sight} sight */
  choose(sight) {
    for (const picture of this.#all()) picture.choose(sight);
    return this.#all().some((picture) => picture.missing.length > 0);
  }

  /**
   * Bring some of what is missing to the card.
   *
   * @returns {boolean} whether something is missing still
   */
  fill() {
    const isMissing = this.#all().map((picture) => picture.fill());
    this.#bind();
    return isMissing.includes(true);
  }

  dispose() {
    this.tables.dispose();
    for (const picture of this.#all()) picture.dispose();
  }

  #all() {
    return Object.values(this.pictures);
  }

  #bind() {
    const { uniforms, tables, pictures } = this;
    uniforms.pages.value = tables.pages;
    uniforms.groups.value = tables.groups;
    uniforms.sheets.value = tables.sheets;
    this.reach = this.has("height") ? this.heightBricks.reach() : 0;
    for (const name of /** @type {const} */ (["base", "normal", "height"])) {
      // What is not there is not looked at, but must be of the kind that the shader says
      const { states, atlas } = pictures[name].states ? pictures[name] : pictures.base;
      uniforms[`${name}States`].value = states?.texture;
      uniforms[`${name}Atlas`].value = atlas?.texture;
    }
  }
}
