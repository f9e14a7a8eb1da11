// Cases that somebody has pinned, each with a name: the storage of this origin keeps them, so that they outlive a reload.

import {Problem} from "./api.js";
import {make, one, say} from "./words.js";
import {phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{name: string, texts: Texts}} Snapshot */

const KEPT = "rocking-snapshots";
const MOST = 8, LONGEST = 120;

/** @param {any} each @returns {each is Snapshot} */
const isSnapshot = (each) => typeof each?.name === "string" && each.texts !== null && typeof each.texts === "object" &&
  Object.values(each.texts).every((text) => typeof text === "string");

/** Where nothing can be kept, as in a frame of some browsers, they are known until the page is closed. @type {Snapshot[]} */
let known = [];
read();

/** Read what is kept, which other tabs change, too. */
function read() {
  try {
    const found = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    known = Array.isArray(found) ? found.filter(isSnapshot).slice(0, MOST) : [];
  } catch { /* as said above */ }
}

/** @returns {Snapshot[]} */
export const snapshots = () => known;

/** Whether two cases have the same texts. @param {Texts} one_ @param {Texts} other */
const same = (one_, other) => JSON.stringify(Object.entries(one_).sort()) === JSON.stringify(Object.entries(other).sort());

/** The pinned case that has these texts. @param {Texts} texts */
export const pinnedAs = (texts) => known.find((each) => same(each.texts, texts));

/** The name of a case, numbered where another case is pinned under it. @param {Snapshot} given */
function unused({name, texts}) {
  const numbered = (/** @type {number} */ k) => (k > 1 ? phrase("snapshots.numbered", {name, number: String(k)}) : name);
  let k = 1;
  while (known.some((each) => each.name === numbered(k) && !same(each.texts, texts))) k += 1;
  return numbered(k);
}

export class Snapshots {
  /** @param {{now: () => Snapshot | null, open: (texts: Texts) => void, changed: () => void, problem: (error: unknown) => void}} page the present
   * case with a name for it, what opens another, and what is told that others are pinned, or what went wrong */
  constructor(page) {
    this.page = page;
    this.name = /** @type {HTMLInputElement} */ (make("input", {type: "text", id: "pin-name", maxLength: LONGEST, hidden: true, "aria-label": phrase("snapshots.name"),
      on: {keydown: (/** @type {KeyboardEvent} */ event) => this.key(event)}}));
    this.button = /** @type {HTMLButtonElement} */ (make("button", {type: "button", id: "pin", on: {click: () => this.pin()}}, [phrase("snapshots.pin")]));
    this.chips = make("span", {className: "chips"});
    one("snapshots").replaceChildren(this.chips, this.name, this.button);
    /** The case for which a name is asked. @type {Snapshot | null} */
    this.asked = null;
    window.addEventListener("storage", ({key}) => { if (key === KEPT) { read(); this.changed(); } });
    this.show();
  }

  /** Ask for a name, and with that keep the case as it was then. */
  pin() {
    if (!this.asked) {
      this.asked = this.page.now();
      if (!this.asked) return;
      this.name.value = unused(this.asked);
      this.name.hidden = false;
      this.button.textContent = phrase("snapshots.keep");
      this.name.select();
      return;
    }
    read();
    if (known.length >= MOST) { // another tab may have pinned the last one
      this.page.problem(new Problem(phrase("snapshots.full", {count: MOST})));
      return;
    }
    const {texts} = this.asked, name = unused({name: this.name.value.trim() || this.asked.name, texts});
    this.keep((all) => [...all.filter((each) => each.name !== name), {name, texts}]);
    say(phrase("snapshots.pinned", {name}));
    this.close();
  }

  close() {
    this.asked = null;
    this.page.problem(null);
    this.name.hidden = true;
    this.button.textContent = phrase("snapshots.pin");
    this.focus();
  }

  /** Let the keys go on here; the button is off where no more cases can be kept. */
  focus() { (this.button.disabled ? this.chips.querySelector("button") : this.button)?.focus(); }

  /** @param {Snapshot} gone */
  remove(gone) {
    this.keep((all) => all.filter(({name}) => name !== gone.name));
    say(phrase("snapshots.removed", {name: gone.name}));
    this.focus();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.key === "Escape") this.close();
    if (event.key !== "Enter") return;
    event.preventDefault(); // or the same key presses the button that has the focus afterwards
    this.pin();
  }

  /** @param {(all: Snapshot[]) => Snapshot[]} change of what is kept */
  keep(change) {
    read();
    known = change(known).slice(-MOST);
    try { localStorage.setItem(KEPT, JSON.stringify(known)); } catch { /* as said above */ }
    this.changed();
  }

  changed() {
    this.show();
    this.page.changed();
  }

  show() {
    this.chips.replaceChildren(...known.map((each) => make("span", {className: "chip"}, [
      make("button", {type: "button", title: phrase("snapshots.return"), on: {click: () => this.page.open({...each.texts})}}, [each.name]),
      make("button", {type: "button", className: "remove", "aria-label": phrase("snapshots.remove", {name: each.name}), on: {click: () => this.remove(each)}}, ["×"]),
    ])));
    this.button.disabled = known.length >= MOST;
    this.button.title = this.button.disabled ? phrase("snapshots.full", {count: MOST}) : "";
  }
}
