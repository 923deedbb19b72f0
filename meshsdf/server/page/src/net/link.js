/** One socket from its opening to its end: greets, sends what waits, and notices when it is dead. */

import { FrameError, UP, decodeFrame, encodeFrame, encodeJson } from "./protocol.js";

const MOST_SENT = 64; // messages that may be under way unacknowledged
const DEAD_AFTER = 15000; // milliseconds in which something that was sent must be answered
const WATCH = 1000;

/**
 * @typedef {object} Hooks
 * @property {(frame: import("./protocol.js").Frame) => void} onFrame
 * @property {() => Record<string, any>} greeting what HELLO says
 * @property {(code: number) => void} onClose called once, however the socket ends
 */

export class Link {
  /**
   * @param {import("./queue.js").Queue} queue
   * @param {Hooks} hooks
   */
  constructor(queue, hooks) {
    this.queue = queue;
    this.hooks = hooks;
    /** @type {WebSocket | null} */
    this.socket = null;
    this.isWelcome = false;
    this.isOver = false;
    this.lastSent = 0; // number of the newest message sent on this socket
    this.heard = 0;
    /** @type {ReturnType<typeof setInterval> | undefined} */
    this.watch = undefined;
  }

  open() {
    const address = new URL("/api/socket", location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heard = performance.now();
    socket.onopen = () => {
      socket.send(encodeFrame(UP.HELLO, 0, encodeJson(this.hooks.greeting())));
    };
    socket.onmessage = (event) => this.#take(event.data);
    socket.onclose = (event) => this.#end(event.code);
    this.watch = setInterval(() => this.#check(), WATCH);
  }

  close() {
    this.#end(1000);
  }

  /** The server has greeted: what waits may go. */
  welcomed() {
    this.isWelcome = true;
    this.pump();
  }

  /** Send as many waiting messages as may be under way. */
  pump() {
    if (!this.isWelcome || this.isOver) return;
    const { messages } = this.queue;
    const limit = Math.min(messages.length, MOST_SENT);
    for (let n = 0; n < limit; n++) {
      if (messages[n].seq <= this.lastSent) continue;
      if (!this.#isAwaited()) this.heard = performance.now();
      this.socket?.send(messages[n].frame);
      this.lastSent = messages[n].seq;
    }
  }

  /**
   * Send what may be lost, if that is possible now.
   *
   * @param {Uint8Array<ArrayBuffer>} frame
   */
  send(frame) {
    if (this.isWelcome && !this.isOver) this.socket?.send(frame);
  }

  #isAwaited() {
    const first = this.queue.messages[0];
    return first !== undefined && first.seq <= this.lastSent;
  }

  /** @param {ArrayBuffer} data */
  #take(data) {
    if (this.isOver) return;
    this.heard = performance.now();
    try {
      this.hooks.onFrame(decodeFrame(data));
    } catch (error) {
      if (!(error instanceof FrameError)) throw error;
      console.error(error);
      this.#end(1002);
    }
  }

  #check() {
    const isWaiting = !this.isWelcome || this.#isAwaited();
    if (isWaiting && performance.now() - this.heard > DEAD_AFTER) this.#end(1001);
  }

  /** @param {number} code */
  #end(code) {
    if (this.isOver) return;
    this.isOver = true;
    clearInterval(this.watch);
    this.socket?.close();
    this.hooks.onClose(code);
  }
}
