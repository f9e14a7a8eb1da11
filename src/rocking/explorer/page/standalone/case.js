// A case as the address has it, in the terms of the command line, and the limits of its numbers.

import {DATA, GRAVITY} from "./kernels.js";
import {measured, whole} from "../numbers.js";

/** @typedef {import("./motions.js").Case} Case */

/** The case of an empty address: its pulse nearly topples the block. */
export const FIRST = "width=0.4&height=1.6&motion=one-sine:amplitude=3.01,frequency=1";

/** Smallest and largest number of each quantity. @type {Record<string, [number, number]>} */
export const LIMITS = {width: [0.02, 50], height: [0.02, 50], restitution: [0.05, 0.998], amplitude: [0.01, 100], rate: [0.02, 50], cycles: [0.5, 20], threshold: [1e-9, 0.5], tilt: [-1.4, 1.4]};
/** Ratios of width and height: no stockier block continues to rock, and no more slender one comes to rest within reasonable time. */
const STOCKIEST = 1.25, SLENDEREST = 0.04;

/** Bring all numbers of a case into their limits. @param {Case} given @returns {Case} */
export function limited(given) {
  const made = /** @type {any} */ ({...given});
  for (const [name, [low, high]] of Object.entries(LIMITS)) if (made[name] !== null) made[name] = Math.min(Math.max(made[name], low), high);
  made.height = Math.min(made.height, made.width / SLENDEREST);
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
  const {motion, width, height, offset, restitution, tilt, threshold, model, amplitude} = given, records = isRecord(motion);
  const parameters = [`amplitude=${whole(amplitude)}`, `${byFrequency(motion) ? "frequency" : "duration"}=${whole(given.rate)}`, ...(motion === "sine" ? [`cycles=${given.cycles}`] : [])];
  const fields = {
    width: whole(width), height: whole(height), offset: offset && whole(offset), restitution: restitution && whole(restitution),
    motion: tilt ? "none" : records ? motion : `${motion}:${parameters.join(",")}`, pga: records && !tilt && whole(amplitude),
    initial_rotation: tilt && whole(tilt), chattering: threshold && `velocity=${whole(threshold)}`, model: model !== "nonlinear" && model,
  };
  return Object.entries(fields).filter(([, value]) => value).map(([name, value]) => `${name}=${value}`).join("&");
}

/** Units of an address as the command line reads them. */
const ADDRESS_UNITS = {"": 1, m: 1, cm: 0.01, mm: 0.001, g: GRAVITY, ms2: 1, hz: 1, s: 1, ms: 0.001, rad: 1, deg: Math.PI / 180};

/** Read a case. What the address lacks is that of the first case, as is what this page cannot show: its names are `wrong`.
 * @param {string} text @returns {{given: Case, wrong: string[]}} */
export function readAddress(text) {
  const fields = new Map(new URLSearchParams(text)), first = new Map(new URLSearchParams(FIRST)), /** @type {string[]} */ wrong = [];
  const read = (/** @type {Map<string, string>} */ texts, /** @type {string} */ name, /** @type {number} */ otherwise) => {
    const given = texts.get(name), value = given === undefined ? otherwise : measured(given, ADDRESS_UNITS);
    texts.delete(name);
    if (Number.isFinite(value)) return value;
    wrong.push(name);
    return otherwise;
  };
  const take = (/** @type {string} */ name) => { const value = fields.get(name); fields.delete(name); return value; };
  const tilt = read(fields, "initial_rotation", 0), named = take("motion"), [name, list] = (named ?? first.get("motion") ?? "").split(":"), isStill = name === "none";
  const motion = isRecord(name) || name === "sine" || name in DATA.pulses ? name : "one-sine", rate = byFrequency(motion) ? "frequency" : "duration";
  if (named !== undefined && (tilt ? !isStill : motion !== name)) wrong.push("motion");
  const parameters = new Map((list ?? "").split(",").filter(Boolean).map((each) => /** @type {[string, string]} */ (each.split("="))));
  const [scheme, limit] = (take("chattering") ?? "certified").split("="), model = take("model") ?? "nonlinear";
  if (!["certified", "velocity"].includes(scheme)) wrong.push("chattering");
  if (!["linear", "nonlinear"].includes(model)) wrong.push("model");
  const made = {
    width: read(fields, "width", Number(first.get("width"))), height: read(fields, "height", Number(first.get("height"))), offset: read(fields, "offset", 0), tilt, motion,
    restitution: fields.has("restitution") ? read(fields, "restitution", 0.9) : null, model: model === "linear" ? model : "nonlinear", cycles: read(parameters, "cycles", 1),
    amplitude: isRecord(motion) ? read(fields, "pga", DATA.records[motion].pga) : read(parameters, "amplitude", 3.01), rate: read(parameters, rate, 1),
    threshold: scheme === "velocity" ? read(new Map([["chattering", limit ?? "0.01"]]), "chattering", 0.01) : null,
  }, given = limited(made);
  for (const each of /** @type {(keyof Case)[]} */ (Object.keys(given))) if (given[each] !== made[each]) wrong.push(each);
  fields.delete("ask");
  fields.delete("token");
  return {given, wrong: [...new Set([...wrong, ...fields.keys(), ...parameters.keys()].filter(Boolean))]};
}
