/** Where the brush is and, with a symmetry, where its copies are; drawn by the surface's shader. */

import { Matrix3, Vector3 } from "three";

export const MOST_CURSORS = 16;
const LEAST_PIXELS = 3; // radius of the smallest ring
const AXES = ["x", "y", "z"];

/**
 * The copies of a symmetry as linear maps about its centre, the first the identity.
 *
 * @param {{mirror: string, radial: number, axis: string}} symmetry
 * @returns {Matrix3[]}
 */
export function copies({ mirror, radial, axis }) {
  let maps = [];
  const a = (AXES.indexOf(axis) + 1) % 3;
  const b = (AXES.indexOf(axis) + 2) % 3;
  for (let turn = 0; turn < radial; turn++) {
    const angle = (2 * Math.PI * turn) / radial;
    const map = new Matrix3(); // elements are by columns
    map.elements[4 * a] = map.elements[4 * b] = Math.cos(angle);
    map.elements[3 * a + b] = Math.sin(angle);
    map.elements[3 * b + a] = -Math.sin(angle);
    maps.push(map);
  }
  for (const letter of mirror) {
    const flip = new Matrix3();
    flip.elements[4 * AXES.indexOf(letter)] = -1;
    maps = maps.concat(maps.map((map) => map.clone().multiply(flip)));
  }
  return maps;
}

export class Cursor {
  /** Place of the wire's origin in the texture's own space, which symmetries are given in. */
  origin = new Vector3();

  constructor() {
    const vectors = () => Array.from({ length: MOST_CURSORS }, () => new Vector3());
    this.uniforms = {
      nCursors: { value: 0 },
      cursors: { value: vectors() },
      cursorNormals: { value: vectors() },
      rings: { value: [1, 1] },
    };
  }

  /**
   * @param {import("./surface.js").Hit | null} hit
   * @param {import("../tool.js").Tool | null} tool
   * @param {number} pixel its size at the hit
   * @param {boolean} hasSize whether the tool paints within a radius
   */
  show(hit, tool, pixel, hasSize) {
    if (!hit || !tool) {
      this.uniforms.nCursors.value = 0;
      return;
    }
    const radius = hasSize ? tool.radius : 0;
    const least = LEAST_PIXELS * pixel;
    const center = new Vector3(...tool.symmetry.center).sub(this.origin);
    const maps = (hasSize ? copies(tool.symmetry) : [new Matrix3()]).slice(0, MOST_CURSORS);
    maps.forEach((map, n) => {
      this.uniforms.cursors.value[n].copy(hit.point).sub(center).applyMatrix3(map).add(center);
      this.uniforms.cursorNormals.value[n].copy(hit.normal).applyMatrix3(map);
    });
    this.uniforms.nCursors.value = maps.length;
    this.uniforms.rings.value = [Math.max(radius, least), radius * tool.hardness];
  }

  /**
   * Mark where it is drawn.
   *
   * @param {import("./region.js").Region} region
   * @param {import("./orbit.js").Orbit} orbit
   * @param {number} spread how far the surface may have moved
   */
  mark(region, orbit, spread) {
    const { nCursors, cursors, rings } = this.uniforms;
    for (const center of cursors.value.slice(0, nCursors.value)) {
      region.addBall(orbit, center, rings.value[0] + spread);
    }
  }
}
