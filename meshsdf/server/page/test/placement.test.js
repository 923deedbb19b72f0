import assert from "node:assert/strict";
import { test } from "node:test";

import { placeAt, shiftOf } from "../src/ui/drag_rows.js";
import {
  around, axesOf, cameraParams, cross, dot, flatParams, hullOf, matrixOf, minus, turned, unit,
} from "../src/ui/placement.js"; // prettier-ignore

const near = (a, b, least = 1e-9) =>
  a.forEach((v, i) => assert.ok(Math.abs(v - b[i]) <= least, `${a} is not ${b}`));
const apply = (matrix, point) => [0, 1, 2].map((i) => dot(matrix[i], point) + matrix[i][3]);
const camera = {
  eye: [0, 0, 10], target: [0, 0, 0], up: [0, 1, 0], fov: 40, aspect: 1.5, width: 900, height: 600,
}; // prettier-ignore

function checkAxes({ right, up, out }) {
  for (const [a, b] of [[right, up], [up, out], [out, right]]) assert.ok(Math.abs(dot(a, b)) < 1e-12); // prettier-ignore
  near(cross(right, up), out, 1e-12);
}

test("axes are right-handed, upright, and exist when one looks along up", () => {
  for (const out of [
    [0, 0, 1],
    [1, 2, 3],
    [0, 1, 0],
    [0, -5, 0],
    [1e-9, 1, 0],
  ]) {
    // prettier-ignore
    const axes = axesOf(out, [0, 1, 0]);
    checkAxes(axes);
    near(axes.out, unit(out), 1e-9);
    assert.ok(axes.up[1] >= -1e-9);
  }
  near(axesOf([0, 0, 2], [0, 1, 0]).right, [1, 0, 0]);
});

test("a quarter turn takes right to up, and four are none", () => {
  const axes = axesOf([0, 0, 1], [0, 1, 0]);
  near(turned(axes, 90).right, [0, 1, 0]);
  near(turned(axes, 360).right, axes.right);
  checkAxes(turned(axes, 33));
});

test("the middle of a plane's image, of width by height from its corner, lies at the point", () => {
  const axes = turned(axesOf([1, 1, 0.5], [0, 1, 0]), 20);
  const point = [3, -2, 5];
  const plane = flatParams("planar", axes, point, 4, 2);
  near(apply(plane.matrix, [2, 1, 0]), point);
  const sticker = flatParams("decal", axes, point, 4, 2);
  near(apply(sticker.matrix, [0, 0, 0]), point);
  near(minus(apply(sticker.matrix, [0, 0, 1]), point), axes.out);
});

test("around an axis: z is that axis, and the three are right-handed", () => {
  for (const [axis, out] of [
    ["x", [1, 0, 0]],
    ["y", [0, 1, 0]],
    ["z", [0, 0, 1]],
  ]) {
    // prettier-ignore
    checkAxes(around(axis));
    near(around(axis).out, out);
    near(
      apply(matrixOf(around(axis), [1, 1, 1]), [0, 0, 2]),
      out.map((v) => 1 + 2 * v),
    );
  }
});

test("a frame over the whole view is the view's own camera", () => {
  const hull = hullOf({ x: 0, y: 0, width: 900, height: 600, angle: 0 });
  const found = cameraParams(camera, hull);
  near([found.field_of_view, found.aspect], [40, 1.5]);
});

test("a corner of the frame is seen in the same direction by the cut camera", () => {
  const frame = { x: 120, y: -60, width: 200, height: 100, angle: 0 };
  const hull = hullOf(frame);
  near([hull.width, hull.height], [440, 220]);
  const { field_of_view: fov, aspect } = cameraParams(camera, hull);
  // Slope of the right border of the frame, by the view's lens and by the cut one
  const slope = (pixels) => (Math.tan((40 * Math.PI) / 360) * pixels) / 300;
  near([slope(120 + 100)], [Math.tan((fov * Math.PI) / 360) * aspect]);
  near([slope(60 + 50)], [Math.tan((fov * Math.PI) / 360)]);
});

test("a turned frame needs the room of its corners", () => {
  const { width, height } = hullOf({ x: 0, y: 0, width: 200, height: 100, angle: 90 });
  near([width, height], [100, 200]);
  const slanted = hullOf({ x: 0, y: 0, width: 100, height: 100, angle: 45 });
  near([slanted.width], [100 * Math.SQRT2]);
});

test("a row that is carried pushes those between by one, and stays in the list", () => {
  assert.deepEqual(
    [placeAt(1, 70, 34, 4), placeAt(1, -900, 34, 4), placeAt(1, 900, 34, 4)],
    [3, 0, 3],
  );
  assert.deepEqual(
    [0, 1, 2, 3].map((i) => shiftOf(i, 1, 3)),
    [0, 0, -1, -1],
  );
  assert.deepEqual(
    [0, 1, 2, 3].map((i) => shiftOf(i, 2, 0)),
    [1, 1, 0, 0],
  );
});
