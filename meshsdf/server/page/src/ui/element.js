/** DOM without a framework: one function that builds an element. */

/** @typedef {Node | string | null | false | undefined} Child */

/**
 * Build an element.
 *
 * Names beginning with "on" are listeners, "data-", "aria-" and what the element has no property
 * for are attributes, the rest properties. `vars` are custom properties for style sheets.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} [properties]
 * @param {...(Child | Child[])} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null) continue;
    if (name === "vars") setVars(node, value);
    else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name === "class") node.className = value;
    else if (name.includes("-") || !(name in node)) setAttribute(node, name, value);
    else Reflect.set(node, name, value);
  }
  node.append(...children.flat().filter(isChild));
  return node;
}

/**
 * Set custom properties, by the CSSOM, which a strict content security policy allows.
 *
 * @param {HTMLElement} node
 * @param {Record<string, string | number>} vars
 */
export function setVars(node, vars) {
  for (const [name, value] of Object.entries(vars)) {
    node.style.setProperty(`--${name}`, String(value));
  }
}

/**
 * @param {Element} node
 * @param {string} name
 * @param {any} value false: no such attribute, but "false" for aria
 */
export function setAttribute(node, name, value) {
  if (value === false && !name.startsWith("aria-")) node.removeAttribute(name);
  else node.setAttribute(name, value === true && !name.startsWith("aria-") ? "" : String(value));
}

/**
 * @param {Child} child
 * @returns {child is Node | string}
 */
function isChild(child) {
  return child !== null && child !== undefined && child !== false;
}

/**
 * Put other children in the place of all.
 *
 * @param {Element} node
 * @param {...(Child | Child[])} children
 */
export function fill(node, ...children) {
  node.replaceChildren(...children.flat().filter(isChild));
}

/**
 * Run at most once a frame, with the newest arguments.
 *
 * @template {any[]} A
 * @param {(...args: A) => void} fn
 * @returns {(...args: A) => void}
 */
export function oncePerFrame(fn) {
  /** @type {A | null} */
  let waiting = null;
  return (...args) => {
    if (!waiting) {
      requestAnimationFrame(() => {
        const newest = /** @type {A} */ (waiting);
        waiting = null;
        fn(...newest);
      });
    }
    waiting = args;
  };
}
