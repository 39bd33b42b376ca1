// @ts-check
/** The list of jobs: what they are at, what went wrong, and what can be done about it. */

import { at, post } from './api.js';
import { app, english, on, t, tell, word } from './app.js';
import { during } from './dialogs.js';
import { attribute, fill, h, icon, text } from './dom.js';
import { seconds, when } from './format.js';
import { chip, fault, progress } from './parts.js';
import { pagedList } from './paged.js';
import { routeTo } from './route.js';

/** Stages of a job, as they follow each other; others that come are added. */
const STAGES = ['regrid', 'segment', 'reconstruct', 'export', 'pictures', 'surface', 'skin', 'toolpath', 'features', 'publish'];

/** Those that every job goes through. */
const ALWAYS = ['segment', 'reconstruct', 'export', 'pictures', 'publish'];

export function openJobs() {
  const paged = pagedList({ path: '/v1/jobs', kind: 'job', title: t('nav.jobs'), empty: t('jobs.empty'), row: () => jobRow((job) => paged.put(job)) });
  const off = on('event', (event) => {
    if (event.kind !== 'progress') return;
    paged.rowOf(event.job)?.advance(event);
  });
  return {
    element: paged.element,
    close: () => {
      off();
      paged.close();
    },
  };
}

/** @param {(job: any) => void} changed */
function jobRow(changed) {
  const title = h('h2', { class: 'name' });
  const state = chip('job-state');
  const about = h('p', { class: 'about' });
  const error = h('div');
  const stages = h('ol', { class: 'stages', 'aria-label': t('jobs.stages') });
  const bar = progress(t('jobs.progress'));
  const actions = h('div', { class: 'actions' });
  const element = h('li', { class: 'row job' }, h('div', { class: 'main' }, h('div', { class: 'head' }, title, state), about, error),
    h('div', { class: 'amount' }, stages, bar), actions);
  /** @type {any} */
  let job = null;
  /** @type {Record<string, number>} */
  let done = {};

  const show = (/** @type {{stage: string, fraction: number} | undefined} */ now) => {
    const names = [...new Set([...STAGES.filter((name) => name in done || (job.state === 'running' && ALWAYS.includes(name))), ...Object.keys(done), ...(now ? [now.stage] : [])])].sort((a, b) => STAGES.indexOf(a) - STAGES.indexOf(b));
    fill(stages, names.map((name) => {
      const active = job.state === 'running' && now?.stage === name && !(name in done);
      const words = name in done ? seconds(done[name]) : active ? `${Math.round(100 * now.fraction)} %` : t('jobs.to-come');
      return h('li', { 'data-stage': name in done ? 'done' : active ? 'now' : 'to-come' }, h('span', null, word('stage', name)), h('span', { class: 'figure' }, words));
    }));
    bar.hidden = job.state !== 'running';
    if (now) bar.update(now.fraction, `${word('stage', now.stage)} ${Math.round(100 * now.fraction)} %`);
  };
  element.advance = (/** @type {any} */ event) => {
    if (!job) return;
    if (event.seconds !== undefined) done[event.stage] = event.seconds;
    show({ stage: event.stage, fraction: event.fraction });
  };
  const act = (/** @type {string} */ what, /** @type {string} */ symbol) => {
    const button = h('button', {
      type: 'button', 'aria-label': t(`jobs.${what}-of`, { name: job.name, id: job.id }),
      onclick: () => during(button, async () => {
        const after = await post(`/v1/jobs/${at(job.id)}/${what}`);
        app.model.takeJob(after);
        changed(after);
        tell('change');
      }),
    }, icon(symbol), h('span', null, t(`jobs.${what}`)));
    return button;
  };
  let shown = '';
  element.update = (/** @type {any} */ given) => {
    if (given === job) return;
    const key = JSON.stringify(given);
    if (key === shown) return;
    shown = key;
    if (job?.started_at !== given.started_at) done = {};
    job = given;
    for (const timing of job.timings ?? []) done[timing.stage] = timing.seconds;
    text(title, job.name);
    state.update(job.state);
    const settings = Object.entries(job.settings ?? {}).map(([name, value]) => `${name} = ${JSON.stringify(value)}`);
    text(about, [t('jobs.number', { id: job.id }), when(job.queued_at, app.words.language), job.scanner, job.worker ? t('jobs.worker', { name: job.worker }) : '',
      job.attempts > 1 ? t('jobs.attempts', { count: job.attempts }) : '',
      job.acknowledged_at ? t('jobs.acknowledged', { by: job.acknowledged_by ?? '?', at: when(job.acknowledged_at, app.words.language) }) : '', ...settings].filter(Boolean).join(' \u00b7 '));
    fill(error, fault(job.error, job.hint), (job.left_out ?? []).map((/** @type {string} */ words) => english(h('p', { class: 'remark' }, words))));
    show(app.model.progress.get(job.id) ?? (job.stage ? { stage: job.stage, fraction: 0 } : undefined));
    fill(actions,
      job.state === 'done' ? h('a', { class: 'button', href: routeTo('result', job.result), 'aria-label': t('jobs.open', { name: job.name }) }, icon('link'), h('span', null, t('scans.result'))) : null,
      job.state === 'failed' || job.state === 'cancelled' ? act('retry', 'run') : null,
      job.state === 'queued' || job.state === 'running' ? act('cancel', 'cross') : null);
    attribute(element, 'data-state', job.state);
  };
  return element;
}
