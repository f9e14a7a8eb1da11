// The case in the phase plane, and its energy over time: drawn only where somebody sees them.

import {Latest, payload} from "./api.js";
import {Scale, at} from "./histories.js";
import {bokeh, colour, figure, showPlot, themed} from "./theme.js";
import {counted, legend, one} from "./words.js";
import {short} from "./numbers.js";
import {phrase} from "./texts.js";

/** What leaves the frame: past it a block only falls. */
const FARTHEST = 1.6;
const F = (/** @type {string} */ field) => ({field});

export class PhasePanel {
  /** @param {any} page @param {(time: number) => void} pick is told of a time that was clicked */
  constructor(page, pick) {
    this.page = page;
    this.pick = pick;
    this.visible = false;
    this.scale = new Scale(0, 1);
    /** What is drawn, as a text. */
    this.drawn = "";
    /** @type {any} */
    this.lines = null;
    /** @type {number | null} */
    this.time = null;
    /** @type {Record<string, any>} */
    this.sources = {};
    this.latest = new Latest(() => this.bring(), (error) => page.problem(error, "view-phase"));
    // Words stand before the plots do, so that nothing below moves when these are drawn.
    legend("phase-legend", [
      ["line", phrase("phase.legend_course")], ["jump", phrase("phase.legend_jump")], ["uplift", phrase("legend.uplift")], ["rest", phrase("phase.legend_rest")],
      ["balance", phrase("phase.legend_balance")], ["potential", phrase("phase.legend_potential")], ["second", phrase("phase.legend_kinetic")],
    ]);
    new IntersectionObserver((entries) => {
      this.visible = entries[entries.length - 1].isIntersecting;
      this.update();
      this.mark(this.time); // what is not seen is not marked
    }, {threshold: 0.15}).observe(one("phase-plots"));
  }

  /** Draw the case in its window, if that is seen and not drawn already. */
  update() {
    this.page.problem(null, "view-phase"); // it was about what was shown before
    if (this.visible && this.page.shown && this.wanted() !== this.drawn) void this.latest.ask();
  }

  wanted() {
    const {from, to} = this.page.shown.header.window;
    return JSON.stringify([this.page.state.good.texts, from, to]);
  }

  async bring() {
    if (!this.page.shown) return;
    const wanted = this.wanted();
    const {window: {from, to}, duration} = this.page.shown.header;
    if (!(duration > from)) return;
    const {header, arrays} = await payload("/api/phase", {...this.page.state.good.texts, from: String(from), to: String(to)});
    this.lines = {...header, ...arrays};
    this.drawn = wanted;
    if (!this.plane) this.build();
    this.draw();
    if (this.visible && this.page.shown && this.wanted() !== this.drawn) void this.latest.ask(); // it changed back meanwhile
    counted("phases");
  }

  build() {
    const B = bokeh();
    const range = () => new B.Range1d({start: -1, end: 1});
    const made = (/** @type {string} */ label) => figure({height: 330, x_range: range(), y_range: range(), min_border_bottom: 46}, label);
    /** @param {any} plot @param {string} name @param {string[]} columns @param {any} glyph @param {() => Record<string, any>} colours */
    const add = (plot, name, columns, glyph, colours) => {
      this.sources[name] = new B.ColumnDataSource({data: Object.fromEntries(columns.map((each) => [each, []])), name: `phase-${name}`});
      plot.add_renderers(new B.GlyphRenderer({data_source: this.sources[name], glyph}));
      themed(() => glyph.setv(colours()));
    };
    /** @param {any} plot @param {string} name @param {string} ink @param {Record<string, any>} [look] */
    const line = (plot, name, ink, look) => add(plot, name, ["x", "y"], new B.Line({x: F("x"), y: F("y"), line_width: 1.2, ...look}), () => ({line_color: colour(ink)}));
    const mark = (/** @type {string} */ marker, /** @type {number} */ size) => new B.Scatter({x: F("x"), y: F("y"), size, marker: {value: marker}});
    /** @param {any} plot @param {string} dimension @param {string} ink @param {Record<string, any>} [look] */
    const span = (plot, dimension, ink, look) => {
      const drawn = new B.Span({dimension, location: 0, line_width: 1, level: "underlay", ...look});
      plot.add_layout(drawn);
      themed(() => { drawn.line_color = colour(ink); });
      return drawn;
    };

    this.plane = made(phrase("phase.plane"));
    this.plane.below[0].axis_label = phrase("histories.rotation");
    this.plane.below[0].ticker.desired_num_ticks = 5;
    this.plane.left[0].axis_label = phrase("phase.velocity");
    for (const dimension of ["width", "height"]) span(this.plane, dimension, "grid");
    line(this.plane, "boundary", "over", {line_dash: [7, 3, 2, 3]});
    add(this.plane, "jumps", ["before", "after"], new B.Segment({x0: 0, x1: 0, y0: F("before"), y1: F("after"), line_width: 1.6, line_dash: [2, 3]}), () => ({line_color: colour("ground")}));
    line(this.plane, "course", "ink");
    add(this.plane, "rest", ["x", "y"], mark("square", 9), () => ({fill_color: colour("rest"), line_color: colour("ink")}));
    add(this.plane, "uplift", ["x", "y"], mark("triangle", 7), () => ({fill_color: colour("accent"), line_color: null}));
    add(this.plane, "now", ["x", "y"], mark("circle", 9), () => ({fill_color: colour("second"), line_color: colour("paper")}));

    this.energy = made(phrase("phase.energy_plot"));
    this.energy.left[0].axis_label = phrase("phase.energy");
    this.levels = [0, 1].map(() => span(this.energy, "width", "over", {line_dash: [7, 3, 2, 3], visible: false}));
    add(this.energy, "impact", ["x", "y"], new B.Scatter({x: F("x"), y: F("y"), angle: Math.PI / 2, size: 9, line_width: 1, marker: {value: "dash"}}), () => ({line_color: colour("ink")}));
    line(this.energy, "potential", "ground");
    line(this.energy, "kinetic", "second", {line_dash: [6, 3]});
    line(this.energy, "total", "ink", {line_width: 1.6});
    this.cursor = span(this.energy, "height", "accent", {level: "overlay", visible: false});
    this.energy.on_event("tap", (/** @type {any} */ event) => this.pick(this.scale.time(event.x)));
    void showPlot(this.plane, one("case-plane"));
    void showPlot(this.energy, one("energy"));
  }

  draw() {
    const {window: {from, to}, needed, time, rotation, velocity, kinetic, potential, before, boundary_x: x, boundary_y: y, uplift, rest} = this.lines;
    this.scale = new Scale(from, to);
    this.energy.below[0].axis_label = this.scale.label;
    this.total = potential.map((/** @type {number} */ each, /** @type {number} */ k) => each + kinetic[k]);
    const {sources} = this;
    sources.course.data = {x: parted(rotation, before), y: parted(velocity, before)};
    sources.jumps.data = {before: Float64Array.from(before, (k) => velocity[k]), after: Float64Array.from(before, (k) => velocity[k + 1])};
    sources.boundary.data = {x, y};
    for (const [name, times] of Object.entries({uplift, rest})) sources[name].data = times.length ? {x: [0], y: [0]} : {x: [], y: []};
    const times = this.scale.all(time, from);
    for (const [name, values] of Object.entries({total: this.total, potential, kinetic})) sources[name].data = {x: times, y: values};
    for (const [range, values] of /** @type {[any, Float64Array][]} */ ([[this.plane.x_range, rotation], [this.plane.y_range, velocity]])) {
      const [low, high] = ends(values);
      const margin = 0.07 * (high - low) || 0.1;
      range.setv({start: low - margin, end: high + margin});
    }
    const highest = Math.min(ends(this.total)[1], 2 * Math.max(...needed)) || 1;
    const levels = needed.filter((/** @type {number} */ each, /** @type {number} */ k) => each < 1.6 * highest && needed.indexOf(each) === k);
    this.levels?.forEach((each, k) => each.setv({visible: k < levels.length, location: levels[k] ?? 0}));
    const top = 1.08 * Math.max(highest, ...levels);
    this.energy.y_range.setv({start: -0.06 * top, end: top});
    this.energy.x_range.setv({start: this.scale.plotted(from), end: this.scale.plotted(to)});
    sources.impact.data = {x: Float64Array.from(before, (k) => times[k]), y: new Float64Array(before.length).fill(-0.03 * top)};
    const share = short(ends(this.total)[1]);
    this.plane.html_attributes = {role: "img", "aria-label": phrase("phase.plane_about")};
    this.energy.html_attributes = {role: "img", "aria-label": phrase("phase.energy_about", {share})};
    one("energy-about").textContent = phrase("phase.greatest", {share, impacts: before.length ? phrase("phase.impacts", {count: before.length}) : phrase("phase.no_impact")});
    this.mark(this.time);
  }

  /** Show where the response is at a time. @param {number | null} time */
  mark(time) {
    this.time = time;
    if (!this.lines || !this.visible) return;
    const {window: {from, to}, time: times, rotation, velocity} = this.lines;
    const inside = time !== null && time >= from && time <= to;
    this.cursor?.setv({visible: inside, location: inside ? this.scale.plotted(time) : 0});
    this.sources.now.data = inside ? {x: [at(times, rotation, time - from)], y: [at(times, velocity, time - from)]} : {x: [], y: []};
  }
}

/** A line with a gap after each of these places. @param {Float64Array} values @param {Float64Array} places */
function parted(values, places) {
  const out = new Float64Array(values.length + places.length);
  let done = 0;
  places.forEach((place, k) => {
    out.set(values.subarray(done, place + 1), done + k);
    out[place + 1 + k] = NaN;
    done = place + 1;
  });
  out.set(values.subarray(done), done + places.length);
  return out;
}

/** Least and greatest of values within the frame. @param {Float64Array} values @returns {[number, number]} */
function ends(values) {
  let low = 0, high = 0;
  for (const each of values) { if (each < low) low = each; if (each > high) high = each; }
  return [Math.max(low, -FARTHEST), Math.min(high, FARTHEST)];
}
