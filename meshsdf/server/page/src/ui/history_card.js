/** The history card: every step that can be taken back, and those that can be done again. */

import { card } from "./card.js";
import { element, fill } from "./element.js";
import { sentence } from "./controls.js";

/** @typedef {import("../store.js").HistoryStep} HistoryStep */

/**
 * @param {import("../store.js").Store} store
 * @param {import("../actions.js").Actions} actions
 */
export function historyCard(store, actions) {
  const list = element("ol", {
    class: "history",
    "aria-label": "Steps, oldest first",
    tabindex: "-1",
  });
  let signature = "";
  const show = () => {
    const { done, undone } = store.get().state?.history ?? { done: [], undone: [] };
    const next = JSON.stringify([done, undone]);
    if (next === signature) return;
    signature = next;
    const steps = [
      row("As it was opened", "", done.length === 0, false, () => actions.go(-done.length)),
      ...done.map((step, i) => {
        const isNow = i === done.length - 1;
        return row(stepWords(step), String(step.seq), isNow, false, () =>
          actions.go(i + 1 - done.length),
        );
      }),
      ...undone.map((step, i) =>
        row(stepWords(step), String(step.seq), false, true, () => actions.go(i + 1)),
      ),
    ];
    // All that fit are shown; the server tells of the last 200 steps
    if (done.length >= 200) steps.shift();
    fill(list, steps);
    scrollToNow(list);
  };
  store.on("state", show);
  show();
  new ResizeObserver(() => scrollToNow(list)).observe(list); // it may have been hidden until now
  return card({ name: "history", title: "History" }, list).node;
}

/** @param {HTMLElement} list */
function scrollToNow(list) {
  const now = list.querySelector("[aria-current]");
  if (!(now instanceof HTMLElement)) return;
  list.scrollTop = now.offsetTop - list.offsetTop - list.clientHeight + now.offsetHeight + 4;
}

/**
 * @param {string} words
 * @param {string} number
 * @param {boolean} isNow
 * @param {boolean} isUndone
 * @param {() => void} onclick
 */
function row(words, number, isNow, isUndone, onclick) {
  return element(
    "li",
    { class: isUndone ? "undone" : "" },
    element(
      "button",
      {
        type: "button", onclick, "aria-current": isNow ? "step" : undefined,
        title: isNow ? undefined : isUndone ? "Redo to here" : "Undo to here",
      },
      element("span", {}, words),
      element("span", { class: "faint" }, number),
    ),
  ); // prettier-ignore
}

/** What the server's kinds of operations are called here. */
const STEP_WORDS = /** @type {Record<string, string>} */ ({
  "add-layer": "New layer",
  "drop-layer": "Delete a layer",
  layer: "Change a layer",
  "fill-color": "Fill with colour",
  bake: "Pattern",
  project: "Image",
  "mesh-colors": "Colours of the mesh",
});

/** @param {HistoryStep} step */
function stepWords(step) {
  return STEP_WORDS[step.name] ?? sentence(step.name || "step");
}
