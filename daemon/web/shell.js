// @ts-check
/** The frame of the page: heading, ways to the views, laser, connection, and the view itself. */

import { app, on, t, tell } from './app.js';
import { alarm, announce, announcer, notesElement } from './dialogs.js';
import { attribute, fill, h, icon, text } from './dom.js';
import { LANGUAGES } from './i18n.js';
import { laserBar } from './laser.js';
import { parseRoute, routeTo } from './route.js';

const NAVIGATION = ['machine', 'scans', 'jobs', 'preview', 'room'];

/** @typedef {{element: HTMLElement, close?: () => void}} View */

/**
 * @param {Record<string, (argument: string) => View>} views
 * @param {(language: string) => void} speak
 */
export function shell(views, speak) {
  const main = h('main', { id: 'main', tabindex: '-1' });
  const links = NAVIGATION.map((view) => h('a', { href: routeTo(view) }, t(`nav.${view}`)));
  const header = h('header', null,
    h('a', { class: 'brand', href: routeTo('machine'), 'aria-label': t('nav.home') }, h('img', { src: '/assets/icon.svg', alt: '', width: 28, height: 28 }), h('span', null, 'Relief')),
    h('nav', { 'aria-label': t('nav.title') }, links),
    h('div', { class: 'tools' }, line(), languages(speak), themes()));
  fill(document.body,
    h('a', { class: 'skip', href: '#main', onclick: (/** @type {Event} */ event) => {
      event.preventDefault();
      main.focus();
    } }, t('nav.skip')),
    header, laserBar(), lost(), main, notesElement, announcer, alarm);

  /** @type {View | null} */
  let view = null;
  let first = true;
  const go = () => {
    const route = parseRoute(location.hash);
    const shown = route.view === 'result' ? 'jobs' : route.view;
    for (const [k, link] of links.entries()) {
      attribute(link, 'aria-current', NAVIGATION[k] === shown ? 'page' : null);
      // On a telephone not all of them fit.
      if (NAVIGATION[k] === shown) link.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    }
    view?.close?.();
    app.viewName = t(`nav.${route.view}`);
    view = views[route.view](route.argument);
    fill(main, view.element);
    scrollTo(0, 0);
    tell('change');
    // Whoever has asked for a view goes on reading there, and not behind a link that is far above.
    if (!first) main.focus({ preventScroll: true });
    first = false;
  };
  addEventListener('hashchange', go);
  go();
}

/** Whether the service is heard. */
function line() {
  const words = h('span', null);
  const element = h('span', { class: 'line' }, h('span', { class: 'dot', 'aria-hidden': 'true' }), words);
  const update = () => {
    element.dataset.up = String(app.model.connected);
    text(words, t(app.model.connected ? 'connection.up' : 'connection.down'));
  };
  on('connection', update);
  update();
  return element;
}

/** Told when the service is not heard any more; what is shown is then of before. */
function lost() {
  const words = h('p', null);
  const element = h('div', { class: 'lost', role: 'region', 'aria-label': t('connection.lost') }, icon('warning'), words);
  let since = false;
  const update = () => {
    const { connected, lastWordMs } = app.model;
    const away = !connected && lastWordMs !== null;
    element.hidden = !away;
    document.body.classList.toggle('stale', away);
    if (away) {
      const seconds = Math.round((Date.now() - lastWordMs) / 1000);
      text(words, t('connection.stale', { seconds }));
    }
    if (away !== since) announce(t(away ? 'connection.lost-said' : 'connection.back'), away);
    since = away;
  };
  on('connection', update);
  on('tick', update);
  update();
  return element;
}

/** @param {(language: string) => void} speak */
function languages(speak) {
  const select = h('select', { 'aria-label': t('language.title') },
    LANGUAGES.map((language) => h('option', { value: language, lang: language, selected: language === app.words.language }, t(`language.${language}`))));
  select.addEventListener('change', () => speak(select.value));
  return select;
}

const THEMES = ['auto', 'light', 'dark'];

function themes() {
  const root = document.documentElement;
  const select = h('select', { 'aria-label': t('theme.title') },
    THEMES.map((theme) => h('option', { value: theme, selected: (root.dataset.theme ?? 'auto') === theme }, t(`theme.${theme}`))));
  select.addEventListener('change', () => {
    if (select.value === 'auto') {
      delete root.dataset.theme;
      localStorage.removeItem('relief.theme');
    } else {
      root.dataset.theme = select.value;
      localStorage.setItem('relief.theme', select.value);
    }
    tell('theme');
  });
  return select;
}
