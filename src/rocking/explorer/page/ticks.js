// Numbers at the ticks of an axis, as people write them: 0.003, and powers of ten only where zeros would fill the axis.

import {fixed, power} from "./numbers.js";

/** Exponents beyond which a power of ten is written. */
const SMALLEST = -5, LARGEST = 6;

/** Decimals that tell these numbers apart and write each as it is. @param {ArrayLike<number>} values */
function digitsOf(values) {
  const all = Array.from(values), size = all.reduce((most, each) => Math.max(most, Math.abs(each)), 0);
  const step = all.reduce((least, each, k) => (k ? Math.min(least, Math.abs(each - all[k - 1])) : least), Infinity);
  const close = 1e-4 * (Number.isFinite(step) && step > 0 ? step : size);
  let count = 0;
  while (count < 15 && all.some((each) => Math.abs(Number(each.toFixed(count)) - each) > close)) count += 1;
  return count;
}

/** Texts of the ticks of one axis, all with the same decimals. @param {ArrayLike<number>} values @returns {string[]} */
export function written(values) {
  const all = Array.from(values), size = all.reduce((most, each) => Math.max(most, Math.abs(each)), 0);
  const exponent = size > 0 ? Math.floor(Math.log10(size) + 1e-9) : 0;
  const raised = exponent < SMALLEST || exponent >= LARGEST;
  const scaled = raised ? all.map((each) => Number((each / 10 ** exponent).toPrecision(12))) : all;
  const count = digitsOf(scaled);
  return scaled.map((each) => {
    const text = fixed(each, count);
    return Number(each.toFixed(count)) === 0 ? "0" : raised ? `${text}${power(exponent)}` : text;
  });
}

/** Let a formatter of the plotting library write so. @template T @param {T} formatter @returns {T} */
export function plain(formatter) {
  /** @type {any} */ (formatter).doFormat = written;
  return formatter;
}
