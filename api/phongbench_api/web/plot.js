// What all plots share: uPlot with the page's colours, labels drawn at the lines, and a cursor that keys can move.

import { colour } from './dom.js';
import { decade, number } from './format.js';

const { uPlot } = globalThis;
const FONT = '12px system-ui, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif';

/** The page's colours as they are now. */
export function palette() {
  const names = ['ink', 'muted', 'line', 'card', 'exact', 'value', 'bright', 'dark', 'front', 'unclear'];
  return Object.fromEntries(names.map((name) => [name, colour(name)]));
}

/** An axis in the page's colours. @param {ReturnType<typeof palette>} p @param {object} more */
export const axis = (p, more) => ({
  stroke: p.muted, font: FONT, labelFont: FONT, labelSize: 18, labelGap: 2, gap: 4,
  grid: { stroke: p.line, width: 1 }, ticks: { stroke: p.line, width: 1, size: 4 }, ...more,
});

/** As wide as an axis's longest label, so that none is cut off. @param {number} least */
export const roomy = (least) => (u, labels) => Math.max(least, 16 + 7 * Math.max(0, ...(labels ?? []).map((label) => (label ?? '').length)));

/** A log axis of ratios, with a line at each power of two. @param {ReturnType<typeof palette>} p @param {object} more */
export const octaves = (p, more) => axis(p, {
  size: 56,
  values: (u, splits) => splits.map((value) => (Number.isInteger(Math.round(1e6 * Math.log2(value)) / 1e6) ? number(value) : '')),
  splits: (u, i, from, to) => { const found = []; for (let e = Math.ceil(Math.log2(from)); 2 ** e <= to; e++) found.push(2 ** e); return found; },
  ...more,
});

/** For a log axis: lines and ticks at the decades only. @param {ReturnType<typeof palette>} p */
export const onlyDecades = (p) => {
  const filter = (u, ticks) => ticks.map((tick) => (decade(tick) ? tick : null));
  return { filter: (u, ticks) => ticks, grid: { stroke: p.line, width: 1, filter }, ticks: { stroke: p.line, width: 1, size: 4, filter } };
};

/**
 * A plot that fills its place's width; `destroy` undoes all of it.
 * @param {HTMLElement} place @param {object} options @param {any[]} data @param {number} height
 */
export function plot(place, options, data, height) {
  const made = new uPlot({
    width: Math.max(place.clientWidth, 120), height, legend: { show: false }, padding: [10, 16, 0, 0], ...options,
  }, data, place);
  const watch = new ResizeObserver(() => {
    const width = Math.max(place.clientWidth, 120);
    if (width !== made.width) made.setSize({ width, height });
  });
  watch.observe(place);
  return Object.assign(made, { remove: () => { watch.disconnect(); made.destroy(); } });
}

/**
 * Writes onto a plot's canvas, on a plate of the background's colour so that lines do not cross the letters.
 * @param {any} u @param {string} text @param {number} x canvas pixels @param {number} y
 * @param {{colour: string, plate: string, align?: CanvasTextAlign, bold?: boolean}} look
 */
export function write(u, text, x, y, { colour: ink, plate, align = 'left', bold = false }) {
  const ratio = uPlot.pxRatio;
  const { ctx } = u;
  ctx.save();
  ctx.font = `${bold ? 600 : 400} ${12 * ratio}px system-ui, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif`;
  ctx.textBaseline = 'middle';
  ctx.textAlign = 'left';
  const width = ctx.measureText(text).width;
  const { left, width: room } = u.bbox;
  const start = { left: x, right: x - width, center: x - width / 2 }[align];
  const from = Math.min(Math.max(start, left + 2 * ratio), left + room - width - 2 * ratio);
  ctx.globalAlpha = 0.8;
  ctx.fillStyle = plate;
  ctx.fillRect(from - 2 * ratio, y - 8 * ratio, width + 4 * ratio, 16 * ratio);
  ctx.globalAlpha = 1;
  ctx.fillStyle = ink;
  ctx.fillText(text, from, y);
  ctx.restore();
}

/**
 * Lets arrow keys move a plot's cursor along its points.
 * @param {HTMLElement} place @param {() => {now: number|null, count: number, go: (index: number) => void}} steps
 */
export function walkable(place, steps) {
  place.addEventListener('keydown', (event) => {
    const way = { ArrowRight: 1, ArrowLeft: -1, ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10, Home: -Infinity, End: Infinity }[event.key];
    if (!way) return;
    event.preventDefault();
    const { now, count, go } = steps();
    if (count) go(Math.min(Math.max((now ?? (way > 0 ? -1 : count)) + way, 0), count - 1));
  });
}

/** A level line across a plot. @param {any} u @param {number} value @param {string} ink @param {number[]} dash */
export function level(u, value, ink, dash) {
  const { ctx, bbox } = u;
  const y = Math.round(u.valToPos(value, 'y', true)) + 0.5;
  if (y < bbox.top || y > bbox.top + bbox.height) return null;
  ctx.save();
  ctx.strokeStyle = ink;
  ctx.lineWidth = uPlot.pxRatio;
  ctx.setLineDash(dash.map((part) => part * uPlot.pxRatio));
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.restore();
  return y;
}
