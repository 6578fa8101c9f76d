// The controls: what they offer comes from the registry, what they show from the state.

import { $, choices, make } from './dom.js';
import { degrees, number, percent } from './format.js';
import { BUDGETS, DEFAULTS, PERTURBATIONS, formula, parameter, waysOf } from './state.js';

const KINDS = { exact: 'Exact', approximation: 'Approximations of Phong', alternative: 'Other shapes' };
const FORMS = {
  dot: ['dot', '1 − a·b'], difference: ['difference', 'half the squared length of a − b'],
  cross: ['cross', 'half the squared length of a × b'], tan2: ['tan²', 'half the squared tangent'],
};
const POLICIES = {
  taylor: 'same value and slope at the peak', minimax: 'least largest error', energy: 'the same light in total',
};
const SPACES = { reflect: ['R, V', 'reflection and viewer'], half: ['N, H', 'normal and half vector'] };
const WRONG = { a: ['one vector', 'only the first of the pair'], both: ['both', 'both alike'], opposite: ['opposite', 'one too long, the other too short'] };
const REMOVED = {
  none: ['as they are', 'lengths are left in'], each: ['each', 'both divided by their lengths, two roots'],
  once: ['once', 'the pair together, one root at most'], squared: ['squared', 'the square of the cosine, no root'],
};
const KIND_OF_COST = { measured: 'Measured: time', compiled: 'Compiled: counted in machine code' };
const STEPS_A_DECADE = 100;
/** The length slider's ends and first step, as powers of ten; its middle is no error. */
const LENGTH = { first: -4, last: -1, steps: 60 };

/** Whole from 3 on: a slider's value should be one that integer powers take. */
const alphaOf = (position) => {
  const value = 10 ** (position / STEPS_A_DECADE);
  return value < 3 ? Math.round(2 * value) / 2 : value < 1000 ? Math.round(value) : Number(value.toPrecision(3));
};
const lengthOf = (position) => {
  if (!position) return 0;
  const share = (Math.abs(position) - 1) / (LENGTH.steps - 1);
  return Math.sign(position) * Number((10 ** (LENGTH.first + share * (LENGTH.last - LENGTH.first))).toPrecision(2));
};
const positionOf = (length) => {
  if (!length) return 0;
  const share = (Math.log10(Math.abs(length)) - LENGTH.first) / (LENGTH.last - LENGTH.first);
  return Math.sign(length) * Math.min(Math.max(1 + Math.round(share * (LENGTH.steps - 1)), 1), LENGTH.steps);
};
const amplifyOf = (position) => Number((10 ** (position / 10)).toPrecision(2));

/** One entry for each approximation, by kind, in the order of the registry. */
function offerApproximations(registry) {
  const groups = Object.entries(KINDS).map(([kind, label]) => make('optgroup', { label },
    ...registry.filter((spec) => spec.kind === kind).map((spec) => make('option', { value: spec.name }, spec.title))));
  $('approximation').replaceChildren(...groups.filter((group) => group.children.length));
}

/** One entry for each target that has costs, those that are timed first. @param {any[]} targets */
export function offerTargets(targets) {
  $('target').replaceChildren(...Object.entries(KIND_OF_COST).map(([kind, label]) => make('optgroup', { label },
    ...targets.filter((one) => one.cost_kind === kind).map((one) => make('option', { value: one.name }, `${one.name}, ${one.title}`)))).filter((group) => group.children.length));
}

/**
 * Wires the controls once.
 * @param {{registry: any[], materials: any[], reflectances: Object<string, number[][]>, precisions: string[], targets: any[]}} offered
 * @param {(patch: Partial<import('./state.js').State>) => void} set
 */
export function wire(offered, set) {
  offerApproximations(offered.registry);
  offerTargets(offered.targets);
  $('material').append(...offered.materials.map((m) => make('option', { value: m.name }, `${m.name.replaceAll('-', ' ')}, α ${number(m.shininess)}`)));
  $('fresnel').append(...Object.keys(offered.reflectances).map((name) => make('option', { value: name }, name)));
  $('budget').append(...BUDGETS.map((budget) => make('option', { value: budget }, budgetName(budget))));
  const on = (id, event, change) => $(id).addEventListener(event, ({ target }) => change(target));
  on('approximation', 'change', ({ value }) => set({ approximation: value }));
  on('alpha-slider', 'input', ({ value }) => set({ alpha: alphaOf(Number(value)) }));
  on('alpha', 'input', (field) => { if (field.value !== '' && field.checkValidity()) set({ alpha: field.valueAsNumber }); });
  on('alpha', 'change', (field) => { if (!field.checkValidity()) field.reportValidity(); });
  on('gamma', 'input', ({ value }) => set({ gamma: 2 ** value }));
  on('length', 'input', ({ value }) => set({ length_error: lengthOf(Number(value)) }));
  on('amplify', 'input', ({ value }) => set({ amplify: amplifyOf(Number(value)) }));
  on('closeup', 'change', ({ checked }) => set({ closeup: checked }));
  on('budget', 'change', ({ value }) => set({ budget: value }));
  on('run', 'change', ({ value }) => set({ run: value }));
  on('target', 'change', ({ value }) => set({ target: value }));
  on('material', 'change', ({ value }) => {
    const material = offered.materials.find((m) => m.name === value);
    set({ material: value, ...(material ? { alpha: Number(material.shininess.toPrecision(4)) } : {}) });
  });
  on('fresnel', 'change', ({ value }) => set({ fresnel: value }));
  on('theme', 'click', () => set((state) => ({ theme: { '': 'light', light: 'dark', dark: '' }[state.theme] })));
  on('reset', 'click', () => set((state) => ({ ...DEFAULTS, theme: state.theme })));
  $('controls').addEventListener('submit', (event) => event.preventDefault());
}

/** @param {string} budget */
function budgetName(budget) {
  const bits = { '1/255': ', one 8-bit code', '1/1023': ', one 10-bit code', '1/4095': ', one 12-bit code' };
  return budget + (bits[budget] ?? '');
}

/**
 * Shows the state; controls that the approximation does not take are hidden.
 * @param {import('./state.js').State} state @param {any} spec
 * @param {{precisions: string[]}} offered @param {(patch: Partial<import('./state.js').State>) => void} set
 */
export function show(state, spec, offered, set) {
  const asked = formula(state, spec);
  $('approximation').value = spec.name;
  $('formula').textContent = spec.formula;
  $('domain').textContent = spec.domain ? `Use: ${spec.domain}.` : '';
  $('source').textContent = typeof spec.source === 'string' ? spec.source : spec.source?.citation ?? '';
  showAlpha(state, parameter(spec, 'alpha'));
  showGamma(asked.gamma, parameter(spec, 'gamma'));
  const field = (name, values, words, chosen) => {
    const place = document.querySelector(`[data-field="${name}"]`);
    place.hidden = values.length < 2;
    choices($(name), name, values.map((value) => [value, ...[words[value] ?? value].flat()]), chosen, (value) => set({ [name]: value }));
  };
  field('lambda', spec.lambda_forms, FORMS, asked.lambda);
  field('beta', spec.beta_policies, Object.fromEntries(Object.entries(POLICIES).map(([k, v]) => [k, [k, v]])), asked.beta);
  field('space', spec.spaces, SPACES, asked.space);
  field('normalise', waysOf(spec, asked.lambda), REMOVED, asked.normalise);
  field('precision', offered.precisions, {}, state.precision);
  choices($('perturbation'), 'perturbation', PERTURBATIONS.map((p) => [p, ...WRONG[p]]), state.perturbation, (p) => set({ perturbation: p }));
  range($('length'), positionOf(state.length_error), percent(state.length_error));
  $('length-out').value = percent(state.length_error);
  for (const input of $('perturbation').querySelectorAll('input')) input.disabled = state.length_error === 0;
  showView(state, set);
}

function showAlpha(state, bounds) {
  range($('alpha-slider'), Math.round(STEPS_A_DECADE * Math.log10(state.alpha)), number(state.alpha));
  Object.assign($('alpha'), { min: bounds.low, max: bounds.high });
  if (document.activeElement !== $('alpha')) $('alpha').value = state.alpha;
  $('material').value = state.material;
  $('fresnel').value = state.fresnel;
}

function showGamma(gamma, bounds) {
  document.querySelector('[data-field="gamma"]').hidden = !bounds;
  if (!bounds) return;
  Object.assign($('gamma'), { min: Math.log2(bounds.low), max: Math.log2(bounds.high) });
  range($('gamma'), Math.log2(gamma), `${gamma}, ${Math.log2(gamma)} squarings`);
  $('gamma-out').value = `${gamma} = 2${'⁰¹²³⁴⁵⁶⁷⁸'[Math.log2(gamma)]}`;
}

function showView(state, set) {
  range($('amplify'), Math.round(10 * Math.log10(state.amplify)), `${state.amplify} times`);
  $('times').textContent = `×${state.amplify}`;
  $('closeup').checked = state.closeup;
  $('budget').value = state.budget;
  $('target').value = state.target;
  choices($('scale'), 'scale', [['linear', 'linear'], ['log', 'log']], state.scale, (scale) => set({ scale }));
  choices($('range'), 'range', [['lobe', 'lobe'], ['all', `0 to ${degrees(90)}`]], state.range, (value) => set({ range: value }));
  $('theme').textContent = `Theme: ${state.theme || 'auto'}`;
  document.documentElement.dataset.theme = state.theme;
}

function range(slider, position, words) {
  if (Number(slider.value) !== position) slider.value = position;
  slider.setAttribute('aria-valuetext', words);
}
