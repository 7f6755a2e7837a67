// The right side: controls of every stage, and its figures. Text is only ever set as text.

import { styleOf } from "./region_colors.js";

const KINDS = ["dark", "bright", "edges", "ridges", "horizons", "faults", "labels", "none"];
const WITH_THRESHOLD = ["ridges", "horizons", "faults"];
const FORMATS = ["vtu", "vtk", "msh", "msh2", "npz", "inp"];

/** An element with properties and children. */
function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

export class Panel {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.root = document.getElementById("panel");
    this.build();
  }

  section(name, ...children) {
    const section = make("section", {}, make("h2", { textContent: name }), ...children);
    section.id = `section-${name.toLowerCase()}`;
    this.root.append(section);
    return section;
  }

  slider(name, id, onchange) {
    const input = make("input", { type: "range", id, min: "0", max: "1", step: "0.001" });
    const output = make("output", { id: `${id}-value` });
    input.oninput = () => (output.textContent = this.words(id, Number(input.value)));
    input.onchange = () => onchange(Number(input.value));
    return make("label", {}, make("span", { textContent: name }), input, output);
  }

  select(name, id, options, onchange) {
    const select = make("select", { id });
    for (const option of options) select.append(make("option", { value: option, textContent: option }));
    select.onchange = () => onchange(select.value);
    return make("label", {}, make("span", { textContent: name }), select, make("output"));
  }

  build() {
    const { app } = this;
    const set = (option, value) => app.do({ do: "set", option, value });
    this.histogram = make("canvas", { id: "histogram", width: 276, height: 44 });
    this.figures = make("dl");
    this.meshFigures = make("dl", { id: "figures" });
    this.flowFigures = make("dl");
    this.notes = make("div", { id: "notes" });
    this.tool = make("div");
    this.section("Tool", this.tool);
    this.section("Image", this.histogram, this.figures);
    this.section("Features",
      this.select("kind", "kind", KINDS, (kind) => set("features.features", kind)),
      this.slider("threshold", "threshold", (high) => set("features.high", high)));
    this.section("Size",
      this.slider("d", "size", (x) => set("lattice.size", Number(this.sizeOf(x).toPrecision(3)))),
      this.slider("β", "beta", (beta) => set("lattice.beta", beta)),
      make("div", { className: "row" },
        make("button", { textContent: "d automatic", onclick: () => set("lattice.size", null) }),
        make("button", { id: "wipe-size", textContent: "wipe size", onclick: () => app.do({ do: "wipe", field: "size" }) }),
        make("button", { id: "wipe-weight", textContent: "wipe weight", onclick: () => app.do({ do: "wipe", field: "weight" }) })),
      make("p", { id: "forecast" }));
    this.section("Mesh",
      this.select("cells", "cells", ["delaunay", "voronoi"], (kind) => set("lattice.mesh", kind)),
      this.meshFigures);
    this.legend = make("dl", { id: "legend" });
    this.section("Regions", this.legend);
    this.section("Flow", this.flowFigures);
    this.command = make("code", { id: "command", hidden: true });
    const format = make("select", { id: "format" });
    for (const name of FORMATS) format.append(make("option", { value: name, textContent: `.${name}` }));
    this.section("Export",
      make("div", { className: "row" }, format,
        make("button", { id: "export", textContent: "Export", onclick: () => app.export(format.value) }),
        make("button", { id: "copy", textContent: "Copy as command line", onclick: () => this.copy() })),
      this.command,
      make("div", { className: "row" },
        make("button", { id: "undo", textContent: "Undo", onclick: () => app.undo() }),
        make("button", { id: "redo", textContent: "Redo", onclick: () => app.redo() })),
      make("p", { id: "session" }));
    this.section("Notes", this.notes);
  }

  async copy() {
    const answer = await this.app.link.ask({ op: "command-line" });
    if (answer.refused) {
      this.app.say(answer.refused);
      return;
    }
    this.command.hidden = false;
    this.command.textContent = answer.text;
    try {
      await navigator.clipboard.writeText(answer.text);
      this.app.say("Copied.", true);
    } catch {
      this.app.say("Select the command below to copy it.", true);
    }
  }

  /** d from the slider's 0…1: from an edge of one sample to a quarter of the box. */
  sizeOf(x) {
    const [low, high] = this.sizes();
    return low * (high / low) ** x;
  }

  sizes() {
    const { shape, step } = this.app;
    const low = Math.min(...step);
    const high = Math.max(...shape.map((n, k) => (n - 1) * step[k])) / 4;
    return [low, Math.max(high, 2 * low)];
  }

  words(id, x) {
    return id === "size" ? this.sizeOf(x).toPrecision(3) : x.toFixed(2);
  }

  put(id, x) {
    const input = /** @type {HTMLInputElement} */ (document.getElementById(id));
    if (document.activeElement === input && input.matches(":active")) return;
    input.value = String(x);
    document.getElementById(`${id}-value`).textContent = this.words(id, x);
  }

  update() {
    const { app } = this;
    const model = app.state?.model;
    for (const section of this.root.children) /** @type {HTMLElement} */ (section).hidden = !model;
    if (!model) return;
    this.updateTool();
    const { options, distance, samples } = model;
    this.drawHistogram(samples);
    table(this.figures, [
      ["samples", model.shape.join(" × ")],
      ["spacing", model.spacing.map((s) => Number(s.toPrecision(4))).join(" × ") + (model.units[0] ? ` ${model.units[0]}` : "")],
      ["values", `${short(samples.least)} … ${short(samples.greatest)}`],
      ["window", `${short(app.window[0])} … ${short(app.window[1])}`],
    ]);
    const kind = options.features?.features ?? "dark";
    const select = /** @type {HTMLSelectElement} */ (document.getElementById("kind"));
    if (![...select.options].some((option) => option.value === kind)) select.append(make("option", { value: kind, textContent: kind }));
    select.value = kind;
    const threshold = /** @type {HTMLInputElement} */ (document.getElementById("threshold"));
    threshold.disabled = !(WITH_THRESHOLD.includes(kind) || options.features?.["edge-operator"] === "crest");
    this.put("threshold", options.features?.high ?? (kind === "horizons" ? 0.4 : 0.5));
    const d = distance?.mean ?? 1;
    const [low, high] = this.sizes();
    this.put("size", Math.min(1, Math.max(0, Math.log(d / low) / Math.log(high / low))));
    this.put("beta", options.lattice?.beta ?? 0.45);
    document.getElementById("cells")["value"] = model.voronoi ? "voronoi" : "delaunay";
    document.getElementById("wipe-size")["disabled"] = !model.painted.size;
    document.getElementById("wipe-weight")["disabled"] = !model.painted.weight;
    const estimate = model.estimate;
    document.getElementById("forecast").textContent = estimate
      ? `About ${estimate.atoms.toLocaleString("en")} atoms, ${estimate.cells.toLocaleString("en")} cells.` : "";
    this.updateFigures(model);
    document.getElementById("undo")["disabled"] = app.state.undo === 0;
    document.getElementById("redo")["disabled"] = app.state.redo === 0;
    document.getElementById("session").textContent = `Kept in ${app.state.session}`;
    this.notes.replaceChildren(...(app.state.error ? [make("p", { className: "warning", textContent: app.state.error })] : []),
      ...model.notes.map((note) => make("p", { textContent: note })));
  }

  updateFigures(model) {
    const figures = this.app.state.figures;
    const share = (x) => (x === null || x === undefined ? "–" : `${(100 * x).toFixed(1)} %`);
    table(this.meshFigures, figures ? [
      ["points", figures.points.toLocaleString("en")],
      ["cells", figures.cells.toLocaleString("en")],
      ...(figures.quality === undefined ? [] : [
        ["quality, mean", figures.quality.toFixed(3)],
        ["quality, least", figures.least.toFixed(3)],
        ["least angle", `${figures.angle.toFixed(1)}°`],
      ]),
      ["features followed", share(figures.recall)],
    ] : []);
    this.updateLegend(model);
    const flow = model.flow;
    const rates = flow ? flow.rates.map((rate, i) => [`${model.wells[i]?.kind ?? "well"} ${i + 1}`, rate.toPrecision(3)]) : [];
    table(this.flowFigures, [
      ...(flow && !model.voronoi ? [["facets", String(flow.facets)]] : []),
      ...rates,
      ...(flow && flow.imbalance !== null ? [["imbalance", flow.imbalance.toExponential(1)]] : []),
      ...(flow ? flow.notes.map((note) => ["", note]) : []),
    ]);
  }

  /** Each region: its colour and name, area or volume in the world's units, cells. */
  updateLegend(model) {
    this.legend.parentElement.hidden = model.regions.length === 0;
    const unit = model.units[0] ? ` ${model.units[0]}${model.dimension === 2 ? "²" : "³"}` : "";
    this.legend.replaceChildren(...model.regions.flatMap(({ region, name, cells, measure }) => {
      const mark = make("span", { className: "mark" });
      mark.style.backgroundColor = styleOf(region);
      return [make("dt", {}, mark, name),
        make("dd", { textContent: `${short(measure)}${unit} · ${cells.toLocaleString("en")} cells` })];
    }));
  }

  updateTool() {
    const { tool, distance, state } = this.app;
    const rows = [];
    if (tool.hint) rows.push(make("p", { textContent: tool.hint }));
    if (tool.radius !== undefined) {
      const unit = state.model.units[0] ?? "units";
      const value = make("input", { type: "number", id: "paint-value", value: String(tool.value), step: "any", min: "0" });
      value.onchange = () => (tool.value = Number(value.value));
      rows.push(make("label", {}, make("span", { textContent: tool.field === "size" ? `d (${unit})` : "β" }), value, make("output")));
      rows.push(make("p", { textContent: `Brush: ${tool.radius.toPrecision(3)} ${unit}` }));
    }
    if (tool.reach !== undefined) rows.push(make("p", { textContent: `Reach: ${tool.reach.toPrecision(2)} edges${distance ? "" : ""}` }));
    if (tool.multiplier !== undefined) {
      const value = make("input", { type: "number", id: "multiplier", value: String(tool.multiplier), step: "0.05", min: "0", max: "1" });
      value.onchange = () => (tool.multiplier = Number(value.value));
      rows.push(make("label", {}, make("span", { textContent: "lets through" }), value, make("output")));
    }
    if (this.tool.contains(document.activeElement) && document.activeElement.tagName !== "BUTTON") return;
    if (tool.controls) rows.push(...tool.controls(make));
    this.tool.replaceChildren(...rows);
    this.tool.parentElement.hidden = rows.length === 0;
  }

  drawHistogram({ bins, least, greatest }) {
    const context = this.histogram.getContext("2d");
    const { width, height } = this.histogram;
    context.clearRect(0, 0, width, height);
    const most = Math.max(1, ...bins.map(Math.sqrt));
    context.fillStyle = "#8892a3";
    bins.forEach((count, i) => {
      const h = (Math.sqrt(count) / most) * (height - 4);
      context.fillRect((i * width) / bins.length, height - h, width / bins.length - 1, h);
    });
    context.fillStyle = "#ffd65a";
    for (const edge of this.app.window) {
      const x = ((edge - least) / (greatest - least || 1)) * width;
      context.fillRect(Math.min(width - 2, Math.max(0, x - 1)), 0, 2, height);
    }
  }
}

function short(x) {
  return String(Number(x.toPrecision(4)));
}

/** Fills a list of names and values. */
function table(list, rows) {
  list.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", { textContent: name }), make("dd", { textContent: value })]));
}
