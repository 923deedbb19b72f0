/**
 * Messages that must not be lost, kept until the server has acknowledged them.
 *
 * They lie in the tab's storage, too, so that they outlive a reload: under one key each, since
 * writing all of them for every batch of a stroke would take ever longer.
 */

import { UP, encodeFrame } from "./protocol.js";

const PREFIX = "meshsdf.";
const MESSAGE = `${PREFIX}message.`;

/** @typedef {{seq: number, frame: Uint8Array<ArrayBuffer>}} Message */

/** What the queue needs of a `Storage`. */
/** @typedef {Pick<Storage, "getItem" | "setItem" | "removeItem" | "key" | "length">} Keeper */

export class Queue {
  /**
   * @param {Keeper | null} storage the tab's; null keeps messages in memory alone
   * @param {() => string} newClient makes 32 hexadecimal digits
   */
  constructor(storage, newClient) {
    this.storage = storage;
    this.newClient = newClient;
    /** @type {Message[]} */
    this.messages = [];
    this.client = this.#read("client") ?? "";
    this.next = Number(this.#read("next") ?? 1);
    this.isStroking = this.#read("stroking") === "1";
    this.isKept = storage !== null;
    if (!/^[0-9a-f]{32}$/.test(this.client) || !Number.isInteger(this.next)) this.forget();
    else this.messages = this.#readMessages();
    const last = this.messages.at(-1);
    if (last) this.next = Math.max(this.next, last.seq + 1);
  }

  /** Begin as somebody new, without messages. */
  forget() {
    for (const key of this.#keys()) this.storage?.removeItem(key);
    this.messages = [];
    this.next = 1;
    this.isStroking = false;
    this.client = this.newClient();
    this.#write("client", this.client);
  }

  /**
   * Number a message and keep it.
   *
   * @param {number} type
   * @param {Uint8Array} [payload]
   * @returns {Message}
   */
  push(type, payload) {
    const message = { seq: this.next, frame: encodeFrame(type, this.next, payload) };
    this.next += 1;
    this.messages.push(message);
    this.#write("next", String(this.next));
    this.#write(`message.${message.seq}`, toText(message.frame));
    if (type === UP.STROKE_BEGIN) this.#setStroking(true);
    if (type === UP.STROKE_END || type === UP.STROKE_CANCEL) this.#setStroking(false);
    return message;
  }

  /**
   * The server has dealt with a message.
   *
   * @param {number} seq
   * @returns {Message | null} the message, if it was waiting
   */
  take(seq) {
    const place = this.messages.findIndex((message) => message.seq === seq);
    if (place < 0) return null;
    this.storage?.removeItem(MESSAGE + seq);
    return this.messages.splice(place, 1)[0];
  }

  /**
   * The server knows messages up to a number: later ones are numbered beyond it.
   *
   * @param {number} seq
   */
  skipTo(seq) {
    if (seq < this.next) return;
    this.next = seq + 1;
    this.#write("next", String(this.next));
  }

  /** How many strokes and operations wait. */
  get strokes() {
    let count = 0;
    let isOpen = false;
    for (const { frame } of this.messages) {
      const isPart = frame[0] === UP.STROKE_BEGIN || frame[0] === UP.DABS;
      if (!isPart) count += 1;
      isOpen = isPart;
    }
    return count + (isOpen ? 1 : 0);
  }

  /** @param {boolean} is */
  #setStroking(is) {
    this.isStroking = is;
    this.#write("stroking", is ? "1" : "0");
  }

  #keys() {
    const keys = [];
    for (let n = 0; n < (this.storage?.length ?? 0); n++) {
      const key = this.storage?.key(n);
      if (key?.startsWith(PREFIX)) keys.push(key);
    }
    return keys;
  }

  #readMessages() {
    /** @type {Message[]} */
    const messages = [];
    for (const key of this.#keys().filter((one) => one.startsWith(MESSAGE))) {
      const frame = fromText(this.storage?.getItem(key) ?? "");
      if (frame) messages.push({ seq: Number(key.slice(MESSAGE.length)), frame });
    }
    return messages.sort((a, b) => a.seq - b.seq);
  }

  /** @param {string} name */
  #read(name) {
    try {
      return this.storage?.getItem(PREFIX + name) ?? null;
    } catch {
      return null;
    }
  }

  /**
   * @param {string} name
   * @param {string} value
   */
  #write(name, value) {
    try {
      this.storage?.setItem(PREFIX + name, value);
    } catch {
      this.isKept = false; // the storage is full: the page warns before it is left
    }
  }
}

/** @param {Uint8Array} bytes */
function toText(bytes) {
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) {
    text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  }
  return btoa(text);
}

/** @param {string} text */
function fromText(text) {
  try {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  } catch {
    return null;
  }
}
