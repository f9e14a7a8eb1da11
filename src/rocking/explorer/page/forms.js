// Forms that change the texts of a case: its block, its motion, its model.

import {json} from "./api.js";
import {NumberControl} from "./controls.js";
import {make, one, sent, what} from "./words.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {(texts: Texts, gone: string[]) => void} Changed */

/** @param {string} id @param {string} label @param {[string, string][]} options @param {(value: string) => void} changed */
function choice(id, label, options, changed) {
  const select = /** @type {HTMLSelectElement} */ (make("select", {id, on: {change: () => changed(select.value)}},
    options.map(([value, text]) => make("option", {value}, [text]))));
  return {select, element: make("div", {className: "choice"}, [make("label", {className: "field", for: id}, [label]), select])};
}

/** @param {string} id @param {string} label @param {(on: boolean) => void} changed */
function check(id, label, changed) {
  const box = /** @type {HTMLInputElement} */ (make("input", {type: "checkbox", id, on: {change: () => changed(box.checked)}}));
  return {box, element: make("label", {className: "check"}, [box, ` ${label}`])};
}

/** Halves of a text that may have a comma. @param {string | undefined} text */
const sides = (text) => {
  const parts = (text ?? "").split(",");
  return [parts[0], parts[1] ?? parts[0]];
};

export class BlockForm {
  /** @param {HTMLElement} element @param {any} offers @param {Changed} changed @param {string} [prefix] */
  constructor(element, offers, changed, prefix = "") {
    this.changed = changed;
    /** @type {Texts} */
    this.texts = {};
    /** @param {string} name @param {number} side */
    const control = (name, side) => {
      const spec = offers.block.find((/** @type {any} */ each) => each.name === name);
      const label = side < 0 ? spec.label : `${spec.label}, ${side ? "left (side −)" : "right (side +)"}`;
      return new NumberControl({...spec, label, words: side > 0 ? "" : spec.words}, () => this.tell(), `${prefix}${side < 0 ? "" : side}`);
    };
    this.shape = choice(`${prefix}shape`, "Given by", [["sizes", "width and height"], ["parameters", "p and α"], ["pivots", "pivots and radius of gyration"]], () => this.reshape());
    this.sizes = ["width", "height", "offset"].map((name) => control(name, -1));
    this.plain = ["p", "alpha"].map((name) => control(name, -1));
    this.pairs = ["p", "alpha", "restitution"].map((name) => [control(name, 0), control(name, 1)]);
    this.pivots = [control("pivots", 0), control("pivots", 1), control("height_of_mass", -1), control("gyration", -1)];
    this.two = check(`${prefix}two`, "Two different sides", () => this.part());
    this.housner = check(`${prefix}housner`, "Restitution from angular momentum", () => this.tell());
    this.restitution = control("restitution", -1);
    element.replaceChildren(
      this.shape.element, ...this.sizes.map((each) => each.element), this.two.element, ...this.plain.map((each) => each.element),
      ...this.pairs.slice(0, 2).flat().map((each) => each.element), ...this.pivots.map((each) => each.element), this.housner.element,
      this.restitution.element, ...this.pairs[2].map((each) => each.element),
    );
  }

  /** Show the block of a case. @param {Texts} texts @param {any[]} [known] sides as they are, for what the texts leave out */
  show(texts, known) {
    this.texts = texts;
    this.known = known ?? this.known;
    const shape = "width" in texts ? "sizes" : "pivots" in texts ? "pivots" : "parameters";
    this.shape.select.value = shape;
    this.two.box.checked = shape === "parameters" && ["p", "alpha", "restitution"].some((name) => (texts[name] ?? "").includes(","));
    this.housner.box.checked = !("restitution" in texts);
    for (const each of [...this.sizes, ...this.plain]) each.show(texts[each.spec.name] ? sides(texts[each.spec.name])[0] : each.spec.name === "offset" ? "0" : each.text);
    for (const pair of this.pairs) pair.forEach((each, k) => { if (texts[each.spec.name]) each.show(sides(texts[each.spec.name])[k]); });
    this.pivots.forEach((each, k) => { if (texts[each.spec.name]) each.show(sides(texts[each.spec.name])[k === 1 ? 1 : 0]); });
    if (this.known) {
      if (!texts.restitution) this.restitution.show(sent(this.known[0].restitution));
      this.pairs[2].forEach((each, k) => { if (!texts.restitution) each.show(sent(/** @type {any[]} */ (this.known)[k].restitution)); });
    }
    if (texts.restitution) this.restitution.show(sides(texts.restitution)[0]);
    this.reveal();
  }

  /** Whether each side has a restitution of its own. */
  sided() {
    const shape = this.shape.select.value;
    if (shape === "parameters") return this.two.box.checked;
    return (this.texts.restitution ?? "").includes(",") || (this.known && this.known[0].restitution !== this.known[1].restitution);
  }

  reveal() {
    const shape = this.shape.select.value, two = shape === "parameters" && this.two.box.checked, given = !this.housner.box.checked;
    this.sizes.forEach((each) => { each.element.hidden = shape !== "sizes"; });
    this.plain.forEach((each) => { each.element.hidden = shape !== "parameters" || two; });
    this.pairs.slice(0, 2).flat().forEach((each) => { each.element.hidden = !two; });
    this.pivots.forEach((each) => { each.element.hidden = shape !== "pivots"; });
    this.two.element.hidden = shape !== "parameters";
    this.restitution.element.hidden = this.sided() || !given;
    this.pairs[2].forEach((each) => { each.element.hidden = !this.sided() || !given; });
  }

  /** From one description to another; the block stays as far as that can describe it. */
  reshape() {
    const shape = this.shape.select.value;
    if (this.known) {
      const [right, left] = this.known;
      const distances = this.known.map((/** @type {any} */ side) => side.radius * Math.sin(side.alpha));
      const height = right.radius * Math.cos(right.alpha);
      if (shape === "parameters") {
        this.plain[0].show(sent(right.p));
        this.plain[1].show(`${sent((right.alpha * 180) / Math.PI)}deg`);
        this.two.box.checked = right.p !== left.p || right.alpha !== left.alpha;
        this.known.forEach((/** @type {any} */ side, /** @type {number} */ k) => {
          this.pairs[0][k].show(sent(side.p));
          this.pairs[1][k].show(`${sent((side.alpha * 180) / Math.PI)}deg`);
          this.pairs[2][k].show(sent(side.restitution));
        });
        // Rounded p and alpha need not be those of a body.
        if (this.two.box.checked) this.housner.box.checked = false;
      } else if (shape === "sizes") {
        this.sizes[0].show(sent(distances[0] + distances[1]));
        this.sizes[1].show(sent(2 * height));
        this.sizes[2].show(sent(0.5 * (distances[1] - distances[0])));
      } else {
        const gravity = Number(this.texts.gravity ?? 9.80665);
        distances.forEach((/** @type {number} */ each, /** @type {number} */ k) => this.pivots[k].show(sent(each)));
        this.pivots[2].show(sent(height));
        this.pivots[3].show(sent(Math.sqrt(Math.max((gravity * right.radius) / right.p ** 2 - right.radius ** 2, 0))));
      }
    }
    this.tell();
  }

  /** Between one set of parameters and a pair of each. */
  part() {
    if (this.two.box.checked) {
      this.plain.forEach((each, k) => this.pairs[k].forEach((side) => side.show(each.text)));
      this.pairs[2].forEach((side) => side.show(this.restitution.text));
      this.housner.box.checked = false;
    } else {
      this.plain.forEach((each, k) => each.show(this.pairs[k][0].text));
      this.restitution.show(this.pairs[2][0].text);
    }
    this.tell();
  }

  tell() {
    const shape = this.shape.select.value, two = shape === "parameters" && this.two.box.checked;
    /** @type {Texts} */
    const texts = {};
    if (shape === "sizes") {
      for (const each of this.sizes) texts[each.spec.name] = each.text;
      if (Number(texts.offset) === 0) delete texts.offset;
    } else if (shape === "pivots") {
      texts.pivots = `${this.pivots[0].text},${this.pivots[1].text}`;
      texts.height_of_mass = this.pivots[2].text;
      texts.gyration = this.pivots[3].text;
    } else if (two) for (const [plus, minus] of this.pairs.slice(0, 2)) texts[plus.spec.name] = `${plus.text},${minus.text}`;
    else for (const each of this.plain) texts[each.spec.name] = each.text;
    if (!this.housner.box.checked) texts.restitution = this.sided() ? `${this.pairs[2][0].text},${this.pairs[2][1].text}` : this.restitution.text;
    this.reveal();
    this.changed(texts, ["width", "height", "offset", "p", "alpha", "pivots", "height_of_mass", "gyration", "restitution"]);
  }
}

const KINDS = /** @type {[string, string][]} */ ([
  ["record", "a shipped record"], ["pulse", "a pulse"], ["file", "a file of yours"], ["given", "the motion of the notebook"],
  ["none", "nothing: released from a rotation"],
]);
const SCALES = /** @type {[string, string][]} */ ([
  ["", "as it is"], ["pga", "to a peak acceleration (PGA)"], ["pgv", "to a peak velocity (PGV)"],
  ["sa", "to a spectral acceleration (Sa)"], ["scale", "by a factor"],
]);

export class MotionForm {
  /** @param {HTMLElement} element @param {any} offers @param {Changed} changed @param {string} [prefix] */
  constructor(element, offers, changed, prefix = "") {
    this.offers = offers;
    this.changed = changed;
    this.prefix = prefix;
    /** @type {any} */
    this.file = null;
    /** @type {any[]} */
    this.files = [];
    this.given = "";
    this.wanted = "";
    this.kind = choice(`${prefix}kind`, "Shaken by", KINDS, () => this.another());
    this.record = choice(`${prefix}record`, "Record", offers.records.map((/** @type {any} */ each) => [each.name, each.name]), () => this.another());
    this.about = make("p", {className: "derived"});
    this.pulse = choice(`${prefix}pulse`, "Pulse", Object.entries(offers.pulses).map(([name, each]) => [name, /** @type {any} */ (each).label]), (name) => { this.furnish(name); this.tell(); });
    this.numbers = make("div");
    this.told = {
      channel: choice(`${prefix}channel`, "Channel", [], () => this.tell()),
      units: choice(`${prefix}units`, "Units of the numbers", offers.units.map((/** @type {string} */ each) => [each, each]), () => this.tell()),
    };
    this.dt = /** @type {HTMLInputElement} */ (make("input", {type: "text", inputMode: "decimal", id: `${prefix}dt`, value: "0.01", on: {change: () => this.tell()}}));
    this.dtElement = make("div", {className: "choice"}, [make("label", {className: "field", for: `${prefix}dt`}, ["Sampling step, s"]), this.dt]);
    this.vertical = choice(`${prefix}vertical`, "Vertical component", [["", "none"]], (value) => { this.wanted = value; this.tell(); });
    this.start = offers.start.map((/** @type {any} */ spec) => new NumberControl(spec, () => this.tell(), prefix));
    this.scale = choice(`${prefix}scaled`, "Scaled", SCALES, () => this.tell());
    this.scales = offers.scales.map((/** @type {any} */ spec) => new NumberControl(spec, () => this.tell(), prefix));
    this.period = new NumberControl(offers.period, () => this.tell(), prefix);
    element.replaceChildren(
      this.kind.element, this.record.element, this.pulse.element, this.numbers, this.about, this.told.channel.element, this.vertical.element, this.told.units.element,
      this.dtElement, ...this.start.map((/** @type {NumberControl} */ each) => each.element), this.scale.element,
      ...this.scales.map((/** @type {NumberControl} */ each) => each.element), this.period.element,
    );
    this.furnish("sine");
  }

  /** Numbers and choices of a pulse. @param {string} name */
  furnish(name) {
    const {numbers, choices} = this.offers.pulses[name];
    this.family = name;
    this.controls = numbers.map((/** @type {any} */ spec) => new NumberControl(spec, () => this.tell(), `${this.prefix}pulse-`));
    this.choices = Object.entries(choices ?? {}).map(([each, values]) => ({
      name: each, ...choice(`${this.prefix}pulse-${each}`, "Kind", /** @type {string[]} */ (values).map((value) => [value, value]), () => this.tell()),
    }));
    this.numbers.replaceChildren(...this.controls.map((/** @type {NumberControl} */ each) => each.element), ...this.choices.map((each) => each.element));
  }

  /** @param {Texts} texts */
  show(texts) {
    const motion = texts.motion ?? this.offers.default.motion;
    const family = motion.split(":")[0];
    const kind = family in this.offers.pulses ? "pulse" : ["none", "file", "given"].includes(family) ? family : "record";
    this.kind.select.value = kind;
    if (kind === "record") this.record.select.value = motion;
    if (kind === "given") this.given = motion;
    if (kind === "pulse") {
      this.pulse.select.value = family;
      if (this.family !== family) this.furnish(family);
      const parts = Object.fromEntries(motion.slice(family.length + 1).split(",").map((part) => part.split("=")));
      for (const each of this.controls) if (parts[each.spec.name]) each.show(parts[each.spec.name]);
      for (const each of this.choices ?? []) each.select.value = parts[each.name] ?? each.select.value;
    }
    const scaled = SCALES.map(([name]) => name).find((name) => name && texts[name]) ?? "";
    this.scale.select.value = scaled;
    for (const each of this.scales) if (texts[each.spec.name]) each.show(texts[each.spec.name].split("@")[0]);
    if (texts.sa) this.period.show(texts.sa.split("@")[1] ?? "1");
    for (const each of this.start) if (texts[each.spec.name]) each.show(texts[each.spec.name]);
    if (texts.channel) this.told.channel.select.value = texts.channel;
    this.wanted = texts.vertical ?? "";
    if (texts.units) this.told.units.select.value = texts.units;
    if (texts.dt) this.dt.value = texts.dt;
    this.reveal();
    void this.recall(texts);
  }

  /** Learn what the files of a link are, which the server has kept. @param {Texts} texts */
  async recall(texts) {
    const [moving, upwards] = [texts.motion, texts.vertical].map((name) => /^file:([^#]*)/.exec(name ?? "")?.[1]);
    for (const key of new Set([moving, upwards])) {
      if (!key || this.files.some((file) => file.key === key)) continue;
      try { this.files.push(await json(`/api/records/${key}`, {})); } catch { return; }
    }
    const known = this.files.find((file) => file.key === moving);
    if (known && known !== this.file) {
      this.file = known;
      this.offerChannels(known);
      if (texts.channel) this.told.channel.select.value = texts.channel;
    }
    if (moving || upwards) this.reveal();
  }

  /** @param {any} file */
  offerChannels(file) {
    this.told.channel.select.replaceChildren(...file.channels.map((/** @type {any} */ each) => make("option", {value: String(each.number)}, [`${each.number}: ${each.name}`])));
  }

  /** A file that the server keeps: what shakes the block, or moves it up and down as well. @param {any} file @param {boolean} [upwards] */
  take(file, upwards = false) {
    this.files = [...this.files.filter((each) => each.key !== file.key), file];
    if (upwards) {
      this.wanted = file.channels.length > 1 ? `file:${file.key}#${file.channels.at(-1).number}` : `file:${file.key}`;
      this.offerVertical();
      this.tell();
      return;
    }
    this.file = file;
    this.wanted = "";
    this.offerChannels(file);
    this.kind.select.value = "file";
    this.scale.select.value = "";
    this.tell();
  }

  /** What may move the block up and down: other channels of the file, shipped records, other files. */
  offerVertical() {
    const kind = this.kind.select.value;
    const shaking = kind === "record" ? this.record.select.value : "";
    /** @type {[string, string][]} */
    const found = [];
    if (kind === "file" && this.file) {
      for (const each of this.file.channels) {
        if (String(each.number) !== this.told.channel.select.value) found.push([String(each.number), `channel ${each.number}: ${each.name}`]);
      }
    }
    for (const file of this.files) {
      if (file.key === this.file?.key && kind === "file") continue;
      if (file.channels.length < 2) found.push([`file:${file.key}`, file.name]);
      else for (const each of file.channels) found.push([`file:${file.key}#${each.number}`, `${file.name}, channel ${each.number}: ${each.name}`]);
    }
    const station = (/** @type {string} */ name) => name.slice(0, name.lastIndexOf("-"));
    const upwards = this.offers.records.filter((/** @type {any} */ each) => each.direction === "up").map((/** @type {any} */ each) => each.name);
    upwards.sort((/** @type {string} */ before, /** @type {string} */ after) => Number(station(after) === station(shaking)) - Number(station(before) === station(shaking)));
    found.push(...upwards.map((/** @type {string} */ name) => [name, name]));
    if (this.wanted && !found.some(([value]) => value === this.wanted)) found.push([this.wanted, this.wanted]);
    const {select, element} = this.vertical;
    element.hidden = kind !== "record" && kind !== "file";
    if (!this.prefix) one("choose-vertical").hidden = element.hidden;
    select.replaceChildren(...[["", "none"], ...found].map(([value, text]) => make("option", {value}, [text])));
    select.value = this.wanted;
  }

  reveal() {
    const kind = this.kind.select.value;
    const options = [...this.kind.select.options];
    for (const option of options) option.hidden = (option.value === "given" && !this.given) || (option.value === "file" && !this.file && kind !== "file");
    this.record.element.hidden = kind !== "record";
    this.pulse.element.hidden = this.numbers.hidden = kind !== "pulse";
    this.offerVertical();
    const file = kind === "file" ? this.file : null;
    this.told.channel.element.hidden = !file || file.channels.length < 2;
    this.told.units.element.hidden = !this.needs("units");
    this.dtElement.hidden = !this.needs("dt");
    for (const each of this.start) each.element.hidden = kind !== "none";
    this.scale.element.hidden = kind === "none" || kind === "pulse";
    for (const each of this.scales) each.element.hidden = this.scale.element.hidden || this.scale.select.value !== each.spec.name;
    this.period.element.hidden = this.scale.element.hidden || this.scale.select.value !== "sa";
    const record = this.offers.records.find((/** @type {any} */ each) => each.name === this.record.select.value);
    this.about.textContent = kind === "record" && record ? `${record.event}; ${record.station}, ${record.direction === "up" ? "vertical component, used as a horizontal motion" : `${record.direction}°`}.`
      : file ? `${file.name}: ${file.format}, since ${file.reason}.` : "";
    this.about.hidden = !this.about.textContent;
  }

  /** Another motion, whose vertical component was not chosen yet. */
  another() {
    this.wanted = "";
    this.tell();
  }

  /** Whether a file that is used does not say something itself. @param {string} name */
  needs(name) {
    const kind = this.kind.select.value;
    const beside = this.files.find((file) => this.wanted.startsWith(`file:${file.key}`));
    const used = kind === "file" ? [this.file, beside] : kind === "record" ? [beside] : [];
    return used.some((file) => file?.missing.includes(name));
  }

  tell() {
    this.reveal();
    const kind = this.kind.select.value;
    /** @type {Texts} */
    const texts = {};
    if (kind === "record") texts.motion = this.record.select.value;
    else if (kind === "none") {
      texts.motion = "none";
      for (const each of this.start) texts[each.spec.name] = Number.parseFloat(each.text) === 0 ? "3deg" : each.text;
    } else if (kind === "given") texts.motion = this.given;
    else if (kind === "pulse") {
      const numbers = this.controls.map((/** @type {NumberControl} */ each) => `${each.spec.name}=${each.text}`);
      const chosen = (this.choices ?? []).map((each) => `${each.name}=${each.select.value}`);
      texts.motion = `${this.family}:${[...numbers, ...chosen].join(",")}`;
    } else if (this.file) {
      texts.motion = `file:${this.file.key}`;
      if (this.file.channels.length > 1) texts.channel = this.told.channel.select.value;
    }
    if (this.wanted && !this.vertical.element.hidden) texts.vertical = this.wanted;
    if (this.needs("units")) texts.units = this.told.units.select.value;
    if (this.needs("dt")) texts.dt = this.dt.value;
    const scaled = this.scale.select.value;
    if (scaled && kind !== "none" && kind !== "pulse") {
      const control = this.scales.find((/** @type {NumberControl} */ each) => each.spec.name === scaled);
      texts[scaled] = scaled === "sa" ? `${control.text}@${this.period.text}` : control.text;
    }
    this.changed(texts, ["motion", "channel", "vertical", "dt", "units", "scale", "pga", "pgv", "sa", "initial_rotation", "initial_velocity"]);
  }
}

export class TreatmentForm {
  /** @param {HTMLElement} element @param {any} offers @param {Changed} changed @param {{prefix?: string, label?: string}} [given] */
  constructor(element, offers, changed, {prefix = "", label = "Chattering ends by"} = {}) {
    this.changed = changed;
    this.treatments = offers.treatments;
    this.kind = choice(`${prefix}treatment`, label, this.treatments.map((/** @type {any} */ each) => [each.name, each.label]), () => this.tell());
    this.about = make("p", {className: "derived"});
    /** @type {Record<string, NumberControl>} */
    this.numbers = {};
    for (const each of this.treatments) if (each.number) this.numbers[each.name] = new NumberControl({...each.number, words: ""}, () => this.tell(), `${prefix}${each.name}-`);
    element.append(this.kind.element, this.about, ...Object.values(this.numbers).map((each) => each.element));
    this.reveal();
  }

  /** @param {Texts} texts */
  show(texts) {
    const [name, value] = (texts.chattering ?? "certified").split("=");
    this.kind.select.value = name;
    if (value && this.numbers[name]) this.numbers[name].show(value);
    this.reveal();
  }

  reveal() {
    const name = this.kind.select.value;
    this.about.textContent = this.treatments.find((/** @type {any} */ each) => each.name === name)?.words ?? "";
    for (const [each, control] of Object.entries(this.numbers)) control.element.hidden = each !== name;
  }

  tell() {
    this.reveal();
    const name = this.kind.select.value;
    const text = this.numbers[name] ? `${name}=${this.numbers[name].text}` : name;
    this.changed(/** @type {Texts} */ (name === "certified" ? {} : {chattering: text}), ["chattering"]);
  }
}

export class ModelForm {
  /** @param {HTMLElement} element @param {any} offers @param {Changed} changed */
  constructor(element, offers, changed) {
    this.model = choice("model", "Equation of motion", [["nonlinear", "exact (nonlinear)"], ["linear", "slender block (linear)"]],
      (value) => changed(/** @type {Texts} */ (value === "nonlinear" ? {} : {model: value}), ["model"]));
    const [button, words] = what("Exact, or linearised for slender blocks: sin and tan of α and of the rotation are taken for the angles themselves.", "the equation of motion");
    this.model.element.querySelector("label")?.append(" ", button);
    element.replaceChildren(this.model.element, words);
    this.treatment = new TreatmentForm(element, offers, changed);
  }

  /** @param {Texts} texts */
  show(texts) {
    this.model.select.value = texts.model ?? "nonlinear";
    this.treatment.show(texts);
  }
}
