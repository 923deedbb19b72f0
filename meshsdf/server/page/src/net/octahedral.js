/**
 * Directions in two numbers: the octahedron's faces folded into a square (Meyer et al. 2010,
 * doi:10.1111/j.1467-8659.2010.01737.x).
 */

const SCALE = 32767;
const NONE = -32768;

/**
 * @param {readonly number[]} normal of any length but zero
 * @returns {[number, number]} two signed 16 bit numbers; (-32768, -32768) for a zero normal
 */
export function encodeOctahedral([x, y, z]) {
  const total = Math.abs(x) + Math.abs(y) + Math.abs(z);
  if (!(total > 0)) return [NONE, NONE];
  let u = x / total;
  let v = y / total;
  if (z < 0) [u, v] = [(1 - Math.abs(v)) * (u >= 0 ? 1 : -1), (1 - Math.abs(u)) * (v >= 0 ? 1 : -1)];
  return [Math.round(SCALE * u), Math.round(SCALE * v)];
}

/**
 * @param {number} a
 * @param {number} b
 * @returns {[number, number, number]} of length 1, or zero for none
 */
export function decodeOctahedral(a, b) {
  if (a === NONE) return [0, 0, 0];
  let x = a / SCALE;
  let y = b / SCALE;
  const z = 1 - Math.abs(x) - Math.abs(y);
  const fold = Math.max(-z, 0);
  x += x >= 0 ? -fold : fold;
  y += y >= 0 ? -fold : fold;
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}
