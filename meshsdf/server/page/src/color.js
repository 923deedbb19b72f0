/**
 * Colours: linear RGB inside the page, sRGB at its edges, OKLCH to choose by.
 *
 * OKLab is Ottosson's (2020, "A perceptual color space for image processing"); its matrices are
 * that note's. Lightness, chroma and hue are the polar form. sRGB is IEC 61966-2-1.
 */

/** @typedef {[number, number, number]} Rgb */
/** @typedef {{l: number, s: number, h: number}} Pick lightness 0..1, share of the most vivid, degrees */

const DEGREES = 180 / Math.PI;
const HALVINGS = 18; // of the interval that the largest chroma lies in
const MOST_CHROMA = 0.4; // no sRGB colour has as much
const BEYOND = 0.005; // of the largest of the three
const GREY = 1e-4; // chroma below which a hue means nothing

/** @param {number} value */
export function encodeSrgb(value) {
  return value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055;
}

/** @param {number} value */
export function decodeSrgb(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/** @param {number} value */
const byte = (value) => Math.round(255 * Math.min(Math.max(encodeSrgb(value), 0), 1));

/**
 * @param {readonly number[]} rgb linear
 * @returns {string} such as "#aa7744"
 */
export function toHex(rgb) {
  const part = (/** @type {number} */ value) => byte(value).toString(16).padStart(2, "0");
  return `#${part(rgb[0])}${part(rgb[1])}${part(rgb[2])}`;
}

/**
 * @param {string} text "#a74", "aa7744" ...
 * @returns {Rgb | null} linear, or null if it is no colour
 */
export function fromHex(text) {
  const digits = text.trim().replace(/^#/, "");
  if (!/^([0-9a-f]{3}|[0-9a-f]{6})$/i.test(digits)) return null;
  const long = digits.length === 3 ? digits.replace(/./g, "$&$&") : digits;
  const number = Number.parseInt(long, 16);
  const parts = [number >> 16, (number >> 8) & 255, number & 255];
  return /** @type {Rgb} */ (parts.map((value) => decodeSrgb(value / 255)));
}

/**
 * @param {number} l
 * @param {number} c
 * @param {number} h degrees
 * @returns {Rgb} linear, perhaps outside of 0..1
 */
export function fromOklch(l, c, h) {
  const a = c * Math.cos(h / DEGREES);
  const b = c * Math.sin(h / DEGREES);
  const long = (l + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const middle = (l - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const short = (l - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    4.0767416621 * long - 3.3077115913 * middle + 0.2309699292 * short,
    -1.2684380046 * long + 2.6097574011 * middle - 0.3413193965 * short,
    -0.0041960863 * long - 0.7034186147 * middle + 1.707614701 * short,
  ];
}

/**
 * @param {readonly number[]} rgb linear
 * @returns {[number, number, number]} lightness, chroma, hue in degrees from 0 to 360
 */
export function toOklch([r, g, b]) {
  const long = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const middle = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const short = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  const l = 0.2104542553 * long + 0.793617785 * middle - 0.0040720468 * short;
  const x = 1.9779984951 * long - 2.428592205 * middle + 0.4505937099 * short;
  const y = 0.0259040371 * long + 0.7827717662 * middle - 0.808675766 * short;
  return [l, Math.hypot(x, y), (Math.atan2(y, x) * DEGREES + 360) % 360];
}

/**
 * Inside of sRGB, or so little beyond that cutting is not seen. Near blue its border is hollow:
 * without the little, a line of one hue would leave it before it gets to its most vivid colour.
 *
 * @param {readonly number[]} rgb
 */
function isInside(rgb) {
  const most = Math.max(...rgb);
  return Math.min(...rgb) >= -BEYOND * most - 1e-9 && most <= 1 + BEYOND;
}

/**
 * The largest chroma that sRGB has at a lightness and a hue, to half a hundredth of its colour.
 *
 * @param {number} l
 * @param {number} h degrees
 */
export function largestChroma(l, h) {
  if (l <= 0 || l >= 1) return 0;
  let low = 0;
  let high = MOST_CHROMA;
  for (let i = 0; i < HALVINGS; i++) {
    const middle = (low + high) / 2;
    if (isInside(fromOklch(l, middle, h))) low = middle;
    else high = middle;
  }
  return low;
}

/**
 * The colour of a place in the picker: its square holds nothing that a screen cannot show.
 *
 * @param {Pick} pick
 * @returns {Rgb} linear, each in 0..1
 */
export function fromPick({ l, s, h }) {
  const rgb = fromOklch(l, s * largestChroma(l, h), h);
  return /** @type {Rgb} */ (rgb.map((value) => Math.min(Math.max(value, 0), 1)));
}

/**
 * The place of a colour in the picker. Greys have no hue, black and white no vividness, so these
 * stay as they were before.
 *
 * @param {readonly number[]} rgb linear
 * @param {Pick} [before]
 * @returns {Pick}
 */
export function toPick(rgb, before = { l: 0, s: 0, h: 30 }) {
  const [l, c, h] = toOklch(rgb);
  const lightness = Math.min(Math.max(l, 0), 1);
  const hue = c < GREY ? before.h : h;
  const most = largestChroma(lightness, hue);
  return { l: lightness, s: most < GREY ? before.s : Math.min(c / most, 1), h: hue };
}

/**
 * Whether dark or light strokes are seen better on a colour (WCAG's contrast with black and white).
 *
 * @param {readonly number[]} rgb linear
 */
export function isLight([r, g, b]) {
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.18;
}
