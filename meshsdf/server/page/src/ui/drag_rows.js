/** Rows of a list that are carried to another place, by mouse, pen or finger. */

import { setVars } from "./element.js";

const FAR_ENOUGH = 5; // px that a press must move to be a drag

/**
 * Let children of a list be dragged by their grip, or with a mouse by any part.
 *
 * @param {HTMLElement} list
 * @param {(from: number, to: number) => void} onmove places from the top
 */
export function dragRows(list, onmove) {
  list.addEventListener("pointerdown", (event) => {
    const target = /** @type {Element} */ (event.target);
    const row = target.closest("[role=listitem]");
    if (
      !(row instanceof HTMLElement) ||
      event.button !== 0 ||
      target.closest(".icon-button, input")
    )
      return;
    if (event.pointerType !== "mouse" && !target.closest(".grip")) return;
    follow(list, row, event, onmove);
  });
}

/**
 * @param {HTMLElement} list
 * @param {HTMLElement} row
 * @param {PointerEvent} start
 * @param {(from: number, to: number) => void} onmove
 */
function follow(list, row, start, onmove) {
  const rows = /** @type {HTMLElement[]} */ ([...list.children]);
  const from = rows.indexOf(row);
  const height = row.offsetHeight + 2;
  let to = from;
  let isMoving = false;
  const move = (/** @type {PointerEvent} */ event) => {
    const way = event.clientY - start.clientY;
    if (!isMoving && Math.abs(way) < FAR_ENOUGH) return;
    isMoving = true;
    list.classList.add("dragging");
    row.classList.add("carried");
    to = placeAt(from, way, height, rows.length);
    rows.forEach((one, i) => setVars(one, { shift: `${shiftOf(i, from, to) * height}px` }));
    setVars(row, { shift: `${way}px` });
  };
  const end = (/** @type {Event} */ event) => {
    for (const [name, fn] of listeners) document.removeEventListener(name, fn, true);
    list.classList.remove("dragging");
    row.classList.remove("carried");
    rows.forEach((one) => setVars(one, { shift: "0px" }));
    if (isMoving && event.type === "pointerup" && to !== from) onmove(from, to);
  };
  const cancel = (/** @type {KeyboardEvent} */ event) => event.key === "Escape" && end(event);
  const listeners = /** @type {[string, (event: any) => void][]} */ ([
    ["pointermove", move], ["pointerup", end], ["pointercancel", end], ["keydown", cancel],
  ]); // prettier-ignore
  for (const [name, fn] of listeners) document.addEventListener(name, fn, true);
}

/**
 * Where a row is dropped that was carried some way.
 *
 * @param {number} from
 * @param {number} way px
 * @param {number} height of a row
 * @param {number} n rows
 */
export function placeAt(from, way, height, n) {
  return Math.min(Math.max(from + Math.round(way / height), 0), n - 1);
}

/**
 * By how many rows another row makes way.
 *
 * @param {number} i its place
 * @param {number} from
 * @param {number} to
 */
export function shiftOf(i, from, to) {
  if (i > from && i <= to) return -1;
  return i < from && i >= to ? 1 : 0;
}
