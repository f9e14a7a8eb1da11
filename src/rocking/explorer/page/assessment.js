// What the records of the list say of the case's block: fragility as it is computed, friction, rules of thumb, the margin.

import {Latest, frames, unpacked} from "./api.js";
import {isTyped} from "./controls.js";
import {showExports, withLegend} from "./exports.js";
import {bokeh, colour, figure, showPlot, themed} from "./theme.js";
import {acceleration, accelerationAxis, velocity, withUnit} from "./units.js";
import {counted, fill, legend, make, one, tell, textCell} from "./words.js";
import {NONE, fixed, short, shown, typed} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */

const FIELDS = ["measure", "measure_period", "level_from", "level_to", "levels", "friction"];
const ACCELERATIONS = ["level_from", "level_to"];
/** How long the case must stay as it is before it is assessed, ms. */
const PAUSE = 500;
const F = (/** @type {string} */ field) => ({field});

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.work = new Latest(() => this.stream(), (error) => page.problem(error, "view-assessment"));
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {any} */
    this.about = null;
    /** @type {any} */
    this.last = null;
    /** @type {any} */
    this.sources = null;
    /** @type {any[]} */
    this.rows = [];
    this.key = "";
    this.waiting = 0;
    for (const name of FIELDS) one(name).addEventListener("change", () => this.chosen(name));
    one("to-records").addEventListener("click", () => page.go("records"));
  }

  enter() { this.update(0); }

  leave() {
    window.clearTimeout(this.waiting);
    this.running?.abort();
    this.key = "";
  }

  /** The case has changed. @param {number} [pause] */
  update(pause = PAUSE) {
    window.clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => {
      const key = JSON.stringify([this.page.state.texts, this.page.state.assessment]);
      if (key === this.key) return;
      this.running?.abort();
      this.key = key;
      void this.work.ask();
    }, pause);
  }

  /** @param {string} name */
  chosen(name) {
    const {assessment} = this.page.state;
    const text = typed(/** @type {HTMLInputElement} */ (one(name)).value);
    if (text) assessment[name] = ACCELERATIONS.includes(name) ? withUnit(text) : text; else delete assessment[name];
    if (name === "measure") for (const each of ACCELERATIONS) delete assessment[each];
    this.update(0);
  }

  async stream() {
    this.running = new AbortController();
    const {signal} = this.running, {key} = this;
    const {texts, assessment} = this.page.state;
    const body = document.body.dataset;
    body.assessment = "running";
    const problem = (/** @type {unknown} */ error) => this.page.problem(error, "exports");
    let begun = false; // what was there before stays until then
    try {
      if (!assessment.records) {
        await this.page.list.load();
        signal.throwIfAborted();
        assessment.records = this.page.list.entries();
        this.key = JSON.stringify([texts, assessment]);
      }
      for await (const frame of frames("/api/assessment", {...texts, ...assessment}, signal)) {
        if (!begun) {
          begun = true;
          this.last = null;
          this.rows = [];
          this.about = JSON.parse(new TextDecoder().decode(frame));
          this.page.remember({assessment: {...assessment}});
          this.fill();
          this.facts();
          showExports("assessment", this.about.python, null, [], problem);
          continue;
        }
        this.last = unpacked(/** @type {ArrayBuffer} */ (frame.buffer));
        const {header} = this.last;
        if (header.row) this.rows.push(header.row);
        /** @type {HTMLProgressElement} */ (one("assessment-progress")).value = header.share;
        this.paint();
      }
    } catch (error) {
      if (this.key === key) this.key = "";
      throw error;
    }
    showExports("assessment", this.about.python, null, [
      ["rocking-fragility.svg", phrase("save.svg"), () => this.picture("svg")], ["rocking-fragility.png", phrase("save.png"), () => this.picture("png")],
      ["rocking-fragility.csv", phrase("assessment.curve"), async () => new Blob([this.curve()], {type: "text/csv"})],
      ["rocking-records.csv", phrase("assessment.table"), async () => new Blob([this.table()], {type: "text/csv"})],
    ], problem);
    body.assessment = "complete";
    counted("assessed");
  }

  /** Show what the fields stand for. */
  fill() {
    const {measure, period, levels, friction} = this.about;
    /** @type {Texts} */
    const found = {measure, measure_period: String(period ?? 1), levels: String(levels.length), friction: friction === null ? "" : String(friction)};
    const scale = accelerationAxis()[0];
    found.level_from = shown(levels[0] * scale);
    found.level_to = shown(levels[levels.length - 1] * scale);
    for (const name of FIELDS) {
      const input = /** @type {HTMLInputElement} */ (one(name));
      if (!isTyped(input)) input.value = found[name];
    }
    one("measure-period").hidden = measure !== "sa";
    for (const each of document.querySelectorAll("#view-assessment .of-level")) each.textContent = accelerationAxis()[1];
  }

  /** What is known before anything is computed, and what each rule says of the case's own motion. */
  facts() {
    const {records, notes} = this.about;
    one("assessment-about").textContent = phrase("assessment.listed", {count: records.length, notes: notes.map(inWords).join(" ")});
    this.rules();
    this.base(null);
  }

  paint() {
    if (!this.plot) this.build();
    const {header, arrays} = this.last, {fit, why, outcomes} = header;
    const [scale, unit] = accelerationAxis();
    const by = (/** @type {Float64Array} */ values) => Float64Array.from(values, (each) => each * scale);
    const bounded = fit?.bounded;
    const empty = new Float64Array(0);
    const at = fit ? by(arrays.at) : empty;
    this.sources.band.data = bounded ? {x: at, lower: arrays.lower, upper: arrays.upper} : {x: empty, lower: empty, upper: empty};
    this.sources.line.data = {x: at, y: fit ? arrays.probability : empty};
    const {levels} = this.about, label = inWords(this.about.label);
    this.sources.seen.data = {x: by(levels), y: arrays.seen};
    this.plot.below[0].axis_label = phrase("assessment.axis", {label, unit});
    this.plot.x_range.setv({start: 0, end: 1.02 * levels[levels.length - 1] * scale});
    const interval = (/** @type {(number | null)[]} */ ends, /** @type {(value: number | null) => string} */ written) => phrase("assessment.interval", {low: written(ends[0]), high: ends[1] === null ? "∞" : written(ends[1])});
    const all = this.rows.length === this.about.records.length;
    const sentence = fit
      ? (bounded ? phrase("assessment.fit_bounded", {
        median: acceleration(fit.median), confidence: short(100 * fit.confidence), interval: interval(fit.median_interval, acceleration),
        dispersion: short(fit.dispersion), range: interval(fit.dispersion_interval, (value) => fixed(value, 2)),
      }) : phrase("assessment.fit", {median: acceleration(fit.median), dispersion: short(fit.dispersion)}))
      : all ? inWords(why) : phrase("assessment.no_fit_so_far", {records: this.rows.length, count: this.about.records.length});
    const counts = fit && {exceeded: fit.exceeded, count: outcomes, records: this.rows.length};
    tell(one("assessment-verdict"), sentence);
    // The notes of a fit are the package's own sentences.
    const notes = fit ? fit.notes.map((/** @type {string} */ note) => ` ${note[0].toUpperCase()}${note.slice(1)}.`).join("") : "";
    one("assessment-notes").replaceChildren(fit ? phrase(all ? "assessment.exceeded" : "assessment.exceeded_so_far", counts) : "",
      make("span", {className: "package"}, [notes]));
    this.plot.html_attributes = {role: "img", "aria-label": phrase("assessment.plot_about", {label, sentence})};
    this.records();
    this.rules();
    this.base(header.margin);
  }

  /** What each record does as it is. */
  records() {
    const {friction} = this.about;
    const rows = this.rows.map((row) => [
      this.about.records[row.number], acceleration(row.pga), velocity(row.pgv), row.undecided ? phrase("assessment.undecided") : row.overturns ? phrase("assessment.overturns") : `${short(row.peak_over_slenderness)} α`,
      row.friction_needed === null ? phrase("assessment.leaves") : fixed(row.friction_needed, 3),
      ...(friction === null ? [] : [row.sliding_time === null ? phrase("assessment.holds") : phrase("assessment.slides", {time: fixed(row.sliding_time, 2)})]),
      phrase("assessment.percent", {share: fixed(100 * row.overturned_levels.reduce((/** @type {number} */ sum, /** @type {number} */ each) => sum + each, 0) / row.overturned_levels.length, 0)}),
    ]);
    fill(/** @type {HTMLTableElement} */ (one("assessment-records")), [phrase("assessment.as_is"), phrase("assessment.pga"), phrase("assessment.pgv"), phrase("assessment.peak"), phrase("assessment.friction_needed"),
      ...(friction === null ? [] : [phrase("assessment.with_friction", {friction: short(friction)})]), phrase("assessment.overturned_levels")], rows);
  }

  /** What rules of thumb say beside what is computed. */
  rules() {
    const {rules, thresholds, overturning_velocity: sudden} = this.about;
    const overturned = this.rows.filter(({overturns}) => overturns).length;
    const has = /** @type {Record<string, string>} */ ({
      uplift: acceleration(Math.min(...thresholds)), west: acceleration(Math.min(...thresholds)), ishiyama: phrase("assessment.both", {first: acceleration(Math.min(...thresholds)), second: velocity(0.4 * sudden)}),
    });
    const told = (/** @type {string} */ name, /** @type {number} */ value) => {
      const ratio = short(value, 2);
      if (name === "uplift") return value > 1 ? phrase("assessment.ratio_rocks", {ratio}) : phrase("assessment.ratio_stays", {ratio});
      return value >= 1 ? phrase("assessment.ratio_overturns", {ratio}) : phrase("assessment.ratio_stands", {ratio});
    };
    const listed = (/** @type {string} */ name) => {
      const counts = {under: this.rows.filter(({ratios}) => ratios[name] >= 1).length, count: this.rows.length, overturned};
      return name === "uplift" ? phrase("assessment.list_rocks", counts) : phrase("assessment.list_overturns", counts);
    };
    fill(/** @type {HTMLTableElement} */ (one("assessment-rules")), [phrase("assessment.rule"), phrase("assessment.this_block"), phrase("assessment.this_case"), phrase("assessment.the_list"), phrase("assessment.source")], rules.map((/** @type {any} */ rule) => [
      make("span", {}, [make("b", {}, [phrase(`rule.${rule.name}`)]), ` ${phrase(`rule.${rule.name}_says`)}`]), has[rule.name],
      this.about.case ? told(rule.name, this.about.case.ratios[rule.name]) : NONE,
      this.rows.length ? listed(rule.name) : phrase("assessment.waits"),
      rule.source,
    ]));
  }

  /** What is known of the factor on the case's motion, and apart from that of the case as it is.
   * @param {{factor: number | null, pga: number} | null | undefined} margin */
  margin(margin) {
    if (!margin) return phrase(this.last?.header.share === 1 ? "assessment.not_shaken" : "assessment.at_last");
    const found = phrase(margin.factor ? "assessment.margin_first" : "assessment.no_margin", {level: acceleration(margin.pga)});
    return this.page.shown?.header.overturned ? phrase("assessment.margin_as_is", {found}) : found;
  }

  /** Uplift, friction and margin of the case. @param {{factor: number | null, pga: number} | null | undefined} margin */
  base(margin) {
    const {thresholds, friction_to_rock: needed, friction} = this.about;
    const largest = this.rows.reduce((most, {friction_needed: each}) => Math.max(most, each ?? Infinity), 0);
    const holds = friction === null ? "" : friction < needed ? phrase("assessment.slides_first", {friction: short(friction)}) : phrase("assessment.rocks_first", {friction: short(friction)});
    const rows = [
      [phrase("assessment.uplift"), thresholds[0] === thresholds[1] ? acceleration(thresholds[0]) : phrase("assessment.both", {first: acceleration(thresholds[0]), second: acceleration(thresholds[1])}), phrase("assessment.uplift_about")],
      [phrase("assessment.to_rock"), short(needed), holds || phrase("assessment.below")],
      [phrase("assessment.over_list"), !this.rows.length ? phrase("assessment.waits") : Number.isFinite(largest) ? fixed(largest, 3) : "∞", phrase("assessment.over_list_about")],
      [phrase("assessment.margin"), margin === undefined || (margin === null && !this.last?.header.share) ? phrase("assessment.waits") : margin?.factor ? phrase("assessment.factor", {factor: short(margin.factor)}) : NONE,
        this.margin(margin)],
    ];
    one("assessment-figures").replaceChildren(...rows.map(([name, value, more]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, [value, make("small", {}, [more])])])));
  }

  build() {
    const B = bokeh();
    this.plot = figure({height: 380, x_range: new B.Range1d({start: 0, end: 1}), y_range: new B.Range1d({start: -0.03, end: 1.03}), min_border_bottom: 46}, phrase("assessment.plot"));
    this.plot.left[0].axis_label = phrase("assessment.probability");
    /** @param {any} glyph @param {string[]} fields @param {() => Record<string, any>} colours */
    const add = (glyph, fields, colours) => {
      const source = new B.ColumnDataSource({data: Object.fromEntries(fields.map((each) => [each, []]))});
      this.plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph}));
      themed(() => glyph.setv(colours()));
      return source;
    };
    this.sources = {
      band: add(new B.VArea({x: F("x"), y1: F("lower"), y2: F("upper")}), ["x", "lower", "upper"], () => ({fill_color: colour("rest")})),
      line: add(new B.Line({x: F("x"), y: F("y"), line_width: 2}), ["x", "y"], () => ({line_color: colour("accent")})),
      seen: add(new B.Scatter({x: F("x"), y: F("y"), size: 7}), ["x", "y"], () => ({fill_color: colour("ink"), line_color: null})),
    };
    void showPlot(this.plot, one("fragility"));
    legend("assessment-legend", [["curve", phrase("assessment.fitted")], ["rest", phrase("assessment.band")], ["seen", phrase("assessment.seen")]]);
  }

  /** @param {"svg" | "png"} form @returns {Promise<Blob>} */
  async picture(form) {
    const drawn = bokeh().index.find_one(this.plot).export(form);
    return withLegend(await drawn.to_blob(), [[phrase("assessment.fitted"), colour("accent")], [phrase("assessment.band"), colour("rest")], [phrase("assessment.seen_short"), colour("ink")]], this.plot.outer_width, this.plot.outer_height);
  }

  /** The curve with its band, in SI units. */
  curve() {
    const {at, probability, lower, upper} = this.last.arrays;
    const rows = Array.from(at ?? [], (/** @type {number} */ each, /** @type {number} */ k) => [each, probability[k], lower[k], upper[k]]);
    return [[`${this.about.measure}_m_s2`, "probability", "lower", "upper"], ...rows].map((row) => `${row.join(",")}\n`).join("");
  }

  /** What each record does, in SI units. */
  table() {
    const rows = this.rows.map((row) => [textCell(this.about.records[row.number]), row.pga, row.pgv, row.overturns, row.undecided, row.peak_over_slenderness ?? "inf", row.friction_needed ?? "inf", row.sliding_time ?? ""]);
    return [["record", "pga_m_s2", "pgv_m_s", "overturns", "undecided", "peak_over_alpha", "friction_needed", "sliding_time_s"], ...rows].map((row) => `${row.join(",")}\n`).join("");
  }
}
