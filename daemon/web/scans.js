// @ts-check
/** The list of scans, and what can be done with each. */

import { at, post } from './api.js';
import { app, english, on, t, tell } from './app.js';
import { dialog, during, note, trouble } from './dialogs.js';
import { attribute, fill, h, icon, text } from './dom.js';
import { when } from './format.js';
import { chip, fileLink, progress } from './parts.js';
import { pagedList } from './paged.js';
import { routeTo } from './route.js';
import { underWay } from './model.js';
import { field, settingFields } from './settings.js';

export function openScans() {
  const paged = pagedList({ path: '/v1/scans', kind: 'scan', title: t('nav.scans'), empty: t('scans.empty'), row: scanRow });
  // Columns are told of without the scan; the rows of those under way follow them.
  const off = on('live', (event) => {
    paged.rowOf(event.scan)?.advance(event.columns, event.columns_planned);
  });
  return {
    element: paged.element,
    close: () => {
      off();
      paged.close();
    },
  };
}

function scanRow() {
  const title = h('h2', { class: 'name' });
  const state = chip('scan-state');
  const about = h('p', { class: 'about' });
  const columns = h('p', { class: 'figure' });
  const bar = progress(t('scan.progress'));
  const reason = h('p', { class: 'reason' });
  const settings = h('p', { class: 'settings' });
  const actions = h('div', { class: 'actions' });
  const element = h('li', { class: 'row' },
    h('div', { class: 'main' }, h('div', { class: 'head' }, title, state), about, reason, settings), h('div', { class: 'amount' }, columns, bar), actions);
  /** @param {number} taken @param {number} planned */
  element.advance = (taken, planned) => {
    text(columns, t('scan.of', { taken, planned: planned || '?' }));
    bar.update(planned > 0 ? taken / planned : 0, columns.textContent ?? '');
  };
  let shown = '';
  /** @type {any} */
  let latest = null;
  element.update = (/** @type {any} */ scan) => {
    if (scan === latest) return;
    latest = scan;
    const key = JSON.stringify(scan);
    if (key === shown) return;
    shown = key;
    text(title, scan.name);
    state.update(scan.state);
    text(about, [when(scan.started_at, app.words.language), scan.scanner, scan.part, scan.operator, scan.note].filter(Boolean).join(' \u00b7 '));
    text(reason, scan.removed_at ? t('scans.removed', { when: when(scan.removed_at, app.words.language) }) : scan.reason ?? '');
    if (!scan.removed_at) english(reason);
    const changed = Object.entries(scan.settings ?? {});
    text(settings, changed.map(([name, value]) => `${name} = ${JSON.stringify(value)}`).join(', '));
    element.advance(scan.columns, scan.columns_planned);
    bar.hidden = !underWay(scan);
    const over = !underWay(scan);
    const again = over && scan.columns > 0 && !scan.removed_at;
    const rerun = h('button', { type: 'button', 'aria-label': t('scans.rerun-of', { name: scan.name }), onclick: () => openRerun(scan) }, icon('run'), h('span', null, t('scans.rerun')));
    fill(actions,
      over ? null : h('a', { class: 'button', href: routeTo('machine', scan.scanner) }, t('scans.watch')),
      scan.jobs?.length > 0 ? h('a', { class: 'button', href: routeTo('result', scan.id), 'aria-label': t('jobs.open', { name: scan.name }) }, icon('link'), h('span', null, t('scans.result'))) : null,
      again ? h('a', { class: 'button', href: routeTo('preview', scan.id), 'aria-label': t('scans.preview-of', { name: scan.name }) }, t('scans.preview')) : null,
      again ? rerun : null,
      again ? fileLink(`/v1/scans/${at(scan.id)}/journal`, `${scan.id}.scan`, t('scans.journal'), { class: 'button' }) : null);
    attribute(element, 'data-state', scan.state);
  };
  return element;
}

/** Asks for a kept scan to be processed again. @param {any} scan @param {Record<string, unknown>} [given] settings */
export function openRerun(scan, given = {}) {
  const name = field(t('start.name'), { maxlength: 100, placeholder: scan.name });
  const settings = settingFields({ ...(scan.settings ?? {}), ...given });
  const go = h('button', { type: 'submit', class: 'primary' }, icon('run'), h('span', null, t('rerun.action')));
  const outcome = h('div', { class: 'outcome', 'aria-live': 'polite' });
  const refuse = (/** @type {unknown} */ error) => fill(outcome, trouble(error));
  const form = h('form', { novalidate: true },
    h('p', null, t('rerun.text', { name: scan.name })), name.element, settings.element, outcome,
    h('div', { class: 'buttons' }, h('button', { type: 'button', onclick: () => element.close() }, t('dialog.back')), go));
  const element = dialog(t('rerun.title'), form);
  form.addEventListener('submit', async (/** @type {Event} */ event) => {
    event.preventDefault();
    const chosen = settings.value();
    if (!chosen) {
      refuse(t('settings.wrong-line'));
      return;
    }
    await during(go, async () => {
      const job = await post(`/v1/scans/${at(scan.id)}/rerun`, { name: name.input.value.trim(), settings: chosen });
      app.model.takeJob(job);
      element.close();
      note(t('rerun.queued', { id: job.id }));
      tell('event', { kind: 'job', ...job });
      location.hash = routeTo('jobs');
    }, refuse);
  });
  element.showModal();
}
