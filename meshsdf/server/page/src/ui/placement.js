/**
 * How an image lies in space: plain arithmetic from a view, or a place on the surface, to the
 * parameters of the server's projections. All in the mesh's own coordinates.
 */

/** @typedef {[number, number, number]} Vec3 */

/**
 * @typedef {object} Camera as the viewer tells it, but in the mesh's own coordinates
 * @property {Vec3} eye
 * @property {Vec3} target
 * @property {Vec3} up
 * @property {number} fov vertical, degrees
 * @property {number} aspect
 * @property {number} width CSS px
 * @property {number} height CSS px
 */

/**
 * @typedef {object} Frame of a picture on the screen
 * @property {number} x its middle, px from the middle of the view, to the right
 * @property {number} y downwards
 * @property {number} width px
 * @property {number} height px
 * @property {number} angle degrees, clockwise
 */

/** @typedef {{right: Vec3, up: Vec3, out: Vec3}} Axes an image's x and y, and what looks at its face */

/** @param {readonly number[]} a @param {readonly number[]} b @returns {Vec3} */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {readonly number[]} a @param {readonly number[]} b @returns {Vec3} */
export const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {readonly number[]} a @param {number} s @returns {Vec3} */
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {readonly number[]} a @param {readonly number[]} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {readonly number[]} a @param {readonly number[]} b @returns {Vec3} */
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
/** @param {readonly number[]} a @returns {Vec3} */
export const unit = (a) => times(a, 1 / (Math.hypot(...a) || 1));

/**
 * Axes with a given face, upright as `up` would have it.
 *
 * @param {Vec3} out
 * @param {Vec3} up
 * @returns {Axes}
 */
export function axesOf(out, up) {
  const face = unit(out);
  let right = cross(up, face);
  // Looked at along `up` any direction will do
  if (Math.hypot(...right) < 1e-6)
    right = cross(Math.abs(face[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], face);
  right = unit(right);
  return { right, up: cross(face, right), out: face };
}

/**
 * Turn axes about their face, against the clock as one looks at the image.
 *
 * @param {Axes} axes
 * @param {number} degrees
 * @returns {Axes}
 */
export function turned({ right, up, out }, degrees) {
  const cosine = Math.cos((degrees * Math.PI) / 180);
  const sine = Math.sin((degrees * Math.PI) / 180);
  return {
    right: plus(times(right, cosine), times(up, sine)),
    up: plus(times(up, cosine), times(right, -sine)),
    out,
  };
}

/**
 * The matrix from an image's space, whose x, y, z are right, up and out, to the mesh's.
 *
 * @param {Axes} axes
 * @param {Vec3} origin
 * @returns {number[][]} 4 x 4
 */
export function matrixOf({ right, up, out }, origin) {
  const rows = [0, 1, 2].map((row) => [right[row], up[row], out[row], origin[row]]);
  return [...rows, [0, 0, 0, 1]];
}

/** Faces of the images that lie along an axis, and what is up in them. */
export const SIDES = /** @type {Record<string, {out: Vec3, up: Vec3}>} */ ({
  x: { out: [1, 0, 0], up: [0, 1, 0] },
  y: { out: [0, 1, 0], up: [0, 0, -1] },
  z: { out: [0, 0, 1], up: [0, 1, 0] },
});

/**
 * The frame that a rotated picture needs around the middle of the view, px.
 *
 * @param {Frame} frame
 * @returns {{width: number, height: number}} least symmetric rectangle that holds it
 */
export function hullOf({ x, y, width, height, angle }) {
  const cosine = Math.abs(Math.cos((angle * Math.PI) / 180));
  const sine = Math.abs(Math.sin((angle * Math.PI) / 180));
  return {
    width: 2 * Math.abs(x) + width * cosine + height * sine,
    height: 2 * Math.abs(y) + width * sine + height * cosine,
  };
}

/**
 * Parameters of a camera's picture that holds the frame: the view's own lens, cut to the hull.
 *
 * @param {Camera} camera
 * @param {{width: number, height: number}} hull px
 */
export function cameraParams(camera, hull) {
  const half = Math.tan((camera.fov * Math.PI) / 360) * (hull.height / camera.height);
  return {
    eye: camera.eye,
    target: camera.target,
    up: camera.up,
    field_of_view: (360 / Math.PI) * Math.atan(half),
    aspect: hull.width / hull.height,
  };
}

/**
 * Parameters of a sticker, a plane or three planes whose image has its middle at a point.
 *
 * @param {"decal" | "planar" | "triplanar"} kind
 * @param {Axes} axes
 * @param {Vec3} middle
 * @param {number} width of the image, world units
 * @param {number} height
 */
export function flatParams(kind, axes, middle, width, height) {
  // A plane's image has its corner at the origin, a sticker's its middle
  const back = plus(times(axes.right, -width / 2), times(axes.up, -height / 2));
  const origin = kind === "decal" ? middle : plus(middle, back);
  return { width, height, matrix: matrixOf(axes, origin) };
}

/**
 * Axes whose z is a coordinate axis, for what goes around it.
 *
 * @param {string} axis
 * @returns {Axes}
 */
export function around(axis) {
  const at = { x: 0, y: 1, z: 2 }[axis] ?? 1;
  const one = (/** @type {number} */ i) =>
    /** @type {Vec3} */ ([0, 1, 2].map((k) => Number(k === i % 3)));
  return { right: one(at + 1), up: one(at + 2), out: one(at) };
}
