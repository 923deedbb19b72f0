/**
 * What the page knows: one flat record; whoever wants to hear of a key says so.
 *
 * The session writes what the server says, the viewer what the pointer does, the panels what the
 * painter chose. Values are never changed in place: `set` puts a new one.
 */

/** @typedef {[number, number, number]} Vec3 */
/** @typedef {"connecting" | "open" | "lost" | "closed"} Connection */

/**
 * @typedef {object} LayerState
 * @property {number} number
 * @property {string} name
 * @property {number} opacity
 * @property {string} mode
 * @property {boolean} visible
 * @property {string} [kind]
 */

/** @typedef {{name: string, client?: string | null, seq: number}} HistoryStep */

/**
 * @typedef {object} ServerState
 * @property {number} seq
 * @property {LayerState[]} layers bottom first
 * @property {{done: HistoryStep[], undone: HistoryStep[]}} history
 * @property {number} painters
 * @property {number} saved
 */

/** @typedef {Record<string, any>} Facts as GET /api/project gives them */

/**
 * @typedef {object} View
 * @property {string} show which of the facts' displays
 * @property {boolean} lit
 * @property {boolean} wireframe
 * @property {boolean} relief whether heights and normals are seen as such
 * @property {"paint" | "orbit"} drag what the left button or one finger does
 * @property {"" | "source"} aim what the next tap sets
 */

/** @typedef {{id: number, kind: "error" | "note", what: string, fix: string}} Toast */

/**
 * @typedef {object} Cursor
 * @property {Vec3} point
 * @property {Vec3} normal
 * @property {number} [spacing] of the texels stored there, world units
 * @property {number} [height] finest texels
 */

/**
 * @typedef {object} State
 * @property {Connection} connection
 * @property {{what: string, fix: string} | null} closedReason
 * @property {Facts | null} facts
 * @property {ServerState | null} state
 * @property {number} saved
 * @property {number} unacked messages that are not acknowledged
 * @property {number} unackedStrokes strokes and operations among them
 * @property {number} layer
 * @property {import("./tool.js").Tool | null} tool
 * @property {View} view
 * @property {number} reach largest height there is, finest texels
 * @property {Cursor | null} cursor
 * @property {boolean} stroking
 * @property {object | null} placing
 * @property {Toast[]} toasts
 * @property {{what: string, share: number | null} | null} progress
 * @property {{what: string, fix: string} | null} fatal
 */

/**
 * @typedef {object} Store
 * @property {() => State} get
 * @property {(patch: Partial<State>) => void} set
 * @property {<K extends keyof State>(key: K, fn: (value: State[K]) => void) => () => void} on
 */

/** @type {State} */
const EMPTY = {
  connection: "connecting",
  closedReason: null,
  facts: null,
  state: null,
  saved: 0,
  unacked: 0,
  unackedStrokes: 0,
  layer: -1,
  tool: null,
  view: { show: "color", lit: true, wireframe: false, relief: true, drag: "paint", aim: "" },
  reach: 0,
  cursor: null,
  stroking: false,
  placing: null,
  toasts: [],
  progress: null,
  fatal: null,
};

/**
 * @param {Partial<State>} [initial]
 * @returns {Store}
 */
export function createStore(initial = {}) {
  /** @type {State} */
  let state = { ...EMPTY, ...initial };
  /** @type {Map<string, Set<(value: any) => void>>} */
  const listeners = new Map();
  return {
    get: () => state,
    set(patch) {
      const before = state;
      state = { ...state, ...patch };
      for (const key of /** @type {(keyof State)[]} */ (Object.keys(patch))) {
        // A listener may set the key again: the others then hear the newest value, once or twice
        if (Object.is(before[key], state[key])) continue;
        for (const fn of [...(listeners.get(key) ?? [])]) fn(state[key]);
      }
    },
    on(key, fn) {
      const fns = listeners.get(key) ?? new Set();
      listeners.set(key, fns.add(fn));
      return () => void fns.delete(fn);
    },
  };
}

const MOST_TOASTS = 4;
let lastToast = 0;

/**
 * Say something to the painter; the same words are not said twice at once.
 *
 * @param {Store} store
 * @param {{kind?: "error" | "note", what: string, fix?: string}} words
 */
export function toast(store, { kind = "error", what, fix = "" }) {
  const others = store.get().toasts.filter((one) => one.what !== what || one.fix !== fix);
  lastToast += 1;
  store.set({ toasts: [...others, { id: lastToast, kind, what, fix }].slice(-MOST_TOASTS) });
}

/**
 * The layer that is painted on, if it is still there.
 *
 * @param {State} state
 * @returns {LayerState | null}
 */
export function activeLayer(state) {
  return state.state?.layers.find((layer) => layer.number === state.layer) ?? null;
}
