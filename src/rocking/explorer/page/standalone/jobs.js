// What workers compute: parts of a map, and critical amplitudes.

import {openKernels} from "./kernels.js";
import {bodyOf, shakingOf} from "./motions.js";
import {criticalOf, respond} from "./response.js";

/** Largest rotation in units of the slenderness at each amplitude, 2 where the block overturns: one column of a map.
 * @param {import("./kernels.js").Kernels} kernels @param {import("./motions.js").Case} given @param {number[]} amplitudes */
function column(kernels, given, amplitudes) {
  const body = bodyOf(given, kernels.exports), {pieces} = shakingOf(given), alpha = Math.max(...body.sides.map((side) => side.alpha));
  return amplitudes.map((factor) => { const {overturned, peak} = kernels.march(body, {pieces, factor}); return overturned ? 2 : Math.min(1.5, peak / alpha); });
}

/** @type {Record<string, (kernels: import("./kernels.js").Kernels, job: any) => any>} */
export const JOBS = {
  column: (kernels, {given, amplitudes}) => column(kernels, given, amplitudes),
  critical: (kernels, {given}) => criticalOf(kernels, given),
  respond: (kernels, {given}) => respond(kernels, given),
};

/** Answer messages, as a worker does. */
export async function serve() {
  const kernels = await openKernels();
  onmessage = ({data: {id, job}}) => postMessage({id, result: JOBS[job.kind](kernels, job)});
  postMessage({id: -1});
}
