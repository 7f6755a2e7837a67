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
 */
export function drawRegions(drawing, areas, box) {
  for (const { region, corners } of areas.groups) {
    drawing.triangles(`region ${region}`, areas.places, corners, box, [...colorOf(region).map((c) => c / 255), 0.4]);
  }
  drawing.edges("parts", areas.places, areas.parts, box, [1, 1, 1, 0.9]);
  drawing.edges("borders", areas.places, areas.borders, box, [1, 0.95, 0.4, 1]);
}
