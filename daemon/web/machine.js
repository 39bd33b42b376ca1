// @ts-check
/** The machine at work: the range image as it fills, the scan, and what can be done about it. */

import { ApiError, at, get, post } from './api.js';
import { app, english, on, t, tell, word } from './app.js';
import { confirm, during } from './dialogs.js';
import { attribute, fill, h, icon, text } from './dom.js';
import { clock, fixed } from './format.js';
import { askAbort } from './laser.js';
import { Live, underWay } from './model.js';
import { chip, progress, reading, tablist } from './parts.js';
import { patient } from './patience.js';
import { RangePicture } from './picture.js';
import { Profile } from './profile.js';
import { routeTo } from './route.js';
import { openStart } from './start.js';

const MOST_NODES = 250000;

/** The scanner that was looked at last. */
let chosen = '';

/** @param {string} name of a scanner; the only one, or the last one, if empty */
export function openMachine(name) {
  const names = () => [...app.model.scanners.keys()];
  if (name) chosen = name;
  const which = () => (app.model.scanners.has(chosen) ? chosen : names()[0] ?? '');
  const picture = new RangePicture({ label: t('machine.image'), onCursor: () => follow() });
  const profile = new Profile();
  const side = scanPanel(which);
  const job = jobPanel(which);
  const tabs = h('div', { class: 'scanners' });
  const body = h('div', { class: 'machine', id: 'panel-scanner' },
    h('section', { class: 'panel image', 'aria-label': t('machine.image') }, picture.element, profile.element),
    h('div', { class: 'side' }, side.element, job.element));
  const element = h('div', { class: 'view' }, h('h1', { class: 'hidden' }, t('nav.machine')), tabs, body);

  let shownTabs = '';
  const update = () => {
    const all = names();
    if (all.join(' ') !== shownTabs) {
      shownTabs = all.join(' ');
      fill(tabs, all.length > 1 ? tablist(t('machine.scanners'), all.map((id) => ({ id, label: id })), which(), (id) => {
        chosen = id;
        picture.cursor = null;
        update();
      }) : null);
      // One panel shows whichever scanner is chosen.
      for (const tab of tabs.querySelectorAll('[role=tab]')) attribute(tab, 'aria-controls', 'panel-scanner');
      attribute(body, 'role', all.length > 1 ? 'tabpanel' : null);
    }
    attribute(body, 'aria-labelledby', all.length > 1 ? `tab-${which()}` : null);
    const live = app.model.live.get(which());
    const scan = app.model.lastScan.get(which());
    picture.nothing(t(!app.model.status ? 'machine.asking' : underWay(scan) ? 'machine.no-column' : 'machine.no-scan'));
    picture.show(live?.lattice ?? null, { planMm: underWay(scan) && live ? live.planMm : null, xMm: underWay(scan) && live ? live.xMm : null });
    follow();
    side.update();
    job.update();
    load();
  };

  /** The profile is of the cursor's column, or of the latest one. */
  const follow = () => {
    const live = app.model.live.get(which());
    const lattice = live?.lattice ?? null;
    const place = picture.place;
    if (place) profile.show(lattice, place.i, place.yMm);
    else profile.show(lattice, lattice ? lattice.i0 + (live && live.known.length > 1 && live.known[1][1] < live.known[0][1] ? 0 : lattice.columns - 1) : null, null);
  };

  /** Fetches what was measured before the page came, or after the last scan. */
  const load = async () => {
    const name = which();
    if (!name || !app.model.connected) return;
    let live = app.model.live.get(name);
    if (!live) {
      const latest = await latestOn(name);
      if (!latest || app.model.live.has(name)) return;
      live = new Live(latest.id);
      live.columns = latest.columns;
      live.planned = latest.columns_planned;
      app.model.live.set(name, live);
      if (!app.model.lastScan.has(name)) app.model.lastScan.set(name, latest);
    }
    if (live.asked) return;
    live.asked = true;
    try {
      if (!app.model.lastScan.has(name)) {
        // It ended while nobody listened.
        app.model.takeScan(await get(`/v1/scans/${at(live.scan)}`));
        tell('change');
      }
      if (live.whole || live.columns === 0) return;
      const path = `/v1/scans/${at(live.scan)}/image?most_nodes=${MOST_NODES}`;
      live.under(await patient(() => get(path), () => element.isConnected));
      tell('change');
    } catch (error) {
      // Columns that were removed, or a service that has no images, leave the picture empty.
      if (!(error instanceof ApiError)) throw error;
    }
  };

  /** The latest jobs, which began before the page came. */
  const loadJobs = async () => {
    try {
      for (const job of (await get('/v1/jobs?limit=20')).jobs.slice(0, 20)) app.model.takeJob(job);
      tell('change');
    } catch {
      // The list of jobs says what is wrong, where it is asked for.
    }
  };
  const again = () => {
    load();
    loadJobs();
  };
  const offs = [on('change', update), on('connection', update), on('tick', () => side.update()), on('again', again)];
  update();
  loadJobs();
  return {
    element,
    close: () => {
      for (const off of offs) off();
      picture.close();
      profile.close();
    },
  };
}

/** @type {Map<string, Promise<any>>} */
const askedFor = new Map();

/** The latest scan of a scanner that has columns. @param {string} name */
function latestOn(name) {
  const known = app.model.lastScan.get(name);
  if (known) return Promise.resolve(known);
  if (!askedFor.has(name)) {
    askedFor.set(name, get('/v1/scans?limit=50').then(({ scans }) => scans.find((/** @type {any} */ scan) => app.model.named(scan.scanner) === name && scan.columns > 0 && !scan.removed_at)));
  }
  return /** @type {Promise<any>} */ (askedFor.get(name)).catch(() => {
    askedFor.delete(name);
    return null;
  });
}

/** @param {() => string} which */
function scanPanel(which) {
  const heading = h('h2', null, t('scan.title'));
  const state = chip('scan-state');
  const name = h('p', { class: 'name' });
  const about = h('p', { class: 'about' });
  const why = h('p', { class: 'reason' });
  const bar = progress(t('scan.progress'));
  const columns = reading(t('scan.columns'), 'wide');
  const rate = reading(t('scan.rate'));
  const left = reading(t('scan.left'));
  const table = reading(t('scan.table'));
  const link = h('div', { class: 'linkstate' });
  const linkChip = chip('link');
  const device = h('span', { class: 'device' });
  link.append(linkChip, device);
  const button = (/** @type {string} */ key, /** @type {string} */ symbol, /** @type {string} */ tone, /** @type {(b: any) => void} */ act) => {
    const element = h('button', { type: 'button', class: tone, onclick: () => act(element) }, icon(symbol), h('span', null, t(key)));
    return element;
  };
  const scanOf = () => app.model.scanners.get(which())?.scan;
  const start = button('scan.start', 'play', 'primary big', () => openStart(which()));
  const pause = button('scan.pause', 'pause', 'big', (b) => during(b, async () => act('pause')));
  const resume = button('scan.resume', 'play', 'primary big', (b) => askResume(scanOf(), which(), () => during(b, async () => act('resume'))));
  const abort = button('scan.abort', 'stop', 'danger big', (b) => askAbort(which(), b));
  const act = async (/** @type {string} */ what) => {
    app.model.takeScan(await post(`/v1/scans/${at(scanOf().id)}/${what}`));
    tell('change');
  };
  const element = h('section', { class: 'panel scan', 'aria-label': t('scan.title') },
    h('div', { class: 'head' }, heading, state), name, about, why, bar,
    h('dl', { class: 'readings' }, columns, rate, left, table),
    h('div', { class: 'buttons', role: 'group', 'aria-label': t('scan.controls') }, start, pause, resume, abort), link);
  const update = () => {
    const scanner = app.model.scanners.get(which());
    const scan = scanner?.scan ?? app.model.lastScan.get(which());
    const live = app.model.live.get(which());
    const active = underWay(scanner?.scan);
    const same = live && scan && live.scan === scan.id ? live : null;
    state.hidden = !scan;
    if (scan) state.update(scan.state);
    text(heading, t(active ? 'scan.now' : 'scan.last'));
    text(name, scan ? scan.name : t('scan.none'));
    text(about, scan ? [scan.part, scan.operator, scan.note].filter(Boolean).join(' \u00b7 ') : '');
    about.hidden = about.textContent === '';
    why.hidden = !scan?.reason;
    text(why, scan?.reason ?? '');
    english(why);
    const taken = Math.max(scan?.columns ?? 0, same?.columns ?? 0);
    const planned = scan?.columns_planned || same?.planned || 0;
    bar.hidden = !scan;
    bar.update(planned > 0 ? taken / planned : 0, t('scan.of', { taken, planned }));
    columns.update(scan ? `${taken} / ${planned || '?'}` : fixed(null, 0));
    const fresh = app.model.connected && scan?.state === 'scanning' && same;
    rate.update(fixed(fresh ? same.rate.perSecond : null, 1) + (fresh && same.rate.perSecond !== null ? ' /s' : ''));
    left.update(clock(fresh ? same.rate.left(planned) : null));
    table.update(active && same?.xMm !== null && same?.xMm !== undefined ? `x ${fixed(same.xMm, 2)} mm` : fixed(null, 0));
    const able = app.model.connected && Boolean(scanner);
    start.hidden = active;
    // One that would go on by itself can be made to wait for a person, too.
    const pausable = scan?.state === 'scanning' || (scan?.state === 'paused' && !scan.needs_person);
    pause.hidden = !active || (scan?.state === 'paused' && !pausable);
    resume.hidden = scan?.state !== 'paused' || !active;
    abort.hidden = !active;
    start.disabled = !able;
    if (resume.getAttribute('aria-busy') !== 'true') resume.disabled = !able;
    if (pause.getAttribute('aria-busy') !== 'true') pause.disabled = !able || !pausable;
    link.hidden = !scanner;
    if (scanner) {
      linkChip.update(app.model.connected ? scanner.link : 'unknown');
      text(device, [scanner.model, scanner.serial].filter(Boolean).join(' ') + (scanner.endpoint ? ` \u00b7 ${scanner.endpoint}` : ''));
    }
  };
  return { element, update };
}

/** A person's word is asked for where the scanner needs one. @param {any} scan @param {string} scanner @param {() => void} go */
async function askResume(scan, scanner, go) {
  if (!scan) return;
  const more = scan.reason ? [english(h('p', { class: 'quoted' }, scan.reason))] : [];
  const sure = await confirm({
    title: t('resume.title'), text: t(scan.needs_person ? 'resume.person' : 'resume.text', { name: scan.name, scanner }),
    action: t('resume.action'), danger: true, symbol: 'beam', more,
  });
  if (sure) go();
}

/** What becomes of the scans. @param {() => string} which */
function jobPanel(which) {
  const list = h('div', { class: 'jobs-now' });
  const element = h('section', { class: 'panel', 'aria-label': t('machine.jobs') }, h('h2', null, t('machine.jobs')), list);
  let before = '';
  const update = () => {
    const jobs = [...app.model.jobs.values()].sort((a, b) => b.id - a.id)
      .filter((job) => app.model.named(job.scanner) === which()).slice(0, 3);
    const key = JSON.stringify([jobs, jobs.map((job) => app.model.progress.get(job.id))]);
    if (key === before) return;
    before = key;
    fill(list, jobs.length === 0 ? h('p', { class: 'dim' }, t('machine.no-jobs')) : jobs.map((job) => {
      const state = chip('job-state');
      state.update(job.state);
      const now = app.model.progress.get(job.id);
      const bar = progress(t('jobs.stage', { name: job.name }));
      const words = now ? `${word('stage', now.stage)} ${Math.round(100 * now.fraction)} %` : '';
      bar.update(now?.fraction ?? 0, words);
      return h('div', { class: 'job-now' }, h('div', { class: 'head' },
        job.state === 'done' ? h('a', { href: routeTo('result', job.result), 'aria-label': t('jobs.open', { name: job.name }) }, job.name) : h('span', null, job.name), state),
      job.state === 'running' ? [bar, h('p', { class: 'dim small' }, words || t('jobs.begins'))] : null,
      job.error ? english(h('p', { class: 'dim small' }, job.error)) : null);
    }), h('a', { class: 'more', href: routeTo('jobs') }, t('machine.all-jobs')));
  };
  return { element, update };
}
