// @ts-check
/** Numbers as people read them. Pure. */

/** Stands where there is no figure. */
export const NO_FIGURE = '\u2013';

/** @param {number | null | undefined} value @param {number} digits behind the point */
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return NO_FIGURE;
  const text = value.toFixed(digits);
  // A minus before zeros alone tells nothing.
  return (Number(text) === 0 ? text.replace('-', '') : text).replace('-', '\u2212');
}

/**
 * A value with as many digits as its uncertainty has meaning: two of that.
 * @param {number} value @param {number} uncertainty
 */
export function withUncertainty(value, uncertainty) {
  if (!(uncertainty > 0)) return { value: fixed(value, 4), uncertainty: '0' };
  const digits = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(uncertainty))));
  return { value: fixed(value, digits), uncertainty: fixed(uncertainty, digits) };
}

/** @param {number | null | undefined} bytes */
export function bytes(bytes) {
  if (bytes === null || bytes === undefined) return NO_FIGURE;
  if (bytes < 1000) return `${bytes} B`;
  const units = ['kB', 'MB', 'GB', 'TB'];
  let value = bytes / 1000;
  let unit = 0;
  while (value >= 999.5 && unit < units.length - 1) {
    value /= 1000;
    unit += 1;
  }
  return `${value < 10 ? value.toFixed(1) : value.toFixed(0)} ${units[unit]}`;
}

/** Minutes and seconds, hours where there are any. @param {number | null | undefined} seconds */
export function clock(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return NO_FIGURE;
  const whole = Math.max(0, Math.round(seconds));
  const two = (/** @type {number} */ n) => String(n).padStart(2, '0');
  const h = Math.floor(whole / 3600);
  const m = Math.floor((whole % 3600) / 60);
  return h > 0 ? `${h}:${two(m)}:${two(whole % 60)}` : `${m}:${two(whole % 60)}`;
}

/** @param {number | null | undefined} seconds */
export function seconds(seconds) {
  if (seconds === null || seconds === undefined) return NO_FIGURE;
  return seconds < 10 ? `${seconds.toFixed(2)} s` : seconds < 100 ? `${seconds.toFixed(1)} s` : clock(seconds);
}

/**
 * Date and time where the reader is; what is no time is told as it came.
 * @param {string | null | undefined} at RFC 3339 @param {string} language
 */
export function when(at, language) {
  if (!at) return NO_FIGURE;
  const date = new Date(at);
  if (Number.isNaN(date.getTime())) return at;
  return new Intl.DateTimeFormat(language, { dateStyle: 'medium', timeStyle: 'medium', hourCycle: 'h23' }).format(date);
}

/**
 * Reads what somebody typed for a setting: a number, a list, true or false, or words.
 * @param {string} text
 */
export function settingValue(text) {
  const trimmed = text.trim();
  try {
    return JSON.parse(trimmed);
  } catch {
    return trimmed;
  }
}

/**
 * Settings from lines `key = value`.
 * @param {string} text
 * @returns {{settings: Record<string, unknown>, wrong: number | null}} `wrong` is the first line
 *   that is none, from 1
 */
export function settingLines(text) {
  /** @type {Record<string, unknown>} */
  const settings = {};
  for (const [at, line] of text.split('\n').entries()) {
    if (line.trim() === '') continue;
    const match = /^\s*([a-z0-9_]+(?:\.[a-z0-9_]+)+)\s*=\s*(.+)$/i.exec(line);
    if (!match) return { settings, wrong: at + 1 };
    settings[match[1]] = settingValue(match[2]);
  }
  return { settings, wrong: null };
}

/**
 * Columns per second, and what is left, from when columns came.
 */
export class Rate {
  /** @param {number} [windowMs] how far back it looks */
  constructor(windowMs = 8000) {
    this.windowMs = windowMs;
    /** @type {{at: number, columns: number}[]} */
    this.seen = [];
  }

  /** @param {number} atMs @param {number} columns */
  add(atMs, columns) {
    const last = this.seen.at(-1);
    if (last && columns < last.columns) this.seen = [];
    this.seen.push({ at: atMs, columns });
    while (this.seen.length > 2 && this.seen[0].at < atMs - this.windowMs) this.seen.shift();
  }

  /** @returns {number | null} */
  get perSecond() {
    if (this.seen.length < 2) return null;
    const first = this.seen[0];
    const last = this.seen[this.seen.length - 1];
    const ms = last.at - first.at;
    return ms > 0 ? ((last.columns - first.columns) * 1000) / ms : null;
  }

  /** Seconds until so many are there. @param {number} planned @returns {number | null} */
  left(planned) {
    const rate = this.perSecond;
    const last = this.seen.at(-1);
    return rate && last ? (planned - last.columns) / rate : null;
  }
}
