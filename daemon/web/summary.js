// @ts-check
/** What a report says, warnings first. */

import { english, t, word } from './app.js';
import { kindColour } from './colour.js';
import { fill, h, icon } from './dom.js';
import { parameters } from './facts.js';
import { fixed, seconds } from './format.js';
import { facts } from './parts.js';

/** @param {any} report */
export function warnings(report) {
  const list = report?.warnings ?? [];
  const lost = [
    report?.lost_nodes > 0 ? t('summary.lost', { count: report.lost_nodes }) : null, report?.invented_nodes > 0 ? t('summary.invented', { count: report.invented_nodes }) : null,
  ].filter(Boolean);
  if (list.length === 0 && lost.length === 0) return report ? h('p', { class: 'well' }, icon('check'), h('span', null, t('summary.no-warnings'))) : null;
  return h('section', { class: 'warnings', 'aria-label': t('summary.warnings') }, h('h2', null, icon('warning'), t('summary.warnings')),
    h('ul', null, list.map((/** @type {string} */ words) => english(h('li', null, words))), lost.map((words) => h('li', null, words))));
}

/** The figures of a result at a glance. @param {any} report */
export function figures(report) {
  const image = report.range_image;
  const deviations = report.deviations;
  const lengths = report.model?.edge_lengths;
  const total = Object.values(report.timings_s ?? {}).reduce((/** @type {number} */ sum, part) => sum + Number(part), 0);
  const mm = (/** @type {number | null | undefined} */ value, digits = 4) => (value === null || value === undefined ? null : `${fixed(value, digits)} mm`);
  const histogram = deviations?.histogram ? histogramOf(deviations) : null;
  return [facts([
    [t('summary.faces'), t('summary.faces-value', { count: report.model?.faces ?? 0, shared: report.model?.edges_shared ?? 0, free: report.model?.free_edges ?? 0 })],
    [t('summary.rms'), mm(deviations?.rms_mm)], [t('summary.p95'), mm(deviations?.percentile_95_mm)], [t('summary.max'), mm(deviations?.max_mm)],
    [t('summary.grid'), image ? `${image.columns} \u00d7 ${image.rows}, ${fixed(image.pitch_mm, 3)} mm` : null],
    [t('summary.nodes'), image ? image.nodes.toLocaleString() : null],
    [t('summary.noise'), mm(image?.noise_mm)],
    [t('summary.inliers'), image?.inlier_share === null || !image ? null : `${fixed(100 * image.inlier_share, 1)} %`],
    [t('summary.samples'), report.scan ? t('summary.samples-value', { samples: report.scan.samples.toLocaleString(), columns: report.scan.columns }) : null],
    [t('summary.snr'), report.snr_db === null ? null : `${fixed(report.snr_db, 1)} dB`],
    [t('summary.edges'), lengths ? t('summary.edges-value', { measured: fixed(lengths.measured_mm, 0), intersected: fixed(lengths.intersected_mm, 0), assumed: fixed(lengths.assumed_mm, 0) }) : null],
    [t('summary.left-out'), report.background?.count > 0 ? report.background.list.map((/** @type {any} */ one) => word('background', one.kind)).join(', ') : null],
    [t('summary.time'), seconds(Number(total))],
  ]), histogram];
}

/** Deviations as bars; the same figures stand beside it in words. @param {any} deviations */
function histogramOf({ histogram: { limits_mm: limits, counts, below, above }, nodes }) {
  const most = Math.max(1, ...counts);
  const bars = h('div', { class: 'bars' });
  fill(bars, counts.map((/** @type {number} */ count) => {
    const bar = h('span', null);
    bar.style.height = `${(100 * count) / most}%`;
    return bar;
  }));
  return h('figure', { class: 'histogram', role: 'img', 'aria-label': t('summary.histogram-alt', {
    nodes, least: fixed(limits[0], 3), most: fixed(limits.at(-1), 3), outside: below + above,
  }) }, bars, h('div', { class: 'limits3', 'aria-hidden': 'true' }, h('span', null, fixed(limits[0], 3)), h('span', null, t('summary.histogram')), h('span', null, `${fixed(limits.at(-1), 3)} mm`)));
}

/** What is known of one region. @param {any} report @param {any} region */
export function regionCard(report, region) {
  const shape = region.shape;
  const swatch = h('span', { class: 'swatch', 'aria-hidden': 'true' });
  swatch.style.background = kindColour(region.kind);
  const worst = report?.deviations?.worst?.filter((/** @type {any} */ one) => one.region === region.label)[0];
  return h('div', { class: 'card' }, h('h3', null, swatch, `${t('result.region', { label: region.label })}: ${word('kind', region.kind)}`),
    facts([
      [t('region.seen'), shape?.hollow === true ? t('region.hollow') : shape?.hollow === false ? t('region.outside') : null],
      ...parameters(region).map(({ key, text }) => /** @type {[string, string]} */ ([t(`parameter.${key}`), text])),
      [t('region.area'), region.area_mm2 === undefined ? null : `${fixed(region.area_mm2, 1)} mm\u00b2`],
      [t('region.rms'), region.rms_mm === undefined ? null : `${fixed(region.rms_mm, 4)} mm`],
      [t('region.max'), region.max_mm === undefined ? null : `${fixed(region.max_mm, 4)} mm`],
      [t('region.worst'), worst ? `${fixed(worst.deviation_mm, 4)} mm (${worst.place_mm.map((/** @type {number} */ part) => fixed(part, 1)).join(', ')})` : null],
      [t('region.nodes'), region.nodes?.toLocaleString()],
      [t('region.samples'), shape?.numbers ? `${shape.numbers.samples.toLocaleString()}, ${t('region.rms')} ${fixed(shape.numbers.rms_mm, 4)} mm` : null],
      [t('region.names'), region.faces?.join(', ')],
    ]));
}

/** @param {any} report */
export function regionTable(report) {
  const column = (/** @type {string} */ key, number = false) => h('th', { scope: 'col', class: number ? 'number' : null }, t(key));
  const rows = report.regions.list.map((/** @type {any} */ region) => {
    const swatch = h('span', { class: 'swatch', 'aria-hidden': 'true' });
    swatch.style.background = kindColour(region.kind);
    const numbers = parameters(region).filter(({ key }) => ['radius', 'tube-radius', 'half-angle'].includes(key)).map(({ key, text }) => `${t(`parameter.${key}`)} ${text}`);
    return h('tr', null, h('th', { scope: 'row' }, String(region.label)), h('td', null, swatch, word('kind', region.kind)), h('td', { class: 'figure' }, numbers.join('; ')),
      h('td', { class: 'figure number' }, fixed(region.area_mm2, 1)), h('td', { class: 'figure number' }, fixed(region.rms_mm, 4)), h('td', { class: 'figure number' }, fixed(region.max_mm, 4)), h('td', { class: 'figure number' }, region.nodes.toLocaleString()));
  });
  return h('div', { class: 'scroll', tabindex: '0', role: 'group', 'aria-label': t('result.regions') }, h('table', null, h('thead', null, h('tr', null,
    column('region.label'), column('region.kind'), column('region.parameters'), column('region.area-unit', true), column('region.rms-unit', true), column('region.max-unit', true), column('region.nodes', true))), h('tbody', null, rows)));
}
