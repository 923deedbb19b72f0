/** The colour card: the two colours, the picker, swatches that stay, colours used lately. */

import { fromHex, fromPick, isLight, toHex, toPick } from "../color.js";
import { keep, kept } from "../keep.js";
import { COLORING, setTool } from "../tool.js";
import { card } from "./card.js";
import { colorSquare, hueBar } from "./color_area.js";
import { iconButton } from "./controls.js";
import { element, fill, setVars } from "./element.js";

/** @typedef {import("../color.js").Pick} Pick */

const MOST_RECENT = 9;
const MOST_SWATCHES = 45;
const FIRST_SWATCHES = [
  "#f4efe6", "#d9d2c5", "#a39c92", "#6b6660", "#2b2927", "#e0554a", "#e98a4b", "#eec05c", "#a9b665",
  "#5d9c76", "#4a9aa5", "#4f79b8", "#7d68b0", "#b8608f", "#e3a69a", "#c28f66", "#8a5a3c", "#4d3527",
]; // prettier-ignore

/** @param {import("../store.js").Store} store */
export function colorCard(store) {
  const first = store.get().tool?.color ?? [0, 0, 0];
  let pick = toPick(first);
  let shownHex = "";
  const change = (/** @type {Partial<Pick>} */ patch) => {
    pick = { ...pick, ...patch };
    shownHex = toHex(fromPick(pick));
    showPick();
    setTool(store, { color: fromPick(pick) });
  };
  const square = colorSquare(change);
  const hue = hueBar(change);
  const chips = colorChips(store);
  const hex = hexField(store);
  const swatches = swatchGrid(store);
  const recent = recentRow(store);
  const showPick = () => {
    square.set(pick);
    hue.set(pick);
  };
  const show = () => {
    const tool = store.get().tool;
    if (!tool) return;
    made.node.hidden = tool.channel !== "base" && tool.kind !== "eyedropper"; // nothing is coloured
    // The picker's own changes come back here: their hue is known better than a grey can tell
    if (toHex(tool.color) !== shownHex) {
      pick = toPick(tool.color, pick);
      shownHex = toHex(tool.color);
      showPick();
    }
    chips.show();
    hex.show();
    swatches.mark();
  };
  const add = iconButton({
    icon: "plus", label: "Keep this colour as a swatch", class: "small", onclick: swatches.add,
  }); // prettier-ignore
  const made = card(
    { name: "color", title: "Colour" },
    element("div", { class: "picker" }, square.node, hue.node),
    element("div", { class: "color-row" }, chips.node, hex.node, add),
    swatches.node,
    recent.node,
  );
  store.on("tool", show);
  store.on("stroking", (is) => is && recent.use());
  show();
  showPick();
  return made.node;
}

/** @param {import("../store.js").Store} store */
function colorChips(store) {
  const front = element("span", { class: "chip front" });
  const back = element("span", { class: "chip back" });
  const node = element(
    "button",
    {
      type: "button", class: "chips", "aria-label": "Swap the two colours", "data-tip": "Swap  ·  X",
      onclick: () => swapColors(store),
    },
    back,
    front,
  ); // prettier-ignore
  return {
    node,
    show() {
      const tool = store.get().tool;
      if (!tool) return;
      setVars(front, { c: toHex(tool.color) });
      setVars(back, { c: toHex(tool.end_color) });
    },
  };
}

/** @param {import("../store.js").Store} store */
export function swapColors(store) {
  const tool = store.get().tool;
  if (tool) setTool(store, { color: tool.end_color, end_color: tool.color });
}

/** @param {import("../store.js").Store} store */
function hexField(store) {
  const input = element("input", {
    type: "text", class: "hex", maxLength: 9, spellcheck: false, autocomplete: "off",
    "aria-label": "Colour as hexadecimal digits",
  }); // prettier-ignore
  const show = () => {
    const tool = store.get().tool;
    if (tool && document.activeElement !== input) input.value = toHex(tool.color);
    input.removeAttribute("aria-invalid");
  };
  const take = () => {
    const color = fromHex(input.value);
    if (color) setTool(store, { color });
    input.setAttribute("aria-invalid", String(!color));
  };
  input.addEventListener("focus", () => input.select());
  input.addEventListener("input", take);
  input.addEventListener("blur", show);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === "Escape") input.blur();
  });
  return { node: input, show };
}

/** @param {import("../store.js").Store} store */
function swatchGrid(store) {
  /** @type {string[]} */
  let colors = kept("swatches", FIRST_SWATCHES)
    .filter((one) => fromHex(one))
    .slice(0, MOST_SWATCHES);
  const node = element("div", { class: "swatches", role: "group", "aria-label": "Swatches" });
  const mark = () => {
    const now = toHex(store.get().tool?.color ?? [0, 0, 0]);
    for (const one of node.children) {
      one.setAttribute("aria-pressed", String(one.getAttribute("data-color") === now));
    }
  };
  const change = (/** @type {string[]} */ next) => {
    colors = next;
    keep("swatches", colors);
    draw();
  };
  const remove = (/** @type {string} */ color) => {
    const at = colors.indexOf(color);
    change(colors.filter((one) => one !== color));
    /** @type {HTMLElement | undefined} */ (
      node.children[Math.min(at, colors.length - 1)]
    )?.focus();
  };
  function draw() {
    fill(
      node,
      colors.map((color) => swatch(store, color, remove)),
    );
    mark();
  }
  draw();
  return {
    node,
    mark,
    add() {
      const color = toHex(store.get().tool?.color ?? [0, 0, 0]);
      change([...colors.filter((one) => one !== color), color].slice(-MOST_SWATCHES));
    },
  };
}

/**
 * @param {import("../store.js").Store} store
 * @param {string} color
 * @param {(color: string) => void} [remove]
 */
function swatch(store, color, remove) {
  const rgb = fromHex(color) ?? [0, 0, 0];
  return element("button", {
    type: "button", class: `swatch ${isLight(rgb) ? "light" : ""}`, vars: { c: color },
    "data-color": color, "aria-label": `Colour ${color}`, "aria-pressed": "false",
    title: remove ? `${color}  (Delete or right button takes it away)` : color,
    onclick: () => setTool(store, { color: /** @type {[number, number, number]} */ (rgb) }),
    oncontextmenu: (/** @type {Event} */ event) => {
      if (!remove) return;
      event.preventDefault();
      remove(color);
    },
    onkeydown: (/** @type {KeyboardEvent} */ event) => {
      if (!remove || (event.key !== "Delete" && event.key !== "Backspace")) return;
      event.stopPropagation();
      remove(color);
    },
  }); // prettier-ignore
}

/** @param {import("../store.js").Store} store */
function recentRow(store) {
  /** @type {string[]} */
  let colors = kept("recent", /** @type {string[]} */ ([])).filter((one) => fromHex(one));
  const row = element("div", {
    class: "swatches recent",
    role: "group",
    "aria-label": "Used lately",
  });
  const node = element("div", {}, element("h3", { class: "small-title" }, "Used lately"), row);
  const draw = () => {
    node.hidden = colors.length === 0;
    fill(
      row,
      colors.map((color) => swatch(store, color)),
    );
  };
  draw();
  return {
    node,
    /** Called when a stroke begins. */
    use() {
      const tool = store.get().tool;
      if (!tool || tool.channel !== "base" || !COLORING.includes(tool.kind)) return;
      const color = toHex(tool.color);
      if (colors[0] === color) return;
      colors = [color, ...colors.filter((one) => one !== color)].slice(0, MOST_RECENT);
      keep("recent", colors);
      draw();
    },
  };
}
