// @ts-check
/** A range image or deviation map on a canvas, with axes, legend, and a cursor that tells x, y and z. */

import { on, t } from './app.js';
import { axes, crosshair, letters } from './axes.js';
import { deviationColour, heightColour, table, ticks } from './colour.js';
import { attribute, h, text } from './dom.js';
import { fixed } from './format.js';

/** @typedef {import('./lattice.js').Lattice} Lattice */

const MARGIN = { left: 46, right: 10, top: 10, bottom: 30 };

let count = 0;

export class RangePicture {
  /**
   * @param {{
   *   label: string, deviation?: boolean, onCursor?: (picture: RangePicture) => void,
   * }} options a deviation map's lattice holds nanometres
   */
  constructor({ label, deviation = false, onCursor = () => {} }) {
    this.label = label;
    this.deviation = deviation;
    this.onCursor = onCursor;
    /** Millimetres for a thousand of the lattice's units. */
    this.factor = deviation ? 1e-3 : 1;
    this.digits = deviation ? 4 : 3;
    this.scale = deviation ? deviationColour : heightColour;
    this.colours = table(this.scale);
    /** @type {Lattice | null} */
    this.lattice = null;
    /** @type {[number, number] | null} */
    this.planMm = null;
    /** @type {number | null} */
    this.xMm = null;
    /** @type {{i: number, j: number} | null} */
    this.cursor = null;
    /** @type {[number, number] | null} */
    this.fixedRange = null;
    this.pending = false;
    /** What the pixels show, and how long it took to paint them. @type {any} */
    this.painted = null;
    this.pixels = document.createElement('canvas');
    this.build();
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.frame);
    this.offTheme = on('theme', () => this.draw());
  }

  close() {
    this.observer.disconnect();
    this.offTheme();
    clearTimeout(this.speaking);
    clearTimeout(this.later);
  }

  build() {
    count += 1;
    const help = `picture-help-${count}`;
    this.canvas = h('canvas', { role: 'img', 'aria-label': this.label });
    this.empty = h('p', { class: 'nothing' });
    this.frame = h('div', {
      class: 'frame', role: 'application', tabindex: '0', 'aria-label': this.label, 'aria-describedby': help,
      'aria-roledescription': t('picture.kind'),
    }, this.canvas, this.empty);
    this.readout = h('p', { class: 'readout' });
    this.spoken = h('p', { class: 'hidden', 'aria-live': 'polite' });
    this.bar = h('canvas', { class: 'bar', role: 'img' });
    this.limits = h('div', { class: 'limits', 'aria-hidden': 'true' });
    this.auto = h('input', { type: 'checkbox', id: `auto-${count}`, checked: true });
    const number = (/** @type {string} */ name) => h('input', { type: 'number', step: 'any', disabled: true, 'aria-label': t(`picture.${name}`) });
    this.least = number('least');
    this.most = number('most');
    this.auto.addEventListener('change', () => this.takeRange());
    for (const input of [this.least, this.most]) input.addEventListener('input', () => this.takeRange());
    const range = h('fieldset', { class: 'range' }, h('legend', null, t(this.deviation ? 'picture.deviation' : 'picture.height')),
      this.bar, this.limits,
      h('div', { class: 'set' }, this.auto, h('label', { for: `auto-${count}` }, t('picture.auto')), this.least, h('span', { 'aria-hidden': 'true' }, '\u2013'), this.most));
    this.element = h('div', { class: 'picture' }, this.frame, h('p', { id: help, class: 'hidden' }, t('picture.help')),
      h('div', { class: 'under' }, this.readout, this.spoken, range));
    this.listen();
    this.say();
  }

  listen() {
    const frame = this.frame;
    const point = (/** @type {PointerEvent} */ event) => {
      const box = this.canvas.getBoundingClientRect();
      const place = this.placeAt(event.clientX - box.left, event.clientY - box.top);
      if (place) this.setCursor(place.i, place.j);
    };
    frame.addEventListener('pointerdown', point);
    frame.addEventListener('pointermove', (/** @type {PointerEvent} */ event) => {
      if (event.pointerType === 'mouse' || event.buttons > 0) point(event);
    });
    frame.addEventListener('keydown', (/** @type {KeyboardEvent} */ event) => {
      const lattice = this.lattice;
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      if (!lattice || lattice.empty) return;
      const far = event.shiftKey ? 10 : 1;
      const moves = { ArrowLeft: [-far, 0], ArrowRight: [far, 0], ArrowUp: [0, far], ArrowDown: [0, -far] };
      const move = moves[/** @type {keyof moves} */ (event.key)];
      if (event.key === 'Escape' && this.cursor) this.clearCursor();
      else if (move) {
        const from = this.cursor ?? { i: lattice.i0 + (lattice.columns >> 1), j: lattice.j0 + (lattice.rows >> 1) };
        const step = this.cursor ? move : [0, 0];
        this.setCursor(
          Math.min(lattice.i0 + lattice.columns - 1, Math.max(lattice.i0, from.i + step[0])),
          Math.min(lattice.j0 + lattice.rows - 1, Math.max(lattice.j0, from.j + step[1])),
        );
        clearTimeout(this.speaking);
        this.speaking = setTimeout(() => text(this.spoken, this.readout.textContent ?? ''), 350);
      } else return;
      event.preventDefault();
    });
  }

  /** @param {Lattice | null} lattice @param {{planMm?: [number, number] | null, xMm?: number | null}} [more] */
  show(lattice, { planMm = null, xMm = null } = {}) {
    if (this.lattice && lattice !== this.lattice && lattice && this.cursor) {
      const { i, j } = lattice.nearest(this.lattice.xMm(this.cursor.i), this.lattice.yMm(this.cursor.j));
      this.cursor = { i, j };
    }
    this.lattice = lattice;
    this.planMm = planMm;
    this.xMm = xMm;
    this.draw();
  }

  /** @param {string} words what stands where there is no image yet */
  nothing(words) {
    text(this.empty, words);
  }

  /** @param {number} i @param {number} j */
  setCursor(i, j) {
    this.cursor = { i, j };
    this.draw();
    this.onCursor(this);
  }

  clearCursor() {
    this.cursor = null;
    this.draw();
    this.onCursor(this);
  }

  /** The place of the cursor in millimetres. @returns {{xMm: number, yMm: number, zMm: number | null, i: number} | null} */
  get place() {
    if (!this.cursor || !this.lattice) return null;
    const found = this.lattice.nearest(this.lattice.xMm(this.cursor.i), this.lattice.yMm(this.cursor.j));
    return { ...found, zMm: found.zMm === null ? null : found.zMm * this.factor };
  }

  takeRange() {
    const automatic = this.auto.checked;
    if (automatic) this.fixedRange = null;
    else {
      const shown = this.colourRange();
      if (this.least.value === '' && shown) this.least.value = shown[0].toFixed(this.digits - 1);
      if (this.most.value === '' && shown) this.most.value = shown[1].toFixed(this.digits - 1);
      const [a, b] = [Number(this.least.value), Number(this.most.value)];
      this.fixedRange = b > a ? [a, b] : null;
      attribute(this.most, 'aria-invalid', b > a ? null : 'true');
    }
    for (const input of [this.least, this.most]) input.disabled = automatic;
    this.draw();
  }

  /** Limits of the colours, millimetres. @returns {[number, number] | null} */
  colourRange() {
    if (this.fixedRange) return this.fixedRange;
    const lattice = this.lattice;
    if (!lattice) return null;
    if (this.known?.lattice !== lattice || this.known.version !== lattice.version) {
      this.known = { lattice, version: lattice.version, range: lattice.range(this.deviation ? 0.005 : 0.002) };
    }
    const { range } = this.known;
    if (!range) return null;
    let [least, most] = [range[0] * this.factor, range[1] * this.factor];
    if (this.deviation) {
      most = Math.max(Math.abs(least), Math.abs(most), 1e-4);
      least = -most;
    }
    return most - least < 1e-3 * this.factor ? [least - 5e-4, most + 5e-4] : [least, most];
  }

  /** The node under a place of the canvas. @param {number} left @param {number} top */
  placeAt(left, top) {
    if (!this.shown || !this.lattice || this.lattice.empty) return null;
    const { x0, y0, perMm } = this.shown;
    return this.lattice.nearest((left - x0) / perMm, (y0 - top) / perMm);
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      if (this.element.isConnected) this.paint();
    });
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (width === 0 || height === 0) return;
    const ratio = devicePixelRatio || 1;
    const [w, hgt] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== hgt) Object.assign(this.canvas, { width: w, height: hgt });
    const g = this.canvas.getContext('2d');
    if (!g) return;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    const lattice = this.lattice;
    const there = Boolean(lattice && !lattice.empty);
    this.empty.hidden = there;
    this.element.dataset.empty = String(!there);
    this.say();
    if (!lattice || !there) return;
    const bounds = lattice.bounds;
    const xMin = Math.min(bounds.xMin, this.planMm?.[0] ?? Infinity);
    const xMax = Math.max(bounds.xMax, this.planMm?.[1] ?? -Infinity);
    // In tens, so that the picture does not jump with each column.
    const [yMin, yMax] = this.planMm ? [Math.floor(bounds.yMin / 10) * 10, Math.ceil(bounds.yMax / 10) * 10] : [bounds.yMin, bounds.yMax];
    const em = letters();
    const inner = { w: width - (MARGIN.left + MARGIN.right) * em, h: height - (MARGIN.top + MARGIN.bottom) * em };
    const perMm = Math.min(inner.w / (xMax - xMin), inner.h / (yMax - yMin));
    const x0 = MARGIN.left * em + (inner.w - (xMax - xMin) * perMm) / 2 - xMin * perMm;
    const y0 = MARGIN.top * em + (inner.h + (yMax - yMin) * perMm) / 2 + yMin * perMm;
    this.shown = { x0, y0, perMm };
    const sx = (/** @type {number} */ x) => x0 + x * perMm;
    const sy = (/** @type {number} */ y) => y0 - y * perMm;
    const { range, box } = this.paintPixels();
    g.imageSmoothingEnabled = false;
    g.drawImage(this.pixels, sx(box.xMin), sy(box.yMax), (box.xMax - box.xMin) * perMm, (box.yMax - box.yMin) * perMm);
    const style = getComputedStyle(this.frame);
    const [ink, line] = [style.getPropertyValue('--picture-ink'), style.getPropertyValue('--picture-line')];
    axes(g, { xMin, xMax, yMin, yMax }, sx, sy, ink, line);
    if (this.xMm !== null && this.xMm >= xMin && this.xMm <= xMax) {
      g.fillStyle = style.getPropertyValue('--laser');
      g.fillRect(sx(this.xMm) - 1, sy(yMax), 2, (yMax - yMin) * perMm);
    }
    if (this.cursor) {
      crosshair(g, sx(lattice.xMm(this.cursor.i)), sy(lattice.yMm(this.cursor.j)), sx(xMin), sx(xMax), sy(yMax), sy(yMin));
    }
    this.paintBar(range, style);
  }

  /**
   * Paints the pixels where they are of before. A large image that grows is painted as often as leaves the
   * page three quarters of its time.
   * @returns {{range: [number, number], box: Lattice['bounds']}} what they show
   */
  paintPixels() {
    const lattice = /** @type {Lattice} */ (this.lattice);
    const before = this.painted;
    const now = performance.now();
    if (before?.lattice === lattice && before.fixedRange === this.fixedRange) {
      if (before.version === lattice.version) return before;
      const wait = before.at + 3 * before.cost - now;
      if (wait > 0) {
        clearTimeout(this.later);
        this.later = setTimeout(() => this.draw(), wait);
        return before;
      }
    }
    const range = this.colourRange() ?? [0, 1];
    Object.assign(this.pixels, { width: lattice.columns, height: lattice.rows });
    const g = this.pixels.getContext('2d');
    if (g) {
      const image = g.createImageData(lattice.columns, lattice.rows);
      lattice.paint(new Uint32Array(image.data.buffer), this.colours, range[0] / this.factor, range[1] / this.factor);
      g.putImageData(image, 0, 0);
    }
    const at = performance.now();
    this.painted = { lattice, version: lattice.version, fixedRange: this.fixedRange, range, box: lattice.bounds, at, cost: at - now };
    return this.painted;
  }

  /** @param {[number, number]} range @param {CSSStyleDeclaration} style */
  paintBar(range, style) {
    const key = `${range} ${this.bar.clientWidth}`;
    if (this.barKey === key) return;
    this.barKey = key;
    Object.assign(this.bar, { width: 256, height: 1 });
    const g = this.bar.getContext('2d');
    if (!g) return;
    const image = g.createImageData(256, 1);
    new Uint32Array(image.data.buffer).set(this.colours);
    g.putImageData(image, 0, 0);
    const digits = this.deviation ? 3 : range[1] - range[0] < 2 ? 2 : 1;
    attribute(this.bar, 'aria-label', t('picture.legend', { least: fixed(range[0], digits), most: fixed(range[1], digits) }));
    this.limits.replaceChildren(...ticks(range[0], range[1], 4).map((value) => {
      const tick = h('span', null, fixed(value, this.deviation ? 3 : value % 1 === 0 ? 0 : 2));
      tick.style.left = `${(100 * (value - range[0])) / (range[1] - range[0])}%`;
      return tick;
    }));
  }

  say() {
    const place = this.place;
    const lattice = this.lattice;
    const figure = (/** @type {string} */ name, /** @type {number | null} */ value, /** @type {number} */ digits) => h('span', null,
      h('b', null, name), h('span', { class: 'figure' }, fixed(value, digits)), ' mm ');
    if (place) {
      this.readout.replaceChildren(figure('x ', place.xMm, 2), figure('y ', place.yMm, 2), figure(this.deviation ? '\u0394 ' : 'z ', place.zMm, this.digits));
    } else if (lattice && !lattice.empty) {
      text(this.readout, t('picture.nodes', { count: lattice.nodes, shown: lattice.nodes.toLocaleString(document.documentElement.lang), pitch: fixed(lattice.spacingMm, 3) }));
    } else text(this.readout, '\u00a0');
    const range = lattice && !lattice.empty ? this.colourRange() : null;
    attribute(this.canvas, 'aria-label', range && lattice
      ? t('picture.alt', { label: this.label, count: lattice.nodes, least: fixed(range[0], this.digits), most: fixed(range[1], this.digits) })
      : `${this.label}: ${t('picture.none')}`);
  }
}
