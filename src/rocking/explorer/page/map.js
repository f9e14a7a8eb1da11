// A map of the case over two of its parameters, coarse to fine; or of a study.

import {Latest, frames, json, payload} from "./api.js";
import {showExports, withLegend} from "./exports.js";
import {namesOf, specification} from "./parameters.js";
import {bokeh, colour, figure, themed} from "./theme.js";
import {make, one, short} from "./words.js";

/** From harmless to the worst, each darker than the one before; the last stands out. */
const OUTCOMES = ["#ffffff", "#d7e3f2", "#9db6d4", "#5d7da6", "#1c2c47", "#e0a23c"];
const MODES = /** @type {[number, string, string][]} */ ([
  [-3, "no uplift", "#ffffff"], [-1, "rocks", "#d7e3f2"], [-2, "rests before the motion is over", "#9db6d4"],
  [0, "overturns without impact", "#1c2c47"], [1, "overturns after 1 impact", "#c76b29"], [2, "overturns after 2 impacts or more", "#e9a94f"],
  [-4, "overturns after a rest", "#7a3b69"],
]);
/** What overturns after a rest, as a mode; and the colour of the hatch over what overturns later than in the first rocking. */
const AFTER_REST = -4, LATER = "#b0390c";
/** Dark to light, even steps of lightness. */
const RAMP = ["#0b1a3a", "#14346b", "#1f5190", "#3a74a8", "#5f97b8", "#8bb8c6", "#b9d6d4", "#e6efe4", "#fdf3d6"];

const ENDS = ["x_from", "x_to", "y_from", "y_to"];

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.study = specification.study;
    /** @type {AbortController | null} */
    this.running = null;
    this.latest = new Latest(() => this.run(), (error) => page.problem(error, "view-map"));
    /** @type {any} */
    this.about = null;
    this.mark = [0, 0];
    this.waiting = 0;
    /** @type {Record<string, HTMLElement>} */
    this.slices = {};
    this.form();
    one("map").addEventListener("keydown", (event) => this.key(event));
    one("map-open").addEventListener("click", () => this.open());
    one("map-sine").addEventListener("click", () => this.sine());
  }

  enter() { this.update(); }

  leave() { this.running?.abort(); }

  /** @param {string} name @returns {HTMLSelectElement} */
  select(name) { return one(`map-${name}`); }

  form() {
    for (const name of ["quantity", "x", "y", "points"]) this.select(name).addEventListener("change", () => this.chosen(name));
    for (const name of ["x-from", "x-to", "y-from", "y-to"]) one(`map-${name}`).addEventListener("change", () => this.ends());
    if (!this.study) return;
    const tools = one("study-tools");
    tools.hidden = false;
    /** @param {string} name @param {string} label @param {string[]} values */
    const slice = (name, label, values) => {
      if (values.length < 2) return;
      const select = /** @type {HTMLSelectElement} */ (make("select", {on: {change: () => { this.page.state.map[name] = select.value; this.update(); }}},
        values.map((value, k) => make("option", {value: name.startsWith("fix_") ? value : String(k)}, [value]))));
      select.value = this.page.state.map[name] ?? select.value;
      this.slices[name] = make("label", {}, [`${label} `, select]);
      tools.append(this.slices[name]);
    };
    tools.append(make("strong", {}, [`Study ${this.study.name}`]), make("span", {className: "cursor"}, [this.study.status]));
    slice("motion_index", "motion", this.study.motions);
    slice("polarity_index", "polarity", this.study.polarities);
    slice("scale_index", "scale", this.study.scales.map(String));
    for (const [name, values] of Object.entries(this.study.fixed)) slice(`fix_${name}`, name, /** @type {number[]} */ (values).map(String));
    for (const name of ["x-from", "x-to", "y-from", "y-to", "points"]) /** @type {HTMLElement} */ (one(`map-${name}`).parentElement).hidden = true;
  }

  /** @param {string} name */
  chosen(name) {
    const {map} = this.page.state;
    map[name] = this.select(name).value;
    if (name === "x" || name === "y") { delete map[`${name}_from`]; delete map[`${name}_to`]; }
    if (name === "quantity" && this.about && !this.study) {
      this.fill();
      this.page.remember({map});
      if (JSON.stringify(this.asked()) === this.drawn) { this.recolour(); this.offer(); return; }
    }
    this.update();
  }

  /** What is asked of the server: all but the quantity, since it sends all of them.
   * @returns {Record<string, string>} */
  asked() {
    const ends = Object.fromEntries(ENDS.map((end) => [end, /** @type {HTMLInputElement} */ (one(`map-${end.replace("_", "-")}`)).value]));
    const {x, y, points} = this.page.state.map;
    return {...this.page.state.texts, x, y, ...ends, points: points ?? "200"};
  }

  ends() {
    for (const end of ENDS) this.page.state.map[end] = /** @type {HTMLInputElement} */ (one(`map-${end.replace("_", "-")}`)).value;
    this.update();
  }

  /** The case, or what is mapped, has changed. */
  update() {
    this.running?.abort();
    void this.latest.ask();
  }

  async run() {
    this.running = new AbortController();
    await (this.study ? this.slice() : this.stream(this.running.signal));
  }

  /** Axes that the case has, and those that are chosen. */
  axes() {
    const {texts, map} = this.page.state;
    if (this.study) {
      const varied = this.study.axes.map((/** @type {any} */ each) => each.name);
      if (!varied.includes(map.x)) map.x = varied[0];
      if (!varied.includes(map.y) || map.y === map.x) map.y = varied.find((/** @type {string} */ each) => each !== map.x);
      return {names: varied, right: varied};
    }
    const motion = texts.motion ?? "";
    const family = motion.split(":")[0];
    const pulse = Object.hasOwn(specification.pulses, family);
    const frequency = pulse && motion.includes("frequency=");
    const names = specification.axes.map((/** @type {any} */ each) => each.name).filter((/** @type {string} */ name) => name !== "omega" || frequency);
    const right = names.filter((/** @type {string} */ name) => name !== "a" && name !== "pga");
    if (!names.includes(map.y)) map.y = pulse ? "a" : "pga";
    if (!right.includes(map.x)) map.x = frequency ? "omega" : "p";
    one("map-sine").hidden = family === "sine";
    return {names, right};
  }

  fill() {
    const {map} = this.page.state;
    const {names, right} = this.axes();
    for (const [name, slice] of Object.entries(this.slices)) slice.hidden = [map.x, map.y].some((axis) => name === `fix_${axis}` || name === `${axis}_index`);
    const offered = this.study ? this.study.axes : specification.axes;
    const label = (/** @type {string} */ name) => offered.find((/** @type {any} */ each) => each.name === name).label;
    for (const [name, values] of Object.entries({x: right, y: names})) {
      this.select(name).replaceChildren(...values.map((/** @type {string} */ value) => make("option", {value}, [label(value)])));
      this.select(name).value = map[name];
    }
    const quantities = this.study ? this.study.quantities : specification.quantities;
    this.select("quantity").replaceChildren(...quantities.map((/** @type {any} */ each) => make("option", {value: each.name}, [each.label])));
    if (!quantities.some((/** @type {any} */ each) => each.name === map.quantity)) map.quantity = this.first(quantities);
    this.select("quantity").value = map.quantity;
    this.select("points").value = map.points ?? "200";
    if (this.study) return;
    for (const which of ["x", "y"]) {
      const axis = offered.find((/** @type {any} */ each) => each.name === map[which]);
      const wide = map.quantity === "peak" || map.quantity === "mode";
      for (const [k, end] of ["from", "to"].entries()) {
        const field = /** @type {HTMLInputElement} */ (one(`map-${which}-${end}`));
        if (document.activeElement !== field) field.value = map[`${which}_${end}`] ?? String((wide ? axis.wide : axis.close)[k]);
      }
    }
  }

  /** The quantity with which a map begins: under a pulse how the first rocking ends; a record goes on, and what counts is the end.
   * @param {any[]} quantities @returns {string} */
  first(quantities) {
    const family = (this.page.state.texts.motion ?? "").split(":")[0];
    return this.study || Object.hasOwn(specification.pulses, family) ? quantities[0].name : "mode";
  }

  /** @param {AbortSignal} signal */
  async stream(signal) {
    this.fill();
    const map = {...this.page.state.map};
    if (this.complete && this.drawn === JSON.stringify(this.asked())) {
      this.page.remember({map});
      this.recolour();
      this.offer();
      return;
    }
    const started = performance.now();
    const body = document.body.dataset;
    this.drawn = JSON.stringify(this.asked());
    body.map = "running";
    let done = 0;
    this.complete = false;
    window.clearTimeout(this.waiting); // that of a map that was given up may be long
    this.waiting = 0;
    for await (const frame of frames("/api/map", this.asked(), signal)) {
      if (!this.about || done === 0) {
        this.about = JSON.parse(new TextDecoder().decode(frame));
        const count = this.about.shape[0] * this.about.shape[1];
        this.values = this.about.quantities.map(() => new Float32Array(count).fill(NaN));
        this.covered = new Uint8Array(count).fill(255);
        this.page.remember({map});
        this.drawAxes();
        this.offer();
        done = 1;
        continue;
      }
      done += this.take(frame);
      const [rows, columns] = this.about.shape;
      /** @type {HTMLProgressElement} */ (one("map-progress")).value = done / (rows * columns);
      this.recolourSoon(started);
      if (!body.first || body.firstOf !== String(started)) { body.first = String(performance.now() - started); body.firstOf = String(started); }
    }
    this.complete = true;
    this.recolour();
    this.offer();
    body.map = "complete";
    body.mapTook = String(performance.now() - started);
  }

  /** Put a part where it belongs. A coarse point covers those that are still to come, but none that came before it: two
   * threads compute, and the last part of a level may come after the first of the next. @param {Uint8Array} frame */
  take(frame) {
    const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
    const stride = view.getUint32(0, true), count = view.getUint32(4, true);
    const [rows, columns] = this.about.shape;
    const covered = /** @type {Uint8Array} */ (this.covered), all = /** @type {Float32Array[]} */ (this.values);
    for (let k = 0; k < count; k += 1) {
      const index = view.getUint32(8 + 4 * k, true);
      const row = Math.floor(index / columns), column = index % columns;
      const point = all.map((_, q) => view.getFloat32(8 + 4 * count + 4 * (q * count + k), true));
      for (let r = row; r < Math.min(rows, row + stride); r += 1) for (let c = column; c < Math.min(columns, column + stride); c += 1) {
        const at = r * columns + c;
        if (covered[at] < stride) continue;
        covered[at] = stride;
        point.forEach((value, q) => { all[q][at] = value; });
      }
    }
    return count;
  }

  /** Recolour soon, once: at first at every change, later after a part of the time that the map has taken so far, so that
   * painting takes little from computing, which is done on the same cores. @param {number} started */
  recolourSoon(started) {
    if (this.waiting) return;
    const wait = Math.max(90, 0.1 * (performance.now() - started));
    this.waiting = window.setTimeout(() => { this.waiting = 0; if (!this.complete) this.recolour(); }, wait);
  }

  /** What can be saved: the picture, the numbers, and code that computes them again. */
  offer() {
    const {python, command} = this.about;
    const name = this.study ? "rocking-study" : "rocking-map";
    const {quantity} = this.page.state.map;
    showExports("map", this.study ? python : python[quantity], (this.study ? command : command[quantity]) ?? null, !this.complete ? [] : [
      [`${name}.svg`, "Figure, SVG", () => this.picture("svg")], [`${name}.png`, "Figure, PNG", () => this.picture("png")],
      [`${name}.csv`, "Numbers, CSV", async () => new Blob([this.table()], {type: "text/csv"})],
    ]);
  }

  /** The map as it is drawn, without the mark and with its legend. @param {"svg" | "png"} form @returns {Promise<Blob>} */
  async picture(form) {
    const marks = this.plot.renderers.filter((/** @type {any} */ each) => each.data_source === this.at);
    for (const each of marks) each.visible = false;
    const drawn = bokeh().index.find_one(this.plot).export(form);
    for (const each of marks) each.visible = true;
    const curves = /** @type {[string, string][]} */ (this.about.curves.exact ? [["critical amplitude: exact (solid), Eq. 76 (dashed)", "#b0390c"]] : []);
    return withLegend(await drawn.to_blob(), [...(this.entries ?? []), ...curves], this.plot.outer_width, this.plot.outer_height);
  }

  /** Every point of the map with all that is known of it. */
  table() {
    const {x, y, quantities} = this.about;
    const head = [x, y].map((axis) => (axis.unit ? `${axis.name}_${axis.unit.replace("°", "deg").replace(/\W+/g, "_")}` : axis.name));
    const rows = y.values.flatMap((/** @type {number} */ up, /** @type {number} */ row) => x.values.map((/** @type {number} */ right, /** @type {number} */ column) => [
      right, up, ...(this.values ?? []).map((/** @type {Float32Array} */ all) => Number(all[row * x.values.length + column].toPrecision(7))),
    ].map((each) => (Number.isNaN(each) ? "" : each === Infinity ? "inf" : String(each))).join(",")));
    return [...this.meanings(quantities), [...head, ...quantities].join(","), ...rows, ""].join("\n");
  }

  /** What the codes in a table stand for, as comments at its head. @param {string[]} quantities */
  meanings(quantities) {
    /** @type {Record<string, string>} */
    const measured = {rest: "s from uplift to rest, empty where it never rests", peak: "rotation over slenderness, inf where it overturns"};
    return quantities.flatMap((name) => {
      const kinds = this.kinds(name)?.map(([value, text]) => (name === "mode" && value === 2 ? "n overturns after n impacts" : `${value} ${text}`));
      const words = kinds ? kinds.join("; ") : measured[name];
      return words ? [`# ${name}: ${words}`] : [];
    });
  }

  async slice() {
    this.fill();
    const {header, arrays} = await payload("/api/study", this.page.state.map);
    this.page.remember({map: this.page.state.map});
    this.about = {...header, quantities: [header.quantity], curves: {}, outcomes: []};
    this.values = [Float32Array.from(arrays.values)];
    this.drawAxes();
    this.complete = true;
    this.recolour();
    this.offer();
    /** @type {HTMLProgressElement} */ (one("map-progress")).value = 1;
    document.body.dataset.map = "complete";
  }

  build() {
    const B = bokeh();
    this.plot = figure({height: 500, x_range: new B.Range1d({start: 0, end: 1}), y_range: new B.Range1d({start: 0, end: 1}), min_border_bottom: 46}, "Map of outcomes over two parameters");
    for (const grid of this.plot.center) grid.visible = false;
    this.image = new B.ColumnDataSource({data: {image: [], x: [], y: [], dw: [], dh: []}});
    const F = (/** @type {string} */ field) => ({field});
    this.plot.add_renderers(new B.GlyphRenderer({data_source: this.image, glyph: new B.ImageRGBA({image: F("image"), x: F("x"), y: F("y"), dw: F("dw"), dh: F("dh")}), level: "image"}));
    /** @type {Record<string, any>} */
    this.curves = {};
    for (const [name, dash] of /** @type {[string, number[]][]} */ ([["eq76", [7, 4]], ["exact", []]])) {
      const source = new B.ColumnDataSource({data: {x: [], y: []}});
      // A light line under the dark one: it is seen on every colour of the map.
      for (const [width, ink] of /** @type {[number, string][]} */ ([[4.5, "#ffffff"], [2, "#b0390c"]])) {
        this.plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph: new B.Line({x: F("x"), y: F("y"), line_width: width, line_color: ink, line_alpha: width > 3 ? 0.75 : 1, line_dash: width > 3 ? [] : dash})}));
      }
      this.curves[name] = source;
    }
    this.at = new B.ColumnDataSource({data: {x: [], y: []}});
    for (const [size, ink] of /** @type {[number, string][]} */ ([[17, "#ffffff"], [14, "#10243e"]])) {
      this.plot.add_renderers(new B.GlyphRenderer({data_source: this.at, glyph: new B.Scatter({x: F("x"), y: F("y"), size, line_width: size > 15 ? 4 : 2, line_color: ink, fill_alpha: 0, marker: {value: "circle_cross"}})}));
    }
    this.bar = new B.ColorBar({color_mapper: new B.LinearColorMapper({palette: RAMP, low: 0, high: 1}), width: 12, title_text_font_style: "normal", padding: 6, visible: false});
    this.plot.add_layout(this.bar, "right");
    themed(() => this.bar.setv({background_fill_color: colour("paper"), major_label_text_color: colour("ink"), title_text_color: colour("ink"), major_tick_line_color: colour("ink")}));
    this.plot.on_event("mousemove", (/** @type {any} */ event) => this.point(event.x, event.y));
    this.plot.on_event("tap", (/** @type {any} */ event) => { this.put(event.x, event.y); void this.open(); });
    B.Plotting.show(this.plot, one("map"));
  }

  drawAxes() {
    if (!this.plot) this.build();
    const {x, y} = this.about;
    const label = (/** @type {any} */ axis) => (axis.unit ? `${axis.label} (${axis.unit})` : axis.label);
    this.plot.below[0].axis_label = label(x);
    this.plot.left[0].axis_label = label(y);
    const [x0, x1, y0, y1] = this.box();
    this.plot.x_range.setv({start: x0, end: x1});
    this.plot.y_range.setv({start: y0, end: y1});
    for (const [name, source] of Object.entries(this.curves ?? {})) {
      const values = this.about.curves[name];
      source.data = values ? {x: x.values, y: values.map((/** @type {number | null} */ each) => each ?? NaN)} : {x: [], y: []};
    }
    if (!(this.mark[0] >= x0 && this.mark[0] <= x1 && this.mark[1] >= y0 && this.mark[1] <= y1)) this.put(0.5 * (x0 + x1), 0.5 * (y0 + y1));
    else this.put(this.mark[0], this.mark[1]);
  }

  /** Ends of the map, half a step beyond the outermost points. */
  box() {
    const {x, y} = this.about;
    return [x.values, y.values].flatMap((values) => {
      const half = 0.5 * ((values[values.length - 1] - values[0]) / Math.max(1, values.length - 1));
      return [values[0] - half, values[values.length - 1] + half];
    });
  }

  recolour() {
    if (!this.about || !this.values) return;
    const {map} = this.page.state;
    const which = Math.max(0, this.about.quantities.indexOf(map.quantity));
    const values = this.values[which];
    const [rows, columns] = this.about.shape;
    const colours = this.coloured(map.quantity, values);
    const {ndarray} = bokeh().require("core/util/ndarray");
    const [x0, x1, y0, y1] = this.box();
    this.image.data = {image: [ndarray(colours, {shape: [rows, columns], dtype: "uint32"})], x: [x0], y: [y0], dw: [x1 - x0], dh: [y1 - y0]};
    this.point(this.mark[0], this.mark[1]);
  }

  /** Colour of every point, and the legend or the bar that says what it means. @param {string} quantity @param {Float32Array} values */
  coloured(quantity, values) {
    const out = new Uint32Array(values.length);
    const kinds = this.kinds(quantity);
    if (kinds) {
      const later = quantity === "outcome" ? this.later() : null;
      const known = new Map(kinds.map(([value, , ink]) => [value, rgba(ink)]));
      /** @type {Map<number, number>} */
      const seen = new Map();
      values.forEach((value, k) => {
        if (Number.isNaN(value)) return;
        const kind = quantity === "mode" && value > 2 ? 2 : value;
        seen.set(kind, (seen.get(kind) ?? 0) + 1);
        out[k] = later?.[k] && striped(k, this.about.shape[1]) ? rgba(LATER) : known.get(kind) ?? 0;
      });
      this.bar.visible = false;
      const share = (/** @type {number} */ value) => (this.complete ? `, ${short((100 * (seen.get(value) ?? 0)) / values.length, 2)} %` : "");
      this.legend(kinds.filter(([value]) => seen.has(value)).map(([value, text, ink]) => [text + share(value), ink]), later?.some(Boolean) ? later.filter(Boolean).length / values.length : 0);
      return out;
    }
    const finite = values.filter((each) => Number.isFinite(each));
    const sorted = finite.sort();
    const logarithmic = quantity === "rest";
    const scale = logarithmic ? Math.log10 : (/** @type {number} */ each) => each;
    const low = quantity === "peak" || !logarithmic ? 0 : sorted[Math.floor(0.02 * sorted.length)] ?? 1e-3;
    const high = quantity === "peak" ? 1 : sorted[Math.floor(0.995 * (sorted.length - 1))] ?? 1;
    const inks = RAMP.map(rgba);
    values.forEach((value, k) => {
      if (Number.isNaN(value)) return;
      if (value === Infinity) { out[k] = rgba("#c76b29"); return; }
      const part = (scale(value) - scale(low)) / (scale(high) - scale(low) || 1);
      out[k] = inks[Math.max(0, Math.min(RAMP.length - 1, Math.floor(part * RAMP.length)))];
    });
    const ends = {low, high: high > low ? high : low + 1};
    const kind = logarithmic ? "LogColorMapper" : "LinearColorMapper";
    if (this.bar.color_mapper.type === kind) this.bar.color_mapper.setv(ends);
    else this.bar.color_mapper = new (bokeh()[kind])({palette: RAMP, ...ends});
    const title = {rest: "s", peak: "peak / α"}[quantity] ?? this.select("quantity").selectedOptions[0].text;
    this.bar.setv({title, visible: true});
    const extra = quantity === "peak" ? [["overturns", "#c76b29"]] : quantity === "rest" ? [["never comes to rest", "rgba(0,0,0,0)"]] : [];
    this.legend(/** @type {[string, string][]} */ (extra));
    return out;
  }

  /** @param {string} quantity @returns {[number, string, string][] | null} */
  kinds(quantity) {
    if (quantity === "outcome") return this.about.outcomes.map((/** @type {string} */ text, /** @type {number} */ k) => [k, text, OUTCOMES[k]]);
    if (quantity === "mode") return MODES;
    if (quantity === "overturned") return [[0, "stays", "#d7e3f2"], [1, "overturns", "#c76b29"], [-1, "not known: ended before its verdict", "#8d8d8d"]];
    return null;
  }

  /** Where a block overturns after its first rocking has ended otherwise. @returns {boolean[] | null} */
  later() {
    const [outcome, mode] = ["outcome", "mode"].map((name) => (this.values ?? [])[this.about.quantities.indexOf(name)]);
    if (!outcome || !mode) return null;
    return Array.from(mode, (each, k) => (each >= 0 || each === AFTER_REST) && outcome[k] !== this.about.outcomes.indexOf("overturns"));
  }

  /** @param {[string, string][]} entries @param {number} [later] share of the points that overturn later */
  legend(entries, later = 0) {
    if (later) entries = [...entries, [`hatched: overturns later${this.complete ? `, ${short(100 * later, 2)} %` : ""}`, LATER]];
    this.entries = entries;
    const parts = entries.map(([text, ink]) => {
      const key = make("i", {className: "key swatch"});
      key.style.background = ink;
      return make("span", {}, [key, text]);
    });
    if (this.about.curves.exact) parts.push(make("span", {}, [make("i", {className: "key exact"}), "exact critical amplitude (slender block)"]), make("span", {}, [make("i", {className: "key eq76"}), "Eq. 76"]));
    one("map-legend").replaceChildren(...parts);
  }

  /** Row and column at a place. @param {number} x @param {number} y */
  place(x, y) {
    const nearest = (/** @type {number[]} */ values, /** @type {number} */ wanted) => values.reduce((best, each, k) => (Math.abs(each - wanted) < Math.abs(values[best] - wanted) ? k : best), 0);
    return [nearest(this.about.y.values, y), nearest(this.about.x.values, x)];
  }

  /** Say what is at a place. @param {number} x @param {number} y */
  point(x, y) {
    if (!this.about || !this.values) return;
    const [row, column] = this.place(x, y);
    const written = (/** @type {any} */ axis, /** @type {number} */ k) => `${axis.label} ${short(axis.values[k])}${axis.names ? ` (${axis.names[k]})` : ""}`;
    const at = `${written(this.about.x, column)}, ${written(this.about.y, row)}`;
    const index = row * this.about.shape[1] + column;
    const said = this.about.quantities.map((/** @type {string} */ name, /** @type {number} */ q) => this.said(name, /** @type {Float32Array[]} */ (this.values)[q][index])).filter(Boolean);
    one("map-at").textContent = `${at}: ${said.join("; ")}.`;
  }

  /** @param {string} name @param {number} value */
  said(name, value) {
    if (Number.isNaN(value)) return "";
    const kinds = this.kinds(name);
    if (name === "mode" && value > 1) return `overturns after ${value} impacts`;
    if (kinds) return kinds.find(([each]) => each === value)?.[1] ?? "";
    if (name === "rest") return `rests ${short(value)} s after uplift`;
    if (name === "peak") return value === Infinity ? "" : `peak ${short(value)} α`;
    return `${name} ${short(value)}`;
  }

  /** @param {number} x @param {number} y */
  put(x, y) {
    const [row, column] = this.place(x, y);
    this.mark = [this.about.x.values[column], this.about.y.values[row]];
    this.at.data = {x: [this.mark[0]], y: [this.mark[1]]};
    this.point(this.mark[0], this.mark[1]);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const way = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0]}[event.key];
    if (event.key === "Enter") { event.preventDefault(); void this.open(); }
    if (!way || !this.about) return;
    event.preventDefault();
    const [row, column] = this.place(this.mark[0], this.mark[1]);
    const step = event.shiftKey ? 10 : 1;
    const clip = (/** @type {number} */ k, /** @type {number} */ size) => Math.min(size - 1, Math.max(0, k));
    this.put(this.about.x.values[clip(column + step * way[1], this.about.shape[1])], this.about.y.values[clip(row + step * way[0], this.about.shape[0])]);
  }

  /** Open the case at the mark. */
  async open() {
    if (!this.about) return;
    const at = {at_x: String(this.mark[0]), at_y: String(this.mark[1])};
    const {map} = this.page.state;
    try {
      const found = await (this.study ? json("/api/study/point", {...map, ...at}) : json("/api/map/point", {...this.asked(), ...at}));
      this.page.state.view = "response";
      this.page.restate(found);
      await this.page.go("response");
    } catch (error) {
      this.page.problem(error, "view-map");
    }
  }

  /** The same block under a sine just below the critical amplitude. */
  sine() {
    const {shown} = this.page;
    const [threshold] = shown?.header.block.thresholds_g ?? [0.2];
    const p = shown?.header.block.sides[0].p ?? 3.6;
    const {texts} = this.page.state;
    const block = Object.fromEntries([...namesOf("block"), "model"].filter((name) => texts[name]).map((name) => [name, texts[name]]));
    const motion = `sine:amplitude=${(1.03 * threshold).toPrecision(6)}g,frequency=${(p / Math.PI).toPrecision(6)},cycles=2.5`;
    this.page.state.map = {};
    this.page.restate({...block, motion});
  }
}

/** Whether a point lies on a stripe of a hatch. @param {number} k @param {number} columns */
const striped = (k, columns) => (Math.floor(k / columns) + (k % columns)) % 4 === 0;

/** Colour as the image takes it: red in the lowest byte. @param {string} ink */
function rgba(ink) {
  const number = parseInt(ink.slice(1), 16);
  return ((0xff << 24) | ((number & 0xff) << 16) | (number & 0xff00) | (number >> 16)) >>> 0;
}
