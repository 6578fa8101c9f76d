// "Measure on this device": what is measured, how far it is, what came out, and the file of it.

import { $, make, table, tell } from '../dom.js';
import { number } from '../format.js';

const SCHEMA = 1;
/** Digits of a time. */
const DIGITS = 6;
/** Seconds without a word from the device after which it is given up. */
const SILENCE = 30;

/** The browser and its version. */
function browser() {
  const brand = navigator.userAgentData?.brands?.find((one) => !/not.?a.?brand/i.test(one.brand.replace(/[^a-z]/gi, '')));
  if (brand) return `${brand.brand} ${brand.version}`;
  const [, name, version] = navigator.userAgent.match(/(Firefox|Edg|Chrome|Version)\/([\d.]+)/) ?? [null, 'unknown browser', ''];
  return `${name === 'Version' ? 'Safari' : name} ${version}`.trim();
}

/** An adapter's own name, of what browsers say around it. @param {string} adapter */
const bare = (adapter) => adapter.replace(/^ANGLE \([^,]*, (.*), [^,]*\)$/, '$1').replace(/^Vulkan [\d.]+ \((.*)\)$/, '$1').replace(/ANGLE Metal Renderer: | ?\(0x[\da-f]+\)| (Direct3D|OpenGL).*$/gi, '');

/** A target's name for an adapter: page-adreno-740. @param {string} adapter */
export function targetName(adapter) {
  const words = bare(adapter).toLowerCase().replace(/[^a-z0-9]+/g, '-').slice(0, 48).replace(/^-+|-+$/g, '');
  return `page-${words || 'unnamed'}`;
}

/** A line of text of at most 200 characters, none of them for control. */
const line = (text) => [...text].map((one) => (/[\p{C}\p{Zl}\p{Zp}]/u.test(one) ? ' ' : one)).join('').slice(0, 160).trim();

/** The measurement as `phongbench targets add` reads it. @param {any} result of the worker @param {string} version of phongbench */
export function measurement(result, version) {
  const rounded = ({ cost, low, high }) => Object.fromEntries(Object.entries({ low, cost, high }).map(([key, value]) => [key, Number(value.toPrecision(DIGITS))]));
  const adapter = line(result.adapter) || 'an unnamed adapter';
  return {
    schema: SCHEMA, target: targetName(adapter), cost_kind: 'measured', unit: 'ns', precision: 'float32',
    adapter: result.software ? `${adapter} (a program on the processor, no GPU)` : adapter,
    tool: result.tool, tool_version: browser(), phongbench: version, dot: rounded(result.dot),
    rows: result.rows.map((row) => ({ formula: row.formula, alpha: result.alpha, ...rounded(row) })),
  };
}

/** Why there is nothing to measure with, and what helps. @param {string[]} failed */
function unmeasurable(failed) {
  const offered = failed.length ? `This device could not be measured. ${failed.join('; ')}.` : 'This browser offers neither WebGPU nor WebGL 2 to this page, so its GPU cannot be measured from here. A current browser on a device with a GPU offers one of them.';
  return `${offered} ${insecure()}`.trim();
}

const insecure = () => (isSecureContext ? '' : 'WebGPU is there on localhost and over https only: TLS in front of phongbench serve brings it to other devices.');

/** The notes below a result. */
function notes(result) {
  const { twin, rounds } = result;
  const apart = `exact Phong beside its own copy took ${number(twin.ratio, 4)} (${number(twin.low / twin.cost * twin.ratio)} to ${number(twin.high / twin.cost * twin.ratio)}) of its time`;
  return [
    result.software ? 'The adapter is a program on the processor, not a GPU: what it says holds for no GPU.' : null,
    twin.verdict === 'unresolved' ? null : 'Two equal programs took different times: the device changed its pace. Measure again with other programs closed.',
    `${rounds} rounds in shuffled order; ${apart}. Intervals are of 99 %, by sign test.`,
    result.why ? `Timed by the wall: of the device's own clock, ${result.why}.` : null,
    ...result.failed.map((one) => `Tried before: ${one}.`), insecure() || null, ...result.left,
  ].filter(Boolean);
}

/** The rows, quickest first. */
const rows = (result) => table(['formula', 'ns', 'time / exact Phong', '99 % interval', ''], [...result.rows].sort((a, b) => a.cost - b.cost).map((row) => {
  const exact = row === result.rows[0];
  const scale = row.ratio / row.cost;
  return [row.formula, number(row.cost), number(row.ratio), exact ? '' : `${number(scale * row.low)} to ${number(scale * row.high)}`, exact ? '' : row.verdict];
}), 'Formulas timed on this device');

/** A button that saves the measurement, and what to do with the file. */
function download(document) {
  const name = `${document.target}.json`;
  const save = () => {
    const link = make('a', { href: URL.createObjectURL(new Blob([`${JSON.stringify(document, null, 1)}\n`], { type: 'application/json' })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  return make('p', {}, make('button', { type: 'button', id: 'measure-save', onclick: save }, 'Download'), ' then ', make('code', {}, `phongbench targets add ${name}`), ' makes it a target of every command.');
}

/** Everything that a worker says until its last word. @param {Worker} worker @param {any} wanted @param {(word: any) => void} heard @param {AbortSignal} signal */
function answer(worker, wanted, heard, signal) {
  return new Promise((done, failed) => {
    let watch;
    const listen = () => { clearTimeout(watch); watch = setTimeout(() => done({ failed: ['the device does not answer'] }), 1000 * SILENCE); };
    worker.addEventListener('message', ({ data }) => {
      listen();
      if (data.stage || data.share !== undefined) return heard(data);
      clearTimeout(watch);
      return done(data);
    });
    worker.addEventListener('error', (event) => { event.preventDefault(); done({ failed: [event.message || 'the browser starts no worker'] }); });
    signal.addEventListener('abort', () => { clearTimeout(watch); failed(signal.reason); });
    listen();
    worker.postMessage(wanted);
  });
}

/**
 * Measures formulas on this device, and shows what came out.
 * @param {{formulas: string[], alpha: number, version: string, adopt: (document: any) => void}} wanted
 */
export async function measureHere({ formulas, alpha, version, adopt }) {
  const place = $('measure-result');
  const { seconds, milliseconds, formulas: most, only } = $('device').dataset;
  const cancel = new AbortController();
  const stage = make('span', { role: 'status' }, 'Starting …');
  const bar = make('progress', { max: 1, 'aria-label': 'Measurement' });
  place.replaceChildren(make('p', { class: 'inline' }, bar, stage, make('button', { type: 'button', id: 'measure-cancel', onclick: () => cancel.abort() }, 'Cancel')));
  const worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
  const heard = ({ stage: words, share }) => { if (words) stage.textContent = words; else bar.value = share; };
  const limits = { seconds: Number(seconds), milliseconds: Number(milliseconds), formulas: Number(most) };
  try {
    const { result, problem, failed } = await answer(worker, { formulas, alpha, only, limits }, heard, cancel.signal);
    if (!result) return refuse(place, problem ?? { title: 'Not measured', message: unmeasurable(failed) });
    const document = measurement(result, version);
    place.replaceChildren(...shown(result, document));
    return adopt(document);
  } catch (reason) {
    if (!cancel.signal.aborted) throw reason;
    return place.replaceChildren(make('p', { class: 'muted' }, 'Cancelled; nothing was kept.'));
  } finally {
    worker.terminate();
  }
}

function shown(result, document) {
  const best = result.rows.slice(1).sort((a, b) => a.cost - b.cost)[0];
  const exact = result.rows[0];
  const sentence = best ? `quickest is ${best.formula}, ${number(best.cost)} ns a highlight, ${number(best.ratio)} of exact Phong's ${number(exact.cost)} ns.` : `exact Phong takes ${number(exact.cost)} ns a highlight.`;
  return [
    make('p', { role: 'status' }, make('b', {}, document.adapter), ` by ${document.tool}: ${sentence}`),
    make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Formulas timed on this device' }, rows(result)),
    download(document),
    make('ul', { class: 'notes muted' }, ...notes(result).map((note) => make('li', {}, note))),
  ];
}

function refuse(place, problem) {
  const words = make('div', { class: 'problem', role: 'alert' });
  tell(words, problem);
  place.replaceChildren(words);
}
