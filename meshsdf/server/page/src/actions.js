/** What the painter can do to the project besides painting; every panel and shortcut ends here. */

import { activeLayer } from "./store.js";

/** @typedef {import("./store.js").Store} Store */

/**
 * What an export wrote; the first of its files is the one that was asked for.
 *
 * @typedef {object} Written
 * @property {string} name
 * @property {string} url
 * @property {number} bytes of all files
 * @property {string[]} [notes]
 * @property {{name: string, url: string}[]} [files]
 */

/**
 * What the panels need of the session.
 *
 * @typedef {object} Session
 * @property {() => void} undo
 * @property {() => void} redo
 * @property {(kind: string, params: Record<string, any>, replaces?: boolean) => any} operation
 * @property {(blob: Blob) => Promise<{id: string, width: number, height: number}>} upload
 * @property {(name: string) => Promise<Written>} export
 */

const LONGEST_WAIT = 120_000; // ms for a new layer, which may come after other, long work

/**
 * @param {Store} store
 * @param {Session} session
 */
export function createActions(store, session) {
  /** @type {Set<() => void>} */
  const turned = new Set();
  /** @type {Set<() => void>} */
  const settled = new Set();
  const turn = () => turned.forEach((fn) => fn());
  const settle = () => settled.forEach((fn) => fn());
  const layers = () => store.get().state?.layers ?? [];

  /**
   * Show a change of a layer before the server's word of it, which waits for the new picture.
   *
   * @param {number} layer
   * @param {{place?: number}} patch
   */
  const show = (layer, { place, ...attributes }) => {
    const { state } = store.get();
    const at = layers().findIndex((one) => one.number === layer);
    if (!state || at < 0) return;
    const next = [...state.layers];
    const [found] = next.splice(at, 1);
    next.splice(place ?? at, 0, { ...found, ...attributes });
    store.set({ state: { ...state, layers: next } });
  };

  const actions = {
    /** @param {() => void} fn called when history is turned, so that nothing is replaced across it */
    onTurn: (fn) => void turned.add(fn),

    /** @param {() => void} fn called when all that waits to be sent must go */
    onSettle: (fn) => void settled.add(fn),

    /** Send what waits for a hand to rest; before exports, and when the page is left. */
    settle,

    undo() {
      if (!store.get().state?.history.done.length) return;
      turn();
      session.undo();
    },

    redo() {
      if (!store.get().state?.history.undone.length) return;
      turn();
      session.redo();
    },

    /**
     * Undo or redo several steps.
     *
     * @param {number} steps below 0: undo
     */
    go(steps) {
      if (steps) turn();
      for (let i = 0; i < Math.abs(steps); i++) steps < 0 ? session.undo() : session.redo();
    },

    /**
     * Put a layer on top and choose it.
     *
     * @param {string} [name]
     * @returns {Promise<number>} its number, once the server has told it
     */
    addLayer(name) {
      const known = new Set(layers().map((layer) => layer.number));
      const wanted = name ?? freeName(layers());
      const added = new Promise((resolve, reject) => {
        const stop = store.on("state", (state) => {
          const fresh = state?.layers.find((one) => !known.has(one.number) && one.name === wanted);
          if (!fresh) return;
          finish();
          store.set({ layer: fresh.number });
          resolve(fresh.number);
        });
        const finish = () => (stop(), clearTimeout(timer));
        const timer = setTimeout(() => {
          stop();
          reject({ what: "The new layer has not come yet", fix: "Wait for the connection" });
        }, LONGEST_WAIT);
      });
      settle();
      session.operation("add-layer", { name: wanted });
      return added;
    },

    /** @param {number} layer */
    dropLayer(layer) {
      const all = layers();
      const at = all.findIndex((one) => one.number === layer);
      if (at < 0) return;
      const next = all[at - 1] ?? all[at + 1];
      settle();
      session.operation("drop-layer", { layer });
      if (layer === store.get().layer) store.set({ layer: next?.number ?? -1 });
    },

    /**
     * @param {number} layer
     * @param {{name?: string, opacity?: number, mode?: string, visible?: boolean, place?: number}} patch
     * @param {boolean} [replaces]
     */
    changeLayer(layer, patch, replaces = false) {
      settle();
      session.operation("layer", { layer, ...patch }, replaces);
      show(layer, patch);
    },

    /**
     * Move a layer up or down.
     *
     * @param {number} layer
     * @param {number} way 1 is one up
     */
    moveLayer(layer, way) {
      const at = layers().findIndex((one) => one.number === layer);
      const place = Math.min(Math.max(at + way, 0), layers().length - 1);
      if (at >= 0 && place !== at) actions.changeLayer(layer, { place });
    },

    /**
     * Choose the layer above or below.
     *
     * @param {number} way 1 is one up
     */
    chooseLayer(way) {
      const all = layers();
      const at = all.findIndex((one) => one.number === store.get().layer);
      const next = all[Math.min(Math.max(at + way, 0), all.length - 1)];
      if (next) store.set({ layer: next.number });
    },

    /** Fill the chosen layer with the chosen colour. */
    fillLayer() {
      const { layer, tool } = store.get();
      if (!tool || !activeLayer(store.get())) return;
      settle();
      session.operation("fill-color", { layer, color: [...tool.color, 1] });
    },
  };
  return actions;
}

/** @typedef {ReturnType<typeof createActions>} Actions */

/**
 * "Layer 3" if there is no layer of that name yet.
 *
 * @param {{name: string}[]} layers
 */
export function freeName(layers) {
  const names = new Set(layers.map((layer) => layer.name));
  let number = layers.length + 1;
  while (names.has(`Layer ${number}`)) number += 1;
  return `Layer ${number}`;
}
