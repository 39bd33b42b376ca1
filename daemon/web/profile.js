// @ts-check
/** The profile of a column: z over y, as a curve with gaps where nothing was measured. */

import { on, t } from './app.js';
import { axes, letters } from './axes.js';
import { attribute, h, text } from './dom.js';
import { fixed } from './format.js';

/** @typedef {import('./lattice.js').Lattice} Lattice */

export class Profile {
  constructor() {
    this.canvas = h('canvas', { role: 'img', 'aria-label': t('profile.title') });
    this.title = h('h2', null, t('profile.title'));
    this.frame = h('div', { class: 'frame low' }, this.canvas);
    this.element = h('div', { class: 'profile' }, this.title, this.frame);
    /** @type {Lattice | null} */
    this.lattice = null;
    /** @type {number | null} */
    this.i = null;
    /** @type {number | null} */
    this.yMm = null;
    /** What is drawn. */
    this.shown = '';
    this.pending = false;
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.frame);
    this.offTheme = on('theme', () => this.draw());
  }

  close() {
    this.observer.disconnect();
    this.offTheme();
  }

  /** @param {Lattice | null} lattice @param {number | null} i @param {number | null} yMm */
  show(lattice, i, yMm) {
    const key = `${i} ${yMm} ${lattice?.version}`;
    if (lattice === this.lattice && key === this.shown) return;
    Object.assign(this, { lattice, i, yMm, shown: key });
    this.draw();
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.paint();
    });
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.frame;
    if (width === 0 || height === 0) return;
    const ratio = devicePixelRatio || 1;
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    const g = this.canvas.getContext('2d');
    if (!g) return;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    const lattice = this.lattice;
    const points = lattice && this.i !== null ? lattice.profile(this.i) : [];
    const measured = points.filter((point) => point.zMm !== null);
    if (!lattice || this.i === null || measured.length === 0) {
      text(this.title, t('profile.title'));
      attribute(this.canvas, 'aria-label', `${t('profile.title')}: ${t('picture.none')}`);
      return;
    }
    const heights = measured.map((point) => /** @type {number} */ (point.zMm));
    const x = lattice.xMm(this.i);
    let [least, most] = [heights.reduce((a, b) => Math.min(a, b)), heights.reduce((a, b) => Math.max(a, b))];
    text(this.title, t('profile.at', { x: fixed(x, 2) }));
    attribute(this.canvas, 'aria-label', t('profile.alt', { x: fixed(x, 2), count: measured.length, least: fixed(least, 3), most: fixed(most, 3) }));
    const room = Math.max(0.05, (most - least) * 0.06);
    [least, most] = [least - room, most + room];
    const { yMin, yMax } = lattice.bounds;
    const em = letters();
    const [left, right, top, bottom] = [46 * em, width - 10 * em, 8 * em, height - 24 * em];
    const sy = (/** @type {number} */ y) => left + ((y - yMin) / (yMax - yMin)) * (right - left);
    const sz = (/** @type {number} */ z) => bottom - ((z - least) / (most - least)) * (bottom - top);
    const style = getComputedStyle(this.frame);
    axes(g, { xMin: yMin, xMax: yMax, yMin: least, yMax: most }, sy, sz, style.getPropertyValue('--picture-ink'), style.getPropertyValue('--picture-line'));
    g.strokeStyle = style.getPropertyValue('--accent');
    g.lineWidth = 1.6 * em;
    g.lineJoin = 'round';
    g.beginPath();
    let drawn = false;
    for (const { yMm, zMm } of points) {
      if (zMm === null) drawn = false;
      else {
        if (drawn) g.lineTo(sy(yMm), sz(zMm));
        else {
          g.moveTo(sy(yMm) - 0.8, sz(zMm));
          g.lineTo(sy(yMm), sz(zMm));
        }
        drawn = true;
      }
    }
    g.stroke();
    if (this.yMm !== null) {
      g.fillStyle = style.getPropertyValue('--picture-ink');
      g.fillRect(Math.round(sy(this.yMm)), top, 1, bottom - top);
    }
  }
}
