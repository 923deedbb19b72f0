/** Where a ray meets a surface that its heights have moved. */

import { Vector3 } from "three";

const MOST_STEPS = 6;
const FLATTEST = 0.15; // cosine: seen from flatter than that, a step could lead anywhere
const NEAR = 0.1; // texels: so near is there

/** @typedef {import("./surface.js").Hit} Hit */

/**
 * The place of the unmoved surface that is seen where a ray meets the moved one.
 *
 * Each step takes the surface for the plane that it moved to at the last place. It finds what is in
 * front wherever heights change slowly against the way that the ray looks along the surface.
 *
 * @param {import("./surface.js").Surface} surface
 * @param {import("three").Ray} ray
 * @param {Hit} hit of the unmoved surface
 * @param {(hit: Hit) => number} heightAt world units
 * @param {number} texel
 * @returns {Hit}
 */
export function onRelief(surface, ray, hit, heightAt, texel) {
  let found = hit;
  for (let step = 0; step < MOST_STEPS; step++) {
    const height = heightAt(found);
    const along = ray.direction.dot(found.normal);
    if ((step === 0 && height === 0) || Math.abs(along) < FLATTEST) break;
    const moved = found.point.clone().addScaledVector(found.normal, height);
    const distance = moved.sub(ray.origin).dot(found.normal) / along;
    const place = ray.at(distance, new Vector3()).addScaledVector(found.normal, -height);
    const next = surface.nearest(place);
    if (!next) break;
    const isThere = next.point.distanceTo(found.point) < NEAR * texel;
    found = { ...next, distance };
    if (isThere) break;
  }
  return found;
}
