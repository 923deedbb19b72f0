/** The brush card: only what the chosen kind of brush heeds. */

import { COLORING, DABBING, radiusRange, setTool } from "../tool.js";
import { card } from "./card.js";
import { channelRow, layRows } from "./channel_rows.js";
import { bar, button, choice, PERCENT, plainNumber, select, sentence, toggle } from "./controls.js";
import { element } from "./element.js";
import { symmetryRows } from "./symmetry_rows.js";
import { TOOL_WORDS } from "./toolbar.js";

/** @typedef {import("../store.js").Store} Store */
/** @typedef {import("../tool.js").Tool} Tool */

const DABS = DABBING;
const ALL = [...DABBING, "fill", "gradient"];

/** @param {Store} store */
export function brushCard(store) {
  const numbers = numberRows(store);
  const channel = channelRow(store);
  const lays = layRows(store);
  const choices = choiceRows(store);
  const [mirror, turns] = symmetryRows(store).map((row) => ({ ...row, kinds: [...DABS, "fill"] }));
  /** @type {Row[]} */
  const rows = [channel, ...lays, ...numbers, ...choices, mirror];
  /** @type {Row[]} */
  const more = [turns, ...moreRows(store)];
  // Hardness and flow are set less often, so they share a row
  const pair = element(
    "div",
    { class: "pair" },
    numbers.slice(-2).map((row) => row.node),
  );
  const moreNode = element(
    "details",
    { class: "more" },
    element("summary", {}, "More"),
    more.map((row) => row.node),
  );
  const hint = element("p", { class: "hint", role: "note" });
  const aim = button("Set the source", () => {
    store.set({ view: { ...store.get().view, aim: "source" } });
  });
  const made = card(
    { name: "brush", title: "Brush" },
    hint,
    aim,
    channel.node,
    ...lays.map((row) => row.node),
    ...numbers.slice(0, -2).map((row) => row.node),
    pair,
    ...[...choices, mirror].map((row) => row.node),
    moreNode,
  );
  const title = made.node.querySelector(".card-head span");
  const show = () => {
    const { tool, view } = store.get();
    if (!tool) return;
    for (const row of [...rows, ...more]) {
      row.node.hidden = !row.kinds.includes(tool.kind) || row.needs?.(tool) === false;
      row.show(tool);
    }
    pair.hidden = numbers.slice(-2).every((row) => row.node.hidden);
    moreNode.hidden = more.every((row) => row.node.hidden);
    hint.textContent = hintOf(tool, view.aim);
    hint.hidden = hint.textContent === "";
    aim.hidden = tool.kind !== "clone" || view.aim === "source";
    aim.textContent = tool.source ? "Set another source" : "Set the source";
    if (title) title.textContent = TOOL_WORDS[tool.kind][0];
  };
  store.on("tool", show);
  store.on("view", show);
  show();
  return made.node;
}

/** @typedef {{node: HTMLElement, kinds: string[], needs?: (tool: Tool) => boolean, show: (tool: Tool) => void}} Row */

/** @param {Store} store @returns {Row[]} */
function numberRows(store) {
  const facts = store.get().facts ?? {};
  const tool = /** @type {Tool} */ (store.get().tool);
  const [least, most] = radiusRange(facts);
  const size = bar({
    label: "Size", least, most, log: true, value: tool.radius, words: plainNumber,
    unit: unitOf(facts), tip: "Radius of the brush  ·  [ and ]",
    onchange: (radius) => setTool(store, { radius }),
  }); // prettier-ignore
  const share = (/** @type {"hardness" | "opacity" | "flow"} */ name, /** @type {string} */ tip) =>
    bar({
      ...PERCENT, label: sentence(name), value: tool[name], tip,
      onchange: (value) => setTool(store, { [name]: value }),
    }); // prettier-ignore
  const tolerance = bar({
    ...PERCENT, label: "Tolerance", value: tool.tolerance,
    tip: "How far colours may differ to be filled together",
    onchange: (value) => setTool(store, { tolerance: value }),
  }); // prettier-ignore
  const hardness = share(
    "hardness",
    "Share of the radius that is painted in full  ·  Shift [ and ]",
  );
  const opacity = share("opacity", "The most that a whole stroke lays on  ·  0 to 9");
  const flow = share("flow", "How much one touch lays on  ·  Shift 0 to 9");
  return [
    { node: size.node, kinds: DABS, show: (now) => size.set(now.radius) },
    {
      node: opacity.node,
      kinds: ALL,
      needs: (now) => now.channel !== "height" || !COLORING.includes(now.kind),
      show: (now) => opacity.set(now.opacity),
    },
    { node: tolerance.node, kinds: ["fill"], show: (now) => tolerance.set(now.tolerance) },
    { node: hardness.node, kinds: DABS, show: (now) => hardness.set(now.hardness) },
    { node: flow.node, kinds: DABS, show: (now) => flow.set(now.flow) },
  ];
}

/** @param {Store} store @returns {Row[]} */
function choiceRows(store) {
  const tool = /** @type {Tool} */ (store.get().tool);
  const modes = blendModes(store.get().facts);
  const shape = choice({
    label: "Shape of the gradient", value: tool.shape,
    choices: [{ value: "linear", label: "Straight" }, { value: "radial", label: "Round" }],
    onchange: (value) => setTool(store, { shape: /** @type {Tool["shape"]} */ (value) }),
  }); // prettier-ignore
  const blend = select({
    label: "Blend", value: tool.blend,
    choices: modes.map((mode) => ({ value: mode, label: sentence(mode) })),
    onchange: (value) => setTool(store, { blend: value }),
  }); // prettier-ignore
  return [
    {
      node: shape.node,
      kinds: ["gradient"],
      show: (/** @type {Tool} */ now) => shape.set(now.shape),
    },
    {
      node: blend.node,
      kinds: COLORING,
      needs: (/** @type {Tool} */ now) => now.channel === "base",
      show: (/** @type {Tool} */ now) => blend.set(now.blend),
    },
  ];
}

/** @param {Store} store @returns {Row[]} */
function moreRows(store) {
  const tool = /** @type {Tool} */ (store.get().tool);
  const stepped = (/** @type {Tool} */ now) =>
    now.build_up || ["blur", "smudge"].includes(now.kind);
  const falloff = choice({
    label: "Edge", value: tool.falloff,
    choices: [
      { value: "smooth", label: "Smooth" },
      { value: "linear", label: "Linear" },
      { value: "round", label: "Round" },
    ],
    onchange: (value) => setTool(store, { falloff: /** @type {Tool["falloff"]} */ (value) }),
  }); // prettier-ignore
  const spacing = bar({
    label: "Spacing", least: 0.02, most: 2, step: 0.01, log: true, value: tool.spacing, unit: "radii",
    onchange: (value) => setTool(store, { spacing: value }),
  }); // prettier-ignore
  const flag = (
    /** @type {"pressure_radius" | "pressure_flow" | "build_up" | "geodesic"} */ name,
    /** @type {string} */ label,
    /** @type {string} */ tip,
  ) => toggle({ label, tip, value: tool[name], onchange: (on) => setTool(store, { [name]: on }) });
  const radius = flag(
    "pressure_radius",
    "Pressure sets the size",
    "A pen pressed lightly paints small",
  );
  const strength = flag(
    "pressure_flow",
    "Pressure sets the flow",
    "A pen pressed lightly paints faint",
  );
  const buildUp = flag("build_up", "Build up", "Paint adds up where a stroke crosses itself");
  const geodesic = flag(
    "geodesic",
    "Along the surface only",
    "Do not reach across gaps to what is near in space",
  );
  return [
    { node: radius.node, kinds: DABS, show: (now) => radius.set(now.pressure_radius) },
    { node: strength.node, kinds: DABS, show: (now) => strength.set(now.pressure_flow) },
    { node: geodesic.node, kinds: DABS, show: (now) => geodesic.set(now.geodesic) },
    {
      node: buildUp.node,
      kinds: ["paint", "erase", "clone"],
      show: (now) => buildUp.set(now.build_up),
    },
    { node: spacing.node, kinds: DABS, needs: stepped, show: (now) => spacing.set(now.spacing) },
    { node: falloff.node, kinds: DABS, show: (now) => falloff.set(now.falloff) },
  ];
}

/** @param {import("../store.js").Facts | null} facts @returns {string[]} */
export function blendModes(facts) {
  return facts?.blend_modes ?? ["normal"];
}

/** @param {import("../store.js").Facts | null} facts @returns {string} the unit of lengths, or "" */
export function unitOf(facts) {
  const unit = facts?.units ?? "";
  return typeof unit === "string" && !["", "unit", "units", "unknown"].includes(unit) ? unit : "";
}

/** @param {Tool} tool @param {string} aim */
function hintOf(tool, aim) {
  if (tool.kind === "eyedropper") return "Drag over the model to take its colour.";
  if (tool.kind === "fill") return "Click to fill connected paint of like colour.";
  if (tool.kind === "gradient") return "Drag from the first colour to the second.";
  if (tool.kind !== "clone") return "";
  if (aim === "source") return "Now click on the model where the paint is to come from.";
  return tool.source ? "" : "Alt-click on the model where the paint is to come from.";
}
