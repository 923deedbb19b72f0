/** Strokes on a table: the surface is the plane z = 0 for x below 100 and z = -50 beyond. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { FIRST_TOOL } from "../src/tool.js";
import { Stroke } from "../src/view/stroke.js";

class Point {
  constructor(/** @type {number[]} */ values) {
    this.values = values;
  }

  toArray() {
    return this.values;
  }

  distanceTo(/** @type {Point} */ other) {
    return Math.hypot(...this.values.map((value, axis) => value - other.values[axis]));
  }
}

/** Paint through places (x, y, and pressure if it matters); what the session was told. */
function paint(/** @type {number[][]} */ places, tool = {}, { height = 10 } = {}) {
  /** @type {any[]} */
  const told = [];
  const means = /** @type {any} */ ({
    session: {
      begin: (/** @type {number} */ layer, /** @type {any} */ brush) => told.push({ layer, brush, samples: [] }),
      dabs: (/** @type {any[]} */ samples) => told.at(-1).samples.push(...samples),
      end: () => (told.at(-1).isEnded = true),
      cancel: () => (told.at(-1).isCancelled = true),
    },
    hit(/** @type {number} */ x, /** @type {number} */ y) {
      if (y < 0) return null;
      const point = new Point([x, y, x < 100 ? 0 : -height]);
      return { point, normal: new Point([0, 0, 1]), faceNormal: new Point([0, 0, 1]), distance: 9 };
    },
    pixelAt: () => 1,
  });
  const stroke = new Stroke(means, { ...FIRST_TOOL, radius: 8, ...tool }, 3);
  places.forEach(([x, y, pressure = 1], n) => stroke.add({ x, y, pressure, time: 10 * n }));
  return { told, stroke };
}

const xs = (/** @type {any} */ one) => one.samples.map((/** @type {any} */ { point }) => point[0]);

test("a quick drag is followed in steps of a few pixels, pressure and time between", () => {
  const { told, stroke } = paint([[0, 5, 0], [60, 5, 1]]);
  stroke.end();
  assert.equal(told.length, 1);
  assert.deepEqual(xs(told[0]), Array.from({ length: 11 }, (_, n) => 6 * n));
  const { samples } = told[0];
  assert.ok(samples.every((/** @type {any} */ one, /** @type {number} */ n) => Math.abs(one.pressure - n / 10) < 1e-9));
  const total = samples.reduce((/** @type {number} */ sum, /** @type {any} */ { dt }) => sum + dt, 0);
  assert.ok(Math.abs(total - 10) < 1e-9);
  assert.deepEqual([told[0].layer, told[0].brush.radius, told[0].isEnded], [3, 8, true]);
});

test("where the pointer leaves the surface a stroke ends, and another begins where it returns", () => {
  const { told, stroke } = paint([[0, 10], [12, 10], [12, -20], [60, -20], [60, 10]]);
  stroke.end();
  assert.equal(told.length, 2);
  assert.ok(told.every(({ isEnded }) => isEnded));
  assert.ok(xs(told[0]).every((/** @type {number} */ x) => x <= 12));
  assert.ok(xs(told[1]).every((/** @type {number} */ x) => x === 60));
});

test("a step that is steep belongs to the surface, a jump behind it does not", () => {
  const way = [[88, 5], [112, 5]];
  assert.equal(paint(way, {}, { height: 20 }).told.length, 1);
  assert.equal(paint(way, {}, { height: 200 }).told.length, 2);
});

test("a pointer that rests says nothing new", () => {
  const { told, stroke } = paint([[5, 5], [5, 5], [5.1, 5], [5, 5.1]]);
  stroke.end();
  assert.equal(told[0].samples.length, 1);
});

test("a fill takes one sample, and a gradient goes over gaps", () => {
  const fill = paint([[5, 5], [50, 5]], { kind: "fill" });
  fill.stroke.end();
  assert.deepEqual(xs(fill.told[0]), [5]);
  const gradient = paint([[5, 5], [20, -9], [190, 5]], { kind: "gradient" }, { height: 900 });
  gradient.stroke.end();
  assert.equal(gradient.told.length, 1);
  assert.deepEqual([xs(gradient.told[0])[0], xs(gradient.told[0]).at(-1)], [5, 190]);
});

test("all pieces of a clone take their paint from equally far away", () => {
  const { told, stroke } = paint([[0, 10], [0, -20], [60, -20], [60, 10]], { kind: "clone", source: [1, 2, 3] });
  stroke.end();
  assert.equal(told.length, 2);
  for (const { brush } of told) assert.deepEqual(brush.offset, [1, -8, 3]);
});

test("what is cancelled sends nothing after it", () => {
  const { told, stroke } = paint([[0, 10], [12, 10]]);
  stroke.cancel();
  stroke.end();
  assert.deepEqual([told[0].isCancelled, told[0].isEnded], [true, undefined]);
});
