// Measures apart from the page, which stays at hand meanwhile: opens a device, has its programs written, times them.

import { Problem, get } from '../api.js';
import { Refused, inTime, isSoftware } from './devices.js';
import { dot, shape } from './programs.js';
import { measure } from './rounds.js';
import { median, ratio, verdict } from './statistics.js';
import { open as openWebGl } from './webgl.js';
import { open as openWebGpu } from './webgpu.js';

/** Exact Phong comes first: the others are compared with it. */
const EXACT = 'phong';
const [DOT, TWIN] = ['dot', 'twin'];
/** Of the time for everything, what writing and compiling the programs may take. */
const PREPARING = 0.5;
/** Formulas that are measured however long compiling takes. */
const FEWEST = 3;

/**
 * Programs of the formulas, one for each shape of code, exact Phong first, and of its twin and the dot product.
 * @param {any} device @param {{formulas: string[], alpha: number, most: number, until: number}} wanted
 */
async function prepared(device, { formulas, alpha, most, until }) {
  const [programs, left, shapes] = [[], [], new Set()];
  const add = async (name, text) => programs.push({ name, text, made: await device.compile(text) });
  for (const name of [EXACT, ...formulas]) {
    if (programs.length >= most + 1 || (programs.length > FEWEST && performance.now() > until)) break;
    postMessage({ stage: `Compiling ${name} …` });
    try {
      const { text } = await get('/v1/shader', { formula: name, alpha, language: device.language });
      if (shapes.has(shape(text))) continue;
      await add(name, text);
      shapes.add(shape(text));
    } catch (problem) {
      const ours = problem instanceof Refused || (problem instanceof Problem && problem.status === 422);
      if (!ours || name === EXACT) throw problem;
      left.push(`${name}: ${problem.message}`);
    }
  }
  await add(TWIN, programs[0].text);
  await add(DOT, dot(device.language));
  return { programs, left };
}

/** What was measured, as numbers a call, with the ends of 99 % intervals. */
function summary(programs, rounds) {
  const exact = rounds[0];
  const cost = median(exact);
  const row = (times) => {
    const { middle, low, high } = ratio(times, exact);
    return { cost: cost * middle, low: cost * low, high: cost * high, ratio: middle, verdict: verdict({ middle, low, high }) };
  };
  const rows = programs.map(({ name }, i) => ({ formula: name, ...row(rounds[i]) }));
  const [twin, bare] = rows.splice(-2);
  Object.assign(rows[0], { low: Math.min(cost, twin.low), high: Math.max(cost, twin.high) });
  return { dot: bare, twin, rows, rounds: exact.length };
}

async function run(device, { formulas, alpha, limits }) {
  const until = performance.now() + 1000 * PREPARING * limits.seconds;
  const since = performance.now();
  const { programs, left } = await prepared(device, { formulas, alpha, most: limits.formulas, until });
  postMessage({ stage: `Measuring ${device.adapter || 'the device'} …` });
  const seconds = Math.max(limits.seconds - (performance.now() - since) / 1000, limits.seconds / 4);
  const { rounds, why } = await measure(device, programs, { ...limits, seconds }, (share) => postMessage({ share }));
  return { ...summary(programs, rounds), left, why, alpha, adapter: device.adapter, software: isSoftware(device.adapter), tool: `${device.tool}, ${device.timer}` };
}

/** The first way to a device that bears measuring. */
async function first(wanted) {
  const failed = [];
  for (const [name, open] of [['WebGPU', openWebGpu], ['WebGL 2', openWebGl]]) {
    if (wanted.only && wanted.only !== name) continue;
    let device = null;
    try {
      postMessage({ stage: `Looking for ${name} …` });
      device = await inTime(open());
      if (device) return { result: { ...await run(device, wanted), failed } };
    } catch (problem) {
      if (problem instanceof Problem) return { problem: { title: problem.title, message: problem.message, status: problem.status } };
      failed.push(`${name}: ${problem.message}`);
    } finally {
      device?.close();
    }
  }
  return { failed };
}

addEventListener('message', async ({ data }) => postMessage(await first(data)));
