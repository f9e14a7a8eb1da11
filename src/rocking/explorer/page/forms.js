// Forms that change the texts of a case: its block, its motion, its model.

import {json} from "./api.js";
import {check, choice, choose, isTyped, offer} from "./controls.js";
import {remaking} from "./focus.js";
import {MeshFields} from "./mesh.js";
import {namesOf, parameter, pulseOf, specification} from "./parameters.js";
import {explained, make, one} from "./words.js";
import {measured, shown, typed, whole} from "./numbers.js";
import {phrase} from "./texts.js";
import {G} from "./units.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {import("./parameters.js").Parameter} Parameter */
/** @typedef {(texts: Texts, replaced: string[]) => void} Changed the new texts, and all names that they replace */
/** @typedef {{tell: () => void}} Form */

const STEPS = 1000;
const BLOCK = namesOf("block"), MOTION = namesOf("motion", "start"), RELEASED = "3deg";
/** Key of the file that a text names, if it names one. @param {string | undefined} text */
const keyOf = (text) => /^file:([^#]*)/.exec(text ?? "")?.[1];

/** A number with a slider, a field, its unit and its explanation. */
class NumberControl {
  /** @param {Parameter} spec @param {Form} form is told when the number changes @param {string} [prefix] */
  constructor(spec, form, prefix = "") {
    this.spec = spec;
    this.form = form;
    this.steps = spec.step ? (spec.high - spec.low) / spec.step : STEPS;
    const id = `${prefix}${spec.name}`;
    this.slider = /** @type {HTMLInputElement} */ (make("input", {
      type: "range", id: `${id}-slider`, min: "0", max: String(this.steps), step: "1", "aria-label": phrase("form.slider", {label: spec.label}), on: {input: () => this.slid()},
    }));
    this.field = /** @type {HTMLInputElement} */ (make("input", {type: "text", id, inputMode: "decimal", size: 6, "data-argument": spec.name, on: {change: () => this.typed()}}));
    const [button, words] = spec.explanation ? explained(spec.explanation, spec.label) : [];
    this.element = make("div", {className: "number"}, [
      make("div", {className: "number-head"}, [make("label", {for: id}, [spec.label]), ...(button ? [button] : [])]),
      make("div", {className: "number-body"}, [this.slider, this.field, make("span", {className: "unit"}, [spec.unit])]),
      ...(words ? [words] : []),
    ]);
    this.text = "";
    this.show(spec.default);
  }

  /** Value in the control's unit of a text in any unit. @param {string} text */
  value(text) { return measured(text, this.spec.units); }

  /** Show a text without telling anybody. @param {string} text */
  show(text) {
    this.text = text;
    const value = this.value(text);
    if (!Number.isFinite(value)) {
      if (!isTyped(this.field)) this.field.value = text;
      return;
    }
    const {low, high, logarithmic} = this.spec;
    const part = logarithmic ? Math.log(Math.max(value, 1e-300) / low) / Math.log(high / low) : (value - low) / (high - low);
    this.slider.value = String(Math.round(this.steps * Math.min(1, Math.max(0, part))));
    const written = shown(value);
    if (!isTyped(this.field)) this.field.value = written;
    this.slider.setAttribute("aria-valuetext", `${written} ${this.spec.unit}`.trim());
  }

  slid() {
    const part = Number(this.slider.value) / this.steps;
    const {low, high, logarithmic, suffix} = this.spec.own ?? this.spec; // rounded in its own unit, whatever unit is shown
    this.text = Number((logarithmic ? low * (high / low) ** part : low + part * (high - low)).toPrecision(3)) + suffix;
    const written = shown(this.value(this.text));
    this.field.value = written;
    this.slider.setAttribute("aria-valuetext", `${written} ${this.spec.unit}`.trim());
    this.form.tell();
  }

  typed() {
    const given = typed(this.field.value);
    if (given === "") {
      this.show(this.text);
      return;
    }
    this.show(Number.isNaN(Number(given)) ? given : given + this.spec.suffix);
    this.form.tell();
  }
}

export class BlockForm {
  /** @param {HTMLElement} element @param {Changed} changed @param {() => Promise<void>} answered comes when `known` is of the block that was told
   * last @param {string} [prefix] */
  constructor(element, changed, answered, prefix = "") {
    this.changed = changed;
    this.answered = answered;
    /** @type {Texts} */
    this.texts = {};
    /** @type {any[] | undefined} sides as they are, for what the texts leave out */
    this.known = undefined;
    /** Whether the restitution followed from angular momentum before the sides were told apart. @type {boolean | undefined} */
    this.byMomentum = undefined;
    this.shape = choice(prefix, "shape", phrase("form.shape"), specification.shapes.map((/** @type {any} */ {name}) => [name, phrase(`shape.${name}`)]), () => this.reshape());
    this.two = check(`${prefix}two`, phrase("form.two"), () => this.separate());
    this.housner = check(`${prefix}housner`, phrase("form.housner"), () => { this.showFields(); this.tell(); });
    this.opener = prefix ? null : one("choose-mesh").parentElement;
    this.mesh = new MeshFields(prefix, () => this.tell(), (azimuth) => { this.put("azimuth", [azimuth]); this.tell(); });
    this.specs = BLOCK.filter((name) => !this.mesh.names.includes(name)).map(parameter);
    /** Controls by name: one for both sides, and one for each. @type {Record<string, {both: NumberControl, pair: NumberControl[]}>} */
    this.controls = Object.fromEntries(this.specs.map((spec) => [spec.name, {
      both: new NumberControl(spec, this, prefix),
      pair: spec.values === "one" ? [] : [phrase("form.right", {label: spec.label}), phrase("form.left", {label: spec.label})].map((label, k) =>
        new NumberControl({...spec, label, explanation: k ? "" : spec.explanation}, this, `${prefix}${k}`)),
    }]));
    const before = /** @type {Record<string, HTMLElement>} */ ({p: this.two.element, restitution: this.housner.element});
    element.replaceChildren(this.shape.element, this.mesh.element, ...this.specs.flatMap(({name}) => {
      const {both, pair} = this.controls[name];
      return [...(before[name] ? [before[name]] : []), both.element, ...pair.map((each) => each.element), ...(name === "azimuth" ? [this.mesh.picture] : [])];
    }));
  }

  /** Show the block of a case. @param {Texts} texts @param {any[]} [known] */
  show(texts, known) {
    this.texts = texts;
    this.known = known ?? this.known;
    const shape = specification.shapes.find((/** @type {any} */ each) => each.needed[0] in texts) ?? specification.shapes[1];
    this.shape.select.value = shape.name;
    this.two.box.checked = shape.name === "parameters" && this.specs.some(({name}) => (texts[name] ?? "").includes(","));
    this.housner.box.checked = !("restitution" in texts);
    this.mesh.show(texts);
    for (const {name} of this.specs) {
      const text = texts[name] ?? (name === "offset" ? "0" : "");
      if (text) this.put(name, text.split(","));
      else if (name === "restitution" && this.known) this.put(name, this.known.map((side) => String(side.restitution)));
    }
    this.showFields();
  }

  /** @param {string} name @param {string[]} texts one, or one for each side */
  put(name, texts) {
    const {both, pair} = this.controls[name];
    both.show(texts[0]);
    pair.forEach((each, k) => each.show(texts[k] ?? texts[0]));
  }

  /** Names of the parameters that describe the block as it is chosen. @returns {string[]} */
  names() {
    const {needed, optional} = specification.shapes.find((/** @type {any} */ each) => each.name === this.shape.select.value);
    return [...needed, ...optional].filter((name) => name in this.controls).concat(...(this.housner.box.checked ? [] : ["restitution"]));
  }

  /** Whether each side has a value of its own. @param {Parameter} spec */
  sided({values}) {
    if (values !== "one or two") return values === "two";
    if (this.shape.select.value === "parameters") return this.two.box.checked;
    return (this.texts.restitution ?? "").includes(",") || Boolean(this.known && this.known[0].restitution !== this.known[1].restitution);
  }

  /** Show the controls that describe the block as it is chosen, and hide the others. */
  showFields() {
    const names = this.names();
    for (const spec of this.specs) {
      const {both, pair} = this.controls[spec.name];
      const seen = names.includes(spec.name), sided = this.sided(spec);
      both.element.hidden = !seen || sided;
      for (const each of pair) each.element.hidden = !seen || !sided;
    }
    this.mesh.element.hidden = this.mesh.picture.hidden = this.shape.select.value !== "mesh";
    if (this.opener) this.opener.hidden = this.mesh.element.hidden;
    this.two.element.hidden = this.shape.select.value !== "parameters";
  }

  /** From one description to another; the block stays as far as that can describe it. */
  async reshape() {
    this.showFields();
    await this.answered();
    if (this.known) {
      const [right, left] = this.known;
      const distances = this.known.map((side) => side.radius * Math.sin(side.alpha));
      const height = right.radius * Math.cos(right.alpha), gravity = measured(this.texts.gravity ?? "", parameter("gravity").units) || G;
      const same = {
        width: [whole(distances[0] + distances[1])], height: [whole(2 * height)], offset: [whole(0.5 * (distances[1] - distances[0]))],
        p: this.known.map((side) => String(side.p)), alpha: this.known.map((side) => `${side.alpha}rad`),
        pivots: distances.map(whole), height_of_mass: [whole(height)], gyration: [whole(Math.sqrt(Math.max((gravity * right.radius) / right.p ** 2 - right.radius ** 2, 0)))],
      };
      for (const [name, texts] of Object.entries(same)) if (this.names().includes(name)) this.put(name, texts);
      this.two.box.checked = this.shape.select.value === "parameters" && (right.p !== left.p || right.alpha !== left.alpha);
      this.put("restitution", this.known.map((side) => String(side.restitution)));
      if (this.byMomentum !== undefined) this.housner.box.checked = this.byMomentum;
      this.byMomentum = undefined;
    }
    this.showFields();
    this.tell();
  }

  /** Between one set of parameters and a pair of each. */
  separate() {
    for (const {both, pair} of Object.values(this.controls)) {
      if (this.two.box.checked) for (const side of pair) side.show(both.text);
      else if (pair.length) both.show(pair[0].text);
    }
    // Two sides that are changed one by one need not be those of a body, which has a momentum.
    if (this.two.box.checked) {
      this.byMomentum = this.housner.box.checked;
      this.housner.box.checked = false;
    } else if (this.byMomentum !== undefined) this.housner.box.checked = this.byMomentum;
    this.showFields();
    this.tell();
  }

  tell() {
    const texts = Object.fromEntries(this.names().map((name) => {
      const {both, pair} = this.controls[name];
      return [name, this.sided(both.spec) ? pair.map((each) => each.text).join(",") : both.text];
    }));
    if (Number(texts.offset) === 0) delete texts.offset;
    this.changed(this.mesh.element.hidden ? texts : {...this.mesh.texts(), ...texts}, BLOCK);
  }

  /** Take a mesh that the server keeps. @param {any} file */
  take(file) {
    const linked = this.mesh.take(file, this.texts);
    if (!linked) this.put("azimuth", [String(Number(file.azimuth.toPrecision(6)))]);
    this.shape.select.value = "mesh";
    this.showFields();
    this.tell();
  }
}

const KINDS = ["record", "pulse", "file", "given", "none"].map((name) => [name, phrase(`kind.${name}`)]);

export class MotionForm {
  /** @param {HTMLElement} element @param {Changed} changed @param {string} [prefix] */
  constructor(element, changed, prefix = "") {
    this.changed = changed;
    this.prefix = prefix;
    /** @type {any} the file that shakes the block */
    this.file = null;
    /** @type {any[]} all files that are known */
    this.files = [];
    this.given = "";
    this.upwards = "";
    const chosen = () => { this.showFields(); this.tell(); };
    const another = () => { this.upwards = ""; chosen(); };
    const shaken = () => { this.release(); another(); };
    /** @param {string} name */
    const field = (name) => parameter(name).label;
    this.kind = choice(prefix, "kind", phrase("form.kind"), KINDS, shaken);
    this.record = choice(prefix, "record", field("motion"), specification.records.map((/** @type {any} */ each) => [each.name, each.title]), another);
    this.about = make("p", {className: "derived"});
    this.pulse = choice(prefix, "pulse", phrase("form.pulse"), Object.keys(specification.pulses).map((name) => [name, phrase(`pulse.${name}`)]), (name) => { this.showPulse(name); chosen(); });
    this.numbers = make("div");
    this.channel = choice(prefix, "channel", field("channel"), [], chosen);
    this.vertical = choice(prefix, "vertical", field("vertical"), [["", phrase("form.none")]], (value) => { this.upwards = value; chosen(); });
    this.units = choice(prefix, "units", field("units"), [["", phrase("form.no_units")], ...specification.units.map((/** @type {string} */ each) => [each, each])], chosen);
    this.units.select.dataset.argument = "units";
    /** What is missing of a file, with what each choice would make of it. */
    this.missing = make("div", {className: "missing", role: "group", "aria-label": phrase("file.missing"), hidden: true});
    /** Texts of the motion as it is. @type {Texts} */
    this.texts = {};
    const {label, unit} = parameter("dt");
    const dt = /** @type {HTMLInputElement} */ (make("input", {type: "text", inputMode: "decimal", id: `${prefix}dt`, "data-argument": "dt", on: {change: () => { dt.value = typed(dt.value); chosen(); }}}));
    this.dt = {field: dt, element: make("div", {className: "choice"}, [make("label", {className: "field", for: dt.id}, [phrase("form.with_unit", {label, unit})]), dt])};
    this.starts = namesOf("start").map((name) => new NumberControl(parameter(name), this, prefix));
    this.scale = choice(prefix, "scaled", phrase("form.scaled"), specification.scalings.map((/** @type {string} */ name) => [name, phrase(`scaled.${name || "none"}`)]), chosen);
    /** @type {NumberControl[]} */
    this.scales = specification.scalings.slice(1).map((/** @type {string} */ name) => new NumberControl(parameter(name), this, prefix));
    this.period = new NumberControl(specification.period, this, prefix);
    element.replaceChildren(
      this.kind.element, this.record.element, this.pulse.element, this.numbers, this.about, this.channel.element, this.missing, this.vertical.element, this.units.element,
      this.dt.element, ...this.starts.map((each) => each.element), this.scale.element, ...this.scales.map((each) => each.element), this.period.element,
    );
    this.showPulse("sine");
  }

  /** Numbers and choices of a pulse. @param {string} name */
  showPulse(name) {
    const {parameters, choices} = specification.pulses[name];
    this.family = name;
    /** @type {NumberControl[]} */
    this.controls = parameters.map((/** @type {Parameter} */ spec) => new NumberControl(spec, this, `${this.prefix}pulse-`));
    this.choices = Object.entries(choices ?? {}).map(([each, values]) => ({
      name: each, ...choice(`${this.prefix}pulse-`, each, phrase("form.kind_of_pulse"), values.map((/** @type {string} */ value) => [value, phrase(`ricker.${value}`)]), () => this.tell()),
    }));
    this.numbers.replaceChildren(...[...this.controls, ...this.choices].map((each) => each.element));
  }

  /** @param {Texts} texts */
  show(texts) {
    const motion = texts.motion ?? specification.default.motion;
    const {family, parts} = pulseOf(motion);
    const kind = Object.hasOwn(specification.pulses, family) ? "pulse" : ["none", "file", "given"].includes(family) ? family : "record";
    this.kind.select.value = kind;
    if (kind === "record") this.record.select.value = motion;
    if (kind === "given") this.given = motion;
    if (kind === "pulse") {
      this.pulse.select.value = family;
      if (this.family !== family) this.showPulse(family);
      // What a pulse does not name is what the package takes for it: the field's default, and the first choice.
      for (const each of this.controls ?? []) each.show(parts[each.spec.name] ?? each.spec.default);
      for (const each of this.choices ?? []) each.select.value = parts[each.name] ?? each.select.options[0].value;
    }
    this.scale.select.value = this.scales.find(({spec}) => texts[spec.name])?.spec.name ?? "";
    for (const each of this.starts) each.show(texts[each.spec.name] ?? each.spec.default);
    for (const each of this.scales) if (texts[each.spec.name]) each.show(texts[each.spec.name].split("@")[0]);
    if (texts.sa) this.period.show(texts.sa.split("@")[1] ?? "1");
    this.upwards = texts.vertical ?? "";
    choose(this.units.select, texts.units ?? "");
    this.dt.field.value = texts.dt ?? "";
    this.texts = texts;
    if (kind === "file" && this.file?.key !== keyOf(motion)) this.file = null;
    this.showFields();
    void this.fetchFiles(texts);
  }

  /** Release the block from a rotation that is shown where nothing shakes it, and else from rest. */
  release() {
    for (const each of this.starts) each.show(each.spec.default);
    if (this.kind.select.value === "none") this.starts[0].show(RELEASED);
  }

  /** Learn what the files of a link are, which the server has kept. @param {Texts} texts */
  async fetchFiles(texts) {
    const keys = new Set([texts.motion, texts.vertical].map(keyOf).filter(Boolean));
    for (const key of keys) {
      if (this.files.some((file) => file.key === key)) continue;
      try { this.files.push(await json(`/api/records/${key}`, {})); } catch { /* what the case says of it is enough */ }
    }
    // Meanwhile another motion may have been chosen.
    const {motion, channel} = this.texts;
    const known = this.files.find((file) => file.key === keyOf(motion));
    if (known && known !== this.file) this.use(known);
    if (known && channel) this.channel.select.value = channel;
    if (keys.size) this.showFields();
  }

  /** Let a file shake the block. @param {any} file */
  use(file) {
    this.file = file;
    offer(this.channel.select, file.channels.map((/** @type {any} */ each) => [String(each.number), `${each.number}: ${each.name}`]));
  }

  /** Take a file that the server keeps: it shakes the block, or moves it up and down as well. @param {any} file @param {boolean} [upwards] */
  take(file, upwards = false) {
    const known = this.files.some(({key}) => key === file.key), {texts} = this;
    this.files = [...this.files.filter(({key}) => key !== file.key), file];
    // A file that the case waits for, or that shakes the block already, leaves the case as it is.
    const named = known ? [upwards ? undefined : texts.motion] : [texts.motion, texts.vertical];
    if (named.some((name) => keyOf(name) === file.key)) {
      this.show(texts);
      this.changed(Object.fromEntries(MOTION.filter((name) => texts[name]).map((name) => [name, texts[name]])), MOTION);
      return;
    }
    if (upwards) this.upwards = file.channels.length > 1 ? `file:${file.key}#${file.channels.at(-1).number}` : `file:${file.key}`;
    else {
      this.use(file);
      this.upwards = "";
      this.kind.select.value = "file";
      this.scale.select.value = this.units.select.value = this.dt.field.value = "";
      this.release();
    }
    this.showFields();
    this.tell();
  }

  /** What may move the block up and down: other channels of the file, shipped records, other files. */
  offerVertical() {
    const kind = this.kind.select.value;
    const used = kind === "file" ? this.file : null;
    /** @type {string[][]} */
    const found = [];
    for (const {number, name} of used?.channels ?? []) if (String(number) !== this.channel.select.value) found.push([String(number), phrase("form.channel", {number: String(number), name})]);
    for (const file of this.files.filter((each) => each.key !== used?.key)) {
      if (file.channels.length < 2) found.push([`file:${file.key}`, file.name]);
      else for (const {number, name} of file.channels) found.push([`file:${file.key}#${number}`, phrase("form.file_channel", {file: file.name, number: String(number), name})]);
    }
    /** Those of the same station first. @param {string} name */
    const station = (name) => name.slice(0, name.lastIndexOf("-"));
    const shaking = kind === "record" ? station(this.record.select.value) : "";
    const records = specification.records.filter((/** @type {any} */ each) => each.direction === "up").map((/** @type {any} */ each) => each.name);
    for (const same of [true, false]) found.push(...records.filter((/** @type {string} */ name) => (station(name) === shaking) === same).map((/** @type {string} */ name) => [name, name]));
    if (this.upwards && !found.some(([value]) => value === this.upwards)) found.push([this.upwards, this.upwards]);
    const {select, element} = this.vertical;
    element.hidden = kind !== "record" && kind !== "file";
    if (!this.prefix) one("choose-vertical").hidden = element.hidden;
    offer(select, [["", phrase("form.none")], ...found]);
    select.value = this.upwards;
  }

  /** Show the fields that belong to the motion as it is chosen, and hide the others. */
  showFields() {
    const kind = this.kind.select.value, scaled = this.scale.select.value, scalable = kind !== "none" && kind !== "pulse";
    for (const option of this.kind.select.options) option.hidden = (option.value === "given" && !this.given) || (option.value === "file" && !this.file && kind !== "file");
    this.record.element.hidden = kind !== "record";
    this.pulse.element.hidden = this.numbers.hidden = kind !== "pulse";
    this.offerVertical();
    const file = kind === "file" ? this.file : null;
    this.channel.element.hidden = !file || file.channels.length < 2;
    this.units.element.hidden = !this.needing("units");
    this.dt.element.hidden = !this.needing("dt");
    this.showMissing();
    for (const each of this.starts) each.element.hidden = each.value(each.text) === 0 && (kind !== "none" || each !== this.starts[0]);
    this.scale.element.hidden = !scalable;
    for (const each of this.scales) each.element.hidden = !scalable || scaled !== each.spec.name;
    this.period.element.hidden = !scalable || scaled !== "sa";
    const record = kind === "record" && specification.records.find((/** @type {any} */ each) => each.name === this.record.select.value);
    const {event, station, direction} = record ?? {};
    this.about.textContent = record ? (direction === "up" ? phrase("form.upward", {event, station}) : phrase("form.horizontal", {event, station, direction}))
      : file ? phrase("file.about", {name: file.name, format: file.format, reason: file.reason}) : "";
    this.about.hidden = !this.about.textContent;
  }

  /** Ask for what a file does not say, by what each choice would make of it. */
  showMissing() {
    /** @type {[string, HTMLInputElement | HTMLSelectElement][]} */
    const asked = [["units", this.units.select], ["dt", this.dt.field]];
    const open = asked.flatMap(([name, input]) => {
      const file = this.needing(name);
      if (!file || input.value) return [];
      const channel = file === this.file ? file.channels.find((/** @type {any} */ each) => String(each.number) === this.channel.select.value) : null;
      const choices = (channel ?? file.channels[0]).choices[name].map((/** @type {any} */ [value, figures]) => make("button", {type: "button", on: {click: () => {
        input.value = value;
        this.showFields();
        this.tell();
      }}}, [phrase(`file.${name}`, {value, ...figures})]));
      return [make("p", {className: "derived"}, [phrase(`file.no_${name}`, {name: file.name})]), make("div", {className: "toolbar"}, choices)];
    });
    remaking(/** @type {HTMLElement} */ (this.missing.parentElement), () => {
      this.missing.replaceChildren(...open);
      this.missing.hidden = !open.length;
    });
  }

  /** A file that is used and does not say something itself. @param {string} name @returns {any} */
  needing(name) {
    const kind = this.kind.select.value;
    const beside = this.files.find((file) => this.upwards.startsWith(`file:${file.key}`));
    const used = kind === "file" ? [this.file, beside] : kind === "record" ? [beside] : [];
    return used.find((file) => file?.missing.includes(name));
  }

  tell() {
    const kind = this.kind.select.value, scaled = this.scale.select.value;
    /** @type {Texts} */
    const texts = {};
    if (kind === "record") texts.motion = this.record.select.value;
    else if (kind === "none") texts.motion = "none";
    else if (kind === "given") texts.motion = this.given;
    else if (kind === "pulse") {
      const numbers = (this.controls ?? []).map((each) => `${each.spec.name}=${each.text}`);
      const chosen = (this.choices ?? []).map((each) => `${each.name}=${each.select.value}`);
      texts.motion = `${this.family}:${[...numbers, ...chosen].join(",")}`;
    } else if (this.file) {
      texts.motion = `file:${this.file.key}`;
      if (this.file.channels.length > 1) texts.channel = this.channel.select.value;
    } else for (const name of ["motion", "channel"]) if (this.texts[name]) texts[name] = this.texts[name];
    if (this.upwards && !this.vertical.element.hidden) texts.vertical = this.upwards;
    const waited = [texts.motion, texts.vertical].map(keyOf).some((key) => key && !this.files.some((file) => file.key === key));
    if ((waited || this.needing("units")) && this.units.select.value) texts.units = this.units.select.value;
    if ((waited || this.needing("dt")) && this.dt.field.value) texts.dt = this.dt.field.value;
    for (const each of this.starts) if (each.value(each.text) !== 0) texts[each.spec.name] = each.text;
    const control = this.scales.find(({spec}) => spec.name === scaled);
    if (control && kind !== "none" && kind !== "pulse") texts[scaled] = scaled === "sa" ? `${control.text}@${this.period.text}` : control.text;
    this.texts = texts;
    this.changed(texts, MOTION);
  }
}

export class TreatmentForm {
  /** @param {HTMLElement} element @param {Changed} changed @param {{prefix?: string, label?: string}} [given] */
  constructor(element, changed, {prefix = "", label = parameter("chattering").label} = {}) {
    this.changed = changed;
    const {treatments} = specification;
    this.kind = choice(prefix, "treatment", label, treatments.map((/** @type {any} */ {name}) => [name, phrase(`treatment.${name}`)]), () => { this.showFields(); this.tell(); });
    this.kind.select.dataset.argument = "chattering";
    this.about = make("p", {className: "derived"});
    /** @type {Record<string, NumberControl>} */
    this.limits = {};
    for (const {name, limit} of treatments) if (limit) this.limits[name] = new NumberControl(limit, this, `${prefix}${name}-`);
    element.append(this.kind.element, this.about, ...Object.values(this.limits).map((each) => each.element));
    this.showFields();
  }

  /** @param {Texts} texts */
  show(texts) {
    const [name, value] = (texts.chattering ?? "certified").split("=");
    this.kind.select.value = name;
    if (Object.hasOwn(this.limits, name)) this.limits[name].show(value ?? specification.treatments.find((/** @type {any} */ each) => each.name === name).unnamed);
    this.showFields();
  }

  showFields() {
    const name = this.kind.select.value;
    this.about.textContent = phrase(`treatment.${name}_about`);
    for (const [each, control] of Object.entries(this.limits)) control.element.hidden = each !== name;
  }

  tell() {
    const name = this.kind.select.value;
    this.changed({chattering: this.limits[name] ? `${name}=${this.limits[name].text}` : name}, ["chattering"]);
  }
}

export class ModelForm {
  /** @param {HTMLElement} element @param {Changed} changed */
  constructor(element, changed) {
    this.model = choice("", "model", parameter("model").label, specification.models.map((/** @type {string} */ name) => [name, phrase(`model.${name}`)]),
      (value) => changed(/** @type {Texts} */ (value === "nonlinear" ? {} : {model: value}), ["model"]));
    const [button, words] = explained(phrase("form.model_about"), phrase("form.model_what"));
    this.model.element.querySelector("label")?.append(" ", button);
    element.replaceChildren(this.model.element, words);
    // The texts of a case leave out what is the default; in a comparison the default is another treatment like any.
    this.treatment = new TreatmentForm(element, ({chattering}, names) => changed(/** @type {Texts} */ (chattering === "certified" ? {} : {chattering}), names));
  }

  /** @param {Texts} texts */
  show(texts) {
    this.model.select.value = texts.model ?? "nonlinear";
    this.treatment.show(texts);
  }
}
