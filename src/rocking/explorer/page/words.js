// Elements of the page, and what is said in them.

import {phrase} from "./texts.js";

/** @template {HTMLElement} T @param {string} id @returns {T} */
export const one = (id) => /** @type {T} */ (document.getElementById(id));

/** @param {string} name @param {Record<string, any>} [given] @param {(Node | string)[]} [inside] */
export function make(name, given = {}, inside = []) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(given)) {
    if (key === "on") for (const [event, act] of Object.entries(value)) made.addEventListener(event, /** @type {any} */ (act));
    else if (/^(aria-|data-|for$|role$)/.test(key)) made.setAttribute(key, value);
    else /** @type {any} */ (made)[key] = value;
  }
  made.append(...inside);
  return made;
}

/** Count on the page how often something was done, for those who wait for it. @param {string} name */
export function counted(name) {
  const {dataset} = document.body;
  dataset[name] = String(Number(dataset[name] ?? 0) + 1);
}

/** Write a text where it is another one; a number and its unit are not parted at the end of a line.
 * @param {Node} node @param {string} text */
export function tell(node, text) {
  const whole = text.replace(/(\d) (?=[%°a-zα-ωµH])/g, "$1\u00a0");
  if (node.textContent !== whole) node.textContent = whole;
}

/** A text as a cell of a table: a spreadsheet takes none for a formula. @param {string} text */
export const textCell = (text) => `"${text.replace(/^(?=[=+\-@\t\r])/, "'").replaceAll('"', '""')}"`;

/** A name as part of a file's. @param {string} name */
export const slug = (name) => name.replace(/[^\p{L}\d.]+/gu, "-").slice(0, 60);

/** Say something to those who listen. @param {string} text */
export function say(text) { one("said").textContent = text; }

/** A "?" that opens an explanation. @param {string} words @param {string} about */
export function explained(words, about) {
  const text = make("p", {className: "words", hidden: true}, [words]);
  const button = make("button", {
    type: "button", className: "what", "aria-expanded": "false", "aria-label": phrase("form.what", {what: about}),
    on: {click: () => { text.hidden = !text.hidden; button.setAttribute("aria-expanded", String(!text.hidden)); }},
  }, ["?"]);
  return [button, text];
}

/** @param {string} id @param {string[][]} entries kinds of marks, and what they mean */
export function legend(id, entries) {
  one(id).replaceChildren(...entries.map(([kind, words]) => make("span", {}, [make("i", {className: `key ${kind}`}), words])));
}

/** @param {HTMLTableElement} table @param {string[]} head @param {(string | Node)[][]} rows */
export function fill(table, head, rows) {
  table.replaceChildren(
    ...(head.length ? [make("thead", {}, [make("tr", {}, head.map((name) => (name ? make("th", {scope: "col"}, [name]) : make("td"))))])] : []),
    make("tbody", {}, rows.map((row) => make("tr", {}, row.map((cell) => make("td", {}, [cell]))))),
  );
}
