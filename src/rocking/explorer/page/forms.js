// Forms that change the texts of a case: its block, its motion, its model.

import {make, one, put} from "./standalone/dom.js";
import {idOf, questions} from "./records.js";
import {namesOf, parameter, specification} from "./state.js";
import {measured, shown, typed, whole} from "./numbers.js";
import {phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {import("./state.js").Parameter} Parameter */
/** Receives new texts, and the names of all texts that they replace. @typedef {(texts: Texts, replaced: string[]) => void} Changed */

const STEPS = 1000, RELEASED = "3deg", G = 9.80665;

/** The field in which somebody types: what arrives meanwhile leaves it as it is. @type {EventTarget | null} */
let typing = null;
document.addEventListener("input", ({target}) => { typing = target; }, true);
for (const end of ["change", "blur"]) document.addEventListener(end, () => { typing = null; }, true);
/** @param {HTMLElement} field */
export const isTyped = (field) => field === typing;

/** @param {string} name @param {string} label @param {string[][]} options values and labels @param {(value: string) => void} changed @param {string} [argument] */
export function choice(name, label, options, changed, argument = name) {
  const select = make("select", {id: name, "data-argument": argument, on: {change: () => changed(select.value)}}, optionsOf(options));
  return {select, element: make("label", {class: "choice"}, [make("span", {}, [label]), select])};
}

/** @param {string[][]} options */
export const optionsOf = (options) => options.map(([value, text]) => make("option", {value}, [text]));

/** Show a value, also if it is not offered. @param {HTMLSelectElement} select @param {string} value */
export function choose(select, value) {
  if (![...select.options].some((each) => each.value === value)) select.append(...optionsOf([[value, value]]));
  select.value = value;
}

/** A number with its slider, field, unit and explanation. Two numbers with a slash are those of the right and the left side. */
export class Field {
  /** @param {Parameter} spec @param {() => void} changed @param {string} [hint] of a field that may stay empty */
  constructor(spec, changed, hint = undefined) {
    this.spec = spec;
    this.changed = changed;
    this.optional = hint !== undefined;
    this.steps = spec.step ? (spec.high - spec.low) / spec.step : STEPS;
    const {name, label, unit, about, argument} = spec;
    this.slider = make("input", {type: "range", id: `${name}-slider`, min: 0, max: this.steps, "aria-label": `${label}, slider`, on: {input: () => this.slid()}});
    this.field = make("input", {type: "text", id: name, inputmode: "decimal", size: 7, placeholder: hint ?? null, "data-argument": name, "data-other": argument, on: {change: () => this.typed()}});
    this.element = make("div", {class: "number"}, [
      make("label", {for: name}, [label]), ...(about ? [make("details", {class: "about"}, [make("summary", {"aria-label": `What is ${label}?`}, ["?"]), make("p", {}, [about])])] : []),
      this.slider, this.field, make("span", {class: "unit"}, [unit]),
    ]);
    this.text = "";
    this.show(this.optional ? "" : spec.default);
  }

  /** @param {string} text as the address has it @param {number | string} [known] value of an empty field, in its own unit */
  show(text, known) {
    this.text = text;
    const values = (text || String(known ?? "")).split(",").map((each) => measured(each, this.spec.units));
    const words = values.every(Number.isFinite) ? values.map(shown).join(" / ") : text;
    if (!isTyped(this.field)) this.field.value = text ? words : "";
    if (this.optional && known !== undefined) this.field.placeholder = words;
    if (!Number.isFinite(values[0])) return;
    const {low, high, is_logarithmic} = this.spec, [value] = values;
    const part = is_logarithmic ? Math.log(Math.max(value, 1e-300) / low) / Math.log(high / low) : (value - low) / (high - low);
    this.slider.value = String(Math.round(this.steps * Math.min(1, Math.max(0, part))));
    this.slider.setAttribute("aria-valuetext", `${words} ${this.spec.unit}`.trim());
  }

  /** A text as a number in the field's unit. @param {string} [text] */
  value(text = this.text) { return measured(text, this.spec.units); }

  slid() {
    const {low, high, is_logarithmic, suffix} = this.spec.own ?? this.spec, part = Number(this.slider.value) / this.steps; // rounded in its own unit
    const value = Number((is_logarithmic ? low * (high / low) ** part : low + part * (high - low)).toPrecision(3));
    this.show(value + suffix + (this.spec.arity === "two" ? `,${value}${suffix}` : ""));
    this.changed();
  }

  typed() {
    const parts = this.field.value.split("/").map(typed).filter(Boolean);
    if (!parts.length && !this.optional) { this.show(this.text); return; }
    this.show(parts.map((/** @type {string} */ each) => (Number.isNaN(Number(each)) ? each : each + this.spec.suffix)).join(","));
    this.changed();
  }
}

export class BlockForm {
  /** @param {HTMLElement} element @param {Changed} changed @param {import("./records.js").RecordList} list */
  constructor(element, changed, list) {
    this.changed = changed;
    this.list = list;
    this.names = namesOf("block");
    /** Sides of the block that is shown, for what the texts leave out. @type {any[] | null} */
    this.sides = null;
    this.gravity = 1;
    this.shape = choice("shape", "Given by", specification.shapes.map((/** @type {any} */ {name}) => [name, phrase(`shape.${name}`)]), () => this.reshape());
    const texts = ["up", "unit", "density", "tolerance"].map((name) => /** @type {[string, any]} */ ([name, make("input", {type: "text", id: name, "data-argument": name, placeholder: {up: "z", unit: "m"}[name] ?? "as usual", on: {change: () => this.tell()}})]));
    this.plain = Object.fromEntries(texts);
    this.mesh = choice("mesh", parameter("mesh").label, [], () => this.tell());
    this.reading = make("details", {}, [make("summary", {}, ["How the mesh is read"]), ...texts.map(([name, input]) => make("label", {class: "choice"}, [make("span", {}, [parameter(name).label]), input]))]);
    const fields = this.names.filter((name) => name !== "mesh" && !(name in this.plain));
    /** @type {Record<string, Field>} */
    this.fields = Object.fromEntries(fields.map((name) => [name, new Field(parameter(name), () => this.tell(), {restitution: "from momentum", offset: "0"}[name])]));
    this.plan = make("div", {id: "plan"});
    element.replaceChildren(this.shape.element, this.mesh.element, this.reading, ...fields.map((name) => this.fields[name].element), this.plan);
  }

  /** Show the block of a case. @param {Texts} texts @param {any} [block] what the server says of it */
  show(texts, block) {
    if (block) { this.sides = block.sides; this.gravity = block.gravity_g; }
    this.shape.select.value = (specification.shapes.find((/** @type {any} */ {needed}) => needed[0] in texts) ?? specification.shapes[0]).name;
    for (const [name, field] of Object.entries(this.fields)) {
      if (name === "restitution") field.show(texts[name] ?? "", this.sides?.map(({restitution}) => restitution).filter((each, k, all) => !k || each !== all[0]).join(","));
      else if (texts[name] || field.optional) field.show(texts[name] ?? "", field.optional ? 0 : undefined);
    }
    const meshes = [...specification.meshes.map((/** @type {string} */ name) => [name, `${name} (shipped)`]), ...Object.entries(this.list.meshes)];
    this.mesh.select.replaceChildren(...optionsOf(meshes));
    choose(this.mesh.select, texts.mesh ?? specification.meshes[0]);
    for (const [name, input] of Object.entries(this.plain)) if (!isTyped(input)) input.value = texts[name] ?? "";
    this.showFields();
  }

  /** Names of the fields of the chosen description. @returns {string[]} */
  wanted() {
    const {needed, optional} = specification.shapes.find((/** @type {any} */ {name}) => name === this.shape.select.value);
    return [...needed, ...optional, "restitution"];
  }

  showFields() {
    const wanted = this.wanted(), isMesh = this.shape.select.value === "mesh";
    for (const [name, {element}] of Object.entries(this.fields)) element.hidden = !wanted.includes(name);
    for (const each of [this.mesh.element, this.reading, this.plan]) each.hidden = !isMesh;
  }

  /** Change the description; the block stays the same, as far as the new one can describe it. */
  reshape() {
    const {sides} = this;
    if (sides) {
      const [right, left] = sides, distances = sides.map(({radius, alpha}) => radius * Math.sin(alpha)), height = right.radius * Math.cos(right.alpha);
      const pair = (/** @type {string[]} */ [one_, other]) => (one_ === other ? one_ : `${one_},${other}`);
      const same = {
        width: whole(distances[0] + distances[1]), height: whole(2 * height), offset: distances[0] === distances[1] ? "" : whole(0.5 * (distances[1] - distances[0])),
        p: pair(sides.map(({p}) => String(p))), alpha: pair(sides.map(({alpha}) => `${alpha}rad`)), pivots: distances.map(whole).join(","), height_of_mass: whole(height),
        gyration: whole(Math.sqrt(Math.max((this.gravity * G * right.radius) / right.p ** 2 - right.radius ** 2, 0))),
      };
      for (const [name, text] of Object.entries(same)) this.fields[name].show(text);
      if (right.restitution !== left.restitution) this.fields.restitution.show(sides.map(({restitution}) => String(restitution)).join(","));
    }
    this.showFields();
    this.tell();
  }

  tell() {
    const texts = Object.fromEntries(this.wanted().filter((name) => this.fields[name]?.text).map((name) => [name, this.fields[name].text]));
    if (this.shape.select.value === "mesh") Object.assign(texts, {mesh: this.mesh.select.value}, Object.fromEntries(Object.entries(this.plain).map(([name, {value}]) => [name, value.trim()]).filter(([, value]) => value)));
    this.changed(texts, this.names);
  }

  /** Take a mesh that was opened. @param {any} file */
  take({key, name, azimuth}) {
    this.list.meshes[`file:${key}`] = name;
    this.changed({mesh: `file:${key}`, azimuth: String(Number(azimuth.toPrecision(6)))}, this.names);
  }
}

export class MotionForm {
  /** @param {HTMLElement} element @param {Changed} changed @param {import("./records.js").RecordList} list @param {() => Promise<void>} reload loads the list after an answer */
  constructor(element, changed, list, reload) {
    this.changed = changed;
    this.list = list;
    this.reload = reload;
    this.names = namesOf("motion", "start");
    this.motion = choice("motion", parameter("motion").label, [], (value) => this.another(value));
    this.vertical = choice("vertical", parameter("vertical").label, [], () => this.tell());
    this.missing = make("div");
    this.corrections = make("details", {}, [make("summary", {}, ["Corrections"]), ...["baseline", "highpass"].map((name) => {
      const input = make("input", {type: "text", id: name, size: 9, "data-argument": name, placeholder: name === "baseline" ? "as the format needs" : "none", on: {change: () => this.correct(name, typed(input.value))}});
      return make("label", {class: "choice"}, [make("span", {}, [parameter(name).label]), input]);
    })]);
    this.pulse = make("div");
    const tell = () => this.tell();
    this.starts = namesOf("start").map((name) => new Field(parameter(name), tell));
    this.scaled = choice("scaled", "Scaled", specification.scalings.map((/** @type {string} */ name) => [name, phrase(`scaled.${name || "none"}`)]), () => { this.showFields(); this.tell(); });
    /** @type {Field[]} */
    this.scales = specification.scalings.slice(1).map((/** @type {string} */ name) => new Field(parameter(name), tell));
    this.period = new Field(specification.period, tell);
    /** @type {Texts} */
    this.texts = {};
    this.family = "";
    /** @type {Field[]} */
    this.numbers = [];
    /** @type {{name: string, select: any, element: any}[]} */
    this.choices = [];
    element.replaceChildren(this.motion.element, this.missing, this.pulse, this.vertical.element, this.corrections, ...this.starts.map((each) => each.element), this.scaled.element, ...this.scales.map((each) => each.element), this.period.element);
  }

  /** Fields of a pulse. @param {string} family @param {Texts} parts */
  showPulse(family, parts) {
    if (family !== this.family) {
      const {parameters, choices = {}} = specification.pulses[family];
      this.family = family;
      this.numbers = parameters.map((/** @type {Parameter} */ spec) => new Field({...spec, name: `pulse-${spec.name}`, argument: spec.name}, () => this.tell()));
      this.choices = Object.entries(choices).map(([name, values]) => ({name, ...choice(`pulse-${name}`, "Kind", values.map((/** @type {string} */ value) => [value, value]), () => this.tell(), name)}));
      this.pulse.replaceChildren(...[...this.numbers, ...this.choices].map((each) => each.element));
    }
    for (const each of this.numbers) each.show(parts[each.spec.argument] ?? each.spec.default);
    for (const each of this.choices) each.select.value = parts[each.name] ?? each.select.options[0].value;
  }

  /** @param {Texts} texts */
  show(texts) {
    this.texts = texts;
    const {motion = ""} = texts, [family, rest = ""] = motion.split(":"), isPulse = Object.hasOwn(specification.pulses, family);
    const group = (/** @type {string} */ label, /** @type {string[][]} */ options) => make("optgroup", {label}, optionsOf(options));
    const rows = (/** @type {boolean} */ own) => this.list.groups.filter(({rows: [first]}) => Boolean(first.key) === own).flatMap((each) => each.rows).map((row) => [idOf(row.texts), row.title]);
    const mine = rows(true);
    this.motion.select.replaceChildren(
      group("Other", [["none#", "nothing: released from a rotation"], ...(family === "given" ? [[`${motion}#`, "the motion of the study"]] : [])]),
      group("Pulses", Object.keys(specification.pulses).map((name) => [`pulse:${name}`, phrase(`pulse.${name}`)])), ...(mine.length ? [group("Your files", mine)] : []), group("Shipped records", rows(false)));
    choose(this.motion.select, isPulse ? `pulse:${family}` : idOf(texts));
    if (isPulse) this.showPulse(family, Object.fromEntries(rest.split(",").map((part) => part.split("=").map((each) => each.trim()))));
    for (const each of this.starts) each.show(texts[each.spec.name] ?? each.spec.default);
    this.scaled.select.value = this.scales.find(({spec}) => texts[spec.name])?.spec.name ?? "";
    for (const each of this.scales) if (texts[each.spec.name]) each.show(texts[each.spec.name].split("@")[0]);
    if (texts.sa) this.period.show(texts.sa.split("@")[1] ?? "1");
    this.vertical.select.replaceChildren(...optionsOf([["", "none"], ...this.list.verticals(this.list.find(texts))]));
    choose(this.vertical.select, texts.vertical ?? "");
    this.showFields();
  }

  showFields() {
    const value = this.motion.select.value, isPulse = value.startsWith("pulse:"), isNone = value === "none#", scaled = this.scaled.select.value;
    const row = this.list.rows().find(({texts}) => idOf(texts) === value);
    this.pulse.hidden = !isPulse;
    this.vertical.element.hidden = !row;
    this.corrections.hidden = !row?.key;
    const assumed = row?.key ? this.list.answers[row.key] : undefined, told = ["dt", "units"].map((name) => assumed?.[name]).filter(Boolean);
    for (const name of ["baseline", "highpass"]) if (!isTyped(one(name))) one(name).value = assumed?.[name] ?? "";
    this.missing.replaceChildren(...(row ? questions([row], (rows, name, answer) => this.answer(rows, name, answer)) : []),
      ...(row && told.length && !row.missing.length ? [make("p", {class: "soft"}, [`Read with ${told.join(" and ")}. `, make("button", {type: "button", class: "link", on: {click: () => this.forget(row)}}, ["change"])])] : []));
    for (const each of this.starts) each.element.hidden = each.value() === 0 && (!isNone || each !== this.starts[0]);
    this.scaled.element.hidden = isPulse || isNone;
    for (const each of this.scales) each.element.hidden = isPulse || isNone || scaled !== each.spec.name;
    this.period.element.hidden = isPulse || isNone || scaled !== "sa";
  }

  /** Another motion was chosen. @param {string} value */
  another(value) {
    const isNone = value === "none#";
    for (const each of this.starts) each.show(each.spec.default);
    if (isNone) this.starts[0].show(RELEASED);
    if (value.startsWith("pulse:")) this.showPulse(value.slice(6), {});
    this.vertical.select.value = "";
    this.showFields();
    this.tell();
  }

  /** Choose a record whose questions are open. @param {import("./records.js").Row} row */
  wait(row) {
    choose(this.motion.select, idOf(row.texts));
    if (this.texts.motion === "none") for (const each of this.starts) each.show(each.spec.default);
    this.showFields();
  }

  /** Ask again about a file. @param {import("./records.js").Row} row */
  async forget(row) {
    delete this.list.answers[row.key];
    await this.reload();
    this.wait(row);
  }

  /** Correct the chosen record. @param {string} name @param {string} value */
  correct(name, value) {
    const row = this.list.rows().find(({texts}) => idOf(texts) === this.motion.select.value);
    if (row) void this.answer([row], name, value);
  }

  /** An answer about files. @param {import("./records.js").Row[]} rows @param {string} name @param {string} value */
  async answer(rows, name, value) {
    for (const {key} of rows) this.list.answers[key] = {...this.list.answers[key], [name]: value};
    const chosen = this.motion.select.value;
    await this.reload();
    choose(this.motion.select, chosen);
    this.showFields();
    if (rows.some((row) => idOf(row.texts) === chosen)) this.tell();
  }

  tell() {
    const value = this.motion.select.value, row = this.list.rows().find(({texts}) => idOf(texts) === value), scaled = this.scaled.select.value;
    if (row?.missing.length) return; // its questions are open
    /** @type {Texts} */
    const texts = {...(row ? row.texts : value.startsWith("pulse:") ? {} : {motion: value.replace(/#[^#]*$/, ""), ...(this.texts.channel && idOf(this.texts) === value ? {channel: this.texts.channel} : {})})};
    if (value.startsWith("pulse:")) texts.motion = `${this.family}:${[...this.numbers.map((each) => `${each.spec.argument}=${each.text}`), ...this.choices.map((each) => `${each.name}=${each.select.value}`)].join(",")}`;
    if (this.vertical.select.value && row) texts.vertical = this.vertical.select.value;
    if (row?.key) for (const name of ["baseline", "highpass"]) { const told = this.list.answers[row.key]?.[name]; if (told) texts[name] = told; }
    for (const each of this.starts) if (each.value() !== 0) texts[each.spec.name] = each.text;
    const control = this.scales.find(({spec}) => spec.name === scaled);
    if (control && !control.element.hidden) texts[scaled] = scaled === "sa" ? `${control.text}@${this.period.text}` : control.text;
    this.changed(texts, this.names);
  }
}

export class ModelForm {
  /** @param {HTMLElement} element @param {Changed} changed */
  constructor(element, changed) {
    this.changed = changed;
    const {models, treatments} = specification, tell = () => this.tell();
    this.model = choice("model", parameter("model").label, models.map((/** @type {string} */ name) => [name, phrase(`model.${name}`)]), tell);
    this.treatment = choice("treatment", parameter("chattering").label, treatments.map((/** @type {any} */ {name}) => [name, phrase(`treatment.${name}`)]), tell, "chattering");
    this.about = make("p", {class: "soft"});
    /** @type {Record<string, Field>} */
    this.limits = Object.fromEntries(treatments.filter((/** @type {any} */ {limit}) => limit).map((/** @type {any} */ {name, limit}) => [name, new Field({...limit, name: `${name}-limit`}, tell)]));
    this.friction = new Field(parameter("friction"), tell, "never slips");
    element.replaceChildren(this.model.element, this.treatment.element, this.about, ...Object.values(this.limits).map(({element: each}) => each), this.friction.element);
  }

  /** @param {Texts} texts */
  show(texts) {
    const [name, limit] = (texts.chattering ?? "certified").split("=");
    this.model.select.value = texts.model ?? "nonlinear";
    choose(this.treatment.select, name);
    if (Object.hasOwn(this.limits, name)) this.limits[name].show(limit ?? specification.treatments.find((/** @type {any} */ each) => each.name === name).unnamed);
    this.friction.show(texts.friction ?? "");
    this.showFields();
  }

  showFields() {
    const name = this.treatment.select.value;
    this.about.textContent = phrase(`treatment.${name}_about`);
    for (const [each, {element}] of Object.entries(this.limits)) put(element, {hidden: each === name ? null : ""});
  }

  tell() {
    this.showFields();
    const name = this.treatment.select.value, limit = Object.hasOwn(this.limits, name) ? this.limits[name] : null, {text} = this.friction;
    const texts = {...(this.model.select.value === "nonlinear" ? {} : {model: this.model.select.value}), ...(name === "certified" ? {} : {chattering: limit ? `${name}=${limit.text}` : name}), ...(text ? {friction: text} : {})};
    this.changed(/** @type {Texts} */ (texts), ["model", "chattering", "friction"]);
  }
}

/** A status for screen readers. @param {string} words */
export const announce = (words) => { one("said").textContent = words; };
