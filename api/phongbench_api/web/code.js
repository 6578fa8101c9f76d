// The formula as source text, in the language of a tab; the comment at its top tells errors, and costs where a compiler counts them.

import { copier } from './answers.js';
import { get, newest } from './api.js';
import { choices, make, tell } from './dom.js';
import { plain } from './format.js';

const TITLES = {
  glsl: ['GLSL'], hlsl: ['HLSL'], wgsl: ['WGSL'], metal: ['Metal'], c: ['C'], essl100: ['ESSL 1.00', 'of WebGL 1'], essl300: ['ESSL 3.00', 'of WebGL 2'],
  cuda: ['CUDA'], numpy: ['NumPy'],
};

/** What stands for a precision of the page in a language: ESSL's mediump is float16 at least. Others are written in float32. */
const STANDS = { float16: ['float16', 'mediump'] };

/** What the service is asked for. @param {any} page @param {string} language */
function question({ state, offered, question: asked }, language) {
  const { precision, length_error: wrong, perturbation, ...formula } = asked();
  const target = offered.targets.find((one) => one.name === state.target);
  return {
    ...formula, language,
    precision: STANDS[precision]?.find((one) => offered.languages[language].includes(one)) ?? null,
    length_error: wrong ? plain(Math.abs(wrong)) : null,
    target: target?.cost_kind === 'compiled' ? target.name : null,
  };
}

/** Fills the panel. @param {HTMLElement} place @param {any} page @returns {() => void} */
export function open(place, page) {
  let language = 'glsl';
  let shown = '';
  const tabs = make('div', { class: 'choices', role: 'radiogroup', 'aria-label': 'Language' });
  const text = make('code');
  const source = make('pre', { class: 'source', tabindex: '0', role: 'region', 'aria-label': 'Source text' }, text);
  const problem = make('div', { class: 'problem', role: 'status', hidden: true });
  const copy = copier('the source text', text);
  const own = make('code');
  place.replaceChildren(make('div', { class: 'heading' }, tabs, copy), problem, source,
    make('p', { class: 'muted' }, 'A formula of your own is not sent to any server. Where its file is, this writes its code:'), make('pre', { tabindex: '0' }, own));
  const ask = newest(async (signal) => {
    try {
      text.textContent = (await get('/v1/shader', question(page, language), signal)).text;
      tell(problem, null);
    } catch (refusal) {
      if (refusal.name === 'AbortError') throw refusal;
      tell(problem, refusal, update);
      shown = '';
    }
    source.hidden = copy.hidden = !problem.hidden;
  }, page.busy('code'));
  function update() {
    choices(tabs, 'language', Object.keys(page.offered.languages).map((name) => [name, ...(TITLES[name] ?? [name])]), language, (name) => { language = name; update(); });
    own.textContent = `phongbench shader NAME --with FILE.py --alpha ${plain(page.state.alpha)} --language ${language}`;
    const key = JSON.stringify(question(page, language));
    if (key === shown) return;
    shown = key;
    ask();
  }
  return update;
}
