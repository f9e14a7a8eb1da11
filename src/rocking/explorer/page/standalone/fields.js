// All numbers of a case as sliders with editable ends, and fields that show every digit.

import {make, one, put} from "./dom.js";
import {DATA, GRAVITY} from "./kernels.js";
import {byFrequency, isRecord, lengthOf, rateFor, writeCase} from "./case.js";
import {measured, short, typed, whole} from "../numbers.js";

/** Part of a slider that a key moves it by, and with Shift. */
const COARSE = 1 / 100, FINE = 1 / 2000;
const DEGREE = Math.PI / 180;
/** Names of motions for people. @type {Record<string, string>} */
const MOTIONS = {
  "one-sine": "one cycle of a sine", "one-cosine": "one cycle of a cosine", "half-sine": "half a sine", rectangular: "rectangle", triangular: "triangle", ricker: "Ricker pulse", sine: "several cycles of a sine",
};

/** A quantity: its text, unit, ends of the slider, and how it is read from and written to a case. @typedef {{text: string, unit: string, ends: [number, number],
 *  of: (given: any, page: any) => number, patch: (value: number, given: any, page: any) => any, when?: (given: any) => boolean}} Quantity */

/** p of the right side, which normalises frequencies. @param {any} page */
const p = (page) => page.shown.body.sides[0].p;

/** A number of the case itself. @param {string} text @param {string} unit @param {[number, number]} ends @param {string} name @param {number} [factor] of the unit @returns {Quantity} */
const simple = (text, unit, ends, name, factor = 1) => ({text, unit, ends, of: (given) => given[name] / factor, patch: (value) => ({[name]: value * factor})});

/** @type {Record<string, Quantity>} */
export const QUANTITIES = {
  width: simple("Width", "m", [0.1, 2], "width"),
  height: simple("Height", "m", [0.2, 6], "height"),
  offset: simple("Mass off the middle", "m", [-0.1, 0.1], "offset"),
  restitution: {...simple("Restitution", "", [0.5, 0.998], "restitution"), of: (given, page) => given.restitution ?? page.shown.body.sides[0].restitution},
  threshold: {text: "Threshold of rest (0: proof)", unit: "", ends: [0, 0.1], of: (given) => given.threshold ?? 0, patch: (threshold) => ({threshold: threshold > 0 ? threshold : null})},
  tilt: simple("Tilt at the start", "°", [-20, 20], "tilt", DEGREE),
  amplitude: simple("Amplitude", "g", [0, 1], "amplitude", GRAVITY),
  a: {text: "a, amplitude / uplift", unit: "", ends: [0, 5], of: (given, page) => given.amplitude / page.shown.uplift, patch: (a, given, page) => ({amplitude: a * page.shown.uplift})},
  length: {text: "Length", unit: "s", ends: [0.1, 3], of: lengthOf, patch: (length, given) => ({rate: rateFor(given, length)}), when: ({motion}) => !isRecord(motion)},
  omega: {
    text: "ω, frequency / p", unit: "", ends: [0.5, 8], when: ({motion}) => byFrequency(motion),
    of: (given, page) => (2 * Math.PI * given.rate) / p(page), patch: (omega, given, page) => ({rate: (omega * p(page)) / (2 * Math.PI)}),
  },
  cycles: {...simple("Cycles", "", [0.5, 10], "cycles"), when: ({motion}) => motion === "sine"},
};

export class Numbers {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.motion = make("select", {id: "motion", on: {change: () => this.choose(this.motion.value)}}, [
      ...Object.entries(MOTIONS).map(([value, text]) => make("option", {value}, [text])),
      ...Object.entries(/** @type {Record<string, any>} */ (DATA.records)).map(([value, {title}]) => make("option", {value}, [title])),
    ]);
    this.model = make("select", {id: "model", on: {change: () => page.change({model: this.model.value})}}, [
      make("option", {value: "nonlinear"}, ["nonlinear"]), make("option", {value: "linear"}, ["linear, for slender blocks"]),
    ]);
    this.rows = Object.entries(QUANTITIES).map(([name, quantity]) => this.row(name, quantity));
    this.derived = make("p", {class: "soft"});
    this.copied = make("span", {role: "status", class: "soft"});
    one("numbers").append(
      make("h2", {}, ["Numbers"]), make("label", {class: "choice"}, ["Motion ", this.motion]), ...this.rows.map(({element}) => element),
      make("label", {class: "choice"}, ["Equation ", this.model]), this.derived,
      make("p", {}, [
        make("button", {type: "button", on: {click: () => this.copy()}}, ["Copy link"]), " ",
        make("button", {type: "button", on: {click: () => page.change({restitution: null, threshold: null, offset: 0, tilt: 0})}}, ["Reset block"]), " ", this.copied,
      ]),
      make("details", {}, [make("summary", {}, ["About"]), make("p", {}, [
        `Computed in this browser by the kernels of rocking ${DATA.version} (${DATA.fingerprint}), compiled to WebAssembly that imports no function. In 1,000 random cases of all motions, no outcome `
        + "differed from that of the installed package. The C library of this page differs from glibc by one unit in the last place in 3 % of sines and cosines and 17 % of arc tangents. Therefore times may differ after "
        + "12 digits, the number of impacts before a proven rest may differ and, under a record of five minutes, so may times of rest. The smallest amplitude that overturns the block is searched among amplitudes 0.5 % apart, and then refined.",
      ])]),
    );
  }

  /** @param {string} name @param {Quantity} quantity */
  row(name, quantity) {
    const {text, unit} = quantity, id = `n-${name}`, row = /** @type {any} */ ({name, quantity, ends: [...quantity.ends]});
    row.slider = make("input", {type: "range", id, min: 0, max: 1, step: "any", "aria-label": text, on: {
      input: () => this.send(row, row.ends[0] + Number(row.slider.value) * (row.ends[1] - row.ends[0])),
      keydown: (/** @type {KeyboardEvent} */ event) => this.step(row, event),
    }});
    row.field = make("input", {type: "text", inputmode: "decimal", class: "value", "aria-label": `${text}${unit ? `, ${unit}` : ""}`, on: {change: () => this.read(row)}});
    row.low = make("input", {type: "text", inputmode: "decimal", class: "end", "aria-label": `${text}: left end`, on: {change: () => this.bound(row, 0, row.low)}});
    row.high = make("input", {type: "text", inputmode: "decimal", class: "end right", "aria-label": `${text}: right end`, on: {change: () => this.bound(row, 1, row.high)}});
    row.element = make("div", {class: "row"}, [make("label", {for: id}, [text]), row.field, make("span", {class: "unit"}, [unit]), row.low, row.slider, row.high]);
    return row;
  }

  /** @param {any} row @param {number} value */
  send(row, value) { this.page.stop(); this.page.change(row.quantity.patch(value, this.page.given, this.page)); }

  /** @param {any} row @param {KeyboardEvent} event */
  step(row, event) {
    const way = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1}[event.key];
    if (!way) return;
    event.preventDefault();
    this.send(row, row.quantity.of(this.page.given, this.page) + way * (row.ends[1] - row.ends[0]) * (event.shiftKey ? FINE : COARSE));
  }

  /** @param {any} row */
  read(row) {
    const {unit} = row.quantity, value = measured(typed(row.field.value), {"": 1, [unit === "°" ? "deg" : unit]: 1, ...(unit === "g" ? {"m/s2": 1 / GRAVITY, ms2: 1 / GRAVITY} : {})});
    put(row.field, {"aria-invalid": Number.isFinite(value) ? null : "true"});
    if (Number.isFinite(value)) this.send(row, value);
  }

  /** Change an end of a slider. @param {any} row @param {number} which @param {HTMLInputElement} field */
  bound(row, which, field) {
    const value = Number(typed(field.value)), right = Number.isFinite(value) && (which ? value > row.ends[0] : value < row.ends[1]);
    put(field, {"aria-invalid": right ? null : "true"});
    if (right) row.ends[which] = value;
    this.update();
  }

  /** Set the ends of a slider. @param {string} name @param {[number, number]} ends */
  limit(name, ends) {
    const row = this.rows.find((each) => each.name === name);
    if (row) row.ends = [...ends];
    this.update();
  }

  /** @param {string} motion */
  choose(motion) {
    const {given} = this.page, {amplitude} = given, length = isRecord(given.motion) ? 1 : lengthOf(given);
    const next = {...given, motion, tilt: 0, cycles: motion === "sine" ? Math.max(given.cycles, 2) : 1};
    this.page.change({...next, ...(isRecord(motion) ? {amplitude: DATA.records[motion].pga} : {amplitude: isRecord(given.motion) ? 2 * this.page.shown.uplift : amplitude, rate: rateFor(next, length)})});
  }

  async copy() {
    const address = `${location.href.split("#")[0]}#${writeCase(this.page.given)}`;
    try { await navigator.clipboard.writeText(address); this.copied.textContent = "Copied."; } catch { this.copied.textContent = "The address of this page is the link."; }
  }

  update() {
    const {given, shown} = this.page, {sides} = shown.body;
    this.motion.value = given.motion;
    this.model.value = given.model;
    for (const row of this.rows) {
      put(row.element, {hidden: row.quantity.when?.(given) === false ? "" : null});
      if (row.element.hidden) continue;
      const value = row.quantity.of(given, this.page), [low, high] = (row.ends = [Math.min(row.ends[0], value), Math.max(row.ends[1], value)]);
      row.slider.value = String((value - low) / (high - low));
      put(row.slider, {"aria-valuetext": `${short(value, 6)} ${row.quantity.unit}`});
      if (document.activeElement !== row.field) row.field.value = whole(value);
      if (document.activeElement !== row.low) row.low.value = String(Number(low.toPrecision(4)));
      if (document.activeElement !== row.high) row.high.value = String(Number(high.toPrecision(4)));
    }
    const every = sides[0].alpha === sides[1].alpha ? sides.slice(0, 1) : sides;
    this.derived.textContent = every.map((/** @type {any} */ side, /** @type {number} */ k) => `${every.length > 1 ? `${k ? "Left" : "Right"}: ` : ""}p ${short(side.p, 4)} rad/s, slenderness α ${short(side.alpha / DEGREE, 4)}°, restitution ${short(side.restitution, 4)}.`).join(" ");
  }
}
