/**
 * The colours of heights: blue goes in, orange comes out, grey is as the surface was.
 *
 * Blue and orange are told apart by every kind of colour vision, and the lightness rises with the
 * height, so that the picture reads in grey, too.
 */

/** sRGB of the deepest, of what was never moved, and of the highest. */
export const RAMP = /** @type {const} */ ({
  low: [0.17, 0.37, 0.66],
  even: [0.62, 0.62, 0.62],
  high: [0.97, 0.69, 0.32],
});

/** @param {readonly number[]} color sRGB, 0 to 1 */
export const cssOf = (color) => `rgb(${color.map((value) => Math.round(255 * value)).join(" ")})`;

/** @param {readonly number[]} color */
const glslOf = (color) => `vec3(${color.join(", ")})`;

/** `rampColor` of a height, and of the largest that there is, on the graphics card. */
export const RAMP_GLSL = /* glsl */ `
vec3 rampColor(float height, float reach) {
  float share = clamp(height / max(reach, 1e-6), -1.0, 1.0);
  vec3 end = share < 0.0 ? ${glslOf(RAMP.low)} : ${glslOf(RAMP.high)};
  return mix(${glslOf(RAMP.even)}, end, abs(share));
}
`;
