// @ts-check
/** What WebGL draws of a result: faces, edges and nodes, with the programs that colour them. */

import { deviationColour, fraction, kindColour, regionColour } from './colour.js';

/** @typedef {import('./glb.js').Glb} Glb */
/** @typedef {{face: number, region: number, kind: string, position: Float32Array, indices: Uint32Array}} Face */

const FACE_VERTEX = `#version 300 es
in vec3 position; in vec3 normal;
uniform mat4 matrix;
out vec3 n;
void main() { n = normal; gl_Position = matrix * vec4(position, 1.0); }`;

const FACE_FRAGMENT = `#version 300 es
precision highp float;
in vec3 n;
uniform vec3 colour; uniform vec3 light; uniform vec3 view; uniform float lifted;
out vec4 result;
void main() {
  vec3 m = normalize(n);
  if (dot(m, view) < 0.0) m = -m;
  float diffuse = 0.42 + 0.58 * max(0.0, dot(m, light));
  float shine = pow(max(0.0, dot(m, normalize(light + view))), 24.0) * 0.16;
  result = vec4(mix(colour * diffuse + shine, vec3(1.0), lifted), 1.0);
}`;

const LINE_VERTEX = `#version 300 es
in vec3 position;
uniform mat4 matrix; uniform float nearer;
void main() { gl_Position = matrix * vec4(position, 1.0); gl_Position.z -= nearer * gl_Position.w; }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 colour;
out vec4 result;
void main() { result = vec4(colour, 1.0); }`;

const POINT_VERTEX = `#version 300 es
in vec3 position; in vec3 tint;
uniform mat4 matrix; uniform float size;
out vec3 c;
void main() { c = tint; gl_Position = matrix * vec4(position, 1.0); gl_Position.z -= 0.0004 * gl_Position.w; gl_PointSize = max(1.5, size / gl_Position.w); }`;

const POINT_FRAGMENT = `#version 300 es
precision highp float;
in vec3 c;
out vec4 result;
void main() { result = vec4(c, 1.0); }`;

/** Colours of edges by how it is known where they run; dark and light theme have the same. */
export const EDGES = { measured: '#2f7fd0', intersected: '#8a8f94', assumed: '#d98324' };

/** @param {string} kind */
export const edgeColour = (kind) => EDGES[/** @type {keyof EDGES} */ (kind)] ?? EDGES.intersected;

/**
 * The largest deviation that has a colour of its own: as the file says, or what 99 of 100 nodes lie within.
 * @param {Glb} glb
 */
export function deviationLimit(glb) {
  /** @type {number[]} */
  const sizes = [];
  for (const { attributes, extras } of glb.primitives) {
    const deviation = attributes._DEVIATION;
    if (!deviation) continue;
    if (Number(extras.limit_mm) > 0) return Number(extras.limit_mm);
    const step = Math.max(1, Math.floor(deviation.length / 50000));
    for (let k = 0; k < deviation.length; k += step) sizes.push(Math.abs(deviation[k]));
  }
  sizes.sort((a, b) => a - b);
  return Math.max(1e-4, sizes[Math.floor(0.99 * (sizes.length - 1))] ?? 0);
}

/** Faces of a result, for picking and for lists. @param {Glb} glb @returns {Face[]} */
export function facesOf(glb) {
  return glb.primitives.filter(({ mode, mesh }) => mode === 4 && mesh !== 'edges').map(({ extras, attributes, indices }, k) => ({
    face: Number(extras.face ?? k), region: Number(extras.region ?? k + 1), kind: String(extras.kind ?? ''), position: attributes.POSITION, indices,
  }));
}

export class Scene {
  /** @param {WebGL2RenderingContext} gl @param {Glb} glb */
  constructor(gl, glb) {
    this.gl = gl;
    this.programs = {
      face: program(gl, FACE_VERTEX, FACE_FRAGMENT), line: program(gl, LINE_VERTEX, LINE_FRAGMENT), point: program(gl, POINT_VERTEX, POINT_FRAGMENT),
    };
    this.limit = deviationLimit(glb);
    /** @type {any[]} */ this.faces = [];
    /** @type {any[]} */ this.edges = [];
    /** @type {any[]} */ this.points = [];
    this.spacingMm = 1;
    for (const { mode, mesh, extras, attributes, indices, count } of glb.primitives) {
      const position = attributes.POSITION;
      if (mode === 4 && mesh !== 'edges') {
        const normal = attributes.NORMAL ?? flat(position, indices);
        this.faces.push({ array: this.array(this.programs.face, { position, normal }, indices), count: indices.length, kind: String(extras.kind ?? ''), region: Number(extras.region ?? 1) });
      } else if (mode >= 1 && mode <= 3) {
        this.edges.push({ array: this.array(this.programs.line, { position }, indices), count: indices.length, mode, kind: String(extras.kind ?? '') });
      } else if (mode === 0) {
        this.spacingMm = Number(extras.pitch_mm ?? 1) * Number(extras.step ?? 1);
        this.points.push({ array: this.array(this.programs.point, { position, tint: tints(attributes._DEVIATION, count, this.limit) }, null), count });
      }
    }
  }

  /** @param {WebGLProgram} of @param {Record<string, Float32Array>} attributes @param {Uint32Array | null} indices */
  array(of, attributes, indices) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [name, data] of Object.entries(attributes)) {
      const place = gl.getAttribLocation(of, name);
      if (place < 0) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    }
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    gl.bindVertexArray(null);
    return array;
  }

  /**
   * @param {import('./orbit.js').Orbit} camera
   * @param {{faces: boolean, edges: boolean, points: boolean, by: 'kind' | 'region', selected: number, background: string, outline: string}} options
   */
  draw(camera, { faces, edges, points, by, selected, background, outline }) {
    const { gl } = this;
    const { width, height } = gl.canvas;
    const matrix = camera.matrix(width / height);
    gl.viewport(0, 0, width, height);
    gl.clearColor(...fraction(background), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const set = (/** @type {WebGLProgram} */ of, /** @type {string} */ name) => gl.getUniformLocation(of, name);
    if (faces) {
      const of = this.programs.face;
      const { x, y, z } = camera.axes;
      const light = [0, 1, 2].map((k) => z[k] * 0.8 + y[k] * 0.45 - x[k] * 0.4);
      const length = Math.hypot(...light);
      gl.useProgram(of);
      gl.uniformMatrix4fv(set(of, 'matrix'), false, matrix);
      gl.uniform3fv(set(of, 'light'), light.map((part) => part / length));
      gl.uniform3fv(set(of, 'view'), z);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(1, 1);
      for (const [k, face] of this.faces.entries()) {
        gl.uniform3fv(set(of, 'colour'), fraction(by === 'kind' ? kindColour(face.kind) : regionColour(face.region)));
        gl.uniform1f(set(of, 'lifted'), k === selected ? 0.35 : 0);
        gl.bindVertexArray(face.array);
        gl.drawElements(gl.TRIANGLES, face.count, gl.UNSIGNED_INT, 0);
      }
      gl.disable(gl.POLYGON_OFFSET_FILL);
    }
    if (edges) {
      const of = this.programs.line;
      gl.useProgram(of);
      gl.uniformMatrix4fv(set(of, 'matrix'), false, matrix);
      gl.uniform1f(set(of, 'nearer'), 0.0008);
      for (const edge of this.edges) {
        gl.uniform3fv(set(of, 'colour'), fraction(edge.kind === 'intersected' || edge.kind === '' ? outline : edgeColour(edge.kind)));
        gl.bindVertexArray(edge.array);
        gl.drawElements(edge.mode, edge.count, gl.UNSIGNED_INT, 0);
      }
    }
    if (points) {
      const of = this.programs.point;
      gl.useProgram(of);
      gl.uniformMatrix4fv(set(of, 'matrix'), false, matrix);
      const [, fy] = camera.focal(width / height);
      gl.uniform1f(set(of, 'size'), this.spacingMm * fy * height * 0.5);
      for (const one of this.points) {
        gl.bindVertexArray(one.array);
        gl.drawArrays(gl.POINTS, 0, one.count);
      }
    }
    gl.bindVertexArray(null);
  }
}

/** @param {WebGL2RenderingContext} gl @param {string} vertex @param {string} fragment */
function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]])) {
    const shader = gl.createShader(kind);
    if (!made || !shader) throw new Error('the graphics driver gives no program');
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) ?? 'the graphics driver refuses a program');
  return made;
}

/** Colours of points; those without a deviation are grey. @param {Float32Array | undefined} deviation @param {number} count @param {number} limit */
function tints(deviation, count, limit) {
  const colours = new Float32Array(3 * count).fill(0.55);
  if (deviation) {
    for (let k = 0; k < count; k += 1) {
      const [r, g, b] = deviationColour(0.5 + (0.5 * deviation[k]) / limit);
      colours[3 * k] = r / 255;
      colours[3 * k + 1] = g / 255;
      colours[3 * k + 2] = b / 255;
    }
  }
  return colours;
}

/** Normals of vertices where a file has none. @param {Float32Array} p @param {Uint32Array} indices */
function flat(p, indices) {
  const normal = new Float32Array(p.length);
  for (let k = 0; k + 2 < indices.length; k += 3) {
    const [a, b, c] = [3 * indices[k], 3 * indices[k + 1], 3 * indices[k + 2]];
    const u = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
    const v = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    for (const vertex of [a, b, c]) for (let r = 0; r < 3; r += 1) normal[vertex + r] += n[r];
  }
  return normal;
}
