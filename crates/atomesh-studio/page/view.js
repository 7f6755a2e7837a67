// One view: a slice of the image with what lies over it, and the way from its pixels to samples and back.

import { Drawing } from "./draw.js";
import { readFrame, readRegions, readSlice } from "./frames.js";
import { drawRegions } from "./region_colors.js";

const NAMES = ["x", "y", "z"];
const AXES = [[1, 2], [0, 2], [0, 1]];

export class View {
  /**
   * @param {any} app
   * @param {HTMLElement} parent
   * @param {number} axis the axis normal to the slice; 2 in the plane
   */
  constructor(app, parent, axis) {
    this.app = app;
    this.axis = axis;
    this.axes = AXES[axis];
    this.box = document.createElement("div");
    this.box.className = "view";
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("aria-label", `slice normal to ${NAMES[axis]}`);
    this.label = document.createElement("span");
    this.label.className = "label";
    this.box.append(this.canvas, this.label);
    parent.append(this.box);
    this.drawing = new Drawing(this.canvas);
    this.isWhole = true;
    this.center = [0, 0];
    this.zoom = 1;
    /** @type {any} */
    this.cells = null;
    /** @type {any} */
    this.regions = null;
    this.loaded = "";
    this.wanted = "";
    this.slices = {};
    if (app.dimension === 3) this.addSlider();
    new ResizeObserver(() => {
      if (this.isWhole) this.reset();
      app.redraw();
    }).observe(this.canvas);
  }

  addSlider() {
    this.slider = document.createElement("input");
    this.slider.type = "range";
    this.slider.min = "0";
    this.slider.max = String(this.app.shape[this.axis] - 1);
    this.slider.setAttribute("aria-label", `${NAMES[this.axis]} of the slice`);
    this.slider.oninput = () => this.app.setCross(this.axis, Number(this.slider.value));
    this.box.append(this.slider);
  }

  remove() {
    this.drawing.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.box.remove();
  }

  /** Samples along the two axes, and the lengths of their steps over the first's. */
  get shape() {
    return this.axes.map((k) => this.app.shape[k] ?? 1);
  }

  get steps() {
    const [a, b] = this.axes.map((k) => this.app.step[k] ?? 1);
    return [1, b / a];
  }

  /** Whether rows run upwards: where they are heights. */
  get isUp() {
    return this.app.zUp && this.axes[1] === 2;
  }

  /** Shows the whole slice. */
  reset() {
    const { clientWidth, clientHeight } = this.canvas;
    const [nx, ny] = this.shape;
    const [sx, sy] = this.steps;
    this.center = [(nx - 1) / 2, (ny - 1) / 2];
    this.zoom = 0.95 * Math.min(clientWidth / (nx * sx), clientHeight / (ny * sy));
    this.isWhole = true;
  }

  /** Pixels of a sample's step along the two axes, in CSS pixels. */
  get pixels() {
    const [sx, sy] = this.steps;
    return [this.zoom * sx, this.zoom * sy];
  }

  /** From pixels of the canvas to samples. */
  toSamples(x, y) {
    const [px, py] = this.pixels;
    const { clientWidth, clientHeight } = this.canvas;
    const down = this.isUp ? -1 : 1;
    return [this.center[0] + (x - clientWidth / 2) / px, this.center[1] + (down * (y - clientHeight / 2)) / py];
  }

  /** From samples to pixels of the canvas. */
  toPixels(s) {
    const [px, py] = this.pixels;
    const { clientWidth, clientHeight } = this.canvas;
    const down = this.isUp ? -1 : 1;
    return [clientWidth / 2 + (s[0] - this.center[0]) * px, clientHeight / 2 + down * (s[1] - this.center[1]) * py];
  }

  /** The scale and shift that take 0…1 between two samples to the screen's −1…1. */
  between(low, high) {
    const { clientWidth, clientHeight } = this.canvas;
    const [x0, y0] = this.toPixels(low);
    const [x1, y1] = this.toPixels(high);
    const [w, h] = [clientWidth / 2 || 1, clientHeight / 2 || 1];
    return { scale: [(x1 - x0) / w, -(y1 - y0) / h], shift: [x0 / w - 1, 1 - y0 / h] };
  }

  /** All coordinates of a place of the slice, in samples. */
  place(s) {
    if (this.app.dimension === 2) return [s[0], s[1]];
    const place = [0, 0, 0];
    place[this.axes[0]] = s[0];
    place[this.axes[1]] = s[1];
    place[this.axis] = this.app.cross[this.axis];
    return place;
  }

  zoomAt(x, y, factor) {
    this.isWhole = false;
    const before = this.toSamples(x, y);
    this.zoom = Math.min(400, Math.max(0.02, this.zoom * factor));
    const after = this.toSamples(x, y);
    this.center = this.center.map((c, k) => c + before[k] - after[k]);
    this.app.redraw();
  }

  pan(dx, dy) {
    this.isWhole = false;
    const [px, py] = this.pixels;
    this.center = [this.center[0] - dx / px, this.center[1] - ((this.isUp ? -1 : 1) * dy) / py];
    this.app.redraw();
  }

  /** Fetches what the view shows, if it is not the newest; the newest wish wins. */
  async load() {
    const { app, axis } = this;
    const at = app.dimension === 3 ? app.cross[axis] : 0;
    if (this.slider) this.slider.value = String(at);
    const overlay = app.overlay;
    const wanted = `${app.imageNumber} ${app.state?.shown} ${at} ${overlay} ${app.wantsDistance} ${app.state?.parts}`;
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    const get = async (path) => {
      const answer = await fetch(path);
      return answer.status === 200 ? answer.arrayBuffer() : null;
    };
    const image = `${app.imageNumber} ${at}`;
    if (this.loaded !== image) {
      const buffer = await get(`/view/slice?what=image&axis=${axis}&at=${at}`);
      if (this.wanted !== wanted) return;
      if (buffer) {
        this.slices.image = readSlice(buffer);
        this.drawing.texture("image", this.slices.image);
        this.loaded = image;
      }
    }
    const kinds = new Set(app.wantsDistance ? ["distance"] : []);
    if (overlay !== "none") kinds.add(overlay);
    for (const what of kinds) {
      const buffer = await get(`/view/slice?what=${what}&axis=${axis}&at=${at}`);
      if (this.wanted !== wanted) return;
      if (buffer) {
        this.slices[what] = readSlice(buffer);
        this.drawing.texture(what, this.slices[what]);
      }
    }
    if (app.dimension === 3) {
      const buffer = await get(`/view/cells?axis=${axis}&at=${at}`);
      if (this.wanted !== wanted) return;
      if (buffer) this.cells = readFrame(buffer);
    }
    const regions = await get(`/view/regions?axis=${axis}&at=${at}`);
    if (this.wanted !== wanted) return;
    // the old ones stay while others are made
    const isAwaited = app.model?.hasRegions || app.tool.paintsRegions;
    if (regions || !isAwaited) this.regions = regions ? readRegions(regions) : null;
    app.redraw();
  }

  /** The value of a slice at a sample. */
  value(what, s) {
    const slice = this.slices[what];
    if (!slice) return NaN;
    const [i, j] = s.map((x) => Math.round(x / slice.step));
    if (i < 0 || j < 0 || i >= slice.width || j >= slice.height) return NaN;
    return slice.values[j * slice.width + i];
  }

  draw() {
    const { app, drawing } = this;
    drawing.begin();
    const [nx, ny] = this.shape;
    const whole = this.between([-0.5, -0.5], [nx - 0.5, ny - 0.5]);
    const box = this.between([0, 0], [nx - 1, ny - 1]);
    drawing.image("image", whole, app.window, 0, 1);
    if (app.overlay !== "none") {
      const range = app.overlay === "weight" ? [0, 1] : [app.distance?.least ?? 0, app.distance?.greatest ?? 1];
      drawing.image(app.overlay, whole, range, app.overlay === "potential" ? 1 : 2, app.overlay === "potential" ? 0.9 : 0.55);
    }
    const mesh = app.dimension === 3 ? this.cells : app.frames.mesh;
    const isEditing = app.tool.showsAtoms && app.dimension === 2 && app.frames.atoms;
    if (this.regions && !app.played) drawRegions(drawing, this.regions, box, Boolean(app.tool.paintsRegions));
    if (app.played) {
      this.drawPlayed(box);
    } else if (app.showsMesh && mesh && !isEditing) {
      drawing.edges("mesh", mesh.places, mesh.edges, box, [0.35, 0.8, 1, app.tool.dimsMesh ? 0.35 : 0.75]);
    }
    if (app.dimension === 3) this.drawCross(box);
    if (!app.played) app.tool.draw?.(this, box);
    const title = app.dimension === 3 ? `${NAMES[this.axis]} = ${app.cross[this.axis]}` : "";
    if (this.label.textContent !== title) this.label.textContent = title;
  }

  drawPlayed(box) {
    const { places, colors } = this.app.played;
    this.drawing.points("played", places, colors, box, 5);
  }

  drawCross(box) {
    const [nx, ny] = this.shape;
    const [x, y] = this.axes.map((k) => this.app.cross[k]);
    const [u, v] = [x / Math.max(1, nx - 1), y / Math.max(1, ny - 1)];
    const places = new Float32Array([u, 0, u, 1, 0, v, 1, v]);
    this.drawing.edges("cross", places, new Uint32Array([0, 1, 2, 3]), box, [1, 0.9, 0.3, 0.6]);
  }

  /** Draws a circle about a sample, of a radius in lattice units. */
  circle(name, s, radius, box, ink) {
    const [nx, ny] = this.shape;
    const [ax, ay] = this.axes.map((k) => this.app.step[k] ?? 1);
    const count = 64;
    const places = new Float32Array(2 * count);
    const edges = new Uint32Array(2 * count);
    for (let i = 0; i < count; i++) {
      const angle = (2 * Math.PI * i) / count;
      places[2 * i] = (s[0] + (radius * Math.cos(angle)) / ax) / Math.max(1, nx - 1);
      places[2 * i + 1] = (s[1] + (radius * Math.sin(angle)) / ay) / Math.max(1, ny - 1);
      edges.set([i, (i + 1) % count], 2 * i);
    }
    this.drawing.edges(name, places, edges, box, ink);
  }
}
