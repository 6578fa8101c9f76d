// The explorer: one state, shown by controls, spheres, plots and sentences; every number comes from the service.

import { get, newest, numbers } from './api.js';
import { recommend, reproduce, verdict } from './answers.js';
import { offerTargets, show as showControls, wire } from './controls.js';
import { Curves, reachOf } from './curves.js';
import { $, tell } from './dom.js';
import { spelling } from './format.js';
import { Front } from './front.js';
import { hold } from './measured.js';
import { Spheres } from './spheres.js';
import { DEFAULTS, formula, fromHash, query, toHash } from './state.js';

const POINTS = 601;

/** @type {import('./state.js').State} */
let state = fromHash(location.hash);
let offered = { registry: [], materials: [], reflectances: {}, precisions: [], targets: [], languages: {}, version: '' };
let past = {};

const specOf = (name) => offered.registry.find((spec) => spec.name === name) ?? offered.registry.find((spec) => spec.name === DEFAULTS.approximation) ?? offered.registry[0];
/** The state with what this service does not know at its default. */
const settled = (wished) => ({
  ...wished,
  approximation: specOf(wished.approximation).name,
  precision: offered.precisions.includes(wished.precision) ? wished.precision : offered.precisions.find((one) => one === DEFAULTS.precision) ?? offered.precisions[0],
  material: offered.materials.some((one) => one.name === wished.material) ? wished.material : '',
  fresnel: Object.hasOwn(offered.reflectances, wished.fresnel) ? wished.fresnel : '',
  target: offered.targets.some((one) => one.name === wished.target) ? wished.target : DEFAULTS.target,
});
/** The state with a run that is there; an address may name one that is gone, and at first none is known. */
const known = () => ({ ...state, run: front.runs.some((run) => run.id === state.run) ? state.run : '' });
const asked = () => formula(state, specOf(state.approximation));

/** Everything that waits for an answer; the page is busy while there is any. */
const waiting = new Set();
const busy = (what) => (is) => {
  if (is) waiting.add(what);
  else waiting.delete(what);
  $('main').setAttribute('aria-busy', String(waiting.size > 0));
};

const curves = new Curves(() => state, (angle) => { spheres.ring = angle; spheres.draw(); });
const spheres = new Spheres(set, () => state, (angle) => curves.point(angle));
const front = new Front(adopt);

/** Writes the state into the address: a little later, since browsers stop listening to a page that does so all the time. */
const writeAddress = newest(async () => {
  const hash = toHash(state);
  if (hash !== location.hash) history.replaceState(null, '', hash || location.pathname);
}, busy('address'), 120);

/** Changes the state and shows it. @param {any} patch fields, or a function of the state that gives them */
function set(patch) {
  state = { ...state, ...(typeof patch === 'function' ? patch(state) : patch) };
  writeAddress();
  show();
}

/** Takes a formula of the front or of the recommendation. @param {any} cell */
function adopt(cell) {
  set({
    approximation: cell.approximation, lambda: cell.lambda_form ?? cell.lambda, space: cell.space ?? 'reflect',
    ...(cell.gamma ? { gamma: cell.gamma } : {}), beta: cell.beta_policy ?? DEFAULTS.beta, normalise: cell.normalise ?? DEFAULTS.normalise,
  });
}

/** The question about the curve. */
function question() {
  const wrong = state.length_error ? { length_error: state.length_error, perturbation: state.perturbation } : {};
  return { ...query(asked(), specOf(state.approximation)), precision: state.precision, ...wrong };
}

const askCurve = newest(async (signal) => {
  try {
    const answer = await get('/v1/curve', { ...question(), points: POINTS, spacing: 'square' }, signal);
    const curve = {
      angle: numbers(answer.angle_degrees), value: numbers(answer.value), exact: numbers(answer.exact), error: numbers(answer.error),
      largest: Number(answer.max_abs_error), worst: answer.worst_index, beta: answer.beta, cutoff: answer.cutoff_degrees,
    };
    curve.reach = reachOf(curve);
    tell($('problem'), null);
    $('stage').classList.remove('stale');
    $('curves').classList.remove('stale');
    $('verdict').replaceChildren(...verdict(curve));
    spheres.show(curve);
    curves.show(curve, answer.name);
  } catch (problem) {
    if (problem.name === 'AbortError') throw problem;
    tell($('problem'), problem, () => { past = {}; show(); });
    $('stage').classList.add('stale');
    $('curves').classList.add('stale');
    $('verdict').textContent = `Nothing to show for these settings${spheres.curve ? '; what is dimmed was shown before' : ''}.`;
  }
}, busy('curve'));
const askFront = newest((signal) => front.ask(state, asked(), signal), busy('front'), 60);
const askRecommend = newest((signal) => recommend(known(), adopt, signal), busy('recommend'), 120);

/** What a panel sees of the page. */
const page = {
  get state() { return state; }, get offered() { return offered; }, get spec() { return specOf(state.approximation); },
  asked, question, set, adopt, front, busy,
};
/**
 * Panels that are closed at first. Opening one loads its module, whose `open(place, page)` fills the place and returns
 * what shows another state there; that is called at once, and at every change while the panel is open.
 */
const panels = [...document.querySelectorAll('[data-panel]')];
for (const panel of panels) {
  panel.addEventListener('toggle', async () => {
    if (!panel.open) return;
    const told = busy(panel);
    told(true);
    panel.update ??= (await import(`./${panel.dataset.panel}.js`)).open(panel.lastElementChild, page);
    panel.update();
    told(false);
  });
}

/** Does something if a value has changed since it was last done. */
function onChange(what, value, act) {
  const key = JSON.stringify(value);
  if (past[what] === key) return;
  past[what] = key;
  act();
}

/** Shows the state: what is known at once, what must be asked when the answer is there. */
function show() {
  const now = asked();
  const name = spelling(now, specOf(state.approximation));
  showControls(state, specOf(state.approximation), offered, set);
  $('sphere-name').textContent = name;
  spheres.material = offered.materials.find((m) => m.name === state.material) ?? null;
  spheres.reflectance = offered.reflectances[state.fresnel] ?? null;
  spheres.draw();
  reproduce(known(), now, question());
  onChange('look', [state.theme, state.scale, state.range], () => { curves.draw(); if (past.theme !== state.theme) front.draw(); past.theme = state.theme; });
  onChange('run', state.run, () => front.use(state.run));
  onChange('mark', [now, state.budget], () => front.mark(now, state.budget));
  onChange('curve', question(), () => askCurve());
  onChange('front', [state.alpha, state.precision, now.space, state.target, front.run?.id], () => askFront());
  for (const panel of panels) if (panel.open) panel.update?.();
  onChange('recommend', [state.alpha, state.precision, state.length_error, state.budget, state.target, front.run?.id], () => askRecommend());
}

/** Looks for a run; all else works without. */
async function lookForRun() {
  busy('runs')(true);
  try {
    await front.find(state.run);
    tell($('front-problem'), null);
  } catch (problem) {
    tell($('front-problem'), problem, lookForRun);
  }
  show();
  busy('runs')(false);
}

/** Measures the formulas of the front, or without a run one of each approximation, on the GPU of this browser. */
async function measure() {
  const button = $('measure');
  button.disabled = true;
  try {
    const { measureHere } = await import('./measure/panel.js');
    const one = (spec) => spelling(formula(state, spec), spec);
    const formulas = [...new Set([one(specOf(state.approximation)), ...front.names(), ...offered.registry.map(one)])];
    await measureHere({ formulas, alpha: front.alpha ?? state.alpha, version: offered.version, adopt: adoptTarget });
  } finally {
    button.disabled = false;
  }
}

/** Shows costs on a device that was measured in this page. @param {any} measurement */
function adoptTarget(measurement) {
  hold(measurement);
  const { target, adapter } = measurement;
  offered.targets = [...offered.targets.filter((one) => one.name !== target), { name: target, title: adapter, cost_kind: 'measured', available: true }];
  offerTargets(offered.targets);
  past = {};
  set({ target, precision: 'float32' });
}

async function start() {
  document.documentElement.dataset.theme = state.theme;
  busy('start')(true);
  try {
    const [meta, approximations, { targets }] = await Promise.all([get('/v1/meta'), get('/v1/approximations'), get('/v1/targets')]);
    offered = { registry: approximations.approximations ?? approximations, materials: meta.materials ?? [], reflectances: meta.reflectances ?? {}, precisions: meta.precisions, targets: targets.filter((one) => one.available), languages: meta.languages, version: meta.versions?.phongbench ?? meta.version ?? '' };
    $('versions').textContent = `phongbench ${offered.version}`;
  } catch (problem) {
    tell($('problem'), problem, start);
    $('verdict').textContent = '';
    busy('start')(false);
    return;
  }
  tell($('problem'), null);
  state = settled(state);
  wire(offered, set);
  addEventListener('hashchange', () => { state = settled(fromHash(location.hash)); show(); });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { curves.draw(); front.draw(); });
  $('front-again').addEventListener('click', lookForRun);
  $('measure').addEventListener('click', measure);
  show();
  busy('start')(false);
  await lookForRun();
}

start();
