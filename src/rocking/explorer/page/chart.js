// Charts of lines, areas, marks and pictures over two axes, as SVG: they scale with the page and with paper.

import {draw, put, stepOf} from "./standalone/dom.js";
import {written} from "./ticks.js";
import {power} from "./numbers.js";

const LEFT = 66, RIGHT = 12, TOP = 8, AXIS = 40, ROW = 19;
/** Width of a letter of a legend, pixels; pixels that a click may move; pixels beyond the frame that are drawn. */
const LETTER = 6.7, STILL = 5, FAR = 2e4;
/** Properties that a saved figure takes from the style sheet. */
const STYLED = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "fill-opacity", "font-size", "font-family", "text-anchor"];

/** @typedef {{low: number, high: number, label?: string, log?: boolean}} Axis */
/** A layer has one of: line and area [x, y, (y)], dots [x, y], segments [x, y, x, y], bands [from, to], rules along x or y, ticks,
 * picture. Its class is its look. @typedef {{class: string, line?: any[], area?: any[], dots?: any[], segments?: any[], bands?: any[], along?: "x" | "y", rules?: any, ticks?: any, row?: number, picture?: string, box?: number[]}} Layer */
/** @typedef {{x: Axis, y: Axis, layers: Layer[], legend?: string[][]}} Content classes, shapes and texts of the legend, and colours that are no class */

export class Chart {
  /** @param {HTMLElement} host @param {{label: string, height: number, hover?: (x: number | null, y: number) => void, pick?: (x: number, y: number) => void, zoom?: (x: number[], y: number[]) => void, both?: boolean}} given */
  constructor(host, given) {
    this.host = host;
    this.given = given;
    this.width = this.across = this.up = 0;
    /** @type {Content | null} */
    this.content = null;
    this.svg = draw("svg", {class: "chart", role: "img", "aria-label": given.label});
    this.inner = draw("svg", {});
    this.cursor = draw("path", {class: "cursor"});
    this.box = draw("rect", {class: "zoom"});
    host.append(this.svg);
    new ResizeObserver(() => { if (host.clientWidth !== this.width) this.render(); }).observe(host);
    this.listen();
  }

  /** @param {Content} content */
  show(content) {
    this.content = content;
    this.render();
  }

  /** Pixels of values, from the corner of the frame. @param {number} value */
  x(value) { return this.place(value, /** @type {Content} */ (this.content).x) * this.across; }

  /** @param {number} value */
  y(value) { return (1 - this.place(value, /** @type {Content} */ (this.content).y)) * this.up; }

  /** @param {number} value @param {Axis} axis */
  place(value, {low, high, log}) { return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low); }

  /** @param {number} part @param {Axis} axis */
  value(part, {low, high, log}) { return log ? low * (high / low) ** part : low + part * (high - low); }

  render() {
    const {clientWidth: width} = this.host, {content, given: {height}} = this;
    if (!width || !content) return;
    this.width = width;
    this.across = width - LEFT - RIGHT;
    this.up = height - TOP - AXIS;
    const legend = this.legend(content.legend ?? [], height), whole = height + legend.rows * ROW;
    put(this.svg, {viewBox: `0 0 ${width} ${whole}`});
    put(this.inner, {x: LEFT, y: TOP, width: this.across, height: this.up});
    this.inner.replaceChildren(...content.layers.flatMap((layer) => this.layer(layer)), this.cursor, this.box);
    put(this.cursor, {d: ""});
    put(this.box, {width: 0, height: 0});
    this.svg.replaceChildren(...this.axes(content, height), this.inner, draw("rect", {class: "frame", x: LEFT, y: TOP, width: this.across, height: this.up}), legend.drawn);
  }

  /** @param {Layer} layer @returns {Element[]} */
  layer(layer) {
    const path = (/** @type {string} */ d) => [draw("path", {class: layer.class, d})];
    const {across, up} = this;
    if (layer.line) return path(this.path(layer.line[0], layer.line[1]));
    if (layer.area) {
      const [x, low, high] = layer.area, back = Array.from(x, (_, k) => x.length - 1 - k);
      return x.length ? path(`${this.path(x, low)}${this.path(back.map((k) => x[k]), back.map((k) => high[k])).replace("M", "L")}Z`) : [];
    }
    if (layer.dots) return path(this.path(layer.dots[0], layer.dots[1], true));
    if (layer.segments) { const [x, y, toX, toY] = layer.segments; return path(Array.from(x, (_, k) => `M${this.x(x[k]).toFixed(1)} ${this.y(y[k]).toFixed(1)}L${this.x(toX[k]).toFixed(1)} ${this.y(toY[k]).toFixed(1)}`).join("")); }
    if (layer.bands) return path(Array.from(layer.bands, ([from, to]) => `M${this.near(this.x(from))} 0H${this.near(this.x(to))}V${up}H${this.near(this.x(from))}Z`).join(""));
    if (layer.rules) return path(Array.from(layer.rules, (at) => (layer.along === "y" ? `M${this.x(at)} 0V${up}` : `M0 ${this.y(at)}H${across}`)).join(""));
    if (layer.ticks) return path(Array.from(layer.ticks, (at) => `M${this.x(at).toFixed(1)} ${up - 4 - 14 * (layer.row ?? 0)}v-10`).join(""));
    const [left, right, low, high] = layer.box ?? [0, 1, 0, 1];
    return [draw("image", {href: layer.picture ?? "", x: this.x(left), y: this.y(high), width: this.x(right) - this.x(left), height: this.y(low) - this.y(high), preserveAspectRatio: "none", class: layer.class})];
  }

  /** @param {number} pixels */
  near(pixels) { return Math.max(-FAR, Math.min(FAR, pixels)).toFixed(1); }

  /** Path through points with gaps where there is no number, or a dot at each. @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {boolean} [dotted] */
  path(x, y, dotted = false) {
    let text = "", before = false;
    for (let k = 0; k < x.length; k += 1) {
      const across = this.x(x[k]), up = this.y(y[k]), seen = Number.isFinite(across) && Number.isFinite(up);
      if (seen) text += `${before && !dotted ? "L" : "M"}${this.near(across)} ${this.near(up)}${dotted ? "h0" : ""}`;
      before = seen;
    }
    return text;
  }

  /** Grid, ticks and labels. @param {Content} content @param {number} height */
  axes({x, y}, height) {
    const text = (/** @type {number} */ left, /** @type {number} */ top, /** @type {string} */ words, /** @type {string} */ anchor, turned = false) =>
      draw("text", {x: left, y: top, "text-anchor": anchor, ...(turned ? {transform: `rotate(-90 ${left} ${top})`} : {})}, [words]);
    const [right, up] = [ticks(x, this.across / 90), ticks(y, this.up / 46)];
    const grid = right.map(([at]) => `M${LEFT + this.x(at)} ${TOP}v${this.up}`).join("") + up.map(([at]) => `M${LEFT} ${TOP + this.y(at)}h${this.across}`).join("");
    return [
      draw("path", {class: "grid", d: grid}),
      ...right.map(([at, words]) => text(LEFT + this.x(at), height - AXIS + 16, words, "middle")),
      ...up.map(([at, words]) => text(LEFT - 6, TOP + this.y(at) + 4, words, "end")),
      text(LEFT + this.across / 2, height - 7, x.label ?? "", "middle"), text(12, TOP + this.up / 2, y.label ?? "", "middle", true),
    ];
  }

  /** Keys in rows below the figure. @param {string[][]} entries @param {number} height */
  legend(entries, height) {
    const first = this.width < 500 ? 8 : LEFT;
    let left = first, row = 0;
    const drawn = entries.flatMap(([look, shape, words, ink]) => {
      const wide = 26 + LETTER * words.length;
      if (left > first && left + wide > this.width) { left = first; row += 1; }
      const x = left, y = height + row * ROW + 8;
      left += wide + 12;
      const d = shape === "area" ? `M${x} ${y - 5}h18v10h-18Z` : shape === "tick" ? `M${x + 9} ${y - 5}v10` : shape === "dot" ? `M${x + 9} ${y}h0` : `M${x} ${y}h18`;
      const key = draw("path", {class: look, d});
      if (ink) key.style.fill = ink;
      return [key, draw("text", {class: "soft", x: x + 24, y: y + 4}, [words])];
    });
    return {rows: entries.length ? row + 1 : 0, drawn: draw("g", {class: "legend"}, drawn)};
  }

  /** Mark a value of x, or none. @param {number | null} value */
  mark(value) {
    if (!this.content || !this.width) return;
    const x = value === null ? NaN : this.x(value);
    put(this.cursor, {d: x >= 0 && x <= this.across ? `M${x} 0V${this.up}` : ""});
  }

  listen() {
    const {hover, pick, zoom, both = false} = this.given, {svg} = this;
    /** @param {PointerEvent} event @returns {[number, number]} */
    const at = (event) => {
      const box = svg.getBoundingClientRect(), scale = this.width / box.width;
      return [(event.clientX - box.left) * scale - LEFT, (event.clientY - box.top) * scale - TOP];
    };
    const values = (/** @type {number[]} */ [x, y]) => {
      const {x: right, y: up} = /** @type {Content} */ (this.content), part = (/** @type {number} */ each) => Math.min(1, Math.max(0, each));
      return [this.value(part(x / this.across), right), this.value(part(1 - y / this.up), up)];
    };
    /** @type {[number, number] | null} */
    let from = null;
    svg.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
      if (!this.content || event.button !== 0) return;
      from = at(event);
      if (zoom && event.pointerType !== "touch") svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
      if (!this.content) return;
      const now = at(event), inside = now[0] >= 0 && now[0] <= this.across && now[1] >= 0 && now[1] <= this.up;
      if (from && zoom && event.pointerType !== "touch") {
        const [x, y] = [0, 1].map((k) => Math.min(now[k], /** @type {number[]} */ (from)[k]));
        put(this.box, {x, y: both ? y : 0, width: Math.abs(now[0] - from[0]), height: both ? Math.abs(now[1] - from[1]) : this.up});
      } else if (hover) { const [x, y] = values(now); hover(inside ? x : null, y); }
    });
    svg.addEventListener("pointerup", (/** @type {PointerEvent} */ event) => {
      if (!this.content || !from) return;
      const now = at(event), first = from, moved = Math.max(Math.abs(now[0] - first[0]), both ? Math.abs(now[1] - first[1]) : 0);
      from = null;
      put(this.box, {width: 0, height: 0});
      if (moved < STILL) { const [x, y] = values(now); pick?.(x, y); return; }
      if (!zoom || event.pointerType === "touch") return;
      const [[x0, y0], [x1, y1]] = [values(first), values(now)];
      zoom([Math.min(x0, x1), Math.max(x0, x1)], [Math.min(y0, y1), Math.max(y0, y1)]);
    });
    svg.addEventListener("pointercancel", () => { from = null; });
    svg.addEventListener("pointerleave", () => hover?.(null, 0));
  }

  /** The figure as a file, with its legend. @param {"svg" | "png"} form @returns {Promise<Blob>} */
  async file(form) {
    const copy = /** @type {SVGSVGElement} */ (this.svg.cloneNode(true)), {width} = this, height = this.svg.viewBox.baseVal.height;
    const originals = this.svg.querySelectorAll("*");
    copy.querySelectorAll("*").forEach((each, k) => {
      const style = getComputedStyle(originals[k]);
      if (!each.matches("image, svg, g")) for (const name of STYLED) each.setAttribute(name, style.getPropertyValue(name));
    });
    put(copy, {xmlns: "http://www.w3.org/2000/svg", width, height});
    copy.prepend(draw("rect", {width, height, fill: getComputedStyle(document.documentElement).getPropertyValue("--paper").trim()}));
    const drawing = new Blob([new XMLSerializer().serializeToString(copy)], {type: "image/svg+xml"});
    if (form === "svg") return drawing;
    const image = new Image(), address = URL.createObjectURL(drawing);
    image.src = address;
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), {width: 2 * width, height: 2 * height});
    canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
    URL.revokeObjectURL(address);
    return new Promise((give) => { canvas.toBlob((blob) => give(/** @type {Blob} */ (blob)), "image/png"); });
  }
}

/** Values and texts of the ticks of an axis. @param {Axis} axis @param {number} most @returns {[number, string][]} */
function ticks({low, high, log}, most) {
  if (log) {
    const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9), step = Math.max(1, Math.ceil((last - first) / most));
    return Array.from({length: Math.max(0, Math.floor((last - first) / step) + 1)}, (_, k) => [10 ** (first + k * step), first + k * step === 0 ? "1" : power(first + k * step).slice(1)]);
  }
  const step = stepOf(high - low, Math.max(2, most)), first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  const values = Array.from({length: Math.max(0, last - first + 1)}, (_, k) => Number(((first + k) * step).toPrecision(12)));
  return written(values).map((words, k) => [values[k], words]);
}

/** Lowest and highest value of arrays, with a margin. @param {ArrayLike<number>[]} all @param {number} [margin] @returns {{low: number, high: number}} */
export function around(all, margin = 0.06) {
  let low = Infinity, high = -Infinity;
  for (const values of all) for (let k = 0; k < values.length; k += 1) { if (values[k] < low) low = values[k]; if (values[k] > high) high = values[k]; }
  if (!(low <= high)) return {low: -1, high: 1};
  const wide = high - low || Math.abs(high) || 1;
  return {low: low - margin * wide, high: high + margin * wide};
}

/** A line with a gap after each of these points. @param {Float64Array} x @param {Float64Array} y @param {number[]} after */
export function gaps(x, y, after) {
  const cut = new Set(after);
  return [x, y].map((all) => Array.from(all).flatMap((each, k) => (cut.has(k) ? [each, NaN] : [each])));
}
