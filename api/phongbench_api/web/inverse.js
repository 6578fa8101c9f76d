// "Normals from shading": a line of intensities across a cylinder, and what the service says of its normals and heights.

import { get, newest } from './api.js';
import { lazily, make, table, tell } from './dom.js';
import { number } from './format.js';
import { axis, palette, plot, write } from './plot.js';

/** Lines to begin with, as cameras saw them: intensities from the first x on, a step apart, and how they were lit. */
const EXAMPLES = {
  circle: {
    title: 'A cylinder', first: -0.9, step: 0.05, fields: { ambient: 0.1, diffuse: 0.7, 'light-x': 0.71, 'light-z': 0.71, noise: 0.004, scale: 1 }, prior: 'convex',
    values: [
      0.1, 0.1, 0.1, 0.1, 0.107, 0.1546, 0.1994, 0.2417, 0.2819, 0.3202, 0.3567, 0.3916, 0.425, 0.457, 0.4876, 0.5168, 0.5448, 0.5715, 0.597,
      0.6212, 0.6442, 0.6659, 0.6864, 0.7055, 0.7232, 0.7395, 0.7543, 0.7675, 0.7789, 0.7884, 0.7958, 0.8007, 0.8028, 0.8015, 0.7958, 0.7843, 0.7639,
    ],
  },
  wave: {
    title: 'A wave', first: 0, step: 0.2, fields: { ambient: 0.1, diffuse: 0.7, 'light-x': 0.8, 'light-z': 0.6, noise: 0.004, scale: 1 }, prior: 'towards-viewer',
    values: [
      0.2252, 0.2307, 0.2472, 0.2746, 0.3124, 0.3594, 0.4134, 0.4711, 0.5281, 0.5805, 0.6253, 0.661, 0.6878, 0.7066, 0.7186, 0.7248, 0.7259, 0.7219, 0.7124,
      0.6965, 0.6732, 0.6412, 0.6002, 0.5507, 0.4951, 0.4372, 0.3812, 0.3309, 0.2891, 0.2573, 0.2363,
    ],
  },
};
const FIELDS = {
  ambient: 'Ambient', diffuse: 'Diffuse', 'light-x': 'Light, to the right', 'light-z': 'Light, to the viewer', noise: 'Noise, standard deviation', scale: 'Largest intensity',
};
const PRIORS = { convex: 'convex', concave: 'concave', continuous: 'continuous', 'towards-viewer': 'towards the viewer' };
const HEIGHT = 190;
const HEADER = /^(x\s*[,;\s]\s*)?intensity$/i;

/** What is wrong with the text of a line, in the words of a problem. */
class Unreadable extends Error {
  get title() { return 'This is no line'; }
}

/**
 * The samples of a text: an intensity on each line, or x and intensity; or all intensities on one line.
 * @param {string} text @returns {{x: number[]|null, intensity: number[]}}
 */
export function read(text) {
  const lines = text.split('\n').map((words, i) => ({ words: words.trim(), at: i + 1 })).filter(({ words }) => words);
  if (lines.length && HEADER.test(lines[0].words)) lines.shift();
  if (!lines.length) throw new Unreadable('give an intensity on each line, or x, intensity');
  let rows = lines.map(({ words, at }) => ({ at, cells: words.split(/[,;\s]+/).filter(Boolean) }));
  if (rows.length === 1) rows = rows[0].cells.map((cell) => ({ at: lines[0].at, cells: [cell] }));
  const wide = rows[0].cells.length;
  for (const { at, cells } of rows) {
    const wrong = cells.find((cell) => !Number.isFinite(Number(cell)));
    if (wrong !== undefined) throw new Unreadable(`line ${at}: ${wrong.slice(0, 20)} is not a number`);
    if (cells.length !== wide || wide > 2) throw new Unreadable(`line ${at} has ${cells.length} numbers: give an intensity on each, or x, intensity`);
  }
  const column = (i) => rows.map(({ cells }) => Number(cells[i]));
  return { x: wide === 2 ? column(0) : null, intensity: column(wide - 1) };
}

/** A line as text. @param {{x: number[]|null, intensity: number[]}} line */
const written = ({ x, intensity }) => intensity.map((value, i) => (x ? `${x[i]}, ${value}` : `${value}`)).join('\n');

const angle = ([nx, nz]) => (nx === null ? null : (180 / Math.PI) * Math.atan2(nx, nz));

/** Lets a pointer draw intensities on a plot. @param {any} u @param {(from: [number, number], to: [number, number]) => void} stroke indices and values */
function drawable(u, stroke) {
  let last = null;
  const at = ({ offsetX, offsetY }) => [u.posToIdx(offsetX), u.posToVal(offsetY, 'y')];
  u.over.addEventListener('pointerdown', (event) => { u.over.setPointerCapture(event.pointerId); last = at(event); stroke(last, last); });
  u.over.addEventListener('pointermove', (event) => { if (last) { const next = at(event); stroke(last, next); last = next; } });
  for (const end of ['pointerup', 'pointercancel']) u.over.addEventListener(end, () => { last = null; });
}

class Inverse {
  /** @param {HTMLElement} place @param {any} page */
  constructor(place, page) {
    this.text = make('textarea', { id: 'inverse-text', rows: 8, spellcheck: 'false', oninput: () => this.edited() });
    this.fields = Object.fromEntries(Object.keys(FIELDS).map((name) => [name, make('input', { type: 'number', id: `inverse-${name}`, step: 'any', oninput: () => this.ask() })]));
    this.unit = make('input', { type: 'checkbox', id: 'inverse-unit', onchange: () => this.ask() });
    this.prior = make('select', { id: 'inverse-prior', onchange: () => this.ask() }, ...Object.entries(PRIORS).map(([value, words]) => make('option', { value }, words)));
    this.problem = make('div', { class: 'problem', role: 'status', hidden: true });
    this.verdict = make('p', { role: 'status' });
    this.notes = make('ul', { class: 'notes muted' });
    const figures = [
      ['intensity', 'Intensity', 'draw on it, or type above'], ['angles', 'Angle of the normal', ''], ['height', 'Height', ''],
    ].map(([name, title, hint]) => make('figure', { class: 'plot' }, make('figcaption', {}, title, make('output', {}, hint)), this[name] = make('div', { class: name === 'intensity' ? 'drawable' : null, role: 'img', 'aria-label': `${title} along the line; the table below holds the numbers` })));
    const details = make('details', {}, make('summary', {}, 'The numbers as a table'), make('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Normals and heights along the line' }));
    const label = (name, words, field) => make('label', { class: 'stacked', for: `inverse-${name}` }, words, field);
    place.replaceChildren(
      make('p', { class: 'muted' }, 'Across a cylinder, shading leaves two normals for every intensity. Which one is meant, only other knowledge can say: the prior.'),
      make('p', {}, 'Example: ', ...Object.entries(EXAMPLES).flatMap(([name, { title }]) => [make('button', { type: 'button', onclick: () => this.example(name) }, title), ' '])),
      make('div', { class: 'columns' }, ...Object.entries(FIELDS).map(([name, words]) => label(name, words, this.fields[name])), label('prior', 'Prior', this.prior), make('label', { class: 'inline' }, this.unit, 'Light of length 1')),
      label('text', 'Intensities, one a line, or x, intensity', this.text),
      this.problem, this.verdict, make('div', { class: 'thirds' }, ...figures), details, this.notes,
    );
    this.fill = lazily(details);
    this.ask = newest((signal) => this.answer(signal), page.busy('inverse'), 80);
    this.example('circle');
  }

  /** @param {string} name */
  example(name) {
    const { first, step, values, fields, prior } = EXAMPLES[name];
    this.line = { x: values.map((_, i) => Number((first + i * step).toFixed(6))), intensity: values };
    this.text.value = written(this.line);
    for (const [field, value] of Object.entries(fields)) this.fields[field].value = value;
    this.prior.value = prior;
    this.unit.checked = false;
    this.ask();
  }

  /** Takes what was typed or pasted. */
  edited() {
    try {
      this.line = read(this.text.value);
      this.ask();
    } catch (problem) {
      if (!(problem instanceof Unreadable)) throw problem;
      this.line = null;
      this.refuse(problem);
    }
  }

  /** Changes the intensities that a stroke passes. */
  stroke([from, start], [to, end]) {
    const top = this.fields.scale.valueAsNumber || 1;
    const way = Math.sign(to - from) || 1;
    const intensity = [...this.line.intensity];
    for (let i = from; ; i += way) {
      const share = to === from ? 1 : (i - from) / (to - from);
      intensity[i] = Number(Math.min(Math.max(start + share * (end - start), 0), top).toPrecision(4));
      if (i === to) break;
    }
    this.line = { ...this.line, intensity };
    this.text.value = written(this.line);
    this.plots?.[0].setData([this.data.x, intensity, this.data.unusable]);
    this.ask();
  }

  async answer(signal) {
    if (!this.line) return;
    const field = (name) => this.fields[name].valueAsNumber;
    const { x, intensity } = this.line;
    const body = {
      ...(x ? { x } : {}), intensity: intensity.map((value) => value / field('scale')), ambient: field('ambient'), diffuse: field('diffuse'),
      light: [field('light-x'), field('light-z')], prior: this.prior.value, noise: field('noise'), unit_light: this.unit.checked,
    };
    try {
      const answer = await get('/v1/inverse/line', {}, signal, body);
      tell(this.problem, null);
      this.show(answer, intensity);
    } catch (problem) {
      if (problem.name === 'AbortError') throw problem;
      this.refuse(problem);
    }
  }

  refuse(problem) {
    tell(this.problem, problem, this.ask);
    this.verdict.replaceChildren();
  }

  show(answer, intensity) {
    const { marks, notes, height_low: low, height_high: high } = answer;
    const known = answer.height.filter((value) => value !== null);
    const unusable = [...new Set(marks.filter((mark) => mark !== 'ok'))].map((mark) => `${marks.filter((one) => one === mark).length} ${mark}`);
    const band = Math.max(0, ...high.map((value, i) => (value === null ? 0 : (value - low[i]) / 2)));
    const words = known.length ? `The heights span ${number(Math.max(...known) - Math.min(...known))}${band ? `, known to ±${number(band)} at worst (99 %)` : ''}.` : 'There are no heights.';
    this.verdict.replaceChildren(words, unusable.length ? ` Not usable: ${unusable.join(', ')}.` : ' Every sample is usable.');
    this.notes.replaceChildren(...notes.map((note) => make('li', {}, note)));
    this.data = { ...answer, intensity, chosen: answer.normals.map(angle), others: answer.other.map(angle), unusable: intensity.map((value, i) => (marks[i] === 'ok' ? null : value)) };
    this.draw();
    this.fill(() => table(['x', 'intensity', 'angle', 'other', 'height', 'band', 'mark'], answer.x.map((x, i) => [
      number(x), number(intensity[i]), ...[this.data.chosen[i], this.data.others[i], answer.height[i]].map((value) => number(value)),
      low[i] === null ? '–' : `${number(low[i])} to ${number(high[i])}`, marks[i],
    ]), 'Normals and heights along the line'));
  }

  /** Draws the plots anew. */
  draw() {
    const { data } = this;
    if (!data) return;
    for (const u of this.plots ?? []) u.remove();
    const p = palette();
    const line = (ink, more = {}) => ({ stroke: ink, width: 2, points: { show: false }, ...more });
    const made = (place, columns, series, more = {}, sign = '') => plot(place, {
      cursor: { show: false }, select: { show: false }, scales: { x: { time: false } }, series: [{}, ...series],
      axes: [axis(p, { size: 28, values: (u, ticks) => ticks.map((tick) => number(tick)) }), axis(p, { size: 50, values: (u, ticks) => ticks.map((tick) => `${number(tick)}${sign}`) })], ...more,
    }, [data.x, ...columns], HEIGHT);
    const { unusable } = data;
    const top = this.fields.scale.valueAsNumber || 1;
    const dots = { stroke: p.bright, width: 0, points: { show: true, size: 7, stroke: p.bright, fill: p.card } };
    const named = (text, ink) => (u) => { if (unusable.some((value) => value !== null)) write(u, text, u.bbox.left + u.bbox.width, u.bbox.top + u.bbox.height - 12, { colour: ink, plate: p.card, align: 'right' }); };
    const branches = (u) => {
      write(u, 'chosen', u.bbox.left, u.bbox.top + 10, { colour: p.value, plate: p.card, bold: true });
      write(u, 'other (dashed)', u.bbox.left + u.bbox.width, u.bbox.top + 10, { colour: p.dark, plate: p.card, align: 'right' });
    };
    this.plots = [
      made(this.intensity, [data.intensity, unusable], [line(p.exact), dots], { scales: { x: { time: false }, y: { range: () => [0, top] } }, hooks: { draw: [named('rings: not usable', p.bright)] } }),
      made(this.angles, [data.chosen, data.others], [line(p.value), line(p.dark, { dash: [7, 4] })], { hooks: { draw: [branches] } }, '°'),
      made(this.height, [data.height, data.height_low, data.height_high], [line(p.value), line(p.value, { width: 0 }), line(p.value, { width: 0 })], { bands: [{ series: [3, 2], fill: `${p.value}40` }] }),
    ];
    drawable(this.plots[0], (from, to) => this.stroke(from, to));
  }
}

/** Fills the panel. @param {HTMLElement} place @param {any} page @returns {() => void} */
export function open(place, page) {
  const panel = new Inverse(place, page);
  let theme = null;
  return () => {
    if (theme !== null && theme !== page.state.theme) panel.draw();
    theme = page.state.theme;
  };
}
