// The view in space: the three slices where they are, and the surfaces of features. Dragging turns it.

import { linked } from "./draw.js";
import { colorOf } from "./region_colors.js";

const VERTEX = `#version 300 es
  uniform mat3 turn;
  uniform vec2 fit;
  uniform vec3 box;
  layout(location = 0) in vec3 place;
  layout(location = 1) in vec4 color;
  out vec3 at;
  out vec4 tint;
  void main() {
    tint = color;
    vec3 p = turn * ((place - 0.5) * box);
    at = p;
    gl_Position = vec4(p.xy * fit, -p.z * 0.4, 1);
  }`;

const FRAGMENT = `#version 300 es
  precision highp float;
  uniform sampler2D values;
  uniform vec2 range;
  uniform bool isSlice;
  in vec3 at;
  in vec4 tint;
  out vec4 color;
  void main() {
    if (isSlice) {
      float t = clamp((texture(values, tint.xy).r - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
      color = vec4(vec3(0.12 + 0.88 * t), 0.6);
      return;
    }
    vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
    color = vec4(tint.rgb * (0.45 + 0.55 * abs(normal.z)), 1);
  }`;

/** Added to the number of a region, among those of features. */
const REGION = 1 << 15;

export class Space {
  /**
   * @param {any} app
   * @param {HTMLElement} parent
   */
  constructor(app, parent) {
    this.app = app;
    this.box = document.createElement("div");
    this.box.className = "view";
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("aria-label", "the slices and the surfaces of features and regions in space");
    this.label = document.createElement("span");
    this.label.className = "label";
    this.label.textContent = "drag to turn";
    this.box.append(this.canvas, this.label);
    parent.append(this.box);
    this.yaw = 0.6;
    this.pitch = 0.45;
    this.zoom = 1;
    this.textures = new Map();
    this.begin();
    this.bind();
  }

  begin() {
    const gl = this.canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
    this.gl = gl;
    const program = linked(gl, VERTEX, FRAGMENT);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.at = Object.fromEntries(["turn", "fit", "box", "range", "isSlice"].map((name) => [name, gl.getUniformLocation(program, name)]));
    this.buffers = [gl.createBuffer(), gl.createBuffer()];
  }

  bind() {
    let from = null;
    this.canvas.onpointerdown = (event) => {
      from = [event.offsetX, event.offsetY];
      this.canvas.setPointerCapture(event.pointerId);
    };
    this.canvas.onpointermove = (event) => {
      if (!from) return;
      this.yaw += (event.offsetX - from[0]) / 150;
      this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + (event.offsetY - from[1]) / 150));
      from = [event.offsetX, event.offsetY];
      this.app.redraw();
    };
    this.canvas.onpointerup = this.canvas.onpointercancel = () => (from = null);
    this.canvas.onwheel = (event) => {
      event.preventDefault();
      this.zoom = Math.max(0.2, Math.min(20, this.zoom * (event.deltaY < 0 ? 1.15 : 1 / 1.15)));
      this.app.redraw();
    };
  }

  reset() {
    [this.yaw, this.pitch, this.zoom] = [0.6, 0.45, 1];
  }

  remove() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.box.remove();
  }

  /** Fetches the surfaces, if there are newer ones. */
  async load() {
    const wanted = this.app.state?.shown;
    if (wanted === this.wanted) return;
    this.wanted = wanted;
    const answer = await fetch("/view/surface");
    if (wanted !== this.wanted) return;
    if (answer.status === 200) this.takeSurface(await answer.arrayBuffer());
    else if (this.app.state?.hash) this.surface = null;
    this.app.redraw();
  }

  takeSurface(buffer) {
    const [all] = new Uint32Array(buffer, 0, 1);
    let numbers = new Uint16Array(buffer, 4, 10 * all);
    // regions are closed: features would be hidden by them, and hide them
    const isRegion = (i) => numbers[10 * i + 9] >= REGION;
    const regions = Array.from({ length: all }, (_, i) => i).filter(isRegion);
    if (regions.length > 0) numbers = Uint16Array.from(regions.flatMap((i) => [...numbers.subarray(10 * i, 10 * i + 10)]));
    const count = numbers.length / 10;
    const places = new Float32Array(9 * count);
    const colors = new Uint8Array(12 * count);
    for (let i = 0; i < count; i++) {
      for (let k = 0; k < 9; k++) places[9 * i + k] = numbers[10 * i + k] / 65535;
      const color = colorOf(numbers[10 * i + 9] % REGION);
      for (let k = 0; k < 3; k++) colors.set([...color, 255], 12 * i + 4 * k);
    }
    this.surface = { count, places, colors };
  }

  draw() {
    const { gl, canvas, app } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.227, 0.243, 0.282, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const extent = app.shape.map((n, k) => Math.max(1, n - 1) * app.step[k]);
    const longest = Math.hypot(...extent);
    const least = Math.min(width, height);
    gl.uniform3fv(this.at.box, extent.map((x) => x / longest));
    gl.uniform2f(this.at.fit, (1.9 * this.zoom * least) / width, (1.9 * this.zoom * least) / height);
    gl.uniformMatrix3fv(this.at.turn, true, this.turn());
    if (this.surface) {
      gl.uniform1i(this.at.isSlice, 0);
      this.triangles(this.surface.places, this.surface.colors, gl.TRIANGLES, 3 * this.surface.count);
    }
    // slices are seen through, so that they hide no surface
    gl.depthMask(false);
    for (const view of app.views) this.drawSlice(view);
    gl.depthMask(true);
  }

  /** Rows: right, up, towards the eye. z points down on the screen, or up where it is a height. */
  turn() {
    const [s, c] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [r, f] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    const up = this.app.zUp ? 1 : -1;
    return [c, -s * up, 0, s * r, c * r * up, f * up, -s * f, -c * f * up, r * up];
  }

  drawSlice(view) {
    const slice = view.slices.image;
    if (!slice) return;
    const { gl } = this;
    let entry = this.textures.get(view.axis);
    if (!entry) {
      entry = { texture: gl.createTexture(), slice: null };
      this.textures.set(view.axis, entry);
    }
    gl.bindTexture(gl.TEXTURE_2D, entry.texture);
    if (entry.slice !== slice) {
      entry.slice = slice;
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, slice.width, slice.height, 0, gl.RED, gl.FLOAT, slice.values);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    }
    const [a, b] = view.axes;
    const places = new Float32Array(12);
    const colors = new Uint8Array(16);
    for (let i = 0; i < 4; i++) {
      const [u, v] = [i & 1, i >> 1];
      places[3 * i + a] = u;
      places[3 * i + b] = v;
      places[3 * i + view.axis] = this.app.cross[view.axis] / Math.max(1, this.app.shape[view.axis] - 1);
      colors.set([255 * u, 255 * v, 0, 255], 4 * i);
    }
    gl.uniform1i(this.at.isSlice, 1);
    gl.uniform2f(this.at.range, this.app.window[0], this.app.window[1]);
    this.triangles(places, colors, gl.TRIANGLE_STRIP, 4);
  }

  triangles(places, colors, kind, count) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, places, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[1]);
    gl.bufferData(gl.ARRAY_BUFFER, colors, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.drawArrays(kind, 0, count);
  }
}
