// Elements of the page.

/** @param {string} id @returns {any} */
export const one = (id) => document.getElementById(id);

/** @param {Element} element @param {Record<string, any>} given */
export function put(element, given) {
  for (const [name, value] of Object.entries(given)) {
    if (name === "on") for (const [event, act] of Object.entries(value)) element.addEventListener(event, /** @type {any} */ (act));
    else if (value === null || value === false) element.removeAttribute(name);
    else element.setAttribute(name, String(value));
  }
  return element;
}

/** @param {Element} element @param {Record<string, any>} given @param {(Node | string)[]} inside @returns {any} */
function fill(element, given, inside) {
  put(element, given).append(...inside);
  return element;
}

/** @param {string} name @param {Record<string, any>} [given] @param {(Node | string)[]} [inside] */
export const make = (name, given = {}, inside = []) => fill(document.createElement(name), given, inside);
/** @param {string} name @param {Record<string, any>} [given] @param {(Node | string)[]} [inside] */
export const draw = (name, given = {}, inside = []) => fill(document.createElementNS("http://www.w3.org/2000/svg", name), given, inside);

/** Drag with the pointer: `begin` returns what is needed while it moves, or nothing to let it pass.
 * @template T @param {Element} element @param {(event: PointerEvent) => T | undefined} begin @param {(event: PointerEvent, context: T) => void} move @param {(context: T) => void} [end] */
export function dragged(element, begin, move, end) {
  element.addEventListener("pointerdown", (event) => {
    const down = /** @type {PointerEvent} */ (event), context = down.button === 0 ? begin(down) : undefined;
    if (context === undefined) return;
    down.preventDefault();
    down.stopPropagation();
    element.setPointerCapture(down.pointerId);
    const onMove = (/** @type {Event} */ each) => move(/** @type {PointerEvent} */ (each), context);
    const onEnd = () => {
      for (const [name, act] of handlers) element.removeEventListener(name, act);
      end?.(context);
    };
    const handlers = /** @type {[string, any][]} */ ([["pointermove", onMove], ["pointerup", onEnd], ["pointercancel", onEnd]]);
    for (const [name, act] of handlers) element.addEventListener(name, act);
  });
}

/** Path through points. @param {ArrayLike<number>} x @param {ArrayLike<number>} y */
export function line(x, y) {
  let text = "";
  for (let k = 0; k < x.length; k += 1) text += `${k ? "L" : "M"}${x[k].toFixed(1)} ${y[k].toFixed(1)}`;
  return text;
}

/** Round steps of an axis: at most so many up to a number. @param {number} size @param {number} most */
export function stepOf(size, most) {
  const wanted = size / most, power = 10 ** Math.floor(Math.log10(wanted));
  return power * ([1, 2, 5, 10].find((each) => each * power >= wanted * (1 - 1e-9)) ?? 10);
}
