import assert from "node:assert/strict";
import { test } from "node:test";

import { activeLayer, createStore, toast } from "../src/store.js";

test("a listener hears the new value of its key, and of no other", () => {
  const store = createStore();
  const heard = [];
  store.on("saved", (value) => heard.push(value));
  store.set({ saved: 3, unacked: 1 });
  store.set({ unacked: 2 });
  assert.deepEqual(heard, [3]);
  assert.equal(store.get().unacked, 2);
});

test("the same value again is no change", () => {
  const store = createStore({ saved: 3 });
  let n = 0;
  store.on("saved", () => (n += 1));
  store.set({ saved: 3 });
  assert.equal(n, 0);
});

test("whoever listens may set the key again, and stop listening", () => {
  const store = createStore();
  const heard = [];
  const stop = store.on("saved", (value) => {
    heard.push(value);
    if (value < 3) store.set({ saved: value + 1 });
  });
  store.set({ saved: 1 });
  stop();
  store.set({ saved: 9 });
  assert.deepEqual(heard, [1, 2, 3]);
  assert.equal(store.get().saved, 9);
});

test("states that were read before do not change", () => {
  const store = createStore();
  const before = store.get();
  store.set({ saved: 5 });
  assert.equal(before.saved, 0);
});

test("the same words are said once, and the newest four are kept", () => {
  const store = createStore();
  for (const what of ["a", "b", "a", "c", "d", "e"]) toast(store, { what });
  assert.deepEqual(
    store.get().toasts.map((one) => one.what),
    ["a", "c", "d", "e"],
  );
  const ids = store.get().toasts.map((one) => one.id);
  assert.equal(new Set(ids).size, 4);
});

test("the active layer is the one of that number, if it is there", () => {
  const layer = (number) => ({ number, name: "", opacity: 1, mode: "normal", visible: true });
  const state = { layers: [layer(4), layer(7)] };
  const store = createStore({ layer: 7, state });
  assert.equal(activeLayer(store.get()), state.layers[1]);
  store.set({ layer: 5 });
  assert.equal(activeLayer(store.get()), null);
});
