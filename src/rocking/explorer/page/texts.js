// Texts of the page by their keys.

import {fixed} from "./numbers.js";

/** @type {Record<string, string>} */
const texts = JSON.parse(document.getElementById("texts")?.textContent ?? "{}");

/** Whether there is such a text. @param {string} key */
export const known = (key) => Object.hasOwn(texts, key);

/** A text, or its key if there is none. @param {string} key */
export const phrase = (key) => texts[key] ?? key;

/** Label of an axis. @param {{name: string, label?: string}} axis */
export const labelOf = ({name, label}) => label ?? phrase(`axis.${name}`);

/** A count with its noun. @param {number} count @param {string} noun */
export const counted = (count, noun) => `${fixed(count, 0)} ${noun}${count === 1 ? "" : "s"}`;
