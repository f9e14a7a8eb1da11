// A map of the case over two of its parameters, coarse to fine; or of a study.

import {Latest, frames, json, payload} from "./api.js";
import {choose, isTyped} from "./controls.js";
import {showExports} from "./exports.js";
import {goOnAt} from "./focus.js";
import {MapPicture, labelled, quantityLabel} from "./map-picture.js";
import {MapReading} from "./map-reading.js";
import {MapZoom} from "./map-zoom.js";
import {namesOf, pulseOf, specification} from "./parameters.js";
import {make, one} from "./words.js";
import {joined, short, typed} from "./numbers.js";
import {inWords, phrase} from "./texts.js";
import {axisUnit} from "./units.js";

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
    this.waiting = 0;
    this.complete = false;
    /** Ends of the axes where none are chosen. @type {Record<string, string>} */
    this.usual = {};
    this.picture = new MapPicture({
      over: (x, y) => this.reading.over(x, y), chosen: (x, y) => { this.reading.put(x, y); void this.open(); }, zoomed: (box) => this.zoom.into(box),
    });
    this.reading = new MapReading(this);
    this.zoom = new MapZoom(this);
    /** @type {Record<string, HTMLSelectElement>} */
    this.slices = {};
    this.form();
    one("map-open").addEventListener("click", () => this.open());
    one("map-sine").addEventListener("click", () => this.sine());
  }

  enter() {
    if (this.known !== this.page.state.map) this.zoom.forget(); // they were those of another map
    this.known = this.page.state.map;
    this.update();
  }

  leave() {
    this.running?.abort();
    this.reading.leave();
  }

  /** @param {string} name @returns {HTMLSelectElement} */
  select(name) { return one(`map-${name}`); }

  form() {
    for (const name of ["quantity", "x", "y", "points"]) this.select(name).addEventListener("change", () => this.chosen(name));
    for (const name of ["x-from", "x-to", "y-from", "y-to"]) one(`map-${name}`).addEventListener("change", () => this.end(name.replace("-", "_")));
    if (!this.study) return;
    const tools = one("study-tools");
    tools.hidden = false;
    /** @param {string} name @param {string} label @param {string[]} values */
    const slice = (name, label, values) => {
      if (values.length < 2) return;
      const [scale, unit] = axisUnit(this.axis(name.replace(/^fix_|_index$/g, ""))?.unit);
      const select = /** @type {HTMLSelectElement} */ (make("select", {on: {change: () => { this.page.state.map[name] = select.value; this.update(); }}},
        values.map((value, k) => make("option", {value: name.startsWith("fix_") ? value : String(k)}, [value.trim() && Number.isFinite(Number(value)) ? joined(short(scale * Number(value), scale === 1 ? 12 : 6), unit) : value]))));
      this.slices[name] = select;
      tools.append(make("label", {}, [`${label} `, select]));
    };
    tools.append(make("strong", {}, [phrase("map.study", {name: this.study.name})]), make("span", {className: "cursor"}, [this.study.status]));
    slice("motion_index", phrase("map.motion"), this.study.motions);
    slice("polarity_index", phrase("map.polarity"), this.study.polarities);
    slice("scale_index", phrase("map.scale"), this.study.scales.map(String));
    for (const [name, values] of Object.entries(this.study.fixed)) slice(`fix_${name}`, name, /** @type {number[]} */ (values).map(String));
    for (const name of ["x-from", "x-to", "y-from", "y-to", "points"]) /** @type {HTMLElement} */ (one(`map-${name}`).parentElement).hidden = true;
  }

  /** @param {string} name */
  chosen(name) {
    const {map} = this.page.state;
    if (name === "x" || name === "y") this.turn(name, this.select(name).value); else map[name] = this.select(name).value;
    if (name === "quantity" && this.about && !this.study) {
      this.fill();
      if (JSON.stringify(this.asked()) === this.drawn) {
        this.page.remember({map});
        this.recolour();
        this.offer();
        return;
      }
    }
    this.update();
  }

  /** What is asked of the server: all but the quantity, since it sends all of them.
   * @returns {Record<string, string>} */
  asked() {
    const {map} = this.page.state, {x, y, points} = map;
    const ends = Object.fromEntries(ENDS.map((end) => [end, map[end] || this.usual[end]]));
    return {...this.page.state.texts, x, y, ...ends, points: points ?? "200"};
  }

  /** An end of an axis was typed. @param {string} end */
  end(end) {
    this.page.state.map[end] = this.asSent(end, typed(/** @type {HTMLInputElement} */ (one(`map-${end.replace("_", "-")}`)).value));
    this.update();
  }

  /** What the server says of an axis. @param {string} name */
  axis(name) { return (this.study ? this.study.axes : specification.axes).find((/** @type {any} */ each) => each.name === name); }

  /** What one of the axis's own unit is in that of the page. @param {string} end of an axis */
  scale(end) { return axisUnit(this.axis(this.page.state.map[end[0]])?.unit)[0]; }

  /** An end as the address has it, in the axis's own unit, of one in that of the page. @param {string} end @param {string} text */
  asSent(end, text) { return scaled(text, 1 / this.scale(end), 12); }

  /** Map over another axis, whose ends are its own. @param {string} which @param {string} name */
  turn(which, name) {
    const {map} = this.page.state;
    if (map[which]) for (const end of ["from", "to"]) delete map[`${which}_${end}`];
    map[which] = name;
    this.zoom.forget();
  }

  /** The case, or what is mapped, has changed. */
  update() {
    this.running?.abort();
    this.reading.leave();
    void this.latest.ask();
  }

  async run() {
    this.running = new AbortController();
    const {signal} = this.running;
    await (this.study ? this.slice(signal) : this.stream(signal));
  }

  /** Axes that the case has, and those that are chosen. */
  axes() {
    const {texts, map} = this.page.state;
    if (this.study) {
      const varied = this.study.axes.map((/** @type {any} */ each) => each.name);
      if (!varied.includes(map.x)) this.turn("x", varied[0]);
      if (!varied.includes(map.y) || map.y === map.x) this.turn("y", varied.find((/** @type {string} */ each) => each !== map.x));
      return {names: varied, right: varied};
    }
    const {family, parts} = pulseOf(texts.motion ?? "");
    const pulse = Object.hasOwn(specification.pulses, family);
    const frequency = pulse && "frequency" in parts;
    const names = specification.axes.map((/** @type {any} */ each) => each.name).filter((/** @type {string} */ name) => name !== "omega" || frequency);
    const right = names.filter((/** @type {string} */ name) => name !== "a" && name !== "pga");
    if (!names.includes(map.y)) this.turn("y", pulse ? "a" : "pga");
    if (!right.includes(map.x)) this.turn("x", frequency ? "omega" : "p");
    one("map-sine").hidden = family === "sine";
    return {names, right};
  }

  fill() {
    const {map} = this.page.state;
    const {names, right} = this.axes();
    for (const [name, select] of Object.entries(this.slices)) {
      select.value = map[name] ?? select.options[0].value;
      /** @type {HTMLElement} */ (select.parentElement).hidden = [map.x, map.y].some((axis) => name === `fix_${axis}` || name === `${axis}_index`);
    }
    const label = (/** @type {string} */ name) => labelled(this.axis(name));
    for (const [name, values] of Object.entries({x: right, y: names})) {
      this.select(name).replaceChildren(...values.map((/** @type {string} */ value) => make("option", {value}, [label(value)])));
      this.select(name).value = map[name];
    }
    const quantities = this.study ? this.study.quantities : specification.quantities;
    this.select("quantity").replaceChildren(...quantities.map((/** @type {any} */ each) => make("option", {value: each}, [quantityLabel(each)])));
    if (!quantities.includes(map.quantity)) map.quantity = this.first(quantities);
    this.select("quantity").value = map.quantity;
    choose(this.select("points"), map.points ?? "200");
    if (this.study) return;
    for (const which of ["x", "y"]) {
      const axis = this.axis(map[which]);
      const wide = map.quantity === "peak" || map.quantity === "mode";
      for (const [k, end] of ["from", "to"].entries()) {
        const field = /** @type {HTMLInputElement} */ (one(`map-${which}-${end}`)), name = `${which}_${end}`;
        this.usual[name] = String((wide ? axis.wide : axis.close)[k]);
        if (!isTyped(field)) field.value = scaled(map[name] || this.usual[name], this.scale(name), 6);
      }
    }
  }

  /** The quantity with which a map begins: under a pulse how the first rocking ends; a record goes on, and what counts is the end.
   * @param {string[]} quantities @returns {string} */
  first(quantities) {
    const {family} = pulseOf(this.page.state.texts.motion ?? "");
    return this.study || Object.hasOwn(specification.pulses, family) ? quantities[0] : "mode";
  }

  /** @param {AbortSignal} signal */
  async stream(signal) {
    this.fill();
    const {map} = this.page.state, asked = this.asked();
    if (this.complete && this.drawn === JSON.stringify(asked)) {
      this.page.remember({map});
      this.recolour();
      this.offer();
      return;
    }
    const started = performance.now();
    const body = document.body.dataset;
    this.drawn = JSON.stringify(asked);
    body.map = "running";
    let done = 0;
    this.complete = false;
    window.clearTimeout(this.waiting); // that of a map that was given up may be long
    this.waiting = 0;
    try {
      for await (const frame of frames("/api/map", asked, signal)) {
        if (!this.about || done === 0) {
          this.about = {...inUnits(JSON.parse(new TextDecoder().decode(frame))), asked};
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
    } catch (error) {
      this.drawn = "";
      throw error;
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
    const wait = Math.max(90, 0.2 * (performance.now() - started));
    this.waiting = window.setTimeout(() => { this.waiting = 0; if (!this.complete) this.recolour(); }, wait);
  }

  /** What can be saved: the picture, the numbers, and code that computes them again. */
  offer() {
    const {python, command = null} = this.about;
    const name = this.study ? "rocking-study" : "rocking-map";
    const {quantity} = this.page.state.map;
    showExports("map", this.study ? python : python[quantity], command, !this.complete ? [] : [
      [`${name}.svg`, phrase("save.svg"), () => this.picture.file("svg")], [`${name}.png`, phrase("save.png"), () => this.picture.file("png")],
      [`${name}.csv`, phrase("save.numbers"), async () => new Blob([this.table()], {type: "text/csv"})],
    ], (error) => this.page.problem(error, "exports"));
  }

  /** Every point of the map with all that is known of it, in the units of the server. */
  table() {
    const {quantities, x: {own: x}, y: {own: y}} = this.about;
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
      const kinds = this.picture.kinds(name)?.map(([value, text]) => (name === "mode" && value === 2 ? "n overturns after n impacts" : `${value} ${text}`));
      const words = kinds ? kinds.join("; ") : measured[name];
      return words ? [`# ${name}: ${words}`] : [];
    });
  }

  drawAxes() {
    this.reading.leave(); // what is pointed at is a point of the map before
    this.picture.axes(this.about);
    const notes = (this.about.notes ?? []).map(inWords).join(" ");
    Object.assign(one("map-notes"), {textContent: notes, hidden: !notes});
    this.reading.keep();
    if (this.study) this.zoom.forget();
    this.zoom.offer();
  }

  recolour() {
    const {quantity} = this.page.state.map;
    if (!this.about || !this.values) return;
    this.picture.paint(this.values, quantity, {complete: this.complete, label: this.select("quantity").selectedOptions[0].text});
    this.reading.say();
  }

  /** @param {AbortSignal} signal */
  async slice(signal) {
    this.fill();
    const asked = {...this.page.state.map};
    const {header, arrays} = await payload("/api/study", asked, {signal});
    signal.throwIfAborted();
    this.page.remember({map: this.page.state.map});
    this.about = {...inUnits({...header, quantities: [header.quantity], curves: {}}), asked};
    this.values = [Float32Array.from(arrays.values)];
    this.drawAxes();
    this.complete = true;
    this.recolour();
    this.offer();
    /** @type {HTMLProgressElement} */ (one("map-progress")).value = 1;
    document.body.dataset.map = "complete";
  }

  /** What is asked of the server about a point of the map that is drawn. @param {string} what @param {number[]} at to the right and upwards @returns {[string, Record<string, string>]} */
  request(what, [x, y]) {
    const own = (/** @type {any} */ axis, /** @type {number} */ value) => String(axis.own.values[axis.values.indexOf(value)]);
    const at = {at_x: own(this.about.x, x), at_y: own(this.about.y, y)};
    return [this.study ? `/api/study/${what}` : `/api/map/${what}`, {...this.about.asked, ...at}];
  }

  /** Open the case at the mark. */
  async open() {
    if (!this.about) return;
    const {texts, view} = this.page.state;
    try {
      const found = await json(...this.request("point", this.reading.mark));
      if (this.page.state.texts !== texts || this.page.state.view !== view) return; // something else was chosen meanwhile
      this.page.state.view = "response";
      this.page.restate(found);
      await this.page.go("response");
      goOnAt(one("histories"));
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
    const block = Object.fromEntries([...namesOf("block"), "model", "gravity"].filter((name) => texts[name]).map((name) => [name, texts[name]]));
    const motion = `sine:amplitude=${(1.03 * threshold).toPrecision(6)}g,frequency=${(p / Math.PI).toPrecision(6)},cycles=2.5`;
    this.page.state.map = {};
    this.zoom.forget();
    this.page.restate({...block, motion});
  }
}

/** A number times a factor, to so many digits; what is none, or stays as it is, is the same text. @param {string} text @param {number} factor @param {number} digits */
const scaled = (text, factor, digits) => (factor === 1 || !text || Number.isNaN(Number(text)) ? text : String(Number((factor * Number(text)).toPrecision(digits))));

/** What a map is said to be, with its axes in the units of the page; `own` is what the server says of each. @param {any} about */
function inUnits(about) {
  const [x, y] = [about.x, about.y].map((own) => {
    const [scale, unit] = axisUnit(own.unit);
    return {...own, unit, values: own.values.map((/** @type {number} */ each) => scale * each), own};
  });
  return {...about, x, y};
}
