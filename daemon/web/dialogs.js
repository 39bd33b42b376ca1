// @ts-check
/** Dialogs, and short notes of what became of a request. */

import { ApiError } from './api.js';
import { english, t } from './app.js';
import { fill, h, icon, put } from './dom.js';

let count = 0;

/**
 * A dialog with a heading; it removes itself once closed.
 * @param {string} title @param {...any} children @returns {HTMLDialogElement}
 */
export function dialog(title, ...children) {
  count += 1;
  const id = `dialog-${count}`;
  /** @type {HTMLDialogElement} */
  const element = h('dialog', { 'aria-labelledby': id }, h('h2', { id }, title), ...children);
  element.addEventListener('close', () => element.remove());
  document.body.append(element);
  return element;
}

/**
 * Asks before something that cannot be taken back.
 * @param {{title: string, text: string, action: string, danger?: boolean, symbol?: string, more?: Node[]}} what
 * @returns {Promise<boolean>}
 */
export function confirm({ title, text, action, danger = false, symbol = 'warning', more = [] }) {
  return new Promise((answer) => {
    const yes = h('button', { class: danger ? 'danger' : 'primary', type: 'button', onclick: () => element.close('yes') }, action);
    const element = dialog(
      title,
      h('p', { class: 'asks' }, icon(symbol), h('span', null, text)),
      ...more,
      h('div', { class: 'buttons' },
        h('button', { type: 'button', onclick: () => element.close() }, t('dialog.back')), yes),
    );
    element.classList.add('narrow');
    element.addEventListener('close', () => answer(element.returnValue === 'yes'));
    element.showModal();
    yes.focus();
  });
}

/** The words of an error, its hint included. @param {unknown} error @returns {HTMLElement} */
export function trouble(error) {
  if (!(error instanceof ApiError)) return h('p', { class: 'trouble' }, icon('warning'), h('span', null, error instanceof Error ? error.message : String(error)));
  if (error.status === 0) return h('p', { class: 'trouble' }, icon('warning'), h('span', null, t('error.no-answer')));
  const hint = error.hint ? h('span', { class: 'hint' }, error.hint) : null;
  const words = english(h('span', null, error.message, hint));
  return h('p', { class: 'trouble' }, icon('warning'), words);
}

const notes = h('div', { class: 'notes', role: 'status', 'aria-live': 'polite' });

/** Where notes appear. */
export const notesElement = notes;

/** Shows a note for a while; errors stay until they are closed. @param {string | unknown} what */
export function note(what) {
  const plain = typeof what === 'string';
  const element = h('div', { class: plain ? 'note' : 'note bad' }, plain ? h('p', null, what) : trouble(what));
  put(element, h('button', { class: 'quiet', type: 'button', 'aria-label': t('note.close'), onclick: () => element.remove() }, icon('cross')));
  notes.append(element);
  while (notes.children.length > 4) notes.firstElementChild?.remove();
  if (plain) setTimeout(() => element.remove(), 6000);
}

/**
 * Does something that a button asks for: the button is off meanwhile, and trouble is told.
 * @template T
 * @param {HTMLButtonElement | null} button @param {() => Promise<T>} work
 * @param {(error: unknown) => void} [told] where trouble is shown; notes lie behind a dialog
 * @returns {Promise<T | undefined>}
 */
export async function during(button, work, told = note) {
  button?.setAttribute('aria-busy', 'true');
  if (button) button.disabled = true;
  try {
    return await work();
  } catch (error) {
    told(error);
    return undefined;
  } finally {
    if (button) button.disabled = false;
    button?.removeAttribute('aria-busy');
  }
}

/** For screen readers alone; says what changed without being asked. */
export const announcer = h('div', { class: 'hidden', role: 'status', 'aria-live': 'polite' });
export const alarm = h('div', { class: 'hidden', role: 'alert' });

/** @param {string} words @param {boolean} [urgent] */
export function announce(words, urgent = false) {
  fill(urgent ? alarm : announcer, words);
}
