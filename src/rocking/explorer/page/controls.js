// Choices of a form: one of several, and yes or no.

import {make} from "./words.js";

/** @param {string} prefix @param {string} name @param {string} label @param {string[][]} options values and labels @param {(value: string) => void} changed */
export function choice(prefix, name, label, options, changed) {
  const id = prefix + name;
  const select = /** @type {HTMLSelectElement} */ (make("select", {id, "data-argument": name, on: {change: () => changed(select.value)}}));
  const element = make("div", {className: "choice"}, [make("label", {className: "field", for: id}, [label]), select]);
  offer(select, options);
  return {select, element};
}

/** @param {HTMLSelectElement} select @param {string[][]} options values and labels */
export const offer = (select, options) => select.replaceChildren(...options.map(([value, text]) => make("option", {value}, [text])));

/** Show what an address says, also where that is not among what is offered. @param {HTMLSelectElement} select @param {string} value */
export function choose(select, value) {
  if (![...select.options].some((each) => each.value === value)) select.append(make("option", {value}, [value]));
  select.value = value;
}

/** The field in which somebody types, until that counts. @type {EventTarget | null} */
let typing = null;
document.addEventListener("input", ({target}) => { typing = target; }, true);
for (const end of ["change", "blur"]) document.addEventListener(end, () => { typing = null; }, true);

/** Whether somebody types in a field: what arrives meanwhile leaves it as it is. @param {HTMLElement} field */
export const isTyped = (field) => field === typing;

/** @param {string} id @param {string} label @param {() => void} changed */
export function check(id, label, changed) {
  const box = /** @type {HTMLInputElement} */ (make("input", {type: "checkbox", id, on: {change: changed}}));
  return {box, element: make("label", {className: "check"}, [box, ` ${label}`])};
}
