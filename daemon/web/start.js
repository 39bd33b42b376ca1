// @ts-check
/** Asks what to scan, shows what it would come to, and starts it once somebody has said so. */

import { post, uuid } from './api.js';
import { app, english, t, tell } from './app.js';
import { confirm, dialog, during, trouble } from './dialogs.js';
import { fill, h, icon } from './dom.js';
import { bytes, clock, fixed } from './format.js';
import { facts } from './parts.js';
import { routeTo } from './route.js';
import { field, planFields, settingFields } from './settings.js';

/** What somebody typed last: the next scan is often the same part by the same person. */
const KEY = 'relief.start';

/** @returns {Record<string, string>} */
function before() {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? '{}');
  } catch {
    return {};
  }
}

/** @param {string} scanner */
export function openStart(scanner) {
  const last = before();
  const name = field(t('start.name'), { maxlength: 100, value: last.name ?? '', placeholder: 'scan' });
  const part = field(t('start.part'), { value: last.part ?? '' });
  const operator = field(t('start.operator'), { value: last.operator ?? '' });
  const note = field(t('start.note'), {});
  const names = [...app.model.scanners.keys()];
  const which = h('select', { id: 'start-scanner' }, names.map((one) => h('option', { value: one, selected: one === scanner }, one)));
  const plan = planFields();
  const settings = settingFields(app.nextSettings);
  const outcome = h('div', { class: 'outcome' });
  // Only trouble is said unasked: figures change with every letter.
  const said = h('p', { class: 'hidden', 'aria-live': 'assertive' });
  const refuse = (/** @type {unknown} */ error) => {
    const words = trouble(error);
    fill(outcome, words);
    fill(said, words.textContent);
  };
  const go = h('button', { class: 'primary', type: 'submit' }, icon('play'), h('span', null, t('start.action')));
  const details = (/** @type {string} */ key, /** @type {Element} */ content, open = false) => h('details', { open }, h('summary', null, t(key)), content);
  const form = h('form', { novalidate: true },
    h('div', { class: 'grid-fields' },
      names.length > 1 ? h('div', { class: 'field' }, h('label', { for: 'start-scanner' }, t('start.scanner')), which) : null,
      name.element, part.element, operator.element, note.element),
    details('start.plan', plan.element),
    details('start.settings', settings.element, Object.keys(app.nextSettings).length > 0),
    outcome, said,
    h('div', { class: 'buttons' }, h('button', { type: 'button', onclick: () => element.close() }, t('dialog.back')), go));
  const element = dialog(t('start.title'), form);

  /** @returns {Record<string, unknown> | null} */
  const wish = () => {
    const chosen = settings.value();
    if (!chosen) return null;
    /** @type {Record<string, unknown>} */
    const request = {};
    for (const [key, input] of Object.entries({ name: name.input, part: part.input, operator: operator.input, note: note.input })) {
      if (input.value.trim()) request[key] = input.value.trim();
    }
    if (names.length > 1) request.scanner = which.value;
    if (Object.keys(plan.value()).length > 0) request.plan = plan.value();
    if (Object.keys(chosen).length > 0) request.settings = chosen;
    return request;
  };

  /** What was asked for last: an answer to an earlier question does not count. */
  let asked = 0;
  const preview = async () => {
    asked += 1;
    const mine = asked;
    const request = wish();
    if (!request) {
      refuse(t('settings.wrong-line'));
      return;
    }
    try {
      const told = await post('/v1/scans/preview', request);
      if (mine === asked) fill(outcome, previewFacts(told));
    } catch (error) {
      if (mine === asked) refuse(error);
    }
  };
  /** @type {number | undefined} */
  let timer;
  // A changed wish is another scan; the same wish sent twice is one.
  let key = uuid();
  form.addEventListener('input', () => {
    key = uuid();
    clearTimeout(timer);
    timer = setTimeout(preview, 350);
  });
  form.addEventListener('submit', async (/** @type {Event} */ event) => {
    event.preventDefault();
    const request = wish();
    if (!request) {
      refuse(t('settings.wrong-line'));
      return;
    }
    const scannerName = String(request.scanner ?? names[0] ?? '');
    const sure = await confirm({
      title: t('start.sure-title'), text: t('start.sure', { scanner: scannerName }), action: t('start.sure-action'), danger: true, symbol: 'beam',
    });
    if (!sure) return;
    await during(go, async () => {
      const scan = await post('/v1/scans', request, { 'Idempotency-Key': key }).catch((error) => {
        // A refusal is an answer: what is sent next is meant anew. Without an answer it may have begun.
        if (error.status > 0) key = uuid();
        throw error;
      });
      localStorage.setItem(KEY, JSON.stringify({ name: name.input.value, part: part.input.value, operator: operator.input.value }));
      app.nextSettings = {};
      app.model.takeScan(scan);
      element.close();
      tell('change');
      location.hash = routeTo('machine', scannerName);
    }, refuse);
  });
  element.showModal();
  name.input.focus();
  preview();
}

/** What a scan would come to. @param {any} told */
export function previewFacts(told) {
  const range = (/** @type {number[] | undefined} */ pair) => (pair ? `${fixed(pair[0], 1)} \u2026 ${fixed(pair[1], 1)} mm` : null);
  return h('div', { class: 'preview-facts' },
    told.refused ? english(h('p', { class: 'trouble' }, icon('warning'), h('span', null, told.refused))) : null,
    facts([
      [t('preview.columns'), t('preview.columns-value', { count: told.columns, pitch: fixed(told.column_pitch_mm, 3) })],
      [t('preview.samples'), String(told.samples)],
      [t('preview.least-time'), told.least_s === undefined ? null : clock(told.least_s)],
      ['x', range(told.x_mm)], ['y', range(told.y_mm)],
      [t('preview.spacing'), told.sample_spacing_mm === undefined ? null : `${fixed(told.sample_spacing_mm, 3)} mm`],
      [t('preview.grid'), told.grid_nodes ? `${told.grid_nodes[0]} \u00d7 ${told.grid_nodes[1]}` : null],
      [t('preview.window'), told.window_mm === undefined ? null : `${fixed(told.window_mm, 2)} mm`],
      [t('preview.least-face'), `${fixed(told.least_face_mm2, 2)} mm\u00b2`],
      [t('preview.room'), bytes(told.journal_bytes)],
    ]),
    (told.notes ?? []).map((/** @type {string} */ words) => english(h('p', { class: 'remark' }, words))));
}
