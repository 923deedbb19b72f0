/** The export menu: every format the server writes; what was written is offered as a download. */

import { toast } from "../store.js";
import { iconButton } from "./controls.js";
import { element } from "./element.js";
import { menu } from "./menu.js";
import { sentenceOf } from "./notices.js";

/** @typedef {{suffix: string, words: string}} Format */

/**
 * @param {import("../store.js").Store} store
 * @param {import("../actions.js").Session} session
 * @param {import("../actions.js").Actions} actions
 */
export function exportMenu(store, session, actions) {
  const facts = store.get().facts ?? {};
  const formats = /** @type {Format[]} */ (facts.exports ?? []);
  const stem = String(facts.name ?? "texture").replace(/\.\w+$/, "");
  let busy = "";
  /** @type {import("../actions.js").Written | null} */
  let written = null;
  const write = async (/** @type {Format} */ { suffix }) => {
    if (busy) return;
    busy = suffix;
    made.redraw();
    try {
      actions.settle();
      written = await session.export(stem + suffix);
      download(written.url, written.name);
    } catch (error) {
      const { what, fix } = /** @type {any} */ (error) ?? {};
      toast(store, { what: what ?? `The ${suffix} file could not be written`, fix: fix ?? "" });
    }
    busy = "";
    made.redraw();
  };
  const row = (/** @type {Format} */ format) => {
    const [title, ...rest] = format.words.split(": ");
    const name = rest.length ? title : format.suffix.slice(1).toUpperCase();
    const words = rest.length ? rest.join(": ") : title;
    return element(
      "button",
      {
        type: "button",
        class: "menu-row",
        onclick: () => void write(format),
        disabled: busy !== "",
      },
      element("span", { class: "menu-key" }, format.suffix.slice(1).toUpperCase()),
      element("span", {}, element("strong", {}, name), element("small", {}, words)),
      busy === format.suffix
        ? element("span", { class: "spinner", role: "status", "aria-label": "Writing" })
        : null,
    );
  };
  const result = () =>
    written &&
    element(
      "div",
      { class: "menu-result", role: "status" },
      element(
        "div",
        { class: "menu-files" },
        (written.files ?? [written]).map(({ name, url }) =>
          element("a", { href: url, download: name }, name),
        ),
      ),
      element("p", {}, `${bytesWords(written.bytes)}, in the project's folder`),
      ...(written.notes ?? []).map((note) => element("p", {}, sentenceOf(note))),
    );
  const opener = iconButton({
    icon: "export",
    label: "Export",
    key: "Ctrl E",
    class: "labelled",
    onclick: () => {},
  });
  opener.append(element("span", {}, "Export"));
  const made = menu(opener, () => [...formats.map(row), result()]);
  return made;
}

/**
 * @param {string} url
 * @param {string} name
 */
function download(url, name) {
  const link = element("a", { href: url, download: name, hidden: true });
  document.body.append(link);
  link.click();
  link.remove();
}

/**
 * "2.3 MB" and the like.
 *
 * @param {number} bytes
 */
export function bytesWords(bytes) {
  const units = ["bytes", "kB", "MB", "GB", "TB"];
  const power = Math.min(Math.floor(Math.log10(Math.max(bytes, 1)) / 3), units.length - 1);
  const number = bytes / 1000 ** power;
  return `${power && number < 10 ? number.toFixed(1) : Math.round(number)} ${units[power]}`;
}
