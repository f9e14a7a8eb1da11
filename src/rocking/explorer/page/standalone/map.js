// Maps: which pulses overturn this block, by their length and amplitude; and, as in the founding article, after which sines it
// rests, by ω and a. Workers compute a map from coarse to fine while one watches. The case can be dragged over it, and the block follows.

import {draw, dragged, make, one, stepOf} from "./dom.js";
import {FALLS, ROCKS} from "./jobs.js";
import {GRAVITY} from "./kernels.js";
import {isRecord} from "./case.js";
import {QUANTITIES} from "./fields.js";
import {short} from "../numbers.js";
import {written} from "../ticks.js";

const COLUMNS = 128, ROWS = 96;
/** Columns and rows between those of each pass. */
const STRIDES = [16, 8, 4, 2, 1];
/** Room for the axes, px. */
const LEFT_AXIS = 50, BELOW_AXIS = 34;

/** A map: its quantities, which a drag changes, their ends, and what colours mean. The horizontal axis is logarithmic.
 * @typedef {{title: string, across: string, up: string, needs: string, is: (given: any) => boolean, ends: (page: any) => [number, number][], legend: [string, string][]}} Kind */
/** @type {Record<string, Kind>} */
const KINDS = {
  pulses: {
    title: "Which pulses overturn it?", across: "length", up: "amplitude", needs: "a pulse", is: ({motion}) => !isRecord(motion),
    ends: (page) => { const longest = (4 * Math.PI) / page.shown.body.sides[0].p; return [[longest / 20, longest], [0, (12 * page.shown.uplift) / GRAVITY]]; },
    legend: [["second", "stands, bluer the more it turns"], ["over", "falls"]],
  },
  sines: {
    title: "After which sines does it rest?", across: "omega", up: "a", needs: "several cycles of a sine", is: ({motion}) => motion === "sine", ends: () => [[0.5, 8], [1, 1.1]],
    legend: [["stone", "rests within half a period"], ["second", "rocks on"], ["over", "falls"]],
  },
};

export class MapView {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.kind = "pulses";
    this.canvas = make("canvas", {tabindex: 0, role: "application", "aria-label": "Map: arrow keys change the case", on: {keydown: (/** @type {KeyboardEvent} */ event) => this.key(event)}});
    this.shape = ""; // what the map is of
    /** @type {Float32Array | null} */
    this.values = null;
    /** @type {[number, number][]} */
    this.ends = [];
    this.stale = 0;
    this.title = make("h2");
    this.words = make("p", {class: "soft", role: "status"});
    this.legend = make("p", {class: "soft"});
    this.choices = Object.entries({pulses: "Pulses", sines: "Sines, ω and a"}).map(([kind, text]) => make("button", {type: "button", value: kind, on: {click: () => this.choose(kind)}}, [text]));
    one("map").append(this.title, make("p", {class: "buttons"}, this.choices), this.canvas, this.words, this.legend);
    this.picture = document.createElement("canvas");
    Object.assign(this.picture, {width: COLUMNS, height: ROWS});
    dragged(this.canvas, (event) => { this.page.rewind(); this.canvas.focus(); this.move(event); return true; }, (event) => this.move(event));
    new ResizeObserver(() => this.paint()).observe(this.canvas);
    for (const query of ["(prefers-color-scheme: dark)", "(forced-colors: active)", "print"]) matchMedia(query).addEventListener("change", () => { this.colours(); this.paint(); });
  }

  get chosen() { return KINDS[this.kind]; }

  /** Quantity of an axis. @param {"across" | "up"} axis */
  quantity(axis) { return QUANTITIES[this.chosen[axis]]; }

  /** Show another map; that of sines starts from the article's case, unless there is a sine. @param {string} kind */
  choose(kind) {
    const {page} = this, {given, shown} = page, rate = shown.body.sides[0].p / Math.PI;
    this.kind = kind;
    if (kind === "sines" && (given.tilt || !this.chosen.is(given))) page.change({motion: "sine", cycles: 2.5, tilt: 0, amplitude: 1.03 * shown.uplift, rate});
    else this.settle();
  }

  update() { this.paint(); }

  /** Compute another map, if the block, the shape of its motion or the kind has changed. */
  settle() {
    const {given, workers} = this.page, {title, legend, needs, is, ends} = this.chosen, {amplitude: _amplitude, rate: _rate, ...rest} = given;
    const isPossible = is(given) && !given.tilt, key = isPossible ? JSON.stringify([this.kind, rest]) : "";
    this.title.textContent = title;
    for (const each of this.choices) each.setAttribute("aria-pressed", String(each.value === this.kind));
    this.legend.replaceChildren(...legend.map(([colour, text]) => make("span", {class: "key"}, [draw("svg", {style: `background: var(--${colour})`}), text])));
    if (key === this.shape && key) return;
    this.shape = key;
    workers.drop("column");
    if (isPossible) { this.ends = ends(this.page); void this.fill(key, given); return; }
    this.words.textContent = `This map needs ${needs}, and a block that starts upright.`;
    this.values = null;
    this.paint();
  }

  /** Number at a place of an axis, from 0 to 1, and the reverse. @param {number} axis 0 across, 1 up @param {number} place */
  value(axis, place) { const [low, high] = this.ends[axis]; return axis ? low + (high - low) * place : low * (high / low) ** place; }
  /** @param {number} axis @param {number} value */
  place(axis, value) { const [low, high] = this.ends[axis]; return axis ? (value - low) / (high - low) : Math.log(value / low) / Math.log(high / low); }

  /** Case at a point. @param {any} given @param {number} across @param {number} up */
  at(given, across, up) {
    const {page} = this, moved = {...given, ...this.quantity("across").patch(this.value(0, across), given, page)};
    return {...moved, ...this.quantity("up").patch(this.value(1, up), moved, page)};
  }

  /** @param {string} key @param {any} given */
  async fill(key, given) {
    const values = new Float32Array(COLUMNS * ROWS).fill(-1), {workers} = this.page, began = performance.now();
    this.values = values;
    document.body.dataset.map = this.words.textContent = "";
    let before = 0; // of which no number is a multiple
    for (const stride of STRIDES) {
      const asked = [];
      for (let column = 0; column < COLUMNS; column += stride) {
        /** @type {number[]} */
        const rows = [];
        for (let row = 0; row < ROWS; row += stride) if (column % before !== 0 || row % before !== 0) rows.push(row);
        const points = rows.map((row) => this.at(given, (column + 0.5) / COLUMNS, (row + 0.5) / ROWS));
        asked.push(workers.ask({kind: "column", given: points[0] ?? given, amplitudes: points.map(({amplitude}) => amplitude), rests: this.kind === "sines"}).then((/** @type {number[]} */ found) => {
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
    const [paper, deep, over, stone] = ["paper", "second", "over", "stone"].map((name) => rgb(name));
    const shade = (/** @type {number} */ share) => paper.map((each, j) => each + (deep[j] - each) * (0.12 + 0.7 * Math.min(1, share)));
    for (let k = 0; k < values.length; k += 1) {
      const value = values[k], at = 4 * ((ROWS - 1 - Math.floor(k / COLUMNS)) * COLUMNS + (k % COLUMNS)), isSine = this.kind === "sines";
      const colour = value === FALLS ? over : isSine ? (value === ROCKS ? deep : stone) : value <= 0 ? paper : shade(value);
      for (let j = 0; j < 3; j += 1) image.data[at + j] = colour[j];
      image.data[at + 3] = value < 0 ? 0 : 255;
    }
    pen.putImageData(image, 0, 0);
  }

  paint() {
    const {canvas, page} = this, width = canvas.clientWidth, height = canvas.clientHeight, sharp = Math.max(1, window.devicePixelRatio);
    if (!width || !page.shown) return;
    Object.assign(canvas, {width: Math.round(width * sharp), height: Math.round(height * sharp)});
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d")), w = width - LEFT_AXIS, h = height - BELOW_AXIS, ink = css("ink");
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = ink;
    pen.strokeStyle = css("line");
    if (!this.values) { pen.strokeRect(LEFT_AXIS, 0.5, w - 1, h); return; }
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.picture, LEFT_AXIS, 0, w, h);
    pen.strokeRect(LEFT_AXIS + 0.5, 0.5, w - 1, h);
    const [[left, right], [low, high]] = this.ends, step = stepOf(high - low, 6), label = (/** @type {any} */ {text, unit}) => `${text}${unit ? `, ${unit}` : ""}`;
    pen.textAlign = "center";
    for (const tick of [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10]) if (tick >= left && tick <= right) pen.fillText(short(tick), LEFT_AXIS + w * this.place(0, tick), h + 14);
    pen.fillText(label(this.quantity("across")), LEFT_AXIS + w / 2, h + 29);
    pen.textAlign = "right";
    const ticks = Array.from({length: Math.floor((high - low) / step + 1e-9) + 1}, (_, k) => low + k * step).filter((tick) => this.place(1, tick) < 0.98), texts = written(ticks);
    ticks.forEach((tick, k) => pen.fillText(texts[k], LEFT_AXIS - 5, h * (1 - this.place(1, tick)) + 4));
    pen.save();
    pen.translate(11, h / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(label(this.quantity("up")), 0, 0);
    pen.restore();
    const [x, y] = this.spot();
    for (const [colour, thick] of /** @type {[string, number][]} */ ([[css("paper"), 6], [ink, 2.5]])) {
      pen.beginPath();
      pen.arc(LEFT_AXIS + w * x, h * (1 - y), 9, 0, 2 * Math.PI);
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.stroke();
    }
    pen.lineWidth = 1;
  }

  /** Place of the case, at an edge of the map if it is beyond. */
  spot() {
    const {given} = this.page;
    return /** @type {("across" | "up")[]} */ (["across", "up"]).map((axis, k) => within(this.place(k, this.quantity(axis).of(given, this.page))));
  }

  /** Move the case to a place. @param {number} across @param {number} up */
  go(across, up) {
    const {amplitude, rate} = this.at(this.page.given, within(across), Math.max(within(up), 0.005));
    this.page.change({amplitude, rate});
  }

  /** @param {PointerEvent} event */
  move(event) {
    const {left, top, width, height} = this.canvas.getBoundingClientRect();
    if (this.values) this.go((event.clientX - left - LEFT_AXIS) / (width - LEFT_AXIS), 1 - (event.clientY - top) / (height - BELOW_AXIS));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const [across, up] = {ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowRight: [1, 0], ArrowLeft: [-1, 0]}[event.key] ?? [0, 0], fine = event.shiftKey ? 0.1 : 1;
    if (!this.values || (!up && !across)) return;
    event.preventDefault();
    const [x, y] = this.spot(), moved = this.at(this.page.given, x + (fine * across) / COLUMNS, y + (fine * up) / ROWS);
    this.page.change(up ? {amplitude: moved.amplitude} : {rate: moved.rate});
  }
}

/** @param {number} place */
const within = (place) => Math.min(1, Math.max(0, place));

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
