// @ts-check
/** Server-sent events, parsed from text as it comes. Pure: who reads the stream feeds it. */

/** @typedef {{event: string, data: string, id: string}} Message */

/** Most characters of a line or of an event's data: a stream that never ends a line is refused. */
const MOST_CHARS = 16 * 1024 * 1024;

export class SseParser {
  constructor() {
    this.rest = '';
    this.event = '';
    /** @type {string[]} */
    this.data = [];
    this.chars = 0;
    /** The last id that came, for `Last-Event-ID`. */
    this.lastId = '';
    /** A carriage return ended the last piece, so that a line feed at the start of the next is its own. */
    this.afterReturn = false;
  }

  /**
   * @param {string} text @returns {Message[]} the events that it completes
   */
  push(text) {
    let piece = text;
    if (this.afterReturn && piece.startsWith('\n')) piece = piece.slice(1);
    if (piece.length > 0) this.afterReturn = piece.endsWith('\r');
    const lines = (this.rest + piece).split(/\r\n|\n|\r/);
    this.rest = lines.pop() ?? '';
    if (this.rest.length > MOST_CHARS) throw new Error('a line of the event stream does not end');
    /** @type {Message[]} */
    const done = [];
    for (const line of lines) {
      const message = this.line(line);
      if (message) done.push(message);
    }
    return done;
  }

  /** @param {string} line @returns {Message | undefined} */
  line(line) {
    if (line === '') {
      const message = { event: this.event || 'message', data: this.data.join('\n'), id: this.lastId };
      const empty = this.data.length === 0;
      this.event = '';
      this.data = [];
      this.chars = 0;
      return empty ? undefined : message;
    }
    const colon = line.indexOf(':');
    if (colon === 0) return undefined;
    const field = colon < 0 ? line : line.slice(0, colon);
    let value = colon < 0 ? '' : line.slice(colon + 1);
    if (value.startsWith(' ')) value = value.slice(1);
    if (field === 'event') this.event = value;
    else if (field === 'data') {
      this.chars += value.length;
      if (this.chars > MOST_CHARS) throw new Error('an event of the stream does not end');
      this.data.push(value);
    } else if (field === 'id' && !value.includes('\0')) this.lastId = value;
    return undefined;
  }
}

/**
 * Waiting time before the next attempt to connect, milliseconds: doubles up to a bound, and is
 * spread so that several pages do not come at once.
 * @param {number} attempt from 0 @param {number} chance 0 to 1
 */
export function backoffMs(attempt, chance) {
  const most = Math.min(5000, 500 * 2 ** Math.min(attempt, 10));
  return Math.round(most * (0.5 + 0.5 * chance));
}
