// The colours of regions, and how they are drawn over a slice.

const COLORS = [
  [255, 120, 90], [110, 200, 120], [120, 160, 255], [240, 200, 90], [200, 120, 230], [90, 210, 220],
  [230, 130, 170], [160, 190, 70], [140, 120, 210], [240, 160, 60], [80, 170, 150], [190, 150, 120],
];

/** The colour of a region, by its number from 1. @param {number} region @returns {number[]} */
export function colorOf(region) {
  return COLORS[(region + COLORS.length - 1) % COLORS.length];
}

/** The colour as a style has it. @param {number} region */
export function styleOf(region) {
  return `rgb(${colorOf(region).join(" ")})`;
}

/**
 * Draws regions as translucent areas, and the borders of parts and regions.
 * @param {import("./draw.js").Drawing} drawing
 * @param {any} areas as `readRegions` gives them
 * @param {{scale: number[], shift: number[]}} box
 * @param {boolean} showsParts
 */
export function drawRegions(drawing, areas, box, showsParts) {
  for (const { region, corners } of areas.groups) {
    drawing.triangles(`region ${region}`, areas.places, corners, box, [...colorOf(region).map((c) => c / 255), 0.4]);
  }
  if (showsParts) {
    // dark beside white, to be seen on any image
    areas.lines ??= segmentsOf(areas.places, areas.parts);
    drawing.segments("shade", areas.lines.ends, areas.lines.dark, box, 3.5);
    drawing.segments("parts", areas.lines.ends, areas.lines.white, box, 1.5);
  }
  drawing.edges("borders", areas.places, areas.borders, box, [1, 0.95, 0.4, 1]);
}

/** Edges as segments. */
function segmentsOf(places, edges) {
  const ends = new Uint16Array(2 * edges.length);
  edges.forEach((place, i) => ends.set(places.subarray(2 * place, 2 * place + 2), 2 * i));
  const filled = (color) => Uint8Array.from({ length: 2 * edges.length }, (_, i) => color[i % 4]);
  return { ends, dark: filled([20, 24, 32, 200]), white: filled([255, 255, 255, 255]) };
}
