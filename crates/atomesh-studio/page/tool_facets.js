// Tool 6: facets. A click closes or opens one; with Shift the whole feature.

const CLOSED = [255, 80, 80, 255];
const OPEN = [90, 220, 120, 255];
const OWN = [255, 170, 60, 255];

export class Facets {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.multiplier = 0;
    this.hint = "Click a facet to close or open it for flow; Shift + click a whole feature.";
  }

  move(view, event) {
    this.over = { view, at: view.toSamples(event.offsetX, event.offsetY) };
  }

  down(view, event) {
    this.start = [event.offsetX, event.offsetY];
  }

  up(view, event) {
    if (!this.start) return;
    const moved = Math.hypot(event.offsetX - this.start[0], event.offsetY - this.start[1]);
    this.start = null;
    if (moved > 4) return;
    const at = view.toSamples(event.offsetX, event.offsetY);
    const isClosed = nearestIsClosed(view, this.app.frames.facets, event.offsetX, event.offsetY);
    this.app.do({ do: "facet", at, whole: event.shiftKey, multiplier: isClosed ? 1 : this.multiplier });
  }

  draw(view, box) {
    drawFacets(view, this.app.frames.facets, box, 4);
  }
}

/** Draws barriers red, open facets of features green, barriers set by hand orange. */
export function drawFacets(view, facets, box, width) {
  if (!facets) return;
  if (!facets.colors) {
    facets.colors = new Uint8Array(4 * facets.first);
    facets.features.forEach((feature, i) => {
      facets.colors.set(feature >= 65536 ? OPEN : feature === 0 ? OWN : CLOSED, 4 * i);
    });
  }
  view.drawing.segments("facets", facets.places, facets.colors, box, width);
}

/** Whether the shown facet that is nearest to a pixel, if one is near, is closed. */
function nearestIsClosed(view, facets, x, y) {
  if (!facets) return false;
  const [nx, ny] = view.shape;
  let best = null;
  let least = 10;
  for (let i = 0; i < facets.first; i++) {
    const at = (k) => view.toPixels([(facets.places[4 * i + k] / 65535) * (nx - 1), (facets.places[4 * i + k + 1] / 65535) * (ny - 1)]);
    const distance = toSegment([x, y], at(0), at(2));
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best !== null && facets.features[best] < 65536;
}

function toSegment(p, a, b) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const t = Math.max(0, Math.min(1, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy);
}
