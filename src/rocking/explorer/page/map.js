// A map of outcomes over two parameters of the case, from coarse to fine; or of a study.

import {Latest, json, parts, payload} from "./api.js";
import {Chart} from "./chart.js";
import {make, one} from "./standalone/dom.js";
import {specification, writeAddress} from "./state.js";
import {amongst, joined, short, typed} from "./numbers.js";
import {known, labelOf, phrase} from "./texts.js";
import {axisUnit} from "./units.js";
import {choose, isTyped, optionsOf} from "./forms.js";
import {csv, offer} from "./save.js";

/** Colours of the first outcome, the final outcome and the verdict of a study; orange is overturning, and nothing else. */
export const OUTCOMES = ["#ffffff", "#c9dcf0", "#7fa3cf", "#1d3f73", "#d4660f", "#b0b0b0"];
export const MODES = /** @type {[number, string][]} */ ([[-3, "#ffffff"], [-1, "#c9dcf0"], [-2, "#7fa3cf"], [0, "#5e2404"], [1, "#b0480a"], [2, "#f08c2e"], [-4, "#ffc58a"]]);
export const VERDICTS = /** @type {[number, string][]} */ ([[0, "#c9dcf0"], [1, "#d4660f"], [-1, "#b0b0b0"]]);
/** Dark to light in even steps of lightness. */
export const RAMP = ["#0b1a3a", "#14346b", "#1f5190", "#3a74a8", "#5f97b8", "#8bb8c6", "#b9d6d4", "#e6efe4", "#fdf3d6"];
const OVERTURNS = OUTCOMES[4], UNKNOWN = OUTCOMES[5], ENDS = ["x_from", "x_to", "y_from", "y_to"], REPAINT = 120;

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.study = specification.study;
    /** @type {AbortController | null} */
    this.running = null;
    this.latest = new Latest(() => (this.study ? this.slice() : this.stream()), (error) => page.problem(error, "view-map"));
    /** @type {any} */
    this.about = null;
    /** @type {Record<string, Float64Array>} */
    this.values = {};
    this.key = "";
    this.mark = [NaN, NaN];
    /** Ends of the axes before each zoom. @type {import("./api.js").Texts[]} */
    this.before = [];
    /** Rectangle of a study that is shown. @type {number[] | null} */
    this.part = null;
    this.chart = new Chart(one("map"), {
      label: "Map of outcomes over two parameters", height: 520, both: true, hover: (x, y) => this.say(x === null ? this.mark : [x, y]),
      pick: (x, y) => { this.put(x, y); void this.open(); }, zoom: (x, y) => this.into([...x, ...y]),
    });
    for (const name of ["quantity", "x", "y", "points", ...ENDS]) one(name).addEventListener("change", () => this.chosen(name));
    one("map").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.press(event));
    one("map-open").addEventListener("click", () => this.open());
    one("map-out").addEventListener("click", () => this.out());
    /** @type {Record<string, any>} */
    this.slices = {};
    if (this.study) this.studyFields();
  }

  enter() { this.update(); }

  leave() { this.running?.abort(); }

  update() {
    this.running?.abort();
    void this.latest.ask();
  }

  /** Fields that fix what a slice of a study does not vary. */
  studyFields() {
    for (const [axis, values] of /** @type {[string, any[]][]} */ (Object.entries(this.study.choices))) {
      if (values.length < 2) continue;
      const name = `${axis}_index`, select = make("select", {"data-argument": name, on: {change: () => { this.page.state.map[name] = select.value; this.update(); }}}, optionsOf(values.map((/** @type {any} */ value, /** @type {number} */ k) => [String(k), typeof value === "number" ? short(value, 6) : value])));
      this.slices[name] = select;
      one("map-tools").append(make("label", {}, [`${axis} `, select]));
    }
    for (const name of [...ENDS, "points"]) one(name).parentElement.hidden = true;
    one("map-tools").prepend(make("strong", {}, [`Study ${this.study.name} `]), make("span", {class: "soft"}, [this.study.status]));
  }

  /** A field was changed. @param {string} name */
  chosen(name) {
    const {map} = this.page.state, text = typed(one(name).value);
    if (ENDS.includes(name) && text) map[name] = String(Number((Number(text) / this.size(name[0])).toPrecision(12))); else map[name] = text;
    if (ENDS.includes(name) && !Number.isFinite(Number(map[name]))) map[name] = text; // for the server to refuse
    if (name === "x" || name === "y") { for (const end of ["from", "to"]) delete map[`${name}_${end}`]; this.before = []; this.part = null; }
    if (name === "quantity" && !this.study && this.about) { writeAddress(this.page.state); this.paint(); this.files(); return; }
    this.update();
  }

  /** Size of the axis's own unit in that of the page. @param {string} which */
  size(which) { return axisUnit(this.about?.[which].own ?? this.about?.[which].unit)[0]; }

  get quantity() {
    const {quantity} = this.page.state.map, all = this.study ? this.study.quantities : specification.quantities;
    return all.includes(quantity) ? quantity : this.study || this.page.state.texts.motion?.startsWith("sine:") ? all[0] : "mode";
  }

  /** Show what the map has. @param {string[]} axes @param {any[]} all */
  fill(axes, all) {
    const label = (/** @type {string} */ name) => { const axis = all.find((each) => each.name === name); return axis.unit ? `${labelOf(axis)} (${axisUnit(axis.unit)[1]})` : labelOf(axis); };
    one("quantity").replaceChildren(...optionsOf((this.study ? this.study.quantities : specification.quantities).map((/** @type {string} */ name) => [name, phrase(`quantity.${name}`)])));
    one("quantity").value = this.quantity;
    if (!this.study) choose(one("points"), String(this.about.x.values.length));
    for (const which of ["x", "y"]) {
      const {name, values} = this.about[which];
      one(which).replaceChildren(...optionsOf(axes.filter((each) => this.study || which === "y" || !["a", "pga"].includes(each)).map((each) => [each, label(each)])));
      one(which).value = name;
      for (const [k, end] of ["from", "to"].entries()) {
        const field = one(`${which}_${end}`);
        if (!isTyped(field)) field.value = String(Number(values[k ? values.length - 1 : 0].toPrecision(6)));
      }
    }
    one("map-out").disabled = !this.before.length && (Boolean(this.study) || !ENDS.some((end) => this.page.state.map[end]));
  }

  /** An axis in the unit of the page. @param {any} axis */
  shown(axis) {
    const [scale, unit] = axisUnit(axis.unit);
    return {...axis, own: axis.unit, scale, unit, values: axis.values.map((/** @type {number} */ each) => each * scale)};
  }

  async stream() {
    this.running = new AbortController();
    const {signal} = this.running, {texts, map} = this.page.state, {quantity: _quantity, ...asked} = map, key = JSON.stringify([texts, asked]);
    if (key === this.key) { this.paint(); this.files(); return; }
    this.key = "";
    document.body.dataset.map = "running";
    let covered = new Uint8Array(0), done = 0, painted = 0;
    for await (const {header, arrays} of parts("/api/map", {...texts, ...asked}, signal)) {
      if (header.shape) {
        const [rows, columns] = header.shape;
        this.about = {...header, x: this.shown(header.x), y: this.shown(header.y)};
        this.values = Object.fromEntries(specification.quantities.map((/** @type {string} */ name) => [name, new Float64Array(rows * columns).fill(NaN)]));
        covered = new Uint8Array(rows * columns).fill(255);
        const at = header.case.map((/** @type {number} */ each, /** @type {number} */ k) => each * this.about[k ? "y" : "x"].scale);
        this.case = at;
        this.mark = at;
        writeAddress(this.page.state);
        this.fill(header.axes, specification.axes);
        this.files();
        continue;
      }
      done += this.take(header.stride, arrays, covered);
      one("map-progress").value = done / covered.length;
      if (performance.now() - painted > REPAINT) { this.paint(); painted = performance.now(); }
    }
    this.key = key;
    this.paint();
    this.say(this.mark);
    this.files();
    document.body.dataset.map = "complete";
  }

  /** Put points where they belong. A coarse point covers finer ones that are still to come. @param {number} stride @param {Record<string, Float64Array>} arrays @param {Uint8Array} covered */
  take(stride, {points, ...found}, covered) {
    const [rows, columns] = this.about.shape;
    points.forEach((index, k) => {
      const row = Math.floor(index / columns), column = index % columns;
      for (let r = row; r < Math.min(rows, row + stride); r += 1) for (let c = column; c < Math.min(columns, column + stride); c += 1) {
        const at = r * columns + c;
        if (covered[at] < stride) continue;
        covered[at] = stride;
        for (const name of Object.keys(found)) this.values[name][at] = found[name][k];
      }
    });
    return points.length;
  }

  /** A slice of a study. */
  async slice() {
    const {map} = this.page.state, names = this.study.axes.map((/** @type {any} */ each) => each.name);
    document.body.dataset.map = "running";
    if (!names.includes(map.x)) map.x = names[0];
    if (!names.includes(map.y) || map.y === map.x) map.y = names.find((/** @type {string} */ each) => each !== map.x);
    const {header, arrays} = await payload("/api/study", {...map, quantity: this.quantity});
    this.about = {...header, x: this.shown(header.x), y: this.shown(header.y)};
    this.values = {[header.quantity]: arrays.values};
    for (const [name, select] of Object.entries(this.slices)) {
      select.value = map[name] ?? select.options[0].value;
      select.parentElement.hidden = [map.x, map.y].some((axis) => name === `${axis}_index`);
    }
    this.fill(names, this.study.axes);
    writeAddress(this.page.state);
    this.paint();
    this.files();
    document.body.dataset.map = "complete";
  }

  /** Colours of the points, and what they mean. @returns {{colours: (string | null)[], legend: [string, string][]}} */
  colours() {
    const {quantity} = this, values = this.values[quantity] ?? new Float64Array(0), kinds = this.kinds(quantity);
    if (kinds) {
      const counts = new Map(), last = quantity === "mode" ? 2 : Infinity, of = (/** @type {number} */ each) => Math.min(each, last);
      for (const each of values) counts.set(of(each), (counts.get(of(each)) ?? 0) + 1);
      const inks = new Map(kinds.map(([value, , ink]) => [value, ink])), share = (/** @type {number} */ value) => short((100 * (counts.get(value) ?? 0)) / values.length, 2);
      return {colours: Array.from(values, (each) => inks.get(of(each)) ?? null), legend: kinds.filter(([value]) => counts.has(value)).map(([value, words, ink]) => [ink, `${words}, ${share(value)} %`])};
    }
    const finite = values.filter(Number.isFinite), [low, high] = [quantity === "peak" ? 0 : Math.min(...finite), quantity === "peak" ? 1 : Math.max(...finite)];
    const colours = Array.from(values, (each) => (each === Infinity ? OVERTURNS : Number.isNaN(each) ? UNKNOWN : RAMP[Math.max(0, Math.min(8, Math.floor((9 * (each - low)) / (high - low || 1))))]));
    const ends = RAMP.map((ink, k) => /** @type {[string, string]} */ ([ink, `${short(low + (k * (high - low)) / 9, 2)} to ${short(low + ((k + 1) * (high - low)) / 9, 2)}`]));
    return {colours, legend: [...ends, .../** @type {[string, string][]} */ (quantity === "peak" ? [[OVERTURNS, "overturns"]] : []), .../** @type {[string, string][]} */ (finite.length < values.length && quantity !== "peak" ? [[UNKNOWN, "none"]] : [])]};
  }

  /** Outcomes of a quantity, their texts and colours. @param {string} quantity @returns {[number, string, string][] | null} */
  kinds(quantity) {
    if (quantity === "outcome") return this.about.outcomes.map((/** @type {string} */ name, /** @type {number} */ k) => [k, phrase(`outcome.${name}`), OUTCOMES[k]]);
    const listed = {mode: MODES, overturned: VERDICTS}[quantity];
    return listed ? listed.map(([value, ink]) => [value, phrase(`${quantity}.${value}`), ink]) : null;
  }

  /** Ends of an axis, half a cell beyond its values. @param {number[]} values */
  ends(values) { const last = values.length - 1; return [values[0] - 0.5 * (values[1] - values[0]), values[last] + 0.5 * (values[last] - values[last - 1])]; }

  paint() {
    if (!this.about || !this.values[this.quantity]) return;
    const {x, y, curve} = this.about, {colours, legend} = this.colours(), [left, right] = this.ends(x.values), [low, high] = this.ends(y.values);
    const [across, up] = [x, y].map(({values}) => cells(values)), canvas = make("canvas", {width: across.length, height: up.length}), pen = canvas.getContext("2d"), image = pen.createImageData(across.length, up.length);
    up.forEach((row, r) => across.forEach((column, c) => {
      const ink = colours[row * x.values.length + column];
      if (ink) image.data.set([1, 3, 5].map((at) => parseInt(ink.slice(at, at + 2), 16)).concat(255), 4 * ((up.length - 1 - r) * across.length + c));
    }));
    pen.putImageData(image, 0, 0);
    const box = this.part ?? [left, right, low, high], label = (/** @type {any} */ axis) => (axis.unit ? `${labelOf(axis)} (${axis.unit})` : labelOf(axis));
    const layers = [{class: "pixels", picture: canvas.toDataURL(), box: [left, right, low, high]}], mark = (/** @type {string} */ name, /** @type {number[]} */ [a, b]) => [{class: `dot ${name} around`, dots: [[a], [b]]}, {class: `dot ${name}`, dots: [[a], [b]]}];
    const lines = curve ? ["curve around", "curve exact"].map((look) => ({class: look, line: [x.values, curve]})) : [];
    this.chart.show({
      x: {low: box[0], high: box[1], label: label(x)}, y: {low: box[2], high: box[3], label: label(y)}, layers: [...layers, ...lines, ...mark("mark", this.mark), ...(this.case ? mark("case", this.case) : [])],
      legend: [...legend.map(([ink, words]) => ["swatch", "area", words, ink]), ...(this.case ? [["dot case", "dot", "this case"]] : []),
        ...(curve ? [["curve exact", "line", "critical amplitude (slender block)"]] : [])],
    });
  }

  /** Row and column of the value nearest to a place. @param {number[]} at */
  place([x, y]) {
    const nearest = (/** @type {number[]} */ values, /** @type {number} */ wanted) => values.reduce((best, each, k) => (Math.abs(each - wanted) < Math.abs(values[best] - wanted) ? k : best), 0);
    return [nearest(this.about.y.values, y), nearest(this.about.x.values, x)];
  }

  /** Say what is at a place. @param {number[]} at */
  say(at) {
    if (!this.about || !at.every(Number.isFinite)) return;
    const [row, column] = this.place(at), {x, y} = this.about, index = row * x.values.length + column;
    const coordinate = (/** @type {any} */ axis, /** @type {number} */ k) => `${labelOf(axis)} = ${joined(amongst(axis.values, k), axis.unit)}${axis.names ? ` (${axis.names[k]})` : ""}`;
    const said = Object.entries(this.values).map(([name, all]) => this.word(name, all[index])).filter(Boolean);
    one("map-at").textContent = `${coordinate(x, column)}, ${coordinate(y, row)}: ${said.join("; ") || "not computed yet"}.`;
  }

  /** @param {string} name @param {number} value */
  word(name, value) {
    if (Number.isNaN(value)) return "";
    if (name === "mode" && value > 1) return `overturns after ${short(value)} impacts`;
    const kind = this.kinds(name)?.find(([each]) => each === value)?.[1];
    if (kind) return name === "outcome" ? `first rocking: ${kind}` : kind;
    if (name === "rest") return `rests ${short(value)} s after uplift`;
    if (name === "peak") return value === Infinity ? "" : `peak ${short(value)} α`;
    return `${known(`quantity.${name}`) ? phrase(`quantity.${name}`) : name} ${name === "peak_rotation" ? `${short(value)} rad` : short(value)}`;
  }

  /** Move the mark. @param {number} x @param {number} y */
  put(x, y) {
    const [row, column] = this.place([x, y]);
    this.mark = [this.about.x.values[column], this.about.y.values[row]];
    this.paint();
    this.say(this.mark);
  }

  /** Open the case at the mark. */
  async open() {
    if (!this.about || !this.mark.every(Number.isFinite)) return;
    const {texts, map} = this.page.state, {quantity: _quantity, ...asked} = map, [x, y] = [this.mark[0] / this.about.x.scale, this.mark[1] / this.about.y.scale];
    try {
      const found = await json(this.study ? "/api/study/point" : "/api/map/point", {...(this.study ? {} : texts), ...asked, at_x: String(x), at_y: String(y)});
      this.page.restate(found, "shake");
    } catch (error) { this.page.problem(error, "view-map"); }
  }

  /** Zoom into a rectangle. @param {number[]} box */
  into(box) {
    const {map} = this.page.state;
    if (this.study) { this.before.push(/** @type {any} */ (this.part)); this.part = box; this.paint(); this.fill(this.study.axes.map((/** @type {any} */ each) => each.name), this.study.axes); return; }
    this.before.push(Object.fromEntries(ENDS.map((end) => [end, map[end]])));
    ENDS.forEach((end, k) => {
      const axis = this.about[end[0]], all = axis.values, width = box[k - (k % 2) + 1] - box[k - (k % 2)], kept = Math.min(Math.max(box[k], all[0]), all[all.length - 1]);
      map[end] = String(Number((Number(kept.toFixed(Math.max(0, 3 - Math.floor(Math.log10(width))))) / axis.scale).toPrecision(12)));
    });
    this.update();
  }

  out() {
    if (this.study) { this.part = /** @type {any} */ (this.before.pop() ?? null); this.paint(); this.fill(this.study.axes.map((/** @type {any} */ each) => each.name), this.study.axes); return; }
    const {map} = this.page.state, ends = this.before.pop() ?? {};
    for (const end of ENDS) if (ends[end]) map[end] = ends[end]; else delete map[end];
    this.update();
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (!this.about || event.ctrlKey || event.metaKey || event.altKey) return;
    const way = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0]}[event.key], {x, y} = this.about, [left, right, low, high] = [...this.ends(x.values), ...this.ends(y.values)];
    if (way) {
      const [row, column] = this.place(this.mark.every(Number.isFinite) ? this.mark : [0.5 * (left + right), 0.5 * (low + high)]), step = event.shiftKey ? 10 : 1, clip = (/** @type {number} */ k, /** @type {number} */ size) => Math.min(size - 1, Math.max(0, k));
      this.put(x.values[clip(column + step * way[1], x.values.length)], y.values[clip(row + step * way[0], y.values.length)]);
    } else if (event.key === "Enter") void this.open();
    else if (["+", "="].includes(event.key)) this.into([this.mark[0] - 0.25 * (right - left), this.mark[0] + 0.25 * (right - left), this.mark[1] - 0.25 * (high - low), this.mark[1] + 0.25 * (high - low)]);
    else if (event.key === "-" && !one("map-out").disabled) this.out();
    else return;
    event.preventDefault();
  }

  /** Files of the map, and the code that computes it. */
  files() {
    const {python, command = null, x, y} = this.about, {quantity} = this, name = `rocking-map-${quantity}-${x.name}-${y.name}`;
    const table = () => csv([[x.name, y.name, ...Object.keys(this.values)], ...y.values.flatMap((/** @type {number} */ up, /** @type {number} */ row) => x.values.map((/** @type {number} */ right, /** @type {number} */ column) => [right / x.scale, up / y.scale, ...Object.values(this.values).map((all) => all[row * x.values.length + column])]))],
      Object.keys(this.values).flatMap((each) => { const kinds = this.kinds(each); return kinds ? [`${each}: ${kinds.map(([value, words]) => `${value} ${words}`).join("; ")}`] : []; }).concat([`units of ${x.name} and ${y.name}: ${x.own || "1"}, ${y.own || "1"}; peak is infinite where the block overturns; rest is empty where it never rests`]));
    offer([[`${name}.svg`, "Figure, SVG", () => this.chart.file("svg")], [`${name}.png`, "Figure, PNG", () => this.chart.file("png")], [`${name}.csv`, "Numbers, CSV", async () => table()]], python, command, this.page);
  }
}

/** Indices of the values for the pixels of a picture: one each if they are even, else in proportion. @param {number[]} values @returns {number[]} */
function cells(values) {
  const count = values.length - 1, step = (values[count] - values[0]) / count;
  if (values.every((each, k) => Math.abs(each - values[0] - k * step) < 1e-3 * step)) return values.map((_, k) => k);
  const low = values[0] - 0.5 * (values[1] - values[0]), high = values[count] + 0.5 * (values[count] - values[count - 1]), pixels = 800;
  return Array.from({length: pixels}, (_, k) => {
    const at = low + ((k + 0.5) / pixels) * (high - low);
    return values.reduce((best, each, j) => (Math.abs(each - at) < Math.abs(values[best] - at) ? j : best), 0);
  });
}
