// A stroke of a brush under way: its path in samples, the view that it began in, and where the pointer is.

/** Pixels from one place of a path to the next. */
const APART = 3;

export class Stroke {
  /** @param {number} most places of a path, at most */
  constructor(most) {
    this.most = most;
    /** @type {number[][] | null} */
    this.path = null;
    this.view = null;
    this.over = null;
    this.erases = false;
  }

  begin(view, event) {
    this.path = [view.toSamples(event.offsetX, event.offsetY)];
    this.view = view;
    this.erases = event.ctrlKey || event.metaKey;
  }

  /** Follows the pointer; a path goes on in the view that it began in. */
  follow(view, event) {
    this.over = { view, at: view.toSamples(event.offsetX, event.offsetY) };
    if (!this.path || view !== this.view) return;
    const last = view.toPixels(this.path[this.path.length - 1]);
    const apart = Math.hypot(last[0] - event.offsetX, last[1] - event.offsetY);
    if (apart > APART && this.path.length < this.most) this.path.push(this.over.at);
  }

  /** Ends the path: its places in space; null if there is none. */
  end(view) {
    const path = this.path?.map((s) => view.place(s)) ?? null;
    this.path = null;
    return path;
  }

  /** Draws the path, and the brush where the pointer is. */
  draw(view, box, radius, ink) {
    if (this.path && this.view === view) drawPath(view, "stroke", this.path, box, ink);
    if (this.over?.view === view) view.circle("brush", this.over.at, radius, box, ink);
  }
}

/** Draws a path of places in samples. */
export function drawPath(view, name, path, box, ink) {
  const [nx, ny] = view.shape;
  const places = new Float32Array(path.flatMap(([x, y]) => [x / Math.max(1, nx - 1), y / Math.max(1, ny - 1)]));
  view.drawing.strips(name, places, [path.length], box, ink);
}
