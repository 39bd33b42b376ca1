// @ts-check
/** A result: its pictures, its faces in three dimensions, what the report says, and its files. */

import { ApiError, at, get, request, spoolPath } from './api.js';
import { app, t, word } from './app.js';
import { announce, trouble } from './dialogs.js';
import { fill, h, icon } from './dom.js';
import { deviationImage } from './facts.js';
import { bytes, when } from './format.js';
import { readGlb } from './glb.js';
import { Lattice } from './lattice.js';
import { fileLink, tablist } from './parts.js';
import { patient } from './patience.js';
import { RangePicture } from './picture.js';
import { routeTo } from './route.js';
import { openRerun } from './scans.js';
import { Solid } from './solid.js';
import { figures, regionCard, regionTable, warnings } from './summary.js';

/** Pictures of the spool that have a place in the page, with the strings that name them. */
const PICTURES = ['range.png', 'regions.png', 'residuals.png', 'inliers.png'];

/** @param {string} result name of the folder in the spool */
export function openResult(result) {
  const content = h('div', { class: 'view' }, h('p', { class: 'dim' }, t('list.asking')));
  const element = content;
  /** @type {{close: () => void}[]} */
  const open = [];
  const state = { gone: false };
  load(result, content, open, state);
  return {
    element,
    close: () => {
      state.gone = true;
      for (const one of open) one.close();
    },
  };
}

/** @param {string} result @param {HTMLElement} content @param {{close: () => void}[]} open @param {{gone: boolean}} state */
async function load(result, content, open, state) {
  try {
    const entry = await get(`/v1/spool/${at(result)}`);
    const has = (/** @type {string} */ name) => entry.files.some((/** @type {any} */ file) => file.name === name);
    const [report, manifest] = await Promise.all([
      has('report.json') ? get(spoolPath(result, 'report.json')) : null, has('manifest.json') ? get(spoolPath(result, 'manifest.json')) : null,
    ]);
    if (state.gone) return;
    fill(content, page(result, entry, report, manifest, open, state));
  } catch (error) {
    if (state.gone) return;
    const missing = error instanceof ApiError && error.status === 404;
    fill(content, h('h1', null, t('nav.result')), trouble(error), missing ? h('p', { class: 'dim' }, t('result.missing')) : null,
      h('p', null, h('a', { href: routeTo('jobs') }, t('machine.all-jobs'))));
  }
}

/** @param {string} result @param {any} entry @param {any} report @param {any} manifest @param {{close: () => void}[]} open @param {{gone: boolean}} state */
function page(result, entry, report, manifest, open, state) {
  const names = new Set(entry.files.map((/** @type {any} */ file) => file.name));
  const scan = report?.scan ?? {};
  const rerun = h('button', { type: 'button', onclick: () => openRerun({ id: scan.id, name: report.name, settings: {} }) }, icon('run'), h('span', null, t('scans.rerun')));
  const head = h('div', { class: 'head result-head' }, h('div', null, h('h1', null, report?.name ?? result),
    h('p', { class: 'about' }, [when(report?.timestamp, app.words.language), scan.scanner, scan.source, scan.part, scan.operator, scan.note].filter(Boolean).join(' \u00b7 '))),
  h('div', { class: 'buttons' },
    names.has('report.html') ? fileLink(spoolPath(result, 'report.html'), 'report.html', t('result.page'), { open: true, class: 'button', symbol: 'link' }) : null,
    names.has('report.pdf') ? fileLink(spoolPath(result, 'report.pdf'), 'report.pdf', 'PDF', { open: true, class: 'button', symbol: 'link' }) : null,
    scan.id ? h('a', { class: 'button', href: routeTo('preview', scan.id) }, t('scans.preview')) : null, scan.id ? rerun : null));
  const chosen = h('div', { class: 'chosen' });
  const viewer = viewers(result, names, report, open, state, (region) => {
    if (region !== null) announce(`${t('result.region', { label: region.label })}: ${word('kind', region.kind)}`);
    fill(chosen, region === null ? h('p', { class: 'dim' }, t('result.pick')) : regionCard(report, region));
  });
  fill(chosen, h('p', { class: 'dim' }, t('result.pick')));
  return [head, warnings(report),
    h('div', { class: 'result' },
      h('section', { class: 'panel', 'aria-label': t('result.views') }, viewer.element),
      h('div', { class: 'side' },
        names.has('view.glb') ? h('section', { class: 'panel', 'aria-label': t('result.face') }, h('h2', null, t('result.face')), viewer.list, chosen) : null,
        h('section', { class: 'panel', 'aria-label': t('result.figures') }, h('h2', null, t('result.figures')), report ? figures(report) : h('p', { class: 'dim' }, t('result.no-report'))))),
    report ? h('section', { class: 'panel', 'aria-label': t('result.regions') }, h('h2', null, t('result.regions')), regionTable(report)) : null,
    h('section', { class: 'panel', 'aria-label': t('result.files') }, h('h2', null, t('result.files')), files(result, entry, manifest))];
}

/**
 * Tabs with what there is to look at; each is made when it is first looked at.
 * @param {string} result @param {Set<string>} names @param {any} report @param {{close: () => void}[]} open
 * @param {{gone: boolean}} state @param {(region: any) => void} onPick
 */
function viewers(result, names, report, open, state, onPick) {
  const list = h('div', { class: 'face-list' });
  /** @type {Promise<import('./glb.js').Glb> | null} */
  let model = null;
  const glb = () => {
    model ??= request(spoolPath(result, 'view.glb')).then((response) => response.arrayBuffer()).then(readGlb);
    return model;
  };
  const tabs = [
    ...(names.has('view.glb') ? [{ id: 'solid', label: t('result.solid') }] : []),
    ...(report?.scan?.id ? [{ id: 'image', label: t('result.image') }] : []),
    ...(names.has('view.glb') ? [{ id: 'deviation', label: t('result.deviation') }] : []),
    ...PICTURES.filter((name) => names.has(name)).map((name) => ({ id: name.replace('.png', ''), label: t(`result.${name.replace('.png', '')}`) })),
  ];
  const first = names.has('view.glb') ? 'solid' : names.has('residuals.png') ? 'residuals' : tabs[0]?.id;
  const make = {
    solid: async () => {
      const read = await glb();
      const solid = new Solid(read, (face) => {
        onPick(face ? report?.regions?.list?.find((/** @type {any} */ region) => region.label === face.region) ?? { label: face.region, kind: face.kind } : null);
        select.value = String(solid.selected);
      });
      open.push(solid);
      const select = h('select', { id: 'face', onchange: () => solid.select(Number(select.value)) }, h('option', { value: -1 }, t('result.no-face')),
        solid.faces.map((face, k) => h('option', { value: k }, `${t('result.region', { label: face.region })} \u2013 ${word('kind', face.kind)}`)));
      fill(list, h('label', { for: 'face' }, t('result.choose-face')), select);
      return solid.element;
    },
    image: async () => {
      const picture = new RangePicture({ label: t('result.image') });
      open.push(picture);
      const image = await patient(() => get(`/v1/scans/${at(report.scan.id)}/image?most_nodes=250000`), () => !state.gone);
      picture.show(Lattice.of(image));
      return picture.element;
    },
    deviation: async () => {
      const image = deviationImage(await glb());
      if (!image) throw new Error(t('result.no-deviation'));
      const picture = new RangePicture({ label: t('result.deviation'), deviation: true });
      open.push(picture);
      picture.show(Lattice.of(image));
      return h('div', null, picture.element, h('p', { class: 'help' }, t('result.deviation-help')));
    },
  };
  /** @type {Map<string, HTMLElement>} */
  const panels = new Map(tabs.map(({ id }) => [id, h('div', { role: 'tabpanel', id: `panel-${id}`, 'aria-labelledby': `tab-${id}`, tabindex: '0', hidden: true })]));
  const choose = async (/** @type {string} */ id) => {
    for (const [name, panel] of panels) panel.hidden = name !== id;
    const panel = panels.get(id);
    if (!panel || panel.dataset.made) return;
    panel.dataset.made = 'true';
    fill(panel, h('p', { class: 'dim' }, t('list.asking')));
    try {
      const maker = make[/** @type {keyof typeof make} */ (id)];
      const element = maker ? await maker() : await spoolPicture(result, `${id}.png`, report, open);
      if (!state.gone) fill(panel, element);
    } catch (error) {
      delete panel.dataset.made;
      fill(panel, trouble(error instanceof ApiError ? error : /** @type {Error} */ (error).message));
    }
  };
  if (first) choose(first);
  const old = names.has('view.glb') ? null : h('p', { class: 'dim' }, t('result.no-solid'));
  return { element: h('div', null, tabs.length > 0 ? tablist(t('result.views'), tabs, first ?? '', choose) : null, old, ...panels.values()), list };
}

/** @param {string} result @param {string} name @param {any} report @param {{close: () => void}[]} open */
async function spoolPicture(result, name, report, open) {
  const url = URL.createObjectURL(await (await request(spoolPath(result, name))).blob());
  open.push({ close: () => URL.revokeObjectURL(url) });
  const key = name.replace('.png', '');
  return h('figure', { class: 'spool' }, h('img', { src: url, alt: t(`result.${key}-alt`, { name: report?.name ?? result }) }), h('figcaption', null, t(`result.${key}-alt`, { name: report?.name ?? result })));
}

/** @param {string} result @param {any} entry @param {any} manifest */
function files(result, entry, manifest) {
  const sums = new Map((manifest?.files ?? []).map((/** @type {any} */ file) => [file.name, file.sha256]));
  return h('ul', { class: 'files' }, entry.files.map((/** @type {any} */ file) => h('li', null,
    fileLink(spoolPath(result, file.name), file.name, file.name),
    h('span', { class: 'figure' }, bytes(file.bytes)),
    sums.has(file.name) ? h('span', { class: 'sum' }, 'SHA-256 ', h('code', null, sums.get(file.name))) : h('span', { class: 'dim' }, file.name === 'manifest.json' ? t('result.manifest') : ''))));
}
