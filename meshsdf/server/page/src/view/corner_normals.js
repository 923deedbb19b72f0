/**
 * Normals to shade a mesh by: smooth where it is smooth, with edges where it has some.
 *
 * At each corner of a face the normals of the faces around the vertex are averaged, weighted by
 * their angles there (Thürmer and Wüthrich 1998, doi:10.1080/10867651.1998.10487487), as far as
 * they look the way of this face. Vertices are told apart by place, so that soups of triangles
 * are as smooth as what they were made of.
 */

const CREASE = Math.cos((50 * Math.PI) / 180);

/**
 * @typedef {object} Shaded
 * @property {Float32Array} positions (v, 3)
 * @property {Float32Array} normals (v, 3)
 * @property {Float32Array} away (v, 3) of all faces at a place, whatever the edges: the way along
 *     which the place moves
 * @property {Uint32Array} index (m, 3)
 */

/**
 * @param {Float32Array} positions (n, 3)
 * @param {Uint32Array} faces (m, 3)
 * @returns {Shaded} the same faces in the same order, vertices repeated where edges are sharp
 */
export function shadedMesh(positions, faces) {
  const nFaces = faces.length / 3;
  const place = weldedPlaces(positions);
  const faceNormals = new Float32Array(faces.length);
  const angles = new Float32Array(faces.length);
  for (let face = 0; face < nFaces; face++) measureFace(positions, faces, face, faceNormals, angles);
  const { first, corners } = cornersAround(place, faces, positions.length / 3);

  const index = new Uint32Array(faces.length);
  /** @type {number[]} */
  const outPositions = [];
  /** @type {number[]} */
  const outNormals = [];
  /** @type {number[]} */
  const outAway = [];
  for (let p = 0; p < first.length - 1; p++) {
    const made = outPositions.length / 3; // vertices of this place begin here
    const away = meanNormal(first[p], first[p + 1], corners, faceNormals, angles, null);
    for (let at = first[p]; at < first[p + 1]; at++) {
      const corner = corners[at];
      const [x, y, z] = cornerNormal(corner, first[p], first[p + 1], corners, faceNormals, angles);
      let vertex = made;
      const end = outPositions.length / 3;
      for (; vertex < end; vertex++) {
        const dot = outNormals[3 * vertex] * x + outNormals[3 * vertex + 1] * y + outNormals[3 * vertex + 2] * z;
        if (dot > 0.9999) break;
      }
      if (vertex === end) {
        const v = 3 * faces[corner];
        outPositions.push(positions[v], positions[v + 1], positions[v + 2]);
        outNormals.push(x, y, z);
        outAway.push(...away);
      }
      index[corner] = vertex;
    }
  }
  return {
    positions: Float32Array.from(outPositions),
    normals: Float32Array.from(outNormals),
    away: Float32Array.from(outAway),
    index,
  };
}

/**
 * The first vertex at the place of each.
 *
 * @param {Float32Array} positions
 */
function weldedPlaces(positions) {
  const n = positions.length / 3;
  const place = new Uint32Array(n);
  const bits = new Uint32Array(positions.buffer, positions.byteOffset, positions.length);
  let size = 16;
  while (size < 2 * n) size *= 2;
  const table = new Int32Array(size).fill(-1);
  for (let v = 0; v < n; v++) {
    // 0 and -0 are one place
    const [a, b, c] = [0, 1, 2].map((axis) => (positions[3 * v + axis] === 0 ? 0 : bits[3 * v + axis]));
    let hash = (Math.imul(a, 0x9e3779b1) ^ Math.imul(b, 0x85ebca77) ^ Math.imul(c, 0xc2b2ae3d)) >>> 0;
    hash = (hash ^ (hash >>> 15)) & (size - 1);
    for (;;) {
      const other = table[hash];
      if (other < 0) {
        table[hash] = v;
        place[v] = v;
        break;
      }
      if (
        positions[3 * other] === positions[3 * v] &&
        positions[3 * other + 1] === positions[3 * v + 1] &&
        positions[3 * other + 2] === positions[3 * v + 2]
      ) {
        place[v] = other;
        break;
      }
      hash = (hash + 1) & (size - 1);
    }
  }
  return place;
}

/**
 * @param {Float32Array} positions
 * @param {Uint32Array} faces
 * @param {number} face
 * @param {Float32Array} normals filled: of length 1, or 0 where there is no area
 * @param {Float32Array} angles filled: at the three corners
 */
function measureFace(positions, faces, face, normals, angles) {
  const points = [0, 1, 2].map((corner) => 3 * faces[3 * face + corner]);
  /** @type {(a: number, b: number) => [number, number, number]} */
  const edge = (a, b) => [
    positions[points[b]] - positions[points[a]],
    positions[points[b] + 1] - positions[points[a] + 1],
    positions[points[b] + 2] - positions[points[a] + 2],
  ];
  const [a, b, c] = [edge(0, 1), edge(1, 2), edge(2, 0)];
  const cross = [a[1] * -c[2] + a[2] * c[1], a[2] * -c[0] + a[0] * c[2], a[0] * -c[1] + a[1] * c[0]];
  const area = Math.hypot(...cross);
  for (let axis = 0; axis < 3; axis++) normals[3 * face + axis] = area > 0 ? cross[axis] / area : 0;
  const sides = [a, b, c];
  for (let corner = 0; corner < 3; corner++) {
    const out = sides[corner];
    const back = sides[(corner + 2) % 3];
    const dot = -(out[0] * back[0] + out[1] * back[1] + out[2] * back[2]);
    angles[3 * face + corner] = Math.atan2(area, dot);
  }
}

/**
 * Corners (3 face + corner) grouped by place.
 *
 * @param {Uint32Array} place
 * @param {Uint32Array} faces
 * @param {number} n
 */
function cornersAround(place, faces, n) {
  const first = new Uint32Array(n + 1);
  for (const vertex of faces) first[place[vertex] + 1] += 1;
  for (let v = 0; v < n; v++) first[v + 1] += first[v];
  const next = first.slice(0, n);
  const corners = new Uint32Array(faces.length);
  for (let corner = 0; corner < faces.length; corner++) {
    const p = place[faces[corner]];
    corners[next[p]] = corner;
    next[p] += 1;
  }
  return { first, corners };
}

/**
 * @param {number} corner
 * @param {number} begin
 * @param {number} end
 * @param {Uint32Array} corners around the place of this one
 * @param {Float32Array} normals of faces
 * @param {Float32Array} angles
 * @returns {[number, number, number]}
 */
function cornerNormal(corner, begin, end, corners, normals, angles) {
  const face = 3 * Math.floor(corner / 3);
  const [x, y, z] = normals.subarray(face, face + 3);
  const isFlat = x === 0 && y === 0 && z === 0; // a face without area goes along with all others
  const mean = meanNormal(begin, end, corners, normals, angles, isFlat ? null : [x, y, z]);
  return mean[0] === 0 && mean[1] === 0 && mean[2] === 0 ? [x, y, z] : mean;
}

/**
 * The mean normal of the faces at a place, weighted by their angles there.
 *
 * @param {number} begin
 * @param {number} end
 * @param {Uint32Array} corners
 * @param {Float32Array} normals of faces
 * @param {Float32Array} angles
 * @param {readonly [number, number, number] | null} way only of faces that look this way
 * @returns {[number, number, number]} of length 1, or 0
 */
function meanNormal(begin, end, corners, normals, angles, way) {
  let [x, y, z] = [0, 0, 0];
  for (let at = begin; at < end; at++) {
    const face = 3 * Math.floor(corners[at] / 3);
    const [nx, ny, nz] = [normals[face], normals[face + 1], normals[face + 2]];
    if (way && nx * way[0] + ny * way[1] + nz * way[2] < CREASE) continue;
    const weight = angles[corners[at]];
    x += weight * nx;
    y += weight * ny;
    z += weight * nz;
  }
  const length = Math.hypot(x, y, z);
  return length > 0 ? [x / length, y / length, z / length] : [0, 0, 0];
}
