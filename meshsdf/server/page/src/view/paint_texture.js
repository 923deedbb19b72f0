/**
 * The painted texture on the graphics card: page table, atlas, and what every entry shows.
 *
 * Only what changes goes up. Where the atlas is full, the bricks that are wanted least make room,
 * and coarser levels show in their place until the camera comes near.
 */

import { TEXELS, UNIFORM } from "../net/protocol.js";
import { Atlas, slotPlace } from "./atlas.js";
import { Bricks } from "./bricks.js";
import { findBrick } from "./octree.js";
import { mostWanted, worths } from "./residency.js";
import { SHIFT, Tables } from "./tables.js";

const NO_SLOT = -1;
const FILLED_PER_FRAME = 512; // bricks that come back to the card in one frame

export class PaintTexture {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {import("./octree.js").Octree} octree
   */
  constructor(renderer, octree) {
    this.octree = octree;
    this.bricks = new Bricks(octree.nEntries);
    this.slots = new Int32Array(octree.nEntries).fill(NO_SLOT);
    this.resident = 0;
    /** @type {Int32Array} those that may make room, the least wanted last */
    this.order = new Int32Array(0);
    /** @type {Int32Array} those that should come to the card, the most wanted last */
    this.missing = new Int32Array(0);
    this.isCrowded = false; // some bricks found no room
    this.uniforms = {
      pages: { value: /** @type {any} */ (null) },
      groups: { value: /** @type {any} */ (null) },
      sheets: { value: /** @type {any} */ (null) },
      states: { value: /** @type {any} */ (null) },
      atlas: { value: /** @type {any} */ (null) },
      heads: { value: octree.heads },
      perTexel: { value: 1 / octree.texel },
    };
    this.defines = { SHIFT, LEVELS: octree.nLevels };
    this.tables = new Tables(renderer, octree);
    this.atlas = new Atlas(renderer);
    this.#bind();
  }

  /**
   * Make everything on the card anew, after it lost all it had.
   *
   * @param {import("three").WebGLRenderer} renderer
   */
  allocate(renderer) {
    this.tables = new Tables(renderer, this.octree);
    this.atlas = new Atlas(renderer);
    this.slots.fill(NO_SLOT);
    this.resident = 0;
    this.#bind();
    const known = [];
    for (let entry = 0; entry < this.octree.nEntries; entry++) {
      if (this.bricks.has(entry)) known.push(entry);
    }
    this.#show(known);
  }

  /**
   * Show what a message brought.
   *
   * @param {readonly import("../net/protocol.js").Brick[]} bricks
   */
  take(bricks) {
    const entries = [];
    for (const brick of bricks) if (this.bricks.put(brick)) entries.push(brick.entry);
    this.#show(entries);
  }

  /**
   * Choose anew what lies on the card, if it does not hold all.
   *
   * @param {import("./residency.js").Sight} sight
   */
  choose(sight) {
    if (!this.isCrowded) return;
    const worth = worths(this.octree, sight);
    const wanted = mostWanted(this.bricks.states, TEXELS, worth, this.bricks.count);
    const inside = wanted.subarray(0, this.atlas.capacity);
    this.order = wanted;
    this.missing = inside.filter((entry) => this.slots[entry] === NO_SLOT).reverse();
    this.isCrowded = this.bricks.count > this.atlas.capacity;
  }

  /**
   * Bring some of what is missing to the card.
   *
   * @returns {boolean} whether something is missing still
   */
  fill() {
    if (!this.missing.length) return false;
    const left = Math.max(0, this.missing.length - FILLED_PER_FRAME);
    this.#show([...this.missing.subarray(left)].filter((entry) => this.bricks.has(entry)));
    this.missing = this.missing.subarray(0, left);
    return left > 0;
  }

  /**
   * What is shown at a point.
   *
   * @param {readonly number[]} point
   * @param {readonly number[]} normal of the face
   * @returns {{color: [number, number, number, number], level: number, entry: number} | null}
   *     linear, premultiplied
   */
  colorAt(point, normal) {
    const found = findBrick(this.octree, (entry) => this.bricks.has(entry), point, normal);
    if (!found) return null;
    const { entry, level, local } = found;
    return { color: this.bricks.sample(entry, local), level, entry };
  }

  dispose() {
    this.tables.dispose();
    this.atlas.dispose();
  }

  #bind() {
    const { pages, groups, sheets, states } = this.tables;
    for (const [name, value] of Object.entries({ pages, groups, sheets, states })) {
      this.uniforms[/** @type {"pages"} */ (name)].value = value;
    }
    this.uniforms.atlas.value = this.atlas.texture;
  }

  /** @param {readonly number[]} entries whose bricks are new */
  #show(entries) {
    const places = [];
    for (const entry of entries) {
      const state = this.bricks.states[entry];
      if (state !== TEXELS) {
        this.#release(entry);
        if (state === UNIFORM) this.tables.setUniform(entry, this.bricks.color(entry));
        else this.tables.setAbsent(entry);
        continue;
      }
      if (this.slots[entry] === NO_SLOT && !this.#settle(entry)) continue;
      places.push({ slot: this.slots[entry], entry });
    }
    // Those that had to make room for later ones of the same message lost their slots again
    this.atlas.upload(places.filter(({ slot, entry }) => this.slots[entry] === slot), this.bricks);
    this.tables.upload();
    this.uniforms.atlas.value = this.atlas.texture;
  }

  /**
   * Find a slot for an entry.
   *
   * @param {number} entry
   */
  #settle(entry) {
    let slot = this.atlas.take();
    if (slot < 0) {
      this.isCrowded = true;
      if (!this.#evict()) {
        this.tables.setAbsent(entry);
        return false;
      }
      slot = this.atlas.take();
    }
    this.slots[entry] = slot;
    this.resident += 1;
    this.tables.setBrick(entry, slotPlace(slot));
    return true;
  }

  /** Take the least wanted brick off the card. */
  #evict() {
    while (this.order.length) {
      const entry = this.order[this.order.length - 1];
      this.order = this.order.subarray(0, -1);
      if (this.slots[entry] === NO_SLOT) continue;
      this.#release(entry);
      this.tables.setAbsent(entry);
      return true;
    }
    return false;
  }

  /** @param {number} entry */
  #release(entry) {
    if (this.slots[entry] === NO_SLOT) return;
    this.atlas.give(this.slots[entry]);
    this.slots[entry] = NO_SLOT;
    this.resident -= 1;
  }
}
