// What the server says about the parameters of a case, from which the forms are built; and the state of the page, as the
// address has it: whoever opens the link sees the same.

import {Problem, json} from "./api.js";
import {inUnits, readUnits, unitsChosen} from "./units.js";
import {write} from "./visits.js";
import {one} from "./words.js";
import {known, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{view: string, texts: Texts, other: Texts, compare: string, window: [number, number] | null, at: number | null, lecture: boolean, example: {name: string, step: number} | null, map: Texts, sweep: Texts, assessment: Texts, good: Good}} State */
/** What was answered last of each part of the state: it alone enters the address.
 * @typedef {{texts: Texts, other: Texts, compare: string, window: [number, number] | null, map: Texts, sweep: Texts, assessment: Texts}} Good */
/** @typedef {{name: string, label: string, group: string, kind: string, unit: string, suffix: string, default: string, units: Record<string, number>, low: number, high: number, logarithmic: boolean, step: number, values: string, explanation: string, own?: Parameter}} Parameter `own` is as the server says, where the page shows another unit */

/** @type {any} */
export const specification = await json("/api/start", {}).catch(stop);

readUnits(specification.shown_in, new URLSearchParams(location.search));
specification.parameters = specification.parameters.map(inUnits).map(named);
specification.period = named(specification.period);
for (const pulse of Object.values(specification.pulses)) pulse.parameters = pulse.parameters.map(inUnits).map(named);
for (const treatment of specification.treatments) if (treatment.limit) treatment.limit = named(treatment.limit);

/** A parameter with what the page calls it and says of it. @param {any} spec @returns {Parameter} */
function named(spec) {
  const {text} = spec;
  return {...spec, label: phrase(`field.${text}`), explanation: known(`about.${text}`) ? phrase(`about.${text}`) : ""};
}

/** Say why the page cannot open, and wait for ever: without what the server says of the parameters there is no page.
 * @param {unknown} error @returns {Promise<never>} */
function stop(error) {
  document.body.inert = false;
  if (!(error instanceof Problem)) throw error;
  one("problem").textContent = error.message;
  one("problem").hidden = false;
  return new Promise(() => {});
}

/** @param {string} name @returns {Parameter} */
export const parameter = (name) => specification.parameters.find((/** @type {Parameter} */ each) => each.name === name);

/** Names of the texts of a case, of some groups or of all. @param {string[]} groups @returns {string[]} */
export const namesOf = (...groups) =>
  specification.parameters.filter((/** @type {Parameter} */ each) => !groups.length || groups.includes(each.group)).map((/** @type {Parameter} */ each) => each.name);

/** Family of a pulse, and texts of its parameters by name, read as the package does: with blanks and a comma at the end.
 * @param {string} text */
export function pulseOf(text) {
  const [family, rest = ""] = text.split(":");
  return {family, parts: /** @type {Texts} */ (Object.fromEntries(rest.split(",").map((part) => part.split("=").map((each) => each.trim()))))};
}

const VIEWS = ["response", "block", "map", "periodic", "compare", "records", "assessment"];
const COMPARED = ["treatment", "block", "motion", "case"];

/** @returns {State} */
export function readAddress() {
  const given = new URLSearchParams(location.search);
  readUnits(specification.shown_in, given);
  /** @param {string[]} names @param {string} [prefix] @returns {Texts} */
  const those = (names, prefix = "") =>
    Object.fromEntries(names.map((name) => [name, given.get(prefix + name) ?? ""]).filter(([, text]) => text));
  const texts = those(namesOf());
  const {view: first, ...opening} = specification.opening;
  const view = given.get("view") ?? first ?? "response";
  const from = Number(given.get("from") ?? NaN), to = Number(given.get("to") ?? NaN), time = Number(given.get("at") || NaN);
  const parts = {
    texts: complete(Object.keys(texts).length ? texts : opening), other: those(namesOf(), "other."),
    compare: COMPARED.find((each) => each === given.get("compare")) ?? COMPARED[0],
    window: /** @type {[number, number] | null} */ (from < to ? [from, to] : null), map: those(specification.map), sweep: those(specification.sweep), assessment: those(specification.assessment),
  };
  return {
    ...parts,
    good: {...parts},
    view: VIEWS.includes(view) ? view : "response",
    at: time >= 0 && time < Infinity ? time : null,
    lecture: given.get("lecture") === "1",
    example: given.get("example") ? {name: given.get("example") ?? "", step: Number(given.get("step") ?? 1)} : null,
  };
}

/** Texts with a block, where they have none. @param {Texts} texts @returns {Texts} */
function complete(texts) {
  const {width, height} = specification.default;
  if (!Object.keys(texts).length) return {...specification.default};
  return ["width", "p", "pivots", "mesh"].some((name) => name in texts) ? texts : {width, height, ...texts};
}

/** The window as texts. @param {Pick<State, "window">} state @returns {Texts} */
export const ends = ({window: chosen}) => (chosen ? {from: String(chosen[0]), to: String(chosen[1])} : {});

/** Parts of the state were answered: what they were then belongs into the address. @param {State} state @param {Partial<Good>} parts */
export function accepted(state, parts) {
  Object.assign(state.good, structuredClone(parts));
  writeAddress(state);
}

let waiting = 0;

/** Write the state into the address, at most a few times a second.
 * @param {State} state */
export function writeAddress(state) {
  window.clearTimeout(waiting);
  waiting = window.setTimeout(() => writeNow(state), 150);
}

/** Write the state into the address at once, as another view needs it: somebody may go back from it at any time.
 * @param {State} state */
export function writeNow(state) {
  window.clearTimeout(waiting);
  const given = new URLSearchParams();
  /** @param {Texts} texts @param {string[]} names @param {string} [prefix] */
  const put = (texts, names, prefix = "") => { for (const name of names) if (texts[name]) given.set(prefix + name, texts[name]); };
  if (state.view !== "response") given.set("view", state.view);
  const {good} = state;
  put(good.texts, namesOf());
  if (state.view === "compare") {
    given.set("compare", good.compare);
    put(good.other, namesOf(), "other.");
  }
  if (state.view === "map") put(good.map, specification.map);
  if (state.view === "periodic") put(good.sweep, specification.sweep);
  if (state.view === "records" || state.view === "assessment") put(good.assessment, specification.assessment);
  for (const [name, unit] of unitsChosen()) given.set(name, unit);
  put(ends(good), ["from", "to"]);
  if (state.at !== null && (state.view === "response" || state.view === "block")) given.set("at", String(state.at));
  if (state.lecture) given.set("lecture", "1");
  if (state.example) { given.set("example", state.example.name); given.set("step", String(state.example.step)); }
  write(given.toString());
}
