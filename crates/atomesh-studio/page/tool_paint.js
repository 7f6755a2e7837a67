// Tools 2 and 3: painting d(x) and β(x) with a soft round brush. Ctrl erases to automatic.

export class Paint {
  /**
   * @param {any} app
   * @param {"size" | "weight"} field
   */
  constructor(app, field) {
    this.app = app;
    this.field = field;
    this.radius = 0;
    this.value = field === "size" ? 0 : 1;
    this.hint = "Drag to paint; Ctrl + drag erases; [ and ] change the brush.";
  }

  /** Begins with a brush and a value that suit the image. */
  enter() {
    const { app } = this;
    this.app.overlay = this.field === "size" ? "distance" : "weight";
    if (!app.distance) return;
    if (this.radius === 0) this.radius = 3 * app.distance.mean;
    if (this.value === 0) this.value = Number((app.distance.mean / 2).toPrecision(2));
  }

  leave() {
    this.app.overlay = "none";
  }

  resize(factor) {
    this.radius *= factor;
    this.app.redraw();
    this.app.panel.update();
  }

  down(view, event) {
    this.path = [view.toSamples(event.offsetX, event.offsetY)];
    this.pathView = view;
    this.erases = event.ctrlKey || event.metaKey;
    this.app.redraw();
  }

  move(view, event) {
    this.over = { view, at: view.toSamples(event.offsetX, event.offsetY) };
    if (this.path) {
      const last = view.toPixels(this.path[this.path.length - 1]);
      const apart = Math.hypot(last[0] - event.offsetX, last[1] - event.offsetY);
      if (apart > 3 && this.path.length < 4000) this.path.push(this.over.at);
    }
    this.app.redraw();
  }

  up(view) {
    if (!this.path) return;
    const path = this.path.map((s) => view.place(s));
    const value = this.erases ? null : this.value;
    this.path = null;
    this.app.do({ do: "paint", field: this.field, value, radius: this.radius, path });
  }

  draw(view, box) {
    const ink = this.erases ? [1, 0.4, 0.4, 0.9] : [1, 1, 1, 0.9];
    if (this.path && this.pathView === view) {
      const [nx, ny] = view.shape;
      const places = new Float32Array(this.path.flatMap(([x, y]) => [x / (nx - 1), y / (ny - 1)]));
      view.drawing.strips("stroke", places, [this.path.length], box, ink);
    }
    if (this.over?.view === view) view.circle("brush", this.over.at, this.radius, box, ink);
  }
}
