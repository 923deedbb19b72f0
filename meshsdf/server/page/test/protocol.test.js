import assert from "node:assert/strict";
import { test } from "node:test";
import { crc32 } from "../src/net/crc32.js";
import { decodeOctahedral, encodeOctahedral } from "../src/net/octahedral.js";
import * as protocol from "../src/net/protocol.js";

const { DOWN, FrameError, MASK_BYTES, TEXELS, UNIFORM, UP } = protocol;
const bytes = (/** @type {string} */ hex) => Uint8Array.from(Buffer.from(hex.replace(/ /g, ""), "hex"));

/** The definition, bit by bit. */
function slowCrc(/** @type {Uint8Array} */ data) {
  let crc = 0xffffffff;
  for (const byte of data) {
    crc ^= byte;
    for (let n = 0; n < 8; n++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return (crc ^ 0xffffffff) >>> 0;
}

test("the checksum is the CRC-32 of its definition, whatever the length", () => {
  assert.equal(crc32(Buffer.from("123456789")), 0xcbf43926); // the check value of the standard
  const data = Uint8Array.from({ length: 41 }, (_, n) => (n * n * 31 + 7) & 255);
  for (let n = 0; n <= data.length; n++) assert.equal(crc32(data.subarray(0, n)), slowCrc(data.subarray(0, n)));
});

test("a frame is the header of the protocol and its payload", () => {
  const frame = protocol.encodeFrame(UP.STROKE_END, 7);
  assert.deepEqual(frame, bytes("04020000 07000000 00000000 00000000"));
  const payload = Buffer.from("123456789");
  const long = protocol.encodeFrame(DOWN.ACK, 0x01020304, payload);
  assert.deepEqual(long.subarray(0, 16), bytes("41020000 04030201 09000000 2639f4cb"));
  const back = protocol.decodeFrame(long);
  assert.deepEqual([back.type, back.flags, back.seq], [DOWN.ACK, 0, 0x01020304]);
  assert.deepEqual(back.payload, Uint8Array.from(payload));
});

test("a frame that was cut, altered or of another version is refused", () => {
  const frame = protocol.encodeFrame(DOWN.STATE, 1, Buffer.from("{}"));
  for (let n = 0; n < frame.length; n++) {
    assert.throws(() => protocol.decodeFrame(frame.slice(0, n)), FrameError);
  }
  for (const [at, words] of /** @type {const} */ ([[1, /protocol/], [8, /bytes came/], [12, /checksum/], [17, /checksum/]])) {
    const other = frame.slice();
    other[at] ^= 4;
    assert.throws(() => protocol.decodeFrame(other), words);
  }
});

test("samples of a stroke take 20 bytes each", () => {
  const samples = [
    { point: [1, -2, 0.5], normal: [0, 0, 1], pressure: 1, dt: 0 },
    { point: [0, 0, 0], normal: [-3, 0, 0], pressure: 0.5, dt: 1e9 },
  ];
  const hex = Buffer.from(protocol.encodeDabs(samples)).toString("hex");
  assert.equal(hex.slice(0, 40), "0000803f" + "000000c0" + "0000003f" + "0000" + "0000" + "ffff" + "0000");
  assert.equal(hex.slice(64), "0180" + "0000" + "0080" + "ffff");
});

test("normals come back to a hundredth of a degree", () => {
  let worst = 0;
  for (let n = 0; n < 2000; n++) {
    // A spiral over the sphere
    const z = 1 - (2 * n + 1) / 2000;
    const r = Math.sqrt(1 - z * z);
    const normal = [r * Math.cos(2.4 * n), r * Math.sin(2.4 * n), z];
    const back = decodeOctahedral(...encodeOctahedral(normal));
    worst = Math.max(worst, Math.hypot(...back.map((value, axis) => value - normal[axis])));
  }
  assert.ok(worst < (0.01 * Math.PI) / 180, `${worst}`);
  assert.deepEqual(encodeOctahedral([0, 0, 0]), [-32768, -32768]);
  assert.deepEqual(decodeOctahedral(-32768, -32768), [0, 0, 0]);
});

/** A message with a uniform brick, one of two nodes, and one that is gone. */
function someBricks() {
  const mask = new Uint8Array(MASK_BYTES);
  mask[0] = 1 << 5;
  mask[91] = 1; // bit 728, the last
  return Buffer.concat([
    bytes("03000000"),
    bytes("05000000 01000000 01000000 0a0b0cff"),
    bytes("06000000 02000000 02000200"), mask, bytes("01020304 05060708"),
    bytes("07000000 03000000 00000000"),
  ]); // prettier-ignore
}

test("bricks are read as they are written", () => {
  const bricks = protocol.decodeBricks(someBricks());
  assert.deepEqual(bricks.map(({ entry, version, state }) => [entry, version, state]), [
    [5, 1, UNIFORM],
    [6, 2, TEXELS],
    [7, 3, protocol.ABSENT],
  ]);
  assert.deepEqual([...bricks[0].data], [10, 11, 12, 255]);
  assert.deepEqual([...bricks[1].data.subarray(MASK_BYTES)], [1, 2, 3, 4, 5, 6, 7, 8]);
});

test("a message of bricks that ends anywhere else is refused", () => {
  const payload = someBricks();
  for (let n = 0; n < payload.length; n++) {
    assert.throws(() => protocol.decodeBricks(payload.subarray(0, n)), FrameError);
  }
  assert.throws(() => protocol.decodeBricks(Buffer.concat([payload, bytes("00")])), /too long/);
  payload[12] = 3;
  assert.throws(() => protocol.decodeBricks(payload), /state 3/);
});
