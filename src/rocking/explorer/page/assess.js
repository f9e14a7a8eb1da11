// The list of records, and the assessment of the block under them.

import {Latest, file, json, payload} from "./api.js";
import {Chart} from "./chart.js";
import {make, one} from "./standalone/dom.js";
import {writeAddress} from "./state.js";
import {short, typed} from "./numbers.js";
import {counted} from "./texts.js";
import {acceleration, axisUnit, velocity, withUnit} from "./units.js";
import {idOf, questions} from "./records.js";
import {csv, offer} from "./save.js";

/** @typedef {import("./records.js").Row} Row */

const FIELDS = ["measure", "measure_period", "level_from", "level_to", "levels"];
/** What a heading sorts by. @type {[string, (row: Row) => number | string][]} */
const COLUMNS = [["Record", (row) => row.title], ...["pga", "pgv", "significant", "duration"].map((name) => /** @type {[string, (row: Row) => number]} */ ([{pga: "PGA", pgv: "PGV", significant: "5–95 %", duration: "Length"}[name] ?? "", (row) => row.measures?.[name] ?? -1]))];
const RESULTS = ["As it is", "Overturned first at"];

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.list = page.list;
    this.latest = new Latest(() => this.run(), (error) => page.problem(error, "view-assess"));
    /** @type {import("./api.js").Payload | null} */
    this.found = null;
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
      if (this.found) this.update();
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

  leave() {}

  /** The case has changed: results of another case are no longer shown. */
  restart() { if (this.found) this.update(); }

  update() { void this.latest.ask(); }

  fields() {
    const given = /** @type {import("./api.js").Texts} */ ({measure: "pga", measure_period: "1", ...this.page.state.assessment});
    for (const name of FIELDS) one(name).value = given[name] ?? "";
    one("measure_period").parentElement.hidden = given.measure !== "sa";
  }

  remember() {
    this.page.state.assessment.records = this.list.entries();
    writeAddress(this.page.state);
  }

  async run() {
    this.remember();
    const {texts, assessment} = this.page.state, given = {...texts, ...assessment, records: assessment.records || ";"}, ids = this.list.rows().filter((/** @type {Row} */ row) => this.list.has(row)).map((/** @type {Row} */ row) => idOf(row.texts));
    document.body.dataset.assessment = "running";
    one("assess-progress").hidden = false;
    try {
      const found = this.found = await payload("/api/assessment", given);
      this.results = new Map(found.header.records.map((/** @type {any} */ row) => [ids[row.number], row]));
    } finally { one("assess-progress").hidden = true; }
    this.paint();
    this.files(given);
    document.body.dataset.assessment = "complete";
  }

  paint() {
    if (!this.found) return;
    const {header: {label, statements, failures}, arrays: {levels, share, at, probability, lower, upper}} = this.found, [scale, unit] = axisUnit("m/s^2");
    const by = (/** @type {ArrayLike<number>} */ values) => Array.from(values, (each) => each * scale), across = at && by(at);
    one("assessed").hidden = false;
    this.chart.show({x: {low: 0, high: 1.02 * levels[levels.length - 1] * scale, label: `${label} (${unit})`}, y: {low: -0.03, high: 1.03, label: "probability of overturning"}, layers: [
      ...(lower ? [{class: "band", area: [across, lower, upper]}] : []), ...(at ? [{class: "line accent", line: [across, probability]}] : []), {class: "dot ink", dots: [by(levels), share]},
    ], legend: [...(at ? [["line accent", "line", "fitted lognormal"]] : []), ...(lower ? [["band", "area", "confidence band, 90 %"]] : []), ["dot ink", "dot", "share of simulations"]]});
    one("statements").replaceChildren(...[...statements, ...failures.map((/** @type {string} */ each) => `Not assessed: ${each}`)].map((text) => make("li", {}, [text])));
    this.render();
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
      ...groups.map((/** @type {any} */ group) => make("tbody", {}, [this.head(group, withResults), ...group.rows.map((/** @type {Row} */ row) => this.row(row, withResults))])));
    if (focus) document.getElementById(focus)?.focus({preventScroll: true});
    const {files = 0, most_files: most = 0, bytes = 0, most_bytes: size = 0} = list.usage, chosen = list.rows().filter((/** @type {Row} */ row) => list.has(row)).length;
    one("assess").textContent = `Assess over ${counted(chosen, "record")}`;
    one("usage").textContent = `${counted(list.rows().length, "record")}. ${files} of at most ${most} files are kept, ${short(bytes / 2 ** 20, 2)} of ${short(size / 2 ** 20)} MiB.`;
    one("missing").replaceChildren(...questions(list.rows(), (rows, name, value) => void this.page.answer(rows, name, value)));
  }

  /** @param {any} group @param {boolean} withResults */
  head({title, reason, rows}, withResults) {
    const [{key}] = rows;
    return make("tr", {class: "station"}, [make("th", {scope: "rowgroup", colspan: COLUMNS.length + 2 + (withResults ? RESULTS.length : 0)}, [title, ...(reason ? [make("small", {}, [` ${reason}`])] : []),
      ...(key ? [" ", make("button", {type: "button", class: "link", "aria-label": `Remove ${title}`, on: {click: () => this.remove(rows)}}, ["remove"])] : [])])]);
  }

  /** @param {Row} row @param {boolean} withResults */
  row(row, withResults) {
    const {measures, title, texts} = row, id = idOf(texts), found = this.results.get(id), isOwn = id === idOf(this.page.state.texts);
    const box = make("input", {type: "checkbox", id: `tick-${id}`, disabled: !measures, "aria-label": `Assess ${title}`, on: {change: () => { this.list.tick([row], box.checked); this.remember(); this.render(); }}});
    box.checked = this.list.has(row);
    const open = make("button", {type: "button", class: "link", id: `open-${id}`, disabled: !measures, "aria-current": isOwn ? "true" : null, title: "Shake the block with it", on: {click: () => this.page.restate(this.list.put(this.page.state.texts, row), "shake")}}, [title]);
    const values = measures ? [acceleration(measures.pga), velocity(measures.pgv), `${short(measures.significant)} s`, `${short(measures.duration)} s`] : ["?", "?", "?", "?"];
    const results = !withResults ? [] : !found ? ["", ""] : [found.undecided ? "undecided" : found.overturned ? "overturns" : `peak ${short(found.peak_over_alpha)} α`, found.overturns_at === null ? `above ${acceleration(found.stands_up_to)}` : `${acceleration(found.stands_up_to)} to ${acceleration(found.overturns_at)}`];
    return make("tr", {}, [box, open, ...values, ...results, ""].map((cell) => make("td", {}, [cell])));
  }

  /** @param {Row[]} rows */
  async remove(rows) {
    try { for (const key of new Set(rows.map(({key: each}) => each))) await json("/api/remove", {key}); } catch (error) { this.page.problem(error, "view-assess"); }
    if (this.list.ticked) this.list.tick(rows, false);
    await this.page.reload();
    this.render();
  }

  /** @param {import("./api.js").Texts} given of the assessment */
  files(given) {
    if (!this.found) return;
    const {header: {python, records, measure}, arrays} = this.found, name = `rocking-assessment-${measure}`, plain = (/** @type {number | null} */ each) => each ?? Infinity;
    const curve = () => csv([[`${measure}_m_s2`, "probability", "lower", "upper"], ...Array.from(arrays.at ?? [], (each, k) => [Number(each), arrays.probability[k], arrays.lower?.[k] ?? NaN, arrays.upper?.[k] ?? NaN])]);
    const rows = () => csv([["record", "overturns", "peak_over_slenderness", "stands_up_to_m_s2", "overturns_at_m_s2"], ...records.map((/** @type {any} */ row) => [row.name, row.undecided ? "undecided" : String(row.overturned), plain(row.peak_over_alpha), row.stands_up_to, plain(row.overturns_at)])]);
    const whole = (/** @type {string} */ form) => () => file("/api/export", {...given, form});
    offer([[`${name}.html`, "Report, HTML", whole("report.html")], [`${name}.nc`, "All, NetCDF", whole("assessment.nc")], [`${name}.svg`, "Figure, SVG", () => this.chart.file("svg")], [`${name}.png`, "Figure, PNG", () => this.chart.file("png")], [`${name}.csv`, "Curve, CSV", async () => curve()], [`${name}-records.csv`, "Records, CSV", async () => rows()]], python, null, this.page, "rocking assess reads the objects from a table: rocking assess --help");
  }
}
