// What both ways to a GPU share.

/** The device cannot be measured this way, or not any more: another way may be tried. */
export class Unusable extends Error {}

/** A program that the device does not take. */
export class Refused extends Error {}

/** The device's own clock says what cannot be. */
export class Distrusted extends Error {}

/** Milliseconds that a device may take for one reading. */
const PATIENCE = 10_000;

/** A promise, or Unusable once it has taken too long. @param {Promise<any>} promise */
export function inTime(promise) {
  let timer;
  const late = new Promise((_, failed) => { timer = setTimeout(() => failed(new Unusable('it does not answer')), PATIENCE); });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/** Resolves after some milliseconds. @param {number} milliseconds */
export const pause = (milliseconds) => new Promise((done) => { setTimeout(done, milliseconds); });

/** Whether an adapter of this name is a program on the processor, and no GPU. @param {string} name */
export const isSoftware = (name) => /swiftshader|llvmpipe|lavapipe|softpipe|basic render|software/i.test(name);
