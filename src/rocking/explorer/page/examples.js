// Guided examples: each step opens a state by its address, as an entry of the browser's history, and says in a sentence what
// to look at. The sentences, whose numbers Python checks, are in examples.json.

import {json} from "./api.js";
import {namesOf, readAddress, writeAddress} from "./parameters.js";
import {unitsChosen} from "./units.js";
import {begin} from "./visits.js";
import {counted, make, one, tell} from "./words.js";
import {phrase} from "./texts.js";

/** @typedef {{name: string, title: string, about: string, source?: string, steps: {query: string, words: string}[]}} Example */

/** Where Escape belongs to something else. */
const OF_OTHERS = "input[type=text], select, textarea, .settings";

export class Examples {
  /** @param {import("./parameters.js").State} state @param {() => void} revisit shows what the address says
   * @param {(error: unknown) => void} problem is told what went wrong */
  constructor(state, revisit, problem) {
    this.state = state;
    this.revisit = revisit;
    this.problem = problem;
    /** @type {Example[]} */
    this.all = [];
    this.panel = one("examples");
    this.button = one("to-examples");
    this.button.addEventListener("click", () => { if (this.panel.hidden) void this.list(); else this.close(); });
    one("example-next").addEventListener("click", () => this.open(1));
    one("example-previous").addEventListener("click", () => this.open(-1));
    one("example-again").addEventListener("click", () => this.open(0));
    one("example-all").addEventListener("click", () => void this.list());
    one("example-close").addEventListener("click", () => this.close());
    document.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || event.defaultPrevented || this.panel.hidden || this.state.lecture) return;
      if (!(event.target instanceof Element && event.target.closest(OF_OTHERS))) this.close();
    });
  }

  /** Read the examples, once. */
  async read() {
    if (!this.all.length) this.all = await json("/page/examples.json", {}).catch((error) => { this.problem(error); return []; });
  }

  /** The example of the state with its step, where there is one. */
  get now() {
    const {example: chosen} = this.state;
    const example = this.all.find(({name}) => name === chosen?.name);
    const step = example?.steps[(chosen?.step ?? 0) - 1];
    return example && step ? {example, step} : null;
  }

  /** The page opens: an address that names a step but no case is that of the step. */
  async arrive() {
    if (!this.state.example) return;
    await this.read();
    const given = new URLSearchParams(location.search);
    if (this.now && !namesOf().some((name) => given.has(name))) {
      history.replaceState(null, "", `?${this.query()}`);
      Object.assign(this.state, readAddress());
    }
    await this.show();
  }

  /** The address of the step of the state: in the units of the page, and in lecture mode with its block. */
  query() {
    const query = new URLSearchParams(this.now?.step.query);
    for (const [name, unit] of unitsChosen()) query.set(name, unit);
    if (this.state.lecture) { query.set("view", "block"); query.set("lecture", "1"); }
    query.set("example", this.state.example?.name ?? "");
    query.set("step", String(this.state.example?.step));
    return query;
  }

  /** Go so many steps on, and let what is said be heard. @param {number} by */
  open(by) {
    const {example: chosen} = this.state;
    if (!chosen) return;
    this.state.example = {...chosen, step: chosen.step + by};
    begin();
    history.pushState(null, "", `?${this.query()}`);
    this.revisit();
    one("example-words").focus();
  }

  /** Show the list of all examples. */
  async list() {
    await this.read();
    this.leave();
    this.panel.hidden = false;
    this.draw();
    one("examples-list").querySelector("button")?.focus();
  }

  close() {
    this.leave();
    this.panel.hidden = true;
    this.draw();
    this.button.focus();
  }

  /** The address names no example any more. */
  leave() {
    if (!this.state.example) return;
    this.state.example = null;
    begin();
    writeAddress(this.state);
  }

  /** Show what the state says; a list that is open stays. */
  async show() {
    if (this.state.example && !this.all.length) await this.read();
    if (!this.now) this.state.example = null;
    const listed = !this.panel.hidden && one("example").hidden;
    this.panel.hidden = !this.now && !listed;
    this.draw();
  }

  draw() {
    const {now} = this;
    this.button.setAttribute("aria-expanded", String(!this.panel.hidden));
    one("example").hidden = one("example-all").hidden = one("example-next").hidden = one("example-previous").hidden = !now;
    one("examples-list").hidden = Boolean(now);
    one("examples-title").textContent = now
      ? phrase("examples.step", {title: now.example.title, step: this.state.example?.step ?? 1, count: now.example.steps.length}) : phrase("examples.title");
    if (now) {
      tell(one("example-words"), now.step.words);
      one("example-source").hidden = !now.example.source;
      one("example-source").textContent = now.example.source ?? "";
      /** @type {HTMLButtonElement} */ (one("example-previous")).disabled = this.state.example?.step === 1;
      /** @type {HTMLButtonElement} */ (one("example-next")).disabled = this.state.example?.step === now.example.steps.length;
      this.check();
    } else {
      one("examples-list").replaceChildren(...this.all.map((example) => make("li", {}, [
        make("button", {type: "button", on: {click: () => { this.state.example = {name: example.name, step: 1}; this.open(0); }}}, [example.title]), ` ${example.about}`,
      ])));
    }
    counted("examples");
  }

  /** Say so where the page shows another case than that of the step. */
  check() {
    const {now, state} = this;
    if (!now) return;
    const wanted = new URLSearchParams(now.step.query), compared = wanted.get("view") === "compare";
    const same = (/** @type {import("./api.js").Texts} */ texts, prefix = "") => namesOf().every((name) => (texts[name] ?? "") === (wanted.get(prefix + name) ?? ""));
    const shown = (state.lecture || state.view === (wanted.get("view") ?? "response")) && same(state.texts) && (!compared || state.lecture || same(state.other, "other."));
    one("example-left").hidden = shown;
  }
}
