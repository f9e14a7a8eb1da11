// The browser's history of the case: an entry for each change that somebody makes; all that a slider does before it is let
// go is one. What arrives meanwhile is written into the present entry.

/** How long after its last step a slider counts as moving, ms. */
export const STILL = 1000;

/** The number of the last change, and of the one that the present entry shows. */
let change = 0, written = 0;
let held = false, slid = -Infinity;

/** Somebody changes something, by other means than a field. */
export function begin() {
  change += 1;
  slid = -Infinity;
}

/** The page shows what the present entry says: nothing is under way. */
export function settle() { written = change; }

/** @returns {number} of the change that a slider makes at the moment, or 0 */
export const sliding = () => (performance.now() - slid < STILL ? change : 0);

/** @param {string} query of the address that shows what is shown now */
export function write(query) {
  if (`?${query}` === location.search) return;
  if (change === written) history.replaceState(null, "", `?${query}`);
  else history.pushState(null, "", `?${query}`);
  settle();
}

/** @param {Event} event */
const isSlider = ({target}) => target instanceof HTMLInputElement && target.type === "range" && target.id !== "scrub";

document.addEventListener("input", (event) => {
  if (!isSlider(event)) return;
  if (!held) begin();
  held = true;
  slid = performance.now();
}, true);
document.addEventListener("change", (event) => {
  if (!isSlider(event) && event.bubbles) begin(); // one that the page sends by itself does not bubble
  held = false;
}, true);
