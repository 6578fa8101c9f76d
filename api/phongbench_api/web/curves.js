// The highlight and its error against the angle, with a common cursor.

import { $, lazily, table } from './dom.js';
import { codes, decade, degrees, number } from './format.js';
import { axis, level, onlyDecades, palette, plot, roomy, walkable, write } from './plot.js';

const { uPlot } = globalThis;
const CODE = 1 / 255;
/** Ends of the angle axis: few, so that the axis stands still while a slider moves. */
const ENDS = [1, 2, 3, 5, 10, 15, 20, 30, 45, 60, 90];
/** Highlights fainter than this are left out of the lobe's own range. */
const FAINT = 0.3 * CODE;
const DECADES = 6;

/** The angle beyond which neither highlight is to be seen. @param {any} curve */
export function reachOf({ angle, exact, value }) {
  let last = angle.length - 1;
  while (last > 1 && !(Math.abs(exact[last]) > FAINT || Math.abs(value[last]) > FAINT)) last--;
  return angle[last];
}

/** Powers of ten in a range. */
const decades = (low, high) => {
  const first = Math.ceil(Math.log10(low));
  return Array.from({ length: Math.max(0, Math.floor(Math.log10(high)) - first + 1) }, (_, i) => 10 ** (first + i));
};

/** Round numbers in a range, about four on either side of 0. */
const rounds = (low, high) => {
  const rough = high / 4;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((one) => one * ten >= rough) * ten;
  const most = Math.floor(high / step);
  return Array.from({ length: 2 * most + 1 }, (_, i) => (i - most) * step).filter((tick) => tick >= low);
};

const drawn = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));

export class Curves {
  /** @param {() => import('./state.js').State} state @param {(angle: number|null) => void} pointed */
  constructor(state, pointed) {
    this.state = state;
    this.pointed = pointed;
    this.curve = null;
    this.fill = lazily($('curve-details'));
    this.index = null;
    for (const id of ['lobe', 'error']) {
      walkable($(id), () => ({ now: this.index, count: this.#shown(), go: (i) => this.#point(i) }));
      $(id).addEventListener('blur', () => this.#read(null));
    }
  }

  /** @param {any} curve @param {string} name */
  show(curve, name) {
    this.curve = curve;
    this.name = name;
    const look = [this.state().scale, this.state().theme, name].join();
    if (this.look === look) this.#update();
    else this.draw();
    this.look = look;
  }

  /** Draws both plots anew: colours, scale or names have changed. */
  draw() {
    if (!this.curve) return;
    this.plots?.forEach((u) => u.remove());
    this.p = palette();
    this.plots = [plot($('lobe'), this.#lobe(), this.#lobeData(), 250), plot($('error'), this.#error(), this.#errorData(), 250)];
    this.#rows();
  }

  #update() {
    this.plots[0].setData(this.#lobeData());
    this.plots[1].setData(this.#errorData());
    this.#rows();
  }

  #end() {
    const reach = this.state().range === 'all' ? 90 : this.curve.reach;
    return ENDS.find((end) => end >= reach) ?? 90;
  }

  #shown() {
    const end = this.#end();
    const beyond = this.curve.angle.findIndex((angle) => angle > end);
    return beyond < 0 ? this.curve.angle.length : beyond;
  }

  #common(title) {
    return {
      title: undefined,
      cursor: { sync: { key: 'angle', setSeries: false }, drag: { x: false, y: false }, y: false, points: { size: 6 } },
      scales: { x: { time: false, range: () => [0, this.#end()] } },
      hooks: { setCursor: [(u) => this.#read(u.cursor.idx ?? null)] },
      axes: [axis(this.p, { label: 'angle between R and V', values: (u, ticks) => ticks.map((tick) => `${tick}°`), size: 28 }), title],
    };
  }

  #lobe() {
    const { p } = this;
    const options = this.#common(axis(p, { size: roomy(50), values: (u, ticks) => ticks.map((tick) => number(tick)) }));
    options.scales.y = { range: (u, low, high) => [Math.min(0, 1.05 * low), Math.max(1, high) * 1.06] };
    options.series = [{}, { stroke: p.exact, width: 2.5 }, { stroke: p.value, width: 2, dash: [7, 4] }];
    options.hooks.draw = [(u) => this.#names(u)];
    return options;
  }

  /** Names beside the lines, where each is at half its height and the two lie apart. */
  #names(u) {
    const { angle, exact, value } = this.curve;
    const first = exact.findIndex((v) => v < 0.6);
    const second = value.findIndex((v) => v < 0.35);
    const pad = 10 * uPlot.pxRatio;
    const at = (i, values) => [u.valToPos(angle[i], 'x', true) + pad, u.valToPos(values[i], 'y', true)];
    if (first > 0) write(u, 'exact Phong', ...at(first, exact), { colour: this.p.exact, plate: this.p.card, bold: true });
    if (second > 0 && this.name !== 'phong') write(u, `${this.name} (dashed)`, ...at(second, value), { colour: this.p.value, plate: this.p.card, bold: true });
  }

  #error() {
    const { p } = this;
    const log = this.state().scale === 'log';
    const own = axis(p, { size: roomy(60), ...(log ? onlyDecades(p) : {}), values: (u, ticks) => ticks.map(log ? decade : (tick) => number(tick)) });
    const options = this.#common(own);
    const codeAxis = axis(p, {
      scale: 'y', side: 1, size: roomy(40), label: '8-bit codes', grid: { show: false }, filter: (u, ticks) => ticks,
      splits: (u, i, low, high) => (log ? decades(255 * low, 255 * high) : rounds(255 * low, 255 * high)).map((tick) => tick / 255),
      values: (u, ticks) => ticks.map((tick) => (log ? decade : number)(Number((255 * tick).toPrecision(6)))),
    });
    if (!matchMedia('(max-width: 40rem)').matches) options.axes.push(codeAxis);
    options.scales.y = log
      ? { distr: 3, range: () => { const top = 10 ** Math.ceil(Math.log10(Math.max(this.curve.largest, CODE) * 1.05)); return [top / 10 ** DECADES, top]; } }
      : { range: () => { const top = 1.15 * Math.max(Number.isFinite(this.curve.largest) ? this.curve.largest : 1, 1.3 * CODE); return [-top, top]; } };
    const filled = log ? () => null : (ink) => `${ink}40`;
    options.series = [{},
      { stroke: p.bright, width: 2, fill: filled(p.bright), fillTo: () => 0 },
      { stroke: p.dark, width: 2, dash: [7, 3], fill: filled(p.dark), fillTo: () => 0 }];
    options.hooks.draw = [(u) => this.#marks(u, log)];
    return options;
  }

  /** The line of one code, the largest error, and what the two colours mean. */
  #marks(u, log) {
    const { p, curve } = this;
    const ratio = uPlot.pxRatio;
    const { left, top, width, height } = u.bbox;
    const y = level(u, CODE, p.ink, [3, 3]);
    if (!log) { level(u, -CODE, p.ink, [3, 3]); level(u, 0, p.muted, []); }
    const label = { colour: p.ink, plate: p.card, align: log ? 'left' : 'right' };
    if (y !== null) write(u, log ? '1/255' : '± 1/255', log ? left + 6 * ratio : left + width - 6 * ratio, y - 9 * ratio, label);
    // The names stand in the half of the plot where the error is small.
    const right = log || curve.angle[curve.worst] < this.#end() / 2;
    const side = right ? left + width - 6 * ratio : left + 6 * ratio;
    const name = (text, ink, at) => write(u, text, side, at, { colour: ink, plate: p.card, align: right ? 'right' : 'left', bold: true });
    // only what is to be seen: a plot without such a line needs no name for it
    const seen = log ? u.scales.y.min : u.scales.y.max / 100;
    if (curve.error.some((e) => e > seen)) name('too bright', p.bright, log ? top + height - 27 * ratio : top + 10 * ratio);
    if (curve.error.some((e) => e < -seen)) name('too dark (dashed)', p.dark, top + height - 10 * ratio);
    const error = curve.error[curve.worst];
    if (!error || !Number.isFinite(error) || curve.angle[curve.worst] > this.#end()) return;
    const [px, py] = [u.valToPos(curve.angle[curve.worst], 'x', true), u.valToPos(log ? Math.abs(error) : error, 'y', true)];
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.arc(px, py, 5 * ratio, 0, 2 * Math.PI);
    u.ctx.lineWidth = 2 * ratio;
    u.ctx.setLineDash([]);
    u.ctx.strokeStyle = p.ink;
    u.ctx.stroke();
    u.ctx.restore();
  }

  #lobeData() {
    const { angle, exact, value } = this.curve;
    return [Array.from(angle), drawn(exact), drawn(value)];
  }

  #errorData() {
    const { angle, error } = this.curve;
    const log = this.state().scale === 'log';
    const has = (sign, i) => sign * error[i] > 0 && Number.isFinite(error[i]);
    const beside = (sign, i) => !log && Number.isFinite(error[i]) && (has(sign, i - 1) || has(sign, i + 1));
    const part = (sign) => Array.from(error, (e, i) => (has(sign, i) ? (log ? Math.abs(e) : e) : beside(sign, i) ? 0 : null));
    return [Array.from(angle), part(1), part(-1)];
  }

  /** Moves the cursor to an angle, from the spheres. @param {number|null} angle */
  point(angle) {
    if (!this.curve) return;
    const index = angle === null ? -1 : this.curve.angle.findIndex((one) => one >= angle);
    if (index >= 0) this.#point(index);
    else {
      for (const u of this.plots) u.setCursor({ left: -10, top: -10 }, false);
      this.#read(null);
    }
  }

  #point(index) {
    for (const u of this.plots) {
      const at = { left: u.valToPos(this.curve.angle[index], 'x'), top: u.bbox.height / 4 };
      u.setCursor(at, false);
    }
    this.#read(index);
  }

  #read(index) {
    if (this.index === index) return;
    this.index = index;
    const { angle, exact, value, error } = this.curve;
    const known = index !== null && index < angle.length;
    $('lobe-readout').value = known ? `at ${degrees(angle[index])}: exact ${number(exact[index])}, here ${number(value[index])}` : '';
    $('error-readout').value = known ? `at ${degrees(angle[index])}: ${number(error[index])}, ${codes(error[index])}` : '';
    this.pointed(known ? angle[index] : null);
  }

  #rows() {
    this.fill(() => {
      const { angle, exact, value, error } = this.curve;
      const every = Math.max(1, Math.floor(this.#shown() / 40));
      const picked = [...angle.keys()].filter((i) => i < this.#shown() && (i % every === 0 || i === this.curve.worst));
      const rows = picked.map((i) => [degrees(angle[i]), number(exact[i]), number(value[i]), number(error[i]), number(255 * error[i])]);
      return table(['angle', 'exact', this.name, 'error', '8-bit codes'], rows, 'Highlight and error by angle');
    });
  }
}
