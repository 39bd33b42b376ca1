// @ts-check
/** Fields for what may be asked of a scan: its plan and its settings. */

import { t } from './app.js';
import { attribute, h } from './dom.js';
import { settingLines } from './format.js';

/** Fields of a plan, in the order in which they are asked for; the second is its step. @type {[string, string][]} */
const PLAN = [
  ['x_first_mm', 'any'], ['x_last_mm', 'any'], ['pitch_mm', 'any'], ['columns', '1'],
  ['angle_first_deg', 'any'], ['angle_last_deg', 'any'], ['y_first_mm', 'any'], ['y_last_mm', 'any'],
  ['samples', '1'], ['exposure_us', '1'],
];

/** Settings that have a field of their own: key, least and step. @type {[string, string, string][]} */
export const COMMON = [
  ['regrid.pitch_mm', '0.01', 'any'], ['regrid.neighbours', '3', '1'], ['regrid.draws', '1', '1'],
  ['reconstruct.tolerance_mm', '0.0001', 'any'],
];

let count = 0;

/** @param {string} label @param {Record<string, any>} properties @param {string} [help] */
export function field(label, properties, help) {
  count += 1;
  const id = `field-${count}`;
  const input = h(properties.rows ? 'textarea' : 'input', { id, autocomplete: 'off', ...properties, ...(help ? { 'aria-describedby': `${id}-help` } : {}) });
  const element = h('div', { class: 'field' }, h('label', { for: id }, label), input, help ? h('p', { id: `${id}-help`, class: 'help' }, help) : null);
  return { element, input };
}

/** Fields of a plan; what is left empty is as configured. */
export function planFields() {
  const fields = PLAN.map(([key, step]) => ({ key, ...field(t(`plan.${key}`), { type: 'number', step, inputmode: 'decimal', placeholder: t('plan.configured') }) }));
  const element = h('div', { class: 'grid-fields' }, fields.map((one) => one.element));
  const value = () => {
    /** @type {Record<string, number>} */
    const plan = {};
    for (const { key, input } of fields) if (input.value !== '' && Number.isFinite(Number(input.value))) plan[key] = Number(input.value);
    return plan;
  };
  return { element, value };
}

/**
 * Fields of settings: the usual ones, and lines for all others.
 * @param {Record<string, unknown>} given
 */
export function settingFields(given) {
  const rest = { ...given };
  const fields = COMMON.map(([key, min, step]) => {
    const one = field(t(`setting.${key}`), { type: 'number', min, step, inputmode: 'decimal', placeholder: t('plan.configured') }, key);
    if (rest[key] !== undefined) one.input.value = String(rest[key]);
    delete rest[key];
    return { key, ...one };
  });
  const lines = field(t('settings.others'), { rows: 3, spellcheck: 'false', placeholder: 'segment.background = keep' }, t('settings.others-help'));
  lines.input.value = Object.entries(rest).map(([key, value]) => `${key} = ${typeof value === 'string' ? value : JSON.stringify(value)}`).join('\n');
  const element = h('div', null, h('div', { class: 'grid-fields' }, fields.map((one) => one.element)), lines.element);
  /** @returns {Record<string, unknown> | null} null where a line is none */
  const value = () => {
    const { settings, wrong } = settingLines(lines.input.value);
    attribute(lines.input, 'aria-invalid', wrong ? 'true' : null);
    for (const { key, input } of fields) if (input.value !== '') settings[key] = Number(input.value);
    return wrong ? null : settings;
  };
  return { element, value };
}
