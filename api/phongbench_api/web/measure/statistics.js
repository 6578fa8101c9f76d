// Medians and sign-test intervals of a few rounds, as phongbench/timing/statistics.py has them; a test compares the two.

/** Confidence of every interval. */
export const LEVEL = 0.99;
/** From how many rounds on the sign test reaches it. */
export const LEAST_ROUNDS = 8;
/** A difference smaller than this is never claimed. */
export const CLAIM = 0.02;

const ascending = (values) => [...values].sort((a, b) => a - b);

/** @param {number[]} values */
export function median(values) {
  const ordered = ascending(values);
  const half = ordered.length >> 1;
  return ordered.length % 2 ? ordered[half] : (ordered[half - 1] + ordered[half]) / 2;
}

/** The largest k whose k-th smallest and k-th largest of `count` values enclose the median so surely; 0: none. @param {number} count */
export function signTestRank(count, level = LEVEL) {
  let [k, below, binomial] = [0, 1, 1];
  while (k < count && 2 * below <= (1 - level) * 2 ** count) {
    binomial = binomial * (count - k) / (k + 1);
    k += 1;
    below += binomial;
  }
  return k;
}

/**
 * Time over the baseline's, paired by round, since rounds are slow together: its median and the ends of its interval.
 * @param {number[]} times @param {number[]} baseline of the same rounds, all above 0
 */
export function ratio(times, baseline) {
  const logs = ascending(times.map((time, i) => Math.log(time / baseline[i])));
  const k = signTestRank(logs.length);
  const [low, high] = k ? [logs[k - 1], logs[logs.length - k]] : [-Infinity, Infinity];
  return { middle: Math.exp(median(logs)), low: Math.exp(low), high: Math.exp(high) };
}

/** faster, slower or unresolved. @param {{middle: number, low: number, high: number}} one */
export function verdict(one) {
  if (one.high < 1 && one.middle <= 1 - CLAIM) return 'faster';
  return one.low > 1 && one.middle >= 1 + CLAIM ? 'slower' : 'unresolved';
}
