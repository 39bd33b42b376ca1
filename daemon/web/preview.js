// @ts-check
/** What other settings would do to a kept scan's range image, before a scan or a rerun is spent. */

import { ApiError, at, get, post } from './api.js';
import { app, t } from './app.js';
import { announce, during, trouble } from './dialogs.js';
import { fill, h, icon } from './dom.js';
import { fixed, seconds } from './format.js';
import { Lattice } from './lattice.js';
import { underWay } from './model.js';
import { patient } from './patience.js';
import { RangePicture } from './picture.js';
import { routeTo } from './route.js';
import { openRerun } from './scans.js';
import { settingFields } from './settings.js';
import { openStart, previewFacts } from './start.js';

const MOST_NODES = 250000;

/** @param {string} id of a scan; the latest with columns if empty */
export function openPreview(id) {
  const content = h('div', null, h('p', { class: 'dim' }, t('list.asking')));
  const element = h('div', { class: 'view' }, h('h1', null, t('nav.preview')), h('p', { class: 'lead' }, t('try.lead')), content);
  /** @type {{close: () => void}[]} */
  const open = [];
  const state = { gone: false };
  begin(id, content, open, state);
  return {
    element,
    close: () => {
      state.gone = true;
      for (const one of open) one.close();
    },
  };
}

/** @param {string} id @param {HTMLElement} content @param {{close: () => void}[]} open @param {{gone: boolean}} state */
async function begin(id, content, open, state) {
  try {
    const { scans } = await get('/v1/scans?limit=50');
    const kept = scans.filter((/** @type {any} */ scan) => !underWay(scan) && scan.columns > 0 && !scan.removed_at);
    let scan = id ? kept.find((/** @type {any} */ one) => one.id === id) : kept[0];
    if (id && !scan) {
      scan = await get(`/v1/scans/${at(id)}`);
      kept.push(scan);
    }
    if (state.gone) return;
    if (!scan) fill(content, h('p', { class: 'dim' }, t('try.no-scan')));
    else fill(content, page(scan, kept, open, state));
  } catch (error) {
    if (!state.gone) fill(content, trouble(error));
  }
}

/** @param {any} scan @param {any[]} kept @param {{close: () => void}[]} open @param {{gone: boolean}} state */
function page(scan, kept, open, state) {
  const which = h('select', { id: 'try-scan' }, kept.map((one) => h('option', { value: one.id, selected: one.id === scan.id }, `${one.name} \u2013 ${one.id.slice(0, 15)}`)));
  which.addEventListener('change', () => {
    location.hash = routeTo('preview', which.value);
  });
  const fields = settingFields(scan.settings ?? {});
  const show = h('button', { type: 'submit', class: 'primary' }, icon('run'), h('span', null, t('try.action')));
  const use = h('button', { type: 'button', onclick: () => {
    app.nextSettings = fields.value() ?? {};
    openStart(app.model.named(scan.scanner));
  } }, icon('play'), h('span', null, t('try.use')));
  const rerun = h('button', { type: 'button', onclick: () => openRerun(scan, fields.value() ?? {}) }, icon('run'), h('span', null, t('try.rerun')));
  const numbers = h('div', { class: 'outcome' });
  const compared = h('div');
  const form = h('form', { class: 'panel', novalidate: true, 'aria-label': t('try.settings') },
    h('h2', null, t('try.settings')), h('div', { class: 'field' }, h('label', { for: 'try-scan' }, t('try.scan')), which), fields.element,
    h('div', { class: 'buttons' }, show), numbers, h('div', { class: 'buttons' }, use, rerun));

  // The cursor of both is at the same place, so that a node can be compared with itself.
  /** @type {RangePicture[]} */
  const pictures = [];
  let following = false;
  const follow = (/** @type {RangePicture} */ from) => {
    if (following) return;
    following = true;
    for (const other of pictures) {
      if (other === from) continue;
      const place = from.place;
      const found = place && other.lattice ? other.lattice.nearest(place.xMm, place.yMm) : null;
      if (found) other.setCursor(found.i, found.j);
      else other.clearCursor();
    }
    following = false;
  };
  const before = new RangePicture({ label: t('try.before'), onCursor: follow });
  const after = new RangePicture({ label: t('try.after'), onCursor: follow });
  pictures.push(before, after);
  open.push(...pictures);
  before.nothing(t('list.asking'));
  after.nothing(t('try.nothing'));
  const panel = (/** @type {string} */ key, /** @type {RangePicture} */ picture) => h('section', { class: 'panel', 'aria-label': t(key) }, h('h2', null, t(key)), picture.element);

  /** @type {any} */
  let base = null;
  const wanted = () => !state.gone;
  const regridded = (/** @type {Record<string, unknown>} */ settings) => patient(
    () => post(`/v1/scans/${at(scan.id)}/regrid`, { settings, most_nodes: MOST_NODES }), wanted);
  const loadBefore = async () => {
    try {
      base = await patient(() => get(`/v1/scans/${at(scan.id)}/image?most_nodes=${MOST_NODES}`), wanted);
      if (!state.gone) before.show(Lattice.of(base));
    } catch (error) {
      before.nothing(error instanceof ApiError ? error.message : String(error));
    }
  };
  const run = () => during(show, async () => {
    const settings = fields.value();
    if (!settings) throw new Error(t('settings.wrong-line'));
    // The service makes one image at a time.
    await loading;
    const [image, told] = await Promise.all([
      regridded(settings),
      // The numbers are of the scanner that is there; without it there are none.
      post('/v1/scans/preview', { ...(scan.scanner ? { scanner: scan.scanner } : {}), settings }).catch((error) => error),
    ]);
    if (state.gone) return;
    after.show(Lattice.of(image));
    fill(compared, comparison(base, image));
    announce(t('try.done'));
    fill(numbers, told instanceof Error ? trouble(told) : [h('h3', null, t('try.next-scan')), previewFacts(told)]);
    if (base?.seconds !== undefined) return;
    // The figures of the scan as it was come from the same place, once, so that they compare.
    base = await regridded({}).catch(() => base);
    if (!state.gone) fill(compared, comparison(base, image));
  });
  form.addEventListener('submit', (/** @type {Event} */ event) => {
    event.preventDefault();
    run();
  });
  const loading = loadBefore();
  return h('div', { class: 'try' }, form, h('div', { class: 'pair' }, panel('try.before', before), panel('try.after', after), compared));
}

/** @param {any} base @param {any} image */
function comparison(base, image) {
  const nodes = (/** @type {any} */ one) => one?.nodes ?? Lattice.of(one).nodes;
  const row = (/** @type {string} */ key, /** @type {string} */ before, /** @type {string} */ after) => h('tr', null, h('th', { scope: 'row' }, t(key)), h('td', { class: 'figure number' }, before), h('td', { class: 'figure number' }, after));
  const none = fixed(null, 0);
  const noise = (/** @type {any} */ one) => (one?.noise_mm === undefined || one.noise_mm === null ? none : `${fixed(one.noise_mm, 4)} mm`);
  return h('section', { class: 'panel', 'aria-label': t('try.compared') }, h('h2', null, t('try.compared')), h('table', null,
    h('thead', null, h('tr', null, h('th', { scope: 'col' }, t('try.figure')), h('th', { scope: 'col', class: 'number' }, t('try.before')), h('th', { scope: 'col', class: 'number' }, t('try.after')))),
    h('tbody', null,
      row('summary.pitch', base ? `${fixed(base.pitch_mm, 3)} mm` : none, `${fixed(image.pitch_mm, 3)} mm`),
      row('summary.nodes', base ? nodes(base).toLocaleString() : none, nodes(image).toLocaleString()),
      row('summary.noise', noise(base), noise(image)),
      row('summary.inliers', base?.inlier_share === undefined || base.inlier_share === null ? none : `${fixed(100 * base.inlier_share, 1)} %`, image.inlier_share === null || image.inlier_share === undefined ? none : `${fixed(100 * image.inlier_share, 1)} %`),
      row('try.seconds', base?.seconds === undefined ? none : seconds(base.seconds), seconds(image.seconds)))));
}
