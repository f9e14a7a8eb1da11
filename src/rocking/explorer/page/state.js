// The state of the page, as its address has it: whoever opens the link sees the same.

import {Problem, json, openSession} from "./api.js";
import {one} from "./standalone/dom.js";
import {inUnits, readUnits, unitsChosen} from "./units.js";
import {known, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{view: string, texts: Texts, other: Texts | null, window: [number, number] | null, at: number | null, map: Texts, sweep: Texts, assessment: Texts}} State */
/** @typedef {{name: string, label: string, group: string, kind: string, unit: string, suffix: string, default: string, units: Record<string, number>, low: number, high: number, is_logarithmic: boolean, step: number, arity: string, text: string, argument: string, about: string, own?: Parameter}} Parameter */

export const VIEWS = ["shake", "map", "periodic", "assess"];

await openSession();
/** What the server says of the parameters, from which the forms are made. @type {any} */
export const specification = await json("/api/start").catch((error) => {
  document.body.inert = false;
  if (!(error instanceof Problem)) throw error;
  one("problem").textContent = error.message;
  one("problem").hidden = false;
  return new Promise(() => {}); // there is no page without it
});

readUnits(specification.shown_in, new URLSearchParams(location.search));
/** A parameter with its unit, label and explanation. @param {any} spec @returns {Parameter} */
const named = (spec) => ({...inUnits(spec), label: phrase(`field.${spec.text}`), about: known(`about.${spec.text}`) ? phrase(`about.${spec.text}`) : ""});
specification.parameters = specification.parameters.map(named);
specification.period = named(specification.period);
for (const pulse of Object.values(specification.pulses)) pulse.parameters = pulse.parameters.map(named);
for (const treatment of specification.treatments) if (treatment.limit) treatment.limit = named(treatment.limit);

/** @param {string} name @returns {Parameter} */
export const parameter = (name) => specification.parameters.find((/** @type {Parameter} */ each) => each.name === name);

/** Names of the texts of a case, of some groups or of all. @param {string[]} groups @returns {string[]} */
export const namesOf = (...groups) => specification.parameters.filter((/** @type {Parameter} */ {group}) => !groups.length || groups.includes(group)).map((/** @type {Parameter} */ {name}) => name);

/** Texts of an address by these names. @param {URLSearchParams} given @param {string[]} names @returns {Texts} */
const those = (given, names) => Object.fromEntries(names.map((name) => [name, given.get(name) ?? ""]).filter(([, text]) => text));

/** Texts with a block and a motion. @param {Texts} texts @returns {Texts} */
function complete(texts) {
  const {width, height} = specification.default;
  if (!Object.keys(texts).length) return {...specification.default};
  return ["width", "p", "pivots", "mesh"].some((name) => name in texts) ? texts : {width, height, ...texts};
}

/** @returns {State} */
export function readAddress() {
  const given = new URLSearchParams(location.search), texts = those(given, namesOf());
  const {view: first, ...opening} = specification.opening, view = given.get("view") ?? first;
  const [from, to, at] = ["from", "to", "at"].map((name) => Number(given.get(name) || NaN));
  const other = given.get("other");
  return {
    view: VIEWS.includes(view) ? view : "shake",
    texts: complete(Object.keys(texts).length ? texts : opening),
    other: other ? complete(those(new URLSearchParams(other), namesOf())) : null,
    window: from < to ? [from, to] : null,
    at: at >= 0 && at < Infinity ? at : null,
    map: those(given, specification.map), sweep: those(given, specification.sweep), assessment: those(given, specification.assessment),
  };
}

/** @param {State} state */
function addressOf(state) {
  const given = new URLSearchParams();
  const put = (/** @type {Texts} */ texts, /** @type {string[]} */ names) => { for (const name of names) if (texts[name]) given.set(name, texts[name]); };
  if (state.view !== "shake") given.set("view", state.view);
  put(state.texts, namesOf());
  if (state.view === "map") put(state.map, specification.map);
  if (state.view === "periodic") put(state.sweep, specification.sweep);
  if (state.view === "assess") put(state.assessment, specification.assessment);
  if (state.view === "shake") {
    if (state.other) given.set("other", new URLSearchParams(state.other).toString());
    if (state.window) { given.set("from", String(state.window[0])); given.set("to", String(state.window[1])); }
    if (state.at !== null) given.set("at", String(state.at));
  }
  for (const [name, unit] of unitsChosen()) given.set(name, unit);
  return `?${given}`;
}

let waiting = 0;
/** Write the state into the address; `step` makes an entry of the browser's history. @param {State} state @param {{step?: boolean, soon?: boolean}} [how] */
export function writeAddress(state, {step = false, soon = false} = {}) {
  window.clearTimeout(waiting);
  if (soon) { waiting = window.setTimeout(() => writeAddress(state), 200); return; }
  const address = addressOf(state);
  if (step && address !== location.search) history.pushState(null, "", address); else history.replaceState(null, "", address);
}

/** The window as texts. @param {Pick<State, "window">} state @returns {Texts} */
export const ends = ({window: chosen}) => (chosen ? {from: String(chosen[0]), to: String(chosen[1])} : {});
