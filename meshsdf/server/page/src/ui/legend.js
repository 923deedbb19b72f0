/** What the colours of heights mean: in texels, and in the model's own lengths. */

import { cssOf, RAMP } from "../view/ramp.js";
import { unitOf } from "./brush_card.js";
import { signedNumber } from "./channel_rows.js";
import { element, fill, setVars } from "./element.js";

/** @param {import("../store.js").Store} store */
export function legend(store) {
  const marks = element("ol", { class: "legend-marks" });
  const scale = element("div", { class: "legend-scale" });
  setVars(scale, { low: cssOf(RAMP.low), even: cssOf(RAMP.even), high: cssOf(RAMP.high) });
  const node = element(
    "div",
    { class: "legend", role: "img" },
    element("h2", {}, "Height"),
    element("div", { class: "legend-body" }, scale, marks),
  );
  const show = () => {
    const { view, reach, facts } = store.get();
    node.hidden = view.show !== "displacement";
    const rows = legendRows(reach, facts);
    fill(
      marks,
      rows.map(([texels, length]) =>
        element("li", {}, element("span", {}, texels), element("span", { class: "faint" }, length)),
      ),
    );
    scale.hidden = rows.length < 2;
    node.setAttribute("aria-label", rows.map((row) => row.join(", ")).join("; "));
  };
  for (const key of /** @type {const} */ (["view", "reach", "facts"])) store.on(key, show);
  show();
  return node;
}

/**
 * The heights at the top, the middle and the bottom of the scale, in texels and as lengths.
 *
 * @param {number} reach largest height, finest texels
 * @param {import("../store.js").Facts | null} facts
 * @returns {[string, string][]}
 */
export function legendRows(reach, facts) {
  if (!reach) return [["No heights painted yet", ""]];
  const unit = unitOf(facts);
  const texel = facts?.texel ?? 1;
  return [reach, 0, -reach].map((height) => {
    const length = signedNumber(height * texel) + (unit ? ` ${unit}` : "");
    return height ? [`${signedNumber(height)} texels`, length] : ["0", ""];
  });
}
