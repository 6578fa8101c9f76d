// What is shown: one plain object, written to and read from the address's hash.

import { spelling } from './format.js';

/**
 * @typedef {object} State
 * @property {string} approximation
 * @property {string} lambda        a wish: what the approximation does not take is not asked for
 * @property {string} beta          policy of the slope
 * @property {string} space
 * @property {number} gamma
 * @property {number} alpha
 * @property {number} length_error  relative and signed
 * @property {string} perturbation  whose length is wrong
 * @property {string} normalise     how wrong lengths are removed; a wish, as lambda is
 * @property {string} precision
 * @property {string} material      name of a material, or ''
 * @property {string} fresnel       whose reflectance colours the highlight by incidence, or '' for a constant
 * @property {string} scale         of the error plot: linear or log
 * @property {string} range         angles shown: lobe or all
 * @property {number} amplify       of the difference, 1 to 1000
 * @property {boolean} closeup
 * @property {[number, number]} light  where the highlight stands on the unit disc, right and up
 * @property {string} budget        largest error allowed
 * @property {string} target        whose costs count: cpu, or a name of /v1/targets
 * @property {string} run           id of the run that answers, or '' for the newest
 * @property {string} theme         light, dark, or '' for the system's
 */

/** @type {Readonly<State>} */
export const DEFAULTS = Object.freeze({
  approximation: 'lyon', lambda: 'cross', beta: 'taylor', space: 'reflect', gamma: 8, alpha: 50,
  length_error: 0, perturbation: 'a', normalise: 'none', precision: 'float32', material: '', fresnel: '', scale: 'linear', range: 'lobe', amplify: 20,
  closeup: false, light: [-0.3, 0.32], budget: '1/255', target: 'cpu', run: '', theme: '',
});

export const PERTURBATIONS = ['a', 'both', 'opposite'];
/** Ways of removing lengths that are offered: those of every precision. */
export const NORMALISE = ['none', 'each', 'once', 'squared'];
export const BUDGETS = ['0.05', '4/255', '2/255', '1/255', '1/1023', '1/4095'];
/** Lengths are at most this wrong; the service's own bound. */
export const LONGEST = 0.5;
/** How far from the middle of its disc the highlight may stand. */
export const RIM = 0.96;

const inside = (low, high) => (text) => {
  const value = Number(text);
  return text.trim() !== '' && value >= low && value <= high ? value : undefined;
};
const oneOf = (...names) => (text) => (names.includes(text) ? text : undefined);
const name = (text) => (/^[a-z0-9-]{0,64}$/.test(text) ? text : undefined);

/** How each field is read from text; undefined: not one of its values, so it is ignored. */
const READ = {
  approximation: name, lambda: name, beta: name, space: name, material: name, fresnel: name, precision: name, target: name, run: name,
  gamma: (text) => { const value = inside(1, 256)(text); return Number.isInteger(Math.log2(value ?? 0)) ? value : undefined; },
  alpha: inside(1e-3, 1e5),
  length_error: inside(-LONGEST, LONGEST),
  perturbation: oneOf(...PERTURBATIONS),
  normalise: oneOf(...NORMALISE),
  scale: oneOf('linear', 'log'),
  range: oneOf('lobe', 'all'),
  amplify: inside(1, 1000),
  closeup: (text) => ({ 0: false, 1: true })[text],
  light: (text) => {
    const [x, y, ...more] = text.split(',').map((part) => inside(-1, 1)(part));
    return more.length || x === undefined || y === undefined || Math.hypot(x, y) > RIM ? undefined : [x, y];
  },
  budget: oneOf(...BUDGETS),
  theme: oneOf('light', 'dark', ''),
};

/** The state that a hash tells; what it does not tell, or tells wrongly, has its default. @param {string} hash @returns {State} */
export function fromHash(hash) {
  const state = { ...DEFAULTS };
  for (const [key, text] of new URLSearchParams(hash.replace(/^#/, ''))) {
    const value = Object.hasOwn(READ, key) ? READ[key](text) : undefined;
    if (value !== undefined) state[key] = value;
  }
  return state;
}

/** The hash of a state: every field that is not at its default. @param {State} state */
export function toHash(state) {
  const written = (value) => (value === true ? '1' : value === false ? '0' : Array.isArray(value) ? value.map((v) => Number(v.toFixed(3))).join(',') : String(value));
  const parts = Object.keys(DEFAULTS)
    .filter((key) => written(state[key]) !== written(DEFAULTS[key]))
    .map((key) => `${key}=${encodeURIComponent(written(state[key])).replaceAll('%2C', ',').replaceAll('%2F', '/')}`);
  return parts.length ? `#${parts.join('&')}` : '';
}

/** The parameter of an approximation that has this name. @param {any} spec @param {string} wanted */
export const parameter = (spec, wanted) => spec.parameters.find((p) => p.name === wanted);

/** The ways of removing lengths that an approximation takes in a lambda form. @param {any} spec @param {string} lambda */
export const waysOf = (spec, lambda) => NORMALISE.filter((way) => spec.normalise[lambda].includes(way));

/**
 * What is asked of the service: the state's wishes as far as the approximation takes them.
 * @param {State} state @param {any} spec
 */
export function formula(state, spec) {
  const fitting = (wish, offered) => (offered.includes(wish) ? wish : offered[0]);
  const gamma = parameter(spec, 'gamma'), lambda = fitting(state.lambda, spec.lambda_forms);
  return {
    approximation: spec.name,
    lambda,
    normalise: fitting(state.normalise, waysOf(spec, lambda)),
    gamma: gamma ? Math.min(Math.max(state.gamma, gamma.low), gamma.high) : null,
    alpha: state.alpha,
    beta: fitting(state.beta, spec.beta_policies),
    space: fitting(state.space, spec.spaces),
  };
}

/**
 * The formula as a query: its spelling where it removes lengths, else its parts without what goes without saying.
 * @param {ReturnType<typeof formula>} asked @param {any} spec
 */
export function query(asked, spec) {
  if (asked.normalise !== 'none') return { formula: spelling(asked, spec), alpha: asked.alpha };
  const told = { approximation: asked.approximation };
  if (asked.lambda !== 'none') told.lambda = asked.lambda;
  if (asked.gamma !== null) told.gamma = asked.gamma;
  told.alpha = asked.alpha;
  if (asked.beta !== 'none') told.beta = asked.beta;
  if (asked.space !== 'reflect') told.space = asked.space;
  return told;
}
