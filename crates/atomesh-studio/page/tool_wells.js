// Tool 7: wells. n puts a source, Shift + n a sink; they are dragged, and flow is solved again when they are let go.

import { drawFacets } from "./tool_facets.js";

const NEAR = 14; // pixels
const SOURCE = [80, 160, 255, 255];
const SINK = [255, 140, 40, 255];

export class Wells {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.dimsMesh = true;
    this.hint = "n puts a source, Shift + n a sink, Delete removes one; drag them.";
  }

  get wells() {
    return this.app.state?.model?.wells ?? [];
  }

  nearest(view, x, y) {
    let best = null;
    let least = NEAR;
    this.wells.forEach((well, i) => {
      const [px, py] = view.toPixels(well.at);
      const distance = Math.hypot(px - x, py - y);
      if (distance < least) {
        least = distance;
        best = i;
      }
    });
    return best;
  }

  down(view, event) {
    this.well = this.nearest(view, event.offsetX, event.offsetY);
  }

  move(view, event) {
    this.over = { view, at: view.toSamples(event.offsetX, event.offsetY) };
    this.app.redraw();
  }

  async up(view, event) {
    if (this.well === null || this.well === undefined) return;
    const to = view.toSamples(event.offsetX, event.offsetY);
    await this.app.do({ do: "move-well", well: this.well, to });
    this.well = null;
  }

  add(isSink) {
    if (this.over) this.app.do({ do: "well", kind: isSink ? "sink" : "source", at: this.over.at });
  }

  remove() {
    const well = this.over ? this.nearest(this.over.view, ...this.over.view.toPixels(this.over.at)) : null;
    if (well === null) this.app.say("There is no well under the pointer.");
    else this.app.do({ do: "remove-well", well });
  }

  draw(view, box) {
    const { app } = this;
    drawFacets(view, app.frames.facets, box, 3);
    const flow = app.frames.flow;
    if (flow) view.drawing.strips("flow", flow.places, flow.lengths, box, [0.85, 0.1, 0.75, 0.9]);
    const [nx, ny] = view.shape;
    const shown = this.wells.map((well, i) => (i === this.well && this.over ? this.over.at : well.at));
    const places = new Float32Array(shown.flatMap(([x, y]) => [x / (nx - 1), y / (ny - 1)]));
    const colors = new Uint8Array(this.wells.flatMap((well) => (well.kind === "source" ? SOURCE : SINK)));
    view.drawing.points("wells", places, colors, box, 16);
  }
}
