// Guided tours: each step shows a case, names something on the page and outlines it.

import {make, one, put} from "./dom.js";
import {readCase} from "./case.js";

/** Step: its words, the address of its case, what is done, the panel that is open, and what is outlined.
 * @typedef {{words: string, case?: string, play?: boolean, ask?: boolean, at?: "gone" | "peak" | "lift", panel?: string, ends?: [string, [number, number]], mark?: string}} Step */
/** @type {{title: string, steps: Step[], question: string}[]} */
const TOURS = [
  {
    title: "A statue in a museum",
    steps: [
      {words: "A statue as slender as a book on its edge, 0.24 m by 1.1 m, under a record of the Ridgecrest earthquake. Will it fall?", case: "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=3.3", ask: true, mark: "#ask"},
      {words: "Watch it rock: each change of side is an impact, which takes energy.", play: true, mark: "#scene"},
      {words: "Drag the knob on the ground motion up, until the statue falls.", mark: "#strip"},
    ],
    question: "Would a statue of twice the size, but the same shape, fall in the same earthquake? Try it with the top and the side.",
  },
  {
    title: "Housner's tank: size matters",
    steps: [
      {words: "A block 0.3 m wide and 1.2 m high falls under this pulse.", case: "width=0.3&height=1.2&motion=one-sine:amplitude=3.4,frequency=1.2", play: true, mark: "#scene"},
      {words: "One of the same shape and ten times the size hardly moves. In 1960, tall tanks stood in Chile where small objects fell.", case: "width=3&height=12&motion=one-sine:amplitude=3.4,frequency=1.2", play: true, mark: "#scene"},
      {words: "Both lift at the same acceleration, width divided by height. The large one only turns more slowly: see the balance in the time line.", mark: "#strip"},
    ],
    question: "Which pulse overturns the large block at the same amplitude: a longer or a shorter one?",
  },
  {
    title: "The critical sine",
    steps: [
      {words: "A slender block under two and a half cycles of a sine, 2 % above uplift. It rocks, and rests again between: infinitely many impacts in a finite time.", case: "width=0.2462&height=1.2144&restitution=0.92&model=linear&motion=sine:amplitude=2.0006,frequency=0.78445,cycles=5", play: true, mark: "#strip"},
      {words: "Drag a from 1.0 to 1.1. Above a critical amplitude near the middle, the block no longer comes to rest between the lobes.", panel: "numbers", ends: ["a", [1, 1.1]], mark: "#n-a"},
    ],
    question: "What happens to the critical amplitude if the restitution is smaller?",
  },
  {
    title: "Rest, and then fall",
    steps: [
      {words: "Under this record the block rests, is lifted again, and falls in a later pulse.", case: "width=0.24&height=1.1&motion=el-centro-meloland-270&pga=2.9", play: true, mark: "#scene"},
      {words: "From the moment of no return nothing can save it. Press its time.", at: "gone", mark: "#why"},
    ],
    question: "Which of the lobes of this record overturns it, and why not the largest?",
  },
  {
    title: "More is not worse",
    steps: [
      {words: "In the map, the block falls in the coloured region. Its edge is not a simple line.", case: "width=0.4&height=1.6&motion=one-sine:amplitude=6,frequency=2", panel: "map", mark: "#map canvas"},
      {words: "Drag the ring upwards at this length: the block falls, stands again, and falls.", panel: "map", mark: "#map canvas"},
      {words: "Therefore the page names the smallest amplitude that overturns it, and does not promise that all larger ones do.", mark: "#headline"},
    ],
    question: "Why can a larger pulse save the block? Watch in which direction it moves when the second half of the pulse arrives.",
  },
  {
    title: "Two sides",
    steps: [
      {words: "The mass of this block is off its middle. To the right it is slender, to the left stocky.", case: "width=0.5&height=1.6&offset=0.06&motion=one-sine:amplitude=2.6,frequency=1", play: true, mark: "#scene"},
      {words: "Drag the mass to the other side: the same pulse then meets the other corner first.", mark: "#scene"},
    ],
    question: "Where must the mass be for the block to stand the largest pulse?",
  },
];

export class Tours {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.root = one("tours");
    this.tour = -1;
    this.list();
  }

  list() {
    this.tour = -1;
    this.mark();
    this.root.replaceChildren(make("h2", {}, ["Tours"]), make("ul", {class: "tours"}, TOURS.map(({title}, k) => make("li", {}, [make("button", {type: "button", on: {click: () => this.go(k, 0)}}, [title])]))));
  }

  /** @param {number} tour @param {number} step */
  go(tour, step) {
    const {title, steps, question} = TOURS[tour], {page} = this;
    Object.assign(this, {tour, step});
    const ended = step >= steps.length, next = (tour + 1) % TOURS.length, words = make("p", {tabindex: -1}, [ended ? question : steps[step].words]);
    const buttons = ended
      ? [make("button", {type: "button", on: {click: () => this.list()}}, ["All tours"]), make("button", {type: "button", class: "main", on: {click: () => this.go(next, 0)}}, [`Next: ${TOURS[next].title}`])]
      : [make("button", {type: "button", disabled: step ? null : "", on: {click: () => this.go(tour, step - 1)}}, ["Back"]), make("button", {type: "button", class: "main", on: {click: () => this.go(tour, step + 1)}}, ["Next"])];
    const chosen = ended ? {} : steps[step];
    const before = steps.slice(0, step + 1).findLast((each) => each.case)?.case;
    if (!ended && before && (chosen.case || this.shown !== before)) { page.show(readCase(before), Boolean(chosen.ask)); this.shown = before; }
    page.open(chosen.panel ?? "tours");
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

  update() {
    if (this.tour < 0) return;
    put(this.root, {});
  }
}
