// Frames of arrays, as protocol.rs lays them out.

const KINDS = ["state", "mesh", "atoms", "drag", "facets", "flow", "progress"];

/** @param {ArrayBuffer} buffer */
export function readFrame(buffer) {
  const view = new DataView(buffer);
  const head = {
    kind: KINDS[view.getUint8(0)],
    dimension: view.getUint8(1),
    revision: view.getUint32(4, true),
    first: view.getUint32(8, true),
    second: view.getUint32(12, true),
  };
  const u16 = (at, count) => new Uint16Array(buffer.slice(at, at + 2 * count));
  const u32 = (at, count) => new Uint32Array(buffer.slice(at, at + 4 * count));
  switch (head.kind) {
    case "mesh":
      return { ...head, places: u16(16, 2 * head.first), edges: u32(16 + 4 * head.first, 2 * head.second) };
    case "atoms": {
      const d = head.dimension;
      const size = d === 2 ? 8 : 12;
      const places = new Uint16Array(d * head.first);
      const states = new Uint32Array(head.first);
      for (let i = 0; i < head.first; i++) {
        const at = 16 + size * i;
        for (let k = 0; k < d; k++) places[d * i + k] = view.getUint16(at + 2 * k, true);
        states[i] = view.getUint32(at + size - 4, true);
      }
      return { ...head, places, states, cells: u32(16 + size * head.first, 3 * head.second) };
    }
    case "drag": {
      const d = head.dimension;
      const size = d === 2 ? 8 : 12;
      const moves = [];
      for (let i = 0; i < head.first; i++) {
        const at = 16 + size * i;
        const place = Array.from({ length: d }, (_, k) => view.getUint16(at + 4 + 2 * k, true));
        moves.push({ atom: view.getUint32(at, true), place });
      }
      const rest = u32(16 + size * head.first, head.second);
      const removed = rest.slice(1, 1 + 3 * rest[0]);
      return { ...head, moves, removed, added: rest.slice(1 + 3 * rest[0]) };
    }
    case "facets": {
      const places = new Uint16Array(4 * head.first);
      const features = new Uint32Array(head.first);
      for (let i = 0; i < head.first; i++) {
        for (let k = 0; k < 4; k++) places[4 * i + k] = view.getUint16(16 + 12 * i + 2 * k, true);
        features[i] = view.getUint32(24 + 12 * i, true);
      }
      return { ...head, places, features };
    }
    case "flow":
      return { ...head, places: u16(16, 2 * head.first), lengths: u32(16 + 4 * head.first, head.second) };
    default:
      return head;
  }
}

/**
 * A raw slice.
 * @param {ArrayBuffer} buffer
 */
export function readSlice(buffer) {
  const [width, height, step] = new Uint32Array(buffer, 0, 4);
  return { width, height, step, values: new Float32Array(buffer, 16) };
}

/**
 * Regions and parts, as region_view.rs lays them out. `corners` of a group are those of its triangles.
 * @param {ArrayBuffer} buffer
 */
export function readRegions(buffer) {
  const [places, triangles, parts, borders, count] = new Uint32Array(buffer, 0, 8);
  let at = 32;
  const u32 = (length) => {
    const numbers = new Uint32Array(buffer, at, length);
    at += 4 * length;
    return numbers;
  };
  const shown = { places: new Uint16Array(buffer, at, 2 * places), parts: null, borders: null, groups: [] };
  at += 4 * places;
  const corners = u32(3 * triangles);
  shown.parts = u32(2 * parts);
  shown.borders = u32(2 * borders);
  const groups = u32(2 * count);
  let start = 0;
  for (let i = 0; i < count; i++) {
    const end = start + 3 * groups[2 * i + 1];
    shown.groups.push({ region: groups[2 * i], corners: corners.subarray(start, end) });
    start = end;
  }
  return shown;
}

/**
 * The recorded iterations.
 * @param {ArrayBuffer} buffer
 */
export function readPlayback(buffer) {
  const [count, atoms, dimension, stride] = new Uint32Array(buffer, 0, 4);
  const energies = new Float32Array(buffer, 16, 2 * count);
  const start = 16 + 8 * count;
  const size = atoms * dimension;
  const frame = (i) => new Uint16Array(buffer.slice(start + 2 * size * i, start + 2 * size * (i + 1)));
  return { count, atoms, dimension, stride, energies, frame };
}
