// Chattering sequences: their rests with brackets, intervals between impacts, and their ratios against eta^2.

import {Latest, json} from "./api.js";
import {within} from "./histories.js";
import {bokeh, colour, figure, showPlot, themed} from "./theme.js";
import {fill, make, one} from "./words.js";
import {NONE, fixed, short, span} from "./numbers.js";
import {phrase} from "./texts.js";

export class ChatteringPanel {
  /** @param {{window: (ends: [number, number]) => void, asked: () => [number, number] | null}} tell
   * @param {(error: unknown) => void} problem is told what went wrong */
  constructor(tell, problem) {
    this.tell = tell;
    /** Texts of the case that is drawn. @type {Record<string, string> | null} */
    this.texts = null;
    this.summary = new Latest(async () => {
      const rows = await json("/api/summary", this.texts ?? {});
      fill(/** @type {HTMLTableElement} */ (one("words")), [], rows);
    }, (error) => { if (error) problem(error); });
    this.chosen = 0;
    this.made = false;
    /** @type {any[]} */
    this.sequences = [];
    one("deeper").addEventListener("click", () => this.zoomToRest());
  }

  /** @param {import("./api.js").Payload} shown @param {Record<string, string>} texts */
  draw(shown, texts) {
    this.shown = shown;
    const rows = shown.arrays.sequence;
    this.sequences = Array.from({length: rows.length / 6}, (_, k) => {
      const [start, end, lower, upper, impacts, off] = rows.subarray(6 * k, 6 * k + 6);
      const before = shown.arrays.uplift.filter((each) => each <= start);
      return {uplift: before.length ? before[before.length - 1] : 0, start, end, lower, upper, impacts, off};
    });
    if (JSON.stringify(this.texts) !== JSON.stringify(texts)) this.chosen = this.longest();
    this.texts = texts;
    this.chosen = Math.min(this.chosen, Math.max(0, this.sequences.length - 1));
    this.list();
    this.plot();
    this.words();
  }

  longest() {
    let best = 0;
    this.sequences.forEach((each, k) => { if (this.count(each) > this.count(this.sequences[best])) best = k; });
    return best;
  }

  /** @param {any} sequence */
  count(sequence) {
    return this.shown ? this.shown.arrays.impact_time.filter((each) => each >= sequence.uplift && each <= sequence.end).length : 0;
  }

  list() {
    const table = /** @type {HTMLTableElement} */ (one("sequences"));
    one("sequence-tools").hidden = !this.sequences.length;
    one("ratios").hidden = !this.sequences.length;
    if (!this.sequences.length) {
      table.replaceChildren(make("caption", {}, [phrase("chattering.none")]));
      return;
    }
    fill(table, ["", phrase("chattering.uplift"), phrase("chattering.complete"), phrase("chattering.rest"), phrase(this.shown?.header.motion ? "chattering.off" : "chattering.off_start"), phrase("chattering.bracket"), phrase("chattering.impacts")], this.sequences.map((each, k) => {
      const proven = Number.isFinite(each.upper);
      const button = make("button", {type: "button", "aria-pressed": String(k === this.chosen), on: {click: () => this.choose(k)}}, [phrase("chattering.show", {number: String(k + 1)})]);
      return [button, fixed(each.uplift, 3), proven ? fixed(each.start, 4) : phrase("chattering.unproven"), fixed(each.end, 9), Number.isFinite(each.off) ? phrase("chattering.within", {span: span(each.off)}) : NONE, proven ? phrase("chattering.within", {span: span(0.5 * (each.upper - each.lower))}) : NONE, fixed(this.count(each), 0)];
    }));
  }

  /** @param {number} number of a sequence */
  choose(number) {
    this.chosen = number;
    one("sequences").querySelectorAll("button").forEach((each, k) => each.setAttribute("aria-pressed", String(k === number)));
    this.plot();
    this.showSequence(this.sequences[number]);
  }

  /** @param {any} sequence */
  showSequence(sequence) {
    const margin = 0.06 * (sequence.end - sequence.uplift);
    this.tell.window([Math.max(0, sequence.uplift - margin), sequence.end + margin]);
  }

  /** Ten times closer to the accumulation point. */
  zoomToRest() {
    const sequence = this.sequences[this.chosen];
    if (!sequence || !this.shown) return;
    const {window, duration} = this.shown.header;
    const [from, to] = within(this.tell.asked(), duration) ?? [window.from, window.to];
    const inside = from <= sequence.end && sequence.end <= to;
    const width = Math.max(1e-10, inside ? 0.1 * (to - from) : sequence.end - sequence.uplift);
    this.tell.window([sequence.end - 0.92 * width, sequence.end + 0.08 * width]);
  }

  /** @param {{from: number, to: number, impacts: number, unresolved: number | null}} window */
  window({from, to, impacts, unresolved}) {
    one("depth").textContent = phrase("chattering.window", {span: span(to - from), count: impacts})
      + (unresolved ? ` ${phrase("chattering.unresolved", {span: span(unresolved)})}` : "");
  }

  build() {
    const B = bokeh();
    // Ranges that follow the data by themselves would paint everything twice.
    this.x = new B.Range1d({start: 0, end: 1});
    this.intervals = figure({height: 232, x_range: this.x, y_range: new B.Range1d({start: 1e-3, end: 1}), y_axis_type: "log", min_border_bottom: 44}, phrase("chattering.interval_plot"));
    this.ratios = figure({height: 232, x_range: this.x, y_range: new B.Range1d({start: 0, end: 1}), min_border_bottom: 44}, phrase("chattering.ratio_plot"));
    this.intervals.left[0].axis_label = phrase("chattering.interval");
    this.ratios.left[0].axis_label = phrase("chattering.ratio");
    for (const plot of [this.intervals, this.ratios]) plot.below[0].axis_label = phrase("chattering.number");
    this.sources = [this.intervals, this.ratios].map((plot) => {
      const source = new B.ColumnDataSource({data: {x: [], y: []}});
      const glyph = new B.Scatter({x: {field: "x"}, y: {field: "y"}, size: 4, line_width: 1});
      plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph}));
      themed(() => glyph.setv({line_color: colour("ink"), fill_color: colour("paper")}));
      return source;
    });
    this.eta = new B.Span({dimension: "width", location: 0, line_width: 1.4});
    this.ratios.add_layout(this.eta);
    themed(() => { if (this.eta) this.eta.line_color = colour("accent"); });
    this.label = new B.Title({text: "", align: "right", text_font_size: "12px", text_font_style: "normal", text_font: "system-ui, sans-serif"});
    this.ratios.title = this.label;
    themed(() => { if (this.label) this.label.text_color = colour("accent"); });
    const narrow = window.matchMedia("(max-width: 700px)");
    const grid = B.Plotting.gridplot([[this.intervals, this.ratios]], {sizing_mode: "stretch_width", toolbar_location: null, merge_tools: false});
    const place = () => { grid.children = [[this.intervals, 0, 0], [this.ratios, ...(narrow.matches ? [1, 0] : [0, 1])]]; };
    narrow.addEventListener("change", place);
    place();
    void showPlot(grid, one("ratios"));
    this.made = true;
  }

  plot() {
    const sequence = this.sequences[this.chosen];
    if (!sequence || !this.shown) return;
    if (!this.made) this.build();
    const {impact_time, interval, ratio} = this.shown.arrays;
    const first = impact_time.findIndex((each) => each >= sequence.uplift);
    const count = this.count(sequence);
    const [intervals, ratios] = [interval, ratio].map((all) => {
      const y = all.subarray(first, first + count);
      const kept = Array.from(y.keys()).filter((k) => Number.isFinite(y[k]) && y[k] > 0);
      return {x: Float64Array.from(kept, (k) => k + 1), y: Float64Array.from(kept, (k) => y[k])};
    });
    const eta = this.shown.header.eta_squared;
    const sorted = Float64Array.from(ratios.y).sort();
    const high = Math.max(eta, sorted[Math.floor(0.95 * sorted.length)] ?? eta), low = Math.min(eta, sorted[Math.floor(0.05 * sorted.length)] ?? eta);
    const margin = Math.max(0.35 * (high - low), 0.02);
    this.ratios.y_range.setv({start: low - margin, end: high + margin});
    this.x?.setv({start: 1 - 0.02 * count, end: count + 0.02 * count});
    if (intervals.y.length) {
      const least = intervals.y.reduce((a, b) => Math.min(a, b)), most = intervals.y.reduce((a, b) => Math.max(a, b));
      const beside = Math.max((most / least) ** 0.05, 1.2);
      this.intervals.y_range.setv({start: least / beside, end: most * beside});
    }
    /** @type {any} */ (this.sources)[0].data = intervals;
    /** @type {any} */ (this.sources)[1].data = ratios;
    if (this.eta) this.eta.location = eta;
    this.label?.setv({text: phrase("chattering.eta", {eta: short(eta, 4)})});
  }

  /** All numbers, once somebody wants to read them. */
  words() {
    if (this.texts && /** @type {HTMLDetailsElement} */ (one("in-words")).open) void this.summary.ask();
  }
}
