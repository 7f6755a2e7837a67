// Every key, once: what binds them is what the help shows.

/** @typedef {{key: string, shown?: string, does: string, act?: (app: any) => void}} Key */

/** @type {Key[]} */
export const KEYS = [
  ...["look", "paint size", "paint weight", "atoms", "regions", "facets", "wells"].flatMap((name, i) =>
    [{ key: String(i + 1), does: `tool: ${name}`, act: (app) => app.choose(i + 1) }]),
  { key: "r", does: "show the whole image", act: (app) => app.resetViews() },
  { key: "c", does: "contrast from the image", act: (app) => app.autoContrast() },
  { key: "g", does: "mesh on or off", act: (app) => app.toggleMesh() },
  { key: "b", does: "features b(x) over the image, on or off", act: (app) => app.toggleOverlay("potential") },
  { key: "d", does: "nominal distance d(x) over the image, on or off", act: (app) => app.toggleOverlay("distance") },
  { key: "w", does: "weight β(x) over the image, on or off", act: (app) => app.toggleOverlay("weight") },
  { key: "v", does: "Delaunay or Voronoi cells", act: (app) => app.toggleVoronoi() },
  { key: "p", does: "play the recorded iterations, or stop", act: (app) => app.playback.toggle() },
  { key: "[", does: "smaller brush or reach", act: (app) => app.tool.resize?.(1 / 1.25) },
  { key: "]", does: "larger brush or reach", act: (app) => app.tool.resize?.(1.25) },
  { key: "n", does: "atoms: add one under the pointer; wells: a source, with Shift a sink", act: (app) => app.tool.add?.(false) },
  { key: "N", shown: "Shift + n", does: "wells: a sink under the pointer", act: (app) => app.tool.add?.(true) },
  { key: "Delete", does: "remove the atom or well under the pointer", act: (app) => app.tool.remove?.() },
  { key: "f", does: "atoms: pin the one under the pointer, or let it go", act: (app) => app.tool.pin?.() },
  { key: "m", does: "regions: the next strokes merge parts, or paint again", act: (app) => app.tool.setHand?.("merge") },
  { key: "s", does: "regions: two strokes split a part between them, or paint again", act: (app) => app.tool.setHand?.("split") },
  { key: "Ctrl+z", does: "undo", act: (app) => app.undo() },
  { key: "Ctrl+Z", shown: "Ctrl + Shift + z", does: "redo", act: (app) => app.redo() },
  { key: "Ctrl+y", does: "redo", act: (app) => app.redo() },
  { key: "Escape", does: "end the work under way, close this list", act: (app) => app.cancel() },
  { key: "h", does: "this list", act: (app) => app.toggleKeys() },
];

/** What the mouse does; told beside the keys. @type {Key[]} */
export const HANDS = [
  { key: "wheel", does: "next slice; in the plane, zoom" },
  { key: "Ctrl + wheel", does: "zoom" },
  { key: "Shift + wheel", does: "size of the brush, or reach of atoms" },
  { key: "middle drag, Space + drag", does: "move the image" },
  { key: "right drag", does: "window (sideways) and level (up and down)" },
  { key: "Shift + move", does: "crosshair, in 3-D" },
  { key: "drag", does: "paint size, weight or regions; move an atom or a well; otherwise move the image" },
  { key: "Ctrl + drag", does: "paint: erase to automatic; regions: erase to none" },
  { key: "Shift + drag", does: "regions: paint single cells" },
  { key: "click", does: "facets: close or open one; with Shift its whole feature" },
];

/** @param {KeyboardEvent} event */
export function nameOf(event) {
  return (event.ctrlKey || event.metaKey ? "Ctrl+" : "") + event.key;
}

/**
 * Binds the keys.
 * @param {any} app
 */
export function bindKeys(app) {
  window.addEventListener("keydown", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    const isTyping = target.matches?.("input:not([type=range]):not([type=checkbox]), select, textarea");
    if (isTyping && event.key !== "Escape") return;
    const found = KEYS.find((key) => key.key === nameOf(event));
    if (!found?.act || event.altKey) return;
    event.preventDefault();
    found.act(app);
  });
}

/** Fills the table of the help. @param {HTMLTableElement} table */
export function showKeys(table) {
  for (const { key, shown, does } of [...KEYS, ...HANDS]) {
    const row = table.insertRow();
    row.insertCell().textContent = shown ?? key.replace(/(?<=\w)\+(?=\w)/, " + ");
    row.insertCell().textContent = does;
  }
}
