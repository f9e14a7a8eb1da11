// A case as the address has it, in the terms of the command line, and the limits of its numbers.

import {DATA} from "./kernels.js";
import {whole} from "../numbers.js";

/** @typedef {import("./motions.js").Case} Case */

/** The case of an empty address: its pulse nearly topples the block. */
export const FIRST = "width=0.4&height=1.6&motion=one-sine:amplitude=3.01,frequency=1";

/** Smallest and largest number of each quantity. @type {Record<string, [number, number]>} */
export const LIMITS = {width: [0.02, 50], height: [0.02, 50], restitution: [0.05, 1], amplitude: [0.01, 100], rate: [0.02, 50], cycles: [0.5, 20], threshold: [1e-9, 0.5], tilt: [-1.4, 1.4]};
/** Largest ratio of width and height, beyond which no rigid block continues to rock. */
const STOCKIEST = 1.25;

/** Bring all numbers of a case into their limits. @param {Case} given @returns {Case} */
export function limited(given) {
  const made = /** @type {any} */ ({...given});
  for (const [name, [low, high]] of Object.entries(LIMITS)) if (made[name] !== null) made[name] = Math.min(Math.max(made[name], low), high);
  made.width = Math.min(made.width, STOCKIEST * made.height);
  made.offset = Math.min(Math.max(made.offset, -made.width / 4), made.width / 4);
  made.cycles = Math.round(2 * made.cycles) / 2;
  return made;
}

/** @param {string} motion */
export const isRecord = (motion) => motion in DATA.records;
/** Whether a motion is described by its frequency; others by their duration. @param {string} motion */
export const byFrequency = (motion) => motion === "sine" || DATA.pulses[motion]?.by === "frequency";

/** Length of a pulse, s, and the rate that it has for a length. @param {Case} given */
export function lengthOf({motion, rate, cycles}) {
  if (motion === "sine") return cycles / rate;
  const {breaks, by} = DATA.pulses[motion], length = breaks[breaks.length - 1];
  return by === "frequency" ? length / rate : length * rate;
}
/** @param {Case} given @param {number} length */
export const rateFor = (given, length) => (byFrequency(given.motion) ? (lengthOf({...given, rate: 1})) / length : length / lengthOf({...given, rate: 1}));

/** @param {Case} given */
export function writeCase(given) {
  const fields = {width: whole(given.width), height: whole(given.height)};
  if (given.offset) Object.assign(fields, {offset: whole(given.offset)});
  if (given.restitution !== null) Object.assign(fields, {restitution: whole(given.restitution)});
  const {motion} = given, rate = `${byFrequency(motion) ? "frequency" : "duration"}=${whole(given.rate)}`;
  const parameters = [`amplitude=${whole(given.amplitude)}`, rate, ...(motion === "sine" ? [`cycles=${given.cycles}`] : [])];
  Object.assign(fields, {motion: isRecord(motion) ? motion : `${motion}:${parameters.join(",")}`});
  if (isRecord(motion)) Object.assign(fields, {pga: whole(given.amplitude)});
  if (given.tilt) Object.assign(fields, {initial_rotation: whole(given.tilt)});
  if (given.threshold !== null) Object.assign(fields, {chattering: `velocity=${whole(given.threshold)}`});
  if (given.model !== "nonlinear") Object.assign(fields, {model: given.model});
  return Object.entries(fields).map(([name, value]) => `${name}=${value}`).join("&");
}

/** Read a case; what the address lacks or misspells is that of the first case. @param {string} text @returns {Case} */
export function readCase(text) {
  const fields = new URLSearchParams(text), first = new URLSearchParams(FIRST);
  const number = (/** @type {string | null | undefined} */ given, /** @type {number} */ otherwise) => (given && Number.isFinite(Number(given)) ? Number(given) : otherwise);
  const size = (/** @type {string} */ name) => number(fields.get(name), Number(first.get(name)));
  const [named, list = ""] = (fields.get("motion") ?? first.get("motion") ?? "").split(":");
  const known = isRecord(named) || named === "sine" || named in DATA.pulses, motion = known ? named : "one-sine";
  const parameters = new Map(list.split(",").map((each) => /** @type {[string, string]} */ (each.split("="))));
  const [scheme, limit] = (fields.get("chattering") ?? "").split("=");
  const amplitude = isRecord(motion) ? number(fields.get("pga"), DATA.records[motion].pga) : number(parameters.get("amplitude"), 3.01);
  return limited({
    width: size("width"), height: size("height"), offset: number(fields.get("offset"), 0), restitution: fields.has("restitution") ? number(fields.get("restitution"), 0.9) : null,
    model: fields.get("model") === "linear" ? "linear" : "nonlinear", motion, amplitude, cycles: number(parameters.get("cycles"), 1),
    threshold: scheme === "velocity" ? number(limit, 0.01) : null, rate: number(parameters.get(byFrequency(motion) ? "frequency" : "duration"), 1), tilt: number(fields.get("initial_rotation"), 0),
  });
}
