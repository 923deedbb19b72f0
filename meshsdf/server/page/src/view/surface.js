/**
 * The mesh as it is drawn and hit: geometry with shading normals, and a tree of boxes over it.
 *
 * What is drawn has enough vertices to be moved by heights; what is hit is the mesh itself.
 */

import { Box3, BufferAttribute, BufferGeometry, DoubleSide, Matrix4, Ray, Vector3 } from "three";
import { MeshBVH, SAH } from "three-mesh-bvh";
import { shadedMesh } from "./corner_normals.js";
import { finerMesh, meanEdge } from "./finer_mesh.js";

const EDGE = 2; // texels between vertices, if that does not make too many
const SAH_MOST_FACES = 200_000; // above, a tree that is built faster

/**
 * @typedef {object} Hit
 * @property {Vector3} point
 * @property {Vector3} normal of length 1, as shading has it
 * @property {Vector3} faceNormal
 * @property {number} distance
 */

export class Surface {
  /**
   * @param {ArrayBuffer} buffer as GET /api/mesh gives it
   * @param {number} texel spacing of the finest texels
   */
  constructor(buffer, texel) {
    const [nVertices, nFaces] = new Uint32Array(buffer, 0, 2);
    const positions = new Float32Array(buffer, 8, 3 * nVertices);
    const faces = new Uint32Array(buffer, 8 + 12 * nVertices, 3 * nFaces);
    const shaded = shadedMesh(positions, faces);
    const finer = finerMesh(shaded, EDGE * texel);
    this.geometry = geometryOf(shaded);
    this.drawn = finer === shaded ? this.geometry : geometryOf(finer);
    this.edge = meanEdge(finer); // of what is drawn
    this.geometry.computeBoundingBox();
    this.geometry.computeBoundingSphere();
    const options = nFaces <= SAH_MOST_FACES ? { strategy: SAH } : {};
    this.tree = new MeshBVH(this.geometry, options); // puts the faces in the tree's order
    this.center = /** @type {import("three").Sphere} */ (this.geometry.boundingSphere).center;
    this.radius = /** @type {import("three").Sphere} */ (this.geometry.boundingSphere).radius || 1;
  }

  /**
   * The nearest thing that a ray meets.
   *
   * @param {Ray} ray
   * @returns {Hit | null}
   */
  hit(ray) {
    const found = this.tree.raycastFirst(ray, DoubleSide);
    if (!found?.face) return null;
    const { point, face, distance } = found;
    return { point, distance, faceNormal: face.normal.clone(), normal: this.#normalAt(point, face) };
  }

  /**
   * The place of the surface that is nearest to a point.
   *
   * @param {Vector3} point
   * @returns {Hit | null}
   */
  nearest(point) {
    const found = this.tree.closestPointToPoint(point);
    if (!found) return null;
    const [a, b, c] = [0, 1, 2].map((n) => this.#corner(3 * found.faceIndex + n));
    const { position } = this.geometry.attributes;
    const [pa, pb, pc] = [a, b, c].map((v) => new Vector3().fromBufferAttribute(position, v));
    const normal = pb.sub(pa).cross(pc.sub(pa)).normalize();
    const place = found.point.clone();
    return {
      point: place,
      distance: found.distance,
      faceNormal: normal.clone(),
      normal: this.#normalAt(place, { a, b, c, normal }),
    };
  }

  /**
   * Whether some face passes through a cube.
   *
   * @param {Vector3} corner
   * @param {number} size
   */
  passes(corner, size) {
    const box = new Box3(corner, corner.clone().addScalar(size));
    return this.tree.intersectsBox(box, new Matrix4());
  }

  /**
   * @param {Vector3} point
   * @param {{a: number, b: number, c: number, normal: Vector3}} face
   */
  #normalAt(point, { a, b, c, normal }) {
    const { position, normal: normals } = this.geometry.attributes;
    const [pa, pb, pc] = [a, b, c].map((v) => new Vector3().fromBufferAttribute(position, v));
    const weights = barycentric(point, pa, pb, pc);
    if (!weights) return normal.clone();
    const mean = new Vector3();
    [a, b, c].forEach((v, n) => {
      mean.addScaledVector(new Vector3().fromBufferAttribute(normals, v), weights[n]);
    });
    return mean.lengthSq() > 0.01 ? mean.normalize() : normal.clone();
  }

  /** @param {number} n */
  #corner(n) {
    return /** @type {BufferAttribute} */ (this.geometry.index).getX(n);
  }

  dispose() {
    this.geometry.dispose();
    this.drawn.dispose();
  }
}

/** @param {import("./corner_normals.js").Shaded} mesh */
function geometryOf({ positions, normals, away, index }) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setAttribute("away", new BufferAttribute(away, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}

/**
 * @param {Vector3} p
 * @param {Vector3} a
 * @param {Vector3} b
 * @param {Vector3} c
 * @returns {[number, number, number] | null} null where the triangle has no area
 */
function barycentric(p, a, b, c) {
  const [u, v, w] = [b.clone().sub(a), c.clone().sub(a), p.clone().sub(a)];
  const normal = u.clone().cross(v);
  const area = normal.lengthSq();
  if (!(area > 0)) return null;
  const third = u.clone().cross(w).dot(normal) / area;
  const second = w.clone().cross(v).dot(normal) / area;
  return [1 - second - third, second, third];
}
