/**
 * Which bricks lie on the graphics card, where not all find room.
 *
 * What counts is how large a brick's texels are on the screen: the largest first, what is out of
 * sight last. Where a brick is missing a coarser one shows, so the coarse are always there.
 */

const HIDDEN = 1 / 16; // what is out of sight counts as if it were so much smaller

/**
 * @typedef {object} Sight
 * @property {readonly number[]} eye
 * @property {Float32Array} planes (6, 4): what is seen lies on the positive side of all
 */

/**
 * How much every entry is wanted.
 *
 * @param {import("./octree.js").Octree} octree
 * @param {Sight} sight
 * @returns {Float32Array}
 */
export function worths(octree, { eye, planes }) {
  const worth = new Float32Array(octree.nEntries);
  for (let entry = 0; entry < octree.nEntries; entry++) {
    const spacing = octree.texel * 2 ** octree.levels[entry];
    const size = 8 * spacing;
    const x = (octree.bricks[3 * entry] + 0.5) * size;
    const y = (octree.bricks[3 * entry + 1] + 0.5) * size;
    const z = (octree.bricks[3 * entry + 2] + 0.5) * size;
    const away = Math.hypot(x - eye[0], y - eye[1], z - eye[2]);
    let share = 1;
    for (let p = 0; p < 24; p += 4) {
      if (planes[p] * x + planes[p + 1] * y + planes[p + 2] * z + planes[p + 3] < -size) share = HIDDEN;
    }
    worth[entry] = (share * spacing) / Math.max(away, size);
  }
  return worth;
}

/**
 * The entries with texels that are wanted most.
 *
 * @param {Uint8Array} states of all entries
 * @param {number} wanted a state
 * @param {Float32Array} worth
 * @param {number} capacity
 * @returns {Int32Array} at most so many, the most wanted first
 */
export function mostWanted(states, wanted, worth, capacity) {
  const all = [];
  for (let entry = 0; entry < states.length; entry++) if (states[entry] === wanted) all.push(entry);
  const ordered = Int32Array.from(all).sort((a, b) => worth[b] - worth[a] || b - a);
  return ordered.slice(0, capacity);
}
