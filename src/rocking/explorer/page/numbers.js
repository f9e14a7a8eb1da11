// Numbers for people: shown as the browser's locale writes them, and read as people type them. What is copied into programs,
// and what fields and the address hold, has a decimal point everywhere.

const LOCALE = locale(navigator.language);

/** The browser's locale, or that of the page where it is none, as "C" of a system without a language.
 * @param {string} given */
function locale(given) {
  try { return Intl.getCanonicalLocales(given)[0]; } catch { return document.documentElement.lang; }
}

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
/** A power of ten, as it stands behind a number. @param {number} exponent */
export const power = (exponent) => `·10${exponent < 0 ? "⁻" : ""}${[...String(Math.abs(exponent))].map((each) => RAISED[Number(each)]).join("")}`;

/** What stands where there is no number. */
export const NONE = "–";
/** Formats by their options, which take long to make. @type {Map<string, Intl.NumberFormat>} */
const formats = new Map();

/** @param {"significant" | "fixed"} kind @param {number} digits @param {number} value */
function formatted(kind, digits, value) {
  const key = kind + digits;
  let format = formats.get(key);
  if (!format) {
    format = new Intl.NumberFormat(LOCALE, kind === "significant" ? {maximumSignificantDigits: digits} : {minimumFractionDigits: digits, maximumFractionDigits: digits});
    formats.set(key, format);
  }
  return format.format(value).replace("-", "−");
}

/** A number to so many digits, without needless zeros and with a real minus. @param {number} value @param {number} [digits] */
export function short(value, digits = 3) {
  if (!Number.isFinite(value)) return NONE;
  const size = Math.abs(value);
  if (size === 0 || (size >= 1e-4 && size < 1e6)) return formatted("significant", digits, value || 0);
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${formatted("significant", digits, Number(mantissa))}${power(Number(exponent))}`;
}

/** A value of an axis, to so many digits that it is told from those beside it. @param {number[]} values @param {number} k */
export function amongst(values, k) {
  const step = Math.min(...[values[k - 1], values[k + 1]].filter((each) => each !== undefined).map((each) => Math.abs(each - values[k])));
  return short(values[k], Math.min(15, 3 + Math.max(0, Math.ceil(Math.log10(Math.abs(values[k]) / step)) - 2)));
}

/** A number with so many decimals, or a dash where there is none. @param {number | null | undefined} value @param {number} digits */
export const fixed = (value, digits) => (Number.isFinite(value) ? formatted("fixed", digits, /** @type {number} */ (value)) : NONE);

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

/** What parts thousands in the browser's locale. */
const GROUP = new Intl.NumberFormat(LOCALE, {useGrouping: true}).formatToParts(1234567).find(({type}) => type === "group")?.value ?? "";

/** A typed text whose number has a decimal point: a comma is one, too, unless thousands are parted by it. What is no number
 * stays as it is, for Python to refuse. @param {string} given */
export function typed(given) {
  const text = given.trim().replace("−", "-");
  const [, number = "", rest = ""] = /^([+-]?[\d.,\s]*\d[.,]?)(.*)$/.exec(text) ?? [];
  const thousands = /^[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?$/.test(number), points = /^[+-]?[1-9]\d{0,2}(?:\.\d{3})+,\d*$/.test(number);
  if (points) return number.replaceAll(".", "").replace(",", ".") + rest;
  if (thousands && (GROUP === "," || number.includes(".") || number.split(",").length > 2)) return number.replaceAll(",", "") + rest;
  return /^[+-]?\d*,\d*$/.test(number) ? number.replace(",", ".") + rest : text;
}

const UNITS = /** @type {[number, string][]} */ ([[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"], [1e-12, "ps"]]);

/** A short time with its unit. @param {number} seconds */
export function span(seconds) {
  if (seconds === 0) return "0 s";
  const [unit, name] = UNITS.find(([each]) => Math.abs(seconds) >= 0.9995 * each) ?? UNITS[UNITS.length - 1];
  return `${short(seconds / unit)} ${name}`;
}

/** A number with its unit, if it has one. @param {string} number @param {string} unit */
export const joined = (number, unit) => (/^(?:[° ]|$)/.test(unit) ? `${number}${unit}` : `${number} ${unit}`);

/** Decimals of times in a window of this width. @param {number} width */
export const decimals = (width) => Math.min(15, Math.max(2, 3 - Math.floor(Math.log10(width))));
