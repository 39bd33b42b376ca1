// @ts-check
/** Small pieces that several views are made of. */

import { english, t, word } from './app.js';
import { ticket } from './api.js';
import { during } from './dialogs.js';
import { attribute, h, icon, text } from './dom.js';

/** Symbol and tone of each state: colour is never the only sign. */
const STATES = {
  starting: ['wait', 'busy'], scanning: ['run', 'busy'], paused: ['pause', 'warn'], complete: ['check', 'good'],
  aborted: ['stop', 'plain'], failed: ['warning', 'bad'], interrupted: ['warning', 'warn'],
  queued: ['wait', 'plain'], running: ['run', 'busy'], done: ['check', 'good'], cancelled: ['stop', 'plain'],
  ready: ['check', 'good'], trouble: ['warning', 'bad'], unknown: ['unknown', 'warn'],
  delivered: ['check', 'good'], waiting: ['wait', 'plain'], given_up: ['warning', 'bad'], dropped: ['warning', 'warn'],
};

/** The state of something, in a word with a symbol. @param {string} group of strings */
export function chip(group) {
  const symbol = h('span', { class: 'symbol' });
  const words = h('span', null);
  const element = h('span', { class: 'chip' }, symbol, words);
  element.update = (/** @type {string} */ state) => {
    if (element.dataset.state === state) return;
    element.dataset.state = state;
    const [name, tone] = STATES[/** @type {keyof STATES} */ (state)] ?? ['unknown', 'plain'];
    element.dataset.tone = tone;
    symbol.replaceChildren(icon(name));
    text(words, word(group, state));
  };
  return element;
}

/** A bar of progress with its words. @param {string} label */
export function progress(label) {
  const bar = h('div', { class: 'done' });
  const element = h('div', { class: 'progress', role: 'progressbar', 'aria-label': label, 'aria-valuemin': 0, 'aria-valuemax': 100 }, bar);
  element.update = (/** @type {number} */ share, /** @type {string} */ words) => {
    const percent = Math.round(100 * Math.min(1, Math.max(0, share)));
    bar.style.width = `${100 * Math.min(1, Math.max(0, share))}%`;
    attribute(element, 'aria-valuenow', String(percent));
    attribute(element, 'aria-valuetext', words);
  };
  return element;
}

/** @param {string} label @param {string} [className] a figure with its name; `update` sets it */
export function reading(label, className = '') {
  const value = h('dd', { class: 'figure' });
  const element = h('div', { class: `reading ${className}` }, h('dt', null, label), value);
  element.update = (/** @type {string} */ words) => text(value, words);
  return element;
}

/** @param {[string, any][]} rows names and what they are; rows without a value are left out */
export function facts(rows) {
  return h('dl', { class: 'facts' }, rows.filter(([, value]) => value !== null && value !== undefined && value !== '')
    .map(([name, value]) => h('div', null, h('dt', null, name), h('dd', null, value))));
}

/**
 * A file of the spool that is opened or saved without the token's header.
 * @param {string} path @param {string} name @param {string} label @param {{open?: boolean, class?: string, symbol?: string}} [options]
 */
export function fileLink(path, name, label, { open = false, class: className = '', symbol = 'down' } = {}) {
  const link = h('a', { class: className, href: path, ...(open ? { target: '_blank', rel: 'noopener' } : { download: name }) }, icon(symbol), h('span', null, label));
  link.addEventListener('click', async (/** @type {MouseEvent} */ event) => {
    event.preventDefault();
    // A window has to be opened at once, or the browser takes it for one that nobody has asked for.
    const tab = open ? window.open('', '_blank') : null;
    const url = await during(null, () => ticket(path));
    if (!url) {
      tab?.close();
      return;
    }
    if (tab) {
      tab.opener = null;
      tab.location.href = url;
    } else {
      const once = h('a', { href: url, download: name });
      document.body.append(once);
      once.click();
      once.remove();
    }
  });
  return link;
}

/** What the service says went wrong, with what to do about it. @param {string | undefined} error @param {string | undefined} hint */
export function fault(error, hint) {
  if (!error) return null;
  return english(h('p', { class: 'trouble' }, icon('warning'), h('span', null, error, hint ? h('span', { class: 'hint' }, hint) : null)));
}

/**
 * Tabs: arrows move between them, as readers of the screen expect.
 * @param {string} label @param {{id: string, label: string}[]} tabs @param {string} chosen
 * @param {(id: string) => void} choose
 */
export function tablist(label, tabs, chosen, choose) {
  const element = h('div', { class: 'tabs', role: 'tablist', 'aria-label': label });
  const buttons = tabs.map(({ id, label: words }) => h('button', {
    type: 'button', role: 'tab', id: `tab-${id}`, 'aria-controls': `panel-${id}`,
    onclick: () => select(id, true),
  }, words));
  /** @param {string} id @param {boolean} told */
  const select = (id, told) => {
    for (const [k, button] of buttons.entries()) {
      const on = tabs[k].id === id;
      attribute(button, 'aria-selected', String(on));
      attribute(button, 'tabindex', on ? '0' : '-1');
    }
    if (told) choose(id);
  };
  element.addEventListener('keydown', (/** @type {KeyboardEvent} */ event) => {
    const at = buttons.indexOf(document.activeElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: buttons.length - 1 }[event.key];
    if (at < 0 || to === undefined) return;
    event.preventDefault();
    const k = (to + buttons.length) % buttons.length;
    buttons[k].focus();
    select(tabs[k].id, true);
  });
  element.append(...buttons);
  select(chosen, false);
  element.select = (/** @type {string} */ id) => select(id, false);
  return element;
}

/** @param {string} [name] of a heading's text, for `aria-labelledby` */
export function panel(name, ...children) {
  return h('section', { class: 'panel', 'aria-label': name }, ...children);
}

/** @param {string} key */
export const settingName = (key) => {
  const short = `setting.${key}`;
  const said = t(short);
  return said === short ? key : said;
};
