// The block on its moving ground, to scale, at one moment; and a body of a mesh from above.

import {draw, make, one, put, stepOf} from "./standalone/dom.js";
import {length, ofG} from "./units.js";
import {short} from "./numbers.js";

const BELOW = 34, ABOVE = 14, SIZE = 252, MARGIN = 16;
const still = window.matchMedia("(prefers-reduced-motion: reduce)");

export class Scene {
  constructor() {
    this.svg = one("scene");
    this.grid = draw("path", {class: "grid"});
    this.earth = draw("path", {class: "earth"});
    this.hatch = draw("path", {class: "hatch"});
    this.block = draw("path", {class: "block"});
    this.mass = draw("circle", {class: "mass", r: 4});
    this.words = draw("text", {class: "soft", "text-anchor": "end"});
    this.turned = draw("g", {}, [this.block, this.mass]);
    this.svg.append(this.grid, this.earth, this.hatch, this.turned, this.words);
    new ResizeObserver(() => this.paint()).observe(this.svg);
    this.state = {rotation: 0, moved: 0, slip: 0};
    /** @type {any} */
    this.header = null;
  }

  /** Show another block. @param {any} header of the case @param {Float64Array | undefined} outline trapezoids of a mesh */
  show(header, outline) {
    const {left, right, top} = header.block.outline;
    this.header = header;
    this.corners = outline ? Array.from({length: outline.length / 6}, (_, k) => {
      const [low, high, l, r, leftAbove, rightAbove] = outline.subarray(6 * k, 6 * k + 6);
      return [[l, low], [r, low], [rightAbove, high], [leftAbove, high]];
    }) : [[[-left, 0], [right, 0], [right, top], [-left, top]]];
    this.paint();
  }

  /** @param {{rotation: number, moved: number, slip: number}} state rotation in rad, and displacements in m */
  paint(state = this.state) {
    this.state = state;
    const {clientWidth: width, clientHeight: height} = this.svg;
    if (!this.header || !this.corners || !width) return;
    const {left, right, centre, top, widest} = this.header.block.outline, {rotation} = state, floor = height - BELOW;
    const scale = Math.min((floor - ABOVE) / Math.hypot(top, widest), width / (2.2 * Math.hypot(top, widest)));
    const step = stepOf(width / scale, 12), moved = still.matches ? 0 : scale * state.moved, free = Math.max(0, width / 2 - scale * Math.hypot(top, widest));
    const shift = Math.max(-free, Math.min(free, moved)), middle = width / 2 + shift, behind = moved - shift, pixels = step * scale;
    put(this.svg, {viewBox: `0 0 ${width} ${height}`});
    let grid = "", hatch = `M0 ${floor}H${width}`;
    for (let x = (((width / 2 - behind) % pixels) + pixels) % pixels; x < width; x += pixels) grid += `M${x.toFixed(1)} 0V${floor}`;
    for (let y = floor - pixels; y > 0; y -= pixels) grid += `M0 ${y.toFixed(1)}H${width}`;
    for (let x = (((middle % 18) + 18) % 18) - 18; x < width + 18; x += 18) hatch += `M${(x + 9).toFixed(1)} ${floor + 3}l-8 9`;
    put(this.grid, {d: grid});
    put(this.earth, {d: `M0 ${floor}H${width}V${height}H0Z`});
    put(this.hatch, {d: hatch});
    const path = this.corners.map((corners) => `M${corners.map(([x, y]) => `${(scale * x).toFixed(2)} ${(-scale * y).toFixed(2)}`).join("L")}Z`).join("");
    put(this.block, {d: path, class: this.corners.length > 1 ? "block mesh" : "block"});
    put(this.mass, {cy: -scale * centre});
    const pivot = scale * (rotation >= 0 ? right : -left);
    put(this.turned, {transform: `translate(${middle + scale * state.slip + pivot} ${floor}) rotate(${(rotation * 180) / Math.PI}) translate(${-pivot} 0)`});
    put(this.words, {x: width - 8, y: height - 9});
    this.words.textContent = `grid ${length(step)}`;
  }
}

/** A body from above with its resistance in every direction; a click chooses an azimuth. @param {HTMLElement} place @param {import("./api.js").Payload} found
 * @param {any} plane the plane of rocking @param {(azimuth: string) => void} turn */
export function drawPlan(place, {header: {body}, arrays: {azimuth, acceleration, support, plan, piece}}, plane, turn) {
  const {height_of_mass: height, gravity_g: gravity} = body, angle = (plane.azimuth * Math.PI) / 180, [east, north] = [Math.sin(angle), Math.cos(angle)];
  const reach = Math.max(height * Math.max(...acceleration), ...[support, plan].map((each) => each.reduce((most, x) => Math.max(most, Math.abs(x)), 0)));
  const scale = (SIZE / 2 - MARGIN) / reach, across = (/** @type {number} */ metres) => (SIZE / 2 + scale * metres).toFixed(2);
  const path = (/** @type {ArrayLike<number>} */ corners, from = 0, to = corners.length / 2) => `M${Array.from({length: to - from}, (_, k) => `${across(corners[2 * (from + k)])} ${across(-corners[2 * (from + k) + 1])}`).join("L")}Z`;
  const rose = Array.from(azimuth).flatMap((each, k) => [height * acceleration[k] * Math.sin((each * Math.PI) / 180), height * acceleration[k] * Math.cos((each * Math.PI) / 180)]);
  const step = stepOf(reach / height, 3), rings = Array.from({length: Math.floor(reach / height / step)}, (_, k) => (k + 1) * step);
  const at = (/** @type {number} */ along, /** @type {number} */ beside) => `${across(along * east - beside * north)} ${across(-(along * north + beside * east))}`;
  const edges = plane.edges.map((/** @type {number[]} */ [distance, low, high], /** @type {number} */ side) => { const sign = side ? -1 : 1; return `M${at(sign * distance, sign * low)}L${at(sign * distance, sign * high)}`; }).join("");
  const svg = draw("svg", {viewBox: `0 0 ${SIZE} ${SIZE}`, class: "plan", role: "img", "aria-label": "Body from above, with the acceleration that lifts it in every direction", on: {click: (/** @type {MouseEvent} */ event) => {
    const box = svg.getBoundingClientRect(), chosen = (Math.atan2(event.clientX - box.left - box.width / 2, box.top + box.height / 2 - event.clientY) * 180) / Math.PI;
    turn(String((Math.round(chosen) + 360) % 360));
  }}}, [
    draw("path", {class: "body", d: Array.from(piece, (end, k) => path(plan, k ? piece[k - 1] : 0, end)).join("")}),
    ...rings.map((level) => draw("circle", {class: "grid", cx: SIZE / 2, cy: SIZE / 2, r: scale * height * level})),
    draw("path", {class: "support", d: path(support)}), draw("path", {class: "rose", d: path(rose)}),
    draw("path", {class: "edges", d: edges}), draw("path", {class: "towards", d: `M${at(0, 0)}L${at(reach, 0)}`}),
    draw("text", {x: SIZE / 2, y: 12, "text-anchor": "middle"}, ["N"]), draw("text", {x: SIZE - 8, y: SIZE / 2 + 4, "text-anchor": "middle"}, ["E"]),
  ]);
  const about = `The body is lifted first towards ${short(body.weakest_azimuth, 4)}°, above ${ofG(gravity * body.weakest)}. The curve is the acceleration that lifts it, with circles ${ofG(gravity * step)} apart. Click to turn it.`;
  place.replaceChildren(svg, make("p", {class: "soft"}, [about]), make("details", {}, [make("summary", {}, ["All numbers of the body"]), make("pre", {}, [body.summary.join("\n")])]));
}
