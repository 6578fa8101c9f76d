// The served curves as tables that a pixel can look up. No highlight is computed here: only read between two angles.

const ENTRIES = 4096;
/** The coordinate of 90 degrees; see `coordinate`. */
const END = Math.sqrt(Math.SQRT1_2);

/**
 * The fourth root of (1 - cos) / 2, which is the root of the half angle's sine: entries lie dense near the peak, where a
 * tight lobe changes within a degree, and a pixel needs no arc cosine. @param {number} cosine
 */
const coordinate = (cosine) => Math.sqrt(Math.sqrt(Math.max(0, 0.5 - 0.5 * cosine)));

/**
 * Values over angles as evenly spaced entries over `coordinate`.
 * @param {Float64Array} angles degrees, ascending from 0 @param {Float64Array} values @returns {Float32Array}
 */
export function tabulated(angles, values) {
  const table = new Float32Array(ENTRIES + 1);
  let right = 1;
  for (let i = 0; i <= ENTRIES; i++) {
    const half = (i / ENTRIES * END) ** 2;
    const angle = Math.asin(half) * 360 / Math.PI;
    while (right < angles.length - 1 && angles[right] < angle) right++;
    const share = Math.min(Math.max((angle - angles[right - 1]) / (angles[right] - angles[right - 1]), 0), 1);
    table[i] = values[right - 1] + share * (values[right] - values[right - 1]);
  }
  return table;
}

/** Where a table's entry for this cosine lies, as a fraction of entries; cosine in 0..1. @param {number} cosine */
export const place = (cosine) => Math.min(coordinate(cosine) / END, 1) * ENTRIES;

/** The entry at a place. @param {Float32Array} table @param {number} at */
export function read(table, at) {
  const left = at | 0;
  return left >= ENTRIES ? table[ENTRIES] : table[left] + (at - left) * (table[left + 1] - table[left]);
}
