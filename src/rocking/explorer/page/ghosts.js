// While a slider moves, the last curves of the rotation stay behind the present one, and fade with their age.

import {STILL, sliding} from "./visits.js";

/** @typedef {import("./histories.js").Lines} Lines */
/** A curve that was: rotations over slenderness, at times from the start of its window. @typedef {{from: number, time: Float64Array, y: Float64Array}} Ghost */

const MOST = 5;
/** Stretches of a curve of which the least and the greatest value are drawn. */
const STRETCHES = 300;

export class Ghosts {
  /** @param {import("./histories.js").Histories} histories */
  constructor(histories) {
    this.histories = histories;
    /** What is drawn now. @type {(() => Ghost) | null} */
    this.last = null;
    this.change = 0;
    this.timer = 0;
  }

  /** Another response is about to be drawn. @param {any} header @param {Lines} lines */
  next({window: {from}, block: {sides}}, lines) {
    const change = sliding();
    if (change !== this.change) this.histories.ghosts = [];
    this.change = change;
    if (change && this.last) {
      this.histories.ghosts = [...this.histories.ghosts, this.last()].slice(-MOST);
      window.clearTimeout(this.timer);
      this.timer = window.setTimeout(() => this.clear(), STILL);
    }
    this.last = () => thinned(from, lines, sides);
  }

  clear() {
    this.histories.ghosts = [];
    this.histories.drawGhosts();
  }
}

/** @param {number} from @param {Lines} lines @param {{alpha: number}[]} sides @returns {Ghost} */
function thinned(from, {time, rotation}, sides) {
  const step = Math.max(1, Math.ceil(rotation.length / STRETCHES));
  /** @type {number[]} */
  const kept = [];
  for (let start = 0; start < rotation.length; start += step) {
    let low = start, high = start;
    for (let k = start; k < Math.min(rotation.length, start + step); k += 1) {
      if (rotation[k] < rotation[low]) low = k;
      if (rotation[k] > rotation[high]) high = k;
    }
    kept.push(Math.min(low, high), Math.max(low, high));
  }
  return {from, time: Float64Array.from(kept, (k) => time[k]), y: Float64Array.from(kept, (k) => rotation[k] / sides[rotation[k] >= 0 ? 0 : 1].alpha)};
}
