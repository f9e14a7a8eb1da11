// What can be taken away: figures, data, and the case as code.

import {address} from "./api.js";
import {make, one, say} from "./words.js";

const FORMS = /** @type {[string, string, boolean][]} */ ([
  ["svg", "Figure, SVG", true], ["png", "Figure, PNG", true], ["csv", "Histories, CSV", false], ["events.csv", "Events, CSV", false],
  ["impacts.csv", "Impacts, CSV", false], ["nc", "All, NetCDF", false],
]);

/** @param {any} header @param {import("./address.js").State} state */
export function showTaking(header, state) {
  const {from, to} = header.window;
  one("exports").replaceChildren(...FORMS.map(([form, label, windowed]) => make("a", {
    href: address("/api/export", {...state.texts, form, ...(windowed && state.window ? {from: String(from), to: String(to)} : {})}),
    download: `rocking-response.${form}`,
  }, [label])));
  one("python").textContent = header.python;
  one("command").textContent = header.command ?? "The command line does not do this case; Python does.";
  /** @type {HTMLButtonElement} */ (document.querySelector("[data-copy=command]")).disabled = !header.command;
}

export function makeCopying() {
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", async () => {
      const source = one(/** @type {HTMLElement} */ (button).dataset.copy ?? "");
      try {
        await navigator.clipboard.writeText(source.textContent ?? "");
        button.textContent = "Copied";
        say("Copied.");
      } catch {
        getSelection()?.selectAllChildren(source);
        button.textContent = "Selected";
      }
      window.setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
  }
}
