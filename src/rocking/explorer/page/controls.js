// A number with a slider, a field, its unit and its explanation.

import {make, sent, what} from "./words.js";

/** @typedef {{name: string, label: string, unit: string, low: number, high: number, start: number, suffix: string, logarithmic: boolean, words: string}} Spec */

const STEPS = 1000;
const G = 9.80665;

export class NumberControl {
  /** @param {Spec} spec @param {(text: string) => void} changed @param {string} [prefix] */
  constructor(spec, changed, prefix = "") {
    this.spec = spec;
    this.text = "";
    this.changed = changed;
    const id = `${prefix}${spec.name}`;
    this.slider = /** @type {HTMLInputElement} */ (make("input", {
      type: "range", id: `${id}-slider`, min: "0", max: String(STEPS), step: "1", "aria-label": `${spec.label}, slider`,
      on: {input: () => this.slid()},
    }));
    this.field = /** @type {HTMLInputElement} */ (make("input", {
      type: "text", id, inputMode: "decimal", size: 6, on: {change: () => this.typed()},
    }));
    const unit = make("span", {className: "unit"}, [spec.unit]);
    const head = [make("label", {for: id}, [spec.label])];
    const [button, words] = spec.words ? what(spec.words, spec.label) : [];
    if (button) head.push(button);
    this.element = make("div", {className: "number"}, [
      make("div", {className: "number-head"}, head),
      make("div", {className: "number-body"}, [this.slider, this.field, unit]),
      ...(words ? [words] : []),
    ]);
    this.show(sent(spec.start) + spec.suffix);
  }

  /** Value in the control's unit of a text in any unit. @param {string} text */
  value(text) {
    const number = parseFloat(text);
    const plain = text.trim() !== "" && !Number.isNaN(Number(text));
    if (this.spec.suffix === "deg" && (plain || text.endsWith("rad"))) return (number * 180) / Math.PI;
    if (this.spec.suffix === "g" && (plain || /m\/s/.test(text))) return number / G;
    return number;
  }

  /** Show a text without telling anybody. @param {string} text */
  show(text) {
    this.text = text;
    const value = this.value(text);
    if (!Number.isFinite(value)) return;
    const {low, high, logarithmic, unit} = this.spec;
    const part = logarithmic ? Math.log(Math.max(value, 1e-300) / low) / Math.log(high / low) : (value - low) / (high - low);
    this.slider.value = String(Math.round(STEPS * Math.min(1, Math.max(0, part))));
    this.slider.setAttribute("aria-valuetext", `${sent(value)} ${unit}`.trim());
    this.field.value = sent(value);
  }

  slid() {
    const part = Number(this.slider.value) / STEPS;
    const {low, high, logarithmic, suffix} = this.spec;
    const value = logarithmic ? low * (high / low) ** part : low + part * (high - low);
    const text = String(Number(value.toPrecision(3))) + suffix;
    this.text = text;
    this.field.value = text.slice(0, text.length - suffix.length);
    this.slider.setAttribute("aria-valuetext", `${this.field.value} ${this.spec.unit}`.trim());
    this.changed(text);
  }

  typed() {
    const given = this.field.value.trim().replace("−", "-").replace(",", ".");
    const text = given !== "" && !Number.isNaN(Number(given)) ? given + this.spec.suffix : given;
    this.show(text);
    this.changed(text);
  }
}
