import assert from "node:assert/strict";
import { test } from "node:test";

import {
  decodeSrgb, encodeSrgb, fromHex, fromOklch, fromPick, isLight, largestChroma, toHex, toOklch, toPick,
} from "../src/color.js"; // prettier-ignore

const near = (a, b, least) => assert.ok(Math.abs(a - b) <= least, `${a} is not ${b}`);
const nearAll = (a, b, least) => a.forEach((value, i) => near(value, b[i], least));
const GRID = [0, 0.07, 0.31, 0.64, 1];
const COLORS = GRID.flatMap((r) => GRID.flatMap((g) => GRID.map((b) => [r, g, b])));

test("sRGB: the standard's knee, its ends, and there and back", () => {
  assert.equal(encodeSrgb(0), 0);
  near(encodeSrgb(1), 1, 1e-12);
  near(encodeSrgb(0.0031308), 0.04045, 1e-5);
  near(encodeSrgb(0.214041), 0.5, 1e-6);
  for (const value of GRID) near(decodeSrgb(encodeSrgb(value)), value, 1e-12);
});

test("all 256 bytes of a channel survive hexadecimal digits", () => {
  for (let byte = 0; byte < 256; byte++) {
    const text = `#${byte.toString(16).padStart(2, "0").repeat(3)}`;
    assert.equal(toHex(fromHex(text)), text);
  }
});

test("short, bare and capital digits are colours; other words are not", () => {
  assert.equal(toHex(fromHex("a74")), "#aa7744");
  assert.equal(toHex(fromHex(" AA7744 ")), "#aa7744");
  for (const text of ["", "#", "#12", "#12345", "#12345g", "red", "#12345678"]) {
    assert.equal(fromHex(text), null);
  }
});

test("OKLCH of sRGB's corners is what its author publishes", () => {
  // Ottosson 2020, and CSS Color 4, of which white, red and blue are examples
  nearAll(toOklch([1, 1, 1]).slice(0, 2), [1, 0], 1e-6);
  nearAll(toOklch([1, 0, 0]), [0.62796, 0.25768, 29.234], 1e-3);
  nearAll(toOklch([0, 0, 1]), [0.45201, 0.31321, 264.052], 1e-3);
});

test("OKLCH there and back", () => {
  for (const rgb of COLORS) nearAll(fromOklch(...toOklch(rgb)), rgb, 1e-6);
});

test("the largest chroma is inside of sRGB, to a hair, and a little more is not", () => {
  for (const h of [0, 29, 90, 142, 200, 264, 330]) {
    for (const l of [0.1, 0.4, 0.7, 0.95]) {
      const c = largestChroma(l, h);
      const over = fromOklch(l, c + 1e-3, h);
      assert.ok(fromOklch(l, c, h).every((v) => v > -0.0051 && v < 1.0051));
      assert.ok(over.some((v) => v < 0 || v > 1));
    }
  }
  assert.equal(largestChroma(0, 40), 0);
  assert.equal(largestChroma(1, 40), 0);
});

test("every colour has a place in the picker, and the place gives the colour", () => {
  for (const rgb of COLORS) {
    const pick = toPick(rgb);
    assert.ok(pick.l >= 0 && pick.l <= 1 && pick.s >= 0 && pick.s <= 1);
    assert.equal(toHex(fromPick(pick)), toHex(rgb));
  }
});

test("a grey keeps the hue that was chosen before, black the vividness", () => {
  const before = { l: 0.5, s: 0.8, h: 210 };
  assert.equal(toPick([0.2, 0.2, 0.2], before).h, 210);
  assert.deepEqual(toPick([0, 0, 0], before), { l: 0, s: 0.8, h: 210 });
});

test("dark marks are set on light colours, light ones on dark", () => {
  assert.equal(isLight([1, 1, 1]), true);
  assert.equal(isLight([0.5, 0.5, 0]), true);
  assert.equal(isLight([0.05, 0.05, 0.4]), false);
});
