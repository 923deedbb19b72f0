/** The layers card: top layer first; order, names, what is shown and how strongly. */

import { activeLayer } from "../store.js";
import { createLive } from "../live.js";
import { blendModes } from "./brush_card.js";
import { card } from "./card.js";
import { bar, button, iconButton, PERCENT, select, sentence } from "./controls.js";
import { element, fill } from "./element.js";
import { dragRows } from "./drag_rows.js";
import { icon } from "./icons.js";

/** @typedef {import("../store.js").Store} Store */
/** @typedef {import("../store.js").LayerState} LayerState */
/** @typedef {import("../actions.js").Actions} Actions */

/**
 * @param {Store} store
 * @param {import("../actions.js").Session} session
 * @param {Actions} actions
 */
export function layersCard(store, session, actions) {
  const list = element("div", {
    class: "layers", role: "list", "aria-label": "Layers, top first",
  }); // prettier-ignore
  const details = layerDetails(store, session, actions);
  let signature = "";
  let isRenaming = false;
  const show = () => {
    const { state, layer } = store.get();
    const next = JSON.stringify([state?.layers, layer]);
    if (next === signature || isRenaming || list.classList.contains("dragging")) return;
    signature = next;
    const hadFocus = list.contains(document.activeElement);
    fill(
      list,
      [...(state?.layers ?? [])].reverse().map((one) => row(one, one.number === layer)),
    );
    if (!list.hasChildNodes())
      list.append(element("p", { class: "hint" }, "No layer yet: add one."));
    if (hadFocus) chosenName()?.focus();
    details.show();
  };
  const chosenName = () => /** @type {HTMLElement | null} */ (list.querySelector("[aria-current]"));
  const rename = (/** @type {LayerState} */ layer) => {
    const name = list.querySelector(`[data-layer="${layer.number}"] .layer-name`);
    if (!name || isRenaming) return;
    isRenaming = true;
    const back = () => {
      isRenaming = false;
      signature = "";
      show();
      chosenName()?.focus();
    };
    nameField(name, layer.name, (text) => {
      if (text && text !== layer.name) actions.changeLayer(layer.number, { name: text });
      back();
    });
  };
  const row = (/** @type {LayerState} */ layer, /** @type {boolean} */ isChosen) =>
    element(
      "div",
      {
        class: `layer ${layer.visible ? "" : "hidden-layer"}`, role: "listitem", "data-layer": layer.number,
        onclick: () => store.set({ layer: layer.number }), ondblclick: () => rename(layer),
      },
      element("span", { class: "grip", title: "Drag to another place" }, icon("grip")),
      element(
        "button",
        {
          type: "button", class: "layer-name", "aria-current": isChosen || undefined, tabIndex: isChosen ? 0 : -1,
          "aria-keyshortcuts": "ArrowUp ArrowDown Alt+ArrowUp Alt+ArrowDown F2 Delete Space",
        },
        layer.name || `Layer ${layer.number}`,
      ),
      layer.opacity < 1 ? element("span", { class: "faint" }, `${Math.round(100 * layer.opacity)} %`) : null,
      iconButton({
        icon: layer.visible ? "eye" : "eye-off", class: "small", label: layer.visible ? "Hide" : "Show",
        onclick: (event) => {
          event.stopPropagation();
          actions.changeLayer(layer.number, { visible: !layer.visible });
        },
      }),
    ); // prettier-ignore
  list.addEventListener("keydown", (event) => layerKeys(event, store, actions, rename));
  dragRows(list, (from, to) => {
    const all = store.get().state?.layers ?? [];
    const layer = all[all.length - 1 - from];
    if (layer) actions.changeLayer(layer.number, { place: all.length - 1 - to });
    signature = "";
    show();
  });
  store.on("state", show);
  store.on("layer", show);
  show();
  const add = iconButton({
    icon: "plus", label: "New layer", key: "N", class: "small",
    onclick: () => void actions.addLayer().catch(() => {}),
  }); // prettier-ignore
  return card({ name: "layers", title: "Layers", actions: [add] }, list, details.node).node;
}

/**
 * Opacity and mode of the chosen layer, and what can be done to it.
 *
 * @param {Store} store
 * @param {import("../actions.js").Session} session
 * @param {Actions} actions
 */
function layerDetails(store, session, actions) {
  const live = createLive(store, session, actions);
  const number = () => store.get().layer;
  const opacity = bar({
    ...PERCENT, label: "Opacity", value: 1, tip: "How strongly the layer is shown",
    onchange: (value, done) => {
      live.change("layer", { layer: number(), opacity: value });
      if (done) live.release();
    },
  }); // prettier-ignore
  const mode = select({
    label: "Mode", value: "normal",
    choices: blendModes(store.get().facts).map((one) => ({ value: one, label: sentence(one) })),
    onchange: (value) => actions.changeLayer(number(), { mode: value }),
  }); // prettier-ignore
  const drop = iconButton({
    icon: "trash",
    label: "Delete the layer",
    onclick: () => actions.dropLayer(number()),
  });
  const up = iconButton({
    icon: "up",
    label: "Move up",
    onclick: () => actions.moveLayer(number(), 1),
  });
  const down = iconButton({
    icon: "down",
    label: "Move down",
    onclick: () => actions.moveLayer(number(), -1),
  });
  const flood = button("Fill with colour", actions.fillLayer);
  flood.title = "Make the whole layer the chosen colour; undo takes it back";
  const node = element(
    "div",
    { class: "rows" },
    opacity.node,
    mode.node,
    element("div", { class: "row" }, flood, element("span", { class: "spring" }), up, down, drop),
  );
  return {
    node,
    show() {
      const layer = activeLayer(store.get());
      node.hidden = !layer;
      if (!layer) return;
      const all = store.get().state?.layers ?? [];
      if (!live.isBusy()) opacity.set(layer.opacity);
      mode.set(layer.mode);
      up.disabled = all.at(-1)?.number === layer.number;
      down.disabled = all[0]?.number === layer.number;
    },
  };
}

/**
 * @param {KeyboardEvent} event
 * @param {Store} store
 * @param {Actions} actions
 * @param {(layer: LayerState) => void} rename
 */
function layerKeys(event, store, actions, rename) {
  const layer = activeLayer(store.get());
  if (!layer || event.target instanceof HTMLInputElement || event.ctrlKey || event.metaKey) return;
  const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
  if (way && event.altKey) actions.moveLayer(layer.number, way);
  else if (way) actions.chooseLayer(way);
  else if (event.key === "F2" || event.key === "Enter") rename(layer);
  else if (event.key === "Delete") actions.dropLayer(layer.number);
  else if (event.key === " ") actions.changeLayer(layer.number, { visible: !layer.visible });
  else return;
  event.preventDefault();
  event.stopPropagation();
}

/**
 * Put a field in the place of a name.
 *
 * @param {Element} name
 * @param {string} text
 * @param {(text: string) => void} done called once, with what it was if nothing is to change
 */
function nameField(name, text, done) {
  const field = element("input", {
    type: "text", class: "layer-name", value: text, maxLength: 80, "aria-label": "Name of the layer",
  }); // prettier-ignore
  let isOpen = true;
  const close = (/** @type {string} */ found) => {
    if (!isOpen) return;
    isOpen = false;
    done(found.trim());
  };
  field.addEventListener("keydown", (event) => {
    event.stopPropagation();
    if (event.key === "Enter") close(field.value);
    if (event.key === "Escape") close(text);
  });
  field.addEventListener("blur", () => close(field.value));
  name.replaceWith(field);
  field.focus();
  field.select();
}
