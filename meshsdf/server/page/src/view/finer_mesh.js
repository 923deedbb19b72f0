/**
 * A mesh of more, smaller faces of the same shape, so that its surface can be moved finely.
 *
 * Every face becomes four, time and again. The middle of an edge comes from its two ends alone, by
 * sums that do not ask which is the first: faces on both sides of it have it at the same place.
 */

/** @typedef {import("./corner_normals.js").Shaded} Shaded */

const MOST_FACES = 100_000;

/**
 * @param {Shaded} mesh
 * @param {number} wanted length that edges should have at most, in the mean
 * @param {number} [mostFaces]
 * @returns {Shaded} the mesh itself if it is fine enough
 */
export function finerMesh(mesh, wanted, mostFaces = MOST_FACES) {
  let finer = mesh;
  let length = meanEdge(mesh);
  while (length > wanted && (4 * finer.index.length) / 3 <= mostFaces) {
    finer = divided(finer);
    length /= 2;
  }
  return finer;
}

/**
 * The mean length of edges.
 *
 * @param {Shaded} mesh
 */
export function meanEdge({ positions, index }) {
  let sum = 0;
  for (let corner = 0; corner < index.length; corner++) {
    const a = 3 * index[corner];
    const b = 3 * index[corner % 3 === 2 ? corner - 2 : corner + 1];
    sum += Math.hypot(
      positions[a] - positions[b],
      positions[a + 1] - positions[b + 1],
      positions[a + 2] - positions[b + 2],
    );
  }
  return sum / Math.max(index.length, 1);
}

/**
 * @param {Shaded} mesh
 * @returns {Shaded}
 */
function divided({ positions, normals, away, index }) {
  const n = positions.length / 3;
  const { ends, middles } = edges(index, n);
  const outIndex = new Uint32Array(4 * index.length);
  for (let face = 0; face < index.length; face += 3) {
    const [a, b, c] = index.subarray(face, face + 3);
    const [ab, bc, ca] = middles.subarray(face, face + 3).map((middle) => n + middle);
    outIndex.set([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], 4 * face);
  }
  return {
    positions: withMiddles(positions, ends, false),
    normals: withMiddles(normals, ends, false),
    away: withMiddles(away, ends, true),
    index: outIndex,
  };
}

/**
 * The edges of faces, each once: their ends, and which one goes on from every corner.
 *
 * @param {Uint32Array} index
 * @param {number} n vertices
 */
function edges(index, n) {
  const middles = new Uint32Array(index.length);
  /** @type {number[]} */
  const ends = [];
  // Edges are found by their lower end, which knows the newest of its edges; each knows an older one
  const newest = new Int32Array(n).fill(-1);
  /** @type {number[]} */
  const older = [];
  for (let corner = 0; corner < index.length; corner++) {
    const next = index[corner % 3 === 2 ? corner - 2 : corner + 1];
    const low = Math.min(index[corner], next);
    const high = Math.max(index[corner], next);
    let edge = newest[low];
    while (edge >= 0 && ends[2 * edge + 1] !== high) edge = older[edge];
    if (edge < 0) {
      edge = older.length;
      older.push(newest[low]);
      newest[low] = edge;
      ends.push(low, high);
    }
    middles[corner] = edge;
  }
  return { ends, middles };
}

/**
 * @param {Float32Array} values (n, 3)
 * @param {readonly number[]} ends of edges
 * @param {boolean} isUnit whether the middles are of length 1
 */
function withMiddles(values, ends, isUnit) {
  const out = new Float32Array(values.length + (3 * ends.length) / 2);
  out.set(values);
  let to = values.length;
  for (let edge = 0; edge < ends.length; edge += 2, to += 3) {
    const [a, b] = [3 * ends[edge], 3 * ends[edge + 1]];
    for (let axis = 0; axis < 3; axis++) out[to + axis] = (values[a + axis] + values[b + axis]) / 2;
    const length = isUnit ? Math.hypot(out[to], out[to + 1], out[to + 2]) : 1;
    for (let axis = 0; axis < 3 && length > 0; axis++) out[to + axis] /= length;
  }
  return out;
}
