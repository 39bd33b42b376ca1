// @ts-check
/** Speaks to the service: requests with the token, problems as errors. */

const KEY = 'relief.token';

/** A refused request, or one that did not get through (status 0). */
export class ApiError extends Error {
  /** @param {{type?: string, title?: string, status: number, detail?: string, hint?: string}} problem */
  constructor(problem) {
    super(problem.detail || problem.title || `HTTP ${problem.status}`);
    this.status = problem.status;
    this.kind = problem.type ?? '';
    this.hint = problem.hint ?? '';
  }
}

export const token = {
  value: sessionStorage.getItem(KEY) ?? localStorage.getItem(KEY) ?? '',
  /** @param {string} value @param {boolean} remember on this browser, beyond this tab */
  set(value, remember) {
    this.forget();
    this.value = value;
    (remember ? localStorage : sessionStorage).setItem(KEY, value);
  },
  forget() {
    this.value = '';
    sessionStorage.removeItem(KEY);
    localStorage.removeItem(KEY);
  },
};

/** Asked for a token when the service wants one. @type {(error: ApiError) => void} */
let refused = () => {};

/** @param {(error: ApiError) => void} listener */
export const onRefused = (listener) => {
  refused = listener;
};

/**
 * @param {string} path @param {RequestInit} [options]
 * @returns {Promise<Response>} one that is well
 */
export async function request(path, options = {}) {
  const headers = new Headers(options.headers);
  if (token.value) headers.set('Authorization', `Bearer ${token.value}`);
  let response;
  try {
    response = await fetch(path, { ...options, headers, cache: 'no-cache' });
  } catch (error) {
    if (options.signal?.aborted) throw error;
    throw new ApiError({ status: 0, type: 'no-answer', detail: String(/** @type {Error} */ (error).message) });
  }
  if (response.ok) return response;
  let problem = {};
  try {
    problem = await response.json();
  } catch {
    // Whoever answered is no service of ours; its status has to do.
  }
  const error = new ApiError({ ...problem, status: response.status });
  if (response.status === 401) refused(error);
  throw error;
}

/** @param {string} path @param {RequestInit} [options] @returns {Promise<any>} */
export const get = async (path, options) => (await request(path, options)).json();

/** @param {string} path @param {unknown} [body] @param {Record<string, string>} [headers] @returns {Promise<any>} */
export async function post(path, body, headers = {}) {
  const options = body === undefined
    ? { method: 'POST', headers }
    : { method: 'POST', headers: { ...headers, 'Content-Type': 'application/json' }, body: JSON.stringify(body) };
  return (await request(path, options)).json();
}

/** A part of a path. @param {string | number} part */
export const at = (part) => encodeURIComponent(String(part));

/** Path of a file of a result. @param {string} result @param {string} file */
export const spoolPath = (result, file) => `/v1/spool/${at(result)}/${at(file)}`;

/**
 * An address that the browser may open by itself, without the token's header: a ticket where the
 * service gives them.
 * @param {string} path @returns {Promise<string>}
 */
export async function ticket(path) {
  if (!token.value) return path;
  try {
    return (await post('/v1/tickets', { path })).url;
  } catch (error) {
    if (!(error instanceof ApiError) || (error.status !== 404 && error.status !== 405)) throw error;
    return URL.createObjectURL(await (await request(path)).blob());
  }
}

/** A random name for something that is meant once. */
export function uuid() {
  if (crypto.randomUUID) return crypto.randomUUID();
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 15) | 64;
  bytes[8] = (bytes[8] & 63) | 128;
  const hex = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return [[0, 8], [8, 12], [12, 16], [16, 20], [20, 32]].map(([a, b]) => hex.slice(a, b)).join('-');
}
