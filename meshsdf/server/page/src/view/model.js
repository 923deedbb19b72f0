/** The painted model: its surface, the pictures on it, and the material that shows them. */

import { DoubleSide, GLSL3, Mesh, RawShaderMaterial, Vector3 } from "three";
import { MOST_CURSORS } from "./cursor.js";
import { straight } from "./formats.js";
import { PAINT_FRAGMENT, PAINT_VERTEX, SHOWS } from "./paint_shader.js";
import { Painting } from "./painting.js";
import { onRelief } from "./relief.js";
import { Surface } from "./surface.js";

/** @typedef {import("../net/protocol.js").PictureName} PictureName */
/** @typedef {import("../store.js").Vec3} Vec3 */
/** @typedef {import("./surface.js").Hit} Hit */

const CLAY = [0.4, 0.45, 0.52]; // linear: what is seen where nothing is painted
const EDGES = 3; // mean ones: as far may faces reach that a moved vertex belongs to

export class Model {
  /**
   * @param {import("three").WebGLRenderer} renderer
   * @param {ArrayBuffer} mesh as GET /api/mesh gives it
   * @param {import("./octree.js").Octree} octree
   * @param {import("../store.js").Facts} facts
   * @param {import("./cursor.js").Cursor} cursor
   */
  constructor(renderer, mesh, octree, facts, cursor) {
    this.octree = octree;
    this.surface = new Surface(mesh, octree.texel);
    this.painting = new Painting(renderer, octree);
    const [r, g, b, a] = facts.base_color ?? [0, 0, 0, 0];
    this.bare = [r, g, b].map((value, n) => value * a + (1 - a) * CLAY[n]);
    this.isRaised = true; // whether heights are shown
    /** @type {import("./bricks.js").Bricks | null} heights that a stroke began on */
    this.held = null;
    /** @type {Map<number, boolean>} entries whose bricks the surface passes through, or not */
    this.passed = new Map();
    const level = Math.round(Math.log2(this.surface.edge / octree.texel));
    this.uniforms = {
      reach: { value: 0 },
      moveLevel: { value: Math.min(Math.max(level, 0), octree.nLevels - 1) },
      bare: { value: this.bare },
    };
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: PAINT_VERTEX,
      fragmentShader: PAINT_FRAGMENT,
      side: DoubleSide,
      defines: { ...this.painting.defines, CURSORS: MOST_CURSORS },
      uniforms: { ...this.painting.uniforms, ...cursor.uniforms, ...this.uniforms },
    });
    this.object = new Mesh(this.surface.drawn, this.material);
    this.object.frustumCulled = false;
  }

  /**
   * Show it as the painter wants to see it.
   *
   * @param {import("../store.js").View} view
   */
  dress({ show, lit, wireframe, relief }) {
    const { material, painting } = this;
    this.isRaised = relief;
    this.uniforms.reach.value = painting.reach;
    const wanted = {
      SHOW: Math.max(SHOWS.indexOf(show), 0),
      LIT: Number(lit),
      RELIEF: Number(relief),
      BRICKS: Number(wireframe),
      HEIGHTS: Number(painting.has("height")),
      NORMALS: Number(painting.has("normal")),
    };
    const { defines } = material;
    if (Object.entries(wanted).every(([name, value]) => defines[name] === value)) return;
    Object.assign(defines, wanted);
    material.needsUpdate = true;
  }

  /**
   * How far beyond its own bricks a picture's change can be seen, world units.
   *
   * @param {PictureName} name
   */
  spread(name) {
    const { texel } = this.octree;
    const moved = this.isRaised ? this.painting.reach * texel : 0;
    return name === "height" ? moved + EDGES * this.surface.edge + texel : moved;
  }

  /**
   * Whether coarser bricks show in the place of an entry. Some entries never have a brick, since they
   * only hold nodes of cells beside them: nothing of the surface lies there.
   *
   * @param {number} entry
   * @param {PictureName} name
   */
  isBare(entry, name) {
    const { octree, painting, surface } = this;
    if (painting.pictures[name].bricks.has(entry)) return false;
    let passes = this.passed.get(entry);
    if (passes === undefined) {
      const size = 8 * octree.texel * 2 ** octree.levels[entry];
      const corner = new Vector3(...octree.bricks.subarray(3 * entry, 3 * entry + 3));
      passes = surface.passes(corner.multiplyScalar(size), size);
      this.passed.set(entry, passes);
    }
    return passes;
  }

  /**
   * While a stroke lasts, rays meet the surface as it was before: else it would rise towards the
   * pointer as it is painted, and the stroke would go astray.
   *
   * @param {boolean} is
   */
  hold(is) {
    this.held = is ? this.painting.heightBricks.copy() : null;
  }

  /**
   * The place that a ray meets, as it is seen.
   *
   * @param {import("three").Ray} ray
   * @returns {Hit | null}
   */
  hit(ray) {
    const hit = this.surface.hit(ray);
    if (!hit || !this.isRaised || this.painting.reach === 0) return hit;
    const { texel } = this.octree;
    const { reach } = this.painting;
    const heights = this.held ?? this.painting.heightBricks;
    return onRelief(this.surface, ray, hit, (at) => this.heightAt(at, heights) * texel, reach * texel);
  }

  /**
   * What the picture of colours shows at a place.
   *
   * @param {Hit} hit
   */
  look(hit) {
    const { bricks } = this.painting.base;
    return bricks.valuesAt(this.octree, hit.point.toArray(), hit.faceNormal.toArray());
  }

  /**
   * The height at a place, in finest texels.
   *
   * @param {Hit} hit
   * @param {import("./bricks.js").Bricks} [bricks]
   */
  heightAt({ point, faceNormal }, bricks = this.painting.heightBricks) {
    return straight(bricks.valuesAt(this.octree, point.toArray(), faceNormal.toArray())?.values);
  }

  /**
   * How far apart the texels are that are shown at a place.
   *
   * @param {Hit} hit
   */
  spacing(hit) {
    return this.octree.texel * 2 ** (this.look(hit)?.level ?? this.octree.nLevels - 1);
  }

  /**
   * The colour that is seen at a place.
   *
   * @param {Hit} hit
   * @returns {Vec3} linear
   */
  visibleColor(hit) {
    const [r, g, b, a] = this.look(hit)?.values ?? [0, 0, 0, 0];
    const { bare } = this;
    return [r + (1 - a) * bare[0], g + (1 - a) * bare[1], b + (1 - a) * bare[2]];
  }

  dispose() {
    this.painting.dispose();
    this.surface.dispose();
    this.material.dispose();
  }
}
