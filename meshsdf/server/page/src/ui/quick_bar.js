/** Size, opacity and colour within reach of a thumb while the panels are put away. */

import { toHex } from "../color.js";
import { COLORING, radiusRange, DABBING, setTool } from "../tool.js";
import { amountBar } from "./channel_rows.js";
import { bar, PERCENT, plainNumber } from "./controls.js";
import { unitOf } from "./brush_card.js";
import { element, setVars } from "./element.js";

/**
 * @param {import("../store.js").Store} store
 * @param {() => void} open the panels
 */
export function quickBar(store, open) {
  const { tool, facts } = store.get();
  const [least, most] = radiusRange(facts ?? {});
  const size = bar({
    label: "Size", least, most, log: true, value: tool?.radius ?? 1, words: plainNumber,
    unit: unitOf(facts), onchange: (radius) => setTool(store, { radius }),
  }); // prettier-ignore
  const opacity = bar({
    ...PERCENT, label: "Opacity", value: tool?.opacity ?? 1,
    onchange: (value) => setTool(store, { opacity: value }),
  }); // prettier-ignore
  const color = element("button", {
    type: "button",
    class: "quick-color",
    "aria-label": "Colour: open the panels",
    onclick: open,
  });
  const amount = amountBar(store);
  const node = element(
    "div",
    { class: "quick-bar", role: "group", "aria-label": "Brush" },
    color,
    size.node,
    opacity.node,
    amount.node,
  );
  const show = () => {
    const now = store.get().tool;
    if (!now) return;
    size.set(now.radius);
    opacity.set(now.opacity);
    size.node.hidden = !DABBING.includes(now.kind);
    amount.set(now.amount);
    amount.node.hidden = now.channel !== "height" || !COLORING.includes(now.kind);
    opacity.node.hidden = now.kind === "eyedropper" || !amount.node.hidden;
    color.hidden = now.channel !== "base" && now.kind !== "eyedropper";
    setVars(color, { c: toHex(now.color) });
  };
  store.on("tool", show);
  show();
  return node;
}
