import assert from "node:assert/strict";
import { test } from "node:test";
import { shadedMesh } from "../src/view/corner_normals.js";

const CUBE = Float32Array.from([0, 1, 2, 3, 4, 5, 6, 7].flatMap((n) => [n >> 2, (n >> 1) & 1, n & 1]));
const CUBE_FACES = Uint32Array.from([
  0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3,
]); // prettier-ignore

/** The three vertices of a face, as plain triples of an array. */
const corners = (/** @type {Float32Array} */ values, /** @type {Uint32Array} */ faces, /** @type {number} */ face) =>
  [0, 1, 2].map((c) => [...values.subarray(3 * faces[3 * face + c], 3 * faces[3 * face + c] + 3)]);

test("a cube keeps its edges: every corner has the normal of its face, in the same order", () => {
  const { positions, normals, index } = shadedMesh(CUBE, CUBE_FACES);
  assert.equal(positions.length / 3, 24);
  for (let face = 0; face < 12; face++) {
    assert.deepEqual(corners(positions, index, face), corners(CUBE, CUBE_FACES, face));
    const axis = Math.floor(face / 2); // -x, x, -y, y, -z, z
    const expected = [0, 0, 0];
    expected[axis >> 1] = axis & 1 ? 1 : -1;
    for (const normal of corners(normals, index, face)) assert.deepEqual(normal.map((v) => v + 0), expected);
  }
});

/** A sphere of rings and segments, as a soup in which no vertex is shared. */
function sphere(n = 24) {
  const at = (/** @type {number} */ i, /** @type {number} */ j) => {
    const [t, p] = [(Math.PI * i) / n, (Math.PI * (j % (2 * n))) / n];
    const r = i % n ? Math.sin(t) : 0;
    return [r * Math.cos(p), r * Math.sin(p), Math.cos(t)];
  };
  const points = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < 2 * n; j++) {
      const [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
      if (i < n - 1) points.push(a, b, c);
      if (i > 0) points.push(a, c, d);
    }
  }
  const positions = Float32Array.from(points.flat());
  return { positions, faces: Uint32Array.from(points, (_, v) => v) };
}

test("a soup of a sphere's triangles is smooth, its normals radial", () => {
  const { positions, faces } = sphere();
  const shaded = shadedMesh(positions, faces);
  assert.equal(shaded.positions.length / 3, 23 * 48 + 2); // the vertices, welded
  for (let v = 0; v < shaded.positions.length; v += 3) {
    const dot = [0, 1, 2].reduce((sum, axis) => sum + shaded.positions[v + axis] * shaded.normals[v + axis], 0);
    assert.ok(dot > Math.cos(0.02));
  }
});

test("faces without area neither fail nor turn what is around them", () => {
  const positions = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0.5, 0, 0]);
  const faces = Uint32Array.from([0, 1, 2, 0, 3, 1, 3, 3, 3]);
  const { normals, index } = shadedMesh(positions, faces);
  assert.ok(normals.every(Number.isFinite));
  assert.deepEqual(corners(normals, index, 0), [[0, 0, 1], [0, 0, 1], [0, 0, 1]]);
  assert.deepEqual(shadedMesh(new Float32Array(0), new Uint32Array(0)).index.length, 0);
});
