// Into a map and back out: a rectangle that is drawn, or keys about the mark; its ends become those of the axes.

import {one, say} from "./words.js";
import {phrase} from "./texts.js";

const ENDS = ["x_from", "x_to", "y_from", "y_to"];

export class MapZoom {
  /** @param {any} view */
  constructor(view) {
    this.view = view;
    /** Ends of the axes before each step in; of a study, which has its own cells, what was shown. @type {any[]} */
    this.before = [];
    /** The rectangle of a study that is shown, if it is a part. @type {number[] | undefined} */
    this.shown = undefined;
    one("map-out").addEventListener("click", () => this.out());
    one("map").addEventListener("keydown", (event) => this.key(event));
  }

  /** The rectangle that is shown, or asked for and not drawn yet; its ends to the right and upwards. @returns {number[]} */
  box() {
    const {study, picture, usual, page: {state}} = this.view;
    return study ? this.shown ?? picture.box() : ENDS.map((end) => this.view.scale(end) * Number(state.map[end] || usual[end]));
  }

  /** Show a rectangle. @param {number[]} box its ends to the right and upwards */
  into(box) {
    const {about, study, picture, page: {state}} = this.view;
    if (!about) return;
    const whole = picture.box();
    if (study) {
      this.before.push(this.shown ?? whole);
      this.shown = box;
      picture.show(box);
      this.offer();
      return;
    }
    const limits = [about.x.values, about.y.values].flatMap((values) => [values[0], values[values.length - 1]]);
    const kept = box.map((each, k) => Math.min(Math.max(each, limits[k - (k % 2)]), limits[k - (k % 2) + 1]));
    if (!(kept[0] < kept[1] && kept[2] < kept[3])) { picture.show(whole); return; }
    this.before.push(Object.fromEntries(ENDS.map((end) => [end, state.map[end]])));
    ENDS.forEach((end, k) => {
      const width = kept[k - (k % 2) + 1] - kept[k - (k % 2)];
      state.map[end] = this.view.asSent(end, String(Number(kept[k].toFixed(Math.min(12, Math.max(0, 3 - Math.floor(Math.log10(width))))))));
    });
    this.move(phrase("map.closer"));
  }

  /** Go back to what was shown before the last step in, or to the ends that the map has by itself. */
  out() {
    const {study, picture, page: {state}} = this.view;
    if (study) {
      this.shown = this.before.pop() ?? picture.box();
      picture.show(this.shown);
      this.offer();
      return;
    }
    const ends = this.before.pop() ?? {};
    for (const end of ENDS) if (ends[end]) state.map[end] = ends[end]; else delete state.map[end];
    this.move(phrase("map.wider"));
  }

  /** @param {string} words */
  move(words) {
    this.view.reading.leave();
    this.view.fill();
    say(words);
    this.view.update();
    this.offer();
  }

  /** Other axes: there is no way back to the ends of the ones before. */
  forget() {
    this.before = [];
    this.shown = undefined;
  }

  /** Whether there is something to go out to. */
  offer() {
    const {study, page: {state}} = this.view;
    /** @type {HTMLButtonElement} */ (one("map-out")).disabled = !this.before.length && (study || !ENDS.some((end) => state.map[end]));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.view.about) return;
    if (event.key === "-" || event.key === "−") {
      event.preventDefault();
      if (!/** @type {HTMLButtonElement} */ (one("map-out")).disabled) this.out();
    }
    if (event.key !== "+" && event.key !== "=") return;
    event.preventDefault();
    const [x0, x1, y0, y1] = this.box(), [x, y] = this.view.reading.mark;
    this.into([x - 0.25 * (x1 - x0), x + 0.25 * (x1 - x0), y - 0.25 * (y1 - y0), y + 0.25 * (y1 - y0)]);
  }
}
