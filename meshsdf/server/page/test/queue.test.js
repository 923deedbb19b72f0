import assert from "node:assert/strict";
import { test } from "node:test";
import { UP, decodeFrame } from "../src/net/protocol.js";
import { Queue } from "../src/net/queue.js";

/** A tab's storage, as the standard describes it, with room for so many letters. */
function storage(room = Infinity) {
  /** @type {Map<string, string>} */
  const values = new Map();
  return {
    values,
    get length() {
      return values.size;
    },
    key: (/** @type {number} */ n) => [...values.keys()][n] ?? null,
    getItem: (/** @type {string} */ key) => values.get(key) ?? null,
    setItem(/** @type {string} */ key, /** @type {string} */ value) {
      let used = value.length;
      for (const [other, text] of values) if (other !== key) used += text.length;
      if (used > room) throw new DOMException("full", "QuotaExceededError");
      values.set(key, value);
    },
    removeItem: (/** @type {string} */ key) => void values.delete(key),
  };
}

let made = 0;
const newClient = () => String((made += 1)).padStart(32, "0");

test("messages are numbered from 1 and come back after a reload, in order", () => {
  const tab = storage();
  const before = new Queue(tab, newClient);
  for (let n = 0; n < 12; n++) before.push(n ? UP.DABS : UP.STROKE_BEGIN, Uint8Array.of(n, 255 - n));
  before.take(1);
  before.take(5);
  const after = new Queue(tab, newClient);
  assert.equal(after.client, before.client);
  assert.deepEqual(after.messages.map(({ seq }) => seq), [2, 3, 4, 6, 7, 8, 9, 10, 11, 12]);
  for (const { seq, frame } of after.messages) {
    const read = decodeFrame(frame);
    assert.deepEqual([read.seq, ...read.payload], [seq, seq - 1, 256 - seq]);
  }
  assert.equal(after.isStroking, true);
  assert.equal(after.push(UP.STROKE_END).seq, 13);
  assert.equal(new Queue(tab, newClient).isStroking, false);
});

test("numbers never come twice, though all was acknowledged before the reload", () => {
  const tab = storage();
  const before = new Queue(tab, newClient);
  for (let n = 0; n < 5; n++) before.take(before.push(UP.UNDO).seq);
  const after = new Queue(tab, newClient);
  assert.equal(after.push(UP.UNDO).seq, 6);
  after.skipTo(40); // the server knows more than the page
  assert.equal(after.push(UP.UNDO).seq, 41);
  after.skipTo(3);
  assert.equal(after.push(UP.UNDO).seq, 42);
});

test("strokes and operations are counted, not their parts", () => {
  const queue = new Queue(null, newClient);
  assert.equal(queue.strokes, 0);
  queue.push(UP.STROKE_BEGIN);
  queue.push(UP.DABS);
  assert.equal(queue.strokes, 1);
  queue.push(UP.STROKE_END);
  queue.push(UP.UNDO);
  queue.push(UP.STROKE_BEGIN);
  assert.equal(queue.strokes, 3);
});

test("a full storage is noticed, and messages stay in memory", () => {
  const queue = new Queue(storage(600), newClient);
  assert.ok(queue.isKept);
  for (let n = 0; n < 30; n++) queue.push(UP.DABS, new Uint8Array(20));
  assert.ok(!queue.isKept);
  assert.equal(queue.messages.length, 30);
});

test("whoever forgets is somebody new, without messages", () => {
  const tab = storage();
  const queue = new Queue(tab, newClient);
  const { client } = queue;
  queue.push(UP.UNDO);
  queue.forget();
  assert.notEqual(queue.client, client);
  assert.deepEqual([queue.messages.length, queue.push(UP.UNDO).seq], [0, 1]);
  assert.equal(new Queue(tab, newClient).client, queue.client);
});

test("what others left in the storage does no harm", () => {
  const tab = storage();
  tab.setItem("meshsdf.client", "<script>");
  tab.setItem("meshsdf.next", "soon");
  tab.setItem("meshsdf.message.3", "%%%");
  tab.setItem("another", "page");
  const queue = new Queue(tab, newClient);
  assert.match(queue.client, /^[0-9]{32}$/);
  assert.deepEqual(queue.messages, []);
  assert.equal(tab.getItem("another"), "page");
});
