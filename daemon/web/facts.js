// @ts-check
/** What report.json says, put in order for people: parameters of shapes, the figures of a result. Pure. */

import { fixed, withUncertainty } from './format.js';

/**
 * Parameters of a region's shape with their standard uncertainties.
 * @param {any} region of report.json
 * @returns {{key: string, text: string}[]} keys of strings, and the figures
 */
export function parameters(region) {
  const numbers = region?.shape?.numbers;
  if (!numbers) return [];
  /** @type {{key: string, text: string}[]} */
  const found = [];
  const one = (/** @type {string} */ key, /** @type {any} */ quantity, /** @type {string} */ unit) => {
    if (!quantity) return;
    const { value, uncertainty } = withUncertainty(quantity.value, quantity.uncertainty);
    found.push({ key, text: `${value} \u00b1 ${uncertainty} ${unit}` });
  };
  one('radius', numbers.radius_mm, 'mm');
  one('tube-radius', numbers.tube_radius_mm, 'mm');
  one('half-angle', numbers.half_angle_deg, '\u00b0');
  const family = region.shape.family;
  const place = { sphere: 'centre', torus: 'centre', cone: 'apex' }[/** @type {string} */ (family)] ?? 'point';
  if (numbers.point_mm) found.push({ key: place, text: `(${vector(numbers.point_mm, numbers.point_uncertainty_mm)}) \u00b1 ${short(numbers.point_uncertainty_mm)} mm` });
  if (numbers.direction) {
    const key = family === 'plane' ? 'normal' : family === 'extrusion' ? 'direction' : 'axis';
    found.push({ key, text: `(${numbers.direction.map((/** @type {number} */ part) => fixed(part, 5)).join(', ')}) \u00b1 ${short(numbers.direction_uncertainty_deg)}\u00b0` });
  }
  if (numbers.profile) found.push({ key: 'profile', text: `\u00b1 ${short(numbers.profile.uncertainty_mm)} mm` });
  return found;
}

/** Two digits of an uncertainty. @param {number | null | undefined} value */
function short(value) {
  return value === null || value === undefined ? fixed(null, 0) : withUncertainty(value, value).uncertainty;
}

/** @param {number[]} parts @param {number} uncertainty */
const vector = (parts, uncertainty) => parts.map((part) => withUncertainty(part, uncertainty).value).join(', ');

/**
 * A lattice's columns of the deviations of a result's nodes, in nanometres so that nothing is lost
 * in whole numbers.
 * @param {import('./glb.js').Glb} glb
 * @returns {{pitch_mm: number, step: number, columns: import('./lattice.js').LiveColumn[]} | null}
 */
export function deviationImage(glb) {
  const nodes = glb.primitives.filter(({ mode, attributes }) => mode === 0 && attributes._DEVIATION);
  const pitch = Number(nodes[0]?.extras.pitch_mm);
  if (nodes.length === 0 || !(pitch > 0)) return null;
  const step = Math.max(1, Number(nodes[0].extras.step ?? 1));
  /** @type {Map<number, Map<number, number>>} */
  const columns = new Map();
  for (const { attributes } of nodes) {
    const { POSITION: position, _DEVIATION: deviation } = attributes;
    for (let k = 0; k < deviation.length; k += 1) {
      const i = Math.round(position[3 * k] / pitch);
      const j = Math.round(position[3 * k + 1] / pitch);
      if (!columns.has(i)) columns.set(i, new Map());
      columns.get(i)?.set(j, Math.round(deviation[k] * 1e6));
    }
  }
  return {
    pitch_mm: pitch, step,
    columns: [...columns].sort(([a], [b]) => a - b).map(([i, column]) => {
      const rows = [...column.keys()];
      const first = rows.reduce((a, b) => Math.min(a, b));
      const last = rows.reduce((a, b) => Math.max(a, b));
      return { i, j_first: first, z_um: Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, k) => column.get(first + k * step) ?? null) };
    }),
  };
}
