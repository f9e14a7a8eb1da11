// Colours of maps: one for each outcome, the same on light and dark paper. Orange stands for overturning, whatever the map shows,
// and for nothing else. More outcomes than four cannot all differ by 3:1, so a line parts neighbours that do not.

import {phrase} from "./texts.js";

/** No uplift, complete chattering, rests later, rests at last, overturns, unproven. */
export const OUTCOMES = ["#ffffff", "#c9dcf0", "#7fa3cf", "#1d3f73", "#d4660f", "#b0b0b0"];
export const OVERTURNS = OUTCOMES[4], UNKNOWN = OUTCOMES[5];
/** What overturns after a rest, as a mode. */
export const AFTER_REST = -4;
export const MODES = /** @type {[number, string, string][]} */ ([
  [-3, "#ffffff"], [-1, "#c9dcf0"], [-2, "#7fa3cf"], [0, "#5e2404"], [1, "#b0480a"], [2, "#f08c2e"], [AFTER_REST, "#ffc58a"],
].map(([value, ink]) => [value, phrase(`mode.${value}`), ink]));
/** Whether a block of a study overturns, or what is known of it. */
export const VERDICTS = /** @type {[number, string, string][]} */ ([[0, "#c9dcf0"], [1, OVERTURNS], [-1, UNKNOWN]].map(([value, ink]) => [value, phrase(`overturned.${value}`), ink]));
/** Stripes over what overturns later than in the first rocking: on light colours, and on dark ones. */
export const STRIPES = ["#8a3405", "#ffb366"];
/** Dark to light, even steps of lightness. */
export const RAMP = ["#0b1a3a", "#14346b", "#1f5190", "#3a74a8", "#5f97b8", "#8bb8c6", "#b9d6d4", "#e6efe4", "#fdf3d6"];
/** Lines that part two colours; curves and marks on a map, with what is around them. */
export const LINES = ["#000000", "#ffffff"];
export const MARK = "#10243e", AROUND = "#ffffff";

/** Least contrast of two colours beside each other. */
const CONTRAST = 3;
/** Points of a picture at most: painting takes little from computing. */
const MOST = 1_500_000;

/** Colour as the image takes it: red in the lowest byte. @param {string} ink */
export function rgba(ink) {
  const number = parseInt(ink.slice(1), 16);
  return ((0xff << 24) | ((number & 0xff) << 16) | (number & 0xff00) | (number >> 16)) >>> 0;
}

/** Relative luminance of a colour as the image takes it (WCAG 2.2). @param {number} ink */
function luminance(ink) {
  const [red, green, blue] = [ink & 0xff, (ink >> 8) & 0xff, (ink >> 16) & 0xff].map((each) => {
    const part = each / 255;
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4;
  });
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
}

/** @param {number} first @param {number} second luminances */
const contrast = (first, second) => (Math.max(first, second) + 0.05) / (Math.min(first, second) + 0.05);

/** The line between two colours, or 0 where they need none. @param {number} first @param {number} second */
export function between(first, second) {
  const [one_, other] = [luminance(first), luminance(second)];
  if (contrast(one_, other) >= CONTRAST) return 0;
  const [dark, light] = LINES.map(rgba);
  return Math.min(one_, other) + 0.05 >= CONTRAST * 0.05 ? dark : light;
}

/** Colour of the stripes over a colour. @param {number} ink */
export const stripe = (ink) => rgba(STRIPES[luminance(ink) > 0.3 ? 0 : 1]);

/** Whether a point lies on a stripe of a hatch. @param {number} k @param {number} columns */
const striped = (k, columns) => (Math.floor(k / columns) + (k % columns)) % 4 === 0;

/** Ends of the cells about values, midway between neighbours: what lies in a cell is nearest to its value.
 * @param {number[]} values @returns {number[]} */
export function cellEdges(values) {
  const last = values.length - 1, middles = values.slice(1).map((each, k) => 0.5 * (each + values[k]));
  return [2 * values[0] - middles[0], ...middles, 2 * values[last] - middles[last - 1]];
}

/** The same ends in pixels of a picture: cells as wide as each other have the same number of these, others share what there are on the
 * screen. @param {number[]} edges @param {number} size pixels of one of even cells @param {number} most pixels at most where they are uneven */
function inPixels(edges, size, most) {
  const count = edges.length - 1, whole = edges[count] - edges[0];
  const even = edges.every((each, k) => Math.abs(count * (each - edges[0]) - k * whole) < 1e-3 * whole);
  const pixels = even ? count * size : Math.max(count, Math.floor(most));
  return edges.map((each) => Math.round((pixels * (each - edges[0])) / whole));
}

/** A map's picture, in which every point has some pixels: with stripes, and with lines between outcomes of low contrast.
 * @param {Uint32Array} inks colour of every point, row by row @param {{x: number[], y: number[]}} edges ends of the cells @param {[number, number]} screen
 * its pixels to the right and upwards @param {Set<number>} kinds colours that stand for an outcome @param {boolean[] | null} hatched
 * @returns {{colours: Uint32Array, shape: [number, number]}} */
export function picture(inks, {x, y}, screen, kinds, hatched) {
  const columns = x.length - 1, rows = y.length - 1;
  const wanted = Math.round(screen[0] / columns), most = Math.floor(Math.sqrt(MOST / (rows * columns)));
  const size = Math.min(Math.max(wanted, 1), Math.max(most, 1), 8);
  const right = inPixels(x, size, Math.min(screen[0], MOST / (rows * size))), up = inPixels(y, size, Math.min(screen[1], MOST / (columns * size)));
  const across = right[columns], out = new Uint32Array(across * up[rows]);
  /** @type {Map<number, number>} */
  const known = new Map();
  /** @param {number} first @param {number} second */
  const line = (first, second) => {
    if (first === second || !first || !second || !(kinds.has(first) || kinds.has(second))) return 0;
    const key = first * 0x100000000 + second;
    let found = known.get(key);
    if (found === undefined) known.set(key, found = between(first, second));
    return found;
  };
  for (let row = 0; row < rows; row += 1) for (let column = 0; column < columns; column += 1) {
    const k = row * columns + column, ink = inks[k];
    const shown = hatched?.[k] && striped(k, columns) ? stripe(ink) : ink;
    const [left, end, bottom, top] = [right[column], right[column + 1], up[row], up[row + 1]];
    for (let r = bottom; r < top; r += 1) out.fill(shown, r * across + left, r * across + end);
    if (end - left < 2 || top - bottom < 2) continue;
    const beside = column + 1 < columns ? line(ink, inks[k + 1]) : 0, above = row + 1 < rows ? line(ink, inks[k + columns]) : 0;
    if (beside) for (let r = bottom; r < top; r += 1) out[r * across + end - 1] = beside;
    if (above) out.fill(above, (top - 1) * across + left, (top - 1) * across + end);
  }
  return {colours: out, shape: [up[rows], across]};
}
