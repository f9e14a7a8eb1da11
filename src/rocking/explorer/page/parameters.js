// What the server says about the parameters of a case: the address and the forms are built from it.

import {json} from "./api.js";

/** @typedef {{name: string, label: string, group: string, unit: string, suffix: string, default: string, low: number, high: number, logarithmic: boolean, values: string, explanation: string}} Parameter */

/** @type {any} */
export const specification = await json("/api/start", {});

/** @param {string} name @returns {Parameter} */
export const parameter = (name) => specification.parameters.find((/** @type {Parameter} */ each) => each.name === name);

/** Names of the texts of a case, of some groups or of all. @param {string[]} groups @returns {string[]} */
export const namesOf = (...groups) =>
  specification.parameters.filter((/** @type {Parameter} */ each) => !groups.length || groups.includes(each.group)).map((/** @type {Parameter} */ each) => each.name);
