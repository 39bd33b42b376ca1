// @ts-check
/** Where the page is, as told by the part of the address behind `#`. Pure. */

/** @typedef {{view: string, argument: string}} Route */

export const VIEWS = ['machine', 'scans', 'jobs', 'result', 'preview', 'room'];

/**
 * `#/result/NAME` is the view `result` of NAME; what is not known is the machine.
 * @param {string} hash @returns {Route}
 */
export function parseRoute(hash) {
  const match = /^#\/([a-z]+)(?:\/(.*))?$/.exec(hash);
  if (!match || !VIEWS.includes(match[1])) return { view: 'machine', argument: '' };
  let argument = match[2] ?? '';
  try {
    argument = decodeURIComponent(argument);
  } catch {
    argument = '';
  }
  return { view: match[1], argument };
}

/** @param {string} view @param {string} [argument] */
export const routeTo = (view, argument) => `#/${view}${argument ? `/${encodeURIComponent(argument)}` : ''}`;

/**
 * Takes a token out of `#token=...`.
 * @param {string} hash @returns {string} empty if there is none
 */
export function tokenIn(hash) {
  const match = /^#(?:.*&)?token=([^&]+)/.exec(hash);
  if (!match) return '';
  try {
    return decodeURIComponent(match[1]).trim();
  } catch {
    return '';
  }
}
