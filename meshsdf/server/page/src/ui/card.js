/** A card of the side panel: a heading that folds what is below it, and stays so the next time. */

import { kept, keep } from "../keep.js";
import { element } from "./element.js";
import { uniqueId } from "./controls.js";
import { icon } from "./icons.js";

/**
 * @param {{name: string, title: string, isOpen?: boolean, actions?: HTMLElement[]}} options
 * @param {...(HTMLElement | null)} children
 */
export function card({ name, title, isOpen = true, actions = [] }, ...children) {
  const id = uniqueId("card");
  const body = element(
    "div",
    { class: "card-body", id, role: "group", "aria-label": title },
    children,
  );
  const head = element(
    "button",
    {
      type: "button",
      class: "card-head",
      "aria-controls": id,
      onclick: () => open(Boolean(body.hidden)),
    },
    icon("chevron"),
    element("span", {}, title),
  );
  const node = element(
    "section",
    { class: "card", "data-card": name },
    element("h2", { class: "card-title" }, head),
    actions.length ? element("div", { class: "card-actions" }, actions) : null,
    body,
  );
  /** @param {boolean} isNowOpen */
  function open(isNowOpen) {
    body.hidden = !isNowOpen;
    head.setAttribute("aria-expanded", String(isNowOpen));
    keep("cards", { ...kept("cards", {}), [name]: isNowOpen });
  }
  open(kept("cards", /** @type {Record<string, boolean>} */ ({}))[name] ?? isOpen);
  return { node, open };
}
