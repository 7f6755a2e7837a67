// Drawing with WebGL2: an image through a window, a field over it, edges, thick segments and points.

const VERTEX = {
  image: `#version 300 es
    uniform vec2 scale, shift;
    out vec2 at;
    void main() {
      vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
      at = corner;
      gl_Position = vec4(corner * scale + shift, 0, 1);
    }`,
  lines: `#version 300 es
    uniform vec2 scale, shift;
    layout(location = 0) in vec2 place;
    void main() { gl_Position = vec4(place * scale + shift, 0, 1); }`,
  points: `#version 300 es
    uniform vec2 scale, shift;
    uniform float size;
    layout(location = 0) in vec2 place;
    layout(location = 1) in vec4 color;
    out vec4 tint;
    void main() {
      tint = color;
      gl_PointSize = color.a > 0.0 ? size : 0.0;
      gl_Position = color.a > 0.0 ? vec4(place * scale + shift, 0, 1) : vec4(2, 2, 2, 1);
    }`,
  thick: `#version 300 es
    uniform vec2 scale, shift, pixel;
    uniform float width;
    layout(location = 0) in vec4 ends;
    layout(location = 1) in vec4 color;
    out vec4 tint;
    void main() {
      tint = color;
      vec2 a = ends.xy * scale + shift, b = ends.zw * scale + shift;
      vec2 along = (b - a) / pixel;
      vec2 across = normalize(vec2(-along.y, along.x) + vec2(1e-6, 0)) * pixel * width;
      vec2 end = (gl_VertexID & 1) == 0 ? a : b;
      gl_Position = vec4(end + ((gl_VertexID & 2) == 0 ? across : -across), 0, 1);
    }`,
};

const FRAGMENT = {
  image: `#version 300 es
    precision highp float;
    uniform sampler2D values;
    uniform vec2 range;
    uniform int ramp;
    uniform float opacity;
    in vec2 at;
    out vec4 color;
    vec3 viridis(float t) {
      vec3 a = vec3(0.267, 0.005, 0.329), b = vec3(0.128, 0.567, 0.551), c = vec3(0.993, 0.906, 0.144);
      return t < 0.5 ? mix(a, b, 2.0 * t) : mix(b, c, 2.0 * t - 1.0);
    }
    void main() {
      float v = texture(values, at).r;
      float t = clamp((v - range.x) / max(range.y - range.x, 1e-30), 0.0, 1.0);
      if (ramp == 0) color = vec4(vec3(isnan(v) ? 0.0 : t), 1);
      else if (ramp == 1) color = vec4(1.0, 0.25, 0.1, opacity * abs(v));
      else color = vec4(viridis(t), opacity);
      color.rgb *= color.a;
    }`,
  lines: `#version 300 es
    precision highp float;
    uniform vec4 ink;
    out vec4 color;
    void main() { color = vec4(ink.rgb * ink.a, ink.a); }`,
  points: `#version 300 es
    precision highp float;
    in vec4 tint;
    out vec4 color;
    void main() {
      float r = length(gl_PointCoord - 0.5);
      if (r > 0.5) discard;
      color = r > 0.36 ? vec4(0, 0, 0, 1) : vec4(tint.rgb, 1);
    }`,
  thick: `#version 300 es
    precision highp float;
    in vec4 tint;
    out vec4 color;
    void main() { color = vec4(tint.rgb * tint.a, tint.a); }`,
};

/**
 * A program of two shaders.
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex
 * @param {string} fragment
 */
export function linked(gl, vertex, fragment) {
  const program = gl.createProgram();
  /** @type {[number, string][]} */
  const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]];
  for (const [kind, source] of shaders) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

/** Puts pictures of one view into its canvas. */
export class Drawing {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL2");
    this.gl = gl;
    this.canvas = canvas;
    /** @type {Record<string, {program: WebGLProgram, at: (name: string) => WebGLUniformLocation | null}>} */
    this.programs = {};
    for (const name of Object.keys(VERTEX)) this.programs[name] = this.program(VERTEX[name], FRAGMENT[name]);
    this.buffers = new Map();
    this.textures = new Map();
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = linked(gl, vertex, fragment);
    const known = new Map();
    const at = (name) => {
      if (!known.has(name)) known.set(name, gl.getUniformLocation(program, name));
      return known.get(name);
    };
    return { program, at };
  }

  /** Begins a picture, as large as the canvas is shown. */
  begin() {
    const { gl, canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.067, 0.075, 0.09, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /** Keeps a slice as a texture, by name. */
  texture(name, slice) {
    const gl = this.gl;
    const texture = this.textures.get(name) || gl.createTexture();
    this.textures.set(name, texture);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, slice.width, slice.height, 0, gl.RED, gl.FLOAT, slice.values);
    for (const [key, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
    ]) gl.texParameteri(gl.TEXTURE_2D, key, value);
  }

  /** Forgets a texture. */
  forget(name) {
    this.gl.deleteTexture(this.textures.get(name) || null);
    this.textures.delete(name);
  }

  /**
   * Draws a texture over the rectangle that `to` makes of 0…1.
   * @param {string} name
   * @param {{scale: number[], shift: number[]}} to
   * @param {number[]} range what is black and what is white
   * @param {number} ramp 0 grey, 1 red by strength, 2 colours
   * @param {number} opacity
   */
  image(name, to, range, ramp, opacity) {
    const texture = this.textures.get(name);
    if (!texture) return;
    const { gl } = this;
    const { program, at } = this.programs.image;
    this.use(program, at, to);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform2f(at("range"), range[0], range[1]);
    gl.uniform1i(at("ramp"), ramp);
    gl.uniform1f(at("opacity"), opacity);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  use(program, at, to) {
    this.gl.useProgram(program);
    this.gl.uniform2f(at("scale"), to.scale[0], to.scale[1]);
    this.gl.uniform2f(at("shift"), to.shift[0], to.shift[1]);
  }

  /** A buffer with this data, made again where the data are others. */
  buffer(name, target, data) {
    const gl = this.gl;
    let entry = this.buffers.get(name);
    if (!entry) {
      entry = { buffer: gl.createBuffer(), data: null };
      this.buffers.set(name, entry);
    }
    gl.bindBuffer(target, entry.buffer);
    if (entry.data !== data) {
      gl.bufferData(target, data, gl.DYNAMIC_DRAW);
      entry.data = data;
    }
  }

  array() {
    const gl = this.gl;
    if (!this.vertexArray) this.vertexArray = gl.createVertexArray();
    gl.bindVertexArray(this.vertexArray);
    for (let k = 0; k < 2; k++) {
      gl.disableVertexAttribArray(k);
      gl.vertexAttribDivisor(k, 0);
    }
  }

  /**
   * Draws edges between places.
   * @param {string} name
   * @param {Uint16Array | Float32Array} places two numbers each, 0…65535 or 0…1
   * @param {Uint32Array} edges two places each
   * @param {{scale: number[], shift: number[]}} to
   * @param {number[]} ink red, green, blue, opacity
   */
  edges(name, places, edges, to, ink) {
    this.elements(this.gl.LINES, name, places, edges, to, ink);
  }

  /**
   * Fills triangles between places.
   * @param {string} name
   * @param {Uint16Array | Float32Array} places
   * @param {Uint32Array} corners three places each
   * @param {{scale: number[], shift: number[]}} to
   * @param {number[]} ink
   */
  triangles(name, places, corners, to, ink) {
    this.elements(this.gl.TRIANGLES, name, places, corners, to, ink);
  }

  elements(mode, name, places, numbers, to, ink) {
    if (numbers.length === 0) return;
    this.setUp(name, places, to, ink);
    this.buffer(`${name} elements`, this.gl.ELEMENT_ARRAY_BUFFER, numbers);
    this.gl.drawElements(mode, numbers.length, this.gl.UNSIGNED_INT, 0);
  }

  /** Sets up what is drawn in one ink between places. */
  setUp(name, places, to, ink) {
    const { program, at } = this.programs.lines;
    this.array();
    this.use(program, at, to);
    this.gl.uniform4fv(at("ink"), ink);
    this.places(`${name} places`, places);
  }

  places(name, places) {
    const { gl } = this;
    this.buffer(name, gl.ARRAY_BUFFER, places);
    gl.enableVertexAttribArray(0);
    const isWhole = places instanceof Uint16Array;
    gl.vertexAttribPointer(0, 2, isWhole ? gl.UNSIGNED_SHORT : gl.FLOAT, isWhole, 0, 0);
  }

  /** Draws polylines of so many places each. */
  strips(name, places, lengths, to, ink) {
    const { gl } = this;
    this.setUp(name, places, to, ink);
    let start = 0;
    for (const length of lengths) {
      gl.drawArrays(gl.LINE_STRIP, start, length);
      start += length;
    }
  }

  /** Draws round points; colours are four bytes each, of opacity 0 for one that is not there. */
  points(name, places, colors, to, size) {
    if (places.length === 0) return;
    const { gl } = this;
    const { program, at } = this.programs.points;
    this.array();
    this.use(program, at, to);
    gl.uniform1f(at("size"), size * (window.devicePixelRatio || 1));
    this.places(`${name} places`, places);
    this.buffer(`${name} colors`, gl.ARRAY_BUFFER, colors);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.drawArrays(gl.POINTS, 0, places.length / 2);
  }

  /** Draws segments of a width in pixels, each of four numbers and a colour. */
  segments(name, ends, colors, to, width) {
    if (ends.length === 0) return;
    const { gl, canvas } = this;
    const { program, at } = this.programs.thick;
    this.array();
    this.use(program, at, to);
    gl.uniform2f(at("pixel"), 2 / canvas.width, 2 / canvas.height);
    gl.uniform1f(at("width"), (width / 2) * (window.devicePixelRatio || 1));
    const isWhole = ends instanceof Uint16Array;
    this.buffer(`${name} ends`, gl.ARRAY_BUFFER, ends);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, isWhole ? gl.UNSIGNED_SHORT : gl.FLOAT, isWhole, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    this.buffer(`${name} colors`, gl.ARRAY_BUFFER, colors);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.vertexAttribDivisor(1, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, ends.length / 4);
  }
}
