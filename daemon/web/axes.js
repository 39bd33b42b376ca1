// @ts-check
/** Axes in millimetres around a picture, and the cursor in it. */

import { ticks } from './colour.js';
import { fixed } from './format.js';

/** How much larger than usual letters are: canvases follow the page. */
export const letters = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 16;

/**
 * @param {CanvasRenderingContext2D} g @param {{xMin: number, xMax: number, yMin: number, yMax: number}} box
 * @param {(x: number) => number} sx @param {(y: number) => number} sy @param {string} ink @param {string} line
 */
export function axes(g, box, sx, sy, ink, line) {
  const [left, right, top, bottom] = [sx(box.xMin), sx(box.xMax), sy(box.yMax), sy(box.yMin)];
  g.strokeStyle = line;
  g.lineWidth = 1;
  g.strokeRect(Math.round(left) + 0.5, Math.round(top) + 0.5, Math.round(right - left) - 1, Math.round(bottom - top) - 1);
  g.fillStyle = ink;
  const em = letters();
  g.font = `${11.5 * em}px system-ui, sans-serif`;
  g.textAlign = 'center';
  g.textBaseline = 'top';
  for (const x of ticks(box.xMin, box.xMax, (right - left) / (70 * em))) {
    g.fillRect(Math.round(sx(x)), bottom, 1, 4);
    g.fillText(fixed(x, x % 1 === 0 ? 0 : 1), sx(x), bottom + 6 * em);
  }
  g.textAlign = 'right';
  g.textBaseline = 'middle';
  for (const y of ticks(box.yMin, box.yMax, (bottom - top) / (45 * em))) {
    g.fillRect(left - 4, Math.round(sy(y)), 4, 1);
    g.fillText(fixed(y, y % 1 === 0 ? 0 : 1), left - 7, sy(y));
  }
}

/**
 * @param {CanvasRenderingContext2D} g @param {number} x @param {number} y @param {number} left @param {number} right @param {number} top @param {number} bottom
 */
export function crosshair(g, x, y, left, right, top, bottom) {
  // Dark under light, so that it is seen on every colour.
  for (const [colour, width] of /** @type {[string, number][]} */ ([['#000000b0', 3], ['#ffffff', 1]])) {
    g.strokeStyle = colour;
    g.lineWidth = width;
    g.beginPath();
    g.moveTo(x, top);
    g.lineTo(x, y - 7);
    g.moveTo(x, y + 7);
    g.lineTo(x, bottom);
    g.moveTo(left, y);
    g.lineTo(x - 7, y);
    g.moveTo(x + 7, y);
    g.lineTo(right, y);
    g.stroke();
    g.strokeRect(x - 4, y - 4, 8, 8);
  }
}
