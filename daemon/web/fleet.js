// @ts-check
/** Workers on other machines: whether their servers are reached, what waits, and who is there. */

import { get } from './api.js';
import { app, t } from './app.js';
import { trouble } from './dialogs.js';
import { fill, h } from './dom.js';
import { clock, when } from './format.js';
import { chip, facts, fault } from './parts.js';

/** How often it is asked: the service itself looks every 15 s, or less often. */
const PAUSE_MS = 5000;

/** A panel that shows itself once the service has named servers; `close` ends its asking. */
export function fleetPanel() {
  const content = h('div');
  const element = h('section', { class: 'panel wide', 'aria-label': t('room.fleet'), hidden: true }, h('h2', null, t('room.fleet')), content);
  let shown = '';
  let timer = 0;
  const load = async () => {
    clearTimeout(timer);
    try {
      const fleet = await get('/v1/fleet');
      // What changes with every look and means nothing is left out of the comparison.
      const key = JSON.stringify({ ...fleet, away_s: undefined });
      if (key !== shown) fill(content, told(fleet));
      shown = key;
      element.hidden = !fleet.is_used;
      if (!fleet.is_used) return;
    } catch (error) {
      shown = '';
      fill(content, trouble(error));
    }
    timer = setTimeout(load, PAUSE_MS);
  };
  return { element, load, close: () => clearTimeout(timer) };
}

/** @param {any} fleet */
function told(fleet) {
  const state = chip('link');
  state.update(fleet.is_connected ? 'ready' : 'trouble');
  const { jobs } = fleet;
  const waiting = jobs ? jobs.waiting_high + jobs.waiting_normal + jobs.waiting_low : 0;
  return [h('div', { class: 'head' }, h('h3', null, fleet.bench), state), facts([
    [t('room.servers'), h('code', null, fleet.servers.join(', '))],
    [t('room.handed-over'), t('room.handed-over-value', { count: fleet.handed_over, most: fleet.most_handed_over })],
    [t('room.of-all'), jobs ? t('room.jobs-value', { running: jobs.running, queued: waiting }) : null],
    [t('room.oldest'), jobs && waiting > 0 ? clock(jobs.oldest_s) : null],
  ]), fault(fleet.problem, undefined), fleet.workers.length === 0 ? h('p', { class: 'dim' }, t('room.no-workers')) : workers(fleet.workers)];
}

/** @param {any[]} all */
function workers(all) {
  const heads = ['room.worker', 'room.version', 'room.busy-with', 'room.threads', 'room.tools', 'room.there-since'];
  const rows = all.map((worker) => h('tr', null, h('td', null, worker.name), h('td', { class: 'figure' }, worker.version),
    h('td', null, worker.busy_with ?? t('room.idle')), h('td', { class: 'figure' }, String(worker.threads)), h('td', null, (worker.tools ?? []).join(', ')),
    h('td', { class: 'figure' }, when(worker.since, app.words.language))));
  return h('div', { class: 'scroll', tabindex: '0', role: 'group', 'aria-label': t('room.workers') }, h('table', null,
    h('thead', null, h('tr', null, heads.map((key) => h('th', { scope: 'col' }, t(key))))), h('tbody', null, rows)));
}
