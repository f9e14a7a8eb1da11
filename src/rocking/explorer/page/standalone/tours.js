// Guided tours: each step shows a case, names something on the page and outlines it.

import {make, one} from "./dom.js";
import {DATA} from "./kernels.js";

/** Step: its words, the address of its case, what is done, the panel that is open, and what is outlined.
 * @typedef {{words: string, case?: string, play?: boolean, ask?: boolean, at?: "gone" | "peak" | "lift", panel?: string, map?: string, ends?: [string, [number, number]], mark?: string}} Step */
/** @type {{title: string, steps: Step[], question: string}[]} */
const TOURS = DATA.tours ?? [];

export class Tours {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.root = one("tours");
    this.tour = -1;
    /** @type {string | undefined} */
    this.shown = undefined;
    this.list();
  }

  list() {
    this.tour = -1;
    this.mark();
    const links = /** @type {{words: string, case?: string}[]} */ (DATA.class ?? []).map(({words, case: address}) => (address ? make("p", {}, [make("a", {href: `#${address}`}, [words])]) : make("h2", {}, [words])));
    this.root.replaceChildren(...links, make("h2", {}, ["Tours"]), make("ul", {class: "tours"}, TOURS.map(({title}, k) => make("li", {}, [make("button", {type: "button", on: {click: () => this.go(k, 0)}}, [title])]))));
  }

  /** @param {number} tour @param {number} step */
  go(tour, step) {
    const {title, steps, question} = TOURS[tour], {page} = this;
    Object.assign(this, {tour, step});
    const ended = step >= steps.length, next = (tour + 1) % TOURS.length, words = make("p", {tabindex: -1}, [ended ? question : steps[step].words]);
    const buttons = ended
      ? [make("button", {type: "button", on: {click: () => this.list()}}, ["All tours"]), make("button", {type: "button", class: "main", on: {click: () => this.go(next, 0)}}, [`Next: ${TOURS[next].title}`])]
      : [make("button", {type: "button", disabled: step ? null : "", on: {click: () => this.go(tour, step - 1)}}, ["Back"]), make("button", {type: "button", class: "main", on: {click: () => this.go(tour, step + 1)}}, ["Next"])];
    /** @type {Partial<Step>} */
    const chosen = ended ? {} : steps[step];
    const before = steps.slice(0, step + 1).findLast((each) => each.case)?.case;
    if (!ended && before && (chosen.case || this.shown !== before)) { page.show(before, Boolean(chosen.ask)); this.shown = before; }
    page.open(chosen.panel ?? "tours");
    if (chosen.map) page.panels.map.choose(chosen.map);
    const place = chosen.panel ? one(chosen.panel) : this.root;
    this.card?.remove();
    this.card = make("div", {class: "card"}, [make("h2", {}, [title]), make("p", {class: "soft"}, [ended ? "A question" : `Step ${step + 1} of ${steps.length}`]), words, make("p", {class: "buttons"}, buttons)]);
    if (chosen.panel) place.prepend(this.card); else this.root.replaceChildren(this.card);
    if (chosen.ends) page.panels.numbers.limit(...chosen.ends);
    if (chosen.at) page.seek(page.shown.moments.find((/** @type {any} */ each) => each.kind === chosen.at)?.time ?? 0);
    this.mark(ended ? "" : chosen.mark);
    words.focus({preventScroll: true});
    if (chosen.play) page.play();
  }

  /** Outline something, and bring it onto the screen. @param {string} [selector] */
  mark(selector) {
    document.querySelectorAll(".marked").forEach((each) => each.classList.remove("marked"));
    const found = selector ? document.querySelector(selector) : null;
    found?.classList.add("marked");
    found?.scrollIntoView({block: "nearest"});
  }

  update() {}
}
