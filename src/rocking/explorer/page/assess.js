// The list of records, and what they say of the block: fragility, friction, rules of thumb, and the margin of the case.

import {Latest, json, parts} from "./api.js";
import {Chart} from "./chart.js";
import {make, one} from "./standalone/dom.js";
import {writeAddress} from "./state.js";
import {NONE, fixed, short, shown, typed} from "./numbers.js";
import {counted, phrase, say} from "./texts.js";
import {acceleration, axisUnit, velocity, withUnit} from "./units.js";
import {isTyped} from "./forms.js";
import {idOf, questions} from "./records.js";
import {csv, figures, offer, table} from "./save.js";

/** @typedef {import("./records.js").Row} Row */

const FIELDS = ["measure", "measure_period", "level_from", "level_to", "levels"];
/** What a heading sorts by. @type {[string, (row: Row) => number | string][]} */
const COLUMNS = [["Record", (row) => row.title], ...["pga", "pgv", "significant", "duration"].map((name) => /** @type {[string, (row: Row) => number]} */ ([{pga: "PGA", pgv: "PGV", significant: "5–95 %", duration: "Length"}[name] ?? "", (row) => row.measures?.[name] ?? -1]))];
const RESULTS = ["Peak rotation", "Friction needed", "Levels that overturn"];

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.list = page.list;
    this.latest = new Latest(() => this.run(), (error) => page.problem(error, "view-assess"));
    /** @type {AbortController | null} */
    this.running = null;
    /** @type {any} */
    this.about = null;
    /** @type {any} */
    this.last = null;
    /** Results by the id of the record. @type {Map<string, any>} */
    this.results = new Map();
    /** Sorted column, and whether upwards. @type {[number, boolean] | null} */
    this.order = null;
    this.chart = new Chart(one("fragility"), {label: "Fragility: probability of overturning against intensity", height: 380});
    for (const name of FIELDS) one(name).addEventListener("change", () => {
      const {assessment} = page.state, text = typed(one(name).value);
      if (text) assessment[name] = name.startsWith("level_") ? withUnit(text) : text; else delete assessment[name];
      if (name === "measure") for (const end of ["level_from", "level_to"]) delete assessment[end];
      this.fields();
      if (this.about) this.update();
    });
    one("assess").addEventListener("click", () => this.update());
    one("search").addEventListener("input", () => this.render());
    one("rising").addEventListener("change", () => { this.list.rising = one("rising").checked; this.remember(); });
    one("open-records").addEventListener("click", () => one("files").click());
  }

  enter() {
    one("rising").checked = this.list.rising;
    this.fields();
    this.render();
    if (this.page.state.assessment.records) this.update(); else offer([], "", null, this.page);
  }

  leave() { this.running?.abort(); }

  /** The case has changed: results of another case are no longer shown. */
  restart() {
    this.running?.abort();
    if (this.about) this.update();
  }

  update() {
    this.running?.abort();
    void this.latest.ask();
  }

  fields() {
    const {measure = "pga"} = this.page.state.assessment;
    one("measure").value = measure;
    one("measure_period").parentElement.hidden = measure !== "sa";
  }

  remember() {
    this.page.state.assessment.records = this.list.entries();
    writeAddress(this.page.state);
  }

  async run() {
    this.running = new AbortController();
    const {signal} = this.running, {texts, assessment} = this.page.state;
    document.body.dataset.assessment = "running";
    this.remember();
    for await (const part of parts("/api/assessment", {...texts, ...assessment, records: assessment.records || ";"}, signal)) {
      const {header} = part;
      if (header.records) {
        this.about = header;
        this.last = null;
        this.results = new Map();
        one("assessed").hidden = false;
        this.fill();
        continue;
      }
      this.last = part;
      if (header.row) this.results.set(this.about.ids[header.row.number], header.row);
      one("assess-progress").value = header.share;
      this.paint();
    }
    this.files();
    document.body.dataset.assessment = "complete";
  }

  /** Show what the fields stand for. */
  fill() {
    const {measure, period, levels, python} = this.about, [scale] = axisUnit("m/s^2");
    this.about.ids = this.list.rows().filter((/** @type {Row} */ row) => this.list.has(row)).map((/** @type {Row} */ {texts}) => idOf(texts));
    const found = {measure, measure_period: String(period ?? 1), level_from: shown(levels[0] * scale), level_to: shown(levels[levels.length - 1] * scale), levels: String(levels.length)};
    for (const [name, value] of Object.entries(found)) { const input = one(name); if (!isTyped(input)) input.value = value; }
    offer([], python, null, this.page);
  }

  paint() {
    const {header: {fit, why, outcomes, margin, share}, arrays} = this.last, {levels, records, notes, label} = this.about, [scale, unit] = axisUnit("m/s^2"), rows = [...this.results.values()];
    const by = (/** @type {ArrayLike<number>} */ values) => Array.from(values, (each) => each * scale), at = fit ? by(arrays.at) : [], all = rows.length === records.length;
    this.chart.show({x: {low: 0, high: 1.02 * levels[levels.length - 1] * scale, label: `${label} (${unit})`}, y: {low: -0.03, high: 1.03, label: "probability of overturning"}, layers: [
      ...(fit?.bounded ? [{class: "band", area: [at, arrays.lower, arrays.upper]}] : []), ...(fit ? [{class: "line accent", line: [at, arrays.probability]}] : []), {class: "dot ink", dots: [by(levels), arrays.seen]},
    ], legend: [["line accent", "line", "fitted lognormal"], ["band", "area", "confidence band, 90 %"], ["dot ink", "dot", "share of simulations"]]});
    const range = (/** @type {(number | null)[]} */ [low, high], /** @type {(value: number | null) => string} */ words) => `${words(low)} to ${high === null ? "∞" : words(high)}`;
    one("fit").textContent = fit ? `Half of the records overturn the block at ${acceleration(fit.median)}${fit.bounded ? ` (${short(100 * fit.confidence)} % confidence: ${range(fit.median_interval, acceleration)})` : ""}; the dispersion is ${short(fit.dispersion)}${fit.bounded ? ` (${range(fit.dispersion_interval, (value) => fixed(value, 2))})` : ""}.`
      : all ? say(why) : `No curve can be fitted yet: ${rows.length} of ${counted(records.length, "record")} computed.`;
    const sentences = fit ? fit.notes.map((/** @type {string} */ note) => `${note[0].toUpperCase()}${note.slice(1)}.`) : [];
    one("fit-notes").textContent = [fit ? `${fit.exceeded} of ${counted(outcomes, "simulation")} overturn the block, of ${counted(rows.length, "record")}${all ? "" : " so far"}.` : "", ...sentences, ...notes.map(say)].join(" ");
    this.margins(margin, share, rows);
    this.rules(rows);
    this.render();
  }

  /** Uplift, friction and margin of the case. @param {any} margin @param {number} share @param {any[]} rows */
  margins(margin, share, rows) {
    const {thresholds: [plus, minus], friction_to_rock: needed} = this.about, largest = rows.reduce((most, {friction_needed: each}) => Math.max(most, each ?? Infinity), 0);
    const found = margin?.factor ? `lowest level found: ${acceleration(margin.pga)}` : margin ? `no level up to ${acceleration(margin.pga)} overturns it` : share === 1 ? "no ground motion" : "computed last";
    figures(one("margins"), [
      ["Uplift at the base", plus === minus ? acceleration(plus) : `${acceleration(plus)} and ${acceleration(minus)}`, "g tan α"],
      ["Friction to rock", short(needed), "below it the block slides instead"],
      ["Friction over the list", rows.length ? (Number.isFinite(largest) ? fixed(largest, 3) : "∞") : "…", "for sticking, records as they are"],
      ["Margin of this case", margin?.factor ? `× ${short(margin.factor, 4)}` : NONE, found],
    ]);
  }

  /** @param {any[]} rows */
  rules(rows) {
    const {rules, thresholds, overturning_velocity: sudden, case: own} = this.about, overturned = rows.filter(({overturns}) => overturns).length, first = acceleration(Math.min(...thresholds));
    table(one("rules"), ["Rule", "This block", "This case", "The list", "Source"], rules.map((/** @type {any} */ {name, source}) => {
      const under = rows.filter(({ratios}) => ratios[name] >= 1).length, verb = name === "uplift" ? "rocks" : "may overturn", ratio = own?.ratios[name];
      return [make("span", {}, [make("b", {}, [phrase(`rule.${name}`)]), ` ${phrase(`rule.${name}_says`)}`]), name === "ishiyama" ? `${first} and ${velocity(0.4 * sudden)}` : first,
        own ? `${short(ratio, 2)} ×: ${ratio >= 1 ? verb : "stands"}` : NONE, rows.length ? `${verb} under ${under} of ${rows.length}; computed: ${overturned} overturn` : "…", source];
    }));
  }

  /** The list, with the results of each record. */
  render() {
    const {list} = this, wanted = one("search").value.toLowerCase().split(/\s+/).filter(Boolean), withResults = this.results.size > 0;
    const seen = (/** @type {any} */ group, /** @type {Row} */ row) => wanted.every((/** @type {string} */ word) => `${group.title} ${row.title} ${row.label}`.toLowerCase().includes(word));
    const groups = list.groups.map((/** @type {any} */ group) => ({...group, rows: group.rows.filter((/** @type {Row} */ row) => seen(group, row))})).filter((/** @type {any} */ {rows}) => rows.length);
    if (this.order) {
      const [column, upwards] = this.order, key = COLUMNS[column][1], compare = (/** @type {Row} */ a, /** @type {Row} */ b) => (upwards ? 1 : -1) * (typeof key(a) === "string" ? String(key(a)).localeCompare(String(key(b))) : Number(key(a)) - Number(key(b)));
      for (const {rows} of groups) rows.sort(compare);
      groups.sort((/** @type {any} */ a, /** @type {any} */ b) => compare(a.rows[0], b.rows[0]));
    }
    const sort = (/** @type {number} */ k) => { this.order = this.order?.[0] === k ? [k, !this.order[1]] : [k, k === 0]; this.render(); };
    const focus = document.activeElement?.id;
    one("records").replaceChildren(
      make("thead", {}, [make("tr", {}, [make("td"), ...COLUMNS.map(([words], k) => make("th", {scope: "col", "aria-sort": this.order?.[0] === k ? (this.order[1] ? "ascending" : "descending") : null}, [make("button", {type: "button", class: "link", id: `sort-${k}`, on: {click: () => sort(k)}}, [words])])),
        ...(withResults ? RESULTS : []).map((words) => make("th", {scope: "col"}, [words])), make("td")])]),
      ...groups.map((/** @type {any} */ group) => make("tbody", {}, [this.head(group), ...group.rows.map((/** @type {Row} */ row) => this.row(row, withResults))])));
    if (focus) document.getElementById(focus)?.focus({preventScroll: true});
    const {files = 0, most_files: most = 0, bytes = 0, most_bytes: size = 0} = list.usage, chosen = list.rows().filter((/** @type {Row} */ row) => list.has(row)).length;
    one("assess").textContent = `Assess over ${counted(chosen, "record")}`;
    one("usage").textContent = `${counted(list.rows().length, "record")}. ${files} of at most ${most} files are kept, ${short(bytes / 2 ** 20, 2)} of ${short(size / 2 ** 20)} MiB.`;
    one("missing").replaceChildren(...questions(list.rows(), (rows, name, value) => void this.page.answer(rows, name, value)));
  }

  /** @param {any} group */
  head({title, reason, rows}) {
    const [{key}] = rows;
    return make("tr", {class: "station"}, [make("th", {scope: "rowgroup", colspan: 6}, [title, ...(reason ? [make("small", {}, [` ${reason}`])] : []),
      ...(key ? [" ", make("button", {type: "button", class: "link", "aria-label": `Remove ${title}`, on: {click: () => this.remove(rows)}}, ["remove"])] : [])])]);
  }

  /** @param {Row} row @param {boolean} withResults */
  row(row, withResults) {
    const {measures, title, texts} = row, id = idOf(texts), found = this.results.get(id), isOwn = id === idOf(this.page.state.texts);
    const box = make("input", {type: "checkbox", id: `tick-${id}`, disabled: !measures, "aria-label": `Assess ${title}`, on: {change: () => { this.list.tick([row], box.checked); this.remember(); this.render(); }}});
    box.checked = this.list.has(row);
    const open = make("button", {type: "button", class: "link", id: `open-${id}`, disabled: !measures, "aria-current": isOwn ? "true" : null, title: "Shake the block with it", on: {click: () => this.page.restate(this.list.put(this.page.state.texts, row), "shake")}}, [title]);
    const values = measures ? [acceleration(measures.pga), velocity(measures.pgv), `${short(measures.significant)} s`, `${short(measures.duration)} s`] : ["?", "?", "?", "?"];
    const results = !withResults ? [] : !found ? ["", "", ""] : [found.undecided ? "undecided" : found.overturns ? "overturns" : `${short(found.peak_over_slenderness)} α`, found.friction_needed === null ? "leaves the ground" : fixed(found.friction_needed, 3), `${fixed(100 * mean(found.overturned_levels), 0)} %`];
    return make("tr", {}, [box, open, ...values, ...results, ""].map((cell) => make("td", {}, [cell])));
  }

  /** @param {Row[]} rows */
  async remove(rows) {
    try { for (const key of new Set(rows.map(({key: each}) => each))) await json("/api/remove", {key}); } catch (error) { this.page.problem(error, "view-assess"); }
    if (this.list.ticked) this.list.tick(rows, false);
    await this.page.reload();
    this.render();
  }

  files() {
    const {python, levels, measure} = this.about, {arrays} = this.last, name = `rocking-fragility-${measure}`, plain = (/** @type {number | null} */ each) => each ?? NaN;
    const curve = () => csv([[`${measure}_m_s2`, "probability", "lower", "upper"], ...Array.from(arrays.at ?? [], (each, k) => [Number(each), arrays.probability[k], arrays.lower[k], arrays.upper[k]])]);
    const records = () => csv([["record", "pga_m_s2", "pgv_m_s", measure, "overturns", "peak_over_slenderness", "required_friction", ...levels.map((/** @type {number} */ each) => `overturned_at_${Number(each.toPrecision(6))}`)],
      ...[...this.results.values()].map((row) => [this.about.records[row.number], row.pga, row.pgv, row.measure, row.undecided ? "undecided" : String(row.overturns), plain(row.peak_over_slenderness), row.friction_needed ?? Infinity, ...row.overturned_levels.map(plain)])]);
    offer([[`${name}.svg`, "Figure, SVG", () => this.chart.file("svg")], [`${name}.png`, "Figure, PNG", () => this.chart.file("png")], [`${name}.csv`, "Curve, CSV", async () => curve()], [`${name}-records.csv`, "Records, CSV", async () => records()]], python, null, this.page);
  }
}

/** @param {number[]} all */
const mean = (all) => all.reduce((sum, each) => sum + each, 0) / all.length;
