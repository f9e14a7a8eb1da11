// What has the keys is seen: neither the header covers it nor what lies over the foot of the page; and an action that
// hides it hands the keys on.

import {one} from "./words.js";

const FIXED = "header, .settings, .to-settings";

/** Show all of what has the keys, where it is not itself one of the bars. @param {FocusEvent} event */
function reveal({target}) {
  if (!(target instanceof Element) || !target.matches(":focus-visible") || target.closest(FIXED)) return;
  const top = Math.max(0, /** @type {HTMLElement} */ (document.querySelector("header")).getBoundingClientRect().bottom);
  const bars = ["settings", "to-settings"].map(one).filter((each) => getComputedStyle(each).position === "fixed" && each.checkVisibility());
  const foot = Math.min(innerHeight, ...bars.map((each) => each.getBoundingClientRect().top));
  const box = target.getBoundingClientRect();
  // Of what is larger than the page between the bars its start is shown.
  if (box.top < top || box.height > foot - top) window.scrollBy({top: box.top - top - 8, behavior: "instant"});
  else if (box.bottom > foot) window.scrollBy({top: box.bottom - foot + 8, behavior: "instant"});
}

document.addEventListener("focusin", reveal);

/** Do what may hide the element that has the keys; where it does, they go to another one.
 * @param {() => void} act @param {() => HTMLElement | null} next */
export function keepingFocus(act, next) {
  const before = document.activeElement;
  act();
  if (before && before !== document.body && !before.checkVisibility()) next()?.focus({preventScroll: true});
}

/** Make controls anew. What had the keys among them has them again, or, where it is gone, what stands in its place.
 * @param {HTMLElement} around @param {() => void} act */
export function remaking(around, act) {
  const all = () => /** @type {HTMLElement[]} */ ([...around.querySelectorAll("button, input, select")]).filter((each) => each.checkVisibility() && !each.matches(":disabled"));
  const named = (/** @type {HTMLElement} */ each) => each.tagName + (each.getAttribute("aria-label") ?? each.textContent);
  const before = document.activeElement, place = all().findIndex((each) => each === before);
  act();
  if (place < 0 || document.activeElement === before) return;
  const after = all();
  (after.find((each) => named(each) === named(/** @type {HTMLElement} */ (before))) ?? after[Math.min(place, after.length - 1)])?.focus({preventScroll: true});
}

/** Let the keys go on at a picture, which takes them only once it is drawn; unless somebody takes them elsewhere meanwhile.
 * @param {HTMLElement} picture */
export function goOnAt(picture) {
  picture.focus({preventScroll: true});
  if (!picture.inert) return;
  const before = document.activeElement;
  const drawn = new MutationObserver(() => {
    if (picture.inert) return;
    drawn.disconnect();
    if (document.activeElement === before) picture.focus({preventScroll: true});
  });
  drawn.observe(picture, {attributeFilter: ["inert"]});
}
