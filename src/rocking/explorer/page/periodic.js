// The case under a sine that never ends: what it settles on in the phase plane, and a diagram of that over a parameter.

import {Latest, frames, json, payload, unpacked} from "./api.js";
import {choose, isTyped} from "./controls.js";
import {showExports, withLegend} from "./exports.js";
import {specification} from "./parameters.js";
import {bokeh, colour, figure, showPlot, themed} from "./theme.js";
import {counted, legend, one, tell} from "./words.js";
import {amongst, typed} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */
/** What a sweep found at a value: how large its steps were, rotations over slenderness, states, and in words.
 * @typedef {{stride: number, drawn: Float64Array, states: Float64Array, words: string, overturned: boolean}} Found */

const DIRECTIONS = ["up", "down"];
const FIELDS = ["sweep", "sweep_from", "sweep_to", "sweep_points"];
/** What scales a sine, or releases the block, and changes nothing in a sweep but the sine's sign. */
const FREE = ["scale", "pga", "pgv", "sa", "initial_rotation", "initial_velocity"];
const F = (/** @type {string} */ field) => ({field});

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.orbit = new Latest(() => this.settle(), (error) => page.problem(error, "phase-plane"));
    this.diagram = new Latest(() => this.stream(), (error) => page.problem(error, "view-periodic"));
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {any} */
    this.about = null;
    /** @type {Record<string, Map<number, Found>>} */
    this.found = {up: new Map(), down: new Map()};
    this.key = "";
    /** The case that is shown, and what is swept. @type {{texts: Texts, sweep: Texts}} */
    this.asked = {texts: {}, sweep: {}};
    this.complete = false;
    this.waiting = 0;
    /** Number of the marked value, and of the point there. @type {[number, number] | null} */
    this.mark = null;
    for (const name of FIELDS) one(name).addEventListener("change", () => this.chosen(name));
    one("diagram").addEventListener("keydown", (event) => this.press(event));
    one("sweep-open").addEventListener("click", () => this.open());
    one("orbit-sine").addEventListener("click", () => this.sine());
  }

  enter() { this.update(); }

  leave() {
    this.running?.abort();
    one("save").hidden = false;
  }

  /** The case has changed. */
  update() {
    void this.orbit.ask();
  }

  /** @param {string} name */
  chosen(name) {
    const {sweep} = this.page.state;
    sweep[name] = typed(/** @type {HTMLInputElement} */ (one(name)).value);
    if (name === "sweep") { delete sweep.sweep_from; delete sweep.sweep_to; }
    this.update();
  }

  /** What the case settles on; after that, its diagram, unless that is the one that is drawn or under way. */
  async settle() {
    const {texts, sweep} = this.page.state, asked = {texts, sweep: {...sweep}};
    const {header, arrays} = await payload("/api/orbit", texts);
    if (this.page.state.view !== "periodic") return; // somebody left meanwhile
    this.offer = header.offer;
    one("orbit").hidden = Boolean(this.offer);
    one("orbit-offer").hidden = !this.offer;
    one("save").hidden = Boolean(this.offer);
    if (this.offer) {
      this.running?.abort();
      this.key = "";
      this.page.problem(null, "view-periodic"); // a diagram may have been asked for, which this motion has not
      one("orbit-verdict").textContent = phrase("orbit.no_sine");
      one("orbit-about").textContent = "";
      one("orbit-sine").textContent = phrase("orbit.offer", {amplitude: this.offer.amplitude, frequency: this.offer.frequency});
      return;
    }
    if (!this.plane) this.build();
    tell(one("orbit-verdict"), inWords(header.sentence));
    tell(one("orbit-about"), inWords(header.about));
    /** @type {Record<string, number>} */
    this.at = header.at;
    this.drawPlane(header, arrays);
    this.asked = asked;
    const key = keyOf(asked, header.phase);
    if (key === this.key) {
      this.drawCase();
      await this.renew();
    } else {
      this.running?.abort();
      this.key = key;
      void this.diagram.ask();
    }
    counted("settled");
  }

  /** Code, and the case at the mark, are of the case that is shown, though several have the same diagram. */
  async renew() {
    const {about, asked} = this, {texts, sweep} = asked;
    if (about?.key !== this.key) return; // its diagram has not begun
    const code = await json("/api/sweep/code", {...texts, ...sweep});
    if (this.asked !== asked || this.page.state.view !== "periodic") return; // another case was settled, or somebody left, meanwhile
    Object.assign(about, code, {asked});
    this.offerFiles();
  }

  async stream() {
    this.running = new AbortController();
    const {signal} = this.running;
    const {key, asked} = this, {texts, sweep} = asked;
    const body = document.body.dataset;
    body.sweep = "running";
    let begun = false; // what was there before stays until then
    try {
      for await (const frame of frames("/api/sweep", {...texts, ...sweep}, signal)) {
        if (!begun) {
          begun = true;
          this.complete = false;
          this.found = {up: new Map(), down: new Map()};
          this.about = {...JSON.parse(new TextDecoder().decode(frame)), key, asked};
          this.page.remember({sweep});
          this.fill();
          this.drawAxes();
          this.offerFiles();
          if (this.asked !== asked) await this.renew();
          continue;
        }
        const {header, arrays} = unpacked(/** @type {ArrayBuffer} */ (frame.buffer));
        this.take(header, arrays);
        /** @type {HTMLProgressElement} */ (one("sweep-progress")).value = header.share;
        this.drawSoon();
      }
    } catch (error) {
      if (this.key === key) this.key = "";
      throw error;
    }
    this.complete = true;
    this.draw();
    if (!this.mark) this.put(this.nearest(this.at?.[this.about.name] ?? 0), this.states?.[0] ?? 0);
    this.offerFiles();
    body.sweep = "complete";
  }

  /** Keep what came, in place of what larger steps found around it. @param {any} header @param {Record<string, Float64Array>} arrays */
  take({stride, direction, indices, counts, words, overturned}, {drawn, states}) {
    const found = this.found[direction];
    let at = 0;
    indices.forEach((/** @type {number} */ index, /** @type {number} */ k) => {
      for (let other = index - stride + 1; other < index + stride; other += 1) if ((found.get(other)?.stride ?? 0) > stride) found.delete(other);
      const end = at + counts[k];
      found.set(index, {stride, drawn: drawn.subarray(at, end), states: states.subarray(2 * at, 2 * end), words: inWords(words[k]), overturned: overturned[k]});
      at = end;
    });
  }

  fill() {
    const {name, values} = this.about;
    const {sweep} = this.page.state;
    const shown = /** @type {Texts} */ ({sweep: name, sweep_from: String(values[0]), sweep_to: String(values[values.length - 1]), sweep_points: String(values.length)});
    for (const field of FIELDS) {
      const input = /** @type {HTMLElement} */ (one(field)), value = sweep[field] || shown[field];
      if (input instanceof HTMLSelectElement) choose(input, value);
      else if (input instanceof HTMLInputElement && !isTyped(input)) input.value = value;
    }
  }

  build() {
    const B = bokeh();
    const range = () => new B.Range1d({start: -1, end: 1});
    const height = window.matchMedia("(max-width: 900px)").matches ? 320 : 430;
    const made = (/** @type {string} */ label) => figure({height, x_range: range(), y_range: range(), min_border_bottom: 46}, label);
    /** @param {any} plot @param {any} glyph @param {string[]} fields @param {() => Record<string, any>} colours */
    const add = (plot, glyph, fields, colours) => {
      const source = new B.ColumnDataSource({data: Object.fromEntries(fields.map((each) => [each, []]))});
      plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph}));
      themed(() => glyph.setv(colours()));
      return source;
    };
    const marks = (/** @type {number} */ size, /** @type {string} */ marker = "circle") => new B.Scatter({x: F("x"), y: F("y"), size, marker: {value: marker}});
    const filled = (/** @type {string} */ ink) => () => ({fill_color: colour(ink), line_color: null});
    const hollow = (/** @type {string} */ ink) => () => ({fill_color: null, line_color: colour(ink)});

    this.plane = made(phrase("phase.plane"));
    this.plane.below[0].axis_label = phrase("histories.rotation");
    this.plane.below[0].ticker.desired_num_ticks = 5;
    this.plane.left[0].axis_label = phrase("phase.velocity");
    const line = new B.Line({x: F("x"), y: F("y"), line_width: 1.2}), jump = new B.Segment({x0: 0, x1: 0, y0: F("before"), y1: F("after"), line_width: 1.6, line_dash: [2, 3]});
    this.jumps = add(this.plane, jump, ["before", "after"], () => ({line_color: colour("ground")}));
    this.line = add(this.plane, line, ["x", "y"], () => ({line_color: colour("ink")}));
    this.dot = marks(8);
    this.dots = add(this.plane, this.dot, ["x", "y"], filled("accent"));
    this.here = marks(6);

    this.plot = made(phrase("orbit.diagram"));
    this.plot.left[0].axis_label = phrase("orbit.once");
    this.case = new B.Span({dimension: "height", location: 0, line_width: 1.2, line_dash: [4, 3]});
    this.plot.add_layout(this.case);
    themed(() => this.case.setv({line_color: colour("accent")}));
    this.sources = {
      down: add(this.plot, marks(5.5), ["x", "y"], hollow("ground")),
      up: add(this.plot, marks(2.6), ["x", "y"], filled("ink")),
      downOver: add(this.plot, marks(7), ["x", "y"], hollow("over")),
      upOver: add(this.plot, marks(5, "x"), ["x", "y"], hollow("over")),
      orbit: add(this.plot, this.here, ["x", "y"], filled("accent")),
      mark: add(this.plot, marks(15, "circle_cross"), ["x", "y"], () => ({fill_alpha: 0, line_color: colour("second"), line_width: 1.6})),
    };
    this.plot.on_event("mousemove", (/** @type {any} */ event) => { if (this.about) this.say(this.nearest(event.x)); });
    this.plot.on_event("tap", (/** @type {any} */ event) => { if (this.about) { this.put(this.nearest(event.x), event.y); void this.open(); } });
    void showPlot(this.plane, one("phase-plane"));
    void showPlot(this.plot, one("diagram"));
    legend("orbit-legend", [
      ["line", phrase("orbit.trajectory")], ["jump", phrase("orbit.jump")], ["dot", phrase("orbit.start")], ["at", phrase("orbit.case")],
      ["up-dot", phrase("orbit.upwards")], ["down-ring", phrase("orbit.downwards")], ["cross", phrase("orbit.over_up")], ["over-ring", phrase("orbit.over_down")],
    ]);
  }

  /** @param {any} header @param {Record<string, Float64Array>} arrays */
  drawPlane({sentence, period}, {rotation, velocity, before, after, x, y}) {
    this.line.data = {x: rotation, y: velocity};
    this.jumps.data = {before, after};
    this.dots.data = {x, y};
    this.dot?.setv({size: {value: period ? 8 : 3}});
    this.here?.setv({size: {value: period ? 6 : 2}});
    this.states = x;
    for (const [range, parts] of /** @type {[any, Float64Array[]][]} */ ([[this.plane.x_range, [rotation, x]], [this.plane.y_range, [velocity, before, after, y]]])) {
      const [low, high] = around(parts);
      range.setv({start: low, end: high});
    }
    this.plane.html_attributes = {role: "img", "aria-label": phrase("orbit.plane_about", {sentence})};
  }

  drawAxes() {
    const {label, values} = this.about;
    this.plot.below[0].axis_label = inWords(label);
    const half = 0.5 * (values[1] - values[0]);
    this.plot.x_range.setv({start: values[0] - half, end: values[values.length - 1] + half});
    this.mark = null;
    this.sources?.mark.setv({data: {x: [], y: []}});
    this.draw();
  }

  /** Draw soon, once, so that painting takes little from computing. */
  drawSoon() {
    if (this.waiting) return;
    this.waiting = window.setTimeout(() => { this.waiting = 0; if (!this.complete) this.draw(); }, 150);
  }

  draw() {
    if (!this.about) return;
    const {values} = this.about;
    const [low, high] = around([...DIRECTIONS.flatMap((each) => Array.from(this.found[each].values(), ({drawn}) => drawn)), this.states ?? []]);
    const top = high + 0.05 * (high - low);
    this.plot.y_range.setv({start: low, end: top + 0.05 * (high - low)});
    for (const direction of DIRECTIONS) {
      /** @type {Record<string, number[]>} */
      const all = {x: [], y: [], over: []};
      for (const [index, {drawn, overturned}] of this.found[direction]) {
        if (overturned) all.over.push(values[index]);
        for (const each of drawn) { all.x.push(values[index]); all.y.push(each); }
      }
      const sources = /** @type {any} */ (this.sources);
      sources[direction].data = {x: all.x, y: all.y};
      sources[`${direction}Over`].data = {x: all.over, y: all.over.map(() => top)};
    }
    this.drawCase();
  }

  /** The case itself within the diagram. */
  drawCase() {
    if (!this.about || !this.at) return;
    const x = this.at[this.about.name];
    this.case.location = x;
    const y = this.states ?? new Float64Array(0);
    this.sources?.orbit.setv({data: {x: Float64Array.from(y, () => x), y}});
  }

  /** Number of the value nearest to a place that has been computed. @param {number} x */
  nearest(x) {
    const {values} = this.about;
    let best = 0;
    for (const index of this.found.up.keys()) if (Math.abs(values[index] - x) < Math.abs(values[best] - x)) best = index;
    return best;
  }

  /** What was found at a value in either direction, from below. @param {number} index */
  points(index) {
    const all = DIRECTIONS.flatMap((each) => {
      const {drawn, states} = this.found[each].get(index) ?? {drawn: [], states: []};
      return Array.from(drawn, (y, k) => ({y, u: states[2 * k], v: states[2 * k + 1]}));
    });
    return all.sort((one_, other) => one_.y - other.y);
  }

  /** Mark the point at a value that is nearest to a height. @param {number} index @param {number} y */
  put(index, y) {
    const points = this.points(index);
    const k = points.reduce((best, each, j) => (Math.abs(each.y - y) < Math.abs(points[best].y - y) ? j : best), 0);
    this.marked(index, k);
  }

  /** @param {number} index @param {number} k */
  marked(index, k) {
    const points = this.points(index);
    this.mark = [index, Math.max(0, Math.min(points.length - 1, k))];
    const y = points[this.mark[1]]?.y ?? this.plot.y_range.end;
    this.sources?.mark.setv({data: {x: [this.about.values[index]], y: [y]}});
    this.say(index);
    return y;
  }

  /** Say what is at a value. @param {number} index */
  say(index) {
    const {label, values} = this.about;
    const words = DIRECTIONS.map((each) => {
      const found = this.found[each].get(index);
      return found && phrase(`orbit.found_${each}`, {found: found.words});
    });
    one("sweep-at").textContent = phrase("orbit.at", {label: inWords(label), value: amongst(values, index), found: words.filter(Boolean).join("; ") || phrase("orbit.nothing")});
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.key === "Enter") { event.preventDefault(); void this.open(); }
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[event.key];
    if (!way || !this.about) return;
    event.preventDefault();
    const [index, k] = this.mark ?? [0, 0];
    if (way[1]) { this.marked(index, k + way[1]); return; }
    const known = [...this.found.up.keys()].sort((first, second) => first - second);
    const next = known.indexOf(this.nearest(this.about.values[index])) + way[0] * (event.shiftKey ? 10 : 1);
    this.put(known[Math.max(0, Math.min(known.length - 1, next))], this.points(index)[k]?.y ?? 0);
  }

  /** The case at the marked value, released from the marked state. */
  async open() {
    if (!this.about || !this.mark) return;
    const [index, k] = this.mark;
    const point = this.points(index)[k];
    const {texts} = this.page.state, {asked} = this.about;
    const from = point ? {u: String(point.u), v: String(point.v)} : {};
    try {
      const found = await json("/api/sweep/point", {...asked.texts, ...asked.sweep, at: String(this.about.values[index]), ...from});
      if (this.page.state.texts === texts && this.page.state.view === "periodic") this.page.restate(found);
    } catch (error) {
      this.page.problem(error, "view-periodic");
    }
  }

  /** The nearest sine in place of what shakes the case. */
  sine() {
    const gone = specification.parameters.filter((/** @type {any} */ each) => each.group === "motion").map((/** @type {any} */ each) => each.name);
    const kept = Object.entries(this.page.state.texts).filter(([name]) => !gone.includes(name));
    this.page.restate({...Object.fromEntries(kept), motion: this.offer.motion});
  }

  /** What can be saved: the picture, the numbers, and code that computes them again. */
  offerFiles() {
    const {python} = this.about;
    showExports("diagram", python, null, !this.complete ? [] : [
      ["rocking-diagram.svg", phrase("save.svg"), () => this.picture("svg")], ["rocking-diagram.png", phrase("save.png"), () => this.picture("png")],
      ["rocking-diagram.csv", phrase("save.numbers"), async () => new Blob([this.table()], {type: "text/csv"})],
    ], (error) => this.page.problem(error, "exports"));
  }

  /** @param {"svg" | "png"} form @returns {Promise<Blob>} */
  async picture(form) {
    const drawn = bokeh().index.find_one(this.plot).export(form);
    return withLegend(await drawn.to_blob(), [[phrase("orbit.upwards"), colour("ink")], [phrase("orbit.downwards"), colour("ground")], [phrase("orbit.case"), colour("accent")]], this.plot.outer_width, this.plot.outer_height);
  }

  /** Every state of the diagram; none where the block overturns. */
  table() {
    const {name, values} = this.about;
    const rows = DIRECTIONS.flatMap((each) => [...this.found[each]].sort(([first], [second]) => first - second).flatMap(([index, {states, overturned}]) =>
      (overturned ? [[values[index], each, "", ""]] : Array.from({length: states.length / 2}, (_, k) => [values[index], each, states[2 * k], states[2 * k + 1]]))));
    return [[name, "sweep", "rotation_rad", "velocity_rad_per_s"], ...rows].map((row) => `${row.join(",")}\n`).join("");
  }
}

/** All that a sweep depends on: of what scales the sine that is the sign, which the phase has.
 * @param {{texts: Texts, sweep: Texts}} asked @param {number} phase */
function keyOf({texts, sweep}, phase) {
  const motion = texts.motion.replace(sweep.sweep === "omega" ? /frequency=[^,]*/ : /amplitude=[^,]*/, "").replace(/cycles=[^,]*/, "");
  const free = sweep.sweep === "omega" ? FREE.slice(-2) : FREE;
  return JSON.stringify([Object.entries({...texts, motion}).filter(([name]) => !free.includes(name)).sort(), sweep, phase]);
}

/** Ends of an axis around all of these. @param {Iterable<number>[]} parts @returns {[number, number]} */
function around(parts) {
  let low = Infinity, high = -Infinity;
  for (const part of parts) for (const each of part) { if (each < low) low = each; if (each > high) high = each; }
  const margin = 0.07 * (high - low);
  return margin > 0 ? [low - margin, high + margin] : low <= high ? [low - 0.1, high + 0.1] : [-0.1, 0.1];
}
