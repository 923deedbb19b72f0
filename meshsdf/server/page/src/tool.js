/** What the hand holds: brush kind, size, colours; and how that becomes a brush on the wire. */

/** @typedef {import("./store.js").Vec3} Vec3 */
/** @typedef {"base" | "height" | "mask"} Channel */

/**
 * @typedef {object} Tool
 * @property {string} kind one of the facts' brush kinds, or "eyedropper"
 * @property {number} radius world units
 * @property {number} hardness
 * @property {number} flow
 * @property {number} opacity
 * @property {number} spacing in radii
 * @property {boolean} build_up
 * @property {"smooth" | "linear" | "round"} falloff
 * @property {boolean} pressure_radius whether pressure makes dabs smaller
 * @property {boolean} pressure_flow whether pressure makes dabs weaker
 * @property {Vec3} color linear
 * @property {Vec3} end_color linear; the other of the two colours, and what a gradient ends in
 * @property {Channel} channel what is painted on
 * @property {number} value painted into a mask
 * @property {number} amount of heights, finest texels; below 0 goes in
 * @property {boolean} adds whether heights are added to those below, or put in their place
 * @property {Partial<Record<Channel, Partial<Pick<Tool, "radius" | "hardness">>>>} hands sizes that
 *     were last used on the other channels
 * @property {string} blend
 * @property {{mirror: string, radial: number, axis: string, center: Vec3}} symmetry in the mesh's own coordinates
 * @property {boolean} geodesic
 * @property {number} tolerance of a fill
 * @property {"linear" | "radial"} shape of a gradient
 * @property {Vec3 | null} source where a clone takes its paint
 */

export const KINDS = ["paint", "erase", "blur", "smudge", "clone", "fill", "gradient"];

/** Kinds that lay dabs of a size. */
export const DABBING = ["paint", "erase", "blur", "smudge", "clone"];

/** Kinds that lay the chosen colour or height, so that it means something how. */
export const COLORING = ["paint", "fill", "gradient"];

/** @type {Tool} */
export const FIRST_TOOL = {
  kind: "paint",
  radius: 1,
  hardness: 0.5,
  flow: 1,
  opacity: 1,
  spacing: 0.15,
  build_up: false,
  falloff: "smooth",
  pressure_radius: true,
  pressure_flow: false,
  color: [0.7454, 0.1329, 0.0742],
  end_color: [0.8714, 0.8228, 0.7157],
  channel: "base",
  value: 0,
  amount: 1,
  adds: true,
  hands: { height: { hardness: 0.2 } },
  blend: "normal",
  symmetry: { mirror: "", radial: 1, axis: "y", center: [0, 0, 0] },
  geodesic: false,
  tolerance: 0.05,
  shape: "linear",
  source: null,
};

const LEAST_TEXELS = 0.5; // radius of the smallest brush, in finest texels
const FIRST_SHARE = 0.04; // of the box's longest side: radius of the first brush
const SHARES = /** @type {const} */ (["hardness", "flow", "opacity"]);

/**
 * Length of the longest side of the mesh's box.
 *
 * @param {import("./store.js").Facts} facts
 */
export function longestSide(facts) {
  const [low, high] = facts.box;
  return Math.max(...[0, 1, 2].map((axis) => high[axis] - low[axis]));
}

/**
 * The radii that the size slider offers, world units.
 *
 * @param {import("./store.js").Facts} facts
 * @returns {[number, number]}
 */
export function radiusRange(facts) {
  return [LEAST_TEXELS * facts.texel, Math.max(longestSide(facts) / 2, facts.texel)];
}

/**
 * The tool to begin with; `kept` is what the page remembers of earlier days, which may be anything.
 *
 * @param {import("./store.js").Facts} facts
 * @param {Partial<Tool>} [kept]
 * @returns {Tool}
 */
export function firstTool(facts, kept = {}) {
  const [least, most] = radiusRange(facts);
  const radius = facts.brush?.defaults?.radius ?? FIRST_SHARE * longestSide(facts);
  const [low, high] = facts.box;
  const center = /** @type {Vec3} */ ([0, 1, 2].map((axis) => (low[axis] + high[axis]) / 2));
  const tool = { ...FIRST_TOOL, radius, symmetry: { ...FIRST_TOOL.symmetry, center } };
  for (const name of SHARES) {
    const value = kept[name];
    if (typeof value === "number" && value >= 0 && value <= 1) tool[name] = value;
  }
  for (const name of /** @type {const} */ (["color", "end_color"])) {
    const value = kept[name];
    if (Array.isArray(value) && value.length === 3 && value.every(Number.isFinite)) {
      tool[name] = value;
    }
  }
  for (const name of /** @type {const} */ (["pressure_radius", "pressure_flow"])) {
    if (typeof kept[name] === "boolean") tool[name] = /** @type {boolean} */ (kept[name]);
  }
  tool.radius = Math.min(Math.max(tool.radius, least), most);
  return tool;
}

/**
 * What of a tool is worth remembering on another mesh, another day.
 *
 * @param {Tool} tool
 */
export function keptOf(tool) {
  const short = (/** @type {Vec3} */ color) => color.map((value) => Number(value.toFixed(5)));
  const { hardness, flow, opacity, pressure_radius, pressure_flow } = tool;
  const colors = { color: short(tool.color), end_color: short(tool.end_color) };
  return { hardness, flow, opacity, pressure_radius, pressure_flow, ...colors };
}

/** What pressure does: nothing, or from a tenth to all. */
const EVEN = [[0, 1], [1, 1]]; // prettier-ignore
const RISING = [[0, 0.1], [1, 1]]; // prettier-ignore

/**
 * The brush of a stroke as the server knows it, all but a clone's offset.
 *
 * @param {Tool} tool
 * @returns {Record<string, any>}
 */
export function brushOf(tool) {
  const { channel } = tool;
  const lays = COLORING.includes(tool.kind);
  const isHeight = channel === "height";
  const ofHeight = tool.adds ? "add" : "normal";
  return {
    kind: tool.kind,
    radius: tool.radius,
    hardness: tool.hardness,
    falloff: tool.falloff,
    flow: tool.flow,
    opacity: isHeight && lays ? 1 : tool.opacity, // the amount says it all
    build_up: tool.build_up,
    spacing: tool.spacing,
    pressure_radius: tool.pressure_radius ? RISING : EVEN,
    pressure_flow: tool.pressure_flow ? RISING : EVEN,
    color: [...tool.color, 1],
    end_color: [...(channel === "base" ? tool.end_color : endOf(tool)), 1],
    channel,
    value: isHeight ? tool.amount : tool.value,
    blend: lays && channel !== "mask" ? (isHeight ? ofHeight : tool.blend) : "normal",
    symmetry: tool.symmetry,
    geodesic: tool.geodesic,
    tolerance: tool.tolerance,
    shape: tool.shape,
  };
}

/**
 * What a gradient of another channel than colour ends in: the surface as it was, or the other mask.
 *
 * @param {Tool} tool
 * @returns {Vec3}
 */
function endOf({ channel, value }) {
  const end = channel === "mask" ? 1 - value : 0;
  return [end, end, end];
}

/**
 * Paint on another channel, with the size that was last used there.
 *
 * @param {import("./store.js").Store} store
 * @param {Channel} channel
 */
export function takeChannel(store, channel) {
  const { tool, view } = store.get();
  if (!tool || tool.channel === channel) return;
  const { radius, hardness, hands } = tool;
  const others = { ...hands, [tool.channel]: { radius, hardness } };
  setTool(store, { channel, hands: others, ...hands[channel] });
  // What is painted should be seen
  if (channel === "height" && !view.relief) store.set({ view: { ...view, relief: true } });
}

/**
 * Channels that can be painted and seen.
 *
 * @param {import("./store.js").Facts | null} facts
 * @returns {Channel[]}
 */
export function channels(facts) {
  const known = facts?.brush?.channels ?? ["base", "mask"];
  const isSeen = facts?.displays?.includes("displacement") ?? false;
  const all = /** @type {Channel[]} */ (["base", "height", "mask"]);
  return all.filter((one) => known.includes(one) && (one !== "height" || isSeen));
}

/**
 * Change the tool.
 *
 * @param {import("./store.js").Store} store
 * @param {Partial<Tool>} patch
 */
export function setTool(store, patch) {
  const tool = store.get().tool;
  if (tool) store.set({ tool: { ...tool, ...patch } });
}

/**
 * Take a colour off the picture.
 *
 * @param {import("./store.js").Store} store
 * @param {Vec3} color linear
 */
export function pickColor(store, color) {
  setTool(store, { color: [color[0], color[1], color[2]] });
}

/**
 * Set the place that a clone takes its paint from.
 *
 * @param {import("./store.js").Store} store
 * @param {Vec3} point
 */
export function setSource(store, point) {
  setTool(store, { source: [point[0], point[1], point[2]] });
  store.set({ view: { ...store.get().view, aim: "" } });
}
