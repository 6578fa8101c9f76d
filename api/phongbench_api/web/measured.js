// Devices that were measured in this page. The service keeps nothing of them, so questions about one carry it along.

import { get } from './api.js';

/** Measurements by the name of their target. @type {Map<string, any>} */
const held = new Map();

/** Answers questions about this target from now on. @param {any} measurement as `phongbench targets add` reads it */
export const hold = (measurement) => held.set(measurement.target, measurement);

/** What the service answers about a target, of its own or measured here. @param {string} path @param {Record<string, any>} params @param {AbortSignal} [signal] */
export function ask(path, params, signal) {
  const measurement = held.get(params.target);
  return measurement ? get(path, { ...params, target: null }, signal, measurement) : get(path, params, signal);
}
