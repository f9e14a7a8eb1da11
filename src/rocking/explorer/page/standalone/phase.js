// The phase plane: angular velocity against rotation, with the separatrix that parts standing from falling on still ground.

import {draw, line, make, one, put} from "./dom.js";

const INSET = 34;
/** Range of rotations in slendernesses, and of velocities in p times slenderness. */
const REACH = 1.5, SPEED = 1.6;

export class Phase {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.width = this.height = 0;
    this.axes = draw("path", {class: "axes"});
    this.limit = draw("path", {class: "separatrix"});
    this.curve = draw("path", {class: "curve"});
    this.dot = draw("circle", {class: "dot now", r: 6});
    this.texts = draw("g", {class: "axes"});
    this.svg = draw("svg", {role: "img", "aria-label": "Angular velocity against rotation"}, [this.axes, this.limit, this.curve, this.texts, this.dot]);
    one("phase").append(make("h2", {}, ["Phase plane"]), this.svg, make("p", {class: "soft"}, [
      "Rotation divided by slenderness, and angular velocity divided by p and slenderness. On still ground, a block beyond a dashed line falls to that side.",
    ]));
    new ResizeObserver(() => this.update()).observe(this.svg);
  }

  /** @param {number} turned @param {number} speed */
  at(turned, speed) {
    const {width, height} = this, across = (width - 2 * INSET) / (2 * REACH), up = (height - 2 * INSET) / (2 * SPEED);
    const bound = (/** @type {number} */ value, /** @type {number} */ most) => Math.max(-most, Math.min(most, value));
    return [width / 2 + bound(turned, REACH) * across, height / 2 - bound(speed, SPEED) * up];
  }

  update() {
    const {clientWidth: width, clientHeight: height} = this.svg, {shown} = this.page;
    if (!width || !shown) return;
    Object.assign(this, {width, height});
    put(this.svg, {viewBox: `0 0 ${width} ${height}`});
    const {sides, model} = shown.body, {rotation, velocity} = shown.picture, unit = (/** @type {number} */ turned) => sides[turned >= 0 ? 0 : 1];
    const inside = rotation.findIndex((/** @type {number} */ turned) => Math.abs(turned) > REACH * unit(turned).alpha);
    const points = Array.from(inside < 0 ? rotation : rotation.slice(0, inside), (turned, k) => this.at(/** @type {number} */ (turned) / unit(turned).alpha, velocity[k] / (unit(turned).p * unit(turned).alpha)));
    put(this.curve, {d: line(points.map(([x]) => x), points.map(([, y]) => y)), class: `curve ${shown.overturned ? "over" : ""}`});
    const [left, top] = this.at(-REACH, SPEED), [right, bottom] = this.at(REACH, -SPEED), [middle, level] = this.at(0, 0);
    put(this.axes, {d: `M${left} ${level}H${right}M${middle} ${top}V${bottom}`});
    let path = "";
    for (const sign of [1, -1]) { // on each side: the motion that just reaches the balance
      const {alpha} = sides[sign > 0 ? 0 : 1], steps = Array.from({length: 41}, (_, k) => (k / 40) * REACH);
      const speeds = steps.map((each) => (model === "linear" ? Math.abs(1 - each) : Math.sqrt(2 * (1 - Math.cos(alpha * (1 - each)))) / alpha));
      const lines = steps.map((each, k) => this.at(sign * each, sign * (each <= 1 ? speeds[k] : -speeds[k])));
      path += line(lines.map(([x]) => x), lines.map(([, y]) => y));
    }
    put(this.limit, {d: path});
    const text = (/** @type {number} */ x, /** @type {number} */ y, /** @type {string} */ words, anchor = "middle") => draw("text", {x, y, "text-anchor": anchor}, [words]);
    this.texts.replaceChildren(...[-1, 1].map((each) => text(this.at(each, 0)[0], level + 16, "balance")), text(right, level - 8, "rotation", "end"), text(middle + 8, top + 4, "angular velocity", "start"));
    this.follow();
  }

  follow() {
    const {shown, time} = this.page;
    if (!this.width) return;
    const {times, rotation, velocity, from, until} = shown.picture, k = Math.round(((time - from) / (until - from)) * (times.length - 1)), {alpha, p} = shown.body.sides[rotation[k] >= 0 ? 0 : 1];
    const [cx, cy] = this.at(rotation[k] / alpha, velocity[k] / (p * alpha));
    put(this.dot, {cx, cy});
  }
}
