// @ts-check
/** The laser of each scanner, where nobody can overlook it, in every view. */

import { at, post } from './api.js';
import { app, english, on, t, tell, word } from './app.js';
import { announce, confirm, during } from './dialogs.js';
import { attribute, h, icon, keyed, text } from './dom.js';
import { underWay } from './model.js';

/** Faults that the page names in the reader's language; the service tells them within a sentence. */
const FAULTS = [
  'interlock open', 'emergency stop pressed', 'laser fault', 'limit switch hit', 'over-temperature', 'table stalled',
  'camera fault', 'mirror fault', 'supply voltage out of bounds', 'device buffer overrun', 'calibration damaged',
];

/**
 * What is known of a scanner's laser at this moment.
 * @param {any} scanner @returns {'on' | 'off' | 'unknown'}
 */
export function laserOf(scanner) {
  if (!app.model.connected) return 'unknown';
  // While columns come it is on, whenever the next status comes.
  if (scanner.scan?.state === 'scanning') return 'on';
  return scanner.laser?.laser ?? 'unknown';
}

/** Names of the faults in what the service says. @param {string | undefined} said */
export const faultsIn = (said) => FAULTS.filter((fault) => said?.includes(fault));

const SYMBOLS = { on: 'beam', off: 'off', unknown: 'unknown' };

/** @type {Map<string, string>} */
const told = new Map();

/** @param {any} scanner */
function segment(scanner) {
  const name = scanner.name;
  const title = h('strong', { class: 'what' });
  const who = h('span', { class: 'who' });
  const why = h('span', { class: 'why' });
  const fault = h('p', { class: 'fault' });
  const symbol = h('span', { class: 'symbol' });
  const abort = h('button', { class: 'abort', type: 'button', onclick: () => askAbort(name, abort) }, icon('stop'), h('span', null, t('scan.abort')));
  const element = h('div', { class: 'segment', role: 'group', 'aria-label': name ? t('laser.of', { scanner: name }) : t('laser.title') },
    symbol, h('div', { class: 'words' }, h('p', null, title, who), why, fault), abort);
  element.update = (/** @type {any} */ scanner) => {
    const laser = laserOf(scanner);
    if (element.dataset.laser !== laser) {
      element.dataset.laser = laser;
      symbol.replaceChildren(icon(SYMBOLS[laser]));
    }
    text(title, t(`laser.${laser}`));
    text(who, app.model.scanners.size > 1 ? name : '');
    const scan = scanner.scan;
    if (!app.model.connected) text(why, !scanner.laser ? t('laser.not-yet') : t('laser.last', { state: t(`laser.${scanner.laser.laser}`) }));
    else text(why, scanner.laser?.cause ?? '');
    english(why);
    const waits = scan?.state === 'paused' && scan.needs_person;
    const problem = scanner.problem ?? (waits ? scan.reason : undefined);
    const faults = faultsIn(problem).map((name) => word('fault', name));
    attribute(element, 'data-fault', scanner.problem || faults.length > 0 ? 'true' : waits ? 'waits' : null);
    why.hidden = Boolean(problem) && why.textContent === problem;
    const named = faults.length > 0 ? faults.join(', ') : waits ? t('laser.waits') : '';
    text(fault, problem ? [named, problem].filter(Boolean).join(': ') : '');
    // On a lost line, too: the request may get through where the events do not.
    abort.hidden = !underWay(scan);
    const key = `${laser} ${problem ?? ''}`;
    if (told.get(name) !== undefined && told.get(name) !== key) {
      announce(`${name}: ${t(`laser.${laser}`)}. ${problem ?? ''}`, laser !== 'off' || Boolean(problem));
    }
    told.set(name, key);
  };
  return element;
}

/** @param {string} scanner @param {HTMLButtonElement | null} button */
export async function askAbort(scanner, button) {
  const scan = app.model.scanners.get(scanner)?.scan;
  if (!scan) return;
  const sure = await confirm({
    title: t('abort.title'), text: t('abort.text', { name: scan.name, scanner }), action: t('scan.abort'), danger: true, symbol: 'stop',
  });
  if (!sure) return;
  await during(button, async () => {
    app.model.takeScan(await post(`/v1/scans/${at(scan.id)}/abort`));
    tell('change');
  });
}

/** The bar of all scanners. @returns {HTMLElement} */
export function laserBar() {
  const bar = h('section', { class: 'laser', 'aria-label': t('laser.title') });
  const update = () => {
    // Before the first word of the service nothing is known, and that is said.
    const scanners = app.model.scanners.size > 0 ? [...app.model.scanners.values()] : [{ name: '' }];
    keyed(bar, scanners, (scanner) => scanner.name, segment);
    const on = scanners.some((scanner) => laserOf(scanner) === 'on');
    const lost = !app.model.connected && app.model.scanners.size > 0;
    document.title = [on ? `\u26a0 ${t('laser.on')}` : lost ? t('connection.lost') : '', app.viewName, 'Relief'].filter(Boolean).join(' \u2013 ');
  };
  on('change', update);
  on('connection', update);
  update();
  return bar;
}
