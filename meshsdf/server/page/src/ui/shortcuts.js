/** The keyboard: one table that both the page and its help read. */

/**
 * @typedef {object} Shortcut
 * @property {string[]} keys such as "B", "Shift+[", "Ctrl+Z"; the first is the one that help shows
 * @property {string} words
 * @property {string} group
 * @property {(key: string) => void} run
 * @property {boolean} [repeats] whether it goes on while the key is held
 */

/** Keys whose sign depends on the layout, by their place on the keyboard. */
const PLACES = /** @type {Record<string, string>} */ ({
  BracketLeft: "[",
  BracketRight: "]",
  Slash: "/",
});

/**
 * A key press as shortcuts are written: "Ctrl+Shift+Z", "?", "Shift+[".
 *
 * @param {Pick<KeyboardEvent, "key" | "code" | "ctrlKey" | "metaKey" | "shiftKey" | "altKey">} event
 * @returns {string[]} the ways in which it can be meant, the likeliest first
 */
export function pressed(event) {
  const ctrl = event.ctrlKey || event.metaKey ? "Ctrl+" : "";
  const shift = event.shiftKey ? "Shift+" : "";
  const letter = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const digit = /^(?:Digit|Numpad)(\d)$/.exec(event.code)?.[1];
  const names = [];
  // AltGr, which some layouts need for brackets, is Ctrl and Alt at once
  if (event.altKey && event.ctrlKey && letter.length === 1) names.push(letter);
  if (event.altKey) return names.length ? names : [`Alt+${ctrl}${shift}${letter}`];
  names.push(`${ctrl}${shift}${letter}`);
  if (shift && /^[^A-Z0-9]$/.test(letter)) names.push(`${ctrl}${letter}`);
  const place = digit ?? PLACES[event.code];
  if (place) names.push(`${ctrl}${shift}${place}`);
  return names;
}

/**
 * Whether keys belong to a field that one types in.
 *
 * @param {EventTarget | null} target
 */
export function isTyping(target) {
  const node =
    /** @type {{tagName?: string, type?: string, isContentEditable?: boolean} | null} */ (target);
  if (!node?.tagName) return false;
  if (node.isContentEditable || ["TEXTAREA", "SELECT"].includes(node.tagName)) return true;
  return (
    node.tagName === "INPUT" &&
    !["range", "checkbox", "radio", "button", "color", "file"].includes(node.type ?? "text")
  );
}

/**
 * The shortcut of a key press, if it is one.
 *
 * @param {readonly Shortcut[]} table
 * @param {Parameters<typeof pressed>[0] & {repeat?: boolean, target?: EventTarget | null, isComposing?: boolean}} event
 * @returns {{shortcut: Shortcut, key: string} | null}
 */
export function findShortcut(table, event) {
  if (event.isComposing || isTyping(event.target ?? null)) return null;
  for (const key of pressed(event)) {
    const shortcut = table.find((one) => one.keys.includes(key));
    if (shortcut) return event.repeat && !shortcut.repeats ? null : { shortcut, key };
  }
  return null;
}

/** Keys that a focused control needs for itself. */
const CONTROL_KEYS = ["Enter", " ", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];

/**
 * Listen for the table's keys; none is heard while a dialog is open or someone types.
 *
 * @param {readonly Shortcut[]} table
 */
export function listen(table) {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    if (CONTROL_KEYS.includes(event.key) && isControl(event.target)) return;
    const found = findShortcut(table, event);
    if (!found) return;
    event.preventDefault();
    found.shortcut.run(found.key);
  });
}

/** @param {EventTarget | null} target */
function isControl(target) {
  return (
    target instanceof Element &&
    target.closest(
      "button, input, select, a, summary, [role=slider], [role=radiogroup], .frame",
    ) !== null
  );
}
