// Tools 2 and 3: painting d(x) and β(x) with a soft round brush. Ctrl erases to automatic.

import { Stroke } from "./stroke.js";

/** Places in a stroke. */
const MOST = 4000;

export class Paint {
  /**
   * @param {any} app
   * @param {"size" | "weight"} field
   */
  constructor(app, field) {
    this.app = app;
    this.field = field;
    this.radius = 0;
    this.stroke = new Stroke(MOST);
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
    this.stroke.begin(view, event);
    this.app.redraw();
  }

  move(view, event) {
    this.stroke.follow(view, event);
    this.app.redraw();
  }

  up(view) {
    const path = this.stroke.end(view);
    if (!path) return;
    const value = this.stroke.erases ? null : this.value;
    this.app.do({ do: "paint", field: this.field, value, radius: this.radius, path });
  }

  draw(view, box) {
    this.stroke.draw(view, box, this.radius, this.stroke.erases ? [1, 0.4, 0.4, 0.9] : [1, 1, 1, 0.9]);
  }
}
