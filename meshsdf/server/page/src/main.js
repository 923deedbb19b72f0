/** The page: what is where, and who speaks with whom. */

import "./style/main.css";

import { createActions } from "./actions.js";
import { keep, kept } from "./keep.js";
import { openSession } from "./net/session.js";
import { activeLayer, createStore, toast } from "./store.js";
import { firstTool, keptOf } from "./tool.js";
import { brushCard } from "./ui/brush_card.js";
import { colorCard } from "./ui/color_card.js";
import { element } from "./ui/element.js";
import { helpDialog } from "./ui/help.js";
import { historyCard } from "./ui/history_card.js";
import { ImageCard, projectionKinds } from "./ui/image_card.js";
import { shortcutTable } from "./ui/keys.js";
import { layersCard } from "./ui/layers_card.js";
import { legend } from "./ui/legend.js";
import { banner, progress, toasts, watchFatal } from "./ui/notices.js";
import { PatternCard } from "./ui/pattern_card.js";
import { quickBar } from "./ui/quick_bar.js";
import { listen } from "./ui/shortcuts.js";
import { statusLine } from "./ui/status_line.js";
import { toolbar } from "./ui/toolbar.js";
import { topBar } from "./ui/top_bar.js";
import { createViewer } from "./view/viewer.js";

const KEEP_AFTER = 500; // ms without a change of the tool
const NARROW = matchMedia("(max-width: 1100px)"); // the side panel lies over the view

const root = /** @type {HTMLElement} */ (document.getElementById("app"));
const stage = /** @type {HTMLElement} */ (document.getElementById("stage"));
const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("canvas"));
const store = createStore();

watchFatal(store, root);
stage.append(banner(store), progress(store), toasts(store));
start();

function start() {
  const session = openSession(store);
  /** @type {import("./view/viewer.js").Viewer} */
  let viewer;
  try {
    viewer = createViewer(canvas, store, session);
  } catch (error) {
    const { what, fix, message } = /** @type {any} */ (error);
    store.set({ fatal: { what: what ?? message, fix: fix ?? "Try another browser" } });
    return;
  }
  Object.assign(window, { meshsdf: { store, viewer, session } });
  store.on("state", () => keepLayerValid());
  store.on("connection", (connection) => {
    const { facts, closedReason } = store.get();
    if (connection === "closed" && !facts) store.set({ fatal: closedReason });
  });
  session.ready.then((facts) => {
    document.title = `${facts.name} – meshsdf`;
    store.set({ tool: firstTool(facts, kept("tool", {})) });
    keepLayerValid();
    build(session, viewer);
    keepTool();
  });
}

/**
 * @param {import("./net/session.js").Session} session
 * @param {import("./view/viewer.js").Viewer} viewer
 */
function build(session, viewer) {
  const actions = createActions(store, session);
  const scene = { store, session, actions, viewer, stage };
  const image = projectionKinds(store.get().facts ?? {}).length ? new ImageCard(scene) : null;
  const side = element(
    "aside",
    { class: "side", id: "side", "aria-label": "Panels" },
    brushCard(store),
    colorCard(store),
    layersCard(store, session, actions),
    new PatternCard(store, session, actions).node,
    image?.node,
    historyCard(store, actions),
  );
  const panels = () => showSide(root.dataset.side === "closed");
  const open = {
    help: () => help.open(),
    panels,
    exports: () => bar.openExports(),
    escape() {
      if (store.get().stroking) viewer.cancelStroke();
      else if (store.get().view.aim) store.set({ view: { ...store.get().view, aim: "" } });
      else if (image?.isPlacing) image.putAway();
      else if (NARROW.matches) showSide(false);
    },
  };
  const bar = topBar(store, session, actions, viewer, open);
  const table = shortcutTable(store, actions, viewer, open);
  const help = helpDialog(table);
  root.append(bar.node, side, help.node);
  stage.append(toolbar(store), statusLine(store), quickBar(store, panels), legend(store));
  listen(table);
  if (image) takeDrops((file) => image.take(file));
  canvas.addEventListener("pointerdown", () => NARROW.matches && showSide(false));
  addEventListener("pagehide", actions.settle);
  watchInput();
  watchStrokes();
  NARROW.addEventListener("change", () => showSide(!NARROW.matches));
  showSide(!NARROW.matches);
}

/** @param {boolean} isOpen */
function showSide(isOpen) {
  root.dataset.side = isOpen ? "open" : "closed";
  document.querySelector(".panels-button")?.setAttribute("aria-expanded", String(isOpen));
  document.getElementById("side")?.toggleAttribute("inert", !isOpen);
}

/** Whether the page was last used by keys, as those who use a mouse need no ring around the view. */
function watchInput() {
  addEventListener(
    "keydown",
    (event) => event.key === "Tab" && (root.dataset.input = "keys"),
    true,
  );
  addEventListener("pointerdown", () => delete root.dataset.input, true);
}

/** The layer that is painted on is always one that is there; the topmost if it is gone. */
function keepLayerValid() {
  const { state, layer } = store.get();
  if (!state || activeLayer(store.get())) return;
  const top = state.layers.at(-1)?.number ?? -1;
  if (top !== layer) store.set({ layer: top });
}

/** Say why a stroke is not seen, if it cannot be. */
function watchStrokes() {
  canvas.addEventListener("pointerdown", (event) => {
    const { state, view, placing } = store.get();
    if (event.button !== 0 || !state || state.layers.length || view.drag === "orbit" || placing)
      return;
    const fix = "Add one: press N, or the plus beside Layers";
    toast(store, { kind: "note", what: "There is no layer to paint on", fix });
  });
  store.on("stroking", (is) => {
    const layer = activeLayer(store.get());
    if (!is || !layer || (layer.visible && layer.opacity > 0)) return;
    const what = `“${layer.name}” is hidden, so what you paint on it is not seen`;
    toast(store, { kind: "note", what, fix: "Show the layer, or choose another one" });
  });
}

/** Remember the tool from day to day. */
function keepTool() {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  store.on("tool", (tool) => {
    clearTimeout(timer);
    timer = setTimeout(() => keep("tool", tool && keptOf(tool)), KEEP_AFTER);
  });
}

/** @param {(file: File) => Promise<void>} take */
function takeDrops(take) {
  document.addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    root.dataset.drop = "over";
  });
  document.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) delete root.dataset.drop;
  });
  document.addEventListener("drop", (event) => {
    const file = event.dataTransfer?.files[0];
    delete root.dataset.drop;
    if (!file) return;
    event.preventDefault();
    void take(file);
  });
}
