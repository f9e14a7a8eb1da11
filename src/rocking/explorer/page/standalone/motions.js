// Bodies and ground motions of a case, as the kernels accept them.

import {DATA, GRAVITY} from "./kernels.js";

/** A case: sizes in m, amplitude in m/s², rate in Hz or s, tilt in rad. @typedef {{width: number, height: number, offset: number,
 *  restitution: number | null, model: string, threshold: number | null, motion: string, amplitude: number, rate: number, cycles: number, tilt: number}} Case */

/** Both sides of a rectangular block whose centre of mass may be off its middle. @param {Case} given @param {any} libm
 * @returns {import("./kernels.js").Body} */
export function bodyOf({width, height, offset, restitution, model, threshold}, libm) {
  const b = width / 2, h = height / 2, s = offset, arms = [b - s, b + s], radii = arms.map((arm) => libm.hypot(arm, h));
  const gyration = (b * b + h * h) / 3 - s * s, inertias = radii.map((radius) => gyration + radius * radius), numerator = gyration + h * h - arms[0] * arms[1];
  const sides = arms.map((arm, k) => {
    const alpha = libm.atan2(arm, h), sine = libm.sin(alpha); // without an offset as in Block: the last digits are the same
    const p = Math.sqrt(s === 0 ? (0.75 * GRAVITY) / radii[k] : (GRAVITY * radii[k]) / inertias[k]);
    return {p, alpha, restitution: restitution ?? (s === 0 ? 1 - 1.5 * (sine * sine) : numerator / inertias[1 - k])};
  });
  return {sides, model, threshold};
}

/** Pieces by the text of their motion: those of the last ones. @type {Map<string, any>} */
const made = new Map();

/** Pieces of a motion of unit amplitude, or of a record. @param {Case} given @returns {import("./kernels.js").Pieces | null} */
export function piecesOf({motion, rate, cycles}) {
  if (motion === "still") return null;
  const key = `${motion} ${motion in DATA.records ? "" : `${rate} ${cycles}`}`;
  if (!made.has(key)) {
    if (made.size > 20) made.delete([...made.keys()][0]);
    made.set(key, motion in DATA.records ? record(DATA.records[motion]) : pulse(motion, rate, cycles));
  }
  return made.get(key);
}

/** @param {string} name @param {number} rate @param {number} cycles */
function pulse(name, rate, cycles) {
  const unit = DATA.pulses[name === "sine" ? "one-sine" : name], speed = unit.by === "frequency" ? rate : 1 / rate;
  let {breaks, rows} = unit;
  if (name === "sine") { // the pieces of one cycle, as often as it is repeated
    const pieces = rows, count = pieces.length * cycles;
    breaks = Array.from({length: count + 1}, (_, k) => k / pieces.length);
    rows = Array.from({length: count}, (_, k) => pieces[k % pieces.length]);
  }
  const powers = [1]; // the operator of powers differs between browsers
  while (powers.length < rows[0].length) powers.push(powers[powers.length - 1] * speed);
  return {
    breaks: breaks.map((/** @type {number} */ time) => time / speed), error: unit.error,
    rows: rows.map((/** @type {number[]} */ row) => row.map((each, k) => each * powers[k])),
  };
}

/** Sums of sums, or of numbers. @param {number[]} differences */
function summed(differences) {
  let sum = 0;
  return differences.map((each) => (sum += each));
}

/** @param {any} given */
function record({step, differences, denominator, multiplier, divisor}) {
  const samples = summed(summed(differences)).map((each) => ((each / denominator) * multiplier) / divisor), breaks = samples.map((_, k) => k * step);
  return {breaks, error: 0, rows: samples.slice(1).map((each, k) => [samples[k], (each - samples[k]) / (breaks[k + 1] - breaks[k])])};
}

/** Ground motion of a case. @param {Case} given @returns {import("./kernels.js").Shaking} */
export function shakingOf(given) {
  const pieces = given.tilt ? null : piecesOf(given);
  return {pieces, factor: given.motion in DATA.records ? given.amplitude / DATA.records[given.motion].pga : given.amplitude};
}

/** State at the start, if the block is tilted. @param {Case} given */
export const startOf = ({tilt}) => (tilt ? {side: tilt > 0 ? 0 : 1, u: Math.abs(tilt), v: 0} : null);

/** Duration of a motion, s. @param {import("./kernels.js").Pieces | null} pieces */
export const durationOf = (pieces) => (pieces ? pieces.breaks[pieces.breaks.length - 1] : 0);

/** Acceleration (m/s²), velocity and displacement of the ground at increasing times, from its polynomials.
 * @param {import("./kernels.js").Shaking} shaking @param {ArrayLike<number>} times */
export function groundAt({pieces, factor}, times) {
  const out = {acceleration: new Float64Array(times.length), displacement: new Float64Array(times.length)};
  if (!pieces) return out;
  const {breaks, rows} = pieces;
  let row = 0, velocity = 0, place = 0;
  for (let k = 0; k < times.length; k += 1) {
    while (row < rows.length && times[k] >= breaks[row + 1]) {
      const ends = integrals(rows[row], breaks[row + 1] - breaks[row]);
      place += velocity * (breaks[row + 1] - breaks[row]) + ends[2];
      velocity += ends[1];
      row += 1;
    }
    const after = times[k] - breaks[row], [a, , d] = row < rows.length ? integrals(rows[row], after) : [0, 0, 0];
    out.acceleration[k] = factor * a;
    out.displacement[k] = factor * (place + velocity * after + d);
  }
  return out;
}

/** Samples of a record within a window: all of them, so that no peak is missed. Its displacement is drawn otherwise.
 * @param {import("./kernels.js").Shaking} shaking @param {number} from @param {number} until @returns {{times: Float64Array, acceleration: Float64Array, displacement?: undefined}} */
export function samplesOf({pieces, factor}, from, until) {
  const {breaks, rows} = pieces ?? {breaks: [0, 1], rows: []}, first = Math.ceil(from / breaks[1] - 1e-9), end = Math.min(until, breaks[breaks.length - 1]);
  const times = Float64Array.from({length: Math.floor(end / breaks[1] + 1e-9) - first + 1}, (_, k) => breaks[first + k]);
  return {times, acceleration: times.map((_, k) => factor * (rows[first + k]?.[0] ?? 0))};
}

/** A polynomial and its first two integrals from 0. @param {ArrayLike<number>} row @param {number} t */
function integrals(row, t) {
  let a = 0, v = 0, d = 0;
  for (let k = row.length - 1; k >= 0; k -= 1) {
    a = a * t + row[k];
    v = v * t + row[k] / (k + 1);
    d = d * t + row[k] / ((k + 1) * (k + 2));
  }
  return [a, v * t, d * t * t];
}
