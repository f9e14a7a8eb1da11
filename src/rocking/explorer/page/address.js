// The state of the page, as the address has it: whoever opens the link sees the same.

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{view: string, texts: Texts, other: Texts, compare: string, window: [number, number] | null, map: Texts}} State */

export const NAMES = [
  "width", "height", "offset", "p", "alpha", "pivots", "height_of_mass", "gyration", "restitution", "gravity", "motion", "channel", "vertical", "dt", "units",
  "scale", "pga", "pgv", "sa", "model", "chattering", "duration", "initial_rotation", "initial_velocity",
];
export const BLOCK = ["width", "height", "offset", "p", "alpha", "pivots", "height_of_mass", "gyration", "restitution", "gravity"];
export const MOTION = ["motion", "channel", "vertical", "dt", "units", "scale", "pga", "pgv", "sa", "initial_rotation", "initial_velocity"];
const VIEWS = ["response", "block", "map", "compare"];
const MAP = [
  "x", "x_from", "x_to", "y", "y_from", "y_to", "points", "quantity",
  "motion_index", "polarity_index", "scale_index", "fix_p", "fix_alpha", "fix_restitution", "fix_block",
];

/** @param {Texts} opening @returns {State} */
export function read(opening) {
  const given = new URLSearchParams(location.search);
  /** @param {string[]} names @param {string} [prefix] @returns {Texts} */
  const those = (names, prefix = "") =>
    Object.fromEntries(names.flatMap((name) => (given.get(prefix + name) ? [[name, /** @type {string} */ (given.get(prefix + name))]] : [])));
  const texts = those(NAMES);
  const view = given.get("view") ?? opening.view ?? "response";
  const from = Number(given.get("from") ?? NaN), to = Number(given.get("to") ?? NaN);
  const {view: _, ...first} = opening;
  return {
    view: VIEWS.includes(view) ? view : "response",
    texts: Object.keys(texts).length ? texts : first,
    other: those(NAMES, "other."),
    compare: given.get("compare") ?? "treatment",
    window: from < to ? [from, to] : null,
    map: those(MAP),
  };
}

/** @param {State} state */
export function query(state) {
  const given = new URLSearchParams();
  if (state.view !== "response") given.set("view", state.view);
  for (const name of NAMES) if (state.texts[name]) given.set(name, state.texts[name]);
  if (state.view === "compare") {
    given.set("compare", state.compare);
    for (const name of NAMES) if (state.other[name]) given.set(`other.${name}`, state.other[name]);
  }
  if (state.view === "map") for (const name of MAP) if (state.map[name]) given.set(name, state.map[name]);
  if (state.window) {
    given.set("from", String(state.window[0]));
    given.set("to", String(state.window[1]));
  }
  return given.toString();
}

let waiting = 0;

/** Write the state into the address, at most a few times a second.
 * @param {State} state */
export function write(state) {
  window.clearTimeout(waiting);
  waiting = window.setTimeout(() => history.replaceState(null, "", `?${query(state)}`), 150);
}
