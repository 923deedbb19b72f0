/**
 * Operations that follow a control while it moves: the newest wins, one is under way at a time.
 *
 * Each takes the place of the last, so that a minute of turning a knob is one step of the history.
 * What takes long is shown coarsely at once, and finely when the hand rests or does something else.
 */

/**
 * @typedef {object} Live
 * @property {(kind: string, params: Record<string, any>, fine?: Record<string, any>) => void} change
 *     fine: other parameters, for when nothing more changes
 * @property {() => void} release the next change is a step of its own
 * @property {() => boolean} isBusy whether something waits to be sent
 */

/** @typedef {{kind: string, params: Record<string, any>}} Change */

const REST = 900; // ms without a change

/**
 * @param {import("./store.js").Store} store
 * @param {import("./actions.js").Session} session
 * @param {import("./actions.js").Actions} actions
 * @param {number} [rest] ms until the fine parameters are sent
 * @returns {Live}
 */
export function createLive(store, session, actions, rest = REST) {
  /** @type {Change | null} */
  let waiting = null;
  /** @type {Change | null} */
  let fine = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  let held = ""; // kind and layer of the last step, if it may be replaced

  const send = (/** @type {Change} */ { kind, params }) => {
    const key = `${kind} ${params.layer}`;
    const replaces = held === key;
    held = key;
    session.operation(kind, params, replaces);
  };
  const pump = () => {
    if (!waiting || store.get().unacked > 0) return;
    const next = waiting;
    waiting = null;
    send(next);
  };
  // Whatever comes next must find the newest, finest state, so nothing waits for its turn here
  const settle = () => {
    clearTimeout(timer);
    const last = fine ?? waiting;
    fine = waiting = null;
    if (last) send(last);
  };
  const release = () => {
    settle();
    held = "";
  };
  store.on("unacked", pump);
  store.on("stroking", (is) => is && release());
  actions.onSettle(settle);
  actions.onTurn(() => {
    clearTimeout(timer);
    fine = waiting = null;
    held = "";
  });
  return {
    change(kind, params, finer) {
      waiting = { kind, params };
      fine = finer ? { kind, params: finer } : null;
      clearTimeout(timer);
      if (fine) {
        timer = setTimeout(() => {
          waiting = fine;
          fine = null;
          pump();
        }, rest);
      }
      pump();
    },
    release,
    isBusy: () => waiting !== null || fine !== null,
  };
}

const QUICK = 120_000; // texels that are filled within a blink

/**
 * The finest level of detail that can be filled while a control moves; each has a quarter of the
 * texels of the one before.
 *
 * @param {Record<string, any>} facts
 */
export function quickLevel({ texels = 0, levels = 1 }) {
  const level = Math.ceil(Math.log2(Math.max(texels / QUICK, 1)) / 2);
  return Math.min(level, levels - 1);
}
