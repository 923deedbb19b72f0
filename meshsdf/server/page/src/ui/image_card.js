/** The image card: choose or drop a picture, lay it on the model, and see it there at once. */

import { createLive, quickLevel } from "../live.js";
import { activeLayer, toast } from "../store.js";
import { card } from "./card.js";
import { button, iconButton, select } from "./controls.js";
import { element, fill } from "./element.js";
import {
  CONTROLS,
  firstSettings,
  projectionParams,
  PROJECTION_WORDS,
  settingField,
} from "./image_options.js";
import { openPicture } from "./picture_file.js";
import { framedPicture, PictureFrame } from "./picture_frame.js";
import { cameraParams, hullOf, plus } from "./placement.js";

/** @typedef {import("./placement.js").Vec3} Vec3 */
/** @typedef {import("./picture_file.js").Picture} Picture */

/**
 * @typedef {object} Scene what the card works with
 * @property {import("../store.js").Store} store
 * @property {import("../actions.js").Session} session
 * @property {import("../actions.js").Actions} actions
 * @property {Viewer} viewer
 * @property {HTMLElement} stage
 */

/**
 * @typedef {object} Viewer what the card needs of it
 * @property {(x: number, y: number) => {point: Vec3, normal: Vec3} | null} pick
 * @property {() => import("./placement.js").Camera} camera
 */

const CLICK = 5; // px that a click may move
const MOST_PIXELS = 2 ** 24; // of a picture, where the server names no other number
const PLACED_BY_CLICK = ["decal", "planar"];

const NOT_SHOWN = {
  what: "The browser cannot show this kind of picture",
  fix: "Lay it on in another way than from this view",
};

export class ImageCard {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    const { store, session, actions, stage } = scene;
    this.facts = store.get().facts ?? {};
    this.kinds = projectionKinds(this.facts);
    this.kind = this.kinds[0];
    this.settings = firstSettings(this.facts);
    this.live = createLive(store, session, actions);
    /** @type {Picture | null} */
    this.picture = null;
    /** @type {PictureFrame | null} */
    this.frame = null;
    this.laid = -1; // the layer that follows the controls
    this.isWorking = false;
    this.#build();
    this.#draw();
    store.on("layer", (layer) =>
      this.laid >= 0 && layer !== this.laid ? this.#stop() : this.#show(),
    );
    store.on("state", () => this.#show());
    actions.onTurn(() => this.#stop());
    onClick(stage, (x, y) => this.#click(x, y));
  }

  #build() {
    const chooser = element("input", {
      type: "file", accept: "image/*,.exr,.tif,.tiff", class: "visually-hidden", tabIndex: -1,
      "aria-label": "Picture to project",
      onchange: () => {
        const file = chooser.files?.[0];
        if (file) void this.take(file);
        chooser.value = "";
      },
    }); // prettier-ignore
    this.drop = element(
      "button",
      { type: "button", class: "drop", onclick: () => chooser.click() },
      "Drop a picture anywhere, or choose one",
    );
    this.rest = element("div", { class: "rows" }, this.#rows());
    const options = { name: "image", title: "Image", isOpen: false };
    const { node, open } = card(options, chooser, this.drop, this.rest);
    this.node = node;
    this.open = open;
  }

  #rows() {
    this.thumb = element("img", { class: "thumb", alt: "" });
    this.name = element("span", { class: "ellipsis" });
    const away = iconButton({
      icon: "close", label: "Put the picture away", class: "small", onclick: () => this.putAway(),
    }); // prettier-ignore
    this.way = select({
      label: "Lay it on", value: this.kind, onchange: (value) => this.#choose(value),
      choices: this.kinds.map((one) => ({ value: one, label: PROJECTION_WORDS[one][0] })),
    }); // prettier-ignore
    this.hint = element("p", { class: "hint" });
    this.fields = element("div", { class: "rows" });
    this.intoNew = button("Apply to a new layer", () => void this.#applyNew(), "primary");
    this.into = button("", () => void this.#apply(this.scene.store.get().layer));
    this.status = element("p", { class: "hint", role: "status" });
    return [
      element(
        "div",
        { class: "row" },
        this.thumb,
        this.name,
        element("span", { class: "spring" }),
        away,
      ),
      this.way.node,
      this.hint,
      this.fields,
      element("div", { class: "row buttons" }, this.intoNew, this.into),
      this.status,
    ];
  }

  get isPlacing() {
    return this.picture !== null;
  }

  /** @param {File} file */
  async take(file) {
    const { store, session } = this.scene;
    try {
      const picture = await openPicture(file, session);
      this.putAway();
      this.picture = picture;
      if (picture.isBlank && this.kind === "camera") this.kind = this.kinds.at(-1) ?? "camera";
      this.open?.(true);
      this.#draw();
      this.node?.scrollIntoView({ block: "nearest", behavior: "smooth" });
    } catch (error) {
      toast(store, wordsOf(error, `${file.name} cannot be read as a picture`));
    }
  }

  putAway() {
    if (this.picture) URL.revokeObjectURL(this.picture.url);
    this.picture = null;
    this.laid = -1;
    this.live.release();
    this.settings = { ...this.settings, point: null, normal: null };
    this.#draw();
  }

  /** @param {string} kind */
  #choose(kind) {
    if (this.picture?.isBlank && kind === "camera")
      toast(this.scene.store, { kind: "note", ...NOT_SHOWN });
    else this.kind = kind;
    this.laid = -1;
    this.live.release();
    this.#draw();
  }

  /** @param {Partial<import("./image_options.js").Settings>} patch */
  #change(patch) {
    this.settings = { ...this.settings, ...patch };
    this.frame?.fade(this.settings.fade);
    if (this.laid >= 0) this.#send(this.laid);
  }

  #draw() {
    const { picture, kind, settings } = this;
    this.drop?.toggleAttribute("hidden", picture !== null);
    this.rest?.toggleAttribute("hidden", picture === null);
    this.scene.store.set({ placing: picture && { kind } });
    this.frame?.remove();
    this.frame = null;
    if (!picture) return;
    this.thumb?.setAttribute("src", picture.url);
    this.name?.replaceChildren(
      `${picture.name}  ${picture.bitmap.width} × ${picture.bitmap.height}`,
    );
    this.way?.set(kind);
    this.hint?.replaceChildren(PROJECTION_WORDS[kind][1]);
    const change = (/** @type {Partial<typeof settings>} */ patch) => this.#change(patch);
    const fields = CONTROLS[kind].map((one) => settingField(one, settings, this.facts, change));
    if (this.fields) fill(this.fields, fields);
    if (kind === "camera") {
      this.frame = new PictureFrame(this.scene.stage, picture);
      this.frame.fade(settings.fade);
    }
    this.#show();
  }

  #show() {
    const { into, intoNew, status, isWorking, laid } = this;
    if (!into || !intoNew || !status) return;
    const layer = activeLayer(this.scene.store.get());
    into.textContent = `Replace “${layer?.name || "layer"}”`;
    into.hidden = !layer || laid === layer.number;
    into.disabled = intoNew.disabled = isWorking;
    const words = laid >= 0 ? "Changes show at once, and finely when you pause." : "";
    status.textContent = isWorking ? "Sending the picture …" : words;
    status.hidden = status.textContent === "";
  }

  #stop() {
    this.laid = -1;
    this.#show();
  }

  /** @param {number} x @param {number} y */
  #click(x, y) {
    if (!this.picture || !PLACED_BY_CLICK.includes(this.kind)) return;
    const hit = this.scene.viewer.pick(x, y);
    if (!hit) return;
    const point = plus(hit.point, this.facts.origin);
    this.settings = { ...this.settings, point, normal: hit.normal };
    if (this.laid >= 0) this.#send(this.laid);
    else void this.#applyNew();
  }

  async #applyNew() {
    if (this.isWorking) return;
    const name = this.picture?.name.replace(/\.\w+$/, "");
    try {
      await this.#apply(await this.scene.actions.addLayer(name));
    } catch (error) {
      toast(this.scene.store, wordsOf(error, "The layer could not be added"));
    }
  }

  /** @param {number} layer */
  async #apply(layer) {
    const { picture, frame } = this;
    if (!picture || this.isWorking) return;
    this.isWorking = true;
    this.#show();
    try {
      this.live.release();
      if (frame) await this.#applyFrame(layer, picture, frame.frame);
      else {
        picture.id ||= (await this.scene.session.upload(picture.blob)).id;
        this.laid = layer;
        this.#send(layer);
      }
    } catch (error) {
      toast(this.scene.store, wordsOf(error, "The picture could not be sent"));
    }
    this.isWorking = false;
    this.#show();
  }

  /**
   * What the frame shows, as one picture from the view's own camera.
   *
   * @param {number} layer
   * @param {Picture} picture
   * @param {import("./placement.js").Frame} frame
   */
  async #applyFrame(layer, picture, frame) {
    const { session } = this.scene;
    const camera = this.#camera();
    const hull = hullOf(frame);
    const most = this.facts.limits?.image_pixels ?? MOST_PIXELS;
    const { id } = await session.upload(await framedPicture(picture.bitmap, frame, hull, most));
    const params = { ...cameraParams(camera, hull), steepest: this.settings.steepest };
    session.operation("project", { layer, image: id, projection: "camera", level: 0, ...params });
    this.putAway();
  }

  /** @param {number} layer */
  #send(layer) {
    const { picture, kind, settings, facts } = this;
    if (!picture || kind === "camera") return;
    const ratio = picture.bitmap.height / picture.bitmap.width;
    const scene = { ratio, box: facts.box, camera: this.#camera() };
    const params = {
      layer,
      image: picture.id,
      projection: kind,
      ...projectionParams(kind, settings, scene),
    };
    this.live.change("project", { ...params, level: quickLevel(facts) }, { ...params, level: 0 });
  }

  /** The view's camera in the mesh's own coordinates. */
  #camera() {
    const camera = this.scene.viewer.camera();
    const { origin } = this.facts;
    return { ...camera, eye: plus(camera.eye, origin), target: plus(camera.target, origin) };
  }
}

/** @param {Record<string, any>} facts @returns {string[]} projections that the card has words for */
export function projectionKinds(facts) {
  const known = (facts.projections ?? []).map((/** @type {{kind: string}} */ one) => one.kind);
  return Object.keys(PROJECTION_WORDS).filter((kind) => known.includes(kind));
}

/** @param {any} error @param {string} what */
function wordsOf(error, what) {
  return { what: error?.what ?? what, fix: error?.fix ?? "" };
}

/**
 * Clicks on the view that were no drags.
 *
 * @param {HTMLElement} stage
 * @param {(x: number, y: number) => void} fn
 */
function onClick(stage, fn) {
  /** @type {PointerEvent | null} */
  let start = null;
  stage.addEventListener("pointerdown", (event) => {
    const isView = /** @type {Element} */ (event.target).tagName === "CANVAS";
    start = isView && event.button === 0 && event.isPrimary ? event : null;
  });
  stage.addEventListener("pointerup", (event) => {
    if (!start) return;
    const far = Math.hypot(event.clientX - start.clientX, event.clientY - start.clientY);
    if (far <= CLICK) fn(event.clientX, event.clientY);
    start = null;
  });
}
