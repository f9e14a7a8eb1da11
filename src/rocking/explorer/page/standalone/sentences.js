// What the page says of a case.

import {GRAVITY} from "./kernels.js";
import {fixed, short} from "../numbers.js";

/** @param {number} value in m/s² */
const inG = (value) => `${short(value / GRAVITY, 4)} g`;

/** Whether it falls, as five runs within three millionths decide. @param {any} shown */
export function headline({falling, runs}) {
  if (falling === 0) return "It stands.";
  return falling === runs ? "It falls." : `Undecided: it falls in ${falling} of ${runs} runs within three millionths.`;
}

/** How far it is from the other outcome. @param {any} shown @param {number | null | undefined} critical in m/s² */
export function margin({given, falling, runs}, critical) {
  if (critical === undefined || given.tilt) return "";
  if (critical === null) return "No amplitude up to 20 times that of uplift overturns it.";
  const away = critical / given.amplitude - 1, text = `Smallest amplitude that overturns it: ${inG(critical)}`;
  if (falling === 0 && away <= 0) return `${text}. At some larger ones, as here, it stands.`;
  if (falling && falling < runs) return `${text}.`;
  return `${text}, ${short(Math.abs(100 * away), 2)} % ${away > 0 ? "more" : "less"} than here.`;
}

/** The moments in words: three sentences at most. @param {any} shown @returns {{time: number, words: string}[]} */
export function reasons({moments, overturned, uplift, given, peak, body, impacts, picture}) {
  const found = (/** @type {string} */ kind) => moments.find((/** @type {any} */ each) => each.kind === kind);
  const lift = found("lift"), list = [], alpha = Math.max(...body.sides.map((/** @type {any} */ side) => side.alpha));
  if (lift) list.push({time: lift.time, words: `It lifts, because the ground acceleration exceeds ${inG(uplift)}${given.offset ? "" : given.model === "linear" ? ", its slenderness" : ", its width divided by its height"}.`});
  if (!lift && !given.tilt) return [{time: 0, words: `It does not move, because the acceleration stays below ${inG(uplift)}.`}];
  if (given.tilt) list.push({time: 0, words: `It is let go at a tilt of ${short((100 * Math.abs(given.tilt)) / alpha, 3)} % of its balance.`});
  if (!overturned) {
    const top = found("peak"), rest = found("rest");
    if (top && !given.tilt) list.push({time: top.time, words: `It turns the most: ${short((100 * peak) / alpha)} % of the way to its balance.`});
    if (rest) list.push({time: rest.time, words: given.threshold === null
      ? `It rests again. ${impacts} impacts were computed one by one; the others follow in a time that is proven to be finite.` : `It rests again after ${impacts} impacts, because it is slower than the threshold.`});
    return list;
  }
  const gone = found("gone"), balance = found("balance"), flat = found("flat");
  if (gone) list.push({time: gone.time, words: "From here on it falls, even if the ground stops."});
  if (balance) list.push({time: balance.time, words: "Its mass passes over the corner: beyond this balance, its weight overturns it."});
  else if (flat) list.push({time: flat.time, words: "It lies flat."});
  return picture ? list.slice(0, 3) : [];
}

/** The picture in words, for those who listen. @param {any} shown @param {number} time @param {number} rotation */
export function described({given: {width, height}}, time, rotation) {
  return `A block of ${short(width)} m by ${short(height)} m at ${fixed(time, 2)} s, turned by ${fixed((180 * rotation) / Math.PI, 1)} degrees.`;
}
