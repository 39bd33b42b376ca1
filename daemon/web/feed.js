// @ts-check
/** Listens to the service's events, and comes back by itself when the line is lost. */

import { ApiError, request } from './api.js';
import { SseParser, backoffMs } from './sse.js';

/** The service sends something at least every 15 s; after this silence the line counts as lost. */
const SILENCE_MS = 40000;

/**
 * @typedef {{
 *   event: (event: any, again: boolean) => void,
 *   up: () => void, down: (why: string) => void, sign: () => void,
 * }} Listener
 */

export class Feed {
  /** @param {Listener} listener */
  constructor(listener) {
    this.listener = listener;
    this.attempt = 0;
    this.lastId = '';
    this.times = 0;
    /** Counts starts, so that a loop that was stopped does not go on beside the next. */
    this.generation = 0;
    this.running = false;
    /** @type {AbortController | null} */
    this.abort = null;
    /** @type {(() => void) | null} */
    this.wake = null;
    // Whoever comes back to the page or to the network need not wait.
    addEventListener('online', () => this.hurry());
    document.addEventListener('visibilitychange', () => {
      if (!document.hidden) this.hurry();
    });
  }

  hurry() {
    this.attempt = 0;
    this.wake?.();
  }

  stop() {
    this.running = false;
    this.abort?.abort();
    this.wake?.();
  }

  async start() {
    if (this.running) return;
    this.running = true;
    this.generation += 1;
    const mine = this.generation;
    const goesOn = () => this.running && this.generation === mine;
    while (goesOn()) {
      let why = '';
      try {
        await this.listen();
        why = 'end';
      } catch (error) {
        if (error instanceof ApiError && error.status === 401 && goesOn()) this.running = false;
        why = error instanceof Error ? error.message : String(error);
      }
      if (this.generation === mine) this.listener.down(why);
      if (!goesOn()) break;
      await new Promise((done) => {
        this.wake = () => done(undefined);
        setTimeout(done, backoffMs(this.attempt, Math.random()));
      });
      this.wake = null;
      this.attempt += 1;
    }
  }

  async listen() {
    const abort = new AbortController();
    this.abort = abort;
    /** @type {number | undefined} */
    let timer;
    const sign = () => {
      clearTimeout(timer);
      timer = setTimeout(() => abort.abort(), SILENCE_MS);
      this.listener.sign();
    };
    timer = setTimeout(() => abort.abort(), SILENCE_MS);
    try {
      /** @type {Record<string, string>} */
      const headers = { Accept: 'text/event-stream' };
      if (this.lastId) headers['Last-Event-ID'] = this.lastId;
      const response = await request('/v1/events', { signal: abort.signal, headers });
      if (!response.body) throw new Error('no stream');
      const parser = new SseParser();
      parser.lastId = this.lastId;
      const reader = response.body.getReader();
      const decoder = new TextDecoder();
      this.times += 1;
      let first = true;
      for (;;) {
        const { done, value } = await reader.read();
        if (done) return;
        sign();
        for (const message of parser.push(decoder.decode(value, { stream: true }))) {
          if (first) {
            this.attempt = 0;
            this.listener.up();
          }
          this.lastId = parser.lastId;
          const event = parsed(message.data);
          if (event) this.listener.event(event, first && this.times > 1);
          first = false;
        }
      }
    } finally {
      clearTimeout(timer);
      abort.abort();
    }
  }
}

/** @param {string} data */
function parsed(data) {
  try {
    return JSON.parse(data);
  } catch {
    // A line that is no event of ours is passed over, as kinds that are not known.
    return null;
  }
}
