/**
 * The frames of the socket, version 2: a header of 16 bytes, then the payload, little endian.
 *
 * `type u8, version u8, flags u16, seq u32, length u32, crc32 u32`; see PROTOCOL.md of the server.
 */

import { crc32 } from "./crc32.js";
import { encodeOctahedral } from "./octahedral.js";

export const VERSION = 2;
export const COMPLETE = 1; // flag of BRICKS: whoever got this has everything
export const HEADER = 16;
export const DAB = 20;
export const MASK_BYTES = 92; // 729 bits
export const BRICK_NODES = 729;

export const UP = /** @type {const} */ ({
  HELLO: 1,
  STROKE_BEGIN: 2,
  DABS: 3,
  STROKE_END: 4,
  UNDO: 5,
  REDO: 6,
  OPERATION: 7,
  VIEW: 8,
  SHOWN: 9,
  STROKE_CANCEL: 10,
});
export const DOWN = /** @type {const} */ ({
  WELCOME: 64,
  ACK: 65,
  BRICKS: 66,
  STATE: 67,
  ERROR: 68,
});

/** Pictures of a texture, by their numbers on the wire. */
export const PICTURES = /** @type {const} */ (["base", "normal", "height"]);

/** @typedef {(typeof PICTURES)[number]} PictureName */

const EMPTY = new Uint8Array(0);

/** A message that cannot be what it says. */
export class FrameError extends Error {}

/**
 * @param {number} type
 * @param {number} seq
 * @param {Uint8Array} [payload]
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function encodeFrame(type, seq, payload = EMPTY) {
  const frame = new Uint8Array(HEADER + payload.length);
  const view = new DataView(frame.buffer);
  view.setUint8(0, type);
  view.setUint8(1, VERSION);
  view.setUint32(4, seq, true);
  view.setUint32(8, payload.length, true);
  view.setUint32(12, crc32(payload), true);
  frame.set(payload, HEADER);
  return frame;
}

/** @typedef {{type: number, flags: number, seq: number, payload: Uint8Array}} Frame */

/**
 * @param {ArrayBuffer | Uint8Array} data
 * @returns {Frame}
 */
export function decodeFrame(data) {
  const frame = data instanceof Uint8Array ? data : new Uint8Array(data);
  if (frame.length < HEADER) throw new FrameError(`a frame of ${frame.length} bytes has no header`);
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  const payload = frame.subarray(HEADER);
  if (view.getUint8(1) !== VERSION) throw new FrameError(`protocol ${view.getUint8(1)} is unknown`);
  if (view.getUint32(8, true) !== payload.length) {
    throw new FrameError(`${payload.length} bytes came of ${view.getUint32(8, true)}`);
  }
  if (view.getUint32(12, true) !== crc32(payload)) throw new FrameError("the checksum is wrong");
  const flags = view.getUint16(2, true);
  return { type: view.getUint8(0), flags, seq: view.getUint32(4, true), payload };
}

/**
 * Which picture the bricks of a message belong to.
 *
 * @param {number} flags of BRICKS
 * @returns {PictureName}
 */
export function pictureOf(flags) {
  const name = PICTURES[(flags >> 1) & 3];
  if (!name) throw new FrameError(`there is no picture ${(flags >> 1) & 3}`);
  return name;
}

/** @param {any} value */
export function encodeJson(value) {
  return new TextEncoder().encode(JSON.stringify(value));
}

/**
 * @param {Uint8Array} payload
 * @returns {any}
 */
export function decodeJson(payload) {
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(payload));
  } catch {
    throw new FrameError("a message is not the JSON it should be");
  }
}

/**
 * @typedef {object} Sample of a stroke
 * @property {readonly number[]} point
 * @property {readonly number[]} normal
 * @property {number} pressure 0 to 1
 * @property {number} dt milliseconds since the sample before
 */

/**
 * @param {readonly Sample[]} samples
 * @returns {Uint8Array}
 */
export function encodeDabs(samples) {
  const bytes = new Uint8Array(DAB * samples.length);
  const view = new DataView(bytes.buffer);
  samples.forEach(({ point, normal, pressure, dt }, n) => {
    const at = DAB * n;
    const [u, v] = encodeOctahedral(normal);
    for (let axis = 0; axis < 3; axis++) view.setFloat32(at + 4 * axis, point[axis], true);
    view.setInt16(at + 12, u, true);
    view.setInt16(at + 14, v, true);
    view.setUint16(at + 16, Math.round(65535 * Math.min(Math.max(pressure, 0), 1)), true);
    view.setUint16(at + 18, Math.round(Math.min(Math.max(dt, 0), 65535)), true);
  });
  return bytes;
}

/**
 * @param {readonly number[]} eye
 * @param {readonly number[] | null} cursor
 * @returns {Uint8Array}
 */
export function encodeView(eye, cursor) {
  return new Uint8Array(new Float32Array([...eye, ...(cursor ?? [NaN, NaN, NaN])]).buffer);
}

/** States of a brick. */
export const ABSENT = 0;
export const UNIFORM = 1;
export const TEXELS = 2;

/**
 * @typedef {object} Brick
 * @property {number} entry
 * @property {number} version
 * @property {number} state ABSENT, UNIFORM or TEXELS
 * @property {Uint8Array} data of UNIFORM its four bytes; of TEXELS the mask, then four for each node in it
 */

/**
 * The bricks of a message; their data are views of it.
 *
 * @param {Uint8Array} payload
 * @returns {Brick[]}
 */
export function decodeBricks(payload) {
  const view = new DataView(payload.buffer, payload.byteOffset, payload.byteLength);
  const short = () => new FrameError("a message of bricks ends too early");
  if (payload.length < 4) throw short();
  const bricks = [];
  let at = 4;
  for (let left = view.getUint32(0, true); left > 0; left--) {
    if (at + 12 > payload.length) throw short();
    const state = view.getUint8(at + 8);
    const n = view.getUint16(at + 10, true);
    const size = state === TEXELS ? MASK_BYTES + 4 * n : state === UNIFORM ? 4 : 0;
    if (state > TEXELS || n > BRICK_NODES) throw new FrameError(`no brick has the state ${state}`);
    if (at + 12 + size > payload.length) throw short();
    bricks.push({
      entry: view.getUint32(at, true),
      version: view.getUint32(at + 4, true),
      state,
      data: payload.subarray(at + 12, at + 12 + size),
    });
    at += 12 + size;
  }
  if (at !== payload.length) throw new FrameError("a message of bricks is too long");
  return bricks;
}
