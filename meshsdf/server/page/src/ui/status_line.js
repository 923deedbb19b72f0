/** The line at the bottom: what is safe on the disk, who else paints, how fine it is here. */

import { signedNumber } from "./channel_rows.js";
import { plainNumber } from "./controls.js";
import { element } from "./element.js";
import { icon } from "./icons.js";
import { unitOf } from "./brush_card.js";
import { DABBING } from "../tool.js";

/** @param {import("../store.js").Store} store */
export function statusLine(store) {
  const saved = element("span", { class: "saved", role: "status" });
  const others = element("span", { class: "others" });
  const fine = element("span", { class: "fine" });
  const node = element(
    "footer",
    { class: "status-line" },
    saved,
    others,
    element("span", { class: "spring" }),
    fine,
  );
  const show = () => {
    const state = store.get();
    saved.textContent = savedWords(state);
    saved.dataset.state = state.connection !== "open" ? "lost" : state.unacked ? "waiting" : "safe";
    const n = state.state?.painters ?? 1;
    others.hidden = n < 2;
    others.replaceChildren(icon("people"), `${n} painters`);
  };
  const showFine = () => {
    fine.textContent = fineWords(store.get());
  };
  for (const key of /** @type {const} */ (["saved", "unacked", "connection", "state"]))
    store.on(key, show);
  for (const key of /** @type {const} */ (["cursor", "tool", "facts"])) store.on(key, showFine);
  show();
  showFine();
  return node;
}

/**
 * Only what the server has acknowledged is called saved.
 *
 * @param {import("../store.js").State} state
 */
export function savedWords({ saved, unacked, unackedStrokes, connection }) {
  const sofar = saved > 0 ? `Saved up to stroke ${saved}` : "Nothing painted yet";
  if (!unacked || connection !== "open") return sofar;
  return unackedStrokes > 1 ? `${sofar}, ${unackedStrokes} under way` : `${sofar}, saving`;
}

/**
 * The size of texels where the cursor is, and of the brush in them.
 *
 * @param {import("../store.js").State} state
 */
export function fineWords({ facts, cursor, tool }) {
  if (!facts) return "";
  const unit = unitOf(facts);
  const length = (/** @type {number} */ value) => plainNumber(value) + (unit ? ` ${unit}` : "");
  const spacing = cursor?.spacing ?? facts.texel;
  const words = [];
  if (cursor?.height) words.push(`Height ${signedNumber(cursor.height)} texels`);
  words.push(`Texel ${length(spacing)}${cursor?.spacing ? " here" : ""}`);
  if (tool && DABBING.includes(tool.kind)) {
    const texels = (2 * tool.radius) / facts.texel;
    words.push(
      `brush ${length(2 * tool.radius)} across, ${texels < 10 ? texels.toFixed(1) : Math.round(texels)} finest texels`,
    );
  }
  return words.join("  ·  ");
}
