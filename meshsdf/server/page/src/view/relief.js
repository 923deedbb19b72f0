/** Where a ray meets a surface that its heights have moved. */

import { Vector3 } from "three";

const STEPS = 12; // through the shell that the surface may have moved in
const HALVINGS = 6; // of the step in which the ray goes in
const FLATTEST = 0.2; // cosine: seen from flatter than that, the shell is not followed on and on

/** @typedef {import("./surface.js").Hit} Hit */

/**
 * The place of the unmoved surface that is seen where a ray meets the moved one.
 *
 * The ray is followed from where the largest height would stop it: it is in as soon as it is nearer
 * to the unmoved surface than that is high there. Bumps thinner than a step may be passed by.
 *
 * @param {import("./surface.js").Surface} surface
 * @param {import("three").Ray} ray
 * @param {Hit} hit of the unmoved surface
 * @param {(hit: Hit) => number} heightAt world units
 * @param {number} reach the largest height, world units
 * @returns {Hit}
 */
export function onRelief(surface, ray, hit, heightAt, reach) {
  const along = Math.max(Math.abs(ray.direction.dot(hit.faceNormal)), FLATTEST);
  const step = reach / along / STEPS;
  const near = (/** @type {number} */ distance) => nearAt(surface, ray, distance, heightAt);
  for (let n = -STEPS; n < STEPS; n++) {
    if (n === 0 && heightAt(hit) >= 0) return hit; // the air before it was free
    const distance = hit.distance + n * step;
    if (distance < 0 || !near(distance).isIn) continue;
    return wayIn(near, distance - step, distance);
  }
  return hit;
}

/**
 * @param {(distance: number) => {place: Hit, isIn: boolean}} near
 * @param {number} out a distance at which the ray is out still
 * @param {number} into one at which it is in
 */
function wayIn(near, out, into) {
  let { place } = near(into);
  for (let n = 0; n < HALVINGS; n++) {
    const middle = (out + into) / 2;
    const found = near(middle);
    if (found.isIn) [into, place] = [middle, found.place];
    else out = middle;
  }
  return { ...place, distance: into };
}

/**
 * The unmoved surface nearest to a ray, and whether its heights reach as far as that.
 *
 * @param {import("./surface.js").Surface} surface
 * @param {import("three").Ray} ray
 * @param {number} distance
 * @param {(hit: Hit) => number} heightAt
 */
function nearAt(surface, ray, distance, heightAt) {
  const point = ray.at(distance, new Vector3());
  const place = /** @type {Hit} */ (surface.nearest(point));
  const away = point.sub(place.point);
  const side = away.dot(place.normal) < 0 ? -1 : 1;
  return { place, isIn: side * away.length() <= heightAt(place) };
}
