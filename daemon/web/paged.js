// @ts-check
/** A list that comes in pages, newest first, and follows the events. */

import { at, get } from './api.js';
import { on, t } from './app.js';
import { during, trouble } from './dialogs.js';
import { fill, h, keyed, text } from './dom.js';

const PAGE = 50;

/**
 * @param {{
 *   path: string, kind: 'scan' | 'job', title: string, empty: string,
 *   row: () => HTMLElement & {update: (item: any) => void},
 * }} options `row` makes an empty one
 */
export function pagedList({ path, kind, title, empty, row }) {
  const key = `${kind}s`;
  /** @type {Map<string, any>} */
  const items = new Map();
  /** @type {string | number | undefined} */
  let next;
  const list = h('ul', { class: 'list', 'aria-label': title });
  const said = h('div', null, h('p', { class: 'dim' }, t('list.asking')));
  const more = h('button', { type: 'button', class: 'more', onclick: () => during(more, load) }, t('list.more'));
  more.hidden = true;
  const count = h('p', { class: 'dim count', role: 'status' });
  const element = h('div', { class: 'view list-view' }, h('div', { class: 'head' }, h('h1', null, title), count), said, list, more);

  /** Newest first: numbers by size, names by the time that they begin with. @param {any} a @param {any} b */
  const order = (a, b) => (typeof a.id === 'number' ? b.id - a.id : a.id < b.id ? 1 : -1);
  /** Rows by id. @type {Map<string, any>} */
  const rows = new Map();
  const made = (/** @type {any} */ item) => {
    const element = row();
    rows.set(String(item.id), element);
    return element;
  };
  const show = () => {
    const sorted = [...items.values()].sort(order);
    keyed(list, sorted, (item) => String(item.id), made);
    more.hidden = next === undefined;
    text(count, sorted.length === 0 ? '' : t(next === undefined ? 'list.all' : 'list.some', { count: sorted.length }));
  };
  let pending = false;
  /** Many events at once are shown once. */
  const showSoon = () => {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      show();
    });
  };
  /** @param {{limit: number, before?: string | number}} page */
  const fetchPage = async ({ limit, before }) => {
    const page = await get(`${path}?limit=${limit}${before === undefined ? '' : `&before=${at(before)}`}`);
    for (const item of page[key]) items.set(String(item.id), item);
    return page;
  };
  const load = async () => {
    ({ next } = await fetchPage({ limit: PAGE, before: next }));
    show();
  };
  const begin = async () => {
    try {
      const page = await fetchPage({ limit: Math.max(PAGE, Math.min(items.size, 200)) });
      if (items.size <= page[key].length) next = page.next;
      fill(said, items.size === 0 ? h('p', { class: 'dim' }, empty) : null);
      show();
    } catch (error) {
      fill(said, trouble(error));
    }
  };
  const offs = [
    on('event', (event) => {
      if (event.kind !== kind) return;
      const { kind: _, ...item } = event;
      items.set(String(item.id), item);
      fill(said);
      showSoon();
    }),
    on('again', begin),
  ];
  begin();
  return {
    element,
    /** @param {string | number} id @returns {any} its row, if it is shown */
    rowOf: (id) => rows.get(String(id)),
    /** @param {any} item */
    put: (item) => {
      items.set(String(item.id), item);
      show();
    },
    close: () => {
      for (const off of offs) off();
    },
  };
}
