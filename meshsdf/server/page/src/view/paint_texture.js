/**
 * One picture of the texture on the graphics card: an atlas, and what every entry shows.
 *
 * Only what changes goes up, and nothing lies there before the first brick came. Where the atlas is
 * full, the bricks that are wanted least make room, and coarser levels show in their place until the
 * camera comes near.
 */

import { TEXELS, UNIFORM } from "../net/protocol.js";
import { Atlas, slotPlace } from "./atlas.js";
import { mostWanted, worths } from "./residency.js";
import { States } from "./tables.js";

const NO_SLOT = -1;
const FILLED_PER_FRAME = 512; // bricks that come back to the card in one frame
const NONE = new Int32Array(0);

export class PaintTexture {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {import("./octree.js").Octree} octree
   * @param {import("./bricks.js").Bricks} bricks
   */
  constructor(renderer, octree, bricks) {
    this.renderer = renderer;
    this.octree = octree;
    this.bricks = bricks;
    this.slots = new Int32Array(octree.nEntries).fill(NO_SLOT);
    this.resident = 0;
    /** @type {Int32Array} those that may make room, the least wanted last */
    this.order = NONE;
    /** @type {Int32Array} those that should come to the card, the most wanted last */
    this.missing = NONE;
    this.isCrowded = false; // some bricks found no room
    /** @type {States | null} */
    this.states = null;
    /** @type {Atlas | null} */
    this.atlas = null;
  }

  /** Have room on the card. */
  wake() {
    this.states ??= new States(this.renderer, this.octree.nEntries);
    this.atlas ??= new Atlas(this.renderer, this.bricks.format);
    return { states: this.states, atlas: this.atlas };
  }

  /** Make everything on the card anew, after it lost all it had. */
  allocate() {
    const known = this.bricks.known();
    if (!this.states && !known.length) return;
    this.states = this.atlas = null;
    this.slots.fill(NO_SLOT);
    this.resident = 0;
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
    if (entries.length) this.#show(entries);
  }

  /**
   * Choose anew what lies on the card, if it does not hold all.
   *
   * @param {import("./residency.js").Sight} sight
   */
  choose(sight) {
    if (!this.isCrowded || !this.atlas) return;
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

  dispose() {
    this.states?.dispose();
    this.atlas?.dispose();
  }

  /** @param {readonly number[]} entries whose bricks are new */
  #show(entries) {
    const { states, atlas } = this.wake();
    const places = [];
    for (const entry of entries) {
      const state = this.bricks.states[entry];
      if (state !== TEXELS) {
        this.#release(entry);
        if (state === UNIFORM) states.setUniform(entry, this.bricks.bytes(entry));
        else states.setAbsent(entry);
        continue;
      }
      if (this.slots[entry] === NO_SLOT && !this.#settle(entry, states, atlas)) continue;
      places.push({ slot: this.slots[entry], entry });
    }
    // Those that had to make room for later ones of the same message lost their slots again
    atlas.upload(places.filter(({ slot, entry }) => this.slots[entry] === slot), this.bricks);
    states.upload();
  }

  /**
   * Find a slot for an entry.
   *
   * @param {number} entry
   * @param {States} states
   * @param {Atlas} atlas
   */
  #settle(entry, states, atlas) {
    let slot = atlas.take();
    if (slot < 0 && atlas.grow(() => this.#refill(atlas))) slot = atlas.take();
    if (slot < 0) {
      this.isCrowded = true;
      if (!this.#evict(states)) {
        states.setAbsent(entry);
        return false;
      }
      slot = atlas.take();
    }
    this.slots[entry] = slot;
    this.resident += 1;
    states.setBrick(entry, slotPlace(slot));
    return true;
  }

  /**
   * Send up again all that has a slot.
   *
   * @param {Atlas} atlas
   */
  #refill(atlas) {
    const places = [];
    for (const [entry, slot] of this.slots.entries()) {
      if (slot !== NO_SLOT) places.push({ slot, entry });
    }
    atlas.upload(places, this.bricks);
  }

  /**
   * Take the least wanted brick off the card.
   *
   * @param {States} states
   */
  #evict(states) {
    while (this.order.length) {
      const entry = this.order[this.order.length - 1];
      this.order = this.order.subarray(0, -1);
      if (this.slots[entry] === NO_SLOT) continue;
      this.#release(entry);
      states.setAbsent(entry);
      return true;
    }
    return false;
  }

  /** @param {number} entry */
  #release(entry) {
    if (this.slots[entry] === NO_SLOT) return;
    this.atlas?.give(this.slots[entry]);
    this.slots[entry] = NO_SLOT;
    this.resident -= 1;
  }
}
