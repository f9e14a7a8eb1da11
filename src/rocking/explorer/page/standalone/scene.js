// The block on its moving ground, to scale. What is drawn can be dragged: the top, a side, the centre of mass, and the whole.

import {draw, dragged, one, put, stepOf} from "./dom.js";
import {DATA, GRAVITY} from "./kernels.js";
import {isRecord} from "./case.js";
import {short} from "../numbers.js";

/** Pixels below the ground at most, the share of the picture that they have at most, and pixels above the block. */
const BELOW = 46, SHARE_BELOW = 0.18, ABOVE = 22;
/** Radius of a handle, and of what a finger touches. */
const HANDLE = 8, TOUCH = 24;
/** Length of the arrow of a push of 1 g in block heights. */
const PUSH = 0.5;
/** Share of the slenderness up to which a largest rotation is drawn enlarged. */
const LEAST = 0.1;
/** Tilts that count as none, rad. */
const UPRIGHT = 0.02;

const still = window.matchMedia("(prefers-reduced-motion: reduce)");

export class Scene {
  /** @param {{change: (patch: Partial<import("./motions.js").Case>, rough?: boolean) => void, settle: () => void, release: () => void, readonly shown: any, readonly given: any, time: number, rewind: () => void}} page */
  constructor(page) {
    this.page = page;
    this.width = this.floor = this.below = this.middle = 0;
    this.held = this.begin = false;
    /** @type {any} */
    this.state = null;
    /** Displacements of records. @type {Record<string, Float64Array>} */
    this.lines = {};
    /** @type {SVGSVGElement} */
    this.svg = one("scene");
    this.grid = draw("path", {class: "grid"});
    this.earth = draw("rect", {class: "earth"});
    this.hatch = draw("path", {class: "hatch"});
    this.scaleText = draw("text", {class: "small", "text-anchor": "end"});
    this.body = draw("rect", {class: "block", rx: 2});
    this.radius = draw("path", {class: "radius"});
    this.push = draw("path", {class: "push"});
    this.mass = this.handle("mass", "Drag to move the centre of mass");
    this.top = this.handle("top", "Drag to change the height");
    this.side = this.handle("side", "Drag to change the width");
    this.whole = draw("g", {class: "whole"}, [this.body, this.radius, this.top, this.side, this.mass]);
    this.pivot = draw("circle", {class: "pivot", r: 5});
    this.bars = draw("g", {class: "bars"});
    this.stored = draw("rect", {class: "stored"});
    this.moving = draw("rect", {class: "moving"});
    this.needed = draw("path", {class: "needed"});
    this.barText = draw("text", {class: "small", "text-anchor": "middle"}, ["energy"]);
    this.needText = draw("text", {class: "small", "text-anchor": "end"}, ["to fall"]);
    this.pushText = draw("text", {class: "small", "text-anchor": "middle"}, ["push"]);
    this.bars.append(draw("rect", {class: "frame"}), this.stored, this.moving, this.needed, this.barText, this.needText);
    this.svg.append(this.grid, this.earth, this.hatch, this.scaleText, this.whole, this.push, this.pushText, this.pivot, this.bars);
    this.scale = 0;
    this.enlarged = 1;
    dragged(this.top, (event) => this.hold(event), (event, held) => this.page.change({height: held.height + (held.y - event.clientY) / this.scale}), () => this.settle());
    dragged(this.side, (event) => this.hold(event), (event, held) => this.page.change({width: held.width + (2 * (event.clientX - held.x)) / this.scale}), () => this.settle());
    dragged(this.mass, (event) => this.hold(event), (event, held) => {
      const offset = held.offset + (event.clientX - held.x) / this.scale;
      this.page.change({offset: Math.abs(offset) < 0.02 * held.width ? 0 : offset});
    }, () => this.settle());
    dragged(this.body, (event) => this.hold(event), (event, held) => this.tilt(event, held), () => { this.settle(); this.page.release(); });
    new ResizeObserver(() => this.fit()).observe(this.svg);
    still.addEventListener("change", () => this.page.rewind());
  }

  /** @param {string} name @param {string} title */
  handle(name, title) {
    return draw("g", {class: `handle ${name}`}, [draw("title", {}, [title]), draw("circle", {class: "touch", r: TOUCH}), draw("circle", {class: "knob", r: HANDLE})]);
  }

  /** @param {PointerEvent} event */
  hold(event) {
    this.page.rewind();
    this.held = true;
    return {...this.page.given, x: event.clientX, y: event.clientY};
  }

  settle() {
    this.held = false;
    this.fit();
    this.page.settle();
  }

  /** Turn the block about a corner so that the point that was touched follows the pointer. @param {PointerEvent} event @param {any} held */
  tilt(event, held) {
    const box = this.svg.getBoundingClientRect(), x = (/** @type {number} */ each) => (each - box.left - this.middle) / this.scale, y = (/** @type {number} */ each) => (this.floor - (each - box.top)) / this.scale;
    const side = event.clientX >= held.x ? 1 : -1, corner = (side * held.width) / 2;
    const angle = Math.atan2(x(event.clientX) - corner, Math.max(y(event.clientY), 0.05)) - Math.atan2(x(held.x) - corner, Math.max(y(held.y), 0.05));
    const tilt = held.tilt + angle;
    this.page.change({tilt: Math.abs(tilt) < UPRIGHT || tilt * side < 0 ? 0 : tilt});
  }

  /** Choose the scale of the picture, unless something is held. */
  fit() {
    const {clientWidth: width, clientHeight: height} = this.svg, {given} = this.page;
    if (!width || !given) return;
    put(this.svg, {viewBox: `0 0 ${width} ${height}`}); // paper has another width
    this.width = width;
    this.below = Math.min(BELOW, SHARE_BELOW * height);
    this.floor = height - this.below;
    if (!this.held || !this.scale) {
      const reach = Math.hypot(given.width, given.height);
      this.scale = Math.min((this.floor - ABOVE) / reach, width / (1.7 * given.height));
    }
    this.paint();
  }

  /** Draw the block at a moment. @param {any} [state] its rotation, velocity, and the acceleration and displacement of the ground @param {boolean} [begin] whether it can be dragged */
  paint(state = this.state, begin = this.begin) {
    this.state = state;
    this.begin = begin;
    const {given, shown} = this.page;
    if (!state || !shown || !this.scale) return;
    const {scale, floor} = this, {width, height, offset} = given, share = shown.peak / Math.max(...shown.body.sides.map((/** @type {any} */ side) => side.alpha));
    this.enlarged = share > 0 && share < LEAST ? stepOf(LEAST / share, 1) : 1;
    const rotation = this.enlarged * state.rotation;
    const moved = still.matches ? 0 : this.displacement(state.displacement), free = Math.max(0, this.width / 2 - scale * Math.hypot(width, height) * 0.9);
    const shift = Math.max(-free, Math.min(free, scale * moved));
    const wide = scale * width, tall = scale * height, outside = Math.max(0, tall + wide / 2 + 12 + Math.abs(shift) - this.width / 2); // of what lies beside it
    const pan = -Math.sin(rotation) * outside;
    this.middle = this.width / 2 + shift + pan;
    this.background(scale * moved - shift - pan);
    const pivot = ((state.rotation >= 0 ? 1 : -1) * wide) / 2, angle = (rotation * 180) / Math.PI;
    put(this.body, {x: -wide / 2, y: -tall, width: wide, height: tall});
    put(this.whole, {transform: `translate(${this.middle + pivot} ${floor}) rotate(${angle}) translate(${-pivot} 0)`});
    const place = scale * offset;
    put(this.mass, {transform: `translate(${place} ${-tall / 2})`});
    put(this.radius, {d: `M${pivot} 0L${place} ${-tall / 2}`});
    put(this.top, {transform: `translate(0 ${-tall})`});
    put(this.side, {transform: `translate(${wide / 2} ${-tall * 0.72})`});
    this.svg.classList.toggle("begin", Boolean(begin));
    put(this.pivot, {cx: this.middle + pivot, cy: floor, visibility: state.rotation === 0 ? "hidden" : "visible"});
    this.arrow({...state, rotation}, pivot, place, tall);
    this.energy(state);
  }

  /** The push of the ground on the centre of mass. @param {any} state @param {number} pivot @param {number} place @param {number} tall */
  arrow({rotation, acceleration}, pivot, place, tall) {
    const cos = Math.cos(rotation), sin = Math.sin(rotation), dx = place - pivot, dy = -tall / 2;
    const x = this.middle + pivot + dx * cos - dy * sin, y = this.floor + dx * sin + dy * cos;
    const length = (-acceleration / GRAVITY) * PUSH * tall, tip = Math.sign(length) * Math.min(9, Math.abs(length));
    put(this.pushText, {x: x + length / 2, y: y - 10, visibility: Math.abs(length) < 24 ? "hidden" : "visible"});
    put(this.push, {d: Math.abs(length) < 3 ? "" : `M${x} ${y}h${length}m${-tip} ${-0.7 * Math.abs(tip)}l${tip} ${0.7 * Math.abs(tip)}l${-tip} ${0.7 * Math.abs(tip)}`});
  }

  /** Energy of the block, in units of what is needed to reach the balance. @param {any} state */
  energy({rotation, velocity}) {
    const {p, alpha} = this.page.shown.body.sides[rotation >= 0 ? 0 : 1], barrier = 1 - Math.cos(alpha);
    const stored = (Math.cos(alpha - Math.abs(rotation)) - Math.cos(alpha)) / barrier, moving = (velocity * velocity) / (2 * p * p * barrier);
    put(this.bars, {visibility: this.floor < 180 ? "hidden" : "visible"});
    const tall = Math.min(130, 0.4 * this.floor), x = this.width - 34, y = 34 + tall, unit = tall / 1.5, of = (/** @type {number} */ each) => Math.max(0, Math.min(1.5, each)) * unit;
    put(this.bars.firstChild, {x: x - 9, y: y - tall, width: 18, height: tall});
    put(this.stored, {x: x - 9, y: y - of(stored), width: 18, height: of(stored)});
    put(this.moving, {x: x - 9, y: y - of(Math.max(0, stored) + moving), width: 18, height: of(Math.max(0, stored) + moving) - of(stored)});
    put(this.needed, {d: `M${x - 15} ${y - unit}h30`});
    put(this.barText, {x, y: y + 15});
    put(this.needText, {x: x - 20, y: y - unit + 4});
  }

  /** Displacement of the ground as it is drawn: that of records without their drift. @param {number} computed */
  displacement(computed) {
    const {given, shown} = this.page;
    if (!isRecord(given.motion) || given.tilt) return computed;
    const {drawn, pga} = DATA.records[given.motion];
    this.lines[given.motion] ??= Float64Array.from(drawn.differences, ((sum) => (/** @type {number} */ each) => (sum += each) * drawn.unit)(0));
    const values = this.lines[given.motion], place = this.page.time / drawn.step, k = Math.floor(place);
    return k + 1 < values.length && shown ? (given.amplitude / pga) * (values[k] + (values[k + 1] - values[k]) * (place - k)) : 0;
  }

  /** What does not move with the ground, and the ground. @param {number} behind */
  background(behind) {
    const {scale, floor, width, middle} = this, step = stepOf(width / scale, 11), pixels = step * scale;
    let path = "";
    for (let x = width / 2 - behind - Math.ceil((width / 2 - behind) / pixels) * pixels; x < width; x += pixels) path += `M${x.toFixed(1)} 0V${floor}`;
    for (let y = floor - pixels; y > 0; y -= pixels) path += `M0 ${y.toFixed(1)}H${width}`;
    put(this.grid, {d: path});
    put(this.earth, {x: 0, y: floor, width, height: this.below});
    let hatch = `M0 ${floor}H${width}`;
    for (let x = (((middle % 18) + 18) % 18) - 18; x < width + 18; x += 18) hatch += `M${(x + 9).toFixed(1)} ${floor + 3}l-9 11`;
    put(this.hatch, {d: hatch});
    put(this.scaleText, {x: width - 10, y: this.below < 34 ? floor - 7 : floor + this.below - 7});
    this.scaleText.textContent = `${this.enlarged > 1 ? `rotation drawn ${short(this.enlarged)} times larger, ` : ""}grid ${short(step)} m`;
  }
}
