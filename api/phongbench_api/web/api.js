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

/** How often a busy service is asked again. */
const TRIES = 5;

/** Resolves after some seconds; rejects as a fetch does once it is abandoned. @param {number} seconds @param {AbortSignal} [signal] */
const rest = (seconds, signal) => new Promise((done, failed) => {
  signal?.throwIfAborted();
  setTimeout(done, 1000 * seconds);
  signal?.addEventListener('abort', () => failed(signal.reason), { once: true });
});

/** One answer; a service that is busy and says until when (503, Retry-After) is asked again then. */
async function asked(url, request, tries = TRIES) {
  const answer = await fetch(url, request);
  const seconds = Number(answer.headers.get('retry-after'));
  if (answer.status !== 503 || !seconds || tries === 1) return answer;
  await rest(seconds, request.signal);
  return asked(url, request, tries - 1);
}

/**
 * What the service answers; Problem if it refuses, does not answer or stays busy.
 * @param {string} path @param {Record<string, any>} [params] @param {AbortSignal} [signal] @param {any} [body] a document to send along
 */
export async function get(path, params, signal, body) {
  const sent = body ? { method: 'POST', body: JSON.stringify(body) } : {};
  let answer;
  try {
    answer = await asked(address(path, params), { signal, headers: { accept: 'application/json', ...(body ? { 'content-type': 'application/json' } : {}) }, ...sent });
  } catch (reason) {
    if (reason.name === 'AbortError') throw reason;
    throw new Problem(0, 'The service does not answer', 'is phongbench serve still running?');
  }
  const told = await answer.json().catch((reason) => { if (reason.name === 'AbortError') throw reason; return null; });
  if (!answer.ok) throw new Problem(answer.status, told?.title ?? answer.statusText, detailed(told));
  return told;
}

function detailed(body) {
  if (!body) return 'The service gave no reason.';
  const errors = (body.errors ?? []).map(({ field, detail }) => (!field || detail.includes(field.match(/^\w*/)[0]) ? detail : `${field}: ${detail}`));
  const parts = [...(errors.some((one) => one.endsWith(body.detail)) ? [] : [body.detail]), ...errors, body.mend ?? body.hint];
  return [...new Set(parts.filter((part) => typeof part === 'string' && part))].join(' – ');
}

/** Non-finite numbers travel as text. @param {(number|string|null)[]} values @returns {Float64Array} */
export const numbers = (values) => Float64Array.from(values, (value) => (value === null ? NaN : Number(value)));

/** How long a question may take once a newer one waits, in milliseconds. */
const PATIENCE = 200;

/**
 * One question at a time, the newest next: a slider on the move shows what it passes, as fast as answers come. A question
 * that takes long while a newer one waits is abandoned. Waiting for the slider to rest instead would show nothing of the
 * way, and abandoning at once nothing either, where answers take longer than the slider's steps.
 * @param {(signal: AbortSignal) => Promise<void>} task @param {(busy: boolean) => void} told @param {number} delay
 */
export function newest(task, told, delay = 20) {
  let running = null;
  let waiting = false;
  let timer = null;
  const run = async () => {
    timer = null;
    waiting = false;
    running = { controller: new AbortController(), since: performance.now() };
    try {
      await task(running.controller.signal);
    } catch (reason) {
      if (reason.name !== 'AbortError') throw reason;
    } finally {
      running = null;
      if (waiting) run();
      else told(false);
    }
  };
  return () => {
    told(true);
    if (!running) {
      timer ??= setTimeout(run, delay);
    } else if (!waiting) {
      waiting = true;
      const old = running;
      setTimeout(() => { if (running === old) old.controller.abort(); }, PATIENCE - (performance.now() - old.since));
    }
  };
}
