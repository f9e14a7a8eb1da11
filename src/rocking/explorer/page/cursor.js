// The time that is read: by the pointer, by keys, by a slider or typed; what the case is then, from Python's series.

import {Latest, json} from "./api.js";
import {writeAddress} from "./parameters.js";
import {one, say} from "./words.js";
import {coarse} from "./theme.js";
import {decimals, fixed, short, typed} from "./numbers.js";
import {inWords, phrase} from "./texts.js";
import {ofG} from "./units.js";

/** How long the time must stay before it is read from the response, and before it is spoken, ms. */
const STILL = 60, QUIET = 600;
/** Steps of the slider, and those of a key with Shift, across the window. */
const STEPS = 1000, KEYS = 200;

export class Cursor {
  /** @param {any} page @param {{mark: (time: number | null) => void, seek: (time: number) => void}} tell */
  constructor(page, tell) {
    this.page = page;
    this.tell = tell;
    this.field = /** @type {HTMLInputElement} */ (one("at"));
    this.slider = /** @type {HTMLInputElement} */ (one("at-slider"));
    this.still = this.quiet = 0;
    /** Whether what is read shall be spoken. */
    this.spoken = false;
    /** Whether somebody types in the field, which then stays as it is. */
    this.typing = false;
    /** What was asked for last; an answer to anything else comes too late. @type {{text: string} | null} */
    this.asked = null;
    this.latest = new Latest((asked) => this.read(asked), (error) => page.problem(error, "reading"));
    this.slider.addEventListener("input", () => this.set(this.left() + (Number(this.slider.value) / STEPS) * this.width()));
    this.field.addEventListener("input", () => { this.typing = true; });
    for (const end of ["change", "blur"]) this.field.addEventListener(end, () => { this.typing = false; });
    this.field.addEventListener("change", () => this.typed());
    one("histories").addEventListener("keydown", (event) => this.key(event));
  }

  left() { return this.page.shown?.header.window.from ?? 0; }
  width() { return (this.page.shown?.header.window.to ?? 1) - this.left(); }

  /** Set the time, and let the block follow. @param {number} time */
  set(time) {
    const {header} = this.page.shown ?? {};
    if (!header) return;
    const kept = Math.min(Math.max(time, 0), header.duration);
    this.spoken = true;
    this.take(kept);
    this.tell.seek(kept);
  }

  /** The time is another one. @param {number} time */
  take(time) {
    this.page.state.at = time;
    writeAddress(this.page.state);
    this.show();
  }

  /** Mark the time that is set, and read it soon; nothing where none is, or where the response ends before. */
  show() {
    const {state: {at}, shown} = this.page;
    const known = at !== null && shown && at <= shown.header.duration;
    this.tell.mark(known ? at : null);
    window.clearTimeout(this.still);
    this.asked = null;
    this.page.problem(null, "reading"); // it was about another case, or another time
    const digits = decimals(this.width());
    if (!this.typing) this.field.value = at === null ? "" : at.toFixed(digits);
    if (!known) {
      this.slider.value = String(STEPS / 2);
      this.slider.removeAttribute("aria-valuetext");
      one("cursor").textContent = phrase(at !== null && shown ? "reading.late" : coarse() ? "reading.tap" : "reading.hint");
      return;
    }
    this.slider.value = String(Math.round((STEPS * (at - this.left())) / this.width()));
    this.slider.setAttribute("aria-valuetext", phrase("time.seconds", {time: fixed(at, digits)}));
    this.ask(String(at));
  }

  /** The pointer is at a time: read it without setting it. @param {number} time */
  hover(time) {
    if (!this.page.shown || time < 0 || time > this.page.shown.header.duration) return;
    this.tell.mark(time);
    this.ask(String(time));
  }

  /** @param {string} text */
  ask(text) {
    window.clearTimeout(this.still);
    window.clearTimeout(this.quiet); // else the last reading would be spoken for this one
    const asked = this.asked = {text};
    this.still = window.setTimeout(() => void this.latest.ask(asked), STILL);
  }

  /** A time was typed, with a unit or without. */
  async typed() {
    const text = typed(this.field.value);
    if (!text) {
      this.page.state.at = null;
      writeAddress(this.page.state);
      this.show();
      return;
    }
    if (!this.page.shown) return;
    const {at} = this.page.state;
    try {
      const {time} = await this.found(text);
      if (this.page.state.at !== at || typed(this.field.value) !== text) return; // another time was chosen meanwhile
      this.set(time);
    } catch (error) {
      this.page.problem(error, "reading");
    }
  }

  /** What the case is at a time. @param {string} at */
  found(at) {
    const {shown: {header: {window: {from, to}, duration}}, state: {good}} = this.page;
    const end = Math.min(to, duration) > from ? to : duration;
    return json("/api/at", {...good.texts, at, ...(end > from ? {from: String(from), to: String(end)} : {})});
  }

  /** @param {{text: string}} asked */
  async read(asked) {
    if (asked !== this.asked) return;
    const found = await this.found(asked.text).catch((error) => { if (asked === this.asked) throw error; });
    if (asked !== this.asked) return;
    const digits = decimals(this.width());
    const parts = [
      phrase("reading.rotation", {rotation: found.rotation, share: short(found.over_slenderness)}), phrase("reading.velocity", {velocity: short(found.velocity)}),
      ...(found.ground_g === null ? [] : [phrase("reading.ground", {acceleration: ofG(found.ground_g)})]),
      ...(found.vertical_g === null ? [] : [phrase("reading.upwards", {acceleration: ofG(found.vertical_g)})]),
      phrase("reading.energy", {energy: short(found.energy)}),
    ];
    const words = phrase("reading.is", {time: fixed(found.time, digits), state: inWords(found.state), parts: parts.join(", ")});
    one("cursor").textContent = words;
    one("cursor").dataset.time = String(found.time);
    if (this.spoken) this.quiet = window.setTimeout(() => { this.spoken = false; say(words); }, QUIET);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (!event.shiftKey || !["ArrowLeft", "ArrowRight"].includes(event.key)) return;
    event.preventDefault();
    const from = this.page.state.at ?? this.left() + 0.5 * this.width();
    this.set(from + ((event.key === "ArrowLeft" ? -1 : 1) * this.width()) / KEYS);
  }
}
