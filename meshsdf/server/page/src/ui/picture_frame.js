/** A picture that lies over the view, to be moved, turned and sized before it is projected. */

import { element, setVars } from "./element.js";

/** @typedef {import("./placement.js").Frame} Frame */

const FIRST_SHARE = 0.5; // of the view's shorter side
const LEAST = 24; // px
const MOST_SIDE = 4096; // px of the picture that is sent
const STEP = 4; // px that an arrow key moves, degrees that a key turns
const DEGREES = 180 / Math.PI;

export class PictureFrame {
  /**
   * @param {HTMLElement} stage what the view fills
   * @param {{bitmap: ImageBitmap, url: string}} picture
   */
  constructor(stage, { bitmap, url }) {
    this.stage = stage;
    this.ratio = bitmap.height / bitmap.width;
    const box = stage.getBoundingClientRect();
    const width = (FIRST_SHARE * Math.min(box.width, box.height)) / Math.max(this.ratio, 1);
    /** @type {Frame} */
    this.frame = { x: 0, y: 0, width, height: width * this.ratio, angle: 0 };
    this.node = this.#build(url);
    this.#put({});
    stage.append(this.node);
  }

  /** @param {string} url */
  #build(url) {
    const size = element("span", { class: "frame-handle size", title: "Drag to size" });
    const turn = element("span", {
      class: "frame-handle turn", title: "Drag to turn; with Shift by steps of 15 degrees",
    }); // prettier-ignore
    const keys = "arrow keys move it, plus and minus size it, comma and full stop turn it";
    const node = element(
      "div",
      { class: "frame", tabindex: "0", role: "group", "aria-label": `Picture to place: ${keys}` },
      element("img", { src: url, alt: "", draggable: false }),
      turn,
      size,
    );
    follow(node, (event, last) => {
      const { x, y } = this.frame;
      this.#put({ x: x + event.clientX - last.clientX, y: y + event.clientY - last.clientY });
    });
    follow(size, (event, last) => {
      const before = Math.max(Math.hypot(...this.#fromMiddle(last)), 1);
      this.#scale(Math.hypot(...this.#fromMiddle(event)) / before);
    });
    follow(turn, (event) => {
      const [x, y] = this.#fromMiddle(event);
      const angle = Math.atan2(x, -y) * DEGREES;
      this.#put({ angle: event.shiftKey ? Math.round(angle / 15) * 15 : angle });
    });
    node.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    node.addEventListener("keydown", (event) => this.#key(event));
    return node;
  }

  remove() {
    this.node.remove();
  }

  /** @param {number} opacity */
  fade(opacity) {
    setVars(this.node, { fade: opacity });
  }

  /** @param {Partial<Frame>} patch */
  #put(patch) {
    this.frame = { ...this.frame, ...patch };
    const { x, y, width, height, angle } = this.frame;
    const vars = {
      x: `${x}px`,
      y: `${y}px`,
      w: `${width}px`,
      h: `${height}px`,
      angle: `${angle}deg`,
    };
    setVars(this.node, vars);
  }

  /** @param {number} factor */
  #scale(factor) {
    const width = Math.max(this.frame.width * factor, LEAST);
    this.#put({ width, height: width * this.ratio });
  }

  /** @param {PointerEvent} event @returns {[number, number]} px */
  #fromMiddle(event) {
    const { left, top, width, height } = this.stage.getBoundingClientRect();
    const { x, y } = this.frame;
    return [event.clientX - left - width / 2 - x, event.clientY - top - height / 2 - y];
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    this.#scale(Math.exp(-event.deltaY / 800));
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const { x, y, angle } = this.frame;
    const far = event.shiftKey ? 5 * STEP : STEP;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[
      event.key
    ];
    if (way) this.#put({ x: x + way[0] * far, y: y + way[1] * far });
    else if (event.key === "+" || event.key === "=") this.#scale(1.05);
    else if (event.key === "-") this.#scale(1 / 1.05);
    else if (event.key === ",") this.#put({ angle: angle - STEP });
    else if (event.key === ".") this.#put({ angle: angle + STEP });
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}

/**
 * The picture as the whole hull shows it, clear around it.
 *
 * @param {ImageBitmap} bitmap
 * @param {Frame} frame
 * @param {{width: number, height: number}} hull px
 * @param {number} mostPixels
 * @returns {Promise<Blob>}
 */
export function framedPicture(bitmap, frame, hull, mostPixels) {
  const scale = Math.min(
    bitmap.width / frame.width, // its own pixels, no fewer and no more
    MOST_SIDE / Math.max(hull.width, hull.height),
    Math.sqrt(mostPixels / (hull.width * hull.height)),
  );
  const canvas = element("canvas", {
    width: Math.max(Math.floor(hull.width * scale), 1),
    height: Math.max(Math.floor(hull.height * scale), 1),
  });
  const context = canvas.getContext("2d");
  if (context) {
    context.imageSmoothingQuality = "high";
    context.translate(canvas.width / 2 + frame.x * scale, canvas.height / 2 + frame.y * scale);
    context.rotate(frame.angle / DEGREES);
    const [width, height] = [frame.width * scale, frame.height * scale];
    context.drawImage(bitmap, -width / 2, -height / 2, width, height);
  }
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => {
      if (blob && context) resolve(blob);
      else
        reject({ what: "The picture is too large to place", fix: "Make it smaller on the screen" });
    }, "image/png");
  });
}

/**
 * @param {HTMLElement} node
 * @param {(event: PointerEvent, last: PointerEvent) => void} fn
 */
function follow(node, fn) {
  /** @type {PointerEvent | null} */
  let last = null;
  node.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    node.setPointerCapture(event.pointerId);
    last = event;
  });
  node.addEventListener("pointermove", (event) => {
    if (!last || !node.hasPointerCapture(event.pointerId)) return;
    fn(event, last);
    last = event;
  });
  node.addEventListener("pointerup", () => (last = null));
}
