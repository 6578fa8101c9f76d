// The error/cost front of the newest run on a target: every formula with its interval, the chosen one marked.

import { Problem, get } from './api.js';
import { $, lazily, make, table, tell } from './dom.js';
import { codes, decade, number } from './format.js';
import { ask } from './measured.js';
import { axis, level, octaves, onlyDecades, palette, plot, walkable, write } from './plot.js';

const { uPlot } = globalThis;
/** Smaller errors are drawn here: a log axis has no place for an exact formula. */
const FLOOR = 1e-7;
const NAMED = 7;
const NEAR = 24;
/** About how wide a letter of a name is. */
const LETTER = 7.2;
const narrow = () => matchMedia('(max-width: 40rem)').matches;
const STATES = {
  on: ['on the front', 'front', 'disc'], unresolved: ['not settled: intervals overlap', 'unclear', 'diamond'], off: ['off: another is surely faster and no worse', 'muted', 'ring'],
};

/** The run to ask: the newest whole one with times, else the newest. @param {any[]} runs newest first */
export function newestRun(runs) {
  const timed = (run) => run.state === 'complete' && (run.files?.['timing.parquet']?.rows ?? 0) > 0;
  return runs.find(timed) ?? runs[0] ?? null;
}

/** What a run is called in lists. @param {any} run */
export function titleOf({ id, state, plan: { alphas } }) {
  const exponents = alphas.length > 3 ? `${alphas[0]} to ${alphas.at(-1)}` : alphas.join(', ');
  return `${id}, α ${exponents}${state === 'complete' ? '' : `, ${state}`}`;
}

/** The run's exponent that lies nearest, as ratios go. @param {number[]} alphas @param {number} alpha */
export const nearest = (alphas, alpha) => alphas.reduce((best, one) => (Math.abs(Math.log(one / alpha)) < Math.abs(Math.log(best / alpha)) ? one : best));

const same = (point, asked) => point.approximation === asked.approximation && point.lambda_form === asked.lambda
  && (point.gamma ?? null) === asked.gamma && point.beta_policy === asked.beta && point.space === asked.space;

export class Front {
  /** @param {(point: any) => void} choose */
  constructor(choose) {
    this.choose = choose;
    this.points = [];
    this.run = null;
    this.runs = [];
    this.asked = false; // whether the service has said which runs there are
    this.fill = lazily($('front-details'));
    const place = $('front-plot');
    walkable(place, () => {
      const line = this.points.filter((p) => p.state !== 'off');
      return { now: line.indexOf(this.near) < 0 ? null : line.indexOf(this.near), count: line.length, go: (i) => this.#point(line[i]) };
    });
    place.addEventListener('keydown', (event) => { if (event.key === 'Enter' && this.near) this.choose(this.near); });
    place.addEventListener('blur', () => this.#point(null));
    place.addEventListener('mousemove', (event) => this.#point(this.#under(event)));
    place.addEventListener('mouseleave', () => this.#point(null));
    place.addEventListener('click', (event) => { const point = this.#under(event); if (point) this.choose(point); });
    $('front-key').replaceChildren(...Object.entries(STATES).map(([, [words, , shape]]) => make('span', {}, make('i', { class: shape }), words)), make('span', {}, make('i', { class: 'chosen' }), 'chosen'));
  }

  /** Looks for runs, and takes one. @param {string} id as for `use` */
  async find(id) {
    const { runs } = await get('/v1/runs', { limit: 50 });
    this.runs = runs.filter((run) => run.state !== 'corrupt');
    this.asked = true;
    const newest = newestRun(this.runs);
    $('run').replaceChildren(...this.runs.map((run) => make('option', { value: run === newest ? '' : run.id }, titleOf(run))));
    $('run').parentElement.hidden = this.runs.length < 2;
    this.use(id);
  }

  /** Takes a run. @param {string} id of one of them; of another, and '': the newest */
  use(id) {
    const newest = newestRun(this.runs);
    this.run = this.runs.find((run) => run.id === id) ?? newest;
    $('run').value = this.run === newest ? '' : this.run.id;
    $('front-absent').hidden = this.run !== null || !this.asked;
    for (const id of ['front-figure', 'front-details']) $(id).hidden = this.run === null;
    $('front-basis').textContent = '';
    for (const [name, end, there] of [['report', 'report/', this.run?.report], ['rows', 'rows', this.run]]) {
      $(`${name}-link`).hidden = !there;
      if (this.run) $(`${name}-link`).href = `/runs/${encodeURIComponent(this.run.id)}/${end}`;
    }
  }

  /** Asks for the points. @param {any} state @param {any} asked the formula shown @param {AbortSignal} signal */
  async ask(state, asked, signal) {
    if (!this.run) return;
    const { id: run, plan } = this.run;
    const alpha = nearest(plan.alphas, state.alpha);
    try {
      for (const [axis, wanted, measured] of [['precision', state.precision, plan.precisions], ['space', asked.space, plan.spaces]]) {
        if (!measured.includes(wanted)) throw new Problem(404, `This run has no ${axis} ${wanted}`, `It measured ${measured.join(', ')}.${axis === 'precision' ? ` Measure it: phongbench run --precision ${wanted}` : ''}`);
      }
      const target = state.target === 'cpu' ? null : state.target;
      const answer = this.answer = await ask(`/v1/runs/${encodeURIComponent(run)}/front`, { alpha, precision: state.precision, space: asked.space, target }, signal);
      this.points = [...answer.points].sort((a, b) => a.error - b.error);
      tell($('front-problem'), null);
      const off = Math.abs(alpha / state.alpha - 1) > 1e-6 ? `, the nearest measured to ${number(state.alpha)}` : '';
      const timed = target || answer.timed_precision === state.precision ? '' : ` with the times of ${answer.timed_precision}`;
      $('front-basis').textContent = `Run ${run}: α = ${number(alpha)}${off}; ${state.precision}${timed}, unit vectors, ${target ? `costs on ${target}` : 'data in the first-level cache'}`;
    } catch (problem) {
      if (problem.name === 'AbortError') throw problem;
      this.points = [];
      $('front-basis').textContent = `Run ${run}`;
      tell($('front-problem'), problem, () => this.ask(state, asked, signal));
    }
    for (const id of ['front-figure', 'front-details']) $(id).hidden = !this.points.length;
    this.asked = asked;
    this.draw();
  }

  /** The exponent that its errors are of; null without a run. */
  get alpha() {
    return this.run && this.answer ? this.answer.alphas[0] : null;
  }

  /** Its formulas by name: those on the line first, then those that may be, then the rest, each by error. */
  names() {
    return Object.keys(STATES).flatMap((state) => this.points.filter((point) => point.state === state)).map((point) => point.name);
  }

  /** Marks the formula shown and the budget. @param {any} asked @param {string} budget a number or a fraction */
  mark(asked, budget) {
    this.asked = asked;
    this.budget = budget;
    this.u?.redraw(false);
    this.#rows();
  }

  /** Draws anew. */
  draw() {
    this.u?.remove();
    this.u = null;
    if (!this.points.length) return;
    const p = this.p = palette();
    const low = Math.min(...this.points.map((q) => q.ratio_low));
    const high = Math.max(1, ...this.points.map((q) => q.ratio_high));
    this.u = plot($('front-plot'), {
      cursor: { show: false }, select: { show: false },
      scales: {
        x: { time: false, distr: 3, range: () => [FLOOR / 2, 1] },
        y: { distr: 3, range: () => [low / 1.5, high * 1.3] },
      },
      axes: [axis(p, { label: 'largest absolute error', ...onlyDecades(p), values: (u, splits) => splits.map((v) => (narrow() && Math.round(Math.log10(v)) % 2 ? '' : decade(v))), size: 28 }), octaves(p, { label: this.#cost() })],
      series: [{}, { paths: () => null, points: { show: false } }],
      hooks: { draw: [(u) => this.#paint(u)] },
    }, [this.points.map((q) => Math.max(q.error, FLOOR)), this.points.map((q) => q.ratio)], 340);
    this.#rows();
  }

  /** Whether costs are counted in machine code, without an interval. */
  get #counted() {
    return this.answer.cost_kind === 'compiled';
  }

  /** What the vertical axis shows: cost or time, in which unit, and how it is known. */
  #cost() {
    return `${this.#counted ? 'cost' : 'time'} / exact Phong (${this.answer.unit}, ${this.#counted ? 'counted' : 'measured'})`;
  }

  /** A point's cost in words: its interval, or how many units it takes beyond the dot product. @param {any} q */
  #spread(q) {
    return this.#counted ? `${number(q.cost)} ${this.answer.unit}, ${q.bound_by}` : `${number(q.ratio_low)} to ${number(q.ratio_high)}`;
  }

  #at(u, point) {
    return [u.valToPos(Math.max(point.error, FLOOR), 'x', true), u.valToPos(point.ratio, 'y', true)];
  }

  #paint(u) {
    const { p } = this;
    const ratio = uPlot.pxRatio;
    const { ctx, bbox } = u;
    level(u, 1, p.ink, []);
    this.#budgetLine(u);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left - 8 * ratio, bbox.top, bbox.width + 16 * ratio, bbox.height);
    ctx.clip();
    for (const state of ['off', 'unresolved', 'on']) for (const point of this.points) if (point.state === state) this.#symbol(u, point);
    ctx.restore();
    write(u, 'exact Phong', bbox.left + bbox.width - 4 * ratio, u.valToPos(1, 'y', true) - 9 * ratio, { colour: p.ink, plate: p.card, align: 'right' });
    this.#names(u);
    const chosen = this.#chosen();
    if (chosen) this.#ring(u, chosen, p.value, 9);
    if (this.near) this.#ring(u, this.near, p.ink, 12);
  }

  #chosen() {
    return this.asked ? this.points.find((point) => same(point, this.asked)) : null;
  }

  #budgetLine(u) {
    const [part, whole = 1] = this.budget.split('/').map(Number);
    const { ctx, bbox } = u;
    const error = part / whole;
    const x = Math.round(u.valToPos(error, 'x', true)) + 0.5;
    ctx.save();
    ctx.strokeStyle = this.p.ink;
    ctx.lineWidth = uPlot.pxRatio;
    ctx.setLineDash([3 * uPlot.pxRatio, 3 * uPlot.pxRatio]);
    ctx.strokeRect(x, bbox.top, 0, bbox.height);
    ctx.restore();
    write(u, this.budget, x + 4 * uPlot.pxRatio, bbox.top + 9 * uPlot.pxRatio, { colour: this.p.ink, plate: this.p.card });
  }

  #symbol(u, point) {
    const [, token, shape] = STATES[point.state] ?? STATES.off;
    const ratio = uPlot.pxRatio;
    const { ctx } = u;
    const [x, y] = this.#at(u, point);
    const size = { disc: 4.5, diamond: 5, ring: 3 }[shape] * ratio;
    ctx.save();
    ctx.strokeStyle = this.p[token];
    ctx.fillStyle = shape === 'disc' ? this.p[token] : this.p.card;
    ctx.lineWidth = 1.2 * ratio;
    ctx.globalAlpha = shape === 'ring' ? 0.65 : 1;
    ctx.beginPath();
    ctx.moveTo(x, u.valToPos(point.ratio_low, 'y', true));
    ctx.lineTo(x, u.valToPos(point.ratio_high, 'y', true));
    ctx.stroke();
    ctx.beginPath();
    if (shape === 'diamond') for (const [dx, dy] of [[0, -1], [1, 0], [0, 1], [-1, 0]]) ctx.lineTo(x + dx * size, y + dy * size);
    else ctx.arc(x, y, size, 0, 2 * Math.PI);
    ctx.closePath();
    ctx.fill();
    ctx.stroke();
    ctx.restore();
  }

  #ring(u, point, ink, radius) {
    const ratio = uPlot.pxRatio;
    u.ctx.save();
    u.ctx.strokeStyle = ink;
    u.ctx.lineWidth = 2.5 * ratio;
    u.ctx.beginPath();
    u.ctx.arc(...this.#at(u, point), radius * ratio, 0, 2 * Math.PI);
    u.ctx.stroke();
    u.ctx.restore();
  }

  /** Names to the lower left of points of the front: nothing can be there, it would be on the front itself - but the chosen one's name. */
  #names(u) {
    const line = narrow() ? [] : this.points.filter((point) => point.state === 'on');
    const every = Math.max(1, Math.ceil(line.length / NAMED));
    const chosen = this.#chosen();
    const ratio = uPlot.pxRatio;
    const taken = chosen && this.#nameOf(u, chosen);
    let lowest = -Infinity;
    for (const point of line.filter((q, i) => i % every === 0 && q !== chosen)) {
      const [x, y] = this.#at(u, point);
      const at = Math.max(y + 12 * ratio, lowest + 15 * ratio);
      if (at > u.bbox.top + u.bbox.height - 8 * ratio) continue;
      const from = x - (7 + LETTER * point.name.length) * ratio;
      if (taken && Math.abs(at - taken.y) < 15 * ratio && from < taken.to && x > taken.from) continue;
      write(u, point.name, x - 7 * ratio, at, { colour: this.p.front, plate: this.p.card, align: 'right' });
      lowest = at;
    }
    if (taken) write(u, chosen.name, taken.x, taken.y, { colour: this.p.value, plate: this.p.card, align: taken.align, bold: true });
  }

  /** Where the chosen point's name goes: to the right of it, or where there is no room to the left. */
  #nameOf(u, chosen) {
    const ratio = uPlot.pxRatio;
    const [x, y] = this.#at(u, chosen);
    const width = LETTER * chosen.name.length * ratio;
    const right = x + 14 * ratio + width < u.bbox.left + u.bbox.width;
    const at = x + (right ? 14 : -14) * ratio;
    return { x: at, y: y - 2 * ratio, from: right ? at : at - width, to: right ? at + width : at, align: right ? 'left' : 'right' };
  }

  #under(event) {
    const box = this.u?.over.getBoundingClientRect();
    if (!box) return null;
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const far = (q) => Math.hypot(this.u.valToPos(Math.max(q.error, FLOOR), 'x') - x, this.u.valToPos(q.ratio, 'y') - y);
    const best = this.points.reduce((one, other) => (far(other) < far(one) ? other : one), this.points[0]);
    return best && far(best) < NEAR ? best : null;
  }

  #point(point) {
    if (this.near === point) return;
    this.near = point;
    $('front-plot').classList.toggle('pointing', Boolean(point));
    $('front-readout').value = point ? `${point.name}: error ${number(point.error)}, ${this.#counted ? 'cost' : 'time'} ${number(point.ratio)} (${this.#spread(point)}) of exact Phong, ${point.state}` : '';
    this.u?.redraw(false);
  }

  #rows() {
    this.fill(() => table(['formula', 'error', '8-bit codes', this.answer ? this.#cost() : '', this.answer && this.#counted ? 'cost, bound by' : 'interval', 'front', ''], [...this.points].sort((a, b) => a.ratio - b.ratio).map((q) => [
      q.name, number(q.error), codes(q.error).split(' ')[0], number(q.ratio), this.#spread(q), q.state,
      this.asked && same(q, this.asked) ? make('b', {}, 'chosen') : make('button', { type: 'button', 'aria-label': `Choose ${q.name}`, onclick: () => this.choose(q) }, 'choose'),
    ]), 'Measured formulas, fastest first'));
  }
}
