// @ts-check
/** Elements made in one line. What comes from the service goes in as text alone. */

/** @typedef {string | number | Node | null | undefined | false} Child */

/**
 * An element. Properties that begin with `on` are listeners, `class` and `data-`, `aria-` and so on
 * are attributes, true is an attribute without a value, false and null are left out.
 * @param {string} tag @param {Record<string, any> | null} [properties]
 * @param {...(Child | Child[])} children
 * @returns {any}
 */
export function h(tag, properties, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? '' : String(value));
  }
  put(element, ...children);
  return element;
}

/** @param {Element} parent @param {...(Child | Child[])} children */
export function put(parent, ...children) {
  for (const child of children.flat()) {
    if (child === null || child === undefined || child === false) continue;
    parent.append(child instanceof Node ? child : String(child));
  }
}

/** @param {Element} parent @param {...(Child | Child[])} children */
export function fill(parent, ...children) {
  parent.replaceChildren();
  put(parent, ...children);
}

/** Sets text only if it differs, so that screen readers are not told it again. @param {Element} element @param {string} text */
export function text(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {Element} element @param {string} name @param {string | null} value */
export function attribute(element, name, value) {
  if (value === null) element.removeAttribute(name);
  else if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

const SVG = 'http://www.w3.org/2000/svg';

/** Paths of the icons, on 24 by 24. */
const ICONS = {
  beam: 'M3 12h7M14 12h7M12 3v4M12 17v4M5.6 5.6l2.9 2.9M15.5 15.5l2.9 2.9M18.4 5.6l-2.9 2.9M8.5 15.5l-2.9 2.9M12 10.6a1.4 1.4 0 1 0 0 2.8a1.4 1.4 0 1 0 0-2.8',
  off: 'M12 4v7M7.5 6.9a7 7 0 1 0 9 0',
  unknown: 'M9.2 9.3a2.9 2.9 0 1 1 4.4 2.5c-1 .6-1.6 1.2-1.6 2.4M12 17.6v.2M12 2.8a9.2 9.2 0 1 0 0 18.4a9.2 9.2 0 1 0 0-18.4',
  warning: 'M12 3.5L22 20.5H2zM12 10v5M12 17.6v.2',
  play: 'M7 4.5l12 7.5l-12 7.5z',
  pause: 'M8 5v14M16 5v14',
  stop: 'M6 6h12v12H6z',
  check: 'M4.5 12.5l5 5l10-11',
  cross: 'M6 6l12 12M18 6L6 18',
  wait: 'M12 2.8a9.2 9.2 0 1 0 0 18.4a9.2 9.2 0 1 0 0-18.4M12 7v5.5l3.5 2',
  run: 'M20 12a8 8 0 1 1-3-6.2M20 3v4h-4',
  down: 'M12 4v11M7 10.5l5 5l5-5M5 20h14',
  link: 'M10 5H5v14h14v-5M14 4h6v6M20 4l-9 9',
  theme: 'M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18',
  fit: 'M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5',
};

/** A picture beside words, which say it all. @param {keyof ICONS | string} name */
export function icon(name) {
  const svg = document.createElementNS(SVG, 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('class', 'icon');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', ICONS[/** @type {keyof ICONS} */ (name)] ?? ICONS.unknown);
  svg.append(path);
  return svg;
}

/**
 * A list that follows its items: an element for each key, made once, moved and updated then.
 * @template T
 * @param {Element} parent @param {T[]} items @param {(item: T) => string} key
 * @param {(item: T) => HTMLElement & {update?: (item: T) => void}} make
 */
export function keyed(parent, items, key, make) {
  /** @type {Map<string, any>} */
  const there = new Map([...parent.children].map((element) => [/** @type {any} */ (element).key, element]));
  let place = parent.firstElementChild;
  for (const item of items) {
    const name = key(item);
    let element = there.get(name);
    if (element) there.delete(name);
    else {
      element = make(item);
      element.key = name;
    }
    element.update?.(item);
    if (place && element === place) place = place.nextElementSibling;
    else parent.insertBefore(element, place);
  }
  for (const element of there.values()) element.remove();
}
