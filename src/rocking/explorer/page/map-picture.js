// A map as it is drawn: its plot, its colours, and the legend that says what they mean.

import {withLegend} from "./exports.js";
import {AFTER_REST, AROUND, MARK, MODES, OUTCOMES, OVERTURNS, RAMP, STRIPES, UNKNOWN, VERDICTS, cellEdges, picture, rgba} from "./outcomes.js";
import {plain} from "./ticks.js";
import {bokeh, coarse, colour, figure, showPlot, themed} from "./theme.js";
import {make, one} from "./words.js";
import {joined, short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";
import {angleAxis, axisUnit} from "./units.js";

/** What an axis is called, with its unit on the page. @param {any} axis */
export const labelled = ({label, unit}) => (unit ? phrase("map.axis_unit", {label: inWords(label), unit: axisUnit(unit)[1]}) : inWords(label));

/** What one of a study's quantities is on a bar, and its unit. @type {Record<string, () => [number, string]>} */
const MEASURED = {peak_rotation: angleAxis, time_at_rest: () => [1, "s"]};
/** @param {string} name of a quantity @returns {[number, string]} */
const measure = (name) => MEASURED[name]?.() ?? [1, ""];
/** What a quantity is called, with its unit. @param {string} name */
export const quantityLabel = (name) => (name in MEASURED ? phrase("map.axis_unit", {label: phrase(`quantity.${name}`), unit: measure(name)[1]}) : phrase(`quantity.${name}`));
/** A value of a quantity. @param {string} name @param {number} value */
export const quantityValue = (name, value) => { const [scale, unit] = measure(name); return phrase("map.value", {name: phrase(`quantity.${name}`), value: joined(short(scale * value), unit)}); };

/** Curves over a map, and how each is dashed. */
const CURVES = /** @type {[string, number[]][]} */ ([["exact", []], ["eq76", [7, 4]]]);

/** A curve as it is drawn, also on dark paper: dark on light. @param {number[]} dash */
function curveKey([on = 1, off = 0]) {
  const key = make("i", {className: "key on-map"});
  key.style.background = `repeating-linear-gradient(90deg, ${MARK} 0 ${on}px, ${AROUND} ${on}px ${on + off}px) center / 100% 2px no-repeat ${AROUND}`;
  return key;
}

export class MapPicture {
  /** @param {{over: (x: number, y: number) => void, chosen: (x: number, y: number) => void, zoomed: (box: number[]) => void}} tell is told where the
   * pointer is, where it clicked, and what rectangle it drew: ends to the right, ends upwards */
  constructor(tell) {
    this.tell = tell;
    /** @type {any} */
    this.about = null;
    /** @type {Float32Array[] | null} */
    this.values = null;
    this.complete = false;
    this.setting = false;
    this.waiting = 0;
  }

  build() {
    const B = bokeh();
    this.plot = figure({height: 500, x_range: new B.Range1d({start: 0, end: 1}), y_range: new B.Range1d({start: 0, end: 1}), min_border_bottom: 46}, phrase("map.plot"));
    for (const grid of this.plot.center) grid.visible = false;
    this.image = new B.ColumnDataSource({data: {image: [], x: [], y: [], dw: [], dh: []}});
    const F = (/** @type {string} */ field) => ({field});
    this.plot.add_renderers(new B.GlyphRenderer({data_source: this.image, glyph: new B.ImageRGBA({image: F("image"), x: F("x"), y: F("y"), dw: F("dw"), dh: F("dh")}), level: "image"}));
    /** @type {Record<string, any>} */
    this.curves = {};
    for (const [name, dash] of [...CURVES].reverse()) {
      const source = new B.ColumnDataSource({data: {x: [], y: []}});
      // A light line under the dark one: it is seen on every colour of the map.
      for (const [width, ink] of /** @type {[number, string][]} */ ([[4.5, AROUND], [2, MARK]])) {
        this.plot.add_renderers(new B.GlyphRenderer({data_source: source, glyph: new B.Line({x: F("x"), y: F("y"), line_width: width, line_color: ink, line_dash: width > 3 ? [] : dash})}));
      }
      this.curves[name] = source;
    }
    this.mark = new B.ColumnDataSource({data: {x: [], y: []}});
    for (const [size, ink] of /** @type {[number, string][]} */ ([[17, AROUND], [14, MARK]])) {
      this.plot.add_renderers(new B.GlyphRenderer({data_source: this.mark, glyph: new B.Scatter({x: F("x"), y: F("y"), size, line_width: size > 15 ? 4 : 2, line_color: ink, fill_alpha: 0, marker: {value: "circle_cross"}})}));
    }
    this.bar = new B.ColorBar({color_mapper: new B.LinearColorMapper({palette: RAMP, low: 0, high: 1}), width: 12, padding: 6, visible: false, formatter: plain(new B.BasicTickFormatter())});
    this.plot.add_layout(this.bar, "right");
    // The bar's own title would stand beside it, on its head.
    this.plot.title.setv({align: "right", offset: -44, text_font_size: "12px", text_font_style: "normal", text_font: "system-ui, sans-serif"});
    themed(() => this.bar.setv({background_fill_color: colour("paper"), major_label_text_color: colour("ink"), major_tick_line_color: colour("ink")}));
    themed(() => { this.plot.title.text_color = colour("ink"); });
    this.plot.on_event("mousemove", (/** @type {any} */ event) => this.tell.over(event.x, event.y));
    this.plot.on_event("tap", (/** @type {any} */ event) => this.tell.chosen(event.x, event.y));
    if (!coarse()) {
      const zoom = new B.BoxZoomTool();
      zoom.overlay.setv({fill_color: colour("accent"), fill_alpha: 0.2, line_color: MARK, line_dash: []});
      this.plot.add_tools(zoom);
      this.plot.toolbar.active_drag = zoom;
      for (const range of [this.plot.x_range, this.plot.y_range]) for (const end of ["start", "end"]) range.properties[end].change.connect(() => this.ranged());
    }
    void showPlot(this.plot, one("map"));
  }

  /** Draw the axes of a map. @param {any} about what the server says of it */
  axes(about) {
    this.about = about;
    if (!this.plot) this.build();
    const {x, y} = about;
    this.plot.below[0].axis_label = labelled(x);
    this.plot.left[0].axis_label = labelled(y);
    const [x0, x1, y0, y1] = this.box();
    this.show([x0, x1, y0, y1]);
    for (const [name, source] of Object.entries(this.curves ?? {})) {
      const values = this.about.curves[name];
      source.data = values ? {x: x.values, y: values.map((/** @type {number | null} */ each) => each ?? NaN)} : {x: [], y: []};
    }
  }

  /** Show a rectangle: ends to the right, ends upwards. @param {number[]} box */
  show([x0, x1, y0, y1]) {
    this.setting = true;
    this.plot.x_range.setv({start: x0, end: x1});
    this.plot.y_range.setv({start: y0, end: y1});
    this.setting = false;
  }

  /** The pointer drew a rectangle. */
  ranged() {
    if (this.setting) return;
    window.clearTimeout(this.waiting);
    this.waiting = window.setTimeout(() => {
      const {x_range: x, y_range: y} = this.plot;
      this.tell.zoomed([x.start, x.end, y.start, y.end]);
    }, 30);
  }

  /** Pixels of a place from the upper left corner of the picture. @param {number} x @param {number} y */
  pixels(x, y) {
    const {frame} = bokeh().index.find_one(this.plot);
    return [frame.x_scale.compute(x), frame.y_scale.compute(y)];
  }

  /** Ends of the map, those of its outermost cells. */
  box() {
    const {x, y} = this.edges();
    return [x[0], x[x.length - 1], y[0], y[y.length - 1]];
  }

  /** Ends of the cells of both axes. */
  edges() { return {x: cellEdges(this.about.x.values), y: cellEdges(this.about.y.values)}; }

  /** Colour all points. @param {Float32Array[]} all values of each quantity @param {string} quantity the one that is shown
   * @param {{complete: boolean, label: string}} given whether they are all computed, and what the quantity is called */
  paint(all, quantity, {complete, label}) {
    if (!this.about) return;
    this.values = all;
    this.complete = complete;
    const values = all[Math.max(0, this.about.quantities.indexOf(quantity))];
    const [rows, columns] = this.about.shape;
    const {inks, kinds, hatched} = this.coloured(quantity, values, label);
    // One pixel a point until all are computed: lines take time that computing has a use for.
    const {clientWidth: width, clientHeight: height} = one("map");
    const {colours, shape} = picture(inks, this.edges(), complete ? [width - 80, height - 80] : [columns, rows], kinds, hatched);
    const {ndarray} = bokeh().require("core/util/ndarray");
    const [x0, x1, y0, y1] = this.box();
    Object.assign(this.image.data, {image: [ndarray(colours, {shape, dtype: "uint32"})], x: [x0], y: [y0], dw: [x1 - x0], dh: [y1 - y0]});
    this.image.change.emit(); // new data would be compared with the old, pixel by pixel
  }

  /** Colour of every point, those that stand for an outcome, and what is hatched; and the legend or the bar that says what they mean.
   * @param {string} quantity @param {Float32Array} values @param {string} label @returns {{inks: Uint32Array, kinds: Set<number>, hatched: boolean[] | null}} */
  coloured(quantity, values, label) {
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
        out[k] = known.get(kind) ?? 0;
      });
      this.bar.visible = false;
      this.plot.title.text = "";
      const share = (/** @type {string} */ outcome, /** @type {number} */ value) => this.shared(outcome, (seen.get(value) ?? 0) / values.length);
      this.legend(kinds.filter(([value]) => seen.has(value)).map(([value, text, ink]) => [share(text, value), ink]), later?.some(Boolean) ? later.filter(Boolean).length / values.length : 0);
      return {inks: out, kinds: new Set(known.values()), hatched: later};
    }
    const finite = values.filter((each) => Number.isFinite(each));
    const sorted = finite.sort();
    const logarithmic = quantity === "rest";
    const scale = logarithmic ? Math.log10 : (/** @type {number} */ each) => each;
    const low = quantity === "peak" || !logarithmic ? 0 : sorted[Math.floor(0.02 * sorted.length)] ?? 1e-3;
    const high = quantity === "peak" ? 1 : sorted[Math.floor(0.995 * (sorted.length - 1))] ?? 1;
    const inks = RAMP.map(rgba);
    const at = quantity === "rest" ? this.about.quantities.indexOf("mode") : -1;
    const mode = at >= 0 ? /** @type {Float32Array[]} */ (this.values)[at] : null;
    values.forEach((value, k) => {
      if (Number.isNaN(value)) {
        if (mode && !Number.isNaN(mode[k])) out[k] = rgba(mode[k] >= 0 || mode[k] === AFTER_REST ? OVERTURNS : UNKNOWN);
        return;
      }
      if (value === Infinity) { out[k] = rgba(OVERTURNS); return; }
      const part = (scale(value) - scale(low)) / (scale(high) - scale(low) || 1);
      out[k] = inks[Math.max(0, Math.min(RAMP.length - 1, Math.floor(part * RAMP.length)))];
    });
    const ends = {low: measure(quantity)[0] * low, high: measure(quantity)[0] * (high > low ? high : low + 1)};
    const kind = logarithmic ? "LogColorMapper" : "LinearColorMapper";
    if (this.bar.color_mapper.type === kind) this.bar.color_mapper.setv(ends);
    else this.bar.color_mapper = new (bokeh()[kind])({palette: RAMP, ...ends});
    const title = {rest: phrase("map.bar_rest"), peak: phrase("map.bar_peak")}[quantity] ?? label;
    this.bar.visible = true;
    this.plot.title.text = title;
    const extra = quantity === "peak" ? [[phrase("outcome.overturns"), OVERTURNS]] : mode ? [[phrase("map.no_rest"), OVERTURNS], [phrase("map.never"), UNKNOWN]] : [];
    this.legend(/** @type {[string, string][]} */ (extra));
    return {inks: out, kinds: new Set([rgba(OVERTURNS), rgba(UNKNOWN)]), hatched: null};
  }

  /** @param {string} quantity @returns {[number, string, string][] | null} */
  kinds(quantity) {
    if (quantity === "outcome") return (this.about.outcomes ?? []).map((/** @type {string} */ name, /** @type {number} */ k) => [k, phrase(`outcome.${name}`), OUTCOMES[k]]);
    if (quantity === "mode") return MODES;
    if (quantity === "overturned") return VERDICTS;
    return null;
  }

  /** Where a block overturns after its first rocking has ended otherwise. @returns {boolean[] | null} */
  later() {
    const [outcome, mode] = ["outcome", "mode"].map((name) => (this.values ?? [])[this.about.quantities.indexOf(name)]);
    if (!outcome || !mode) return null;
    return Array.from(mode, (each, k) => (each >= 0 || each === AFTER_REST) && outcome[k] !== this.about.outcomes.indexOf("overturns"));
  }

  /** An outcome, with its share once all points are computed. @param {string} outcome @param {number} share */
  shared(outcome, share) { return this.complete ? phrase("map.share_of", {outcome, share: short(100 * share, 2)}) : outcome; }

  /** @param {[string, string][]} entries @param {number} [later] share of the points that overturn later */
  legend(entries, later = 0) {
    if (later) entries = [...entries, [this.shared(phrase("map.hatched"), later), STRIPES[0]]];
    this.entries = entries;
    const parts = entries.map(([text, ink]) => {
      const key = make("i", {className: "key swatch"});
      key.style.background = ink;
      return make("span", {}, [key, text]);
    });
    if (this.about.curves.exact) for (const [name, dash] of CURVES) parts.push(make("span", {}, [curveKey(dash), phrase(name === "exact" ? "map.exact" : "map.eq76")]));
    one("map-legend").replaceChildren(...parts);
  }

  /** The map as it is drawn, without the mark and with its legend. @param {"svg" | "png"} form @returns {Promise<Blob>} */
  async file(form) {
    const marks = this.plot.renderers.filter((/** @type {any} */ each) => each.data_source === this.mark);
    for (const each of marks) each.visible = false;
    const drawn = bokeh().index.find_one(this.plot).export(form);
    for (const each of marks) each.visible = true;
    const curves = /** @type {[string, string][]} */ (this.about.curves.exact ? [[phrase("map.curves"), MARK]] : []);
    return withLegend(await drawn.to_blob(), [...(this.entries ?? []), ...curves], this.plot.outer_width, this.plot.outer_height);
  }
}
