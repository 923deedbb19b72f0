/** The bar at the top: what is painted, how it is seen, history, export, help. */

import { iconButton, choice } from "./controls.js";
import { element } from "./element.js";
import { exportMenu } from "./export_menu.js";
import { menu } from "./menu.js";

const SHOWN = [
  { value: "color", label: "Colour", tip: "The layers' colours" },
  { value: "normal", label: "Normals", tip: "Where the surface looks, heights included" },
  { value: "displacement", label: "Height", tip: "Heights of the layers" },
];

/**
 * @param {import("../store.js").Store} store
 * @param {import("../actions.js").Session} session
 * @param {import("../actions.js").Actions} actions
 * @param {{focus: () => void, resetView: () => void, look?: (side: string) => void}} viewer
 * @param {{help: () => void, panels: () => void}} open
 */
export function topBar(store, session, actions, viewer, open) {
  const facts = store.get().facts ?? {};
  const setView = (/** @type {Partial<import("../store.js").View>} */ patch) => {
    store.set({ view: { ...store.get().view, ...patch } });
  };
  const displays = facts.displays ?? ["color", "normal"];
  const shown = choice({
    label: "What is shown", value: store.get().view.show,
    choices: SHOWN.filter((one) => displays.includes(one.value)),
    onchange: (show) => setView({ show }),
  }); // prettier-ignore
  const lit = iconButton({
    icon: "lit",
    label: "Light",
    key: "L",
    onclick: () => setView({ lit: !store.get().view.lit }),
  });
  const hasRelief = displays.includes("displacement");
  const relief = iconButton({
    icon: "relief", label: "Relief", key: "R",
    onclick: () => setView({ relief: !store.get().view.relief }),
  }); // prettier-ignore
  relief.hidden = !hasRelief;
  const wire = iconButton({
    icon: "wireframe", label: "Bricks of the octree", key: "W",
    onclick: () => setView({ wireframe: !store.get().view.wireframe }),
  }); // prettier-ignore
  const undo = iconButton({ icon: "undo", label: "Undo", key: "Ctrl Z", onclick: actions.undo });
  const redo = iconButton({
    icon: "redo",
    label: "Redo",
    key: "Ctrl Shift Z",
    onclick: actions.redo,
  });
  const help = iconButton({ icon: "help", label: "Keys", key: "?", onclick: open.help });
  const panels = iconButton({
    icon: "panels",
    label: "Panels",
    key: "P",
    class: "panels-button",
    onclick: open.panels,
  });
  const exports = exportMenu(store, session, actions);
  const show = () => {
    const { view, state } = store.get();
    shown.set(view.show);
    lit.setAttribute("aria-pressed", String(view.lit));
    relief.setAttribute("aria-pressed", String(view.relief));
    wire.setAttribute("aria-pressed", String(view.wireframe));
    undo.disabled = !state?.history.done.length;
    redo.disabled = !state?.history.undone.length;
  };
  store.on("view", show);
  store.on("state", show);
  show();
  const node = element(
    "header",
    { class: "top-bar" },
    element(
      "div",
      { class: "project" },
      element("h1", { class: "ellipsis" }, facts.name ?? ""),
      element("span", { class: "faint ellipsis" }, factsWords(facts)),
    ),
    element(
      "div",
      { class: "bar-group", role: "group", "aria-label": "View" },
      shown.node,
      lit,
      relief,
      wire,
      viewMenu(viewer).node,
    ),
    element(
      "div",
      { class: "bar-group end" },
      undo,
      redo,
      element("span", { class: "rule" }),
      exports.node,
      help,
      panels,
    ),
  );
  return { node, openExports: () => exports.open(true) };
}

/** @param {{focus: () => void, resetView: () => void, look?: (side: string) => void}} viewer */
function viewMenu(viewer) {
  const opener = iconButton({ icon: "focus", label: "Look at", onclick: () => {} });
  const row = (
    /** @type {string} */ words,
    /** @type {string} */ key,
    /** @type {() => void} */ fn,
  ) =>
    element(
      "button",
      { type: "button", class: "menu-row plain", onclick: () => (fn(), made.open(false)) },
      element("span", {}, words),
      key ? element("kbd", {}, key) : null,
    );
  const sides = ["front", "back", "left", "right", "top", "bottom"];
  const made = menu(opener, () => [
    row("What is under the cursor", "F", () => viewer.focus()),
    row("The whole model", "H", () => viewer.resetView()),
    ...(viewer.look
      ? sides.map((side) => row(`From the ${side}`, "", () => viewer.look?.(side)))
      : []),
  ]);
  return made;
}

/** @param {Record<string, any>} facts */
function factsWords(facts) {
  const number = (/** @type {number} */ n) => n.toLocaleString("en").replaceAll(",", "\u202f");
  const parts = [];
  if (facts.faces) parts.push(`${number(facts.faces)} faces`);
  if (facts.texels) parts.push(`${number(facts.texels)} texels`);
  return parts.join(", ");
}
