// Tool 4: atoms. Dragging one moves those in reach; n adds, Delete removes, f pins.

const NEAR = 14; // pixels
const COLORS = { free: [255, 214, 90, 255], pinned: [255, 90, 90, 255], moved: [120, 255, 140, 255], held: [255, 255, 255, 255] };

export class Atoms {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.showsAtoms = true;
    this.reach = 5;
    this.hint = "Drag an atom; n adds, Delete removes, f pins; [ and ] change the reach.";
  }

  enter() {
    this.app.link.send({ op: "atoms", shown: true });
  }

  leave() {
    this.app.link.send({ op: "atoms", shown: false });
  }

  resize(factor) {
    this.reach = Math.min(50, Math.max(0.5, this.reach * factor));
    this.app.redraw();
    this.app.panel.update();
  }

  /** Takes up atoms that were made anew. */
  takeAtoms(frame) {
    const edges = new Uint32Array(2 * frame.cells.length);
    /** @type {Map<string, number>} */
    this.slots = null;
    for (let i = 0; i < frame.cells.length; i += 3) setCell(edges, i / 3, frame.cells.subarray(i, i + 3));
    this.atoms = frame;
    this.base = { places: frame.places.slice(), edges: edges.slice() };
    this.edges = edges;
    this.colors = new Uint8Array(4 * frame.first);
    frame.states.forEach((state, i) => {
      this.colors.set(state === 2 ? [0, 0, 0, 0] : state === 1 ? COLORS.pinned : COLORS.free, 4 * i);
    });
    this.baseColors = this.colors.slice();
    this.app.redraw();
  }

  /** Takes up what a drag has changed since the atoms were made. */
  takeDrag(frame) {
    if (!this.atoms || frame.revision !== this.atoms.revision) return;
    const places = this.base.places.slice();
    const colors = this.baseColors.slice();
    for (const { atom, place } of frame.moves) {
      places.set(place, frame.dimension * atom);
      colors.set(atom === this.atom ? COLORS.held : COLORS.moved, 4 * atom);
    }
    if (!this.slots) {
      this.slots = new Map();
      for (let i = 0; i < this.atoms.cells.length; i += 3) this.slots.set(keyOf(this.atoms.cells.subarray(i, i + 3)), i / 3);
    }
    // removed cells make room for added ones; what is left over comes behind
    const free = [];
    const edges = this.base.edges.slice();
    for (let i = 0; i < frame.removed.length; i += 3) {
      const slot = this.slots.get(keyOf(frame.removed.subarray(i, i + 3)));
      if (slot === undefined) continue;
      edges.fill(0, 6 * slot, 6 * slot + 6);
      free.push(slot);
    }
    const more = [];
    for (let i = 0; i < frame.added.length; i += 3) {
      const cell = frame.added.subarray(i, i + 3);
      const slot = free.pop();
      if (slot !== undefined) setCell(edges, slot, cell);
      else more.push(cell[0], cell[1], cell[1], cell[2], cell[2], cell[0]);
    }
    this.edges = more.length ? Uint32Array.from([...edges, ...more]) : edges;
    this.atoms = { ...this.atoms, places };
    this.colors = colors;
    this.app.redraw();
  }

  /** An atom's place in samples. */
  sample(i) {
    const d = this.atoms.dimension;
    return this.app.shape.map((n, k) => (this.atoms.places[d * i + k] / 65535) * (n - 1));
  }

  /** Whether an atom is there, and in space within half an edge of the slice. */
  isIn(view, i) {
    const { atoms, app } = this;
    if (atoms.states[i] === 2) return false;
    if (atoms.dimension === 2) return true;
    const { axis } = view;
    const off = (atoms.places[3 * i + axis] / 65535) * (app.shape[axis] - 1) - app.cross[axis];
    return Math.abs(off) * app.step[axis] <= (app.distance?.mean ?? 0) / 2;
  }

  /** The atom nearest to a place of the canvas, within reach of the hand. */
  nearest(view, x, y) {
    if (!this.atoms) return null;
    const { places, states, dimension } = this.atoms;
    const [nx, ny] = view.shape;
    const [a, b] = view.axes;
    let best = null;
    let least = NEAR * NEAR;
    const s = view.toSamples(x, y);
    const [px, py] = view.pixels;
    for (let i = 0; i < states.length; i++) {
      const dx = ((places[dimension * i + a] / 65535) * (nx - 1) - s[0]) * px;
      const dy = ((places[dimension * i + b] / 65535) * (ny - 1) - s[1]) * py;
      if (dx * dx + dy * dy < least && this.isIn(view, i)) {
        least = dx * dx + dy * dy;
        best = i;
      }
    }
    return best;
  }

  down(view, event) {
    this.atom = this.nearest(view, event.offsetX, event.offsetY);
    this.pending = null;
    this.isFailed = false;
    if (this.atom !== null && this.atoms.states[this.atom] === 1) {
      this.app.say("This atom is pinned; f lets it go.");
      this.atom = null;
    }
    if (this.atom !== null) this.depth = this.sample(this.atom)[view.axis];
  }

  move(view, event) {
    this.over = { view, at: view.toSamples(event.offsetX, event.offsetY) };
    if (this.atom !== null && this.atom !== undefined && !this.isFailed) {
      this.pending = view.place(this.over.at);
      // in space it stays as deep as it is
      if (this.app.dimension === 3) this.pending[view.axis] = this.depth;
      this.step();
    }
    this.app.redraw();
  }

  /** Sends the newest place, one at a time. */
  async step() {
    if (this.isSending || !this.pending) return;
    this.isSending = true;
    while (this.pending) {
      const to = this.pending;
      this.pending = null;
      const command = { op: "drag", atom: this.atom, to, reach: this.reach, revision: this.atoms.revision };
      const answer = await this.app.link.ask(command);
      if (answer.refused) {
        this.app.say(answer.refused);
        this.isFailed = true;
        this.pending = null;
      }
    }
    this.isSending = false;
    if (this.drops) {
      this.drops = false;
      this.app.link.ask({ op: "drop" });
    }
  }

  up() {
    if (this.atom === null || this.atom === undefined) return;
    if (this.isSending) this.drops = true;
    else this.app.link.ask({ op: "drop" });
    this.atom = null;
  }

  add() {
    if (this.over) this.app.do({ do: "add", at: this.over.view.place(this.over.at) });
  }

  under() {
    if (!this.over) return null;
    const atom = this.nearest(this.over.view, ...this.over.view.toPixels(this.over.at));
    if (atom === null) this.app.say("There is no atom under the pointer.");
    return atom;
  }

  remove() {
    const atom = this.under();
    if (atom !== null) this.app.do({ do: "remove", atom });
  }

  pin() {
    const atom = this.under();
    if (atom !== null) this.app.do({ do: "pin", atom, pinned: this.atoms.states[atom] !== 1 });
  }

  /** The places and colours of the atoms in a slice. */
  inSlice(view) {
    const [a, b] = view.axes;
    const places = [];
    const colors = [];
    for (let i = 0; i < this.atoms.states.length; i++) {
      if (!this.isIn(view, i)) continue;
      places.push(this.atoms.places[3 * i + a], this.atoms.places[3 * i + b]);
      colors.push(...this.colors.subarray(4 * i, 4 * i + 4));
    }
    return { places: Uint16Array.from(places), colors: Uint8Array.from(colors) };
  }

  draw(view, box) {
    if (!this.atoms) return;
    const { drawing } = view;
    if (this.atoms.dimension === 2) {
      drawing.edges("atoms", this.atoms.places, this.edges, box, [0.35, 0.8, 1, 0.6]);
      drawing.points("atoms", this.atoms.places, this.colors, box, 8);
    } else {
      const { places, colors } = this.inSlice(view);
      drawing.points("atoms", places, colors, box, 8);
    }
    if (this.over?.view === view) {
      const d = view.value("distance", this.over.at);
      const radius = this.reach * (Number.isFinite(d) ? d : (this.app.distance?.mean ?? 0));
      view.circle("disc", this.over.at, radius, box, [1, 0.7, 0.3, 0.9]);
    }
  }
}

function setCell(edges, slot, [a, b, c]) {
  edges.set([a, b, b, c, c, a], 6 * slot);
}

function keyOf([a, b, c]) {
  return `${a} ${b} ${c}`;
}
