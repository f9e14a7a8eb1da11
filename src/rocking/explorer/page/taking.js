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
  showCode("case", header.python, header.command);
}

/** What can be taken of a map, which the page has already. @param {string} python @param {string | null} command
 * @param {[string, string, () => Promise<Blob>][]} files names, labels, and what makes them */
export function showMapTaking(python, command, files) {
  one("exports").replaceChildren(...files.map(([name, label, content]) => make("button", {type: "button", on: {click: async () => save(name, await content())}}, [label])));
  showCode("map", python, command);
}

/** @param {string} what @param {string} python @param {string | null} command */
function showCode(what, python, command) {
  one("python-title").textContent = `This ${what} as Python`;
  one("python").textContent = python;
  one("command").textContent = command ?? `The command line does not do this ${what}; Python does.`;
  /** @type {HTMLButtonElement} */ (document.querySelector("[data-copy=command]")).disabled = !command;
}

/** @param {string} name @param {Blob} content */
function save(name, content) {
  const link = /** @type {HTMLAnchorElement} */ (make("a", {href: URL.createObjectURL(content), download: name}));
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  say(`${name} is saved.`);
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
