/** The painted model on the canvas: drawn when something changed, and only then. */

import { Frustum, Matrix4, Scene, WebGLRenderer } from "three";
import { requestBytes } from "../net/api.js";
import { toast } from "../store.js";
import { DABBING } from "../tool.js";
import { CARD_LOST, NO_WEBGL } from "../troubles.js";
import { Cursor } from "./cursor.js";
import { Gestures } from "./gestures.js";
import { Model } from "./model.js";
import { decodeOctree } from "./octree.js";
import { Orbit } from "./orbit.js";
import { Pace } from "./pace.js";
import { Region } from "./region.js";

/** @typedef {import("../net/protocol.js").Brick} Brick */
/** @typedef {import("../net/protocol.js").PictureName} PictureName */

const MOST_RATIO = 2; // pixels of the canvas for one of the page
const REST = 250; // milliseconds without a change of the camera
const QUIET = 400; // milliseconds after which all is drawn once more
const LOST_FOR = 8000; // milliseconds after which a lost card is not waited for any more

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
    /** @type {[Brick[], PictureName][]} that came before there was a model */
    this.early = [];
    /** @type {Model | null} */
    this.model = null;
    /** @type {Orbit | null} */
    this.orbit = null;
    /** @type {Gestures | null} */
    this.gestures = null;
    /** @type {{x: number, y: number} | null} where the pointer hovers */
    this.spot = null;
    this.region = new Region();
    this.frame = 0;
    this.frames = 0;
    this.parts = 0; // of these, those that drew a part
    this.time = 0;
    this.isLost = false;
    this.pace = new Pace();
    this.isCameraNew = true;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.rest = undefined;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.settling = undefined;
    /** @type {(() => void)[]} */
    this.endings = [];
    session.onBricks((bricks, picture) => this.#take(bricks, picture));
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
    this.endings.push(this.store.on("stroking", (is) => this.model?.hold(is)));
    this.canvas.addEventListener("webglcontextlost", (event) => this.#lose(event));
    this.canvas.addEventListener("webglcontextrestored", () => this.#restore());
  }

  /** @param {import("../store.js").Facts} facts */
  async #load(facts) {
    this.store.set({ progress: { what: "Loading the model", share: null } });
    const [mesh, octree] = await Promise.all([requestBytes("/api/mesh"), requestBytes("/api/octree")]);
    this.cursor.origin.fromArray(facts.origin ?? [0, 0, 0]);
    const model = new Model(this.renderer, mesh, decodeOctree(octree), facts, this.cursor);
    for (const [bricks, picture] of this.early.splice(0)) model.painting.take(bricks, picture);
    this.model = model;
    this.scene.add(model.object);
    this.orbit = new Orbit(model.surface.center, model.surface.radius);
    this.#tellReach();
    this.gestures = new Gestures({
      canvas: this.canvas,
      store: this.store,
      orbit: this.orbit,
      means: {
        session: this.session,
        hit: (x, y) => this.hit(x, y),
        pixelAt: (hit) => /** @type {Orbit} */ (this.orbit).pixelAt(hit.point),
      },
      colorAt: (hit) => model.visibleColor(hit),
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

  /**
   * @param {Brick[]} bricks
   * @param {PictureName} picture
   */
  #take(bricks, picture) {
    const { model, orbit, region } = this;
    if (!model) {
      this.early.push([bricks, picture]);
      return;
    }
    if (this.isLost) return model.painting.keep(bricks, picture);
    const before = model.painting.reach;
    model.painting.take(bricks, picture);
    if (model.painting.isCrowded) this.#chooseSoon();
    const isBare = (/** @type {number} */ entry) => model.isBare(entry, picture);
    const spread = Math.max(model.spread(picture), before * model.octree.texel);
    if (orbit) region.addBricks(orbit, model.octree, isBare, bricks, spread);
    if (model.painting.reach !== before) this.#tellReach();
    this.schedule();
  }

  /** Another largest height has other colours, and another legend. */
  #tellReach() {
    const reach = this.model?.painting.reach ?? 0;
    this.orbit?.grow(reach * (this.model?.octree.texel ?? 0));
    this.store.set({ reach });
    if (this.store.get().view.show === "displacement") this.region.addAll();
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
    const { orbit, model, pace } = this;
    if (!orbit || !model) return;
    const elapsed = this.time ? Math.min(time - this.time, 100) : 16;
    const isMoving = orbit.step(elapsed);
    this.#aim();
    if (this.isCameraNew) this.#chooseSoon();
    this.isCameraNew = isMoving;
    const isFilling = model.painting.fill();
    if (pace.step(isMoving ? elapsed : 0)) {
      this.#setRatio();
      this.region.addAll();
    }
    if (isMoving || isFilling) this.region.addAll();
    this.draw(this.region.take(orbit.width, orbit.height));
    this.time = isMoving || isFilling ? time : 0;
    if (isMoving || isFilling) this.schedule();
  }

  #setRatio() {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_RATIO) * this.pace.share);
  }

  /** @param {"all" | import("./region.js").Part | null} part */
  draw(part) {
    const { model, orbit, renderer } = this;
    if (!part || !model || !orbit || this.isLost) return;
    model.dress(this.store.get().view);
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
    const { spot, store, orbit, model } = this;
    if (!orbit || !model) return;
    const { tool, view, placing, cursor } = store.get();
    const isFree = view.drag !== "orbit" && !placing;
    const hit = spot ? this.hit(spot.x, spot.y) : null;
    const pixel = hit ? orbit.pixelAt(hit.point) : 0;
    const spread = model.spread("base");
    this.cursor.mark(this.region, orbit, spread);
    const hasSize = DABBING.includes(tool?.kind ?? "");
    this.cursor.show(isFree ? hit : null, tool, pixel, hasSize);
    this.cursor.mark(this.region, orbit, spread);
    this.canvas.dataset.cursor = hit && isFree ? "brush" : "view";
    const point = hit?.point.toArray() ?? null;
    if (hit && point) {
      const height = model.heightAt(hit);
      store.set({ cursor: { point, normal: hit.normal.toArray(), spacing: model.spacing(hit), height } });
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
      if (!this.model || !this.orbit || this.isLost) return;
      const { camera } = this.orbit;
      const matrix = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
      const planes = new Frustum().setFromProjectionMatrix(matrix).planes;
      const flat = planes.flatMap(({ normal, constant }) => [...normal.toArray(), constant]);
      const sight = { eye: camera.position.toArray(), planes: Float32Array.from(flat) };
      if (this.model.painting.choose(sight)) this.schedule();
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
      this.model?.painting.allocate();
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
    if (!this.orbit || !this.model) return null;
    return this.model.hit(this.orbit.ray(x, y));
  }

  dispose() {
    cancelAnimationFrame(this.frame);
    clearTimeout(this.rest);
    clearTimeout(this.settling);
    for (const end of this.endings) end();
    this.gestures?.dispose();
    this.model?.dispose();
    this.renderer.dispose();
  }
}
