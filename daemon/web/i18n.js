// @ts-check
/** Words in the language of whoever reads. Pure: strings are handed in. */

/** Languages there are strings of; each is called by its own name in them. */
export const LANGUAGES = ['en', 'ko'];

/** @typedef {Record<string, string>} Strings */

/**
 * The language for somebody who prefers these.
 * @param {readonly string[]} preferred such as `navigator.languages` @returns {'en' | 'ko'}
 */
export function choose(preferred) {
  for (const tag of preferred) {
    const language = tag.toLowerCase().split('-')[0];
    if (language === 'en' || language === 'ko') return language;
  }
  return 'en';
}

export class Words {
  /** @param {string} language @param {Strings} strings @param {Strings} [fallback] */
  constructor(language, strings, fallback = {}) {
    this.language = language;
    this.strings = strings;
    this.fallback = fallback;
    this.plural = new Intl.PluralRules(language);
  }

  /** @param {string} key */
  has(key) {
    return key in this.strings || key in this.fallback;
  }

  /**
   * A string with `{name}` replaced. With `count`, `key.one` goes before `key` where the language
   * has it.
   * @param {string} key @param {Record<string, string | number>} [values]
   */
  say(key, values = {}) {
    let text;
    if (typeof values.count === 'number') text = this.strings[`${key}.${this.plural.select(values.count)}`];
    text ??= this.strings[key] ?? this.fallback[key] ?? key;
    return text.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole));
  }

  /**
   * A word of the service in this language, or as the service says it.
   * @param {string} group @param {string} word
   */
  word(group, word) {
    const key = `${group}.${word.replaceAll(' ', '-')}`;
    return this.has(key) ? this.say(key) : word;
  }
}
