// Lecture mode: the stage large, with large text, the plots beside it where the screen is wide, and nothing else on the screen.

import {enlarge} from "./theme.js";
import {one} from "./words.js";
import {phrase} from "./texts.js";

/** Text of the plots in lecture mode, times as large: 24 px. */
const LARGER = 2;
/** Width of the window, px, from which the plots stand beside the stage. */
const WIDE = 1200;

export class Lecture {
  /** @param {any} page @param {import("./histories.js").Histories} histories */
  constructor(page, histories) {
    this.page = page;
    this.histories = histories;
    this.on = false;
    /** What had the focus before. @type {HTMLElement | null} */
    this.before = null;
    this.magnified = "1";
    one("lecture").addEventListener("click", () => this.toggle());
    document.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("fullscreenchange", () => { if (!document.fullscreenElement && this.full) this.leave(); });
    window.addEventListener("resize", () => { if (this.on) this.fit(); });
    this.full = false;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const {target} = event;
    if (target instanceof HTMLElement && target.closest("textarea, select, input:not([type=range], [type=checkbox])")) return;
    if (event.key === "f") { event.preventDefault(); this.toggle(); }
    if (event.key === "Escape" && this.on) this.leave();
  }

  toggle() {
    if (this.on) this.leave(); else void this.enter();
  }

  /** Show the stage large; fill the screen where the browser lets the page do so, which needs somebody's key or click. */
  async enter() {
    const {activeElement} = document;
    this.before = activeElement instanceof HTMLElement ? activeElement : null;
    const asked = navigator.userActivation?.isActive && document.documentElement.requestFullscreen?.();
    this.on = true;
    this.page.state.lecture = true;
    document.body.classList.add("lecture");
    await this.page.go("block");
    if (!this.on) return;
    const magnify = /** @type {HTMLSelectElement} */ (one("magnify"));
    this.magnified = magnify.value;
    magnify.value = "peak";
    this.named();
    enlarge(LARGER);
    this.fit();
    one("stage-frame").focus({preventScroll: true});
    try {
      await asked;
      this.full = Boolean(document.fullscreenElement);
    } catch { /* The browser does not let the page fill the screen; the stage is large all the same. */ }
  }

  /** @param {string} [view] that is shown next */
  leave(view = "block") {
    this.on = this.full = false;
    this.page.state.lecture = false;
    if (document.fullscreenElement) void document.exitFullscreen();
    document.body.classList.remove("lecture");
    /** @type {HTMLSelectElement} */ (one("magnify")).value = this.magnified;
    this.named();
    enlarge(1);
    void this.page.go(view);
    (this.before?.checkVisibility() ? this.before : one("lecture")).focus({preventScroll: true});
  }

  named() {
    one("lecture").textContent = phrase(this.on ? "stage.leave_lecture" : "stage.lecture");
    one("lecture").setAttribute("aria-pressed", String(this.on));
    one("magnify").dispatchEvent(new Event("change"));
  }

  /** Heights of the plots, which share that of the stage where they stand beside it. */
  fit() {
    const {innerHeight: height, innerWidth: width} = window;
    if (width >= WIDE) this.histories.size(Math.round(0.36 * height), Math.round(0.27 * height));
    else this.histories.size(260, 200);
  }
}
