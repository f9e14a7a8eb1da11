// What happens in a case: its response, how certain the outcome is, and the moments that decide it.

import {DATA, GRAVITY} from "./kernels.js";
import {bodyOf, durationOf, groundAt, samplesOf, shakingOf, startOf} from "./motions.js";

/** Relative changes of the motion, or of the tilt, whose outcomes decide whether a case is certain. */
const CHANGES = [0, -3e-6, -1.5e-6, 1.5e-6, 3e-6];
/** Points of a history. */
const POINTS = 900;
/** What is shown after the end, and before a record lifts the block, s. */
const AFTERWARDS = 0.5, BEFORE = 2;
/** Ratio of the amplitudes that are tried, and the largest one in units of that of uplift. */
const LEVEL = 1.005, MOST_UPLIFTS = 20;
/** Halvings of a search. */
const HALVINGS = 30;

/** @typedef {import("./motions.js").Case} Case */
/** @typedef {{time: number, kind: "lift" | "peak" | "balance" | "gone" | "flat" | "rest"}} Moment */

/** Simulate a case, and read what its pictures and sentences need. @param {import("./kernels.js").Kernels} kernels @param {Case} given */
export function respond(kernels, given) {
  const body = bodyOf(given, kernels.exports), shaking = shakingOf(given), start = startOf(given);
  const response = kernels.march(body, shaking, start, true);
  const falls = CHANGES.map((change) => (change === 0 ? response : kernels.march(
    body, {...shaking, factor: shaking.factor * (1 + change)}, start && {...start, u: start.u * (1 + change)},
  )).overturned);
  const {overturned, end} = response, duration = durationOf(shaking.pieces);
  const [from, until] = windowOf(given, shaking, response, duration), times = Float64Array.from({length: POINTS}, (_, k) => from + ((until - from) * k) / (POINTS - 1));
  const traced = kernels.trace(body, shaking, response, times), isRecord = given.motion in DATA.records && shaking.pieces;
  const ground = isRecord ? samplesOf(shaking, from, until) : {times, ...groundAt(shaking, times)}, displacement = ground.displacement ?? new Float64Array(POINTS);
  const flat = overturned ? (response.events[response.events.length - 1].side * Math.PI) / 2 : 0, isOver = (/** @type {number} */ time) => overturned && time >= end;
  const rotation = times.map((time, k) => (isOver(time) ? flat : traced[3 * k])), velocity = times.map((time, k) => (isOver(time) ? 0 : traced[3 * k + 1]));
  const picture = {times, rotation, velocity, displacement, ground, from, until};
  return {given, body, shaking, start, ...response, falling: falls.filter(Boolean).length, runs: falls.length, picture, moments: momentsOf(kernels, body, shaking, response, picture)};
}

/** The part that is shown: of a record that in which the block moves, or the strongest. @param {Case} given @param {import("./kernels.js").Shaking} shaking @param {any} response @param {number} duration */
function windowOf({motion, tilt}, {pieces}, {overturned, uplifts, end, firstUplift, lastRest}, duration) {
  if (!(motion in DATA.records) || !pieces) return [0, overturned ? end + AFTERWARDS : Math.max(duration, lastRest + AFTERWARDS, tilt ? end : 0)];
  if (uplifts) return [Math.max(0, Math.floor(firstUplift - BEFORE)), overturned ? end + AFTERWARDS : lastRest + AFTERWARDS];
  let peak = 0;
  pieces.rows.forEach((row, k) => { if (Math.abs(row[0]) > Math.abs(pieces.rows[peak][0])) peak = k; });
  return [Math.max(0, pieces.breaks[peak] - 2 * BEFORE), pieces.breaks[peak] + 2 * BEFORE];
}

/** @typedef {ReturnType<typeof respond>} Shown */

/** State at one moment. @param {import("./kernels.js").Kernels} kernels @param {any} body @param {any} shaking @param {any} response @param {number} time */
function stateAt(kernels, body, shaking, response, time) {
  const [rotation, velocity] = kernels.trace(body, shaking, response, [time]);
  return stateOf(rotation, velocity);
}

/** Side, rotation and velocity in its frame. @param {number} rotation @param {number} velocity */
function stateOf(rotation, velocity) {
  const sign = rotation < 0 || (rotation === 0 && velocity < 0) ? -1 : 1;
  return {side: sign > 0 ? 0 : 1, u: sign * rotation, v: sign * velocity};
}

/** The last number in [low, high] for which something holds at low and not at high. @param {number} low @param {number} high @param {(at: number) => boolean} holds */
function last(low, high, holds) {
  for (let k = 0; k < HALVINGS; k += 1) {
    const middle = (low + high) / 2;
    if (holds(middle)) low = middle; else high = middle;
  }
  return low;
}

/** The moments that decide, in order of time. @param {import("./kernels.js").Kernels} kernels @param {any} body @param {any} shaking
 * @param {ReturnType<import("./kernels.js").Kernels["march"]>} response @param {any} picture @returns {Moment[]} */
function momentsOf(kernels, body, shaking, response, picture) {
  /** @type {Moment[]} */
  const moments = [], {times, rotation} = picture, {UPLIFT, REST} = DATA.events, lifted = response.events.find(({kind}) => kind === UPLIFT);
  if (lifted && lifted.time > 0) moments.push({time: lifted.time, kind: "lift"});
  const rest = response.events.findLast(({kind}) => kind === REST);
  if (rest) moments.push({time: rest.time, kind: "rest"});
  if (!response.overturned) {
    if (response.peak > 0) moments.push({time: response.peakTime, kind: "peak"});
    return moments.sort((one, other) => one.time - other.time);
  }
  const side = rotation[rotation.length - 1] > 0 ? 0 : 1, {alpha} = body.sides[side];
  const beyond = times.findLastIndex((/** @type {number} */ _, /** @type {number} */ k) => (side ? -rotation[k] : rotation[k]) < alpha);
  const inside = (/** @type {number} */ at) => { const state = stateAt(kernels, body, shaking, response, at); return state.side !== side || state.u < alpha; };
  if (beyond >= 0 && beyond + 1 < times.length) moments.push({time: last(times[beyond], times[beyond + 1], inside), kind: "balance"});
  const gone = noReturn(kernels, body, shaking, response, picture);
  if (gone > 0) moments.push({time: gone, kind: "gone"});
  moments.push({time: response.end, kind: "flat"});
  return moments.sort((one, other) => one.time - other.time);
}

/** Whether a block falls on ground that stops: its energy suffices to pass over a balance, now or after impacts.
 * @param {import("./kernels.js").Body} body @param {import("./kernels.js").Start} start @param {any} libm */
function fallsAlone({sides, model}, {side, u, v}, libm) {
  const energies = sides.map(({p, alpha}) => (/** @type {number} */ turned) => p * p * (model === "linear" ? turned * (alpha - turned / 2) : 2 * libm.sin(turned / 2) * libm.sin(alpha - turned / 2)));
  const barriers = sides.map(({alpha}, k) => energies[k](alpha));
  let energy = energies[side](u) + (v * v) / 2, now = side;
  if (u >= sides[side].alpha && (v >= 0 || energy < barriers[side])) return true;
  for (let outward = v >= 0; energy > Math.min(...barriers); outward = true) {
    if (outward && energy > barriers[now]) return true;
    energy *= sides[now].restitution * sides[now].restitution;
    now = 1 - now;
  }
  return false;
}

/** The last moment at which the block would not have fallen, if the ground had stopped then; 0 if there is none.
 * @param {import("./kernels.js").Kernels} kernels @param {any} body @param {any} shaking @param {any} response @param {any} picture */
function noReturn(kernels, body, shaking, response, {times, rotation, velocity}) {
  if (!shaking.pieces) return 0;
  const k = times.findLastIndex((/** @type {number} */ time, /** @type {number} */ at) => time < response.end && !fallsAlone(body, stateOf(rotation[at], velocity[at]), kernels.exports));
  return k < 0 ? 0 : last(times[k], Math.min(times[k + 1], response.end), (time) => !fallsAlone(body, stateAt(kernels, body, shaking, response, time), kernels.exports));
}

/** Smallest amplitude that overturns the block, m/s², among levels of half a per cent and that of the case, up to 20 times
 * that of uplift; null without one. It is then refined. @param {import("./kernels.js").Kernels} kernels @param {Case} given */
export function criticalOf(kernels, given) {
  const body = bodyOf(given, kernels.exports), {pieces, factor} = shakingOf(given);
  if (!pieces) return null;
  const stands = (/** @type {number} */ amplitude) => !kernels.march(body, {pieces, factor: (factor * amplitude) / given.amplitude}).overturned;
  const low = upliftOf(body, kernels.exports), high = MOST_UPLIFTS * low, falls = !stands(given.amplitude);
  for (let before = low, level = low * LEVEL; before < high; before = level, level *= LEVEL) {
    const isOwn = falls && given.amplitude > before && given.amplitude <= level;
    if (isOwn || !stands(level)) return last(before, isOwn ? given.amplitude : level, stands);
  }
  return null;
}

/** Smallest acceleration that lifts a block, m/s². @param {import("./kernels.js").Body} body @param {any} libm */
export const upliftOf = ({sides, model}, libm) => GRAVITY * Math.min(...sides.map(({alpha}) => (model === "linear" ? alpha : libm.tan(alpha))));
