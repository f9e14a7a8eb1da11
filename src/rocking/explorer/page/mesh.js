// The fields of a body of a mesh: its file, how that is read, and the picture on which it is turned.

import {payload} from "./api.js";
import {choice, choose, isTyped, offer} from "./controls.js";
import {namesOf, parameter, specification} from "./parameters.js";
import {Plan} from "./plan.js";
import {make} from "./words.js";
import {typed} from "./numbers.js";
import {phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */

const UP = [["", phrase("mesh.as_format")], ...["z", "y", "x", "-z", "-y", "-x"].map((axis) => [axis, axis.replace("-", "−")])];

export class MeshFields {
  /** @param {string} prefix @param {() => void} tell a field has changed @param {(azimuth: string) => void} turned an azimuth was chosen */
  constructor(prefix, tell, turned) {
    const {needed, optional} = specification.shapes.find((/** @type {any} */ each) => each.name === "mesh");
    /** Names of the texts that are set here. @type {string[]} */
    this.names = [needed[0], ...optional];
    /** Names of the files that are known, by their texts. @type {Record<string, string>} */
    this.files = Object.fromEntries(specification.meshes.map((/** @type {string} */ name) => [name, phrase("mesh.shipped", {name})]));
    this.file = choice(prefix, "mesh", parameter("mesh").label, Object.entries(this.files), tell);
    this.unit = choice(prefix, "unit", parameter("unit").label, [["", "m"], ...specification.mesh_units.filter((/** @type {string} */ each) => each !== "m").map((/** @type {string} */ each) => [each, each])], tell);
    this.up = choice(prefix, "up", parameter("up").label, UP, tell);
    /** @type {Record<string, HTMLInputElement>} */
    this.typed = {};
    const field = (/** @type {string} */ name, /** @type {string} */ hint) => {
      const id = prefix + name;
      const input = this.typed[name] = /** @type {HTMLInputElement} */ (make("input", {type: "text", id, placeholder: hint, "data-argument": name, on: {change: () => {
        if (name !== "density") input.value = typed(input.value); // commas part the densities of several bodies
        tell();
      }}}));
      return make("div", {className: "choice"}, [make("label", {className: "field", for: id}, [parameter(name).label]), input]);
    };
    this.more = make("details", {}, [make("summary", {}, [phrase("mesh.read")]), this.unit.element, this.up.element,
      field("density", phrase("mesh.same_density")), field("tolerance", phrase("mesh.thousandth"))]);
    this.element = make("div", {hidden: true}, [this.file.element, this.more]);
    this.asked = "";
    /** The body of the case that is shown. @type {any} */
    this.body = null;
    this.plan = prefix ? null : new Plan(turned);
    this.picture = make("div", {className: "body", hidden: true}, this.plan ? [this.plan.element] : []);
  }

  /** @param {Texts} texts */
  show(texts) {
    if (!texts.mesh) return;
    if (!Object.hasOwn(this.files, texts.mesh)) this.know(texts.mesh, phrase("mesh.linked"));
    this.file.select.value = texts.mesh;
    choose(this.unit.select, texts.unit ?? "");
    choose(this.up.select, texts.up ?? "");
    for (const [name, input] of Object.entries(this.typed)) if (!isTyped(input)) input.value = texts[name] ?? "";
  }

  /** @param {string} text @param {string} name */
  know(text, name) {
    this.files[text] = name;
    const {value} = this.file.select;
    offer(this.file.select, Object.entries(this.files));
    this.file.select.value = value;
  }

  /** Take a file that the server keeps; whether it is the one of the link that is open. @param {any} file @param {Texts} texts */
  take(file, texts) {
    const text = `file:${file.key}`, linked = texts.mesh === text;
    this.know(text, file.name);
    this.file.select.value = text;
    if (!linked) for (const input of [this.unit.select, this.up.select, ...Object.values(this.typed)]) input.value = "";
    return linked;
  }

  /** @returns {Texts} */
  texts() {
    const given = {mesh: this.file.select.value, up: this.up.select.value, unit: this.unit.select.value, ...Object.fromEntries(Object.entries(this.typed).map(([name, input]) => [name, input.value.trim()]))};
    return Object.fromEntries(Object.entries(given).filter(([, value]) => value));
  }

  /** Turn the picture, while a slider moves. @param {any} body */
  turn(body) {
    this.body = body;
    this.plan?.turn(body);
  }

  /** Learn what is said and drawn of the body that is shown, after a pause. @param {Texts} texts */
  async learn(texts) {
    if (!this.body || !this.plan) return;
    const asked = JSON.stringify(namesOf("block", "model").map((name) => texts[name]));
    if (asked === this.asked) return;
    const found = await payload("/api/body", texts);
    this.asked = asked;
    if (texts.mesh !== this.file.select.value) return;
    if (texts.mesh.startsWith("file:") && this.files[texts.mesh] !== found.header.name) this.know(texts.mesh, found.header.name);
    this.typed.density.title = phrase("mesh.parts", {names: found.header.parts.join(", ")});
    this.plan.draw(found);
    this.plan.turn(this.body);
  }
}
