// The page: one state, in its address; forms that change it, and three tabs that show it.

import {Problem} from "./api.js";
import {one, put} from "./standalone/dom.js";
import {BlockForm, ModelForm, MotionForm, announce} from "./forms.js";
import {RecordList, isMesh, sendFile} from "./records.js";
import {Shake, figuresOf} from "./shake.js";
import {View as Assess} from "./assess.js";
import {View as MapView} from "./map.js";
import {View as Periodic} from "./periodic.js";
import {copyButtons, figures} from "./save.js";
import {readAddress, specification, writeAddress} from "./state.js";
import {angle, caseName, ofG, unitFields} from "./units.js";
import {short} from "./numbers.js";

/** @typedef {import("./api.js").Texts} Texts */

/** How long the case must stay as it is before a map or an assessment is computed again, ms. */
const PAUSE = 400;
const TITLES = /** @type {Record<string, string>} */ ({shake: "Shake", map: "Map", periodic: "Periodic motion", assess: "Assess"});

class Page {
  constructor() {
    this.state = readAddress();
    this.list = new RecordList();
    this.list.read(this.state);
    /** @type {import("./api.js").Payload | null} */
    this.shown = null;
    /** What is wrong at each place, by its id. @type {Map<string, string>} */
    this.problems = new Map();
    const changed = (/** @type {Texts} */ texts, /** @type {string[]} */ replaced) => this.changed(texts, replaced);
    this.forms = {block: new BlockForm(one("block-form"), changed, this.list), motion: new MotionForm(one("motion-form"), changed, this.list, () => this.reload()), model: new ModelForm(one("model-form"), changed)};
    this.shake = new Shake(this);
    this.views = /** @type {Record<string, any>} */ ({shake: this.shake, map: new MapView(this), periodic: new Periodic(this), assess: new Assess(this)});
    for (const button of document.querySelectorAll("[data-tab]")) button.addEventListener("click", () => this.go(/** @type {any} */ (button).dataset.tab === "explore" ? this.explored ?? "map" : /** @type {any} */ (button).dataset.tab));
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => this.go(/** @type {any} */ (button).dataset.view));
    one("settings").addEventListener("submit", (/** @type {Event} */ event) => event.preventDefault());
    one("to-settings").addEventListener("click", () => this.sheet(!document.body.classList.contains("sheet")));
    addEventListener("keydown", ({key}) => { if (key === "Escape") this.sheet(false); });
    addEventListener("popstate", () => { this.state = readAddress(); this.list.read(this.state); this.showForms(); void this.shake.load.ask(); this.go(this.state.view, false); });
    copyButtons();
    unitFields(() => writeAddress(this.state));
    this.takeFiles();
  }

  async start() {
    try { await this.reload(); } catch (error) { this.problem(error, "settings"); }
    this.showForms();
    void this.shake.load.ask();
    this.go(this.state.view, false);
    document.body.inert = false;
    document.body.dataset.ready = String(performance.now());
  }

  showForms() { for (const form of Object.values(this.forms)) form.show(this.state.texts); }

  /** Load the list of records. */
  async reload() {
    await this.list.load();
    this.forms.motion.show(this.state.texts);
    this.views.assess?.render();
  }

  /** Take an answer about files. @param {import("./records.js").Row[]} rows @param {string} name @param {string} value */
  answer(rows, name, value) { return this.forms.motion.answer(rows, name, value).catch((error) => this.problem(error, "view-assess")); }

  /** Texts that stand for all those that they replace. @param {Texts} given @param {string[]} replaced */
  changed(given, replaced) {
    const {state} = this, before = state.texts;
    state.texts = {...Object.fromEntries(Object.entries(before).filter(([name]) => !replaced.includes(name))), ...given};
    if (replaced.includes("motion") && before.motion !== state.texts.motion) state.window = state.at = null;
    this.shake.stop();
    void this.shake.load.ask();
    const view = this.views[state.view];
    if (view === this.shake) return;
    view.leave();
    window.clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => (view.restart ?? view.update).call(view), PAUSE);
  }

  /** Show another case, in a view. @param {Texts} texts @param {string} [view] */
  restate(texts, view = this.state.view) {
    this.state.window = this.state.at = null;
    writeAddress(this.state);
    this.changed(texts, Object.keys(this.state.texts));
    this.showForms();
    this.go(view);
    if (view !== "shake") writeAddress(this.state, {step: true});
  }

  /** The case of the state is shown. */
  accepted() {
    const {state, shown} = this;
    if (!shown) return;
    writeAddress(state, {soon: true});
    one("to-block").hidden = !specification.block_page;
    one("to-block").href = `/block#${new URLSearchParams(state.texts)}`;
    this.forms.block.show(state.texts, shown.header.block);
    document.title = `${TITLES[state.view]}: ${caseName(shown.header)} – rocking explorer`;
  }

  /** @param {any} header of the case */
  summary(header) {
    one("verdict").textContent = header.verdict;
    figures(one("figures"), figuresOf(header));
    const sides = header.block.sides.map((/** @type {any} */ {p, alpha, restitution}, /** @type {number} */ k) => `p = ${short(p)} rad/s, α = ${angle(alpha)}, η = ${short(restitution)}; lifts above ${ofG(header.block.thresholds_g[k])}`);
    one("derived").textContent = sides[0] === sides[1] ? `${sides[0]}.` : `Right: ${sides[0]}. Left: ${sides[1]}.`;
    const notes = [...header.block.notes, ...(header.motion?.notes ?? [])];
    one("notes").hidden = !notes.length;
    one("notes").replaceChildren(...notes.map((note) => Object.assign(document.createElement("li"), {textContent: note})));
  }

  /** Show a view. @param {string} name @param {boolean} [step] whether it is an entry of the browser's history */
  go(name, step = true) {
    window.clearTimeout(this.waiting);
    const {state} = this;
    if (state.view !== name) { this.views[state.view].leave(); writeAddress(state); }
    state.view = name;
    if (name === "map" || name === "periodic") this.explored = name;
    const tab = name === "map" || name === "periodic" ? "explore" : name, mark = (/** @type {Element} */ button, /** @type {boolean} */ on) => (on ? button.setAttribute("aria-current", "page") : button.removeAttribute("aria-current"));
    for (const button of document.querySelectorAll("[data-tab]")) { mark(button, /** @type {any} */ (button).dataset.tab === tab); one(`view-${/** @type {any} */ (button).dataset.tab}`).hidden = /** @type {any} */ (button).dataset.tab !== tab; }
    for (const button of document.querySelectorAll("[data-view]")) { mark(button, /** @type {any} */ (button).dataset.view === name); one(`view-${/** @type {any} */ (button).dataset.view}`).hidden = /** @type {any} */ (button).dataset.view !== name; }
    document.body.dataset.view = name;
    for (const place of this.problems.keys()) if (place !== "settings") this.problem(null, place);
    writeAddress(state, {step});
    this.views[name].enter();
    this.accepted();
  }

  /** Say what is wrong, or that nothing is, and mark the field. @param {unknown} error @param {string} place id of the element that contains the field */
  problem(error, place) {
    if (error instanceof DOMException && error.name === "AbortError") return;
    if (error && !(error instanceof Problem)) console.error(error);
    const sentence = error instanceof Problem ? error.message : error ? `The page has a fault: ${error}` : null, argument = error instanceof Problem ? error.argument : null;
    this.problems.delete(place);
    if (sentence) this.problems.set(place, sentence);
    for (const each of document.querySelectorAll(`[data-refused="${place}"]`)) for (const name of ["aria-invalid", "aria-errormessage", "data-refused"]) each.removeAttribute(name);
    if (argument) {
      const name = CSS.escape(argument), fields = `[data-argument="${name}"], [data-other="${name}"]`;
      for (const each of [...one(place).querySelectorAll(fields), ...one("settings").querySelectorAll(fields)]) if (each.checkVisibility()) put(each, {"aria-invalid": "true", "aria-errormessage": "problem", "data-refused": place});
    }
    one("main").classList.toggle("stale", this.problems.has("settings") && Boolean(this.shown));
    one("old").hidden = !(this.problems.has("settings") && this.shown);
    one("problem").textContent = [...this.problems.values()].at(-1) ?? "";
    one("problem").hidden = !this.problems.size;
    if (!error && place === "settings") this.counted("drawn");
  }

  /** Count for whoever waits for it. @param {string} name */
  counted(name) { document.body.dataset[name] = String(Number(document.body.dataset[name] ?? 0) + 1); }

  /** On a phone the settings are a sheet over the lower half. @param {boolean} open */
  sheet(open) {
    document.body.classList.toggle("sheet", open);
    one("to-settings").setAttribute("aria-expanded", String(open));
    one("to-settings").textContent = open ? "Close the settings" : "Block and motion";
  }

  /** Files that are chosen, or dropped on the page: one record or mesh is used at once, several are listed. */
  takeFiles() {
    const input = one("files");
    one("open-files").addEventListener("click", () => input.click());
    input.addEventListener("change", () => { const files = [...(input.files ?? [])]; input.value = ""; void this.take(files); });
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => { event.preventDefault(); void this.take([...(event.dataTransfer?.files ?? [])]); });
  }

  /** @param {File[]} files */
  async take(files) {
    /** @type {string[]} */
    const refused = [];
    /** @type {any[]} */
    const records = [];
    for (const file of files) {
      try {
        const found = await sendFile(file);
        if (isMesh(file.name)) this.forms.block.take(found); else records.push(found);
      } catch (error) { if (error instanceof Problem) refused.push(error.message); else this.problem(error, "settings"); }
    }
    if (records.length) await this.reload();
    announce(`${files.length - refused.length} of ${files.length} files were read.`);
    if (records.length === 1 && files.length === 1 && this.state.view !== "assess") {
      const row = this.list.rows().find(({key}) => key === records[0].key);
      if (row?.missing.length) {
        this.forms.motion.wait(row);
        this.problem(new Problem(`${files[0].name} is not used yet: answer the questions below its name first.`), "settings");
      } else if (row) this.restate(this.list.put(this.state.texts, row));
    } else if (records.length) { if (this.state.view === "assess") this.views.assess.render(); else this.go("assess"); }
    this.problem(refused.length ? new Problem(refused.join("\n")) : null, "main");
    this.counted("taken");
  }
}

void new Page().start();
