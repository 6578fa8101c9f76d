// The front of the run shown beside that of another: where each formula went, and whether its time changed.

import { get, newest } from './api.js';
import { make, table, tell } from './dom.js';
import { decade, number } from './format.js';
import { nearest, titleOf } from './front.js';
import { ask as askOf } from './measured.js';
import { axis, level, octaves, onlyDecades, palette, plot } from './plot.js';

/** Smaller errors are drawn here, as on the front. */
const FLOOR = 1e-7;
/** What identifies a timed kernel: the slope is left out, which costs nothing. */
const kernel = (one) => ['approximation', 'lambda_form', 'space', 'gamma', 'recipe', 'normalise'].map((name) => one[name] ?? '').join(':');

/** The fronts of both runs, and how times changed. @param {any} page @param {any} other run @param {AbortSignal} signal */
async function answers({ state, front, asked }, other, signal) {
  const target = state.target === 'cpu' ? null : state.target;
  const about = { precision: state.precision, space: asked().space, target };
  const one = ({ id, plan }) => askOf(`/v1/runs/${id}/front`, { ...about, alpha: nearest(plan.alphas, state.alpha) }, signal);
  const [now, then, times] = await Promise.all([one(front.run), one(other), get(`/v1/runs/${front.run.id}/compare`, { against: other.id }, signal)]);
  const changes = new Map(times.rows.filter((row) => row.working_set === now.working_set && row.precision === now.timed_precision && row.threads === 1).map((row) => [kernel(row), row]));
  const before = new Map(then.points.map((point) => [point.name, point]));
  const pairs = now.points.map((after) => ({ after, before: before.get(after.name), change: changes.get(kernel(after)) }));
  return { now, then, times, pairs: pairs.filter((pair) => pair.before && (pair.after.state !== 'off' || pair.before.state !== 'off')) };
}

/** Both fronts in one plot: a line leads from what a formula was to what it is. */
function draw(place, { now, pairs }) {
  const p = palette();
  const x = (point) => Math.max(point.error, FLOOR);
  const all = pairs.flatMap(({ before, after }) => [before, after]);
  const mark = (u, point, ink, filled) => {
    const ratio = globalThis.uPlot.pxRatio;
    u.ctx.beginPath();
    u.ctx.arc(u.valToPos(x(point), 'x', true), u.valToPos(point.ratio, 'y', true), 4 * ratio, 0, 2 * Math.PI);
    Object.assign(u.ctx, { strokeStyle: ink, fillStyle: filled ? ink : p.card, lineWidth: 1.5 * ratio });
    u.ctx.fill();
    u.ctx.stroke();
  };
  const paint = (u) => {
    level(u, 1, p.ink, []);
    u.ctx.save();
    for (const { before, after } of pairs) {
      u.ctx.strokeStyle = p.muted;
      u.ctx.beginPath();
      for (const point of [before, after]) u.ctx.lineTo(u.valToPos(x(point), 'x', true), u.valToPos(point.ratio, 'y', true));
      u.ctx.stroke();
      mark(u, before, p.value, false);
      mark(u, after, p.front, true);
    }
    u.ctx.restore();
  };
  return plot(place, {
    cursor: { show: false }, select: { show: false },
    scales: { x: { time: false, distr: 3, range: () => [FLOOR / 2, 1] }, y: { distr: 3, range: () => [Math.min(...all.map((q) => q.ratio)) / 1.5, Math.max(1, ...all.map((q) => q.ratio)) * 1.3] } },
    axes: [axis(p, { label: 'largest absolute error', ...onlyDecades(p), values: (u, splits) => splits.map(decade), size: 28 }),
      octaves(p, { label: `${now.cost_kind === 'compiled' ? 'cost' : 'time'} / exact Phong` })],
    series: [{}, { paths: () => null, points: { show: false } }], hooks: { draw: [paint] },
  }, [all.map(x).sort((a, b) => a - b), all.map((q) => q.ratio)], 300);
}

const interval = (change) => (change ? `${number(change.ratio)} (${number(change.ratio_low)} to ${number(change.ratio_high)}), ${change.verdict}` : '–');

/** Fills the panel. @param {HTMLElement} place @param {any} page @returns {() => void} */
export function open(place, page) {
  const choice = make('select', { onchange: () => update() });
  const label = make('label', { class: 'inline' }, 'Compare with ', choice);
  const problem = make('div', { class: 'problem', role: 'status', hidden: true });
  const basis = make('p', { class: 'muted' });
  const key = make('p', { class: 'key' }, make('span', {}, make('i', { class: 'disc now' }), 'the run shown'), make('span', {}, make('i', { class: 'ring then' }), 'the other run'));
  const picture = make('div', { role: 'img', 'aria-label': 'Both fronts; the table below holds the same' });
  const rows = make('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Both fronts' });
  const parts = [basis, key, picture, rows];
  place.replaceChildren(label, problem, ...parts);
  let shown = '';
  let drawn = null;
  const other = () => page.front.runs.find((run) => run.id === choice.value);
  const ask = newest(async (signal) => {
    try {
      const both = await answers(page, other(), signal);
      const { now, then, times, pairs } = both;
      const comparable = now.cost_kind === 'compiled' || !times.why_not;
      tell(problem, comparable ? null : { title: 'Times are not compared', detail: `${times.why_not}. Errors can be: they are in the table.` });
      for (const part of parts) part.hidden = false;
      basis.textContent = `α ${now.alpha} against α ${then.alpha}, ${now.precision}; formulas on either front. A change is the ratio after over before, of times over exact Phong's, with ${Math.round(100 * times.level)} % interval.`;
      drawn?.remove();
      drawn = null;
      key.hidden = picture.hidden = !comparable;
      if (comparable && pairs.length) drawn = draw(picture, both);
      const cost = (point) => (comparable ? number(point.ratio) : '–');
      rows.replaceChildren(table(['formula', 'error before', 'after', 'cost before', 'after', 'change'], pairs.map(({ before, after, change }) => [
        after.name, number(before.error), number(after.error), cost(before), cost(after), now.cost_kind === 'compiled' ? number(after.ratio / before.ratio) : interval(change),
      ]), 'Formulas of both fronts'));
    } catch (refusal) {
      if (refusal.name === 'AbortError') throw refusal;
      tell(problem, refusal, update);
      for (const part of parts) part.hidden = true;
      shown = '';
    }
  }, page.busy('compare'));
  function update() {
    const { front, state } = page;
    const others = front.runs.filter((run) => run !== front.run);
    label.hidden = !others.length;
    for (const part of parts) part.hidden = !others.length;
    if (!others.length) return tell(problem, { title: 'There is no other run here', detail: 'phongbench run makes one.' });
    if ([...choice.options].map((option) => option.value).join() !== others.map((run) => run.id).join()) {
      const before = choice.value;
      choice.replaceChildren(...others.map((run) => make('option', { value: run.id }, titleOf(run))));
      if (others.some((run) => run.id === before)) choice.value = before;
    }
    const question = JSON.stringify([front.run.id, choice.value, state.alpha, state.precision, state.target, page.asked().space, state.theme]);
    if (question === shown) return undefined;
    shown = question;
    return ask();
  }
  return update;
}
