// The overturning spectrum: which pulses overturn this block, by their length and height. Workers compute it from coarse to
// fine while one watches; the case can be dragged over it, and the block follows.

import {make, one} from "./dom.js";
import {GRAVITY} from "./kernels.js";
import {isRecord, lengthOf, rateFor} from "./case.js";
import {short} from "../numbers.js";

const COLUMNS = 128, ROWS = 96;
/** Columns and rows between those of each pass. */
const STRIDES = [16, 8, 4, 2, 1];
/** Room for the axes, px. */
const LEFT_AXIS = 44, BELOW_AXIS = 34;
/** Ratio of the longest length to that of the block, 2 pi/p, and of the shortest; largest amplitude over that of uplift. */
const LONGEST_PULSE = 2, SHORTEST_PULSE = 0.1, TALLEST_PULSE = 12;

export class MapView {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.canvas = make("canvas", {tabindex: 0, role: "application", "aria-label": "Map of pulses: arrow keys change length and amplitude", on: {keydown: (/** @type {KeyboardEvent} */ event) => this.key(event)}});
    this.shape = ""; // what the map is of
    /** @type {Float32Array | null} */
    this.values = null;
    /** @type {number[]} */
    this.lengths = [];
    this.tallest = this.stale = 0;
    this.words = make("p", {class: "soft", role: "status"});
    one("map").append(make("h2", {}, ["Which pulses overturn it?"]), this.canvas, this.words, make("p", {class: "legend"}, [
      make("i", {class: "key stands"}), "stands, darker the more it turns ", make("i", {class: "key falls"}), "falls",
    ]));
    this.picture = document.createElement("canvas");
    Object.assign(this.picture, {width: COLUMNS, height: ROWS});
    const drag = (/** @type {PointerEvent} */ event) => this.move(event);
    this.canvas.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => { this.page.rewind(); this.canvas.setPointerCapture(event.pointerId); drag(event); this.canvas.addEventListener("pointermove", drag); });
    this.canvas.addEventListener("pointerup", () => this.canvas.removeEventListener("pointermove", drag));
    this.canvas.addEventListener("pointercancel", () => this.canvas.removeEventListener("pointermove", drag));
    new ResizeObserver(() => this.paint()).observe(this.canvas);
    for (const query of ["(prefers-color-scheme: dark)", "(forced-colors: active)"]) matchMedia(query).addEventListener("change", () => { this.colours(); this.paint(); });
  }

  get possible() { const {given} = this.page; return !isRecord(given.motion) && !given.tilt; }

  update() { this.paint(); }

  /** Compute the map of another block or shape of pulse. */
  settle() {
    const {given, shown} = this.page;
    this.words.textContent = this.possible ? this.words.textContent : "A map needs a pulse, and a block that starts upright.";
    if (!this.possible) { this.shape = ""; this.page.workers.drop("column"); this.values = null; this.paint(); return; }
    const {amplitude: _amplitude, rate: _rate, ...shape} = given, key = JSON.stringify(shape);
    if (key === this.shape) return;
    this.shape = key;
    const period = (2 * Math.PI) / shown.body.sides[0].p;
    this.lengths = [SHORTEST_PULSE * period, LONGEST_PULSE * period];
    this.tallest = TALLEST_PULSE * shown.uplift;
    void this.fill(key, given);
  }

  /** Length of a pulse in a column, and amplitude in a row. @param {number} place from 0 to 1 */
  length(place) { const [low, high] = this.lengths; return low * (high / low) ** place; }

  /** @param {string} key @param {any} given */
  async fill(key, given) {
    const values = new Float32Array(COLUMNS * ROWS).fill(-1), {workers} = this.page, began = performance.now();
    this.values = values;
    document.body.dataset.map = "";
    workers.drop("column");
    let before = Infinity;
    for (const stride of STRIDES) {
      const asked = [];
      for (let column = 0; column < COLUMNS; column += stride) {
        /** @type {number[]} */
        const rows = [];
        for (let row = 0; row < ROWS; row += stride) if (column % before || row % before) rows.push(row);
        const amplitudes = rows.map((row) => this.tallest * ((row + 0.5) / ROWS)), rate = rateFor(given, this.length((column + 0.5) / COLUMNS));
        asked.push(workers.ask({kind: "column", given: {...given, rate}, amplitudes}).then((/** @type {number[]} */ found) => {
          if (this.shape !== key) return;
          found.forEach((value, k) => {
            for (let x = column; x < Math.min(column + stride, COLUMNS); x += 1) for (let y = rows[k]; y < Math.min(rows[k] + stride, ROWS); y += 1) values[y * COLUMNS + x] = value;
          });
          this.stale ||= requestAnimationFrame(() => { this.stale = 0; this.colours(); this.paint(); });
        }));
      }
      await Promise.all(asked);
      if (this.shape !== key) return;
      before = stride;
    }
    document.body.dataset.map = "complete";
    this.words.textContent = `${(COLUMNS * ROWS).toLocaleString()} simulations in ${short((performance.now() - began) / 1000, 2)} s. Drag the ring.`;
  }

  /** Colour the points that are known. */
  colours() {
    const {values} = this;
    if (!values) return;
    const pen = /** @type {CanvasRenderingContext2D} */ (this.picture.getContext("2d")), image = pen.createImageData(COLUMNS, ROWS);
    const [paper, deep, over] = ["paper", "second", "over"].map((name) => rgb(name));
    for (let k = 0; k < values.length; k += 1) {
      const value = values[k], at = 4 * ((ROWS - 1 - Math.floor(k / COLUMNS)) * COLUMNS + (k % COLUMNS)), share = Math.min(1, value);
      const colour = value > 1.6 ? over : value <= 0 ? paper : paper.map((each, j) => each + (deep[j] - each) * (0.12 + 0.7 * share));
      for (let j = 0; j < 3; j += 1) image.data[at + j] = colour[j];
      image.data[at + 3] = value < 0 ? 0 : 255;
    }
    pen.putImageData(image, 0, 0);
  }

  paint() {
    const {canvas} = this, width = canvas.clientWidth, height = canvas.clientHeight, sharp = Math.max(1, window.devicePixelRatio);
    if (!width || !this.page.shown) return;
    Object.assign(canvas, {width: Math.round(width * sharp), height: Math.round(height * sharp)});
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), w = width - LEFT_AXIS, h = height - BELOW_AXIS;
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.font = "12px system-ui, sans-serif";
    const ink = css("ink");
    pen.fillStyle = pen.strokeStyle = ink;
    if (!this.values) { pen.strokeRect(LEFT_AXIS, 0.5, w - 1, h); return; }
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.picture, LEFT_AXIS, 0, w, h);
    pen.strokeStyle = css("line");
    pen.strokeRect(LEFT_AXIS + 0.5, 0.5, w - 1, h);
    pen.textAlign = "center";
    const [low, high] = this.lengths, {tallest} = this;
    for (const tick of [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10]) {
      if (tick < low || tick > high) continue;
      pen.fillText(short(tick), LEFT_AXIS + (w * Math.log(tick / low)) / Math.log(high / low), h + 14);
    }
    pen.fillText("length of the pulse, s", LEFT_AXIS + w / 2, h + 29);
    pen.textAlign = "right";
    const step = [0.1, 0.2, 0.5, 1, 2, 5].find((each) => tallest / GRAVITY / each <= 6) ?? 10;
    for (let g = step; g < tallest / GRAVITY; g += step) pen.fillText(short(g), LEFT_AXIS - 5, h * (1 - (g * GRAVITY) / tallest) + 4);
    pen.save();
    pen.translate(11, h / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText("amplitude, g", 0, 0);
    pen.restore();
    const {given} = this.page, x = LEFT_AXIS + (w * Math.log(lengthOf(given) / low)) / Math.log(high / low), y = h * (1 - given.amplitude / tallest);
    for (const [colour, thick] of /** @type {[string, number][]} */ ([[css("paper"), 6], [ink, 2.5]])) {
      pen.beginPath();
      pen.arc(Math.min(Math.max(x, LEFT_AXIS), width), Math.max(y, 0), 9, 0, 2 * Math.PI);
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.stroke();
    }
    pen.lineWidth = 1;
  }

  /** @param {PointerEvent} event */
  move(event) {
    if (!this.values) return;
    const box = this.canvas.getBoundingClientRect(), within = (/** @type {number} */ each) => Math.min(1, Math.max(0, each));
    const across = within((event.clientX - box.left - LEFT_AXIS) / (box.width - LEFT_AXIS)), up = within(1 - (event.clientY - box.top) / (box.height - BELOW_AXIS));
    this.page.change({amplitude: Math.max(up, 0.005) * this.tallest, rate: rateFor(this.page.given, this.length(across))});
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const {given} = this.page, fine = event.shiftKey ? 0.1 : 1, up = {ArrowUp: 1, ArrowDown: -1}[event.key], right = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (!this.values || (!up && !right)) return;
    event.preventDefault();
    const [low, high] = this.lengths;
    if (up) this.page.change({amplitude: given.amplitude + (fine * up * this.tallest) / ROWS});
    if (right) this.page.change({rate: rateFor(given, lengthOf(given) * (high / low) ** ((fine * right) / COLUMNS))});
  }
}

/** @param {string} name */
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** A colour of the style sheet as numbers. @param {string} name */
function rgb(name) {
  const probe = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
  if (!probe) return [0, 0, 0];
  probe.fillStyle = css(name);
  probe.fillRect(0, 0, 1, 1);
  return [...probe.getImageData(0, 0, 1, 1).data].slice(0, 3);
}
