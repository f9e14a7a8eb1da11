// On a phone the settings are a sheet over the lower half of the page, so that the picture is seen while they are changed.

import {one} from "./words.js";
import {phrase} from "./texts.js";

const PICTURES = ["stage-frame", "histories", "map", "orbit", "compare-plots"];

export class Sheet {
  constructor() {
    this.button = one("to-settings");
    this.button.addEventListener("click", () => (this.open ? this.close() : this.show()));
    one("settings").addEventListener("keydown", (event) => { if (event.key === "Escape" && this.open) this.close(); });
  }

  get open() { return document.body.classList.contains("sheet"); }

  show() {
    document.body.classList.add("sheet");
    this.named();
    const picture = PICTURES.map((id) => one(id)).find((each) => each.checkVisibility());
    const above = /** @type {HTMLElement} */ (document.querySelector("header")).getBoundingClientRect().bottom;
    if (picture) window.scrollBy(0, picture.getBoundingClientRect().top - Math.max(above, 0) - 8);
  }

  close() {
    document.body.classList.remove("sheet");
    this.named();
    this.button.focus({preventScroll: true});
  }

  named() {
    this.button.setAttribute("aria-expanded", String(this.open));
    this.button.textContent = phrase(this.open ? "settings.close" : "settings.open");
  }
}
