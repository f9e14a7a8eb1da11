// Guided tours: each step shows a case, names something on the page and outlines it.

import {make, one} from "./dom.js";
import {readCase} from "./case.js";

/** Step: its words, the address of its case, what is done, the panel that is open, and what is outlined.
 * @typedef {{words: string, case?: string, play?: boolean, ask?: boolean, at?: "gone" | "peak" | "lift", panel?: string, ends?: [string, [number, number]], mark?: string}} Step */
/** @type {{title: string, steps: Step[], question: string}[]} */
const TOURS = [
  {
    title: "A statue in a museum",
    steps: [
      {words: "A statue 0.24 m wide and 1.1 m high, under a record of the Ridgecrest earthquake of 2019. Will it fall?", case: "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=4", ask: true, mark: "#ask"},
      {words: "Each change of side is an impact, which takes energy.", play: true, mark: "#scene"},
      {words: "Drag the knob on the ground motion up, until the statue falls.", mark: "#strip"},
    ],
    question: "Does a statue of the same shape and twice the size fall in the same earthquake?",
  },
  {
    title: "Housner's tank: the effect of size",
    steps: [
      {words: "A block 0.3 m wide and 1.2 m high falls under this pulse.", case: "width=0.3&height=1.2&motion=one-sine:amplitude=3.4,frequency=1.2", play: true, mark: "#scene"},
      {words: "A block of the same shape and ten times the size hardly turns. In the earthquakes of 1960 in Chile, tall tanks stood where smaller objects fell.", case: "width=3&height=12&motion=one-sine:amplitude=3.4,frequency=1.2", play: true, mark: "#scene"},
      {words: "Both lift at the same acceleration, because width divided by height is equal. However, the large block turns more slowly, and the pulse is over too soon.", mark: "#strip"},
    ],
    question: "Which pulse of the same amplitude overturns the large block: a longer or a shorter one?",
  },
  {
    title: "The critical sine",
    steps: [
      {words: "A slender block under a sine 2 % above uplift. It rocks and rests in each half cycle: infinitely many impacts in a finite time.", case: "width=0.730609&height=3.604203&restitution=0.92&model=linear&motion=sine:amplitude=2.00056,frequency=0.63662,cycles=2.5", play: true, mark: "#strip"},
      {words: "Drag a from 1.0 to 1.1. Beyond a critical amplitude, the block no longer rests while the ground moves. Near 1.1 it falls.", panel: "numbers", ends: ["a", [1, 1.1]], mark: "#n-a"},
    ],
    question: "How does the critical amplitude change if you reduce the restitution?",
  },
  {
    title: "Rest, and then fall",
    steps: [
      {words: "The block rocks, rests for more than a second, and falls in a later part of the same record.", case: "width=0.2&height=1&motion=ridgecrest-clc-090&pga=4.2", play: true, mark: "#scene"},
      {words: "After this moment it falls, even if the ground stops at once.", at: "gone", mark: "#strip"},
    ],
    question: "A program that takes small steps in time may miss this rest. Would its block fall, too?",
  },
  {
    title: "The error of a threshold",
    steps: [
      {words: "This block stands. Each of its rests is proven.", case: "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=4.903325", play: true, mark: "#strip"},
      {words: "Many programs put a block to rest when its velocity is below a threshold: here 0.02 of p times slenderness. Now it falls, which is wrong.", case: "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=4.903325&chattering=velocity=0.02", mark: "#headline"},
    ],
    question: "Does a smaller threshold always correct the outcome? Try it under Numbers.",
  },
  {
    title: "A stronger pulse may save it",
    steps: [
      {words: "Pulses in the coloured region overturn the block. The edge of this region is not a simple line.", case: "width=0.4&height=1.6&motion=one-sine:amplitude=4.4,frequency=2", panel: "map", mark: "#map canvas"},
      {words: "Drag the ring straight up. The block falls, stands again near 1.4 g, and falls.", panel: "map", mark: "#map canvas"},
      {words: "Therefore the page reports the smallest amplitude that overturns the block, and does not claim that all larger ones do.", mark: "#headline"},
    ],
    question: "In which direction does the block move when the second half of the pulse begins?",
  },
  {
    title: "Two different sides",
    steps: [
      {words: "The mass of this block is off its middle: it is slender to the right, and stocky to the left.", case: "width=0.5&height=1.6&offset=0.06&motion=one-sine:amplitude=3.4,frequency=1", play: true, mark: "#scene"},
      {words: "Drag the mass to the other side of the middle. The same pulse then overturns the block.", mark: "#scene"},
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
    /** @type {string | undefined} */
    this.shown = undefined;
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
    /** @type {Partial<Step>} */
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

  update() {}
}
