// Sentences of the server by their keys, with numbers in the locale and in the units of the page.

import {fixed, short} from "./numbers.js";

/** Something that the server says: a key, and the values in its text. @typedef {{phrase: string, values: Record<string, any>}} Message */

/** How quantities are written in the units of the page, by kind; units.js sets them. @type {Record<string, (value: number, digits?: number) => string>} */
export const measures = {};
/** @type {Record<string, string>} */
const texts = JSON.parse(document.getElementById("texts")?.textContent ?? "{}");

/** Whether there is such a text. @param {string} key */
export const known = (key) => Object.hasOwn(texts, key);

/** A value in a text: `.2f` is a number with two decimals, `.3g` one of three digits, `.4angle` a quantity of four digits with
 * its unit, and without these a count. @param {any} value @param {string} [digits] @param {string} [kind] @returns {string} */
function written(value, digits, kind) {
  if (typeof value !== "number") return say(value);
  if (kind && Object.hasOwn(measures, kind)) return measures[kind](value, digits ? Number(digits) : undefined);
  return kind === "g" ? short(value, Number(digits || 6)) : fixed(value, Number(digits || 0));
}

/** A text with its values. @param {string} key @param {Record<string, any>} [values] @returns {string} */
export const phrase = (key, values = {}) => (texts[key] ?? key).replace(/\{(\w+)(?::\.?(\d*)([a-z]+))?\}/g, (_, name, digits, kind) => written(values[name], digits, kind));

/** What the server says; a sentence of the package stays as it is. @param {string | Message | null} said */
export const say = (said) => (said === null ? "–" : typeof said === "string" ? said : phrase(said.phrase, said.values));

/** A count with its noun. @param {number} count @param {string} noun */
export const counted = (count, noun) => `${fixed(count, 0)} ${noun}${count === 1 ? "" : "s"}`;
