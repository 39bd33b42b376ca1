// @ts-check
/** The result in three dimensions, turned by mouse, touch and keys; faces are picked by click or list. */

import { on, t, word } from './app.js';
import { KINDS, kindColour, regionColour, deviationColour } from './colour.js';
import { fill, h, icon } from './dom.js';
import { fixed } from './format.js';
import { Orbit, STANDARD_VIEWS, meets } from './orbit.js';
import { EDGES, Scene, edgeColour, facesOf } from './scene.js';

/** @typedef {import('./scene.js').Face} Face */

export class Solid {
  /**
   * @param {import('./glb.js').Glb} glb
   * @param {(face: Face | null) => void} onPick
   */
  constructor(glb, onPick) {
    this.onPick = onPick;
    this.glb = glb;
    this.faces = facesOf(glb);
    this.camera = new Orbit();
    this.selected = -1;
    // Where all faces are of one kind, only regions tell them apart.
    const kinds = new Set(this.faces.map(({ kind }) => kind));
    this.options = { faces: true, edges: true, points: false, by: /** @type {'kind' | 'region'} */ (kinds.size > 1 ? 'kind' : 'region') };
    const left = glb.primitives.filter(({ mode }) => mode === 4);
    /** What is to fill the picture: the faces, or what there is without any. */
    this.seen = (left.length > 0 ? left : glb.primitives).map(({ attributes }) => attributes.POSITION);
    if (left.length === 0) this.options.points = true;
    /** The next picture is to show all of it; how, the size of the picture decides. */
    this.fitted = true;
    this.hasPoints = glb.primitives.some(({ mode }) => mode === 0);
    this.pending = false;
    this.canvas = h('canvas', { role: 'img', 'aria-label': t('solid.alt', { count: this.faces.length }) });
    this.frame = h('div', {
      class: 'frame solid', role: 'application', tabindex: '0', 'aria-label': t('solid.title'), 'aria-describedby': 'solid-help', 'aria-roledescription': t('solid.kind'),
    }, this.canvas);
    this.legend = h('div', { class: 'legend' });
    const why = glb.extras.faces_left_out;
    this.element = h('div', { class: 'picture' }, why ? h('p', { class: 'remark', lang: 'en' }, String(why)) : null, this.frame, h('p', { id: 'solid-help', class: 'help' }, t('solid.help')), this.tools(), this.legend);
    const gl = this.canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: false });
    /** @type {Scene | null} */
    this.scene = gl ? new Scene(gl, glb) : null;
    this.canvas.addEventListener('webglcontextlost', (/** @type {Event} */ event) => event.preventDefault());
    this.canvas.addEventListener('webglcontextrestored', () => {
      this.scene = gl ? new Scene(gl, glb) : null;
      this.draw();
    });
    if (!gl) fill(this.frame, h('p', { class: 'nothing' }, t('solid.no-webgl')));
    this.fit();
    this.listen();
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.frame);
    this.offTheme = on('theme', () => this.draw());
    this.tell();
  }

  close() {
    this.observer.disconnect();
    this.offTheme();
    // Browsers allow a few contexts only; a view that is gone gives its own back.
    this.scene?.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  fit() {
    this.fitted = true;
    this.draw();
  }

  /** @param {keyof STANDARD_VIEWS} view */
  look(view) {
    [this.camera.turnDeg, this.camera.tiltDeg] = STANDARD_VIEWS[view];
    this.fit();
  }

  tools() {
    const tick = (/** @type {'faces' | 'edges' | 'points'} */ name) => {
      const input = h('input', { type: 'checkbox', id: `solid-${name}`, checked: this.options[name] });
      input.addEventListener('change', () => {
        this.options[name] = input.checked;
        this.tell();
        this.draw();
      });
      return name === 'points' && !this.hasPoints ? null : h('span', { class: 'tick' }, input, h('label', { for: `solid-${name}` }, t(`solid.${name}`)));
    };
    const by = h('select', { 'aria-label': t('solid.by') }, ['kind', 'region'].map((one) => h('option', { value: one, selected: one === this.options.by }, t(`solid.by-${one}`))));
    by.addEventListener('change', () => {
      this.options.by = by.value;
      this.tell();
      this.draw();
    });
    const views = Object.keys(STANDARD_VIEWS).map((view) => h('button', { type: 'button', onclick: () => this.look(/** @type {keyof STANDARD_VIEWS} */ (view)) }, t(`solid.view-${view}`)));
    return h('div', { class: 'solid-tools' },
      h('div', { class: 'group', role: 'group', 'aria-label': t('solid.show') }, tick('faces'), tick('edges'), tick('points'), by),
      h('div', { class: 'group', role: 'group', 'aria-label': t('solid.views') }, h('button', { type: 'button', onclick: () => this.fit() }, icon('fit'), h('span', null, t('solid.fit'))), views));
  }

  listen() {
    const { frame, camera } = this;
    /** @type {Map<number, {x: number, y: number}>} */
    const fingers = new Map();
    let moved = 0;
    frame.addEventListener('pointerdown', (/** @type {PointerEvent} */ event) => {
      frame.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
      moved = fingers.size > 1 ? Infinity : 0;
    });
    frame.addEventListener('pointermove', (/** @type {PointerEvent} */ event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = { x: event.clientX, y: event.clientY };
      const [dx, dy] = [now.x - before.x, now.y - before.y];
      moved += Math.abs(dx) + Math.abs(dy);
      const size = frame.clientHeight || 1;
      if (fingers.size === 2) {
        const other = /** @type {{x: number, y: number}} */ ([...fingers].find(([id]) => id !== event.pointerId)?.[1]);
        const apart = (/** @type {{x: number, y: number}} */ a) => Math.hypot(a.x - other.x, a.y - other.y) || 1;
        camera.zoom(apart(before) / apart(now));
        camera.pan(-dx / size / 2, dy / size / 2);
      } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) camera.pan(-dx / size, dy / size);
      else camera.turn((-dx * 180) / size, (dy * 180) / size);
      fingers.set(event.pointerId, now);
      this.draw();
    });
    const up = (/** @type {PointerEvent} */ event) => {
      if (event.type === 'pointerup' && fingers.has(event.pointerId) && moved < 5 && event.button === 0) this.pick(event);
      fingers.delete(event.pointerId);
    };
    frame.addEventListener('pointerup', up);
    frame.addEventListener('pointercancel', up);
    frame.addEventListener('contextmenu', (/** @type {Event} */ event) => event.preventDefault());
    frame.addEventListener('wheel', (/** @type {WheelEvent} */ event) => {
      event.preventDefault();
      camera.zoom(Math.exp(Math.sign(event.deltaY) * Math.min(0.3, Math.abs(event.deltaY) * 0.0015)));
      this.draw();
    }, { passive: false });
    frame.addEventListener('keydown', (/** @type {KeyboardEvent} */ event) => {
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      const step = event.shiftKey ? 2 : 10;
      const acts = {
        ArrowLeft: () => camera.turn(-step, 0), ArrowRight: () => camera.turn(step, 0), ArrowUp: () => camera.turn(0, step), ArrowDown: () => camera.turn(0, -step),
        '+': () => camera.zoom(0.88), '=': () => camera.zoom(0.88), '-': () => camera.zoom(1 / 0.88), f: () => this.fit(), F: () => this.fit(),
        w: () => camera.pan(0, 0.05), s: () => camera.pan(0, -0.05), a: () => camera.pan(-0.05, 0), d: () => camera.pan(0.05, 0),
        Escape: () => this.select(-1),
      };
      const act = acts[/** @type {keyof acts} */ (event.key)];
      if (!act || (event.key === 'Escape' && this.selected < 0)) return;
      event.preventDefault();
      act();
      this.draw();
    });
  }

  /** @param {PointerEvent} event */
  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    const ray = this.camera.ray((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height, box.width / box.height);
    let best = -1;
    let nearest = Infinity;
    for (const [k, face] of this.faces.entries()) {
      const far = meets(ray, face.position, face.indices);
      if (far < nearest) [best, nearest] = [k, far];
    }
    this.select(best);
  }

  /** @param {number} k in `faces`; none if negative */
  select(k) {
    this.selected = k;
    this.onPick(this.faces[k] ?? null);
    this.draw();
  }

  draw() {
    if (this.pending || !this.scene) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      if (!this.element.isConnected || !this.scene) return;
      const ratio = Math.min(2, devicePixelRatio || 1);
      const [width, height] = [this.frame.clientWidth, this.frame.clientHeight].map((size) => Math.round(size * ratio));
      if (width === 0 || height === 0) return;
      if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
      if (this.fitted) this.camera.fit(this.seen, width / height);
      this.fitted = false;
      const style = getComputedStyle(this.frame);
      this.scene.draw(this.camera, {
        ...this.options, selected: this.selected, background: style.getPropertyValue('--stage').trim(), outline: style.getPropertyValue('--stage-ink').trim(),
      });
    });
  }

  /** The legend of what is shown. */
  tell() {
    const swatch = (/** @type {string} */ colour, /** @type {string} */ words, line = false) => {
      const box = h('span', { class: line ? 'swatch line' : 'swatch', 'aria-hidden': 'true' });
      box.style.background = colour;
      return h('li', null, box, words);
    };
    const { faces, edges, points, by } = this.options;
    const kinds = [...new Set(this.faces.map(({ kind }) => kind))].sort((a, b) => KINDS.indexOf(a) - KINDS.indexOf(b));
    const regions = [...new Set(this.faces.map(({ region }) => region))].sort((a, b) => a - b).slice(0, 20);
    const edgeKinds = Object.keys(EDGES).filter((kind) => this.glb.primitives.some(({ mode, extras }) => mode >= 1 && mode <= 3 && extras.kind === kind));
    const limit = this.scene?.limit ?? 0;
    const stops = Array.from({ length: 11 }, (_, k) => `rgb(${deviationColour(k / 10).join(' ')})`).join(', ');
    const bar = h('span', { class: 'gradient', 'aria-hidden': 'true' });
    bar.style.background = `linear-gradient(90deg, ${stops})`;
    fill(this.legend,
      faces ? h('ul', { 'aria-label': t('solid.faces') }, by === 'kind'
        ? kinds.map((kind) => swatch(kindColour(kind), word('kind', kind) || t('result.no-kind')))
        : regions.map((region) => swatch(regionColour(region), t('result.region', { label: region })))) : null,
      edges && edgeKinds.length > 0 ? h('ul', { 'aria-label': t('solid.edges') }, edgeKinds.map((kind) => swatch(kind === 'intersected' ? 'var(--stage-ink)' : edgeColour(kind), word('edge', kind), true))) : null,
      points ? h('div', { class: 'deviations' }, h('span', null, t('solid.deviation')), h('span', { class: 'figure' }, `${fixed(-limit, 3)}`), bar, h('span', { class: 'figure' }, `+${fixed(limit, 3)} mm`)) : null);
  }
}
