// Numbers and texts for people.

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

/** A number to so many digits, without needless zeros and with a real minus. @param {number} value @param {number} [digits] */
export function short(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-4 || size >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

/** A number as its field shows it; its text is sent whole. @param {number} value */
export const shown = (value) => String(Number(value.toPrecision(4)));

/** A number that was computed, without the last digits, which the computation rounds. @param {number} value */
export const whole = (value) => String(Number(value.toPrecision(15)));

const WRITTEN = /^\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(\D.*?)?\s*$/i;

/** The number of a text with one of these units, in the unit that is shown; NaN where there is none. Units are spelled as
 * the command line reads them. @param {string} text @param {Record<string, number>} units */
export function measured(text, units) {
  const [, number, spelling = ""] = WRITTEN.exec(text) ?? [];
  const plain = spelling.toLowerCase().replaceAll("²", "2").replaceAll("⁻", "-").replace(/[\s^*._/·'’]/g, "").replaceAll("sec", "s").replaceAll("s-2", "s2");
  return number !== undefined && Object.hasOwn(units, plain) ? Number(number) * units[plain] : NaN;
}

/** A number with so many decimals, or a dash where there is none. @param {number | null | undefined} value @param {number} digits */
export const fixed = (value, digits) => (Number.isFinite(value) ? /** @type {number} */ (value).toFixed(digits) : "–");

const UNITS = /** @type {[number, string][]} */ ([[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"], [1e-12, "ps"]]);

/** A short time with its unit. @param {number} seconds */
export function span(seconds) {
  if (seconds === 0) return "0 s";
  const [unit, name] = UNITS.find(([each]) => Math.abs(seconds) >= 0.9995 * each) ?? UNITS[UNITS.length - 1];
  return `${short(seconds / unit)} ${name}`;
}

/** Decimals of times in a window of this width. @param {number} width */
export const decimals = (width) => Math.min(15, Math.max(2, 3 - Math.floor(Math.log10(width))));

/** Count on the page how often something was done, for those who wait for it. @param {string} name */
export function counted(name) {
  const {dataset} = document.body;
  dataset[name] = String(Number(dataset[name] ?? 0) + 1);
}

/** A name as part of a file's. @param {string} name */
export const slug = (name) => name.replace(/[^\p{L}\d.]+/gu, "-").slice(0, 60);

/** Say something to those who listen. @param {string} text */
export function say(text) { one("said").textContent = text; }

/** A "?" that opens an explanation. @param {string} words @param {string} about */
export function explained(words, about) {
  const text = make("p", {className: "words", hidden: true}, [words]);
  const button = make("button", {
    type: "button", className: "what", "aria-expanded": "false", "aria-label": `What is ${about}?`,
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
