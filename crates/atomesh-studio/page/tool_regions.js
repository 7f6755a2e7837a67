// Tool 5: regions. A stroke gives the parts that it touches a region; Shift paints single cells, Ctrl erases. Parts are
// merged by a stroke across them, and split between two strokes.

import { colorOf } from "./region_colors.js";
import { Stroke, drawPath } from "./stroke.js";

/** Places in a stroke: two of them are in the gesture that splits a part. */
const MOST = 2000;

const HANDS = ["paint", "merge", "split"];

export class Regions {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.dimsMesh = true;
    this.paintsRegions = true;
    this.count = 20;
    this.region = 1;
    this.hand = "paint";
    this.brush = 0;
    this.stroke = new Stroke(MOST);
    /** @type {number | null} the region whose cells alone are changed */
    this.only = null;
    this.hint = "Drag over parts to give them the region; Shift paints cells, Ctrl erases; m merges, s splits; [ and ] change the brush.";
  }

  enter() {
    if (this.brush === 0) this.brush = (this.app.distance?.mean ?? 0) / 4;
    this.tell();
  }

  leave() {
    this.app.link.send({ op: "parts", count: null });
    this.first = null;
  }

  /** Says which parts are wanted. */
  tell() {
    this.app.link.send({ op: "parts", count: this.count });
  }

  setCount(count) {
    this.count = count;
    this.tell();
  }

  setHand(hand) {
    this.hand = this.hand === hand ? "paint" : hand;
    this.first = null;
    this.app.panel.update();
    this.app.redraw();
  }

  resize(factor) {
    this.brush *= factor;
    this.app.redraw();
    this.app.panel.update();
  }

  down(view, event) {
    this.stroke.begin(view, event);
    this.isOfCells = event.shiftKey;
    this.app.redraw();
  }

  move(view, event) {
    this.stroke.follow(view, event);
    this.app.redraw();
  }

  up(view) {
    const path = this.stroke.end(view);
    if (!path) return;
    const { app, count } = this;
    if (this.hand === "merge") {
      app.do({ do: "merge-parts", path, parts: count });
    } else if (this.hand === "split") {
      if (this.first) app.do({ do: "split-part", first: this.first, second: path, parts: count });
      else app.say("Now mark the other side.", true);
      this.first = this.first ? null : path;
    } else {
      const region = this.stroke.erases ? 0 : this.region;
      app.do({ do: "region", region, radius: this.brush, path, parts: this.isOfCells ? null : count, over: this.only });
    }
    this.app.redraw();
  }

  draw(view, box) {
    const own = colorOf(this.region).map((c) => c / 255);
    const erases = this.stroke.erases && this.stroke.path;
    const ink = erases ? [1, 0.4, 0.4, 0.9] : this.hand === "paint" ? [...own, 1] : [1, 1, 1, 0.9];
    if (this.first && this.app.dimension === 2) drawPath(view, "first", this.first, box, [1, 0.7, 0.3, 1]);
    this.stroke.draw(view, box, this.brush, ink);
  }

  /** The controls of the tool, for the panel. @param {(tag: string, properties?: object, ...children: any[]) => any} make */
  controls(make) {
    const { app } = this;
    const { model } = app.state;
    const count = make("input", { type: "range", id: "parts", min: "1", max: String(model.mostParts), step: "1", value: String(this.count) });
    const shown = make("output", { textContent: String(this.count) });
    count.oninput = () => (shown.textContent = count.value);
    count.onchange = () => this.setCount(Number(count.value));
    const region = make("select", { id: "region" });
    model.regionNames.slice(0, 16).forEach((name, i) => region.append(make("option", { value: String(i + 1), textContent: `${i + 1} ${name}` })));
    region.value = String(this.region);
    region.onchange = () => {
      this.region = Number(region.value);
      region.blur();
      app.panel.update();
      app.redraw();
    };
    const only = make("select", { id: "over" });
    only.append(make("option", { value: "", textContent: "everything" }), make("option", { value: "0", textContent: "rest" }));
    for (const { region: number, name } of model.regions) only.append(make("option", { value: String(number), textContent: name }));
    only.value = this.only === null ? "" : String(this.only);
    only.onchange = () => {
      this.only = only.value === "" ? null : Number(only.value);
      only.blur();
    };
    const name = make("input", { type: "text", id: "region-name", value: model.regionNames[this.region - 1], maxLength: 64 });
    name.onchange = () => {
      name.blur();
      app.do({ do: "name-region", region: this.region, name: name.value });
    };
    const hands = HANDS.map((hand) => {
      const button = make("button", { textContent: hand, onclick: () => this.setHand(hand) });
      button.setAttribute("aria-pressed", String(this.hand === hand));
      return button;
    });
    return [
      make("label", {}, make("span", { textContent: "parts" }), count, shown),
      make("label", {}, make("span", { textContent: "region" }), region, make("output")),
      make("label", {}, make("span", { textContent: "name" }), name, make("output")),
      make("label", {}, make("span", { textContent: "paint over" }), only, make("output")),
      make("div", { className: "row" }, ...hands),
      make("p", { textContent: `Brush: ${this.brush.toPrecision(3)} ${model.units[0] ?? "units"}` }),
    ];
  }
}
