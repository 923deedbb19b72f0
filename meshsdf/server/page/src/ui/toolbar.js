/** The slim bar of brush kinds at the left. */

import { KINDS, setTool } from "../tool.js";
import { iconButton } from "./controls.js";
import { element } from "./element.js";

/** What each kind is called, and the key that takes it. */
export const TOOL_WORDS = /** @type {Record<string, [label: string, key: string]>} */ ({
  paint: ["Paint", "B"],
  erase: ["Erase", "E"],
  blur: ["Blur", "U"],
  smudge: ["Smudge", "S"],
  clone: ["Clone", "C"],
  fill: ["Fill", "G"],
  gradient: ["Gradient", "D"],
  eyedropper: ["Eyedropper", "I"],
});
const GROUP_ENDS = ["clone", "gradient"];

/**
 * Kinds of the toolbar that the server knows.
 *
 * @param {import("../store.js").Facts | null} facts
 */
export function toolKinds(facts) {
  const known = brushKinds(facts);
  return [...KINDS.filter((kind) => known.includes(kind)), "eyedropper"];
}

/** @param {import("../store.js").Facts | null} facts @returns {string[]} */
function brushKinds(facts) {
  const kinds = facts?.brush?.kinds;
  return Array.isArray(kinds) ? kinds : KINDS;
}

/**
 * Take a tool, and remember the one before, to which the eyedropper goes back.
 *
 * @param {import("../store.js").Store} store
 * @param {string} kind
 */
export function takeTool(store, kind) {
  setTool(store, { kind });
  const { view } = store.get();
  store.set({ view: { ...view, drag: "paint", aim: "" } });
}

/** @param {import("../store.js").Store} store */
export function toolbar(store) {
  const kinds = toolKinds(store.get().facts);
  const buttons = new Map(
    kinds.map((kind) => {
      const [label, key] = TOOL_WORDS[kind];
      return [kind, iconButton({ icon: kind, label, key, onclick: () => takeTool(store, kind) })];
    }),
  );
  const orbit = iconButton({
    icon: "orbit", label: "Turn the view when dragging", key: "V", onclick: () => toggleDrag(store),
  }); // prettier-ignore
  const children = kinds.flatMap((kind) => [
    /** @type {HTMLElement} */ (buttons.get(kind)),
    GROUP_ENDS.includes(kind) ? element("span", { class: "rule" }) : null,
  ]);
  const node = element(
    "div",
    { class: "toolbar", role: "toolbar", "aria-label": "Tools", "aria-orientation": "vertical" },
    children,
    element("span", { class: "rule" }),
    orbit,
  );
  node.addEventListener("keydown", (event) => {
    const way = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const all = [...node.querySelectorAll("button")];
    const at = all.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    all[(at + way + all.length) % all.length].focus();
  });
  const show = () => {
    const { tool, view } = store.get();
    const turns = view.drag === "orbit";
    buttons.forEach((one, kind) => {
      one.setAttribute("aria-pressed", String(!turns && tool?.kind === kind));
    });
    orbit.setAttribute("aria-pressed", String(turns));
  };
  store.on("tool", show);
  store.on("view", show);
  show();
  return node;
}

/** @param {import("../store.js").Store} store */
export function toggleDrag(store) {
  const { view } = store.get();
  store.set({ view: { ...view, drag: view.drag === "orbit" ? "paint" : "orbit" } });
}
