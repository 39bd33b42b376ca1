// @ts-check
/** Asks again where the service has no time at the moment. Pure: waiting is handed in. */

/** The service makes one range image of kept columns at a time, and says so to whoever asks meanwhile. */
const BUSY = 'busy-regridding';

/** How often it is asked, and how long is waited between, which grows up to a bound. */
const TIMES = 60;
const FIRST_MS = 400;
const LONGEST_MS = 3000;

/**
 * @template T
 * @param {() => Promise<T>} ask
 * @param {() => boolean} [wanted] whether somebody still waits for the answer
 * @param {(ms: number) => Promise<unknown>} [wait]
 * @returns {Promise<T>}
 */
export async function patient(ask, wanted = () => true, wait = (ms) => new Promise((done) => setTimeout(done, ms))) {
  for (let time = 1; ; time += 1) {
    try {
      return await ask();
    } catch (error) {
      if (/** @type {any} */ (error)?.kind !== BUSY || time >= TIMES || !wanted()) throw error;
      await wait(Math.min(LONGEST_MS, FIRST_MS * 1.5 ** (time - 1)));
    }
  }
}
