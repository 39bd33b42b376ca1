// @ts-check
/** What all parts of the page share: the model, the words, and who wants to be told of what. */

import { Model } from './model.js';
import { Words } from './i18n.js';
import { get } from './api.js';

/** @typedef {'change' | 'event' | 'live' | 'again' | 'theme' | 'tick' | 'connection'} Topic */

/** @type {Map<Topic, Set<(value?: any) => void>>} */
const listeners = new Map();

export const app = {
  model: new Model(),
  words: new Words('en', {}),
  /** What the view is called. */
  viewName: '',
  /** Settings that the preview hands to the next scan. @type {Record<string, unknown>} */
  nextSettings: {},
};

/** @param {string} key @param {Record<string, string | number>} [values] */
export const t = (key, values) => app.words.say(key, values);

/** @param {string} group @param {string} word */
export const word = (group, word) => app.words.word(group, word);

/**
 * @param {Topic} topic @param {(value?: any) => void} listener
 * @returns {() => void} ends it
 */
export function on(topic, listener) {
  if (!listeners.has(topic)) listeners.set(topic, new Set());
  listeners.get(topic)?.add(listener);
  return () => listeners.get(topic)?.delete(listener);
}

/** @param {Topic} topic @param {any} [value] */
export function tell(topic, value) {
  for (const listener of [...(listeners.get(topic) ?? [])]) listener(value);
}

/** @type {number | undefined} */
let asking;

/**
 * Asks for the status soon: what has changed since the page was last told, and what no event tells.
 * @param {number} [afterMs]
 */
export function askStatus(afterMs = 120) {
  clearTimeout(asking);
  asking = setTimeout(async () => {
    const { changes } = app.model;
    try {
      const status = await get('/v1/status');
      if (changes !== app.model.changes) {
        // Something was told meanwhile that this answer may not know of yet.
        askStatus(200);
        return;
      }
      app.model.takeStatus(status);
      app.model.lastWordMs = Date.now();
      tell('change');
    } catch {
      // The event stream notices a lost line, and says so.
    }
  }, afterMs);
}

/** Words of the service, which are English whatever the page's language. @param {Element} element */
export function english(element) {
  if (app.words.language !== 'en') element.setAttribute('lang', 'en');
  return element;
}
