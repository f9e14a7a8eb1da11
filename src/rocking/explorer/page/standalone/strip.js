// The time line: the ground's acceleration, which can be dragged, and the rotation with the moments that decide.

import {draw, dragged, line, make, one, put, stepOf} from "./dom.js";
import {GRAVITY} from "./kernels.js";
import {isRecord, lengthOf, rateFor} from "./case.js";
import {fixed, short} from "../numbers.js";
import {written} from "../ticks.js";

const LEFT = 80, RIGHT = 22, TOP = 18, GAP = 36, BOTTOM = 24;
/** Share of the upper part. */
const UPPER = 0.45;
/** Ends of the axis of time, s. */
const ENDS = [0.5, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30, 40, 60, 80, 120, 200, 400];
/** Letters of the moments in the picture. @type {Record<string, string>} */
export const NAMES = {lift: "lifts", push: "push", peak: "largest", balance: "balance", gone: "no return", flat: "flat", rest: "rest"};

export class Strip {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.width = this.height = this.span = this.from = this.unit = this.upper = this.middle = this.tall = this.knobTime = this.most = 0;
    this.sign = this.share = 1;
    this.held = false;
    /** Times and places of the curve. @type {{times: Float64Array, x: Float64Array, y: Float64Array} | null} */
    this.drawn = null;
    /** @type {SVGSVGElement} */
    this.svg = one("strip");
    this.axes = draw("g", {class: "axes"});
    this.band = draw("rect", {class: "band"});
    this.area = draw("path", {class: "area"});
    this.limits = draw("path", {class: "limits"});
    this.curve = draw("path", {class: "curve"});
    this.marks = draw("g", {class: "marks"});
    this.cursor = draw("path", {class: "cursor"});
    this.knob = draw("g", {class: "handle pulse"}, [
      draw("title", {}, ["Drag to change the height and the length of the pulse"]), draw("circle", {class: "touch", r: 24}), draw("circle", {class: "knob", r: 8}),
    ]);
    this.svg.append(this.axes, this.band, this.area, this.limits, this.curve, this.marks, this.cursor, this.knob);
    dragged(this.svg, (event) => { this.page.seek(this.timeAt(event)); return true; }, (event) => this.page.seek(this.timeAt(event)));
    dragged(this.knob, (event) => this.hold(event), (event, held) => this.reshape(event, held), () => { this.held = false; this.fit(); this.page.settle(); });
    new ResizeObserver(() => this.fit()).observe(this.svg);
  }

  /** @param {PointerEvent} event */
  timeAt(event) { return this.from + ((event.clientX - this.svg.getBoundingClientRect().left - LEFT) / (this.width - LEFT - RIGHT)) * this.span; }

  /** @param {PointerEvent} event */
  hold(event) {
    this.page.rewind();
    this.held = true;
    const {given} = this.page;
    return {x: event.clientX, y: event.clientY, given, share: this.share, length: isRecord(given.motion) ? 1 : lengthOf(given), time: this.knobTime};
  }

  /** @param {PointerEvent} event @param {any} held */
  reshape(event, held) {
    const {given} = held, amplitude = given.amplitude + ((held.y - event.clientY) / this.unit / held.share) * this.sign;
    if (isRecord(given.motion)) { this.page.change({amplitude}); return; }
    const time = Math.max(held.time * 0.1, held.time + ((event.clientX - held.x) / (this.width - LEFT - RIGHT)) * this.span);
    this.page.change({amplitude, rate: rateFor(given, held.length * (held.time > 0 ? time / held.time : 1))});
  }

  /** Choose the axes, unless the pulse is held. */
  fit() {
    const {clientWidth: width, clientHeight: height} = this.svg, {shown, given} = this.page;
    if (!width || !shown) return;
    const {picture, uplift} = shown;
    Object.assign(this, {width, height});
    put(this.svg, {viewBox: `0 0 ${width} ${height}`});
    if (!this.held || !this.span) {
      this.from = picture.from;
      this.span = ENDS.find((each) => each >= (picture.until - picture.from) * 0.999) ?? picture.until - picture.from;
      this.most = Math.max(1.25 * Math.abs(given.amplitude), 1.5 * uplift);
    }
    const inner = height - TOP - GAP - BOTTOM;
    this.upper = TOP + (inner * UPPER) / 2;
    this.unit = (inner * UPPER) / 2 / this.most;
    this.middle = TOP + inner * UPPER + GAP + (inner * (1 - UPPER)) / 2;
    this.tall = (inner * (1 - UPPER)) / 2;
    this.paint();
  }

  /** @param {number} time */
  x(time) { return LEFT + ((time - this.from) / this.span) * (this.width - LEFT - RIGHT); }

  paint() {
    const {shown, given} = this.page;
    if (!this.width || !shown) return;
    const {times, rotation, ground: {times: corners, acceleration}} = shown.picture, alpha = Math.max(...shown.body.sides.map((/** @type {any} */ side) => side.alpha));
    const share = shown.peak / alpha, span = shown.overturned ? 1.35 : share > 0.2 || !share ? 1.15 : 1.15 * share, mark = stepOf(span, 1.8); // a small rotation fills the picture
    const visible = (/** @type {number} */ each) => Math.max(-span, Math.min(span, each));
    const x = times.map((/** @type {number} */ time) => this.x(time));
    const y = (/** @type {number} */ turned) => this.middle - (visible(turned / alpha) / span) * this.tall;
    const stillGround = !shown.shaking.pieces;
    put(this.area, {d: stillGround ? "" : `${line(corners.map((/** @type {number} */ time) => this.x(time)), acceleration.map((/** @type {number} */ each) => this.upper - each * this.unit))}V${this.upper}H${LEFT}Z`});
    this.drawn = {times, x, y: rotation.map((/** @type {number} */ each) => y(each))};
    put(this.curve, {class: `curve ${shown.overturned && this.page.answered ? "over" : ""}`});
    const [plus, minus] = shown.body.sides.map((/** @type {any} */ side) => side.alpha), right = this.width - RIGHT;
    put(this.band, {x: LEFT, y: y(plus), width: right - LEFT, height: y(-minus) - y(plus)});
    const {uplift} = shown;
    put(this.limits, {d: `M${LEFT} ${this.upper - uplift * this.unit}H${right}M${LEFT} ${this.upper + uplift * this.unit}H${right}`});
    this.axis(stillGround, y, span > 1 ? [[plus, "balance"], [-minus, "balance"]] : [1, -1].map((sign) => [sign * mark * alpha, `${short(100 * sign * mark)} %`]));
    let peak = 0;
    acceleration.forEach((/** @type {number} */ each, /** @type {number} */ k) => { if (Math.abs(each) > Math.abs(acceleration[peak])) peak = k; });
    if (!isRecord(given.motion)) { // the top of the first of equal lobes, which samples may miss by different amounts
      const most = Math.abs(acceleration[peak]);
      peak = Math.max(acceleration.findIndex((/** @type {number} */ each) => Math.abs(each) > 0.9 * most), 0);
      while (Math.abs(acceleration[peak + 1]) > Math.abs(acceleration[peak])) peak += 1;
      this.knobTime = given.motion === "rectangular" ? lengthOf(given) : corners[peak];
    } else this.knobTime = corners[peak];
    this.sign = Math.sign(acceleration[peak]) || 1;
    this.share = isRecord(given.motion) ? Math.abs(acceleration[peak]) / given.amplitude || 1 : 1; // the part that is shown may lack the peak
    put(this.knob, {transform: `translate(${this.x(this.knobTime)} ${this.upper - this.sign * given.amplitude * this.share * this.unit})`, visibility: stillGround ? "hidden" : "visible"});
    this.moments(shown, y);
    this.follow();
  }

  /** @param {boolean} stillGround @param {(turned: number) => number} y @param {any[]} turns rotations and their texts */
  axis(stillGround, y, turns) {
    const text = (/** @type {number} */ x, /** @type {number} */ top, /** @type {string} */ words, anchor = "end", kind = "") => draw("text", {x, y: top, "text-anchor": anchor, class: kind}, [words]);
    const step = stepOf(this.span, Math.max(3, this.width / 110)), first = Math.ceil(this.from / step - 1e-9);
    const ticks = Array.from({length: Math.floor((this.from + this.span) / step + 1e-9) - first + 1}, (_, k) => (first + k) * step);
    const right = this.width - RIGHT, {uplift} = this.page.shown, foot = this.height - BOTTOM + 4;
    const texts = written(ticks), ground = text(LEFT, 13, stillGround ? "Tilted: the ground is at rest. Stand it upright again" : "ground, g", "start", stillGround ? "link" : "");
    if (stillGround) ground.addEventListener("pointerdown", (/** @type {Event} */ event) => { event.stopPropagation(); this.page.change({tilt: 0}); });
    this.axes.replaceChildren(
      draw("path", {d: `M${LEFT} ${this.upper}H${right}M${LEFT} ${this.middle}H${right}${ticks.map((each) => `M${this.x(each)} ${foot - 4}v4`).join("")}`}),
      ground, text(LEFT, TOP + (this.height - TOP - GAP - BOTTOM) * UPPER + 14, "rotation", "start"),
      text(LEFT - 6, this.upper - uplift * this.unit + 4, short(uplift / GRAVITY, 2)), text(LEFT - 6, this.upper + 4, uplift * this.unit > 12 ? "0" : ""),
      ...turns.map(([turned, words]) => text(LEFT - 6, y(turned) + 4, words)), text(LEFT - 6, this.middle + 4, "0"),
      ...ticks.map((each, k) => text(this.x(each), foot + 14, k === ticks.length - 1 ? `${texts[k]} s` : texts[k], "middle")),
    );
  }

  /** @param {any} shown @param {(turned: number) => number} y */
  moments({moments, picture: {times, rotation}}, y) {
    let beyond = -Infinity, row = 0;
    const [from, until] = [times[0], times[times.length - 1]];
    this.marks.replaceChildren(...moments.flatMap((/** @type {any} */ {time, kind}) => {
      const k = Math.min(times.length - 1, Math.max(0, Math.round(((time - from) / (until - from)) * (times.length - 1)))), x = this.x(time), name = NAMES[kind];
      row = x < beyond ? row + 1 : 0;
      beyond = x + 8 * name.length;
      const side = x > this.width - 70 ? "end" : "start";
      const top = this.middle - this.tall - 6 + 13 * row;
      return [
        draw("path", {class: "stem", d: `M${x} ${top + 3}V${y(rotation[k])}`}), draw("circle", {class: `dot ${kind}`, cx: x, cy: y(rotation[k]), r: 4.5}),
        draw("text", {x: x + (side === "end" ? -4 : 4), y: top, "text-anchor": side}, [name]),
      ];
    }));
  }

  /** Show the present moment. */
  follow() {
    if (!this.width) return;
    if (this.drawn) { // before the outcome is guessed, up to this moment
      const {times, x, y} = this.drawn, count = this.page.answered ? times.length : times.filter((/** @type {number} */ each) => each <= this.page.time).length;
      put(this.curve, {d: count > 1 ? line(x.slice(0, count), y.slice(0, count)) : ""});
    }
    put(this.cursor, {d: `M${this.x(this.page.time)} ${TOP - 6}V${this.height - BOTTOM + 4}`});
  }
}

/** A list of sentences, each with a link to its moment. @param {{time: number, words: string}[]} sentences @param {(time: number) => void} seek */
export function linked(sentences, seek) {
  return sentences.map(({time, words}) => make("li", {}, [make("button", {type: "button", class: "link", on: {click: () => seek(time)}}, [`${fixed(time, 2)} s`]), ` ${words}`]));
}
