/** What the page says unasked: the connection, errors, progress, and what makes it impossible. */

import { button, iconButton } from "./controls.js";
import { element, fill, setVars } from "./element.js";

const NOTE_LASTS = 6000; // ms; errors stay until they are put away
const PATIENCE = 400; // ms that a connection may take before anything is said

/** @typedef {import("../store.js").Store} Store */

/**
 * What a lost connection means for the painter.
 *
 * @param {Pick<import("../store.js").State, "connection" | "unackedStrokes" | "unacked" | "closedReason">} state
 * @returns {string} "" if there is nothing to say
 */
export function connectionWords({ connection, unackedStrokes, unacked, closedReason }) {
  const n = unackedStrokes || Math.min(unacked, 1);
  const strokes = n === 1 ? "1 stroke is" : `${n} strokes are`;
  if (connection === "lost") {
    return n
      ? `Connection lost: ${strokes} kept here and will be sent.`
      : "Connection lost. You can go on painting: strokes are kept here and will be sent.";
  }
  if (connection === "closed") {
    const why = closedReason
      ? `${sentenceOf(closedReason.what)} ${sentenceOf(closedReason.fix)}`
      : "The connection is closed.";
    return n ? `${why} ${strokes} not saved.` : why;
  }
  return "";
}

/** @param {Store} store */
export function banner(store) {
  const words = element("span", {});
  const node = element(
    "div",
    { class: "banner", role: "alert", hidden: true },
    element("span", { class: "dot" }),
    words,
  );
  const show = () => {
    const text = connectionWords(store.get());
    node.hidden = text === "";
    node.dataset.state = store.get().connection;
    if (words.textContent !== text) words.textContent = text;
  };
  const soon = () => setTimeout(show, store.get().connection === "lost" ? PATIENCE : 0);
  for (const key of /** @type {const} */ ([
    "connection",
    "unacked",
    "unackedStrokes",
    "closedReason",
  ]))
    store.on(key, soon);
  show();
  return node;
}

/** @param {Store} store */
export function toasts(store) {
  const node = element("div", { class: "toasts", role: "log", "aria-label": "Messages" });
  /** @type {Map<number, HTMLElement>} */
  const shown = new Map();
  const drop = (/** @type {number} */ id) =>
    store.set({ toasts: store.get().toasts.filter((one) => one.id !== id) });
  const show = () => {
    const all = store.get().toasts;
    for (const [id, one] of shown) {
      if (all.some((toast) => toast.id === id)) continue;
      one.remove();
      shown.delete(id);
    }
    for (const one of all) {
      if (shown.has(one.id)) continue;
      const close = iconButton({
        icon: "close",
        label: "Put away",
        class: "small",
        onclick: () => drop(one.id),
      });
      const made = element(
        "div",
        { class: `toast ${one.kind}`, role: one.kind === "error" ? "alert" : "status" },
        element(
          "div",
          {},
          element("strong", {}, sentenceOf(one.what)),
          one.fix ? element("p", {}, sentenceOf(one.fix)) : null,
        ),
        close,
      );
      shown.set(one.id, made);
      node.append(made);
      if (one.kind === "note") setTimeout(() => drop(one.id), NOTE_LASTS);
    }
  };
  store.on("toasts", show);
  show();
  return node;
}

/** @param {Store} store */
export function progress(store) {
  const words = element("span", {});
  const line = element("span", { class: "progress-line" });
  const node = element("div", { class: "progress", role: "status", hidden: true }, words, line);
  const show = () => {
    const now = store.get().progress;
    node.hidden = !now;
    if (!now) return;
    words.textContent = now.what;
    line.classList.toggle("endless", now.share === null);
    setVars(line, { share: now.share ?? 0.3 });
  };
  store.on("progress", show);
  show();
  return node;
}

/**
 * A page of words where painting is not possible.
 *
 * @param {{what: string, fix: string}} reason
 */
export function wall({ what, fix }) {
  return element(
    "div",
    { class: "wall", role: "alert" },
    element(
      "div",
      {},
      element("h1", {}, sentenceOf(what)),
      element("p", {}, sentenceOf(fix)),
      button("Try again", () => location.reload(), "primary"),
    ),
  );
}

/** @param {Store} store @param {HTMLElement} root */
export function watchFatal(store, root) {
  const show = () => {
    const { fatal } = store.get();
    if (!fatal) return;
    fill(root, wall(fatal));
    addEventListener("hashchange", () => location.reload()); // a new key in the same tab
  };
  store.on("fatal", show);
  show();
}

/**
 * The server's lower-case words as a sentence.
 *
 * @param {string} text
 */
export function sentenceOf(text) {
  const words = text.trim();
  if (!words) return "";
  return words.charAt(0).toUpperCase() + words.slice(1) + (/[.!?:]$/.test(words) ? "" : ".");
}
