// A body of a mesh as it is seen from above, with its resistance in every direction; and its outline from one side.

import {colour} from "./theme.js";
import {make} from "./words.js";
import {short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";
import {ofG} from "./units.js";

/** Width of the plan, pixels, and of what is free around it. */
const SIZE = 252, MARGIN = 16;

/** @param {string} name @param {Record<string, string | number>} given @param {(Node | string)[]} [inside] */
function shape(name, given, inside = []) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(given)) made.setAttribute(key, String(value));
  made.append(...inside);
  return made;
}

export class Plan {
  /** @param {(azimuth: string) => void} turned is told the azimuth that is chosen */
  constructor(turned) {
    this.svg = shape("svg", {viewBox: `0 0 ${SIZE} ${SIZE}`, class: "plan", role: "img", "aria-label": phrase("plan.picture")});
    this.svg.addEventListener("click", (event) => {
      const {left, top, width, height} = this.svg.getBoundingClientRect();
      const {clientX, clientY} = /** @type {MouseEvent} */ (event);
      const azimuth = (Math.atan2(clientX - left - width / 2, top + height / 2 - clientY) * 180) / Math.PI;
      turned(String((Math.round(azimuth) + 360) % 360));
    });
    this.still = shape("g", {});
    this.moving = shape("g", {});
    this.svg.append(this.still, this.moving);
    this.words = make("div", {className: "derived"});
    this.legend = make("p", {className: "legend"});
    this.element = make("div", {}, [this.svg, make("p", {className: "derived"}, [phrase("plan.turn")]), this.legend, this.words]);
    this.scale = 0;
  }

  /** Places in the picture of corners to the east and to the north, m. @param {Float64Array} corners @param {number} [from] @param {number} [to] */
  path(corners, from = 0, to = corners.length / 2) {
    const places = Array.from({length: to - from}, (_, k) => `${this.across(corners[2 * (from + k)])} ${this.across(-corners[2 * (from + k) + 1])}`);
    return `M${places.join("L")}Z`;
  }

  /** @param {number} metres */
  across(metres) { return (SIZE / 2 + this.scale * metres).toFixed(2); }

  /** @param {import("./api.js").Payload} found */
  draw({header, arrays}) {
    const {azimuth, acceleration, support, plan, piece} = arrays;
    const height = header.height_of_mass;
    const reach = Math.max(height * acceleration.reduce((a, b) => Math.max(a, b)), ...[support, plan].map((each) => each.reduce((most, x) => Math.max(most, Math.abs(x)), 0)));
    this.scale = (SIZE / 2 - MARGIN) / reach;
    this.reach = reach;
    const rose = new Float64Array(2 * azimuth.length);
    azimuth.forEach((each, k) => {
      rose[2 * k] = height * acceleration[k] * Math.sin((each * Math.PI) / 180);
      rose[2 * k + 1] = height * acceleration[k] * Math.cos((each * Math.PI) / 180);
    });
    const step = nice(reach / height / 2.5);
    const rings = Array.from({length: Math.floor(reach / height / step)}, (_, k) => (k + 1) * step);
    const pieces = Array.from(piece, (end, k) => this.path(plan, k ? piece[k - 1] : 0, end)).join("");
    this.still.replaceChildren(
      shape("path", {d: pieces, class: "plan-edge"}), shape("path", {d: pieces, class: "plan-body"}),
      ...rings.map((level) => shape("circle", {cx: SIZE / 2, cy: SIZE / 2, r: (this.scale * height * level).toFixed(2), class: "plan-ring"})),
      ...rings.slice(-2).map((level) => shape("text", {x: SIZE / 2, y: (SIZE / 2 + this.scale * height * level + 4).toFixed(2), class: "plan-text"}, [ofG(header.gravity_g * level)])),
      shape("path", {d: this.path(support), class: "plan-support"}),
      shape("path", {d: this.path(rose), class: "plan-rose"}),
      ...[[phrase("plan.north"), 0, -1], [phrase("plan.east"), 1, 0]].map(([name, x, y]) => shape("text", {x: SIZE / 2 + Number(x) * (SIZE / 2 - 7), y: SIZE / 2 + Number(y) * (SIZE / 2 - 9) + 4, class: "plan-compass"}, [String(name)])),
    );
    const entries = [["plan-key-body", phrase("plan.body")], ["line", phrase("plan.support")], ["plan-key-rose", phrase("plan.rose")], ["plan-key-edge", phrase("plan.edges")]];
    this.legend.replaceChildren(...entries.map(([kind, words]) => make("span", {}, [make("i", {className: `key ${kind}`}), words])));
    const about = phrase("plan.about", {body: inWords(header.about), azimuth: short(header.weakest_azimuth, 4), acceleration: ofG(header.gravity_g * header.weakest)});
    this.words.replaceChildren(...[about, inWords(header.left_out), inWords(header.repaired)].map((words) => make("p", {}, [words])));
  }

  /** Show the direction, and the edges about which the body rocks. @param {any} body */
  turn(body) {
    if (!body || !this.scale) { this.moving.replaceChildren(); return; }
    const angle = (body.azimuth * Math.PI) / 180;
    const [east, north] = [Math.sin(angle), Math.cos(angle)];
    /** A line at a distance along the azimuth, from one place across it to another. @param {number} distance @param {number} from @param {number} to @param {string} kind */
    const line = (distance, from, to, kind) => shape("line", {
      x1: this.across(distance * east - from * north), y1: this.across(-(distance * north + from * east)),
      x2: this.across(distance * east - to * north), y2: this.across(-(distance * north + to * east)), class: kind,
    });
    const far = this.reach ?? 1;
    const half = (/** @type {number} */ distance) => 0.92 * Math.sqrt(Math.max(far * far - distance * distance, 0.04 * far * far));
    const edges = body.edges.flatMap((/** @type {number[]} */ [distance, low, high], /** @type {number} */ side) => {
      // The second edge looks the other way: what is across it is counted from the other end.
      const sign = side ? -1 : 1, short_ = 0.02 * far * Number(high - low < 0.04 * far);
      return [line(sign * distance, -half(distance), half(distance), "plan-axis"), line(sign * distance, sign * low - short_, sign * high + short_, "plan-pivot")];
    });
    const tip = far * 0.98;
    const head = [[tip, 0], [tip - 9 / this.scale, 4.5 / this.scale], [tip - 9 / this.scale, -4.5 / this.scale]].flatMap(([along, across]) => [along * east - across * north, along * north + across * east]);
    this.moving.replaceChildren(
      ...edges,
      shape("line", {x1: SIZE / 2, y1: SIZE / 2, x2: this.across(tip * east), y2: this.across(-tip * north), class: "plan-towards"}),
      shape("path", {d: this.path(Float64Array.from(head)), class: "plan-head"}),
      shape("circle", {cx: SIZE / 2, cy: SIZE / 2, r: 3.5, class: "plan-centre"}),
    );
  }
}

/** A round number next to another. @param {number} value */
function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 2, 5].find((each) => each * power >= value) ?? 10);
}

/** Fill an outline of trapezoids with one line around all. The centre of mass is at the left and right of zero, the ground at
 * zero. @param {CanvasRenderingContext2D} pen @param {Float64Array} profile @param {number} scale */
export function fillOutline(pen, profile, scale) {
  const path = new Path2D();
  for (let k = 0; k < profile.length; k += 6) {
    const [low, high, left, right, leftAbove, rightAbove] = profile.subarray(k, k + 6);
    path.moveTo(scale * left, -scale * low);
    path.lineTo(scale * right, -scale * low);
    path.lineTo(scale * rightAbove, -scale * high);
    path.lineTo(scale * leftAbove, -scale * high);
    path.closePath();
  }
  pen.lineJoin = "round";
  pen.strokeStyle = colour("ink");
  pen.lineWidth = 3;
  pen.stroke(path);
  // What is filled covers the lines between trapezoids.
  pen.fillStyle = pen.strokeStyle = colour("stone");
  pen.lineWidth = 0.8;
  pen.fill(path);
  pen.stroke(path);
}
