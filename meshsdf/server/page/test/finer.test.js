/** Meshes with more faces: the same shape, and nothing tears where vertices move. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { shadedMesh } from "../src/view/corner_normals.js";
import { finerMesh, meanEdge } from "../src/view/finer_mesh.js";

const CUBE = Float32Array.from({ length: 24 }, (_, n) => ((Math.floor(n / 3) >> (2 - (n % 3))) & 1) - 0.3);
const SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]; // prettier-ignore
const FACES = Uint32Array.from(SIDES.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]));

/** @param {import("../src/view/corner_normals.js").Shaded} mesh */
function volumeOf({ positions, index }) {
  let sum = 0;
  for (let at = 0; at < index.length; at += 3) {
    const [a, b, c] = [0, 1, 2].map((n) => positions.subarray(3 * index[at + n], 3 * index[at + n] + 3));
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

test("a mesh is divided until its edges are short enough, and no further than it may", () => {
  const cube = shadedMesh(CUBE, FACES);
  assert.equal(finerMesh(cube, 2), cube);
  const finer = finerMesh(cube, 0.2);
  assert.equal(finer.index.length, 64 * cube.index.length);
  assert.ok(Math.abs(meanEdge(finer) - meanEdge(cube) / 8) < 1e-6);
  assert.equal(finerMesh(cube, 0.2, 200).index.length, 16 * cube.index.length);
  assert.ok(Math.abs(volumeOf(finer) - 1) < 1e-6);
});

test("every edge has a face on both sides, and both move its ends alike", () => {
  const finer = finerMesh(shadedMesh(CUBE, FACES), 0.3);
  const moved = (/** @type {number} */ vertex) =>
    [0, 1, 2].map((axis) => finer.positions[3 * vertex + axis] + 0.07 * finer.away[3 * vertex + axis]).join(" ");
  /** @type {Map<string, number>} */
  const sides = new Map();
  for (let corner = 0; corner < finer.index.length; corner++) {
    const next = corner % 3 === 2 ? corner - 2 : corner + 1;
    const ends = [moved(finer.index[corner]), moved(finer.index[next])];
    const key = [...ends].sort().join(" | ");
    sides.set(key, (sides.get(key) ?? 0) + (ends[0] < ends[1] ? 1 : -1));
  }
  assert.equal(sides.size, (3 * finer.index.length) / 6);
  assert.ok([...sides.values()].every((sum) => sum === 0));
});

test("places move along the mean of all faces there, and shading keeps its edges", () => {
  const { positions, normals, away } = shadedMesh(CUBE, FACES);
  assert.equal(positions.length, 3 * 24);
  for (let at = 0; at < positions.length; at += 3) {
    for (let axis = 0; axis < 3; axis++) {
      const sign = positions[at + axis] > 0 ? 1 : -1;
      assert.ok(Math.abs(away[at + axis] - sign / Math.sqrt(3)) < 1e-6);
    }
    assert.equal(Math.max(...normals.subarray(at, at + 3).map(Math.abs)), 1);
  }
});
