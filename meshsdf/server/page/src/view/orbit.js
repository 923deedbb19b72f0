/**
 * The camera: it turns about a target, and follows where it should be with a short delay.
 */

import { Matrix4, PerspectiveCamera, Raycaster, Vector2, Vector3 } from "three";

const FOV = 35;
const FIRST = { azimuth: 0.6, polar: 1.25 };
const SIDES = /** @type {Record<string, [number, number]>} */ ({
  front: [0, Math.PI / 2],
  back: [Math.PI, Math.PI / 2],
  right: [Math.PI / 2, Math.PI / 2],
  left: [-Math.PI / 2, Math.PI / 2],
  top: [0, 0],
  bottom: [0, Math.PI],
});
const LEAST_POLAR = 1e-3;
const DELAY = 55; // milliseconds in which 63 % of a way is gone
const AT_REST = 1e-4; // of the distance, or radians
const MARGIN = 1.12; // around what fills the view
const NEAREST = 2e-3; // of the model's radius
const FARTHEST = 40;
const TURN = Math.PI; // radians for a drag over the height of the view

/** @typedef {{target: Vector3, distance: number, azimuth: number, polar: number}} Pose */

export class Orbit {
  #matrix = new Matrix4(); // from the world to the view's cube

  /**
   * @param {Vector3} center
   * @param {number} radius of what is looked at
   */
  constructor(center, radius) {
    this.center = center.clone();
    this.radius = radius;
    this.spread = 0; // how far things may lie beyond that
    this.camera = new PerspectiveCamera(FOV, 1, 0.1, 100);
    this.width = this.height = 1;
    this.caster = new Raycaster();
    /** @type {Pose} */
    this.pose = { target: center.clone(), distance: 1, ...FIRST };
    this.pose.distance = this.#wholeDistance();
    /** @type {Pose} */
    this.goal = { ...this.pose, target: center.clone() };
    this.isFresh = true;
    this.#place();
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    this.camera.aspect = this.width / this.height;
    if (this.isFresh) {
      this.goal.distance = this.pose.distance = this.#wholeDistance();
    }
    this.#place();
  }

  /**
   * What is looked at has grown, or shrunk: nothing of it may be cut off in front of the camera.
   *
   * @param {number} spread how far it may lie beyond its radius
   */
  grow(spread) {
    this.spread = spread;
    this.#place();
  }

  /**
   * @param {number} dx pixels
   * @param {number} dy
   */
  turn(dx, dy) {
    const scale = TURN / this.height;
    this.goal.azimuth -= dx * scale;
    this.goal.polar = clamp(this.goal.polar - dy * scale, LEAST_POLAR, Math.PI - LEAST_POLAR);
    this.isFresh = false;
  }

  /**
   * @param {number} dx pixels
   * @param {number} dy
   */
  pan(dx, dy) {
    const scale = (2 * this.goal.distance * Math.tan((FOV * Math.PI) / 360)) / this.height;
    const { elements: m } = this.camera.matrixWorld;
    this.goal.target.addScaledVector(new Vector3(m[0], m[1], m[2]), -dx * scale);
    this.goal.target.addScaledVector(new Vector3(m[4], m[5], m[6]), dy * scale);
    this.isFresh = false;
  }

  /**
   * Come nearer (a factor below 1) or go away; a point keeps its place on the screen.
   *
   * @param {number} factor
   * @param {Vector3 | null} [point]
   */
  zoom(factor, point = null) {
    const before = this.goal.distance;
    const least = NEAREST * this.radius;
    this.goal.distance = clamp(before * factor, least, FARTHEST * this.radius);
    const share = 1 - this.goal.distance / before;
    if (point) this.goal.target.addScaledVector(point.clone().sub(this.goal.target), share);
    this.isFresh = false;
  }

  /**
   * Look at a place, from near enough to work on it.
   *
   * @param {Vector3 | null} point null: at everything
   */
  focus(point) {
    this.goal.target.copy(point ?? this.center);
    if (!point) this.goal.distance = this.#wholeDistance();
    this.isFresh = false;
  }

  /** Everything, from where it was first seen. */
  reset() {
    this.focus(null);
    Object.assign(this.goal, FIRST);
    this.#shorten();
    this.isFresh = true;
  }

  /** @param {string} side */
  look(side) {
    const angles = SIDES[side];
    if (!angles) return;
    [this.goal.azimuth, this.goal.polar] = angles;
    this.goal.polar = clamp(this.goal.polar, LEAST_POLAR, Math.PI - LEAST_POLAR);
    this.#shorten();
    this.isFresh = false;
  }

  /**
   * Follow the goal.
   *
   * @param {number} elapsed milliseconds
   * @returns {boolean} whether there is some way to go
   */
  step(elapsed) {
    const { pose, goal } = this;
    const share = 1 - Math.exp(-elapsed / DELAY);
    pose.target.lerp(goal.target, share);
    pose.azimuth += share * (goal.azimuth - pose.azimuth);
    pose.polar += share * (goal.polar - pose.polar);
    pose.distance *= (goal.distance / pose.distance) ** share;
    const isThere =
      pose.target.distanceTo(goal.target) < AT_REST * goal.distance &&
      Math.abs(goal.azimuth - pose.azimuth) < AT_REST &&
      Math.abs(goal.polar - pose.polar) < AT_REST &&
      Math.abs(goal.distance / pose.distance - 1) < AT_REST;
    if (isThere) this.settle();
    else this.#place();
    return !isThere;
  }

  /** Be at the goal at once. */
  settle() {
    this.pose = { ...this.goal, target: this.goal.target.clone() };
    this.#place();
  }

  /**
   * The ray through a place on the canvas.
   *
   * @param {number} x pixels from its left
   * @param {number} y from its top
   */
  ray(x, y) {
    const place = new Vector2((2 * x) / this.width - 1, 1 - (2 * y) / this.height);
    this.caster.setFromCamera(place, this.camera);
    return this.caster.ray;
  }

  /**
   * Where a point is on the canvas: pixels from its upper left corner.
   *
   * @param {Vector3} point
   */
  project(point) {
    const { elements: m } = this.#matrix;
    const w = m[3] * point.x + m[7] * point.y + m[11] * point.z + m[15];
    const x = m[0] * point.x + m[4] * point.y + m[8] * point.z + m[12];
    const y = m[1] * point.x + m[5] * point.y + m[9] * point.z + m[13];
    return {
      x: (0.5 + (0.5 * x) / w) * this.width,
      y: (0.5 - (0.5 * y) / w) * this.height,
      isBehind: !(w > this.camera.near),
    };
  }

  /**
   * Size of a pixel at a point.
   *
   * @param {Vector3} point
   */
  pixelAt(point) {
    const depth = point.clone().applyMatrix4(this.camera.matrixWorldInverse).z;
    return (2 * Math.abs(depth) * Math.tan((FOV * Math.PI) / 360)) / this.height;
  }

  #wholeDistance() {
    const half = (FOV * Math.PI) / 360;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * this.camera.aspect));
    return (MARGIN * this.radius) / Math.sin(narrow);
  }

  /** The same angle, less than half a turn away. */
  #shorten() {
    const turns = Math.round((this.pose.azimuth - this.goal.azimuth) / (2 * Math.PI));
    this.goal.azimuth += 2 * Math.PI * turns;
  }

  #place() {
    const { target, distance, azimuth, polar } = this.pose;
    const away = new Vector3().setFromSphericalCoords(distance, polar, azimuth);
    this.camera.position.copy(target).add(away);
    this.camera.lookAt(target);
    const center = this.camera.position.distanceTo(this.center);
    const most = 1.1 * this.radius + this.spread;
    this.camera.far = center + most;
    this.camera.near = Math.max(center - most, distance * 0.01, this.camera.far * 1e-5);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.#matrix.multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
  }
}

/**
 * @param {number} value
 * @param {number} least
 * @param {number} most
 */
function clamp(value, least, most) {
  return Math.min(Math.max(value, least), most);
}
