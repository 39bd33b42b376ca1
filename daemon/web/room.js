// @ts-check
/** The machine room: service, scanners, storage, who is told, what is done with results, the laser's log. */

import { at, get, post, token } from './api.js';
import { app, english, on, t, word } from './app.js';
import { during, note, trouble } from './dialogs.js';
import { fill, h, icon } from './dom.js';
import { fleetPanel } from './fleet.js';
import { bytes, when } from './format.js';
import { chip, facts, fault, progress } from './parts.js';

export function openRoom() {
  const service = h('div');
  const scanners = h('div');
  const storage = h('div');
  const hooks = h('div', null, h('p', { class: 'dim' }, t('list.asking')));
  const doers = h('div', null, h('p', { class: 'dim' }, t('list.asking')));
  const log = h('div', null, h('p', { class: 'dim' }, t('list.asking')));
  const panel = (/** @type {string} */ key, /** @type {Element} */ content, wide = false) => h('section', { class: wide ? 'panel wide' : 'panel', 'aria-label': t(key) }, h('h2', null, t(key)), content);
  const fleet = fleetPanel();
  const element = h('div', { class: 'view' }, h('h1', null, t('nav.room')),
    h('div', { class: 'room' }, panel('room.service', service), panel('room.storage', storage), panel('room.scanners', scanners), fleet.element, panel('room.webhooks', hooks, true), panel('room.doers', doers, true), panel('room.laser', log, true)));

  let shown = '';
  const update = () => {
    const { status } = app.model;
    const key = JSON.stringify([status, [...app.model.scanners.values()], app.model.connected]);
    if (!status || key === shown) return;
    shown = key;
    fill(service, facts([
      [t('room.version'), `reliefd ${status.version}`],
      [t('room.since'), when(status.started_at, app.words.language)],
      [t('room.jobs'), t('room.jobs-value', { running: status.jobs_running, queued: status.jobs_queued })],
      [t('room.spool'), h('code', null, status.spool)],
    ]), token.value ? h('button', { type: 'button', onclick: () => {
      token.forget();
      location.reload();
    } }, t('room.sign-out')) : null);
    fill(storage, status.storage ? rooms(status.storage) : h('p', { class: 'dim' }, t('room.no-storage')));
    fill(scanners, [...app.model.scanners.values()].map((scanner) => {
      const state = chip('link');
      state.update(app.model.connected ? scanner.link : 'unknown');
      return h('div', { class: 'device' }, h('div', { class: 'head' }, h('h3', null, scanner.name), state), facts([
        [t('room.model'), scanner.model], [t('room.serial'), scanner.serial], [t('room.firmware'), scanner.firmware], [t('room.endpoint'), h('code', null, scanner.endpoint)],
      ]), fault(scanner.problem, undefined));
    }));
  };
  const loadHooks = async () => {
    try {
      const { webhooks } = await get('/v1/webhooks');
      fill(hooks, webhooks.length === 0 ? h('p', { class: 'dim' }, t('room.no-webhooks')) : webhooks.map((/** @type {any} */ hook) => webhook(hook, loadHooks)));
    } catch (error) {
      fill(hooks, trouble(error));
    }
  };
  const loadDoers = async () => {
    try {
      const [{ hooks: programs }, { uploads }] = await Promise.all([get('/v1/hooks'), get('/v1/uploads')]);
      const all = [...programs.map((/** @type {any} */ one) => doer('hook', one, one.command.join(' '), loadDoers)),
        ...uploads.map((/** @type {any} */ one) => doer('upload', one, one.to, loadDoers))];
      fill(doers, all.length === 0 ? h('p', { class: 'dim' }, t('room.no-doers')) : all);
    } catch (error) {
      fill(doers, trouble(error));
    }
  };
  const loadLog = async () => {
    try {
      const { entries } = await get('/v1/laser');
      fill(log, laserLog(entries));
    } catch (error) {
      fill(log, trouble(error));
    }
  };
  const load = () => {
    loadHooks();
    loadDoers();
    loadLog();
    fleet.load();
  };
  const offs = [on('change', update), on('connection', update), on('again', load), on('event', (event) => {
    if (event.kind === 'laser') loadLog();
    if (event.kind === 'published') loadDoers();
  })];
  update();
  load();
  return {
    element,
    close: () => {
      fleet.close();
      for (const off of offs) off();
    },
  };
}

/** @param {any} storage */
function rooms(storage) {
  const place = (/** @type {string} */ key, /** @type {number} */ used, /** @type {number | null} */ free) => {
    const bar = progress(t(key));
    const words = free === null ? bytes(used) : t('room.room', { used: bytes(used), free: bytes(free) });
    bar.update(free === null ? 0 : used / Math.max(1, used + free), words);
    bar.hidden = free === null;
    return h('div', { class: 'store' }, h('div', { class: 'head' }, h('h3', null, t(key)), h('span', { class: 'figure' }, words)), bar,
      free !== null && free < storage.reserve_bytes * 2 ? h('p', { class: 'trouble' }, icon('warning'), h('span', null, t('room.nearly-full'))) : null);
  };
  return [place('room.scans', storage.scans_bytes, storage.scans_free_bytes), place('room.results', storage.results_bytes, storage.results_free_bytes),
    h('p', { class: 'dim small' }, t('room.reserve', { bytes: bytes(storage.reserve_bytes) }))];
}

/** @param {any} hook @param {() => void} again */
function webhook(hook, again) {
  const test = h('button', { type: 'button', 'aria-label': t('room.test-of', { name: hook.name }), onclick: () => during(test, async () => {
    const delivery = await post(`/v1/webhooks/${at(hook.name)}/test`);
    const last = delivery.tried.at(-1);
    if (delivery.state === 'delivered') note(t('room.test-good', { name: hook.name, ms: last?.milliseconds ?? 0 }));
    else note(new Error(`${hook.name}: ${last?.error ?? word('delivery', delivery.state)}`));
    again();
  }) }, t('room.test'));
  const state = chip('delivery');
  const latest = hook.latest;
  if (latest) state.update(latest.state);
  const tried = latest?.tried.at(-1);
  return h('div', { class: 'hook' }, h('div', { class: 'head' }, h('h3', null, hook.name), latest ? state : null, test), facts([
    [word('receiver', hook.kind), h('code', null, hook.url)],
    [t('room.events'), hook.events.map((/** @type {string} */ event) => word('webhook', event)).join(', ')],
    [t('room.waiting'), String(hook.waiting)],
    [t('room.dropped'), hook.dropped > 0 ? String(hook.dropped) : null],
    [t('room.latest'), latest ? `${word('webhook', latest.event)} \u00b7 ${when(tried?.at ?? latest.created_at, app.words.language)}` : t('room.nothing-yet')],
  ]), fault(tried?.error, tried?.answer));
}

/**
 * Something that is done with each result.
 * @param {'hook' | 'upload'} kind @param {any} one @param {string} what @param {() => void} again
 */
function doer(kind, one, what, again) {
  const test = h('button', { type: 'button', 'aria-label': t(`room.try-${kind}-of`, { name: one.name }), onclick: () => during(test, async () => {
    const run = await post(`/v1/${kind}s/${at(one.name)}/test`);
    const last = run.tried.at(-1);
    if (run.state === 'delivered') note(t('room.try-good', { name: one.name, ms: last?.milliseconds ?? 0 }));
    else note(new Error(`${one.name}: ${last?.error ?? word('delivery', run.state)}`));
    again();
  }) }, t(`room.try-${kind}`));
  const state = chip('delivery');
  const { latest } = one;
  if (latest) state.update(latest.state);
  const tried = latest?.tried.at(-1);
  return h('div', { class: 'hook' }, h('div', { class: 'head' }, h('h3', null, one.name), latest ? state : null, test), facts([
    [word('receiver', kind), h('code', null, what)],
    [t('room.results-waiting'), String(one.waiting)],
    [t('room.results-dropped'), one.dropped > 0 ? String(one.dropped) : null],
    [t('room.latest-result'), latest ? `${latest.about ?? ''} \u00b7 ${when(tried?.at ?? latest.created_at, app.words.language)}` : t('room.nothing-yet')],
  ]), fault(tried?.error, tried?.answer));
}

/** Newest first; the service tells them oldest first. @param {any[]} entries */
function laserLog(entries) {
  if (entries.length === 0) return h('p', { class: 'dim' }, t('room.no-log'));
  const several = new Set(entries.map((entry) => entry.scanner ?? '')).size > 1;
  const rows = entries.slice(-200).reverse().map((entry) => h('tr', { 'data-laser': entry.laser },
    h('td', { class: 'figure' }, when(entry.at, app.words.language)), several ? h('td', null, entry.scanner ?? '') : null,
    h('td', null, h('span', { class: 'lamp' }, icon({ on: 'beam', off: 'off' }[entry.laser] ?? 'unknown'), h('span', null, t(`laser.${entry.laser}`)))),
    english(h('td', null, entry.cause)), h('td', { class: 'dim' }, entry.scan ?? '')));
  return h('div', { class: 'scroll', tabindex: '0', role: 'group', 'aria-label': t('room.laser') }, h('table', null, h('thead', null, h('tr', null,
    h('th', { scope: 'col' }, t('room.at')), several ? h('th', { scope: 'col' }, t('start.scanner')) : null, h('th', { scope: 'col' }, t('laser.title')),
    h('th', { scope: 'col' }, t('room.cause')), h('th', { scope: 'col' }, t('scan.title')))), h('tbody', null, rows)));
}
