// What workers compute: parts of a map, and critical amplitudes.

import {openKernels} from "./kernels.js";
import {bodyOf, shakingOf} from "./motions.js";
import {criticalOf} from "./response.js";

/** Value of a block that overturns, and of one that rocks on for more than half a period. */
export const FALLS = 2, ROCKS = 1;

/** One column of a map, at these amplitudes: the largest rotation in units of the slenderness or, under sines, whether the first rest
 * comes within half a period of the first uplift.
 * @param {import("./kernels.js").Kernels} kernels @param {import("./motions.js").Case} given @param {number[]} amplitudes @param {boolean} rests */
function column(kernels, given, amplitudes, rests) {
  const body = bodyOf(given, kernels.exports), {pieces} = shakingOf(given), alpha = Math.max(...body.sides.map((side) => side.alpha));
  return amplitudes.map((factor) => {
    const {overturned, peak, firstUplift, firstRest} = kernels.march(body, {pieces, factor});
    if (overturned) return FALLS;
    return rests ? Number(peak > 0 && !(firstRest > 0 && firstRest - firstUplift < 0.5 / given.rate)) * ROCKS : Math.min(1.5, peak / alpha);
  });
}

/** @type {Record<string, (kernels: import("./kernels.js").Kernels, job: any) => any>} */
export const JOBS = {
  column: (kernels, {given, amplitudes, rests}) => column(kernels, given, amplitudes, rests),
  critical: (kernels, {given}) => criticalOf(kernels, given),
};

/** Answer messages, as a worker does. */
export function serve() {
  const opened = openKernels();
  onmessage = async ({data}) => postMessage(JOBS[data.kind](await opened, data));
}
