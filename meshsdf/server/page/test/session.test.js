/** The session against a server in memory whose line breaks again and again. */

import assert from "node:assert/strict";
import { after, test } from "node:test";
import { createStore } from "../src/store.js";
import { DOWN, UP, decodeFrame, decodeJson, encodeFrame, encodeJson } from "../src/net/protocol.js";

const FACTS = { name: "cow", entries: 9, texel: 1, origin: [0, 0, 0], faces: 2 };
const SAMPLE = { point: [0, 0, 0], normal: [0, 0, 1], pressure: 1, dt: 5 };

/** What the server of the protocol does with durable messages: each once, in order. */
class Server {
  applied = /** @type {{client: string, seq: number, type: number, size: number}[]} */ ([]);
  last = /** @type {Map<string, number>} */ (new Map());
  lines = /** @type {Set<Line>} */ (new Set());
  breakAfter = Infinity; // frames until a line breaks, before or after the frame counts
  refuses = (/** @type {number} */ _type) => false;
  views = 0;
  tokens = /** @type {string[]} */ ([]);
  facts = FACTS;
  status = 200;

  take(/** @type {Line} */ line, /** @type {Uint8Array} */ data) {
    const { type, seq, payload } = decodeFrame(data);
    if (type === UP.HELLO) {
      line.client = decodeJson(payload).client;
      const state = { seq: 0, layers: [], history: { done: [], undone: [] }, painters: 1, saved: 0 };
      const welcome = { version: 2, run: "r", cseq: this.last.get(line.client) ?? 0, state };
      return line.say(encodeFrame(DOWN.WELCOME, 0, encodeJson(welcome)));
    }
    if (type === UP.VIEW) return void (this.views += 1);
    this.breakAfter -= 1;
    if (this.breakAfter === 0) return line.cut();
    if (seq > (this.last.get(line.client) ?? 0)) {
      this.last.set(line.client, seq);
      if (this.refuses(type)) {
        const words = { cseq: seq, what: "it is refused", where: "here", fix: "leave it" };
        return line.say(encodeFrame(DOWN.ERROR, seq, encodeJson(words)));
      }
      this.applied.push({ client: line.client, seq, type, size: payload.length });
    }
    if (this.breakAfter === -1) {
      this.breakAfter = 15;
      return line.cut(); // it is done, and nobody says so
    }
    line.say(encodeFrame(DOWN.ACK, seq, Uint8Array.of(this.applied.length, 0, 0, 0)));
  }
}

let server = new Server();

/** One end of a line, with the face of a browser's socket. */
class Line {
  client = "";
  isOpen = false;
  onopen = () => {};
  onmessage = (/** @type {any} */ _event) => {};
  onclose = (/** @type {any} */ _event) => {};

  constructor() {
    this.server = server;
    setTimeout(() => {
      this.isOpen = true;
      server.lines.add(this);
      this.onopen();
    });
  }

  send(/** @type {Uint8Array} */ data) {
    const copy = data.slice();
    setTimeout(() => this.server.lines.has(this) && this.server.take(this, copy));
  }

  say(/** @type {Uint8Array} */ frame) {
    setTimeout(() => this.isOpen && this.onmessage({ data: frame.buffer }));
  }

  cut(code = 1006) {
    if (!this.server.lines.delete(this)) return;
    // What was said before still arrives
    setTimeout(() => {
      this.isOpen = false;
      this.onclose({ code });
    });
  }

  close() {
    this.isOpen = false;
    this.server.lines.delete(this);
  }
}

const values = new Map();
Object.assign(globalThis, {
  WebSocket: Line,
  location: { href: "http://127.0.0.1:1/", hash: "", pathname: "/", search: "" },
  history: { replaceState: () => (globalThis.location.hash = "") },
  addEventListener: () => {},
  sessionStorage: {
    get length() {
      return values.size;
    },
    key: (/** @type {number} */ n) => [...values.keys()][n] ?? null,
    getItem: (/** @type {string} */ key) => values.get(key) ?? null,
    setItem: (/** @type {string} */ key, /** @type {string} */ value) => void values.set(key, value),
    removeItem: (/** @type {string} */ key) => void values.delete(key),
  },
  fetch: async (/** @type {string} */ path, /** @type {any} */ init) => {
    if (path === "/api/session") {
      server.tokens.push(JSON.parse(init.body).token);
      return new Response(null, { status: 204 });
    }
    return new Response(JSON.stringify(server.facts), { status: server.status });
  },
});
const { openSession } = await import("../src/net/session.js");

/** @type {any[]} */
const opened = [];
after(() => opened.forEach((session) => session.close()));

function open() {
  const store = createStore();
  const session = openSession(store);
  opened.push(session);
  return { store, session };
}

async function until(/** @type {() => boolean} */ is) {
  for (let n = 0; n < 1500 && !is(); n++) await new Promise((resolve) => setTimeout(resolve, 4));
  assert.ok(is());
}

test("whatever breaks the line, every message is done once and in order", async () => {
  server = new Server();
  server.breakAfter = 9;
  values.clear();
  const { store, session } = open();
  let sent = 0;
  for (let stroke = 0; stroke < 6; stroke++) {
    session.begin(1, { radius: 1 });
    for (let n = 0; n < 8; n++) {
      session.dabs(Array.from({ length: n + 1 }, () => SAMPLE));
      await new Promise((resolve) => setTimeout(resolve, 1));
    }
    session.end();
    session.undo();
    sent += 11;
  }
  assert.ok(store.get().unacked > 0);
  await until(() => store.get().unacked === 0);
  assert.deepEqual(server.applied.map(({ seq }) => seq), Array.from({ length: sent }, (_, n) => n + 1));
  const sizes = server.applied.slice(1, 9).map(({ size }) => size);
  assert.deepEqual(sizes, [20, 40, 60, 80, 100, 120, 140, 160]);
  assert.deepEqual([store.get().saved, store.get().connection], [sent, "open"]);
});

test("a page that is left in mid-stroke ends it when it comes back", async () => {
  server = new Server();
  values.clear();
  const first = open();
  await until(() => first.store.get().connection === "open");
  first.session.begin(1, {});
  for (const line of server.lines) line.cut();
  first.session.dabs([SAMPLE]);
  first.session.close();
  assert.ok(first.store.get().unacked >= 2);

  const second = open();
  await until(() => second.store.get().connection === "open" && second.store.get().unacked === 0);
  assert.deepEqual(server.applied.map(({ type }) => type), [UP.STROKE_BEGIN, UP.DABS, UP.STROKE_END]);
  assert.equal(new Set(server.applied.map(({ client }) => client)).size, 1);
});

test("a refused stroke is said once, and its other batches are not sent on", async () => {
  server = new Server();
  server.refuses = (type) => type <= UP.STROKE_END;
  values.clear();
  const { store, session } = open();
  await until(() => store.get().connection === "open");
  session.begin(1, {});
  session.dabs([SAMPLE]);
  await until(() => store.get().unacked === 0);
  session.dabs([SAMPLE]);
  session.end();
  assert.equal(store.get().unacked, 0);
  assert.deepEqual(store.get().toasts.map(({ what, fix }) => [what, fix]), [["it is refused", "leave it"]]);
});

test("without a valid key the page says how to get one, and keeps what it has", async () => {
  server = new Server();
  server.status = 401;
  values.clear();
  const { store, session } = open();
  session.undo();
  await until(() => store.get().connection === "closed");
  assert.match(store.get().closedReason?.fix ?? "", /meshsdf paint/);
  assert.equal(store.get().unacked, 1);
});

test("strokes never go to another project that is served at the same place", async () => {
  server = new Server();
  values.clear();
  const { store, session } = open();
  await until(() => store.get().connection === "open");
  const line = [...server.lines][0];
  server = new Server();
  server.facts = { ...FACTS, entries: 10 };
  line.cut();
  session.undo();
  await until(() => store.get().connection === "closed");
  assert.match(store.get().closedReason?.what ?? "", /another project/);
  assert.deepEqual(server.applied, []);
});

test("bricks reach those who listen before they count as shown", async () => {
  server = new Server();
  values.clear();
  const { store, session } = open();
  /** @type {string[]} */
  const order = [];
  session.onBricks((bricks) => order.push(`bricks of ${bricks.map(({ entry }) => entry)}`));
  await until(() => store.get().connection === "open");
  server.take = (_, data) => void order.push(`type ${decodeFrame(data).type} ${decodeFrame(data).seq}`);
  const brick = Uint8Array.of(1, 0, 0, 0, 5, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 3, 4);
  [...server.lines][0].say(encodeFrame(DOWN.BRICKS, 9, brick));
  await until(() => order.length === 2);
  assert.deepEqual(order, ["bricks of 5", `type ${UP.SHOWN} 9`]);
});

test("the address's token is traded once, and taken off the address", async () => {
  server = new Server();
  values.clear();
  globalThis.location.hash = "#t=secret-_7";
  const begin = performance.now();
  const { store } = open();
  await until(() => store.get().connection === "open");
  assert.ok(performance.now() - begin < 200); // at the first try
  assert.deepEqual([server.tokens, globalThis.location.hash], [["secret-_7"], ""]);
});
