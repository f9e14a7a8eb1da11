// Units in which the page shows lengths, angles and accelerations: chosen once, and part of the address.

import {make, one} from "./standalone/dom.js";
import {NONE, joined, short, span} from "./numbers.js";
import {phrase} from "./texts.js";

/** Standard gravity, m/s². */
const G = 9.80665;
/** Size of an SI unit in each unit, and how the page writes the unit and its rate. @type {Record<string, [number, string, string]>} */
const KNOWN = {
  m: [1, "m", "m/s"], cm: [100, "cm", "cm/s"], ft: [1 / 0.3048, "ft", "ft/s"], in: [1 / 0.0254, "in", "in/s"],
  deg: [180 / Math.PI, "°", ""], rad: [1, " rad", ""], g: [1 / G, "g", ""], "m/s2": [1, "m/s²", ""],
};
/** @type {Record<string, string>} */
const KINDS = {length: "length_in", position: "length_in", angle: "angle_in", acceleration: "acceleration_in", "acceleration at a period": "acceleration_in"};
const LABELS = {length_in: "Lengths in", angle_in: "Angles in", acceleration_in: "Accelerations in"};

/** Chosen units by name. @type {Record<string, string>} */
const chosen = {};
/** @type {Record<string, string[]>} */
let offered = {};

/** @param {Record<string, string[]>} choices the default of each first @param {URLSearchParams} given */
export function readUnits(choices, given) {
  offered = choices;
  for (const [name, units] of Object.entries(choices)) chosen[name] = units.find((each) => each === given.get(name)) ?? units[0];
}

/** Units that are not the default, for the address. @returns {[string, string][]} */
export const unitsChosen = () => Object.entries(chosen).filter(([name, unit]) => unit !== offered[name][0]);

/** A parameter as its field shows it, in the chosen unit. @param {any} spec */
export function inUnits(spec) {
  const name = KINDS[spec.kind ?? ""], unit = name && chosen[name], scale = unit && spec.units[unit.replace("/", "")];
  if (!unit || !scale || unit === offered[name][0]) return spec;
  const units = Object.fromEntries(Object.entries(spec.units).map(([each, size]) => [each, Number(size) / scale]));
  return {...spec, own: spec, units, unit: KNOWN[unit][1].trim(), suffix: unit, low: spec.low / scale, high: spec.high / scale};
}

/** @param {string} name @param {1 | 2} [which] @returns {(value: number | null, digits?: number) => string} */
const writer = (name, which = 1) => (value, digits = 3) => {
  const [scale] = KNOWN[chosen[name]], unit = KNOWN[chosen[name]][which];
  return value === null || !Number.isFinite(value) ? NONE : joined(short(value * scale, digits), unit);
};
/** Quantities in m/s², rad, m and m/s as the page writes them. */
export const acceleration = writer("acceleration_in"), angle = writer("angle_in"), length = writer("length_in"), velocity = writer("length_in", 2);
/** @param {number} value in g @param {number} [digits] */
export const ofG = (value, digits) => acceleration(value * G, digits);

/** Units of axes as the server names them: what chooses the page's, and their sizes in SI units. @type {Record<string, [string, number]>} */
const OF_AXES = {"°": ["angle_in", Math.PI / 180], rad: ["angle_in", 1], g: ["acceleration_in", G], "m/s^2": ["acceleration_in", 1], "m/s": ["length_in", 1]};
/** Size of an axis's unit in the chosen unit, and how the page writes that. @param {string} [unit] @returns {[number, string]} */
export function axisUnit(unit = "") {
  const [name, size] = OF_AXES[unit] ?? [];
  if (!name || !size) return [1, unit];
  const [scale, plain, rate] = KNOWN[chosen[name]], text = (name === "length_in" ? rate : plain).trim();
  return text === unit ? [1, unit] : [Number((size * scale).toPrecision(15)), text];
}
/** A field's text, with the chosen unit of accelerations if it is a bare number. @param {string} text */
export const withUnit = (text) => (text && !Number.isNaN(Number(text)) ? `${Number(text)}${chosen.acceleration_in}` : text);

/** Fields that choose the units; a choice loads the page again. @param {() => void} write writes the address */
export function unitFields(write) {
  one("units-form").replaceChildren(...Object.entries(offered).map(([name, units]) => {
    const select = make("select", {id: name, on: {change: () => { chosen[name] = select.value; write(); location.reload(); }}},
      units.map((each) => make("option", {value: each, selected: each === chosen[name] || null}, [KNOWN[each][1].trim()])));
    return make("label", {class: "choice"}, [make("span", {}, [LABELS[/** @type {keyof typeof LABELS} */ (name)]]), select]);
  }));
}

/** Name of a case. @param {any} header */
export const caseName = ({block: {sides: [{p, alpha}]}, motion}) => `p = ${short(p)} rad/s, α = ${angle(alpha)}, ${motion ? `${motion.name} ${ofG(motion.pga_g)}` : "no ground motion"}`;

/** Name of a scheme that ends chattering, with its limit. @param {string} text as the address has it */
export function treatmentName(text) {
  const [kind, limit] = text.split("="), name = phrase(`treatment.${kind}`);
  if (limit === undefined || kind === "certified" || kind === "time") return name;
  return `${name}, ${kind === "interval" ? span(Number(limit)) : `${short(Number(limit))} pα`}`;
}
