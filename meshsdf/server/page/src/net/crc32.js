/** The CRC-32 of IEEE 802.3 (reflected polynomial 0xEDB88320), four bytes at a time. */

const POLYNOMIAL = 0xedb88320;
const TABLES = tables();

function tables() {
  const all = Array.from({ length: 4 }, () => new Uint32Array(256));
  for (let n = 0; n < 256; n++) {
    let value = n;
    for (let bit = 0; bit < 8; bit++) value = value & 1 ? (value >>> 1) ^ POLYNOMIAL : value >>> 1;
    all[0][n] = value;
  }
  // Table k takes a byte that k others follow (Kounavis and Berry 2008, doi:10.1109/TC.2008.85)
  for (let k = 1; k < 4; k++) {
    for (let n = 0; n < 256; n++) {
      const before = all[k - 1][n];
      all[k][n] = (before >>> 8) ^ all[0][before & 255];
    }
  }
  return all;
}

/**
 * @param {Uint8Array} bytes
 * @returns {number} 0 to 2^32 - 1
 */
export function crc32(bytes) {
  const [t0, t1, t2, t3] = TABLES;
  let crc = 0xffffffff;
  let at = 0;
  for (const end = bytes.length & ~3; at < end; at += 4) {
    crc ^= bytes[at] | (bytes[at + 1] << 8) | (bytes[at + 2] << 16) | (bytes[at + 3] << 24);
    crc = t3[crc & 255] ^ t2[(crc >>> 8) & 255] ^ t1[(crc >>> 16) & 255] ^ t0[crc >>> 24];
  }
  for (; at < bytes.length; at++) crc = (crc >>> 8) ^ t0[(crc ^ bytes[at]) & 255];
  return (crc ^ 0xffffffff) >>> 0;
}
