// What is at a point of a map: the mark, which keys move, and where pointer or mark lie still the response there, small.

import {payload} from "./api.js";
import {quantityValue} from "./map-picture.js";
import {colour} from "./theme.js";
import {make, one, say, tell} from "./words.js";
import {amongst, joined, short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** How long pointer or mark must lie still before a response is asked for, ms. */
const STILL = 120;
const WIDTH = 230, HEIGHT = 84;

export class MapReading {
  /** @param {any} view */
  constructor(view) {
    this.view = view;
    this.mark = [0, 0];
    this.still = 0;
    /** Whether the fate that comes next shall be spoken. */
    this.spoken = false;
    this.dragging = false;
    /** @type {AbortController | null} */
    this.running = null;
    /** The point that is shown or waited for. @type {string} */
    this.at = "";
    this.canvas = /** @type {HTMLCanvasElement} */ (make("canvas"));
    this.words = make("p");
    one("map-small").append(this.canvas, this.words);
    const map = one("map");
    map.addEventListener("keydown", (event) => this.key(event));
    map.addEventListener("pointerdown", () => { this.dragging = true; this.leave(); });
    map.addEventListener("pointerleave", () => this.leave());
    // Before the plotting library, which keeps the end of a drag to itself.
    for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, () => { this.dragging = false; }, {capture: true});
  }

  /** The pointer is here. @param {number} x @param {number} y */
  over(x, y) {
    this.point(x, y);
    if (this.dragging || !this.view.about || !this.view.values) return;
    const [row, column] = this.place(x, y);
    this.rest([this.view.about.x.values[column], this.view.about.y.values[row]]);
  }

  /** Show the response at a point soon, if nothing moves until then. @param {number[]} point */
  rest(point) {
    if (this.at === String(point)) return;
    this.leave();
    this.at = String(point);
    this.still = window.setTimeout(() => void this.bring(point), STILL);
  }

  /** Nothing is pointed at any more. */
  leave() {
    window.clearTimeout(this.still);
    this.running?.abort();
    this.at = "";
    one("map-small").hidden = true;
    this.view.page.problem(null, "map-at"); // it was about another point
  }

  /** @param {number[]} point */
  async bring(point) {
    const running = this.running = new AbortController();
    const [path, texts] = this.view.request("response", point);
    try {
      const {header, arrays} = await payload(path, texts, {signal: running.signal});
      if (running.signal.aborted) return;
      this.show(point, header, arrays);
      if (this.spoken) say(inWords(header.verdict));
      this.spoken = false;
    } catch (error) {
      if (!running.signal.aborted) this.view.page.problem(error, "map-at");
    }
  }

  /** @param {number[]} point @param {any} header @param {Record<string, Float64Array>} arrays */
  show([x, y], header, arrays) {
    const small = one("map-small"), map = one("map");
    const [right, down] = this.view.picture.pixels(x, y);
    this.words.textContent = phrase("map.shown", {verdict: inWords(header.verdict), time: short(header.to - header.from)});
    small.hidden = false;
    small.dataset.at = `${x},${y}`;
    const {offsetWidth: width, offsetHeight: height} = small;
    small.style.left = `${Math.max(0, right + 16 + width > map.clientWidth ? right - 16 - width : right + 16)}px`;
    small.style.top = `${Math.max(0, down + 16 + height > map.clientHeight ? down - 16 - height : down + 16)}px`;
    this.draw(header, arrays);
  }

  /** @param {any} header @param {Record<string, Float64Array>} arrays */
  draw({from, to}, {time, rotation}) {
    const ratio = window.devicePixelRatio || 1;
    Object.assign(this.canvas, {width: WIDTH * ratio, height: HEIGHT * ratio});
    const pen = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    pen.scale(ratio, ratio);
    let low = 0, high = 0;
    for (const each of rotation) { low = Math.min(low, each); high = Math.max(high, each); }
    [low, high] = [Math.max(low, -1.6), Math.min(high, 1.6)];
    const scale = (HEIGHT - 12) / (high - low || 1);
    const across = (/** @type {number} */ at) => 4 + ((WIDTH - 8) * (at - from)) / (to - from || 1);
    const up = (/** @type {number} */ value) => HEIGHT - 6 - scale * (value - low);
    for (const level of [0, 1, -1]) {
      if (level < low || level > high) continue;
      pen.setLineDash(level ? [6, 3] : []);
      pen.strokeStyle = colour(level ? "over" : "soft");
      pen.beginPath();
      pen.moveTo(0, up(level));
      pen.lineTo(WIDTH, up(level));
      pen.stroke();
    }
    pen.setLineDash([]);
    pen.strokeStyle = colour("ink");
    pen.lineWidth = 1.3;
    pen.beginPath();
    time.forEach((each, k) => pen.lineTo(across(each), up(rotation[k])));
    pen.stroke();
  }

  /** Row and column of the cell at a place, whose value is the nearest. @param {number} x @param {number} y */
  place(x, y) {
    const nearest = (/** @type {number[]} */ values, /** @type {number} */ wanted) => values.reduce((best, each, k) => (Math.abs(each - wanted) < Math.abs(values[best] - wanted) ? k : best), 0);
    return [nearest(this.view.about.y.values, y), nearest(this.view.about.x.values, x)];
  }

  /** Say what is at a place. @param {number} x @param {number} y */
  point(x, y) {
    if (!this.view.about || !this.view.values) return;
    const [row, column] = this.place(x, y);
    const written = (/** @type {any} */ axis, /** @type {number} */ k) => {
      const label = inWords(axis.label), value = joined(amongst(axis.values, k), axis.unit);
      return axis.names ? phrase("map.coordinate_named", {label, value, name: axis.names[k]}) : phrase("map.coordinate", {label, value});
    };
    const index = row * this.view.about.shape[1] + column;
    const said = this.view.about.quantities.map((/** @type {string} */ name, /** @type {number} */ q) => this.said(name, /** @type {Float32Array[]} */ (this.view.values)[q][index])).filter(Boolean);
    tell(one("map-at"), phrase("map.at", {x: written(this.view.about.x, column), y: written(this.view.about.y, row), what: said.join("; ") || phrase("orbit.nothing")}));
  }

  /** @param {string} name @param {number} value */
  said(name, value) {
    if (Number.isNaN(value)) return "";
    const kinds = this.view.picture.kinds(name);
    if (name === "mode" && value > 1) return phrase("map.overturns_after", {count: value});
    const kind = kinds?.find((/** @type {[number, string, string]} */ [each]) => each === value)?.[1] ?? "";
    if (kinds) return name === "outcome" && kind ? phrase("map.first_rocking", {outcome: kind}) : kind;
    if (name === "rest") return phrase("map.rests_after", {time: short(value)});
    if (name === "peak") return value === Infinity ? "" : phrase("map.peak", {peak: short(value)});
    return quantityValue(name, value);
  }

  /** @param {number} x @param {number} y */
  put(x, y) {
    const [row, column] = this.place(x, y);
    this.mark = [this.view.about.x.values[column], this.view.about.y.values[row]];
    this.view.picture.mark.data = {x: [this.mark[0]], y: [this.mark[1]]};
    this.point(this.mark[0], this.mark[1]);
  }

  /** Keep the mark within another map, or put it into the middle. */
  keep() {
    const [x0, x1, y0, y1] = this.view.picture.box();
    const [x, y] = this.mark;
    if (x >= x0 && x <= x1 && y >= y0 && y <= y1) this.put(x, y); else this.put(0.5 * (x0 + x1), 0.5 * (y0 + y1));
  }

  /** Say what is at the mark. */
  say() { this.point(this.mark[0], this.mark[1]); }

  /** @param {KeyboardEvent} event */
  key(event) {
    const way = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0]}[event.key];
    if (event.key === "Enter") { event.preventDefault(); void this.view.open(); }
    if (event.key === "Escape") this.leave();
    if (!way || !this.view.about) return;
    event.preventDefault();
    const [row, column] = this.place(this.mark[0], this.mark[1]);
    const step = event.shiftKey ? 10 : 1;
    const clip = (/** @type {number} */ k, /** @type {number} */ size) => Math.min(size - 1, Math.max(0, k));
    this.put(this.view.about.x.values[clip(column + step * way[1], this.view.about.shape[1])], this.view.about.y.values[clip(row + step * way[0], this.view.about.shape[0])]);
    this.spoken = true;
    this.rest(this.mark);
  }
}
