/** The keys and gestures, on one page. */

import { iconButton } from "./controls.js";
import { element } from "./element.js";

/** @type {[string, string][]} */
const GESTURES = [
  ["Drag", "Paint"],
  ["Drag beside the model", "Turn the view"],
  ["Right or Alt drag", "Turn the view"],
  ["Shift right drag", "Move the view"],
  ["Wheel", "Nearer or farther"],
  ["Alt click", "Take the colour; a clone's source"],
  ["Two fingers", "Turn, move and zoom"],
];

/** @param {readonly import("./shortcuts.js").Shortcut[]} table */
export function helpDialog(table) {
  const groups = new Map(
    /** @type {[string, [string, string][]][]} */ ([["Mouse, pen and fingers", GESTURES]]),
  );
  for (const one of table) {
    const rows = groups.get(one.group) ?? [];
    groups.set(one.group, [...rows, [keyWords(one.keys), one.words]]);
  }
  const close = iconButton({ icon: "close", label: "Close", onclick: () => node.close() });
  const node = element(
    "dialog",
    { class: "help", "aria-label": "Keys and gestures" },
    element("header", {}, element("h2", {}, "Keys and gestures"), close),
    element(
      "div",
      { class: "help-groups" },
      [...groups].map(([group, rows]) => section(group, rows)),
    ),
  );
  node.addEventListener("click", (event) => event.target === node && node.close());
  node.addEventListener("keydown", (event) => {
    if (event.key !== "?") return;
    event.preventDefault();
    node.close();
  });
  return { node, open: () => node.showModal() };
}

/** @param {string} title @param {[string, string][]} rows */
function section(title, rows) {
  return element(
    "section",
    {},
    element("h3", {}, title),
    element(
      "dl",
      {},
      rows.map(([key, words]) =>
        element(
          "div",
          {},
          element(
            "dt",
            {},
            key.split("  ").map((one) => element("kbd", {}, one)),
          ),
          element("dd", {}, words),
        ),
      ),
    ),
  );
}

/** @param {string[]} keys */
function keyWords(keys) {
  if (keys.length > 2)
    return `${keys[0]} … ${keys.at(-1)?.replace("Shift+", "")}`.replaceAll("+", " ");
  return keys[0].replaceAll("+", " ").replace("PageUp", "Page up").replace("PageDown", "Page down");
}
