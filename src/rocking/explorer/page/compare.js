// Two responses over each other: another treatment of chattering, another block, another motion.

import {Latest, payload} from "./api.js";
import {BlockForm, MotionForm, TreatmentForm} from "./forms.js";
import {Histories} from "./histories.js";
import {offer} from "./exports.js";
import {ends, namesOf, parameter, specification} from "./parameters.js";
import {pinnedAs, snapshots} from "./snapshots.js";
import {colour} from "./theme.js";
import {caseName, treatmentName} from "./units.js";
import {counted, legend, make, one, slug, tell} from "./words.js";
import {short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */

/** What shows a comparison; hidden where nothing is compared. */
const DRAWN = ["compare-verdict", "compare-plots", "compare-legend"];

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.with = /** @type {HTMLSelectElement} */ (one("compare-with"));
    this.with.addEventListener("change", () => { page.state.compare = this.with.value; page.state.other = {}; this.form(); this.update(); });
    this.histories = new Histories(one("compare-plots"), {window: (chosen) => { page.state.window = chosen; this.update(); }, asked: () => page.state.window, load: () => this.load});
    this.load = new Latest(() => this.run(), (error) => page.problem(error, "view-compare"));
    this.restore();
  }

  enter() {
    this.restore(); // what is other may have been left behind in the browser's history
    this.update();
  }

  /** Show what the state says. */
  restore() {
    this.with.value = this.page.state.compare;
    this.form();
  }

  /** Other cases are pinned. */
  repinned() {
    if (this.with.value !== "case") return;
    this.form();
    if (this.page.state.view === "compare") this.update();
  }

  /** The form of what is other. */
  form() {
    const {state} = this.page;
    const {texts} = state;
    const element = make("div");
    one("compare-other").replaceChildren(element);
    const changed = (/** @type {Texts} */ other) => { state.other = other; this.update(); };
    /** @type {Record<string, () => [any, Texts]>} the form of each kind, and the texts with which it starts */
    const kinds = {
      treatment: () => [new TreatmentForm(element, changed, {prefix: "other-", label: phrase("compare.ends_by")}), {chattering: "velocity=0.05"}],
      block: () => [new BlockForm(element, changed, () => this.load.idle, "other-"), larger(texts)],
      case: () => [new PinnedForm(element, changed), snapshots()[0]?.texts ?? {}],
      motion: () => [new MotionForm(element, changed, "other-"), {motion: specification.records.find((/** @type {any} */ each) => each.name !== texts.motion).name, pga: texts.pga ?? "0.4g"}],
    };
    const [form, first] = kinds[this.with.value]();
    if (!Object.keys(state.other).length) state.other = first;
    form.show(state.other);
    this.block = form instanceof BlockForm ? form : null;
  }

  update() {
    void this.load.ask();
  }

  async run() {
    const {state} = this.page;
    const {texts, other: chosen, compare: kind, good} = state, asked = {...texts, ...this.asked()};
    const none = !Object.keys(chosen).length;
    for (const id of DRAWN) one(id).hidden = none;
    if (none) {
      offer([], () => {});
      this.page.remember({other: chosen, compare: kind});
      return;
    }
    const {header, arrays} = await payload("/api/compare", {...asked, ...ends(state)});
    if (state.good !== good || state.view !== "compare") return; // somebody went back, or elsewhere, meanwhile
    if (state.window && state.window[0] >= header.duration) state.window = null; // it was of longer responses
    this.page.remember({other: chosen, compare: kind, window: state.window});
    this.draw(header, arrays, kind, chosen);
    // Both blocks have the gravity of the case.
    if (state.other === chosen) this.block?.show({...chosen, gravity: texts.gravity}, header.cases[1].block.sides);
    this.files(header, kind);
    counted("compared");
  }

  /** @param {any} [header] @param {any} [arrays] @param {string} [kind] of what is compared @param {Texts} [chosen] what is other */
  draw(header, arrays, kind = "", chosen = {}) {
    if (!header) return;
    const [one_, other] = header.cases;
    const none = new Float64Array(0);
    const [first, second] = ["first", "second"].map((name, k) => {
      const lines = /** @type {any} */ (Object.fromEntries(["time", "rotation", "ground_time", "ground_g", "impact"].map((key) => [key, arrays[`${name}_${key}`] ?? none])));
      return {lines, rest: arrays[`${name}_rest`], uplift: none, block: header.cases[k].block};
    });
    first.lines.weight = arrays.first_weight;
    if (!["motion", "case"].includes(kind)) second.lines.ground_time = second.lines.ground_g = none;
    this.histories.draw(header, first, second);
    const name = kind === "treatment" ? treatmentName(other.treatment) : pinnedAs(chosen)?.name;
    const found = {verdict: inWords(other.verdict), difference: difference(one_, other)};
    tell(one("compare-verdict"), (name ? phrase("compare.verdict_named", {name, ...found}) : phrase("compare.verdict", found)).trim());
    legend("compare-legend", [["line", phrase("compare.this")], ["second", phrase("compare.other")], ["rest", phrase("compare.at_rest")], ["impact", phrase("compare.impacts")]]);
  }

  /** What may be saved: both cases, each under its name. @param {any} header @param {string} kind of what is compared */
  files({cases: [first, other]}, kind) {
    const [one_, second] = [caseName(first), kind === "treatment" ? phrase("compare.treated", {name: caseName(other), treatment: treatmentName(other.treatment)}) : caseName(other)];
    const name = `rocking-compare-${slug(one_)}-and-${slug(second)}`;
    /** @type {[string, string][]} */
    const entries = [[phrase("compare.entry_this", {name: one_}), colour("ink")], [phrase("compare.entry_other", {name: second}), colour("second")]];
    const drawn = (/** @type {"svg" | "png"} */ form) => this.histories.picture(form, entries);
    offer([
      [`${name}.svg`, phrase("compare.svg"), () => drawn("svg")], [`${name}.png`, phrase("compare.png"), () => drawn("png")],
    ], (error) => this.page.problem(error, "exports"));
  }

  /** What is asked of the server besides the case and the window. @returns {Texts} */
  asked() {
    const {other, compare} = this.page.state;
    return {...Object.fromEntries(Object.entries(other).map(([name, value]) => [`other.${name}`, value])), compare};
  }
}

/** A choice among the pinned cases. */
class PinnedForm {
  /** @param {HTMLElement} element @param {(texts: Texts) => void} changed */
  constructor(element, changed) {
    this.select = /** @type {HTMLSelectElement} */ (make("select", {id: "other-case", on: {change: () => changed({...snapshots()[Number(this.select.value)].texts})}},
      snapshots().map(({name}, k) => make("option", {value: String(k)}, [name]))));
    element.append(snapshots().length ? make("label", {}, [`${phrase("compare.pinned")} `, this.select]) : phrase("compare.none_pinned"));
  }

  /** @param {Texts} texts */
  show(texts) {
    const found = pinnedAs(texts);
    this.select.value = found ? String(snapshots().indexOf(found)) : "";
  }
}

/** The same shape, half as large again; of a mesh the same body, a quarter turned. @param {Texts} texts @returns {Texts} */
function larger(texts) {
  if (texts.mesh) return {...Object.fromEntries(namesOf("block").filter((name) => texts[name]).map((name) => [name, texts[name]])), azimuth: String((Number(texts.azimuth) + 90) % 360)};
  const factors = /** @type {Record<string, number>} */ ({length: 1.5, position: 1.5, rate: 0.8});
  const resized = (/** @type {string} */ text, factor = 1) =>
    (factor === 1 ? text : text.split(",").map((each) => String(Number((factor * parseFloat(each)).toPrecision(12))) + each.replace(/^[\s\d.eE+-]+/, "")).join(","));
  return Object.fromEntries(namesOf("block").filter((name) => texts[name]).map((name) => [name, resized(texts[name], factors[parameter(name).kind])]));
}

/** @param {any} first @param {any} second */
function difference(first, second) {
  if (first.overturned || second.overturned) return "";
  return phrase("compare.difference", {other: short(second.peak_over_slenderness), this: short(first.peak_over_slenderness)});
}
