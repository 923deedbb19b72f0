/** A button that opens a short list of things to do. */

import { element, fill } from "./element.js";
import { uniqueId } from "./controls.js";

/**
 * @param {HTMLButtonElement} opener
 * @param {() => (HTMLElement | null)[]} content built each time it opens
 */
export function menu(opener, content) {
  const id = uniqueId("menu");
  const panel = element("div", {
    class: "menu",
    id,
    role: "group",
    "aria-label": opener.getAttribute("aria-label") ?? opener.textContent ?? "",
    hidden: true,
  });
  const node = element("div", { class: "menu-holder" }, opener, panel);
  opener.setAttribute("aria-expanded", "false");
  opener.setAttribute("aria-controls", id);
  const items = () => /** @type {HTMLElement[]} */ ([...panel.querySelectorAll("button, a")]);
  const open = (/** @type {boolean} */ isOpen) => {
    panel.hidden = !isOpen;
    opener.setAttribute("aria-expanded", String(isOpen));
    if (!isOpen) return;
    fill(panel, content());
    items()[0]?.focus();
  };
  opener.addEventListener("click", () => open(Boolean(panel.hidden)));
  panel.addEventListener("keydown", (event) => {
    const way = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const all = items();
    const at = all.indexOf(/** @type {HTMLElement} */ (document.activeElement));
    all[(at + way + all.length) % all.length]?.focus();
  });
  // Caught on the document, as what had the focus may be gone after a redraw
  document.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || panel.hidden) return;
    event.preventDefault();
    open(false);
    opener.focus();
  }, { capture: true }); // prettier-ignore
  document.addEventListener("pointerdown", (event) => {
    if (!panel.hidden && !node.contains(/** @type {Node} */ (event.target))) open(false);
  });
  return { node, open, redraw: () => !panel.hidden && fill(panel, content()) };
}
