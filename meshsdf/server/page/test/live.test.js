import assert from "node:assert/strict";
import { test } from "node:test";

import { createActions, freeName } from "../src/actions.js";
import { createLive, quickLevel } from "../src/live.js";
import { createStore } from "../src/store.js";

/** A session that keeps what it is asked to send; `ack` says that all of it has arrived. */
function scene() {
  const sent = [];
  const store = createStore({ layer: 0, state: stateOf([0, 1]) });
  const send = (...what) => {
    sent.push(what);
    store.set({ unacked: store.get().unacked + 1 });
  };
  const session = { undo: () => send("undo"), redo: () => send("redo"), operation: send };
  const actions = createActions(store, session);
  return {
    sent,
    store,
    actions,
    live: createLive(store, session, actions, 5),
    ack: () => store.set({ unacked: 0 }),
  };
}

const stateOf = (numbers) => ({
  layers: numbers.map((number) => ({ number, name: `${number}`, opacity: 1, mode: "normal", visible: true })),
  history: { done: [{ name: "stroke", seq: 1 }], undone: [] },
}); // prettier-ignore

test("one change is under way at a time, and then the newest is sent", () => {
  const { sent, live, ack } = scene();
  for (const scale of [1, 2, 3, 4]) live.change("bake", { layer: 0, scale });
  assert.deepEqual(sent, [["bake", { layer: 0, scale: 1 }, false]]);
  assert.equal(live.isBusy(), true);
  ack();
  assert.deepEqual(sent[1], ["bake", { layer: 0, scale: 4 }, true]);
  ack();
  assert.equal(sent.length, 2);
});

test("another layer, another kind or a release begin a step of their own", () => {
  const { sent, live, ack } = scene();
  const change = (...what) => (live.change(...what), ack());
  change("bake", { layer: 0 });
  change("bake", { layer: 1 });
  change("project", { layer: 1 });
  change("project", { layer: 1 });
  live.release();
  change("project", { layer: 1 });
  assert.deepEqual(
    sent.map((one) => one[2]),
    [false, false, false, true, false],
  );
});

test("a stroke, or an undo, ends what may be replaced", () => {
  const { sent, store, actions, live, ack } = scene();
  const change = (scale) => (live.change("bake", { layer: 0, scale }), ack());
  change(1);
  store.set({ stroking: true });
  change(2);
  change(3);
  actions.undo();
  ack();
  change(4);
  assert.deepEqual(sent.map((one) => [one[0], one[1]?.scale, one[2]]), [
    ["bake", 1, false], ["bake", 2, false], ["bake", 3, true], ["undo", undefined, undefined],
    ["bake", 4, false],
  ]); // prettier-ignore
});

test("what waits is dropped by an undo, but sent before a stroke, an export or another step", () => {
  for (const [act, last] of [
    [({ actions }) => actions.undo(), "undo"],
    [({ store }) => store.set({ stroking: true }), 2],
    [({ actions }) => actions.settle(), 2],
  ]) {
    const made = scene();
    made.live.change("bake", { layer: 0, scale: 1 });
    made.live.change("bake", { layer: 0, scale: 2 });
    act(made);
    const [kind, params] = made.sent.at(-1);
    assert.equal(params?.scale ?? kind, last);
    made.ack();
    assert.equal(made.sent.length, 2);
  }
});

test("the fine state follows when the hand rests, once, in the place of the coarse one", async () => {
  const { sent, live, ack } = scene();
  live.change("bake", { layer: 0, scale: 1, level: 2 }, { layer: 0, scale: 1, level: 0 });
  live.change("bake", { layer: 0, scale: 2, level: 2 }, { layer: 0, scale: 2, level: 0 });
  ack();
  assert.deepEqual(sent.map((one) => [one[1].scale, one[1].level]), [[1, 2], [2, 2]]); // prettier-ignore
  assert.equal(live.isBusy(), true);
  ack();
  await new Promise((resolve) => setTimeout(resolve, 30));
  assert.deepEqual(sent.at(-1), ["bake", { layer: 0, scale: 2, level: 0 }, true]);
  ack();
  assert.equal(sent.length, 3);
  assert.equal(live.isBusy(), false);
});

test("the fine state comes before whatever comes next, and is not lost by a release", () => {
  const { sent, live, actions } = scene();
  live.change("bake", { layer: 0, level: 2 }, { layer: 0, level: 0 });
  actions.changeLayer(0, { name: "Rust" });
  assert.deepEqual(sent.map((one) => [one[0], one[1].level, one[2]]), [
    ["bake", 2, false], ["bake", 0, true], ["layer", undefined, false],
  ]); // prettier-ignore
  live.change("bake", { layer: 1, level: 2 }, { layer: 1, level: 0 });
  live.release();
  assert.equal(sent.at(-1)[1].level, 0);
});

test("the quick level has few texels, and exists", () => {
  assert.equal(quickLevel({ texels: 50_000, levels: 5 }), 0);
  assert.equal(quickLevel({ texels: 240_000, levels: 5 }), 1);
  assert.equal(quickLevel({ texels: 1_443_602, levels: 7 }), 2);
  assert.equal(quickLevel({ texels: 1e12, levels: 4 }), 3);
});

test("undo and redo are not sent when there is nothing to turn", () => {
  const { sent, store, actions } = scene();
  actions.redo();
  store.set({ state: { ...stateOf([0]), history: { done: [], undone: [] } } });
  actions.undo();
  assert.deepEqual(sent, []);
});

test("a click in the history is as many steps as lie between", () => {
  const { sent, actions } = scene();
  actions.go(-3);
  actions.go(2);
  actions.go(0);
  assert.deepEqual(
    sent.map((one) => one[0]),
    ["undo", "undo", "undo", "redo", "redo"],
  );
});

test("a layer is moved within the pile, and not beyond its ends", () => {
  const { sent, actions } = scene();
  actions.moveLayer(0, -1);
  actions.moveLayer(1, 1);
  actions.moveLayer(9, 1);
  assert.deepEqual(sent, []);
  actions.moveLayer(0, 1);
  assert.deepEqual(sent, [["layer", { layer: 0, place: 1 }, false]]);
});

test("a change of a layer is seen before the server tells of it", () => {
  const { store, actions } = scene();
  actions.changeLayer(0, { visible: false, place: 1 });
  actions.changeLayer(1, { name: "Rust" });
  const seen = store.get().state.layers.map(({ number, name, visible }) => [number, name, visible]);
  assert.deepEqual(seen, [[1, "Rust", true], [0, "0", false]]); // prettier-ignore
});

test("a new layer is chosen once the server tells of it", async () => {
  const { store, actions, sent } = scene();
  const added = actions.addLayer("Rust");
  assert.deepEqual(sent, [["add-layer", { name: "Rust" }]]);
  store.set({ state: stateOf([0, 1]) });
  assert.equal(store.get().layer, 0);
  const layers = stateOf([0, 1, 7, 8]).layers;
  layers[3].name = "Rust"; // 7 is somebody else's
  store.set({ state: { ...stateOf([]), layers } });
  assert.equal(await added, 8);
  assert.equal(store.get().layer, 8);
});

test("deleting the chosen layer chooses the one below, or above", () => {
  const { store, actions } = scene();
  store.set({ layer: 1 });
  actions.dropLayer(1);
  assert.equal(store.get().layer, 0);
  actions.dropLayer(0);
  assert.equal(store.get().layer, 1);
});

test("names of new layers are free", () => {
  const named = (...names) => names.map((name) => ({ name }));
  assert.equal(freeName([]), "Layer 1");
  assert.equal(freeName(named("Layer 1", "Layer 3")), "Layer 4");
  assert.equal(freeName(named("a", "Layer 3")), "Layer 4");
});
