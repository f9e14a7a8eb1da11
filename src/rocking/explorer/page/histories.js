// Rotation over ground acceleration: one axis of time, which keeps its digits however far it is zoomed.

import {withLegend} from "./exports.js";
import {bokeh, coarse, colour, figure, showPlot, themed} from "./theme.js";
import {fixed} from "./numbers.js";
import {phrase} from "./texts.js";
import {gAxis} from "./units.js";

/** @typedef {{time: Float64Array, rotation: Float64Array, ground_time: Float64Array, ground_g: Float64Array, weight?: Float64Array, impact: Float64Array}} Lines */
/** @typedef {{lines: Lines, rest: Float64Array, uplift: Float64Array, block: {sides: {alpha: number}[], thresholds_g: number[], gravity_g: number}}} Drawn */

const NARROWEST = 1e-10;
const WIDE = 0.5;
const UNITS = /** @type {[number, string][]} */ ([[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]]);
const NAMES = ["first", "second"];
const SIGNS = [1, -1];

/** Time as it is plotted: counted from an origin, in a unit that suits the window. */
export class Scale {
  /** @param {number} from @param {number} to */
  constructor(from, to) {
    const width = to - from;
    if (width >= WIDE) {
      [this.origin, this.unit, this.label] = [0, 1, phrase("histories.time")];
      return;
    }
    const [unit, name] = UNITS.find(([each]) => width >= 2 * each) ?? UNITS[UNITS.length - 1];
    const step = 10 ** Math.floor(Math.log10(width));
    this.origin = Number((Math.floor(from / step) * step).toFixed(14));
    this.unit = unit;
    this.label = phrase("histories.time_after", {origin: fixed(this.origin, Math.max(0, Math.round(-Math.log10(step)))), unit: name});
  }

  /** @param {number} time */
  plotted(time) { return (time - this.origin) / this.unit; }

  /** @param {number} x */
  time(x) { return this.origin + x * this.unit; }

  /** Times that count from the window's start. @param {Float64Array} times @param {number} from */
  all(times, from) {
    const shift = from - this.origin;
    return times.map((each) => (shift + each) / this.unit);
  }
}

/** A window within a response, or null where none is asked for that has a part in it.
 * @param {[number, number] | null} asked @param {number} duration @returns {[number, number] | null} */
export const within = (asked, duration) => (asked && asked[0] < duration ? [asked[0], Math.min(asked[1], duration)] : null);

export class Histories {
  /** @param {HTMLElement} element @param {{window: (ends: [number, number] | null) => void, asked: () => [number, number] | null, load: () => import("./api.js").Latest, cursor?: (time: number | null) => void, pick?: (time: number) => void}} tell */
  constructor(element, tell) {
    this.element = element;
    this.tell = tell;
    this.scale = new Scale(0, 1);
    /** @type {[number, number]} */
    this.window = [0, 1];
    this.whole = 1;
    /** Ground accelerations that lift the block, in the unit of the axis: to the right and to the left. */
    this.thresholds = [NaN, NaN];
    /** @type {(Drawn | null)[]} */
    this.drawn = [null, null];
    /** @type {Record<string, any>} */
    this.sources = {};
    /** @type {Record<string, any[]>} */
    this.levels = {};
    /** @type {any[]} */
    this.cursors = [];
    /** Curves that were shown before, the oldest first. @type {import("./ghosts.js").Ghost[]} */
    this.ghosts = [];
    this.perG = this.upwards = 1;
    this.unit = "g";
    this.made = false;
    this.drawing = false;
    element.addEventListener("keydown", (event) => this.key(event));
  }

  build() {
    const B = bokeh();
    this.x = new B.Range1d({start: 0, end: 1});
    this.rotation = figure({height: 290, x_range: this.x, y_range: new B.Range1d({start: -1, end: 1})}, phrase("histories.rotation_plot"));
    this.ground = figure({height: 190, x_range: this.x, y_range: new B.Range1d({start: -1, end: 1}), min_border_bottom: 44}, phrase("histories.ground_plot"));
    this.rotation.left[0].axis_label = phrase("histories.rotation");
    [this.perG, this.unit] = gAxis();
    this.ground.left[0].axis_label = phrase("histories.ground", {unit: this.unit});
    this.rotation.below[0].visible = false;
    for (const each of [this.rotation, this.ground]) this.addTools(each);
    this.glyphs();
    this.cursors = [this.rotation, this.ground].map((plot) => this.vertical(plot));
    this.grid = B.Plotting.gridplot([[this.rotation], [this.ground]], {sizing_mode: "stretch_width", toolbar_location: null, merge_tools: false});
    void showPlot(this.grid, this.element);
    this.x.properties.start.change.connect(() => this.ranged());
    this.x.properties.end.change.connect(() => this.ranged());
    this.made = true;
  }

  /** Heights of both plots. @param {number} rotation @param {number} ground */
  size(rotation, ground) {
    if (!this.made) this.build();
    this.rotation.height = rotation;
    this.ground.height = ground;
    this.element.style.minHeight = `${rotation + ground}px`;
  }

  /** @param {any} plot */
  addTools(plot) {
    const B = bokeh();
    if (!coarse()) {
      const zoom = new B.BoxZoomTool({dimensions: "width"});
      zoom.overlay.setv({fill_color: colour("accent"), fill_alpha: 0.12, line_color: colour("accent"), line_dash: []});
      const wheel = new B.WheelZoomTool({dimensions: "width", modifiers: {ctrl: true}});
      plot.add_tools(zoom, wheel);
      plot.toolbar.setv({active_drag: zoom, active_scroll: wheel});
    }
    plot.on_event("mousemove", (/** @type {any} */ event) => this.point(event.x));
    plot.on_event("mouseleave", () => this.tell.cursor?.(null));
    plot.on_event("tap", (/** @type {any} */ event) => { if (this.tell.pick) this.tell.pick(this.scale.time(event.x)); else this.point(event.x); });
  }

  /** @param {any} plot */
  vertical(plot) {
    const span = new (bokeh().Span)({dimension: "height", location: NaN, line_width: 1, visible: false});
    plot.add_layout(span);
    themed(() => { span.line_color = colour("accent"); });
    return span;
  }

  /** @param {string} name @param {string[]} columns */
  source(name, columns) {
    const data = Object.fromEntries(columns.map((column) => [column, new Float64Array(0)]));
    this.sources[name] = new (bokeh().ColumnDataSource)({data, name: `${this.element.id}-${name}`});
    return this.sources[name];
  }

  glyphs() {
    const B = bokeh();
    /** @type {(() => void)[]} */
    const paints = [];
    /** @param {any} plot @param {any} glyph @param {any} source @param {(glyph: any) => void} paint */
    const add = (plot, glyph, source, paint) => {
      plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph, level: "glyph"}));
      paints.push(() => paint(glyph));
    };
    const F = (/** @type {string} */ field) => ({field});
    add(this.rotation, new B.VStrip({x0: F("from"), x1: F("to"), line_width: 1}), this.source("rest", ["from", "to"]),
      (glyph) => glyph.setv({fill_color: colour("rest"), line_color: colour("edge")}));
    add(this.rotation, new B.MultiLine({xs: F("xs"), ys: F("ys"), line_alpha: F("alpha"), line_width: 1}), this.source("ghosts", ["xs", "ys", "alpha"]),
      (glyph) => { glyph.line_color = colour("ink"); });
    for (const [k, name] of [...NAMES.entries()].reverse()) {
      const [ink, ground] = k === 0 ? ["ink", "ground"] : ["second", "second"];
      if (k === 0) {
        const source = this.source("vertical", ["x", "y", "plus", "minus"]);
        add(this.ground, new B.Line({x: F("x"), y: F("y"), line_width: 0.9}), source, (glyph) => { glyph.line_color = colour("vertical"); });
        for (const side of ["plus", "minus"]) {
          add(this.ground, new B.Line({x: F("x"), y: F(side), line_width: 0.9, line_dash: [5, 3]}), source, (glyph) => { glyph.line_color = colour("ink"); });
        }
      }
      add(this.ground, new B.Line({x: F("x"), y: F("y"), line_width: 1}), this.source(`${name}-ground`, ["x", "y"]),
        (glyph) => { glyph.line_color = colour(ground); });
      if (k === 0) for (const sign of SIGNS) {
        const source = this.source(`beyond${sign}`, ["x", "y", "level", "line"]);
        add(this.ground, new B.VArea({x: F("x"), y1: F("y"), y2: F("level")}), source, (glyph) => { glyph.fill_color = colour("accent"); });
        add(this.ground, new B.Line({x: F("x"), y: F("line"), line_width: 1.2}), source, (glyph) => { glyph.line_color = colour("accent"); });
      }
      add(this.rotation, new B.Line({x: F("x"), y: F("y"), line_width: k === 0 ? 1.4 : 1.6, line_dash: k === 0 ? [] : [6, 3]}), this.source(name, ["x", "y"]),
        (glyph) => { glyph.line_color = colour(ink); });
      const marks = {angle: Math.PI / 2, size: 11, line_width: 1, marker: {value: "dash"}};
      add(this.rotation, new B.Scatter({x: F("x"), y: F("y"), ...marks}), this.source(`${name}-impact`, ["x", "y"]),
        (glyph) => { glyph.line_color = colour(ink); });
    }
    add(this.rotation, new B.Scatter({x: F("x"), y: F("y"), marker: {value: "triangle"}, size: 8, line_color: null}), this.source("uplift", ["x", "y"]),
      (glyph) => { glyph.fill_color = colour("accent"); });
    this.levels = {balance: [0, 1].map(() => this.level(this.rotation, [7, 3, 2, 3], "over")), threshold: [0, 1].map(() => this.level(this.ground, [5, 3], "ink"))};
    for (const plot of [this.rotation, this.ground]) this.level(plot, [], "soft").location = 0;
    themed(() => paints.forEach((paint) => paint()));
  }

  /** @param {any} plot @param {number[]} dash @param {string} name */
  level(plot, dash, name) {
    const span = new (bokeh().Span)({dimension: "width", location: NaN, line_width: 0.9, line_dash: dash, level: "underlay"});
    plot.add_layout(span);
    themed(() => { span.line_color = colour(name); });
    return span;
  }

  /** Draw one response, or two over each other.
   * @param {{window: {from: number, to: number}, duration: number}} header @param {Drawn} first @param {Drawn | null} [second] */
  draw({window: {from, to}, duration}, first, second = null) {
    if (!this.made) this.build();
    this.window = [from, to];
    this.whole = duration;
    this.drawn = [first, second];
    this.thresholds = first.block.thresholds_g.map((each) => this.perG * each);
    /** What the vertical acceleration is drawn with, which the weight has over the block's own gravity. */
    this.upwards = this.perG * first.block.gravity_g;
    this.scale = new Scale(from, to);
    const {dataset} = this.element, origin = String(this.scale.origin), unit = String(this.scale.unit);
    if (dataset.origin !== origin || dataset.unit !== unit) Object.assign(dataset, {origin, unit});
    this.drawing = true;
    for (const plot of [this.rotation, this.ground]) plot.hold_render = true;
    // Where another window is asked for already, the axis stays there: a wheel turns on from it.
    const [left, right] = this.tell.load().next ? this.wanted() : this.window;
    this.x.setv({start: this.scale.plotted(left), end: this.scale.plotted(right)});
    this.ground.below[0].axis_label = this.scale.label;
    let low = 0, high = 0;
    for (const [k, drawn] of this.drawn.entries()) {
      const name = NAMES[k];
      if (!drawn) { this.clear(name); continue; }
      const {lines, block: {sides}} = drawn;
      const y = lines.rotation.map((each) => each / sides[each >= 0 ? 0 : 1].alpha);
      for (const each of y) { if (each < low) low = each; if (each > high) high = each; }
      this.sources[name].data = {x: this.scale.all(lines.time, from), y};
      this.sources[`${name}-ground`].data = {x: this.scale.all(lines.ground_time, from), y: lines.ground_g.map((each) => this.perG * each)};
    }
    this.drawGhosts();
    this.drawThresholds(first.lines);
    this.frame(low, high);
    const rests = first.rest;
    const ends = Array.from({length: rests.length / 2}, (_, k) => [rests[2 * k], rests[2 * k + 1]]);
    const seen = ends.filter(([start, end]) => end > from && start < to);
    this.sources.rest.data = {
      from: Float64Array.from(seen, ([start]) => this.scale.plotted(Math.max(start, from))),
      to: Float64Array.from(seen, ([, end]) => this.scale.plotted(Math.min(end, to))),
    };
    for (const plot of [this.rotation, this.ground]) plot.hold_render = false;
    this.drawing = false;
  }

  /** Both plots as they are drawn, and what their colours mean. @param {"svg" | "png"} form @param {[string, string][]} entries */
  async picture(form, entries) {
    const drawn = bokeh().index.find_one(this.grid).export(form);
    return withLegend(await drawn.to_blob(), entries, this.rotation.outer_width, this.rotation.outer_height + this.ground.outer_height, 1);
  }

  drawGhosts() {
    const {ghosts} = this, source = this.sources.ghosts;
    if (!ghosts.length && !source.data.xs.length) return;
    source.data = {
      xs: ghosts.map(({from, time}) => this.scale.all(time, from)), ys: ghosts.map(({y}) => y),
      alpha: ghosts.map((_, k) => 0.08 + (0.24 * (k + 1)) / ghosts.length),
    };
  }

  /** What of the ground motion is beyond the threshold of a side; under a vertical component, that and the thresholds, which it moves.
   * @param {Lines} lines */
  drawThresholds({weight}) {
    const {x, y} = this.sources[`${NAMES[0]}-ground`].data;
    const [plus, minus] = this.thresholds;
    for (const level of this.levels.threshold) level.visible = !weight;
    if (weight) this.sources.vertical.data = {x, y: weight.map((each) => this.upwards * (each - 1)), plus: weight.map((each) => minus * each), minus: weight.map((each) => -plus * each)};
    else this.empty("vertical");
    for (const sign of SIGNS) {
      const still = sign > 0 ? minus : plus;
      const found = weight ? beyond(x, y, sign, still, weight) : beyond(x, y, sign, still);
      if (found.x.length) this.sources[`beyond${sign}`].data = found;
      else this.empty(`beyond${sign}`);
    }
  }

  /** Remove the line of a response, its ground motion and its impacts. @param {string} name */
  clear(name) {
    for (const each of [name, `${name}-ground`, `${name}-impact`]) this.empty(each);
  }

  /** Remove what a source holds; one that is empty would be painted again for nothing. @param {string} name */
  empty(name) {
    const source = this.sources[name], {data} = source;
    if (Object.values(data)[0].length) source.data = Object.fromEntries(Object.keys(data).map((column) => [column, new Float64Array(0)]));
  }

  /** Heights of both plots, and the marks at their bottom. @param {number} low @param {number} high */
  frame(low, high) {
    const [bottom, top] = [Math.max(low, -1.6), Math.min(high, 1.6)];
    const span = top - bottom || (this.drawn[0]?.lines.rotation.length ? 1e-3 : 1);
    const [start, end] = [bottom - 0.24 * span, top + 0.08 * span];
    this.rotation.y_range.setv({start, end});
    let peak = 0;
    for (const drawn of this.drawn) for (const each of drawn?.lines.ground_g ?? []) peak = Math.max(peak, Math.abs(this.perG * each));
    for (const each of this.drawn[0]?.lines.weight ?? []) peak = Math.max(peak, Math.abs(this.upwards * (each - 1)));
    const shown = 1.1 * Math.max(peak, Math.min(...this.thresholds, peak || Infinity) || 0.1);
    this.ground.y_range.setv({start: -shown, end: shown});
    this.levels.balance.forEach((each, k) => { each.location = k ? -1 : 1; });
    const [plus, minus] = this.thresholds;
    this.levels.threshold[0].location = minus;
    this.levels.threshold[1].location = -plus;
    const from = this.window[0];
    for (const [k, drawn] of this.drawn.entries()) {
      if (!drawn) continue;
      const x = this.scale.all(drawn.lines.impact, from);
      const height = start + (0.045 + 0.075 * k) * (end - start);
      this.sources[`${NAMES[k]}-impact`].data = {x, y: new Float64Array(x.length).fill(height)};
    }
    const uplifts = (this.drawn[0]?.uplift ?? new Float64Array(0)).filter((each) => each >= this.window[0] && each <= this.window[1]);
    this.sources.uplift.data = {
      x: uplifts.map((each) => this.scale.plotted(each)),
      y: new Float64Array(uplifts.length).fill(start + 0.15 * (end - start)),
    };
  }

  /** The range was changed by a tool. */
  ranged() {
    if (this.drawing) return;
    window.clearTimeout(this.waiting);
    /** @type {[number, number]} */
    const ends = [this.scale.time(this.x.start), this.scale.time(this.x.end)]; // what is drawn until then changes the range, too
    this.waiting = window.setTimeout(() => this.go(ends), 30);
  }

  /** Ask for another window. @param {[number, number] | null} ends */
  go(ends) {
    if (ends) {
      const width = Math.max(ends[1] - ends[0], NARROWEST);
      const middle = 0.5 * (ends[0] + ends[1]);
      ends = [Math.max(0, middle - 0.5 * width), Math.min(this.whole, middle + 0.5 * width)];
      if (!(ends[1] > ends[0])) return;
    }
    this.tell.window(ends);
  }

  /** The window that is asked for, which may not be drawn yet; the one that is drawn where nothing is asked of it.
   * @returns {[number, number]} */
  wanted() { return within(this.tell.asked(), this.whole) ?? this.window; }

  /** @param {string} how */
  async zoom(how) {
    if (!this.tell.asked()) await this.tell.load().idle; // where it moves is known when that is drawn
    const [from, to] = this.wanted();
    const width = to - from, middle = 0.5 * (from + to);
    if (how === "all") this.go([0, this.whole]);
    else if (how === "active") this.go(null);
    else if (how === "in") this.go([middle - 0.25 * width, middle + 0.25 * width]);
    else if (how === "out") this.go([Math.max(0, middle - width), Math.min(this.whole, middle + width)]);
    else {
      const shift = Math.min(Math.max((how === "left" ? -0.25 : 0.25) * width, -from), this.whole - to);
      if (shift !== 0) this.go([from + shift, to + shift]);
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || (event.shiftKey && event.key.startsWith("Arrow"))) return;
    const how = {"+": "in", "=": "in", "-": "out", "−": "out", ArrowLeft: "left", ArrowRight: "right", "0": "active"}[event.key];
    if (!how) return;
    event.preventDefault();
    void this.zoom(how);
  }

  /** Show where the cursor is, if it is anywhere. @param {number | null} time */
  mark(time) {
    if (!this.made) return;
    for (const span of this.cursors) span.setv({location: time === null ? NaN : this.scale.plotted(time), visible: time !== null});
  }

  /** The pointer is here. @param {number} x */
  point(x) {
    const time = this.scale.time(x);
    this.mark(time);
    this.tell.cursor?.(time);
  }
}

/** Points of a ground motion beyond a threshold, one before and one after each stretch, and the area between.
 * @param {Float64Array} x @param {Float64Array} y @param {number} sign @param {number} still threshold without vertical motion @param {Float64Array} [weight] */
function beyond(x, y, sign, still, weight) {
  /** @type {number[]} */
  const seen = [];
  let before = false, over = x.length > 0 && sign * y[0] > (weight ? still * weight[0] : still);
  for (let k = 0; k < x.length; k += 1) {
    const after = k + 1 < x.length && sign * y[k + 1] > (weight ? still * weight[k + 1] : still);
    // Between two stretches the area is of no height, and the line has a gap.
    if (seen.length && !over && !before && after) seen.push(-k - 1);
    if (before || over || after) seen.push(k);
    before = over;
    over = after;
  }
  const count = seen.length;
  const found = {x: new Float64Array(count), y: new Float64Array(count), level: new Float64Array(count), line: new Float64Array(count)};
  seen.forEach((place, n) => {
    const k = place < 0 ? -place - 1 : place;
    const level = sign * still * (weight ? weight[k] : 1);
    const height = sign * y[k] > sign * level ? y[k] : level;
    found.x[n] = x[k];
    found.y[n] = height;
    found.level[n] = level;
    found.line[n] = place < 0 ? NaN : height;
  });
  return found;
}

/** Value of a line at a time. @param {Float64Array} times @param {Float64Array} values @param {number} time */
export function at(times, values, time) {
  let low = 0, high = times.length - 1;
  if (high < 0 || time < times[0] || time > times[high]) return 0;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle; else high = middle;
  }
  const part = times[high] > times[low] ? (time - times[low]) / (times[high] - times[low]) : 0;
  return values[low] + part * (values[high] - values[low]);
}
