import assert from "node:assert/strict";
import { test } from "node:test";

import { createStore } from "../src/store.js";
import { brushOf, channels, firstTool, keptOf, pickColor, radiusRange, setSource, setTool, takeChannel } from "../src/tool.js";
import { shareOf } from "../src/ui/keys.js";
import { limited, mirrored } from "../src/ui/symmetry_rows.js";

const facts = { box: [[0, 0, 0], [2, 8, 4]], texel: 0.01 }; // prettier-ignore

test("the first tool suits the mesh, and what was kept of earlier days", () => {
  const tool = firstTool(facts, { hardness: 0.25, color: [0, 1, 0], radius: 900 });
  assert.deepEqual([tool.hardness, tool.color, tool.radius], [0.25, [0, 1, 0], 0.04 * 8]);
  assert.deepEqual(tool.symmetry.center, [1, 4, 2]);
});

test("what was kept may be anything, and does no harm", () => {
  const kept = {
    hardness: 7,
    flow: "much",
    color: [1, null, 0],
    end_color: "red",
    pressure_flow: 1,
  };
  assert.deepEqual(firstTool(facts, kept), firstTool(facts));
});

test("what is kept of a tool brings it back", () => {
  const tool = { ...firstTool(facts), hardness: 0.2, color: [0.25, 0.5, 1], pressure_flow: true };
  assert.deepEqual(firstTool(facts, keptOf(tool)), tool);
});

test("a radius goes from half a texel to half the mesh", () => {
  assert.deepEqual(radiusRange(facts), [0.005, 4]);
});

test("a brush has four numbers a colour, and blends only where it lays colour", () => {
  const tool = { ...firstTool(facts), blend: "multiply", channel: "mask" };
  assert.equal(brushOf({ ...tool, channel: "base" }).blend, "multiply");
  assert.equal(brushOf(tool).blend, "normal");
  assert.equal(brushOf(tool).channel, "mask");
  assert.equal(brushOf({ ...tool, channel: "base", blend: "multiply", kind: "erase" }).blend, "normal");
  assert.equal(brushOf(tool).color.length, 4);
  assert.ok(!("source" in brushOf(tool)));
});

test("heights are added up to an amount, or brought to it, and a gradient runs out level", () => {
  const tool = { ...firstTool(facts), channel: "height", amount: -2, opacity: 0.5, blend: "multiply" };
  const { channel, value, blend, opacity } = brushOf(tool);
  assert.deepEqual([channel, value, blend, opacity], ["height", -2, "add", 1]);
  assert.equal(brushOf({ ...tool, adds: false }).blend, "normal");
  const eraser = brushOf({ ...tool, kind: "erase" });
  assert.deepEqual([eraser.channel, eraser.blend, eraser.opacity], ["height", "normal", 0.5]);
  assert.equal(brushOf({ ...tool, kind: "gradient" }).end_color[0], 0);
  assert.equal(brushOf({ ...tool, kind: "gradient", channel: "mask", value: 0 }).end_color[0], 1);
});

test("every channel has its own size and hardness, and heights are painted to be seen", () => {
  const store = createStore({ tool: firstTool(facts) });
  const tool = () => /** @type {import("../src/tool.js").Tool} */ (store.get().tool);
  store.set({ view: { ...store.get().view, relief: false } });
  const before = tool();
  takeChannel(store, "height");
  assert.ok(tool().hardness < before.hardness);
  assert.ok(store.get().view.relief);
  setTool(store, { radius: 3, hardness: 0.9 });
  takeChannel(store, "base");
  assert.deepEqual([tool().radius, tool().hardness], [before.radius, before.hardness]);
  takeChannel(store, "height");
  assert.deepEqual([tool().radius, tool().hardness], [3, 0.9]);
});

test("only channels that the server paints and shows are offered", () => {
  const brush = { channels: ["base", "normal", "height", "orm", "mask"] };
  assert.deepEqual(channels({ brush }), ["base", "mask"]);
  const displays = ["color", "normal", "displacement"];
  assert.deepEqual(channels({ brush, displays }), ["base", "height", "mask"]);
  assert.deepEqual(channels({ brush: { channels: ["base"] }, displays }), ["base"]);
});

test("pressure bends its curve only where it is asked to", () => {
  const brush = brushOf({ ...firstTool(facts), pressure_radius: true, pressure_flow: false });
  assert.ok(brush.pressure_radius[0][1] < 1);
  assert.deepEqual(brush.pressure_flow, [[0, 1], [1, 1]]); // prettier-ignore
});

test("picking a colour and a source changes those alone", () => {
  const store = createStore({ tool: firstTool(facts) });
  const before = store.get().tool;
  pickColor(store, [0.1, 0.2, 0.3]);
  store.set({ view: { ...store.get().view, aim: "source" } });
  setSource(store, [1, 2, 3]);
  assert.deepEqual(store.get().tool, { ...before, color: [0.1, 0.2, 0.3], source: [1, 2, 3] });
  assert.equal(store.get().view.aim, "");
});

test("digits are tenths, and 0 is all", () => {
  assert.deepEqual(["1", "5", "0", "Shift+3"].map(shareOf), [0.1, 0.5, 1, 0.3]);
});

test("mirrors are put on and off, their letters in order", () => {
  assert.equal(mirrored("", "y"), "y");
  assert.equal(mirrored("z", "x"), "xz");
  assert.equal(mirrored("xyz", "y"), "xz");
});

test("turns and mirrors make 64 copies at most, as the server has it", () => {
  for (const mirror of ["", "x", "xy", "xyz"]) {
    for (let radial = 0; radial < 80; radial++) {
      const found = limited({ mirror, radial, axis: "y", center: [0, 0, 0] });
      assert.ok(found.radial >= 1 && found.radial * 2 ** mirror.length <= 64);
    }
  }
});
