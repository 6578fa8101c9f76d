// Times that can be believed: rounds that take every program in turn, in a new order each, each at two counts of repeats.
//
// The time of a call is the difference of the two counts' times over that of their calls: what begins and ends a pass is
// in both. Exact Phong's second copy, its twin, shows how much two equal programs seem to differ.

import { Distrusted, Unusable, pause } from './devices.js';
import { ROWS, SIDE, calls } from './programs.js';
import { LEAST_ROUNDS, median } from './statistics.js';

/** The larger count of repeats over the smaller. */
const TIMES = 4;
/** More rounds than this tell nothing new. */
const MOST_ROUNDS = 40;
/** Two readings agree that differ by no more; how many are taken until two do. */
const AGREE = 0.05;
const WARMING = 12;
/** A device's clock that runs so slow or fast against the wall counts no nanoseconds. */
const PACE = [0.1, 1.5];
/** Readings of the clock's grain that a pass lasts, and how long one may last, in milliseconds. */
const GRAINS = 150;
const LONGEST = 80;
const TRIES = 3;
/** Far more than any GPU does in a pass. */
const MOST_REPEATS = 1e8;

/** The smallest step of the page's clock, in milliseconds. */
function grain() {
  let least = Infinity;
  for (let i = 0; i < 8; i++) {
    const from = performance.now();
    let now = from;
    while (now === from) now = performance.now();
    least = Math.min(least, now - from);
  }
  return least;
}

/** The same in another order, each order as likely. @param {any[]} things */
function shuffled(things) {
  const mixed = [...things];
  for (let i = mixed.length - 1; i > 0; i--) {
    const j = Math.floor(Math.random() * (i + 1));
    [mixed[i], mixed[j]] = [mixed[j], mixed[i]];
  }
  return mixed;
}

/** Readings until two agree: a clock that slept has woken up. */
async function warm(device, program) {
  let last = 0;
  for (let i = 0; i < WARMING; i++) {
    const { ns } = await device.time(program.made, TIMES * program.repeats);
    if (Math.abs(ns / last - 1) < AGREE) return;
    last = ns;
  }
}

/** Takes as many points as a pass of the time wanted allows. */
async function fill(device, program, wanted) {
  device.rows = ROWS.fewest;
  const { ns } = await device.time(program.made, TIMES);
  if (ns * ROWS.most / ROWS.fewest < 1e6 * wanted) device.rows = ROWS.most;
}

/** Finds how often a program is repeated so that its longer pass lasts about as long as wanted; the reading of that pass. */
async function calibrate(device, program, wanted) {
  program.repeats = 1;
  for (;;) {
    const reading = await device.time(program.made, TIMES * program.repeats);
    const ns = reading.ns > 0 ? reading.ns : 1;
    if (ns === 1 && reading.wall > 1e6 * wanted) throw new Distrusted('its clock stands still');
    if (program.repeats > MOST_REPEATS) throw new Unusable('more work seems to take no more time');
    const factor = Math.min(1e6 * wanted / ns, 16);
    if (factor < 1.3) return reading;
    program.repeats = Math.ceil(program.repeats * factor);
  }
}

/** The time of a call in ns: the difference of two counts, asked for again where it is none. */
async function timeOf(device, program) {
  for (let tries = 0; tries < TRIES; tries++) {
    const found = {};
    for (const times of shuffled([1, TIMES])) found[times] = (await device.time(program.made, times * program.repeats)).ns;
    const ns = (found[TIMES] - found[1]) / ((TIMES - 1) * program.repeats * calls(program.text) * SIDE * device.rows);
    if (ns > 0 && Number.isFinite(ns)) return ns;
  }
  throw new Distrusted('more work seems to take no more time');
}

/**
 * Times of every program by round, in ns a call.
 * @param {any} device @param {{name: string, text: string, made: any}[]} programs
 * @param {{seconds: number, milliseconds: number}} limits until when since now, and how long a pass lasts at least
 * @param {(share: number) => void} told how much is done, 0 to 1
 */
async function attempt(device, programs, { seconds, milliseconds }, told) {
  const begun = performance.now();
  const left = () => 1000 * seconds - (performance.now() - begun);
  const room = left() / (1.5 * LEAST_ROUNDS * programs.length * (1 + 1 / TIMES));
  const wanted = Math.min(Math.max(milliseconds, Math.min(GRAINS * grain(), LONGEST)), Math.max(room, milliseconds / 4));
  const paces = [];
  await fill(device, programs[0], wanted);
  for (const program of programs) {
    const { ns, wall } = await calibrate(device, program, wanted);
    paces.push(ns / wall);
    if (paces.length === 1) await warm(device, program);
  }
  const pace = median(paces);
  if (pace < PACE[0] || pace > PACE[1]) throw new Distrusted(`its clock runs ${pace.toPrecision(2)} times as fast as the wall's`);
  const rounds = programs.map(() => []);
  while (rounds[0].length < LEAST_ROUNDS || (left() > 0 && rounds[0].length < MOST_ROUNDS)) {
    const before = left();
    for (const i of shuffled([...programs.keys()])) rounds[i].push(await timeOf(device, programs[i]));
    // a device that others use, too, may need shorter passes to be done in time
    if ((before - left()) * (LEAST_ROUNDS - rounds[0].length) > left()) for (const one of programs) one.repeats = Math.ceil(one.repeats / 2);
    told(Math.min(Math.max(1 - left() / (1000 * seconds), rounds[0].length / MOST_ROUNDS), 1));
    await pause(0);
  }
  return rounds;
}

/** As `attempt`; by the wall where the device's own clock says what cannot be. What was distrusted is in `why`. */
export async function measure(device, programs, limits, told) {
  try {
    return { rounds: await attempt(device, programs, limits, told), why: null };
  } catch (problem) {
    if (!(problem instanceof Distrusted)) throw problem;
    if (!device.distrust()) throw new Unusable(problem.message);
    const { rounds } = await measure(device, programs, { ...limits, seconds: limits.seconds / 2 }, told);
    return { rounds, why: problem.message };
  }
}
