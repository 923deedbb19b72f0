/**
 * The page's end of the wire: it keeps what the server has not acknowledged, comes back after every
 * break, and puts what the server says into the store.
 */

import { toast } from "../store.js";
import { ELSEWHERE, NO_KEY, OTHER_PROJECT, REFUSED } from "../troubles.js";
import { ApiError, requestJson, tradeToken, uploadImage } from "./api.js";
import { claim, newClient, tabStorage } from "./identity.js";
import { Link } from "./link.js";
import { COMPLETE, DOWN, FrameError, UP, VERSION, decodeBricks, decodeJson, encodeDabs, encodeFrame, encodeJson, encodeView, pictureOf } from "./protocol.js"; // prettier-ignore
import { Queue } from "./queue.js";
import { Seen } from "./seen.js";

/** @typedef {import("../store.js").Store} Store */
/** @typedef {import("./protocol.js").Brick} Brick */
/** @typedef {import("./protocol.js").PictureName} PictureName */
/** @typedef {(bricks: Brick[], picture: PictureName) => void} BrickListener */
/** @typedef {import("./protocol.js").Sample} Sample */

const DELAYS = [250, 500, 1000, 2000, 4000]; // milliseconds before the tries to come back
const VIEW_PAUSE = 100; // between two words on where the eye is
const DABS_PER_MESSAGE = 256;
const MOST_REFUSALS = 5; // closings in a row in which nothing was acknowledged
const SAME = ["name", "entries", "texel", "origin", "faces"]; // what tells projects apart

/**
 * @typedef {object} Session
 * @property {Promise<import("../store.js").Facts>} ready when the facts are in the store
 * @property {(layer: number, brush: Record<string, any>) => void} begin a stroke
 * @property {(samples: readonly Sample[]) => void} dabs
 * @property {() => void} end
 * @property {() => void} cancel
 * @property {() => void} undo
 * @property {() => void} redo
 * @property {(kind: string, params: Record<string, any>, replaces?: boolean) => number} operation
 * @property {(eye: readonly number[], cursor: readonly number[] | null) => void} view
 * @property {(fn: BrickListener) => void} onBricks called at once with every message
 * @property {(blob: Blob) => Promise<{id: string, width: number, height: number}>} upload
 * @property {(name: string) => Promise<any>} export
 * @property {() => void} close
 */

/**
 * @param {Store} store
 * @returns {Session}
 */
export function openSession(store) {
  return new Wire(store).session();
}

class Wire {
  /** @param {Store} store */
  constructor(store) {
    this.store = store;
    this.queue = new Queue(tabStorage(), newClient);
    /** @type {Link | null} */
    this.link = null;
    /** @type {BrickListener[]} */
    this.brickListeners = [];
    /** @type {Promise<import("../store.js").Facts>} */
    this.ready = new Promise((resolve) => (this.resolveReady = resolve));
    this.tries = 0;
    this.refusals = 0;
    this.isClosed = false;
    this.seen = new Seen();
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.viewSent = 0;
    /** @type {Uint8Array | null} */
    this.viewWaiting = null;
    if (this.queue.isStroking) this.queue.push(UP.STROKE_END); // the page was left in mid-stroke
    this.#count();
    this.#listen();
    void this.#start();
  }

  /** @returns {Session} */
  session() {
    return {
      ready: this.ready,
      begin: (layer, brush) => {
        if (this.queue.isStroking) this.#send(UP.STROKE_END);
        this.#send(UP.STROKE_BEGIN, encodeJson({ layer, brush }));
      },
      dabs: (samples) => {
        if (!this.queue.isStroking) return; // the server refused the stroke
        for (let at = 0; at < samples.length; at += DABS_PER_MESSAGE) {
          this.#send(UP.DABS, encodeDabs(samples.slice(at, at + DABS_PER_MESSAGE)));
        }
      },
      end: () => void (this.queue.isStroking && this.#send(UP.STROKE_END)),
      cancel: () => void (this.queue.isStroking && this.#send(UP.STROKE_CANCEL)),
      undo: () => void this.#send(UP.UNDO),
      redo: () => void this.#send(UP.REDO),
      operation: (kind, params, replaces = false) =>
        this.#send(UP.OPERATION, encodeJson({ kind, params, replaces })),
      view: (eye, cursor) => this.#look(encodeView(eye, cursor)),
      onBricks: (fn) => void this.brickListeners.push(fn),
      upload: uploadImage,
      export: (name) => requestJson("/api/exports", { name }),
      close: () => this.#close(null),
    };
  }

  #listen() {
    addEventListener("hashchange", () => {
      if (!new URLSearchParams(location.hash.slice(1)).get("t")) return;
      this.isClosed = false; // a new key for a page that stands open
      this.#retry(0);
    });
    addEventListener("online", () => this.#retry(0));
    addEventListener("beforeunload", (event) => {
      if (this.queue.messages.length) event.preventDefault();
    });
  }

  async #start() {
    if (!(await claim(this.queue.client))) {
      this.queue.forget();
      await claim(this.queue.client);
    }
    this.#count();
    await this.#connect();
  }

  async #connect() {
    if (this.isClosed || this.link) return;
    const link = new Link(this.queue, {
      onFrame: (frame) => this.#receive(frame),
      greeting: () => ({ client: this.queue.client, version: VERSION, ...this.seen.greeting() }),
      onClose: (code) => this.#lost(link, code),
    });
    this.link = link;
    try {
      await tradeToken();
      const facts = await requestJson("/api/project");
      const known = this.store.get().facts;
      if (known && SAME.some((key) => JSON.stringify(known[key]) !== JSON.stringify(facts[key]))) {
        return this.#close(OTHER_PROJECT);
      }
      this.store.set({ facts });
      this.resolveReady?.(facts);
      link.open();
    } catch (error) {
      const isRefused = error instanceof ApiError && [401, 403].includes(error.status);
      if (isRefused) return this.#close(NO_KEY);
      this.#lost(link, 0);
    }
  }

  /**
   * @param {Link} link
   * @param {number} code
   */
  #lost(link, code) {
    if (this.link !== link) return;
    this.link = null;
    if (this.isClosed) return;
    if (code === 4403) return this.#close(NO_KEY);
    if (code === 4001) return this.#close(ELSEWHERE);
    // Sent again what the server refuses would be refused again, unless it was only too much at once
    if (code === 1008 && (this.refusals += 1) > MOST_REFUSALS) return this.#close(REFUSED);
    this.store.set({ connection: this.tries === 0 && !this.store.get().facts ? "connecting" : "lost" });
    const delay = DELAYS[Math.min(this.tries, DELAYS.length - 1)];
    this.tries += 1;
    this.#retry(delay * (0.75 + 0.5 * Math.random()));
  }

  /** @param {number} delay */
  #retry(delay) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.#connect(), delay);
  }

  /** @param {{what: string, fix: string} | null} reason */
  #close(reason) {
    this.isClosed = true;
    const link = this.link;
    this.link = null;
    clearTimeout(this.timer);
    link?.close();
    this.store.set({ connection: "closed", closedReason: reason });
  }

  /**
   * @param {number} type
   * @param {Uint8Array} [payload]
   * @returns {number} the message's number
   */
  #send(type, payload) {
    const { seq } = this.queue.push(type, payload);
    this.link?.pump();
    this.#count();
    return seq;
  }

  /** @param {Uint8Array} payload */
  #look(payload) {
    const isPlanned = this.viewWaiting !== null;
    this.viewWaiting = payload;
    if (isPlanned) return;
    const wait = Math.max(0, this.viewSent + VIEW_PAUSE - performance.now());
    setTimeout(() => {
      if (this.viewWaiting) this.link?.send(encodeFrame(UP.VIEW, 0, this.viewWaiting));
      this.viewWaiting = null;
      this.viewSent = performance.now();
    }, wait);
  }

  /** @param {import("./protocol.js").Frame} frame */
  #receive({ type, flags, seq, payload }) {
    if (type === DOWN.ACK) this.#acknowledged(seq, payload);
    else if (type === DOWN.BRICKS) {
      const bricks = decodeBricks(payload);
      for (const fn of this.brickListeners) fn(bricks, pictureOf(flags));
      this.seen.add(bricks, (flags & COMPLETE) !== 0);
      this.link?.send(encodeFrame(UP.SHOWN, seq));
    } else if (type === DOWN.STATE) this.#setState(decodeJson(payload));
    else if (type === DOWN.ERROR) this.#refused(decodeJson(payload));
    else if (type === DOWN.WELCOME) this.#welcomed(decodeJson(payload));
    else throw new FrameError(`messages of type ${type} are unknown`);
  }

  /** @param {any} welcome */
  #welcomed(welcome) {
    this.tries = 0;
    this.queue.skipTo(welcome.cseq);
    this.seen.begin(welcome.run ?? "");
    this.store.set({ saved: welcome.state.saved, connection: "open", closedReason: null });
    this.#setState(welcome.state);
    this.link?.welcomed();
    this.#count();
  }

  /**
   * @param {number} seq
   * @param {Uint8Array} payload
   */
  #acknowledged(seq, payload) {
    if (payload.length !== 4) throw new FrameError("an acknowledgement has not 4 bytes");
    const number = new DataView(payload.buffer, payload.byteOffset).getUint32(0, true);
    this.refusals = 0;
    this.#drop(seq);
    if (number > this.store.get().saved) this.store.set({ saved: number });
  }

  /** @param {any} state */
  #setState(state) {
    const { saved } = this.store.get();
    this.store.set({ state, saved: Math.max(saved, state.saved ?? 0) });
  }

  /** @param {any} error */
  #refused(error) {
    const message = this.#drop(error.cseq);
    const type = message?.frame[0];
    const isLast = !this.queue.messages.some(({ frame }) => frame[0] === UP.STROKE_BEGIN);
    if (type === UP.STROKE_BEGIN && isLast) this.queue.isStroking = false;
    // Batches of a stroke that was refused are refused, too: that was said already
    if (type === UP.DABS || type === UP.STROKE_END) return;
    toast(this.store, { kind: "error", what: error.what, fix: error.fix });
  }

  /** @param {number} seq */
  #drop(seq) {
    const message = this.queue.take(seq);
    this.link?.pump();
    this.#count();
    return message;
  }

  #count() {
    const { messages, strokes } = this.queue;
    this.store.set({ unacked: messages.length, unackedStrokes: strokes });
  }
}
