import assert from "node:assert/strict";
import { test } from "node:test";

import { findShortcut, isTyping, pressed } from "../src/ui/shortcuts.js";

const press = (key, more = {}) => ({
  key, code: "", ctrlKey: false, metaKey: false, shiftKey: false, altKey: false, target: null, ...more,
}); // prettier-ignore
const table = [
  { keys: ["B"], words: "", group: "", run() {} },
  { keys: ["["], words: "", group: "", run() {}, repeats: true },
  { keys: ["Shift+["], words: "", group: "", run() {} },
  { keys: ["Ctrl+Z"], words: "", group: "", run() {} },
  { keys: ["Ctrl+Shift+Z", "Ctrl+Y"], words: "", group: "", run() {} },
  { keys: ["?"], words: "", group: "", run() {} },
  { keys: ["5"], words: "", group: "", run() {} },
  { keys: ["Shift+5"], words: "", group: "", run() {} },
];
const found = (key, more) => findShortcut(table, press(key, more))?.key ?? null;

test("letters count small and large, with the lock on or off", () => {
  assert.equal(found("b"), "B");
  assert.equal(found("B"), "B");
  assert.equal(found("b", { ctrlKey: true }), null);
  assert.equal(found("b", { altKey: true }), null);
});

test("undo and redo, with Ctrl or the command key", () => {
  assert.equal(found("z", { ctrlKey: true }), "Ctrl+Z");
  assert.equal(found("z", { metaKey: true }), "Ctrl+Z");
  assert.equal(found("Z", { ctrlKey: true, shiftKey: true }), "Ctrl+Shift+Z");
  assert.equal(found("y", { ctrlKey: true }), "Ctrl+Y");
  assert.equal(found("z"), null);
});

test("brackets: as signs, by place, with Shift, and with AltGr", () => {
  assert.equal(found("["), "[");
  assert.equal(found("{", { shiftKey: true, code: "BracketLeft" }), "Shift+[");
  assert.equal(found("ü", { code: "BracketLeft" }), "[");
  assert.equal(found("[", { altKey: true, ctrlKey: true, code: "Digit8" }), "[");
});

test("a question mark, wherever the layout has it", () => {
  assert.equal(found("?", { shiftKey: true, code: "Slash" }), "?");
  assert.equal(found("?", { shiftKey: true, code: "Minus" }), "?");
});

test("digits of both blocks, with Shift by their place", () => {
  assert.equal(found("5", { code: "Digit5" }), "5");
  assert.equal(found("5", { code: "Numpad5" }), "5");
  assert.equal(found("%", { shiftKey: true, code: "Digit5" }), "Shift+5");
});

test("a held key repeats only what is meant to repeat", () => {
  assert.equal(found("[", { repeat: true }), "[");
  assert.equal(found("b", { repeat: true }), null);
});

test("nothing fires while someone types, and sliders are no fields", () => {
  const fields = [
    { tagName: "INPUT", type: "text" }, { tagName: "INPUT", type: "search" }, { tagName: "TEXTAREA" },
    { tagName: "SELECT" }, { tagName: "DIV", isContentEditable: true },
  ]; // prettier-ignore
  for (const target of fields) {
    assert.equal(isTyping(target), true);
    assert.equal(found("b", { target }), null);
    assert.equal(found("z", { ctrlKey: true, target }), null);
  }
  for (const type of ["range", "checkbox", "color"]) {
    assert.equal(found("b", { target: { tagName: "INPUT", type } }), "B");
  }
  assert.equal(found("b", { target: { tagName: "CANVAS" } }), "B");
  assert.equal(found("b", { isComposing: true }), null);
});

test("a press has names, the likeliest first", () => {
  assert.deepEqual(pressed(press("{", { shiftKey: true, code: "BracketLeft" })), [
    "Shift+{",
    "{",
    "Shift+[",
  ]);
});
