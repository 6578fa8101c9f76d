// The service's answers, and its refusals in words.

/** A refusal: the problem document that the service sent, or why there was no answer. */
export class Problem extends Error {
  /** @param {number} status 0: no answer @param {string} title @param {string} detail */
  constructor(status, title, detail) {
    super(detail || title);
    this.status = status;
    this.title = title;
    this.detail = detail;
  }
}

/** The address of a question, its empty parameters left out. @param {string} path @param {Record<string, any>} [params] */
export function address(path, params = {}) {
  const given = Object.entries(params).filter(([, value]) => value !== null && value !== undefined && value !== '');
  const text = new URLSearchParams(given).toString().replaceAll('%2F', '/').replaceAll('%2C', ',');
  return text ? `${path}?${text}` : path;
}

/**
 * What the service answers; Problem if it refuses or does not answer.
 * @param {string} path @param {Record<string, any>} [params] @param {AbortSignal} [signal]
 */
export async function get(path, params, signal) {
  let answer;
  try {
    answer = await fetch(address(path, params), { signal, headers: { accept: 'application/json' } });
  } catch (reason) {
    if (reason.name === 'AbortError') throw reason;
    throw new Problem(0, 'The service does not answer', 'is phongbench serve still running?');
  }
  const body = await answer.json().catch((reason) => { if (reason.name === 'AbortError') throw reason; return null; });
  if (!answer.ok) throw new Problem(answer.status, body?.title ?? answer.statusText, detailed(body));
  return body;
}

function detailed(body) {
  if (!body) return 'The service gave no reason.';
  const parts = [body.detail, ...(body.errors ?? []).map((e) => e.detail ?? e.message), body.mend ?? body.hint];
  return [...new Set(parts.filter((part) => typeof part === 'string' && part))].join(' – ');
}

/** Non-finite numbers travel as text. @param {(number|string|null)[]} values @returns {Float64Array} */
export const numbers = (values) => Float64Array.from(values, (value) => (value === null ? NaN : Number(value)));

/**
 * Asks at most every few milliseconds and keeps the newest answer only: an older question is abandoned.
 * @param {(signal: AbortSignal, ...wishes: any[]) => Promise<void>} task @param {(busy: boolean) => void} told
 */
export function newest(task, told, delay = 25) {
  let timer;
  let running;
  return (...wishes) => {
    clearTimeout(timer);
    told(true);
    timer = setTimeout(async () => {
      timer = undefined;
      running?.abort();
      const mine = running = new AbortController();
      try {
        await task(mine.signal, ...wishes);
      } catch (reason) {
        if (reason.name !== 'AbortError') throw reason;
      } finally {
        if (running === mine && timer === undefined) told(false);
      }
    }, delay);
  };
}
