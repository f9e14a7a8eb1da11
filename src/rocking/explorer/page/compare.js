// Two responses over each other: another end of chattering, another block, another motion.

import {Latest, json, payload} from "./api.js";
import {BlockForm, MotionForm, TreatmentForm} from "./forms.js";
import {Histories} from "./histories.js";
import {fill, make, one, short} from "./words.js";

const FIRST = /** @type {Record<string, Record<string, string>>} */ ({treatment: {chattering: "velocity=0.05"}, block: {}, motion: {}});

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.with = /** @type {HTMLSelectElement} */ (one("compare-with"));
    this.with.value = page.state.compare;
    this.with.addEventListener("change", () => { page.state.compare = this.with.value; page.state.other = {}; this.form(); this.update(); });
    this.histories = new Histories(one("compare-plots"), {window: (ends) => { page.state.window = ends; this.update(); }});
    this.known = "";
    this.load = new Latest(() => this.run());
    this.form();
  }

  enter() { this.update(); }

  /** The form of what is other. */
  form() {
    const {state, offers} = this.page;
    const element = make("div");
    one("compare-other").replaceChildren(element);
    const changed = (/** @type {Record<string, string>} */ texts) => { state.other = texts; this.update(); };
    const {texts} = state;
    if (this.with.value === "treatment") {
      if (!state.other.chattering) state.other = {...FIRST.treatment};
      const form = new TreatmentForm(element, offers, changed, {prefix: "other-", label: "Chattering of the other ends by"});
      form.show(state.other);
    } else if (this.with.value === "block") {
      if (!Object.keys(state.other).length) state.other = this.larger(texts);
      this.block = new BlockForm(element, offers, changed, "other-");
      this.block.show(state.other);
    } else {
      if (!Object.keys(state.other).length) state.other = {motion: offers.records.find((/** @type {any} */ each) => each.name !== texts.motion).name, pga: texts.pga ?? "0.4g"};
      new MotionForm(element, offers, changed, "other-").show(state.other);
    }
    one("schemes-part").hidden = this.with.value !== "treatment";
  }

  /** The same shape, half as large again. @param {Record<string, string>} texts */
  larger(texts) {
    const resized = (/** @type {string} */ text, /** @type {number} */ factor) =>
      text.split(",").map((each) => String(Number((factor * parseFloat(each)).toPrecision(12))) + each.replace(/^[\s\d.eE+-]+/, "")).join(",");
    const LENGTHS = ["width", "height", "offset", "pivots", "height_of_mass", "gyration"];
    const kept = [...LENGTHS, "p", "alpha", "restitution"].filter((name) => texts[name]);
    return Object.fromEntries(kept.map((name) => [name, LENGTHS.includes(name) ? resized(texts[name], 1.5) : name === "p" ? resized(texts[name], 0.8) : texts[name]]));
  }

  update() {
    this.page.remember();
    void this.load.ask();
  }

  async run() {
    const {state} = this.page;
    const ends = state.window ? {from: String(state.window[0]), to: String(state.window[1])} : {};
    const other = Object.fromEntries(Object.entries(state.other).map(([name, value]) => [`other.${name}`, String(value)]));
    try {
      const {header, arrays} = await payload("/api/compare", {...state.texts, ...other, ...ends});
      this.draw(header, arrays);
      this.page.problem(null);
      document.body.dataset.compared = String(Number(document.body.dataset.compared ?? 0) + 1);
      if (this.with.value === "treatment") await this.schemes();
    } catch (error) {
      this.page.problem(error instanceof Error ? error.message : String(error));
    }
  }

  /** @param {any} [header] @param {any} [arrays] */
  draw(header, arrays) {
    if (!header) return;
    const [one_, other] = header.cases;
    const none = new Float64Array(0);
    const lines = (/** @type {string} */ name) => Object.fromEntries(["time", "rotation", "ground_time", "ground_g", "impact"].map((key) => [key, arrays[`${name}_${key}`] ?? none]));
    const first = {lines: lines("first"), rest: arrays.first_rest, uplift: none, sides: one_.block.sides};
    const weight = arrays.first_weight;
    if (weight) first.lines.weight = weight;
    const second = {lines: lines("second"), rest: arrays.second_rest, uplift: none, sides: other.block.sides};
    if (this.with.value !== "motion") second.lines.ground_time = second.lines.ground_g = none;
    this.histories.draw([header.window.from, header.window.to], header.duration, /** @type {any} */ (first), /** @type {any} */ (second), one_.block.thresholds_g);
    this.block?.show(this.page.state.other, other.block.sides);
    one("compare-verdict").textContent = `The other${this.with.value === "treatment" ? ` (${other.treatment})` : ""}: ${this.lower(other.verdict)} ${this.difference(one_, other)}`;
    const legend = [["line", "this case"], ["second", "the other"], ["rest", "this case at rest"], ["impact", "impacts: below, this case; above, the other"]];
    one("compare-legend").replaceChildren(...legend.map(([name, text]) => make("span", {}, [make("i", {className: `key ${name}`}), text])));
  }

  /** @param {string} sentence */
  lower(sentence) { return sentence.charAt(0).toLowerCase() + sentence.slice(1); }

  /** @param {any} first @param {any} second */
  difference(first, second) {
    if (first.overturned !== second.overturned) return "";
    if (first.overturned) return "";
    return `Peak ${short(second.peak_over_slenderness)} α against ${short(first.peak_over_slenderness)} α.`;
  }

  async schemes() {
    const key = JSON.stringify(this.page.state.texts);
    if (this.known === key) return;
    this.known = key;
    const rows = await json("/api/schemes", this.page.state.texts);
    fill(/** @type {HTMLTableElement} */ (one("schemes")), ["", "Treatment", "What it makes of the case"], rows.map((/** @type {any} */ row) => {
      const button = make("button", {type: "button", disabled: row.right === null, "aria-label": `Compare with ${row.label}`, on: {click: () => { this.page.state.other = {chattering: row.text}; this.form(); this.update(); }}}, ["Compare"]);
      const sign = row.right === null ? "" : row.right ? "✓ " : "✗ ";
      return [button, row.label, `${sign}${row.verdict}${row.error ? ` (worst error of a rest ${short(row.error)} s)` : ""}`];
    }));
  }
}
