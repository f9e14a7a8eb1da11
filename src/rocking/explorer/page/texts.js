// Every text of the page by its key, in the language that the server chose: it stands in the page itself, so that nothing is
// ever shown without its words. The texts are in texts.json.

import {fixed, short} from "./numbers.js";

/** Something that the server says: a key, and what is put into its text. @typedef {{phrase: string, values: Record<string, any>}} Message */
/** @typedef {string | number | Message} Value */

/** How numbers of a kind are written in the units of the page, by the names of the kinds: units.js puts them here.
 * @type {Record<string, (value: number, digits?: number) => string>} */
export const measures = {};
/** @type {Record<string, string | Record<string, string>>} */
const texts = JSON.parse(document.getElementById("texts")?.textContent ?? "{}");
const plural = new Intl.PluralRules(document.documentElement.lang);

/** Whether there is such a text. @param {string} key */
export const known = (key) => Object.hasOwn(texts, key);

/** A value as it is written in a text: `.2f` is a number with two decimals, `.3g` one of three digits, `.4angle` a quantity of
 * four digits with its unit, and without any of these a count. @param {Value} value @param {string} [digits] @param {string} [kind] */
function written(value, digits, kind) {
  if (typeof value !== "number") return inWords(value);
  if (kind && Object.hasOwn(measures, kind)) return measures[kind](value, digits ? Number(digits) : undefined);
  return kind === "g" ? short(value, Number(digits || 6)) : fixed(value, Number(digits || 0));
}

/** A text, with values at its places. Of several forms it is the one of exactly this count, or of its kind of plural.
 * @param {string} key @param {Record<string, Value>} [values] @returns {string} */
export function phrase(key, values = {}) {
  const found = texts[key] ?? key, count = Number(values.count);
  const form = typeof found === "string" ? found : found[String(count)] ?? found[plural.select(count)] ?? found.other;
  return form.replace(/\{(\w+)(?::\.?(\d*)([a-z]+))?\}/g, (_, name, digits, kind) => written(values[name], digits, kind));
}

/** What the server says, in the page's language; a sentence of the package itself stays as it is. @param {Exclude<Value, number>} said */
export const inWords = (said) => (typeof said === "string" ? said : phrase(said.phrase, said.values));
