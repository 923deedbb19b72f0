import assert from "node:assert/strict";
import { test } from "node:test";

import { valueOf } from "../src/keep.js";
import { signedNumber } from "../src/ui/channel_rows.js";
import { plainNumber, sentence } from "../src/ui/controls.js";
import { bytesWords } from "../src/ui/export_menu.js";
import { connectionWords, sentenceOf } from "../src/ui/notices.js";
import { legendRows } from "../src/ui/legend.js";
import { rangeOf } from "../src/ui/parameter_fields.js";
import { fineWords, savedWords } from "../src/ui/status_line.js";

const calm = { saved: 12, unacked: 0, unackedStrokes: 0, connection: "open", closedReason: null };

test("saved is what was acknowledged, and no more", () => {
  assert.equal(savedWords({ ...calm, saved: 0 }), "Nothing painted yet");
  assert.equal(savedWords(calm), "Saved up to stroke 12");
  assert.match(
    savedWords({ ...calm, unacked: 4, unackedStrokes: 1 }),
    /^Saved up to stroke 12, saving/,
  );
  assert.match(
    savedWords({ ...calm, unacked: 9, unackedStrokes: 3 }),
    /^Saved up to stroke 12, 3 under way/,
  );
});

test("heights say which way they go, in texels and in the model's lengths", () => {
  assert.deepEqual([2.5, -0.125, 0].map(signedNumber), ["+2.5", "\u22120.125", "0"]);
  assert.deepEqual(legendRows(4, { texel: 0.01, units: "mm" }), [
    ["+4 texels", "+0.04 mm"],
    ["0", ""],
    ["\u22124 texels", "\u22120.04 mm"],
  ]);
  assert.equal(legendRows(0, { texel: 0.01 }).length, 1);
  const cursor = { spacing: 0.02, height: -1.5 };
  assert.match(fineWords({ facts: { texel: 0.01 }, tool: null, cursor }), /^Height \u22121\.5 texels {2}·  Texel 0\.02 here$/);
});

test("a lost connection says how many strokes are kept", () => {
  assert.equal(connectionWords(calm), "");
  const lost = { ...calm, connection: "lost" };
  assert.match(connectionWords(lost), /go on painting/);
  assert.match(
    connectionWords({ ...lost, unacked: 2, unackedStrokes: 1 }),
    /1 stroke is kept here and will be sent/,
  );
  assert.match(
    connectionWords({ ...lost, unacked: 9, unackedStrokes: 3 }),
    /3 strokes are kept here and will be sent/,
  );
});

test("a closed connection gives the reason, and admits what is not saved", () => {
  const reason = { what: "this page's key is not valid", fix: "open the address again" };
  const closed = { ...calm, connection: "closed", closedReason: reason };
  assert.equal(connectionWords(closed), "This page's key is not valid. Open the address again.");
  assert.match(connectionWords({ ...closed, unackedStrokes: 1 }), /1 stroke is not saved/);
});

test("the fineness line tells texels here, and the brush in the finest ones", () => {
  const tool = { kind: "paint", radius: 0.5 };
  const facts = { texel: 0.01, units: "mm" };
  assert.equal(fineWords({ facts: null }), "");
  assert.equal(
    fineWords({ facts, tool, cursor: { spacing: 0.04 } }),
    "Texel 0.04 mm here  ·  brush 1 mm across, 100 finest texels",
  );
  assert.equal(
    fineWords({ facts: { texel: 0.01 }, tool: { kind: "fill" }, cursor: null }),
    "Texel 0.01",
  );
});

test("numbers are short and exact to three digits", () => {
  const said = [0, 1, 0.12345, 1234.5, 12345678, 0.0000123].map(plainNumber);
  assert.deepEqual(said, ["0", "1", "0.123", "1230", "1.23e+7", "1.23e-5"]);
});

test("bytes, names and sentences", () => {
  assert.deepEqual([0, 999, 2_345_678, 45_000_000_000].map(bytesWords), [
    "0 bytes",
    "999 bytes",
    "2.3 MB",
    "45 GB",
  ]);
  assert.equal(sentence("color-dodge"), "Color dodge");
  assert.equal(sentence("wood_grain"), "Wood grain");
  assert.equal(sentenceOf("there is no layer 7"), "There is no layer 7.");
  assert.equal(sentenceOf(""), "");
});

test("a bar's range holds the default and stays within the server's limits", () => {
  const cases = [
    { type: "length", default: 0.25, least: 0, most: null },
    { type: "number", default: 7, least: null, most: null },
    { type: "number", default: -0.5, least: null, most: null },
    { type: "share", default: 0.35, least: 0, most: 1 },
    { type: "count", default: 6, least: 1, most: 32 },
    { type: "number", default: 0, least: null, most: null },
  ];
  for (const one of cases) {
    const { least, most } = rangeOf(one, one.type);
    assert.ok(least < most && least <= one.default && one.default <= most);
    if (one.least !== null) assert.ok(least >= one.least);
    if (one.most !== null) assert.ok(most <= one.most);
  }
});

test("one cookie among several, by its whole name", () => {
  assert.equal(valueOf("a=1; meshsdf_kept_tool=2; tool=3", "tool"), "3");
  assert.equal(valueOf("meshsdf_kept_tool=x=y", "meshsdf_kept_tool"), "x=y");
  assert.equal(valueOf("", "tool"), null);
});
