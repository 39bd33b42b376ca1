// @ts-check
/** Asks for the token that the service wants on its address. */

import { ApiError, request, token } from './api.js';
import { t } from './app.js';
import { dialog } from './dialogs.js';
import { fill, h, icon } from './dom.js';

/** @type {HTMLDialogElement | null} */
let open = null;

/**
 * @param {() => void} done once the service takes the token
 */
export function signIn(done) {
  if (open) return;
  const had = token.value !== '';
  token.forget();
  const said = h('p', { class: 'trouble', role: 'alert' });
  said.hidden = true;
  /** @param {string} words */
  const say = (words) => {
    fill(said, icon('warning'), h('span', null, words));
    said.hidden = false;
  };
  const input = h('input', {
    id: 'token', type: 'password', autocomplete: 'off', spellcheck: 'false', autocapitalize: 'off', required: true,
    'aria-describedby': 'token-help',
  });
  const remember = h('input', { id: 'remember', type: 'checkbox' });
  const button = h('button', { class: 'primary', type: 'submit' }, t('signin.action'));
  const form = h('form', { class: 'fields', novalidate: true },
    h('p', { id: 'token-help' }, t('signin.text'), ' ', h('code', null, 'relief token create NAME')),
    h('label', { for: 'token' }, t('signin.token')), input,
    h('div', { class: 'tick' }, remember, h('label', { for: 'remember' }, t('signin.remember'))),
    said,
    h('div', { class: 'buttons' }, button));
  form.addEventListener('submit', async (/** @type {Event} */ event) => {
    event.preventDefault();
    const value = input.value.trim();
    if (!value) {
      say(t('signin.empty'));
      input.focus();
      return;
    }
    button.disabled = true;
    token.value = value;
    try {
      await request('/v1/status');
      token.set(value, remember.checked);
      open?.close();
      open = null;
      done();
    } catch (error) {
      token.value = '';
      const status = error instanceof ApiError ? error.status : 0;
      say(status === 401 ? t('signin.wrong') : status === 0 ? t('error.no-answer') : String(/** @type {Error} */ (error).message));
      input.select();
      input.focus();
    } finally {
      button.disabled = false;
    }
  });
  open = dialog(t('signin.title'), form);
  open.classList.add('narrow');
  // There is nothing behind it to go back to.
  open.addEventListener('cancel', (event) => event.preventDefault());
  open.addEventListener('close', () => {
    open = null;
  });
  open.showModal();
  if (had) say(t('signin.expired'));
  input.focus();
}

/** True while somebody is asked. */
export const asking = () => open !== null;
