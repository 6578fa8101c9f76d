// The sentence about visibility, the recommendation, and how to get what is shown without this page.

import { address } from './api.js';
import { $, make, tell } from './dom.js';
import { codes, degrees, number, plain } from './format.js';
import { ask } from './measured.js';

/** Is it visible at 8 bits, and by how much? @param {any} curve */
export function verdict(curve) {
  const { largest, worst, angle, error, beta, cutoff } = curve;
  if (!Number.isFinite(largest)) return [make('b', { class: 'yes' }, 'Not usable here:'), ' some values are not finite.'];
  const seen = 255 * largest >= 1;
  const way = error[worst] > 0 ? 'too bright' : 'too dark';
  const size = largest === 0 ? 'It is exact here.' : `The largest error on this curve is ${codes(largest)} at ${degrees(angle[worst])}, where it is ${way}.`;
  const facts = [beta === null || beta === undefined ? null : `slope β ${number(beta)}`, cutoff === null || cutoff === undefined ? null : `dark beyond ${degrees(cutoff)}`].filter(Boolean);
  return ['Visible at 8 bits: ', make('b', { class: seen ? 'yes' : 'no' }, seen ? 'yes' : 'no'), `. ${size}`,
    ...(facts.length ? [' ', make('span', { class: 'muted' }, `${facts.join(', ')}.`)] : [])];
}

/** What the recommendation is asked. @param {import('./state.js').State} state */
const wish = (state) => ({
  alpha: plain(state.alpha), max_error: state.budget, precision: state.precision,
  length_error: state.length_error ? plain(Math.abs(state.length_error)) : null,
  target: state.target === 'cpu' ? null : state.target, run: state.run,
});

/**
 * The cheapest formula within the budget.
 * @param {import('./state.js').State} state @param {(choice: any) => void} choose @param {AbortSignal} signal
 */
export async function recommend(state, choose, signal) {
  const place = $('choice');
  try {
    const answer = await ask('/v1/recommend', wish(state), signal);
    const [best, next] = answer.choices;
    const parts = best ? [offered(best, choose, 'Cheapest: '), ...(next ? [offered(next, choose, 'Next: ')] : [])] : [make('p', {}, make('b', {}, 'Nothing meets this budget.'))];
    if (!best && answer.nearest_miss) parts.push(offered(answer.nearest_miss, choose, 'Nearest miss: '));
    const notes = [answer.run ? `judged by run ${answer.run}` : null, ...(answer.notes ?? [])].filter(Boolean);
    place.replaceChildren(...parts, make('ul', { class: 'notes muted' }, ...notes.map((note) => make('li', {}, note))));
  } catch (problem) {
    if (problem.name === 'AbortError') throw problem;
    const words = make('div', { class: 'problem' });
    tell(words, problem);
    place.replaceChildren(words);
  }
}

const offered = (choice, choose, lead) => make('div', { class: 'offer' },
  make('p', {}, lead, make('b', {}, choice.name), ' ', make('button', { type: 'button', 'aria-label': `Show ${choice.name}`, onclick: () => choose(choice) }, 'Show it')),
  make('p', { class: 'muted' }, choice.why ?? ''));

/**
 * The request and the commands that give what is shown.
 * @param {import('./state.js').State} state @param {any} asked @param {Record<string, any>} question of /v1/curve
 */
export function reproduce(state, asked, question) {
  const quoted = (path, parameters) => `curl '${location.origin}${address(path, parameters)}'`;
  const run = ['phongbench run', `--only ${asked.approximation}`, `--alpha ${plain(state.alpha)}`];
  if (asked.gamma !== null) run.push(`--gamma ${asked.gamma}`);
  if (asked.lambda !== 'none') run.push(`--lambda ${asked.lambda}`);
  run.push(`--precision ${state.precision}`);
  const wanted = wish(state);
  const pick = ['phongbench recommend', `--alpha ${wanted.alpha}`, `--max-error ${wanted.max_error}`, `--precision ${wanted.precision}`];
  if (wanted.length_error) pick.push(`--length-error ${wanted.length_error}`);
  if (wanted.target) pick.push(`--target ${wanted.target}`);
  if (wanted.run) pick.push(`--run ${wanted.run}`);
  const formula = Object.fromEntries(['approximation', 'lambda', 'gamma', 'alpha', 'beta', 'space'].filter((name) => name in question).map((name) => [name, question[name]]));
  const lines = [
    ['This curve, from the service', quoted('/v1/curve', question)],
    ['The formula as shader code (or hlsl, wgsl, metal, essl300, c, cuda, numpy)', quoted('/v1/shader', { ...formula, language: 'glsl' })],
    ['Its error and time, measured on this machine', run.join(' ')],
    ['The recommendation', pick.join(' ')],
  ];
  const place = $('commands');
  if (!place.children.length) place.append(...lines.flatMap(([title]) => [make('dt', {}, title), make('dd', {}, make('code', {}), copier(title))]));
  place.querySelectorAll('code').forEach((code, i) => code.replaceChildren(...unbroken(lines[i][1])));
}

/** A command whose options stay whole where a line ends; its text is the command's. @param {string} command */
const unbroken = (command) => command.split(/(?= --)/).flatMap((part) => (part.startsWith(' --') ? [' ', make('span', { class: 'whole' }, part.slice(1))] : [part]));

/** A button that copies the text before it, or that of another place. @param {string} title @param {Element} [place] */
export function copier(title, place) {
  return make('button', { type: 'button', 'aria-label': `Copy: ${title}`, onclick: async ({ currentTarget: button }) => {
    const code = place ?? button.previousElementSibling;
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = 'Copied';
    } catch { // not allowed, or not a secure context: the text is marked, for the keyboard to copy
      getSelection().selectAllChildren(code);
      button.textContent = 'Marked';
    }
    button.addEventListener('blur', () => { button.textContent = 'Copy'; }, { once: true });
  } }, 'Copy');
}
