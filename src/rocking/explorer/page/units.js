// Units in which the page shows lengths, angles and accelerations: chosen once, and part of the address.

import {make, one} from "./words.js";
import {NONE, joined, short, span} from "./numbers.js";
import {measures, phrase} from "./texts.js";

/** Standard gravity, m/s²: what a g is, whatever gravity a block has. */
export const G = 9.80665;
/** What one SI unit is in each unit, and how the page writes that. @type {Record<string, [number, string, string]>} */
const KNOWN = {
  m: [1, "m", "m/s"], cm: [100, "cm", "cm/s"], ft: [1 / 0.3048, "ft", "ft/s"], in: [1 / 0.0254, "in", "in/s"],
  deg: [180 / Math.PI, "°", ""], rad: [1, " rad", ""], g: [1 / G, "g", ""], "m/s2": [1, "m/s²", ""],
};
const KINDS = /** @type {Record<string, string>} */ ({
  length: "length_in", position: "length_in", angle: "angle_in", acceleration: "acceleration_in", "acceleration at a period": "acceleration_in",
});

/** Chosen units by name. @type {Record<string, string>} */
const chosen = {};
/** Units by name, the default of each first. @type {Record<string, string[]>} */
let offered = {};

/** Read the units of the address. @param {Record<string, string[]>} choices @param {URLSearchParams} given */
export function readUnits(choices, given) {
  offered = choices;
  for (const [name, units] of Object.entries(choices)) chosen[name] = units.find((each) => each === given.get(name)) ?? units[0];
}

/** What the address says of the units: nothing of those that are the default. @returns {[string, string][]} */
export const unitsChosen = () => Object.entries(chosen).filter(([name, unit]) => unit !== offered[name][0]);

/** A parameter as a field shows it, in the chosen unit. @template {{kind?: string, unit: string, suffix: string, units: Record<string, number>, low: number, high: number}} P
 * @param {P} spec @returns {P} */
export function inUnits(spec) {
  const name = KINDS[spec.kind ?? ""];
  const unit = name && chosen[name];
  const scale = unit && spec.units[unit.replace("/", "")];
  if (!unit || !scale || unit === offered[name][0]) return spec;
  const units = Object.fromEntries(Object.entries(spec.units).map(([each, size]) => [each, size / scale]));
  return {...spec, own: spec, units, unit: KNOWN[unit][1].trim(), suffix: unit, low: spec.low / scale, high: spec.high / scale};
}

/** @param {string} name @param {number | null} value in SI units @param {number} [digits] @param {1 | 2} [which] */
function written(name, value, digits = 3, which = 1) {
  const [scale] = KNOWN[chosen[name]], unit = KNOWN[chosen[name]][which];
  if (value === null || !Number.isFinite(value)) return NONE;
  return joined(short(value * scale, digits), unit);
}

/** @param {number | null} value in m/s² @param {number} [digits] */
export const acceleration = (value, digits) => written("acceleration_in", value, digits);
/** @param {number} value in g @param {number} [digits] */
export const ofG = (value, digits) => acceleration(value * G, digits);
/** @param {number} value in rad @param {number} [digits] */
export const angle = (value, digits) => written("angle_in", value, digits);
/** @param {number} value in m @param {number} [digits] */
export const length = (value, digits) => written("length_in", value, digits);
Object.assign(measures, {acceleration, angle, length});
/** @param {number | null} value in m/s @param {number} [digits] */
export const velocity = (value, digits) => written("length_in", value, digits, 2);
/** An acceleration as the axis of a figure has it: what one m/s² is, and the unit. @returns {[number, string]} */
export const accelerationAxis = () => [KNOWN[chosen.acceleration_in][0], KNOWN[chosen.acceleration_in][1]];
/** The same of one g. @returns {[number, string]} */
export const gAxis = () => [Number((G * KNOWN[chosen.acceleration_in][0]).toPrecision(15)), KNOWN[chosen.acceleration_in][1]];
/** An angle likewise: what one rad is, and the unit. @returns {[number, string]} */
export const angleAxis = () => [KNOWN[chosen.angle_in][0], KNOWN[chosen.angle_in][1].trim()];
/** Units of axes as the server names them: what chooses the page's, and what one is in SI units. @type {Record<string, [string, number]>} */
const OF_AXES = {"°": ["angle_in", Math.PI / 180], rad: ["angle_in", 1], g: ["acceleration_in", G], "m/s^2": ["acceleration_in", 1], "m/s": ["length_in", 1]};
/** What one of an axis's unit is in the unit that is chosen, and how the page writes that. @param {string} [unit] @returns {[number, string]} */
export function axisUnit(unit = "") {
  const [name, size] = OF_AXES[unit] ?? [];
  if (!name || !size) return [1, unit];
  const [scale, plain, rate] = KNOWN[chosen[name]], written_ = (name === "length_in" ? rate : plain).trim();
  return written_ === unit ? [1, unit] : [Number((size * scale).toPrecision(15)), written_];
}
/** A field's text, with the chosen unit where it is a bare number. @param {string} text */
export const withUnit = (text) => (text && !Number.isNaN(Number(text)) ? `${Number(text)}${chosen.acceleration_in}` : text);

/** Fields that choose the units; another choice loads the page again, so that all of it is in them. @param {(name: string) => void} write
 * writes the address, and is told which was chosen */
export function unitFields(write) {
  one("units-form").replaceChildren(...Object.entries(offered).map(([name, units]) => {
    const options = units.map((each) => make("option", {value: each, selected: each === chosen[name]}, [KNOWN[each][1].trim()]));
    const select = /** @type {HTMLSelectElement} */ (make("select", {id: name, on: {change: () => { chosen[name] = select.value; write(name); }}}, options));
    return make("label", {className: "field"}, [`${phrase(`units.${name}`)} `, select]);
  }));
}

/** What a case is called, from what the server says of it. @param {any} header */
export function caseName({block: {sides: [{p, alpha}]}, motion}) {
  return phrase("case.name", {p: short(p), alpha: angle(alpha), motion: motion ? phrase("case.motion", {name: motion.name, pga: ofG(motion.pga_g)}) : phrase("case.still")});
}

/** What a treatment of chattering is called, with its limit. @param {string} text as the address has it */
export function treatmentName(text) {
  const [kind, limit] = text.split("="), name = phrase(`treatment.${kind}`), size = Number(limit);
  if (limit === undefined || kind === "certified") return name;
  if (kind === "time") return limit === "exact" ? phrase("limit.named", {name, limit: phrase("limit.exact")}) : name;
  return phrase("limit.named", {name, limit: kind === "interval" ? span(size) : phrase("limit.over", {limit: short(size)})});
}
