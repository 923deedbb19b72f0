/** The painted model on the canvas: drawn when something changed, and only then. */

import { DoubleSide, Frustum, GLSL3, Matrix4, Mesh, RawShaderMaterial, Scene, Vector3, WebGLRenderer } from "three"; // prettier-ignore
import { requestBytes } from "../net/api.js";
import { toast } from "../store.js";
import { DABBING } from "../tool.js";
import { Cursor, MOST_CURSORS } from "./cursor.js";
import { Gestures } from "./gestures.js";
import { decodeOctree } from "./octree.js";
import { Orbit } from "./orbit.js";
import { PAINT_FRAGMENT, PAINT_VERTEX } from "./paint_shader.js";
import { PaintTexture } from "./paint_texture.js";
import { Region } from "./region.js";
import { Surface } from "./surface.js";

/** @typedef {import("../store.js").Vec3} Vec3 */
/** @typedef {import("./surface.js").Hit} Hit */

const CLAY = [0.4, 0.45, 0.52]; // linear: what is seen where nothing is painted
const MOST_RATIO = 2; // pixels of the canvas for one of the page
const REST = 250; // milliseconds without a change of the camera
const SLOW = 45; // milliseconds between frames from which on they are drawn coarser in motion
const COARSER = 0.5; // of the pixels along a side
const QUIET = 400; // milliseconds after which all is drawn once more
const LOST_FOR = 8000; // milliseconds after which a lost card is not waited for any more
const SHOWS = ["color", "flat", "normal"]; // numbers of the shader's ``show``

const NO_WEBGL = {
  what: "this browser cannot draw the model: WebGL 2 is missing or turned off",
  fix: "turn on hardware acceleration in its settings, or open the address in a current Chrome, Edge, Firefox or Safari",
};
const CARD_LOST = {
  what: "the graphics card stopped drawing",
  fix: "reload the page; nothing that was painted is lost",
};

export class View {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("../store.js").Store} store
   * @param {import("../net/session.js").Session} session
   */
  constructor(canvas, store, session) {
    this.canvas = canvas;
    this.store = store;
    this.session = session;
    const context = canvas.getContext("webgl2", {
      antialias: true,
      alpha: true,
      stencil: false,
      preserveDrawingBuffer: true, // as often only a part of it is drawn anew
      powerPreference: "high-performance",
    });
    if (!context) throw Object.assign(new Error(NO_WEBGL.what), NO_WEBGL);
    this.renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.setClearColor(0, 0);
    this.scene = new Scene();
    this.scene.matrixWorldAutoUpdate = false;
    this.cursor = new Cursor();
    /** @type {import("../net/protocol.js").Brick[][]} that came before there was a texture */
    this.early = [];
    /** @type {PaintTexture | null} */
    this.texture = null;
    /** @type {Surface | null} */
    this.surface = null;
    /** @type {Orbit | null} */
    this.orbit = null;
    /** @type {Gestures | null} */
    this.gestures = null;
    /** @type {RawShaderMaterial | null} */
    this.material = null;
    /** @type {{x: number, y: number} | null} where the pointer hovers */
    this.spot = null;
    this.region = new Region();
    /** @type {Map<number, boolean>} entries whose bricks the surface passes through, or not */
    this.passed = new Map();
    this.frame = 0;
    this.frames = 0;
    this.parts = 0; // of these, those that drew a part
    this.time = 0;
    this.isLost = false;
    this.isCoarse = false;
    this.slowFrames = 0; // in a row
    this.isCameraNew = true;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.rest = undefined;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.settling = undefined;
    /** @type {(() => void)[]} */
    this.endings = [];
    session.onBricks((bricks) => this.#take(bricks));
    this.#watch();
    session.ready.then((facts) => this.#load(facts)).catch((error) => this.#failed(error));
  }

  #watch() {
    const observer = new ResizeObserver(() => this.#resize());
    observer.observe(this.canvas.parentElement ?? this.canvas);
    this.endings.push(() => observer.disconnect());
    for (const key of /** @type {const} */ (["view", "tool", "placing"])) {
      this.endings.push(this.store.on(key, () => this.redraw()));
    }
    this.canvas.addEventListener("webglcontextlost", (event) => this.#lose(event));
    this.canvas.addEventListener("webglcontextrestored", () => this.#restore());
  }

  /** @param {import("../store.js").Facts} facts */
  async #load(facts) {
    this.store.set({ progress: { what: "Loading the model", share: null } });
    const [mesh, octree] = await Promise.all([requestBytes("/api/mesh"), requestBytes("/api/octree")]);
    this.surface = new Surface(mesh);
    this.texture = new PaintTexture(this.renderer, decodeOctree(octree));
    for (const bricks of this.early.splice(0)) this.texture.take(bricks);
    this.cursor.origin.fromArray(facts.origin ?? [0, 0, 0]);
    const [r, g, b, a] = facts.base_color ?? [0, 0, 0, 0];
    const bare = [r, g, b].map((value, n) => value * a + (1 - a) * CLAY[n]);
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: PAINT_VERTEX,
      fragmentShader: PAINT_FRAGMENT,
      side: DoubleSide,
      defines: { ...this.texture.defines, CURSORS: MOST_CURSORS },
      uniforms: {
        ...this.texture.uniforms,
        ...this.cursor.uniforms,
        show: { value: 0 },
        wireframe: { value: false },
        bare: { value: bare },
      },
    });
    const model = new Mesh(this.surface.geometry, this.material);
    model.frustumCulled = false;
    this.scene.add(model);
    this.orbit = new Orbit(this.surface.center, this.surface.radius);
    this.gestures = new Gestures({
      canvas: this.canvas,
      store: this.store,
      orbit: this.orbit,
      means: {
        session: this.session,
        hit: (x, y) => this.hit(x, y),
        pixelAt: (hit) => /** @type {Orbit} */ (this.orbit).pixelAt(hit.point),
      },
      colorAt: (hit) => this.#visibleColor(hit),
      hover: (spot) => this.#hover(spot),
      moved: () => this.turn(() => {}),
    });
    this.store.set({ progress: null });
    this.#resize();
  }

  /** @param {any} error */
  #failed(error) {
    console.error(error);
    const { what, message, fix } = error;
    const words = { what: `the model could not be shown: ${what ?? message}`, fix: fix ?? "reload the page" };
    this.store.set({ progress: null, fatal: words });
  }

  /** @param {import("../net/protocol.js").Brick[]} bricks */
  #take(bricks) {
    if (!this.texture) {
      this.early.push(bricks);
      return;
    }
    if (this.isLost) {
      for (const brick of bricks) this.texture.bricks.put(brick);
      return;
    }
    this.texture.take(bricks);
    if (this.texture.isCrowded) this.#chooseSoon();
    const { orbit, texture } = this;
    const isBare = (/** @type {number} */ entry) => this.#isBare(entry);
    if (orbit) this.region.addBricks(orbit, texture.octree, isBare, bricks);
    this.schedule();
  }

  /**
   * Whether coarser bricks show in the place of an entry. Some entries never have a brick, since they
   * only hold nodes of cells beside them: nothing of the surface lies there.
   *
   * @param {number} entry
   */
  #isBare(entry) {
    const { surface, texture } = this;
    if (!surface || !texture || texture.bricks.has(entry)) return false;
    const { octree } = texture;
    let passes = this.passed.get(entry);
    if (passes === undefined) {
      const size = 8 * octree.texel * 2 ** octree.levels[entry];
      const corner = new Vector3(...octree.bricks.subarray(3 * entry, 3 * entry + 3));
      passes = surface.passes(corner.multiplyScalar(size), size);
      this.passed.set(entry, passes);
    }
    return passes;
  }

  /** Draw all at the next chance. */
  redraw() {
    this.region.addAll();
    this.schedule();
  }

  /** Draw what is marked at the next chance. */
  schedule() {
    if (!this.frame && this.orbit && !this.isLost) {
      this.frame = requestAnimationFrame((time) => this.#tick(time));
    }
  }

  /**
   * Change where the camera should be.
   *
   * @param {(orbit: Orbit) => void} change
   */
  turn(change) {
    if (!this.orbit) return;
    change(this.orbit);
    this.isCameraNew = true;
    this.redraw();
  }

  focus() {
    this.turn((orbit) => orbit.focus(this.spot ? (this.hit(this.spot.x, this.spot.y)?.point ?? null) : null));
  }

  /** @param {number} time */
  #tick(time) {
    this.frame = 0;
    const { orbit, texture } = this;
    if (!orbit || !texture) return;
    const elapsed = this.time ? Math.min(time - this.time, 100) : 16;
    const isMoving = orbit.step(elapsed);
    this.#aim();
    if (this.isCameraNew) this.#chooseSoon();
    this.isCameraNew = isMoving;
    const isFilling = texture.fill();
    this.#pace(isMoving ? elapsed : 0);
    if (isMoving || isFilling) this.region.addAll();
    this.draw(this.region.take(orbit.width, orbit.height));
    this.time = isMoving || isFilling ? time : 0;
    if (isMoving || isFilling) this.schedule();
  }

  /**
   * Draw fewer pixels while the camera moves, if the machine is slow, and all when it stands.
   *
   * @param {number} elapsed milliseconds since the last frame of a motion; 0 if it is over
   */
  #pace(elapsed) {
    this.slowFrames = elapsed > SLOW ? this.slowFrames + 1 : 0;
    const wanted = elapsed && (this.isCoarse || this.slowFrames > 2);
    if (Boolean(wanted) === this.isCoarse) return;
    this.isCoarse = Boolean(wanted);
    this.#setRatio();
    this.region.addAll();
  }

  #setRatio() {
    const ratio = Math.min(devicePixelRatio, MOST_RATIO) * (this.isCoarse ? COARSER : 1);
    this.renderer.setPixelRatio(ratio);
  }

  /** @param {"all" | import("./region.js").Part | null} part */
  draw(part) {
    const { material, orbit, renderer } = this;
    if (!part || !material || !orbit || this.isLost) return;
    const { show, lit, wireframe } = this.store.get().view;
    const kind = show === "color" && !lit ? "flat" : show;
    material.uniforms.show.value = Math.max(SHOWS.indexOf(kind), 0);
    material.uniforms.wireframe.value = wireframe;
    clearTimeout(this.settling);
    renderer.setScissorTest(part !== "all");
    if (part !== "all") {
      renderer.setScissor(part.x, part.y, part.width, part.height);
      this.parts += 1;
      // What a part left out, such as rims that show far coarser levels, is drawn when all is quiet
      this.settling = setTimeout(() => this.redraw(), QUIET);
    }
    renderer.render(this.scene, orbit.camera);
    this.frames += 1;
  }

  /** Put the cursor where the pointer is, and tell where one looks. */
  #aim() {
    const { spot, store, orbit, texture } = this;
    if (!orbit || !texture) return;
    const { tool, view, placing, cursor } = store.get();
    const isFree = view.drag !== "orbit" && !placing;
    const hit = spot ? this.hit(spot.x, spot.y) : null;
    const pixel = hit ? orbit.pixelAt(hit.point) : 0;
    this.cursor.mark(this.region, orbit);
    const hasSize = DABBING.includes(tool?.kind ?? "");
    this.cursor.show(isFree ? hit : null, tool, pixel, hasSize);
    this.cursor.mark(this.region, orbit);
    this.canvas.dataset.cursor = hit && isFree ? "brush" : "view";
    const point = hit?.point.toArray() ?? null;
    if (hit && point) {
      store.set({ cursor: { point, normal: hit.normal.toArray(), spacing: this.spacing(hit) } });
    } else if (cursor) store.set({ cursor: null });
    if (this.isCameraNew || hit || cursor) {
      this.session.view(orbit.camera.position.toArray(), point);
    }
  }

  /** @param {{x: number, y: number} | null} spot */
  #hover(spot) {
    this.spot = spot;
    this.schedule();
  }

  #resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement ?? this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.#setRatio();
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.orbit?.resize(clientWidth, clientHeight);
    this.time = 0;
    this.turn(() => {});
    this.draw("all"); // at once, as another size clears the canvas
  }

  #chooseSoon() {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      if (!this.texture || !this.orbit || this.isLost) return;
      const { camera } = this.orbit;
      const matrix = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
      const planes = new Frustum().setFromProjectionMatrix(matrix).planes;
      const flat = planes.flatMap(({ normal, constant }) => [...normal.toArray(), constant]);
      this.texture.choose({ eye: camera.position.toArray(), planes: Float32Array.from(flat) });
      if (this.texture.missing.length) this.schedule();
    }, REST);
  }

  /** @param {Event} event */
  #lose(event) {
    event.preventDefault(); // else it never comes back
    this.isLost = true;
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.gestures?.cancelStroke();
    const timer = setTimeout(() => this.isLost && this.store.set({ fatal: CARD_LOST }), LOST_FOR);
    this.endings.push(() => clearTimeout(timer));
  }

  #restore() {
    this.isLost = false;
    try {
      this.texture?.allocate(this.renderer);
    } catch (error) {
      return this.#failed(error);
    }
    toast(this.store, { kind: "note", what: "The graphics card was reset; everything is shown again" });
    this.turn(() => {});
  }

  /**
   * @param {number} x pixels from the canvas' left
   * @param {number} y from its top
   */
  hit(x, y) {
    if (!this.orbit || !this.surface) return null;
    return this.surface.hit(this.orbit.ray(x, y));
  }

  /** @param {Hit} hit */
  look(hit) {
    return this.texture?.colorAt(hit.point.toArray(), hit.faceNormal.toArray()) ?? null;
  }

  /** @param {Hit} hit */
  spacing(hit) {
    const texture = /** @type {PaintTexture} */ (this.texture);
    return texture.octree.texel * 2 ** (this.look(hit)?.level ?? texture.octree.nLevels - 1);
  }

  /**
   * @param {Hit} hit
   * @returns {Vec3}
   */
  #visibleColor(hit) {
    const [r, g, b, a] = this.look(hit)?.color ?? [0, 0, 0, 0];
    const bare = this.material?.uniforms.bare.value ?? CLAY;
    return [r + (1 - a) * bare[0], g + (1 - a) * bare[1], b + (1 - a) * bare[2]];
  }

  dispose() {
    cancelAnimationFrame(this.frame);
    clearTimeout(this.rest);
    clearTimeout(this.settling);
    for (const end of this.endings) end();
    this.gestures?.dispose();
    this.texture?.dispose();
    this.surface?.dispose();
    this.material?.dispose();
    this.renderer.dispose();
  }
}
