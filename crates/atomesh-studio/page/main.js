// The studio's page: what is shown, which tool the hand holds, and the way to the server.

import { readFrame } from "./frames.js";
import { bindKeys, showKeys } from "./keys.js";
import { Link } from "./link.js";
import { Panel } from "./panel.js";
import { Playback } from "./playback.js";
import { Atoms } from "./tool_atoms.js";
import { Facets } from "./tool_facets.js";
import { Look } from "./tool_look.js";
import { Paint } from "./tool_paint.js";
import { Regions } from "./tool_regions.js";
import { Wells } from "./tool_wells.js";
import { Space } from "./space.js";
import { View } from "./view.js";

const TOOLS = ["look", "size", "weight", "atoms", "regions", "facets", "wells"];

class App {
  constructor() {
    /** @type {any} */
    this.state = null;
    this.frames = {};
    this.views = [];
    this.window = [0, 1];
    this.cross = [0, 0, 0];
    this.overlay = "none";
    this.showsMesh = true;
    this.played = null;
    this.imageNumber = 0;
    /** @type {Record<number, any>} the tools by their numbers; each has what it needs of down, move, up, draw, enter, leave … */
    this.tools = {
      1: new Look(this), 2: new Paint(this, "size"), 3: new Paint(this, "weight"),
      4: new Atoms(this), 5: new Regions(this), 6: new Facets(this), 7: new Wells(this),
    };
    /** @type {any} */
    this.tool = this.tools[1];
    this.playback = new Playback(this);
    this.panel = new Panel(this);
    this.link = new Link((kind, value) => this.take(kind, value), (buffer) => this.takeFrame(buffer), (up) => this.takeUp(up));
    this.buildTools();
    this.buildWelcome();
    bindKeys(this);
    bindPage(this);
    showKeys(document.querySelector("#keys table"));
    document.getElementById("close-keys").onclick = () => this.toggleKeys();
    document.getElementById("cancel").onclick = () => this.cancel();
  }

  get model() { return this.state?.model ?? null; }
  get dimension() { return this.model?.dimension ?? 2; }
  get shape() { return this.model?.shape ?? [1, 1]; }
  get step() { return this.model?.step ?? [1, 1]; }
  get zUp() { return this.model?.zUp ?? false; }
  get distance() { return this.model?.distance ?? null; }
  get revision() { return this.state?.revision ?? 0; }
  get wantsDistance() { return Boolean(this.tool.showsAtoms && this.distance); }

  buildTools() {
    const nav = document.getElementById("tools");
    TOOLS.forEach((name, i) => {
      const button = document.createElement("button");
      const number = document.createElement("b");
      number.textContent = String(i + 1);
      button.append(number, name);
      button.disabled = !this.tools[i + 1];
      button.title = button.disabled ? "not yet" : `${name} (${i + 1})`;
      button.onclick = () => this.choose(i + 1);
      nav.append(button);
    });
    this.markTool();
  }

  markTool() {
    [...document.getElementById("tools").children].forEach((button, i) => {
      button.setAttribute("aria-pressed", String(this.tools[i + 1] === this.tool));
      if (this.tools[i + 1]) /** @type {HTMLButtonElement} */ (button).disabled = this.dimension === 3 && i + 1 > 5;
    });
  }

  buildWelcome() {
    const scenes = document.getElementById("scenes");
    document.getElementById("draw-scene").onclick = () => this.ask({ op: "scene", name: scenes["value"], seed: 0 });
    const file = /** @type {HTMLInputElement} */ (document.getElementById("file"));
    file.onchange = () => file.files[0] && this.open(file.files[0]);
  }

  fillScenes(names) {
    const scenes = document.getElementById("scenes");
    if (scenes.children.length > 0) return;
    for (const name of names) {
      const option = document.createElement("option");
      option.value = option.textContent = name;
      scenes.append(option);
    }
  }

  /** Takes a state in words. */
  take(kind, value) {
    if (kind === "progress") {
      this.progress = value;
    } else {
      const before = this.state;
      this.state = value;
      this.fillScenes(value.scenes);
      const isOther = value.model && value.image !== before?.image;
      if (isOther) this.showOther();
      if (value.error && value.error !== before?.error) this.say(value.error);
      if (!value.model) this.frames = {};
    }
    this.update();
  }

  /** Another image is open. */
  showOther() {
    this.imageNumber += 1;
    this.frames = { mesh: this.frames.mesh && this.frames.mesh.revision >= this.revision ? this.frames.mesh : null };
    for (const view of this.views) view.remove();
    this.space?.remove();
    const parent = document.getElementById("views");
    parent.className = this.dimension === 3 ? "three" : "";
    this.cross = this.shape.map((n) => Math.floor(n / 2));
    this.views = (this.dimension === 3 ? [2, 1, 0] : [2]).map((axis) => new View(this, parent, axis));
    this.space = this.dimension === 3 ? new Space(this, parent) : null;
    if (this.dimension === 3 && (this.tool === this.tools[6] || this.tool === this.tools[7])) this.choose(1);
    this.tools[4].atoms = null;
    this.autoContrast();
    this.markTool();
  }

  /** Takes a frame of arrays, and says its kind. */
  takeFrame(buffer) {
    const frame = readFrame(buffer);
    this.frames[frame.kind] = frame;
    if (frame.kind === "atoms") this.tools[4].takeAtoms(frame);
    if (frame.kind === "drag") this.tools[4].takeDrag(frame);
    this.redraw();
    return frame.kind;
  }

  takeUp(up) {
    document.body.classList.toggle("down", !up);
    if (up) {
      this.wasUp = true;
      if (this.tool.showsAtoms) this.tool.enter();
      // the page before a reload may have wanted parts
      if (this.tool.paintsRegions) this.tool.enter();
      else this.link.send({ op: "parts", count: null });
    } else if (this.wasUp) {
      this.say("The studio has ended or cannot be reached; it is tried again.");
    }
  }

  /** Brings text and controls up to date. */
  update() {
    const { model, state } = this;
    document.getElementById("welcome").hidden = Boolean(model) || !state;
    document.getElementById("title").textContent = model ? `${model.name} – atomesh studio` : "atomesh studio";
    document.title = model ? `${model.name} – atomesh studio` : "atomesh studio";
    const busy = Boolean(state?.busy);
    document.getElementById("phase").textContent = busy ? (this.progress?.phase ?? "working") : "ready";
    const bar = /** @type {HTMLProgressElement} */ (document.getElementById("progress"));
    bar.hidden = document.getElementById("cancel").hidden = !busy;
    bar.value = this.progress?.done ?? 0;
    this.playback.update(model?.recorded ?? 0, this.revision);
    if (model && (this.tool.radius === 0 || (this.tool.brush === 0 && this.distance))) this.tool.enter();
    this.panel.update();
    document.body.dataset.revision = String(this.revision);
    document.body.dataset.busy = String(busy);
    document.body.dataset.hash = state?.hash ?? "";
    for (const view of this.views) view.load();
    this.space?.load();
    this.redraw();
  }

  redraw() {
    if (this.isDrawing) return;
    this.isDrawing = true;
    requestAnimationFrame(() => {
      this.isDrawing = false;
      for (const view of this.views) view.draw();
      this.space?.draw();
    });
  }

  choose(number) {
    const tool = this.tools[number];
    if (!tool || tool === this.tool || (this.dimension === 3 && number > 5)) return;
    this.tool.leave?.();
    this.tool = tool;
    tool.enter?.();
    this.markTool();
    this.update();
  }

  async ask(command) {
    const answer = await this.link.ask(command);
    if (answer.refused) this.say(answer.refused);
    return answer;
  }

  do(gesture) { return this.ask({ op: "do", gesture }); }
  undo() { return this.ask({ op: "undo" }); }
  redo() { return this.ask({ op: "redo" }); }

  cancel() {
    const keys = /** @type {HTMLDialogElement} */ (document.getElementById("keys"));
    if (keys.open) keys.close();
    else if (this.state?.busy) this.ask({ op: "cancel" });
  }

  toggleKeys() {
    const keys = /** @type {HTMLDialogElement} */ (document.getElementById("keys"));
    if (keys.open) keys.close();
    else keys.showModal();
  }

  toggleMesh() {
    this.showsMesh = !this.showsMesh;
    this.redraw();
  }

  toggleOverlay(what) {
    this.overlay = this.overlay === what ? "none" : what;
    this.update();
  }

  toggleVoronoi() {
    if (this.model) this.do({ do: "set", option: "lattice.mesh", value: this.model.voronoi ? "delaunay" : "voronoi" });
  }

  resetViews() {
    for (const view of this.views) view.reset();
    this.space?.reset();
    this.redraw();
  }

  /** The window from the histogram: all but half a percent at each end. */
  autoContrast() {
    const samples = this.model?.samples;
    if (!samples) return;
    const all = samples.bins.reduce((a, b) => a + b, 0);
    const at = (share) => {
      let sum = 0;
      const bin = samples.bins.findIndex((count) => (sum += count) >= share * all);
      return bin / samples.bins.length;
    };
    const extent = samples.greatest - samples.least || 1;
    const [low, high] = [at(0.005), Math.min(1, at(0.995) + 1 / samples.bins.length)];
    this.window = [samples.least + low * extent, samples.least + high * extent];
    this.panel.update();
    this.redraw();
  }

  setCross(axis, at) {
    this.cross[axis] = Math.min(this.shape[axis] - 1, Math.max(0, Math.round(at)));
    for (const view of this.views) view.load();
    this.redraw();
  }

  async open(file) {
    this.say(`Reading ${file.name} …`, true);
    const answer = await fetch(`/file/drop?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
    this.say(answer.ok ? `${file.name} is open.` : await answer.text(), answer.ok);
  }

  async export(format) {
    this.say("Writing …", true);
    const answer = await fetch(`/file/export?format=${format}`, { method: "POST" });
    if (!answer.ok) {
      this.say(await answer.text());
      return;
    }
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await answer.blob());
    link.download = `${(this.model?.name ?? "mesh").replace(/\..*$/, "")}.${format}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    this.say(`Written as mesh.${format} into the session's folder, and sent to this browser.`, true);
  }

  say(text, isPlain = false) {
    const message = document.getElementById("message");
    message.textContent = text;
    message.className = isPlain ? "plain" : "";
    message.hidden = false;
    clearTimeout(this.quiet);
    this.quiet = setTimeout(() => (message.hidden = true), 6000);
  }
}

/** Binds the mouse and the dropping of files. @param {App} app */
function bindPage(app) {
  const area = document.getElementById("views");
  let isSpace = false;
  window.addEventListener("keydown", (event) => {
    const isOnView = event.target === document.body || /** @type {HTMLElement} */ (event.target).tagName === "CANVAS";
    if (event.key === " " && isOnView) {
      isSpace = true;
      event.preventDefault();
    }
  });
  window.addEventListener("keyup", (event) => { if (event.key === " ") isSpace = false; });
  const viewOf = (event) => app.views.find((view) => view.canvas === event.target);
  /** @type {any} */
  let hold = null;
  area.addEventListener("pointerdown", (event) => {
    const view = viewOf(event);
    if (!view) return;
    view.canvas.focus();
    view.canvas.setPointerCapture(event.pointerId);
    const isPan = event.button === 1 || (event.button === 0 && isSpace);
    hold = { view, how: isPan ? "pan" : event.button === 2 ? "window" : "tool", x: event.offsetX, y: event.offsetY };
    if (hold.how === "tool") app.tool.down?.(view, event);
    if (event.button === 1) event.preventDefault();
  });
  area.addEventListener("pointermove", (event) => {
    const view = hold?.view ?? viewOf(event);
    if (!view) return;
    showPlace(app, view, event);
    if (event.shiftKey && !hold && app.dimension === 3) {
      const s = view.toSamples(event.offsetX, event.offsetY);
      view.axes.forEach((axis, k) => app.setCross(axis, s[k]));
    }
    if (hold && hold.how !== "tool") {
      const [dx, dy] = [event.offsetX - hold.x, event.offsetY - hold.y];
      [hold.x, hold.y] = [event.offsetX, event.offsetY];
      if (hold.how === "pan") view.pan(dx, dy);
      else turnWindow(app, dx, dy);
    } else {
      app.tool.move?.(view, event);
    }
  });
  const release = (event) => {
    if (!hold) return;
    if (hold.how === "tool") app.tool.up?.(hold.view, event);
    hold = null;
  };
  area.addEventListener("pointerup", release);
  area.addEventListener("pointercancel", release);
  area.addEventListener("contextmenu", (event) => event.preventDefault());
  area.addEventListener("wheel", (event) => {
    const view = viewOf(event);
    if (!view) return;
    event.preventDefault();
    const turn = event.deltaY || event.deltaX;
    const factor = turn < 0 ? 1.2 : 1 / 1.2;
    if (event.shiftKey) app.tool.resize?.(factor);
    else if (app.dimension === 3 && !event.ctrlKey) app.setCross(view.axis, app.cross[view.axis] + (turn < 0 ? 1 : -1));
    else view.zoomAt(event.offsetX, event.offsetY, factor);
  }, { passive: false });
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  window.addEventListener("dragleave", () => document.body.classList.remove("dropping"));
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    const file = event.dataTransfer?.files[0];
    if (file) app.open(file);
  });
}

/** Sideways the window grows, upwards the level. */
function turnWindow(app, dx, dy) {
  const samples = app.model?.samples;
  if (!samples) return;
  const extent = (samples.greatest - samples.least || 1) / 400;
  const [low, high] = app.window;
  const level = (low + high) / 2 + dy * extent;
  const width = Math.max(extent, high - low + dx * extent);
  app.window = [level - width / 2, level + width / 2];
  app.panel.update();
  app.redraw();
}

/** The sample, its place in the world, and its value. */
function showPlace(app, view, event) {
  const { model } = app;
  if (!model) return;
  const place = view.place(view.toSamples(event.offsetX, event.offsetY));
  const world = model.origin.map((o, i) =>
    o + place.reduce((sum, s, k) => sum + model.direction[i][k] * model.spacing[k] * s, 0));
  const unit = model.units[0] ? ` ${model.units[0]}` : "";
  const value = view.value("image", view.toSamples(event.offsetX, event.offsetY));
  const words = (xs, digits) => xs.map((x) => x.toFixed(digits)).join(", ");
  document.getElementById("place").textContent =
    `sample ${words(place, 1)} · world ${words(world, 2)}${unit}` + (Number.isNaN(value) ? "" : ` · ${Number(value.toPrecision(4))}`);
}

window["studio"] = new App();
