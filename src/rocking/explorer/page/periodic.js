// The case under a sine that never ends: its steady state in the phase plane, and a bifurcation diagram.

import {Latest, Problem, json, parts, payload} from "./api.js";
import {Chart, around, gaps} from "./chart.js";
import {one} from "./standalone/dom.js";
import {writeAddress} from "./state.js";
import {amongst, short, typed} from "./numbers.js";
import {labelOf} from "./texts.js";
import {choose, isTyped} from "./forms.js";
import {csv, offer} from "./save.js";

const DIRECTIONS = ["up", "down"], FIELDS = ["sweep", "sweep_from", "sweep_to", "sweep_points"], REPAINT = 200;

/** What a sweep found at a value. @typedef {{stride: number, drawn: Float64Array, states: Float64Array, words: string, overturned: boolean}} Found */

const NONE = new Float64Array(0), NOTHING = {drawn: NONE, states: NONE};

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.latest = new Latest(() => this.run(), (error) => this.settle(error));
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {any} */
    this.about = null;
    /** @type {any} */
    this.orbit = null;
    /** @type {Record<string, Map<number, Found>>} */
    this.found = {up: new Map(), down: new Map()};
    /** Index of the marked value, and of the point there. */
    this.mark = [0, 0];
    this.plane = new Chart(one("orbit-plane"), {label: "Phase plane of the steady state", height: 420});
    this.chart = new Chart(one("diagram"), {label: "Bifurcation diagram", height: 420, hover: (x) => { if (x !== null && this.about) this.say(this.nearest(x)); }, pick: (x, y) => { this.put(this.nearest(x), y); void this.open(); }});
    for (const name of FIELDS) one(name).addEventListener("change", () => {
      const {sweep} = page.state;
      sweep[name] = typed(one(name).value);
      if (name === "sweep") { delete sweep.sweep_from; delete sweep.sweep_to; }
      this.update();
    });
    one("diagram").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.press(event));
    one("sweep-open").addEventListener("click", () => this.open());
  }

  enter() {
    offer([], "", null, this.page);
    this.update();
  }

  /** @param {unknown} error what went wrong; a diagram of another case does not stay */
  settle(error) {
    if (error instanceof Problem) one("orbit").hidden = true;
    this.page.problem(error, "view-periodic");
  }

  leave() { this.running?.abort(); }

  update() {
    this.running?.abort();
    void this.latest.ask();
  }

  async run() {
    this.running = new AbortController();
    const {signal} = this.running, {texts, sweep} = this.page.state, found = await payload("/api/orbit", texts), {sentence, duration} = found.header;
    if (signal.aborted) return;
    this.orbit = found;
    one("orbit").hidden = false;
    one("orbit-verdict").textContent = sentence;
    one("orbit-about").textContent = `One period of the sine lasts ${short(duration)} s, and repeats for ever.`;
    this.drawPlane(found);
    document.body.dataset.sweep = "running";
    let painted = 0;
    for await (const {header, arrays} of parts("/api/sweep", {...texts, ...sweep}, signal)) {
      if (header.values) {
        this.found = {up: new Map(), down: new Map()};
        this.about = header;
        writeAddress(this.page.state);
        this.fill();
        continue;
      }
      this.take(header, arrays);
      one("sweep-progress").value = header.share;
      if (performance.now() - painted > REPAINT) { this.draw(); painted = performance.now(); }
    }
    this.put(this.nearest(found.header.at[this.about.name]), found.arrays.x[0] ?? 0);
    document.body.dataset.sweep = "complete";
  }

  /** Keep results in place of those of larger steps around them. @param {any} header @param {Record<string, Float64Array>} arrays */
  take({stride, direction, indices, counts, words, overturned}, {drawn, states}) {
    const found = this.found[direction];
    let at = 0;
    indices.forEach((/** @type {number} */ index, /** @type {number} */ k) => {
      for (let other = index - stride + 1; other < index + stride; other += 1) if ((found.get(other)?.stride ?? 0) > stride) found.delete(other);
      const end = at + counts[k];
      found.set(index, {stride, drawn: drawn.subarray(at, end), states: states.subarray(2 * at, 2 * end), words: words[k], overturned: overturned[k]});
      at = end;
    });
  }

  fill() {
    const {name, values, python} = this.about, shown = {sweep: name, sweep_from: String(values[0]), sweep_to: String(values[values.length - 1]), sweep_points: String(values.length)};
    for (const [field, value] of Object.entries(shown)) {
      const input = one(field);
      if (input instanceof HTMLSelectElement) choose(input, value); else if (!isTyped(input)) input.value = value;
    }
    const file = `rocking-diagram-${name}`, table = () => csv([[name, "direction", "rotation", "angular_velocity", "over_slenderness"], ...DIRECTIONS.flatMap((direction) => values.flatMap((/** @type {number} */ value, /** @type {number} */ k) => {
      const {drawn, states} = this.found[direction].get(k) ?? NOTHING;
      return Array.from(drawn, (each, j) => /** @type {(number | string)[]} */ ([value, direction, states[2 * j], states[2 * j + 1], each]));
    }))], ["rotation in rad, angular velocity in rad/s, once a period"]);
    offer([[`${file}.svg`, "Diagram, SVG", () => this.chart.file("svg")], [`${file}.png`, "Diagram, PNG", () => this.chart.file("png")], [`${file}-plane.svg`, "Phase plane, SVG", () => this.plane.file("svg")], [`${file}.csv`, "Numbers, CSV", async () => table()]], python, null, this.page);
  }

  /** @param {import("./api.js").Payload} found */
  drawPlane({header: {period}, arrays: {rotation = NONE, velocity = NONE, jump = NONE, x, y}}) {
    const [zero, before, after] = [() => 0, (/** @type {number} */ k) => velocity[k], (/** @type {number} */ k) => velocity[k + 1]].map((value) => Array.from(jump, value));
    this.plane.show({x: {...around([rotation, x]), label: "rotation / slenderness"}, y: {...around([velocity, y]), label: "velocity / (p · slenderness)"}, layers: [
      {class: "zero", along: "x", rules: [0]}, {class: "zero", along: "y", rules: [0]}, {class: "line ink", line: gaps(rotation, velocity, Array.from(jump))}, {class: "jump", segments: [zero, before, zero, after]}, {class: period ? "dot accent large" : "dot accent", dots: [x, y]},
    ], legend: [["line ink", "line", "trajectory"], ["jump", "line", "impact"], ["dot accent", "dot", "start of each period"]]});
  }

  draw() {
    const {name, values} = this.about, half = 0.5 * (values[1] - values[0]), states = this.orbit.arrays.x, at = this.orbit.header.at[name];
    const y = around([states, ...DIRECTIONS.flatMap((each) => Array.from(this.found[each].values(), ({drawn}) => drawn))]), top = y.high - 0.02 * (y.high - y.low);
    const dots = (/** @type {string} */ direction) => { const all = /** @type {number[][]} */ ([[], [], []]); for (const [index, {drawn, overturned}] of this.found[direction]) { if (overturned) all[2].push(values[index]); for (const each of drawn) { all[0].push(values[index]); all[1].push(each); } } return all; };
    const [up, down] = DIRECTIONS.map(dots), [index, k] = this.mark, point = this.points(index)[k];
    this.chart.show({x: {low: values[0] - half, high: values[values.length - 1] + half, label: labelOf(this.about)}, y: {...y, label: "rotation / slenderness, once a period"}, layers: [
      {class: "limit accent", along: "y", rules: [at]}, {class: "dot ground wide", dots: [down[0], down[1]]}, {class: "dot ink fine", dots: [up[0], up[1]]},
      {class: "dot over wide", dots: [down[2], down[2].map(() => top)]}, {class: "dot over", dots: [up[2], up[2].map(() => top)]}, {class: "dot accent", dots: [Array.from(states, () => at), states]},
      {class: "dot mark", dots: [[values[index]], [point?.y ?? top]]},
    ], legend: [["dot ink", "dot", "swept upwards"], ["dot ground wide", "dot", "swept downwards"], ["dot over", "dot", "overturns"], ["limit accent", "line", "this case"]]});
  }

  /** Index of the nearest computed value. @param {number} x */
  nearest(x) {
    const {values} = this.about;
    let best = 0;
    for (const index of this.found.up.keys()) if (Math.abs(values[index] - x) < Math.abs(values[best] - x)) best = index;
    return best;
  }

  /** Points at a value in either direction, from below. @param {number} index */
  points(index) {
    return DIRECTIONS.flatMap((each) => {
      const {drawn, states} = this.found[each].get(index) ?? NOTHING;
      return Array.from(drawn, (y, k) => ({y, u: states[2 * k], v: states[2 * k + 1]}));
    }).sort((one_, other) => one_.y - other.y);
  }

  /** Mark the point at a value that is nearest to a height. @param {number} index @param {number} y */
  put(index, y) {
    const points = this.points(index);
    this.mark = [index, points.reduce((best, each, j) => (Math.abs(each.y - y) < Math.abs(points[best].y - y) ? j : best), 0)];
    this.draw();
    this.say(index);
  }

  /** @param {number} index */
  say(index) {
    const words = DIRECTIONS.map((each) => { const found = this.found[each].get(index); return found && `swept ${each}wards: ${found.words}`; }).filter(Boolean);
    one("sweep-at").textContent = `${labelOf(this.about)} = ${amongst(this.about.values, index)}; ${words.join("; ") || "not computed yet"}.`;
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const along = {ArrowLeft: -1, ArrowRight: 1}[event.key], up = {ArrowDown: -1, ArrowUp: 1}[event.key], [index, k] = this.mark;
    if (!this.about || (!along && !up && event.key !== "Enter")) return;
    event.preventDefault();
    if (event.key === "Enter") { void this.open(); return; }
    const points = this.points(index), known = [...this.found.up.keys()].sort((a, b) => a - b), next = known[Math.min(known.length - 1, Math.max(0, known.indexOf(index) + (along ?? 0) * (event.shiftKey ? 10 : 1)))];
    if (along) { this.put(next, points[k]?.y ?? 0); return; }
    this.mark = [index, Math.min(points.length - 1, Math.max(0, k + (up ?? 0)))];
    this.draw();
  }

  /** Open the case at the mark. */
  async open() {
    if (!this.about) return;
    const {texts, sweep} = this.page.state, [index, k] = this.mark, point = this.points(index)[k];
    try {
      this.page.restate(await json("/api/sweep/point", {...texts, ...sweep, at: String(this.about.values[index]), ...(point ? {u: String(point.u), v: String(point.v)} : {})}), "shake");
    } catch (error) { this.page.problem(error, "view-periodic"); }
  }
}
