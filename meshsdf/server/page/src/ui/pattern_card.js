/** The pattern card: solid textures that fill a layer, and change under one's hand. */

import { createLive, quickLevel } from "../live.js";
import { activeLayer, toast } from "../store.js";
import { card } from "./card.js";
import { button, sentence } from "./controls.js";
import { element, fill } from "./element.js";
import { parameterField } from "./parameter_fields.js";

/** @typedef {import("./parameter_fields.js").Parameter} Parameter */

export class PatternCard {
  /**
   * @param {import("../store.js").Store} store
   * @param {import("../actions.js").Session} session
   * @param {import("../actions.js").Actions} actions
   */
  constructor(store, session, actions) {
    this.store = store;
    this.actions = actions;
    this.facts = store.get().facts ?? {};
    this.patterns = patternsOf(this.facts);
    this.kind = Object.keys(this.patterns)[0];
    /** @type {Record<string, Record<string, any>>} */
    this.chosen = {};
    this.filled = -1; // the layer that follows the controls
    this.live = createLive(store, session, actions);
    this.chips = Object.keys(this.patterns).map((name) => this.#chip(name));
    this.fields = element("div", { class: "rows" });
    this.into = button("", () => this.#apply(store.get().layer), "primary");
    const words = "Changes show at once, and finely when you pause.";
    this.hint = element("p", { class: "hint", role: "status" }, words);
    this.node = this.#build();
    this.#draw();
    this.#show();
    this.#listen();
  }

  #build() {
    const intoNew = button("New layer", () => this.#applyNew());
    const label = { class: "chip-grid", role: "group", "aria-label": "Kind of pattern" };
    return card(
      { name: "pattern", title: "Pattern", isOpen: false },
      element("div", label, this.chips),
      element("div", { class: "row buttons" }, this.into, intoNew),
      this.hint,
      this.fields,
    ).node;
  }

  /** @param {string} name */
  #chip(name) {
    const onclick = () => {
      this.kind = name;
      this.#draw();
      if (this.filled >= 0) this.#apply(this.filled);
    };
    const label = sentence(name);
    return element(
      "button",
      { type: "button", class: "chip-button wide", "data-kind": name, onclick },
      label,
    );
  }

  #listen() {
    this.store.on("layer", (layer) => (layer === this.filled ? this.#show() : this.#stop()));
    this.store.on("state", () => this.#show());
    this.store.on("stroking", (is) => is && this.#stop());
    this.actions.onTurn(() => this.#stop());
  }

  get values() {
    return (this.chosen[this.kind] ??= firstValues(this.patterns[this.kind]));
  }

  /** @param {number} layer */
  #apply(layer) {
    this.filled = layer;
    const params = { layer, texture_kind: this.kind, ...this.values };
    const level = quickLevel(this.facts);
    this.live.change("bake", { ...params, level }, { ...params, level: 0 });
    this.#show();
  }

  #applyNew() {
    this.actions.addLayer("Pattern").then(
      (layer) => this.#apply(layer),
      (error) => toast(this.store, error),
    );
  }

  #draw() {
    for (const chip of this.chips) {
      chip.setAttribute("aria-pressed", String(chip.dataset.kind === this.kind));
    }
    const rows = this.patterns[this.kind].map((parameter) =>
      parameterField(parameter, this.values[parameter.name], (value) => {
        this.chosen[this.kind] = { ...this.values, [parameter.name]: value };
        if (this.filled >= 0) this.#apply(this.filled);
      }),
    );
    fill(this.fields, rows);
  }

  #show() {
    const layer = activeLayer(this.store.get());
    this.into.textContent = layer ? `Fill “${layer.name || `Layer ${layer.number}`}”` : "Fill";
    this.into.disabled = !layer;
    this.into.hidden = this.filled >= 0 && this.filled === layer?.number;
    this.hint.hidden = this.filled < 0;
  }

  #stop() {
    this.filled = -1;
    this.live.release();
    this.#show();
  }
}

/**
 * The server's patterns by name.
 *
 * @param {Record<string, any>} facts
 * @returns {Record<string, Parameter[]>}
 */
function patternsOf(facts) {
  const given = /** @type {{kind: string, parameters: Parameter[]}[]} */ (facts.procedurals ?? []);
  return Object.fromEntries(given.map((one) => [one.kind, one.parameters]));
}

/**
 * What a pattern begins with: the server's defaults.
 *
 * @param {Parameter[]} parameters
 */
function firstValues(parameters) {
  return Object.fromEntries(parameters.map((one) => [one.name, one.default]));
}
