// The page: one case, its response, and the moment that is shown.

import {Scene} from "./scene.js";
import {Strip, linked} from "./strip.js";
import {MapView} from "./map.js";
import {Numbers} from "./fields.js";
import {Phase} from "./phase.js";
import {Tours} from "./tours.js";
import {Workers} from "./workers.js";
import {DATA, openKernels} from "./kernels.js";
import {limited, readAddress, writeCase} from "./case.js";
import {respond, upliftOf} from "./response.js";
import {described, headline, margin, reasons} from "./sentences.js";
import {one, put} from "./dom.js";
import {fixed} from "../numbers.js";

/** An address that asks for the outcome first, or that the explorer has printed. */
const ASKED = /[#&](ask=1\b|token=)/;
/** Pause before the address changes and slow parts are computed again, ms. */
const SETTLED = 200;
/** What is said before the first answer. */
const HINT = "Drag its top, its side, its mass or the pulse. Or tilt the block and let it go.";
const PANELS = ["numbers", "map", "phase", "tours"];

class Page {
  /** @param {import("./kernels.js").Kernels} kernels */
  constructor(kernels) {
    this.kernels = kernels;
    const {given, wrong} = readAddress(location.hash.slice(1));
    this.given = given;
    this.wrong = wrong;
    this.answered = location.hash.length > 1 && !ASKED.test(location.hash);
    this.time = 0;
    this.playing = false;
    /** @type {any} */
    this.shown = null;
    /** @type {import("./motions.js").Case | null} */
    this.pending = null;
    this.workers = new Workers();
    this.scene = new Scene(this);
    this.strip = new Strip(this);
    this.panels = /** @type {Record<string, any>} */ ({numbers: new Numbers(this), map: new MapView(this), phase: new Phase(this), tours: new Tours(this)});
    one("play").addEventListener("click", () => this.toggle());
    for (const [id, guess] of /** @type {[string, boolean][]} */ ([["yes", true], ["no", false]])) {
      one(id).addEventListener("click", () => { this.guess = guess; this.play(); one("play").focus(); });
    }
    one("time").addEventListener("input", () => this.seek(this.shown.picture.from + (Number(/** @type {HTMLInputElement} */ (one("time")).value) / 1000) * (this.shown.picture.until - this.shown.picture.from)));
    for (const name of PANELS) {
      document.querySelector(`[data-panel=${name}]`)?.addEventListener("click", (event) => {
        this.open(this.panel === name ? null : name);
        if (this.panel && /** @type {MouseEvent} */ (event).detail === 0) /** @type {HTMLElement} */ (one("close")).focus(); // a key has opened it
      });
    }
    one("close").addEventListener("click", () => this.leave());
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => { if (location.hash.slice(1) !== this.written) this.show(location.hash, ASKED.test(location.hash)); });
    this.compute();
    this.settle();
    if (DATA.served) redeem().catch(() => {}); // the explorer says what is missing
    if (DATA.class && !this.answered) this.open("tours");
    document.body.dataset.ready = "1";
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.target instanceof HTMLElement && event.target.closest("input, select, textarea, button, a, summary, canvas")) {
      if (event.key === "Escape" && this.panel) this.leave();
      return;
    }
    if (event.key === " ") { event.preventDefault(); this.toggle(); }
    if (event.key === "Escape" && this.panel) this.leave();
  }

  /** Change some of the numbers. @param {Partial<import("./motions.js").Case>} patch */
  change(patch) {
    this.pending = limited({...(this.pending ?? this.given), ...patch});
    this.answered = true;
    this.wrong = [];
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.given = this.pending ?? this.given;
      this.pending = null;
      this.compute();
    });
  }

  /** Show the case of an address from its start. @param {string} address @param {boolean} asked whether its outcome is asked first */
  show(address, asked) {
    this.stop();
    Object.assign(this, readAddress(address.replace(/^#/, "")), {pending: null, answered: !asked});
    this.guess = undefined;
    this.time = 0;
    this.compute();
    this.settle();
  }

  compute() {
    const began = performance.now();
    this.shown = respond(this.kernels, this.given);
    this.shown.uplift = upliftOf(this.shown.body, this.kernels.exports);
    document.body.dataset.took = String(performance.now() - began);
    this.critical = undefined;
    this.time = Math.min(this.time, this.shown.picture.until);
    this.scene.fit();
    this.strip.fit();
    this.seek(this.time);
    this.tell();
    this.panels[this.panel ?? ""]?.update();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.settle(), SETTLED);
  }

  /** Compute what takes longer, and write the address. */
  async settle() {
    clearTimeout(this.timer);
    if (this.pending) return;
    const {given} = this;
    this.written = writeCase(given);
    if (DATA.served) put(one("more"), {href: `/?${this.written}`});
    if (this.answered) history.replaceState(null, "", `#${this.written}`);
    this.panels[this.panel ?? ""]?.settle?.();
    const critical = given.tilt || given.motion === "still" ? null : await this.workers.ask({kind: "critical", given});
    if (given !== this.given) return;
    this.critical = critical;
    this.tell();
    document.body.dataset.settled = String(Number(document.body.dataset.settled ?? 0) + 1);
  }

  /** Say what happens, once it was guessed or seen. */
  tell() {
    const open = this.answered;
    put(one("ask"), {hidden: open ? "" : null});
    one("answer").classList.toggle("waiting", !open);
    this.strip.svg.classList.toggle("waiting", !open);
    if (!open) { one("headline").textContent = HINT; one("why").replaceChildren(); return; }
    const falls = this.shown.falling > this.shown.runs / 2, verdict = headline(this.shown);
    const judged = this.guess === undefined ? "" : this.guess === falls ? "You were right. " : "You were wrong. ";
    const strong = document.createElement("strong");
    strong.textContent = `${judged}${verdict}`;
    strong.className = this.shown.falling ? "over" : "";
    one("headline").replaceChildren(strong, ` ${margin(this.shown, this.critical)}${this.wrong.length ? ` This page cannot show all of the address: ${this.wrong.join(", ")}.` : ""}`);
    one("why").replaceChildren(...linked(reasons(this.shown), (time) => { this.stop(); this.seek(time); }));
  }

  /** @param {number} time */
  seek(time) {
    const {times, rotation, velocity, displacement, from, until, ground} = this.shown.picture;
    this.time = Math.min(Math.max(time, from), until);
    const at = (/** @type {Float64Array} */ values, evenly = times) => {
      const place = (this.time - evenly[0]) / (evenly[1] - evenly[0]), k = Math.min(Math.max(Math.floor(place), 0), values.length - 2);
      return values[k] + (values[k + 1] - values[k]) * Math.min(Math.max(place - k, 0), 1);
    };
    this.scene.paint({rotation: at(rotation), velocity: at(velocity), acceleration: at(ground.acceleration, ground.times), displacement: at(displacement)}, this.time === from && !this.playing);
    this.strip.follow();
    this.panels[this.panel ?? ""]?.follow?.();
    const slider = /** @type {HTMLInputElement} */ (one("time")), said = `${fixed(this.time, 2)} s`;
    slider.value = String((1000 * (this.time - from)) / (until - from));
    slider.setAttribute("aria-valuetext", said);
    one("clock").textContent = said;
    if (!this.playing) one("described").textContent = described(this.shown, this.time, at(rotation));
  }

  /** Go to the start, where all can be dragged. */
  rewind() {
    this.stop();
    this.seek(this.shown.picture.from);
  }

  /** Let a tilted block go. */
  release() {
    this.answered = true;
    if (this.given.tilt) this.play();
  }

  toggle() { if (this.playing) this.stop(); else this.play(); }

  play() {
    if (this.time >= this.shown.picture.until - 1e-9 || !this.answered) this.time = this.shown.picture.from;
    this.playing = true;
    one("play").textContent = "Pause";
    put(one("ask"), {hidden: ""});
    let before = performance.now();
    const tick = (/** @type {number} */ now) => {
      if (!this.playing) return;
      const time = this.time + Math.min(0.1, Math.max(0, now - before) / 1000);
      before = now;
      this.seek(time);
      if (this.time >= this.shown.picture.until - 1e-9) {
        this.stop();
        this.answered = true;
        this.strip.paint();
        this.tell();
        document.body.dataset.played = String(Number(document.body.dataset.played ?? 0) + 1);
      } else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  stop() {
    this.playing = false;
    one("play").textContent = "Play";
  }

  /** Close the panel; the keyboard returns to the button that opened it. */
  leave() {
    const button = /** @type {HTMLElement | null} */ (document.querySelector(`[data-panel=${this.panel}]`));
    this.open(null);
    button?.focus();
  }

  /** @param {string | null} name */
  open(name) {
    this.panel = name;
    put(one("panel"), {hidden: name ? null : ""});
    document.body.classList.toggle("beside", Boolean(name));
    for (const each of PANELS) {
      put(one(each), {hidden: each === name ? null : ""});
      document.querySelector(`[data-panel=${each}]`)?.setAttribute("aria-expanded", String(each === name));
    }
    if (name) { this.panels[name].update(); this.panels[name].settle?.(); }
  }
}

/** Exchange the token of the explorer's link for its secret, which the storage of this origin keeps for the explorer. */
async function redeem() {
  const given = new URLSearchParams(location.hash.slice(1)), token = given.get("token");
  if (!token) return;
  given.delete("token");
  history.replaceState(null, "", location.pathname + (given.size ? `#${given}` : ""));
  const response = await fetch("/api/secret", {method: "POST", headers: {authorization: `Bearer ${token}`}});
  if (response.ok) localStorage.setItem("rocking-secret", await response.text());
}

openKernels().then((kernels) => { Object.assign(globalThis, {page: new Page(kernels)}); }).catch((/** @type {Error} */ error) => {
  one("headline").textContent = `This browser cannot run the kernels (${error.message}). Use a current version of Chromium, Firefox or Safari.`;
});
