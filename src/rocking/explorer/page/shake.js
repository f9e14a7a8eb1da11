// The response of a case: the block in motion, histories, phase plane and energy, chattering; and another case to compare with.

import {Latest, file, json, payload} from "./api.js";
import {Chart, around, gaps} from "./chart.js";
import {Scene, drawPlan} from "./scene.js";
import {make, one, put} from "./standalone/dom.js";
import {ends, writeAddress} from "./state.js";
import {NONE, decimals, fixed, short, span, typed} from "./numbers.js";
import {counted} from "./texts.js";
import {angle, axisUnit, caseName, length, ofG, treatmentName} from "./units.js";
import {isTyped} from "./forms.js";
import {offer, slug, table} from "./save.js";

/** @typedef {import("./api.js").Payload} Payload */

const NARROWEST = 1e-10, REACH = 1.6, PAUSE = 150;
const UNITS = /** @type {[number, string][]} */ ([[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]]);
const FILES = [["csv", "Histories, CSV"], ["events.csv", "Events, CSV"], ["impacts.csv", "Impacts, CSV"], ["nc", "All, NetCDF"]];

/** How times of a narrow window are written: after an origin, in a suitable unit. @param {number} from @param {number} to */
function scaleOf(from, to) {
  const width = to - from;
  if (width >= 0.5) return {origin: 0, unit: 1, label: "time (s)"};
  const [unit, name] = UNITS.find(([each]) => width >= 2 * each) ?? UNITS[UNITS.length - 1], step = 10 ** Math.floor(Math.log10(width));
  const origin = Number((Math.floor(from / step) * step).toFixed(14));
  return {origin, unit, label: `time after ${fixed(origin, Math.max(0, Math.round(-Math.log10(step))))} s (${name})`};
}

/** Value of a line at a place. @param {Float64Array} x @param {Float64Array} y @param {number} at */
function valueAt(x, y, at) {
  let low = 0, high = x.length - 1;
  if (high < 0) return 0;
  if (at <= x[0]) return y[0];
  if (at >= x[high]) return y[high];
  while (high - low > 1) { const middle = (low + high) >> 1; if (x[middle] <= at) low = middle; else high = middle; }
  return y[low] + (x[high] > x[low] ? (at - x[low]) / (x[high] - x[low]) : 0) * (y[high] - y[low]);
}

export class Shake {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.scene = new Scene();
    /** @type {Payload | null} */
    this.shown = null;
    /** @type {Payload | null} */
    this.other = null;
    /** @type {Payload | null} */
    this.details = null;
    this.scale = scaleOf(0, 1);
    this.chosen = 0;
    this.playing = 0;
    this.load = new Latest(() => this.compute(), (error) => page.problem(error, "settings"));
    this.settled = new Latest(() => this.settle(), (error) => page.problem(error, "exports"));
    this.read = new Latest((time, chosen) => this.reading(time, chosen), (error) => page.problem(error, "scene-view"));
    const hover = (/** @type {number | null} */ x) => this.hover(x === null ? null : this.time(x)), pick = (/** @type {number} */ x) => this.seek(this.time(x));
    const zoom = (/** @type {number[]} */ x) => this.go(/** @type {[number, number]} */ (x.map((each) => this.time(each))));
    const chart = (/** @type {string} */ id, /** @type {string} */ label, height = 240, more = {}) => new Chart(one(id), {label, height, ...more});
    this.histories = [chart("rotation", "Rotation divided by slenderness against time", 270, {hover, pick, zoom}), chart("ground", "Ground acceleration against time", 190, {hover, pick, zoom}), chart("slip", "Slip against time", 130, {hover, pick, zoom})];
    this.plane = chart("plane", "Phase plane: angular velocity against rotation", 310);
    this.energy = chart("energy", "Energy against time", 310, {hover, pick});
    this.intervals = chart("intervals", "Interval to the next impact, by the number of the impact");
    this.ratios = chart("ratios", "Ratio of intervals, by the number of the impact");
    for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => this.zoom(/** @type {any} */ (button).dataset.zoom));
    one("histories").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.key(event));
    one("play").addEventListener("click", () => this.play());
    one("scrub").addEventListener("input", () => { const {from, to} = this.window(); this.seek(from + (Number(one("scrub").value) / 1000) * (to - from)); });
    one("at").addEventListener("change", () => this.read.ask(typed(one("at").value), true));
    one("larger").addEventListener("change", () => this.follow(this.moment()));
    one("closer").addEventListener("click", () => this.closer());
    one("keep").addEventListener("click", () => { page.state.other = page.state.other ? null : {...this.texts}; page.changed({}, []); });
    for (const id of ["phase", "chattering"]) one(id).addEventListener("toggle", () => this.drawDetails());
  }

  /** Compute the case of the state, and the one to compare with. */
  async compute() {
    window.clearTimeout(this.pause);
    const {state} = this.page, {texts} = state, asked = ends(state);
    const found = await payload("/api/case", {...texts, ...asked});
    const {from, to} = found.header.window;
    this.other = state.other && state.view === "shake" ? await payload("/api/case", {...state.other, from: String(from), to: String(to)}) : null;
    if (state.window && state.window[0] >= found.header.duration) state.window = null; // it was chosen for a longer response
    this.shown = found;
    this.texts = texts;
    this.page.shown = found;
    this.page.accepted();
    this.draw();
    this.pause = window.setTimeout(() => void this.settled.ask(), PAUSE);
  }

  /** What nobody reads while a slider moves. */
  async settle() {
    const {shown, texts = {}, page: {state}} = this;
    if (!shown) return;
    const {from, to} = shown.header.window, details = await payload("/api/details", {...texts, from: String(from), to: String(to)});
    if (shown !== this.shown) return;
    this.details = details;
    const {header} = details;
    if (header.body) drawPlan(one("plan"), details, shown.header.block.body, (azimuth) => this.page.changed({...texts, azimuth}, Object.keys(texts)));
    if (state.view === "shake") {
      this.files();
      table(one("words"), [], header.summary);
      this.drawDetails();
      this.follow(this.moment());
    }
    this.page.counted("rested");
  }

  files() {
    if (!this.shown || !this.details) return;
    const {texts = {}} = this, name = slug(caseName(this.shown.header));
    const figures_ = ["rotation", "ground"].flatMap((figure, k) => /** @type {("svg" | "png")[]} */ (["svg", "png"]).map((form) => [`${name}-${figure}.${form}`, `${k ? "Ground" : "Rotation"}, ${form.toUpperCase()}`, () => this.histories[k].file(form)]));
    offer([...figures_, ...FILES.map(([form, label]) => [`${name}.${form}`, label, () => file("/api/export", {...texts, form})])], this.details.header.python, this.details.header.command, this.page);
  }

  enter() {
    if (this.page.state.other && !this.other) void this.load.ask(); else if (this.shown) { this.draw(); void this.settled.ask(); }
  }

  leave() { this.stop(); }

  window() { return this.shown?.header.window ?? {from: 0, to: 1}; }

  /** @param {number} time */
  plotted(time) { return (time - this.scale.origin) / this.scale.unit; }

  /** @param {number} x */
  time(x) { return this.scale.origin + x * this.scale.unit; }

  draw() {
    const {shown, other, page: {state}} = this;
    if (!shown) return;
    const {header, arrays} = shown, {from, to} = header.window;
    this.page.summary(header);
    this.scene.show(header, arrays.outline);
    if (state.view !== "shake") return;
    this.scale = scaleOf(from, to);
    this.drawHistories(header, arrays, other);
    const verdict = one("other-verdict");
    verdict.hidden = !other;
    one("keep").textContent = state.other ? "Stop comparing" : "Compare other cases with this one";
    if (other) verdict.textContent = `Compared case (${nameOf(other.header)}): ${other.header.verdict}`;
    this.follow(this.moment());
    if (state.at !== null) void this.read.ask(String(state.at)); else one("reading").textContent = "Click on a figure, or type a time, to read the response there.";
    this.drawChattering();
  }

  /** @param {any} header @param {Record<string, Float64Array>} arrays @param {Payload | null} other */
  drawHistories({window: {from, to}, block, motion, overturned, peak_over_slenderness: peak}, arrays, other) {
    const times = (/** @type {Float64Array} */ all) => all.map((each) => this.plotted(from + each)), [perG, unit] = axisUnit("g"), g = perG === 1 ? 1 : perG;
    const turned = (/** @type {any} */ header, /** @type {Float64Array} */ rotation) => rotation.map((each) => each / header.block.sides[each >= 0 ? 0 : 1].alpha);
    const rotation = turned(this.shown?.header, arrays.rotation), lines = other ? [rotation, turned(other.header, other.arrays.rotation)] : [rotation];
    const x = {low: this.plotted(from), high: this.plotted(to)};
    let {low, high} = around(lines, 0);
    [low, high] = [Math.max(low, -REACH), Math.min(high, REACH)];
    const tall = high - low || 1, rests = rows(arrays.rest, 2).filter(([start, end]) => end > from && start < to).map((each) => each.map((at) => this.plotted(at)));
    const uplifts = arrays.uplift.filter((each) => each >= from && each <= to).map((each) => this.plotted(each));
    const y = {low: low - 0.26 * tall, high: high + 0.08 * tall, label: "rotation / slenderness"};
    this.histories[0].show({x, y, layers: [
      {class: "band", bands: rests}, {class: "zero", along: "x", rules: [0]}, {class: "balance", along: "x", rules: [-1, 1]},
      ...(other ? [{class: "line dashed second", line: [other.arrays.time.map((each) => this.plotted(other.header.window.from + each)), lines[1]]}] : []),
      {class: "line ink", line: [times(arrays.time), rotation]}, {class: "tick ink", ticks: times(arrays.impact)},
      {class: "dot accent", dots: [uplifts, uplifts.map(() => y.low + 0.17 * tall)]},
    ], legend: [
      ["line ink", "line", "rotation"], ["band", "area", "at rest"], ["tick ink", "tick", "impact"], ["dot accent", "dot", "uplift"],
      ...(overturned || peak > 0.9 ? [["balance", "line", "balance on still ground"]] : []), ...(other ? [["line dashed second", "line", "compared case"]] : []),
    ]});
    const ground = arrays.ground_g.map((each) => g * each), {weight} = arrays, [plus, minus] = block.thresholds_g.map((/** @type {number} */ each) => g * each), at = times(arrays.ground_time);
    const limit = (/** @type {number} */ level) => (weight ? weight.map((each) => level * each) : ground.map(() => level));
    const vertical = weight?.map((each) => g * block.gravity_g * (each - 1)), [high1, low1] = [limit(minus), limit(-plus)];
    const beyond = (/** @type {Float64Array} */ level, /** @type {number} */ sign) => ({class: "fill accent", area: [at, level, ground.map((each, k) => (sign * each > sign * level[k] ? each : level[k]))]});
    const most = 1.08 * Math.max(around([ground, vertical ?? []], 0).high, -around([ground, vertical ?? []], 0).low, ground.length ? Math.min(plus, minus) : 0.1);
    this.histories[1].show({x: {...x, label: this.scale.label}, y: {low: -most, high: most, label: `ground (${unit})`}, layers: [
      {class: "zero", along: "x", rules: [0]},
      ...(weight ? [{class: "line thin vertical", line: [at, /** @type {Float64Array} */ (vertical)]}, {class: "limit", line: [at, high1]}, {class: "limit", line: [at, low1]}] : [{class: "limit", along: /** @type {"x"} */ ("x"), rules: motion ? [minus, -plus] : []}]),
      ...(other ? [{class: "line thin second", line: [other.arrays.ground_time.map((each) => this.plotted(other.header.window.from + each)), other.arrays.ground_g.map((each) => g * each)]}] : []),
      {class: "line thin ground", line: [at, ground]}, beyond(high1, 1), beyond(low1, -1),
    ], legend: [
      ["line thin ground", "line", "ground acceleration"], ["limit", "line", "threshold of uplift"], ["fill accent", "area", "beyond it"],
      ...(motion?.vertical ? [["line thin vertical", "line", `vertical: ${motion.vertical.name}`]] : []),
    ]});
    one("slip").hidden = !arrays.slip;
    if (!arrays.slip) return;
    const slip = arrays.slip.map((each) => 1e3 * each);
    this.histories[2].show({x: {...x, label: this.scale.label}, y: {...around([slip]), label: "slip (mm)"}, layers: [{class: "zero", along: "x", rules: [0]}, {class: "line ink", line: [times(arrays.time), slip]}]});
  }

  /** The time that is shown: the chosen one, or the start of the window. */
  moment() { return this.page.state.at ?? this.window().from; }

  /** The pointer is at a time. @param {number | null} time */
  hover(time) {
    if (this.playing) return;
    this.follow(time ?? this.moment());
    if (time !== null) void this.read.ask(String(time)); else if (this.page.state.at !== null) void this.read.ask(String(this.page.state.at));
  }

  /** Choose a time. @param {number} time */
  seek(time) {
    this.stop();
    this.page.state.at = Math.min(Math.max(time, 0), this.shown?.header.duration ?? 0);
    writeAddress(this.page.state, {soon: true});
    this.follow(this.page.state.at);
    void this.read.ask(String(this.page.state.at));
  }

  /** Draw the block and mark the figures at a time. @param {number} time */
  follow(time) {
    const {shown, details} = this;
    if (!shown) return;
    const {arrays, header: {window: {from, to}}} = shown, at = time - from;
    for (const chart of [...this.histories, this.energy]) chart.mark(this.plotted(time));
    const rotation = valueAt(arrays.time, arrays.rotation, at), larger = Number(one("larger").value);
    const moved = details && details.header.from === from ? valueAt(details.arrays.displacement_time, details.arrays.displacement, at) : 0;
    this.scene.paint({rotation: Math.max(-Math.PI / 2, Math.min(Math.PI / 2, larger * rotation)), moved, slip: arrays.slip ? valueAt(arrays.time, arrays.slip, at) : 0});
    one("scrub").value = String(Math.round((1000 * at) / (to - from)));
    put(one("scrub"), {"aria-valuetext": `${fixed(time, decimals(to - from))} s`});
    const field = one("at");
    if (!isTyped(field) && document.activeElement !== field) field.value = time.toFixed(decimals(to - from));
  }

  /** Read the response at a time. @param {string} time @param {boolean} [chosen] whether it was typed */
  async reading(time, chosen = false) {
    const {from, to} = this.window(), found = await json("/api/at", {...this.texts, at: time, from: String(from), to: String(to)});
    if (chosen) { this.seek(found.time); return; }
    const parts = [
      `rotation ${angle(found.rotation)} = ${short(found.over_slenderness)} α`, `angular velocity ${short(found.velocity)} rad/s`, ...(found.ground_g === null ? [] : [`ground ${ofG(found.ground_g)}`]),
      ...(found.vertical_g === null ? [] : [`upwards ${ofG(found.vertical_g)}`]), `energy ${short(found.energy)} of the overturning energy`, ...(found.slip === null ? [] : [`slip ${length(found.slip)}`]),
    ];
    one("reading").textContent = `At ${fixed(found.time, decimals(to - from))} s the block ${found.rotation ? `leans to the ${found.rotation > 0 ? "right" : "left"}` : "stands on both corners"}: ${parts.join(", ")}.`;
    one("reading").dataset.time = String(found.time);
  }

  play() {
    if (this.playing) { this.stop(); return; }
    const {from, to} = this.window(), first = this.moment() < to - 1e-9 && this.moment() > from ? this.moment() : from, began = performance.now();
    one("play").textContent = "Pause";
    const frame = () => {
      const time = first + ((performance.now() - began) / 1000) * Number(one("speed").value);
      if (time >= to) { this.stop(); this.seek(to); return; }
      this.page.state.at = time;
      this.follow(time);
      this.playing = requestAnimationFrame(frame);
    };
    this.playing = requestAnimationFrame(frame);
  }

  stop() {
    if (!this.playing) return;
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    one("play").textContent = "Play";
    writeAddress(this.page.state);
    if (this.page.state.at !== null) void this.read.ask(String(this.page.state.at));
  }

  /** Show another window. @param {[number, number] | null} wanted */
  go(wanted) {
    const whole = this.shown?.header.duration ?? 1;
    if (wanted) {
      const width = Math.max(wanted[1] - wanted[0], NARROWEST), middle = 0.5 * (wanted[0] + wanted[1]);
      wanted = [Math.max(0, middle - 0.5 * width), Math.min(whole, middle + 0.5 * width)];
      if (!(wanted[1] > wanted[0])) return;
    }
    this.page.state.window = wanted;
    void this.load.ask();
  }

  /** @param {string} how */
  zoom(how) {
    const {from, to} = this.window(), whole = this.shown?.header.duration ?? 1, width = to - from, middle = 0.5 * (from + to);
    if (how === "all") this.go([0, whole]);
    else if (how === "active") this.go(null);
    else if (how === "in") this.go([middle - 0.25 * width, middle + 0.25 * width]);
    else if (how === "out") this.go([Math.max(0, middle - width), Math.min(whole, middle + width)]);
    else {
      const shift = Math.min(Math.max((how === "left" ? -0.25 : 0.25) * width, -from), whole - to);
      if (shift) this.go([from + shift, to + shift]);
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const how = {"+": "in", "=": "in", "-": "out", "−": "out", ArrowLeft: "left", ArrowRight: "right", "0": "active"}[event.key];
    if (!how) return;
    event.preventDefault();
    this.zoom(how);
  }

  /** Phase plane and energy, if they are open. */
  drawDetails() {
    const {details} = this;
    if (!details) return;
    this.drawChattering();
    if (!one("phase").open) return;
    const {arrays, header: {from}} = details, jump = Array.from(arrays.jump), [time, x, v, kinetic, potential] = ["course_time", "course_rotation", "course_velocity", "kinetic", "potential"].map((name) => arrays[name]);
    const [beyond] = [x.findIndex((each) => Math.abs(each) > REACH)], count = beyond < 0 ? x.length : beyond;
    const [rotation, rate] = [x.subarray(0, count), v.subarray(0, count)], jumps = jump.filter((k) => k + 1 < count);
    this.plane.show({x: {...around([rotation]), label: "rotation / slenderness"}, y: {...around([rate]), label: "velocity / (p · slenderness)"}, layers: [
      {class: "zero", along: "x", rules: [0]}, {class: "zero", along: "y", rules: [0]}, {class: "balance", line: [arrays.boundary_x, arrays.boundary_y]}, {class: "line ink", line: gaps(rotation, rate, jumps)},
      {class: "jump", segments: [jumps.map(() => 0), jumps.map((k) => rate[k]), jumps.map(() => 0), jumps.map((k) => rate[k + 1])]},
    ], legend: [["line ink", "line", "response"], ["jump", "line", "impact"], ["balance", "line", "energy of the balance"]]});
    const times = time.map((each) => this.plotted(from + each)), total = kinetic.map((each, k) => each + potential[k]), {low, high} = this.histories[0].content?.x ?? {low: 0, high: 1};
    const needed = Math.max(...details.header.needed.filter(Number.isFinite));
    this.energy.show({x: {low, high, label: this.scale.label}, y: {low: 0, high: 1.06 * Math.min(2, Math.max(...total.filter(Number.isFinite), 0.01)), label: "energy / overturning energy"}, layers: [
      {class: "balance", along: "x", rules: [needed]}, {class: "line thin second", line: [times, kinetic]}, {class: "line thin ground", line: [times, potential]}, {class: "line ink", line: [times, total]},
    ], legend: [["line ink", "line", "total"], ["line thin second", "line", "kinetic"], ["line thin ground", "line", "potential"]]});
    this.follow(this.moment());
  }

  /** Sequences of impacts that end at rest, as objects. */
  sequences() {
    const {arrays} = /** @type {Payload} */ (this.shown);
    return rows(arrays.sequence, 6).map(([start, end, lower, upper, impacts, off]) => {
      const uplift = [0, ...arrays.uplift].findLast((each) => each <= end) ?? 0, count = arrays.impact_time.filter((each) => each >= uplift && each <= end).length;
      return {start, end, lower, upper, impacts, off, uplift, count};
    });
  }

  drawChattering() {
    if (!this.shown || !one("chattering").open) return;
    const {header, arrays} = this.shown, found = this.sequences(), {from, to, impacts, unresolved} = header.window;
    this.chosen = Math.min(this.chosen, Math.max(0, found.length - 1));
    for (const id of ["intervals", "ratios", "closer"]) one(id).hidden = !found.length;
    one("depth").textContent = `${span(to - from)} with ${counted(impacts, "impact")} drawn.${unresolved ? ` Those in the last ${span(unresolved)} before the rest are summed by the proof.` : ""}`;
    if (!found.length) { table(one("sequences"), [], [["No sequence of impacts ends at rest."]]); return; }
    const changed = header.motion ? "Change by 3 millionths of the motion" : "Change by 3 millionths of the start";
    table(one("sequences"), ["", "Uplift (s)", "Complete from (s)", "Rest (s)", changed, "Bracket", "Impacts"], found.map(({uplift, start, end, lower, upper, off, count}, k) => {
      const proven = Number.isFinite(upper), button = make("button", {type: "button", "aria-pressed": String(k === this.chosen), on: {click: () => { this.chosen = k; const margin = 0.06 * (end - uplift); this.go([Math.max(0, uplift - margin), end + margin]); }}}, [`Show ${k + 1}`]);
      return [button, fixed(uplift, 3), proven ? fixed(start, 4) : "not proven", fixed(end, 9), off === Infinity ? "undetermined" : Number.isFinite(off) ? `± ${span(off)}` : NONE, proven ? `± ${span(0.5 * (upper - lower))}` : NONE, fixed(count, 0)];
    }));
    const {uplift, count} = found[this.chosen], first = arrays.impact_time.findIndex((each) => each >= uplift), impacts_ = Array.from(arrays.impact_time.subarray(first, first + count));
    const interval = impacts_.slice(1).map((each, k) => each - impacts_[k]), ratio = interval.slice(2).map((each, k) => each / interval[k]), number = interval.map((_, k) => k + 1);
    const x = {low: 0, high: count + 1, label: "impact since uplift"}, known = interval.filter((each) => each > 0);
    if (!known.length) return;
    this.intervals.show({x, y: {low: 0.5 * Math.min(...known), high: 2 * Math.max(...known), log: true, label: "interval (s)"}, layers: [{class: "dot ink", dots: [number, interval.map((each) => (each > 0 ? each : NaN))]}]});
    const [right, left] = header.block.sides, eta = right.restitution * left.restitution, sorted = ratio.filter(Number.isFinite).sort(), middle = [sorted[Math.floor(0.05 * sorted.length)] ?? eta, sorted[Math.floor(0.95 * sorted.length)] ?? eta, eta];
    this.ratios.show({x, y: {...around([middle], 0.35), label: "ratio of intervals"}, layers: [{class: "limit accent", along: "x", rules: [eta]}, {class: "dot ink", dots: [number.slice(0, ratio.length), ratio]}], legend: [["limit accent", "line", `η² = ${short(eta, 4)}`]]});
  }

  /** Ten times closer to the accumulation point. */
  closer() {
    const sequence = this.sequences()[this.chosen], {from, to} = this.window();
    if (!sequence) return;
    const inside = from <= sequence.end && sequence.end <= to, width = Math.max(NARROWEST, inside ? 0.1 * (to - from) : sequence.end - sequence.uplift);
    this.go([sequence.end - 0.92 * width, sequence.end + 0.08 * width]);
  }
}

/** @param {Float64Array} all @param {number} width @returns {number[][]} */
const rows = (all, width) => Array.from({length: all.length / width}, (_, k) => Array.from(all.subarray(k * width, (k + 1) * width)));

/** What tells a compared case. @param {any} header */
const nameOf = (header) => `${caseName(header)}, ${treatmentName(header.treatment).toLowerCase()}`;

/** The four figures of a case. @param {any} header @returns {[string, string, string][]} */
export function figuresOf(header) {
  const {block: {thresholds_g: [plus, minus]}, overturned, rests, proven, motion} = header;
  return [
    ["Peak rotation", overturned ? "overturns" : `${short(header.peak_over_slenderness)} α`, overturned ? `lies flat at ${fixed(header.overturn_time, 3)} s` : `${angle(header.peak_rotation)} at ${fixed(header.peak_time, 2)} s`],
    ["Uplift acceleration", ofG(Math.min(plus, minus)), motion ? `PGA ${ofG(motion.pga_g)}` : "no ground motion"],
    ["Comes to rest", `${fixed(rests, 0)} ×`, rests ? (proven === rests ? "each time proven" : `${fixed(proven, 0)} proven`) : "not at all"],
    ["Impacts", fixed(header.impacts, 0), header.share_at_rest === null ? "" : `at rest for ${short(100 * header.share_at_rest, 2)} % of the strong shaking`],
  ];
}
