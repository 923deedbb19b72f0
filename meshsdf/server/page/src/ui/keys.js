/** Which key does what. */

import { toast } from "../store.js";
import { channels, radiusRange, setTool, takeChannel } from "../tool.js";
import { swapColors } from "./color_card.js";
import { savedWords } from "./status_line.js";
import { mirrored } from "./symmetry_rows.js";
import { takeTool, toggleDrag, toolKinds, TOOL_WORDS } from "./toolbar.js";

/** @typedef {import("../store.js").Store} Store */
/** @typedef {import("./shortcuts.js").Shortcut} Shortcut */

const SIZE_STEP = 2 ** 0.25; // four presses double the brush
const HARDNESS_STEP = 0.1;

/**
 * @param {Store} store
 * @param {import("../actions.js").Actions} actions
 * @param {{focus: () => void, resetView: () => void, cancelStroke?: () => void}} viewer
 * @param {{help: () => void, panels: () => void, exports: () => void, escape: () => void}} open
 * @returns {Shortcut[]}
 */
export function shortcutTable(store, actions, viewer, open) {
  const view = (/** @type {Partial<import("../store.js").View>} */ patch) =>
    store.set({ view: { ...store.get().view, ...patch } });
  return [
    ...toolKeys(store),
    ...brushKeys(store),
    {
      group: "Steps and layers",
      keys: ["Ctrl+Z"],
      words: "Undo",
      repeats: true,
      run: actions.undo,
    },
    {
      group: "Steps and layers",
      keys: ["Ctrl+Shift+Z", "Ctrl+Y"],
      words: "Redo",
      repeats: true,
      run: actions.redo,
    },
    {
      group: "Steps and layers",
      keys: ["N"],
      words: "New layer",
      run: () => void actions.addLayer().catch(() => {}),
    },
    {
      group: "Steps and layers",
      keys: ["PageUp"],
      words: "Layer above",
      run: () => actions.chooseLayer(1),
    },
    {
      group: "Steps and layers",
      keys: ["PageDown"],
      words: "Layer below",
      run: () => actions.chooseLayer(-1),
    },
    {
      group: "View",
      keys: ["F"],
      words: "Focus on what is under the cursor",
      run: () => viewer.focus(),
    },
    {
      group: "View",
      keys: ["H", "Home"],
      words: "See the whole model",
      run: () => viewer.resetView(),
    },
    {
      group: "View",
      keys: ["V"],
      words: "Turn the view when dragging, or paint",
      run: () => toggleDrag(store),
    },
    {
      group: "View",
      keys: ["W"],
      words: "Bricks of the octree",
      run: () => view({ wireframe: !store.get().view.wireframe }),
    },
    {
      group: "View",
      keys: ["R"],
      words: "Relief",
      run: () => view({ relief: !store.get().view.relief }),
    },
    { group: "View", keys: ["L"], words: "Light", run: () => view({ lit: !store.get().view.lit }) },
    { group: "View", keys: ["P"], words: "Hide or show the panels", run: open.panels },
    { group: "Page", keys: ["Ctrl+E"], words: "Export", run: open.exports },
    {
      group: "Page",
      keys: ["Ctrl+S"],
      words: "Ask what is saved",
      run: () =>
        toast(store, {
          kind: "note",
          what: savedWords(store.get()),
          fix: "Every stroke is saved as soon as it is painted",
        }),
    },
    { group: "Page", keys: ["?", "F1"], words: "These keys", run: open.help },
    {
      group: "Page",
      keys: ["Escape"],
      words: "Stop the stroke, put the picture away",
      run: open.escape,
    },
  ];
}

/** @param {Store} store @returns {Shortcut[]} */
function toolKeys(store) {
  return toolKinds(store.get().facts).map((kind) => ({
    group: "Tools",
    keys: [TOOL_WORDS[kind][1]],
    words: TOOL_WORDS[kind][0],
    run: () => takeTool(store, kind),
  }));
}

/** @param {Store} store @returns {Shortcut[]} */
function brushKeys(store) {
  const group = "Brush";
  const digits = [..."1234567890"];
  const resize = (/** @type {number} */ factor) => {
    const { tool, facts } = store.get();
    if (!tool || !facts) return;
    const [least, most] = radiusRange(facts);
    setTool(store, { radius: Math.min(Math.max(tool.radius * factor, least), most) });
  };
  const harden = (/** @type {number} */ way) => {
    const hardness = (store.get().tool?.hardness ?? 0) + way * HARDNESS_STEP;
    setTool(store, { hardness: Math.min(Math.max(Math.round(hardness * 100) / 100, 0), 1) });
  };
  const mirror = () => {
    const symmetry = store.get().tool?.symmetry;
    if (symmetry)
      setTool(store, { symmetry: { ...symmetry, mirror: mirrored(symmetry.mirror, "x") } });
  };
  return [
    { group, keys: ["["], words: "Smaller", repeats: true, run: () => resize(1 / SIZE_STEP) },
    { group, keys: ["]"], words: "Larger", repeats: true, run: () => resize(SIZE_STEP) },
    { group, keys: ["Shift+["], words: "Softer", repeats: true, run: () => harden(-1) },
    { group, keys: ["Shift+]"], words: "Harder", repeats: true, run: () => harden(1) },
    {
      group,
      keys: digits,
      words: "Opacity: 1 is 10 %, 0 is 100 %",
      run: (key) => setTool(store, { opacity: shareOf(key) }),
    },
    {
      group,
      keys: digits.map((one) => `Shift+${one}`),
      words: "Flow, in the same way",
      run: (key) => setTool(store, { flow: shareOf(key) }),
    },
    { group, keys: ["X"], words: "Swap the two colours, or out and in", run: () => swap(store) },
    ...(channels(store.get().facts).includes("height")
      ? [{ group, keys: ["T"], words: "Paint heights, or colour", run: () => toggleHeight(store) }]
      : []),
    { group, keys: ["M"], words: "Mirror across x", run: mirror },
  ];
}

/** @param {Store} store */
function toggleHeight(store) {
  takeChannel(store, store.get().tool?.channel === "height" ? "base" : "height");
}

/** @param {Store} store */
function swap(store) {
  const { tool } = store.get();
  if (tool?.channel === "height") setTool(store, { amount: -tool.amount });
  else swapColors(store);
}

/** @param {string} key ending in a digit */
export function shareOf(key) {
  const digit = Number(key.at(-1));
  return digit === 0 ? 1 : digit / 10;
}
