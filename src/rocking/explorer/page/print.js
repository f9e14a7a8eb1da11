// One printed page of what is shown: the case in its head, light figures, the verdict, the summary, no controls.

import {json} from "./api.js";
import {specification} from "./parameters.js";
import {lit} from "./theme.js";
import {angle, ofG, treatmentName} from "./units.js";
import {fill, make, one} from "./words.js";
import {short} from "./numbers.js";
import {phrase} from "./texts.js";

/** @param {any} page @param {(error: unknown) => void} problem is told what went wrong, or null */
export function makePrinting(page, problem) {
  /** Texts of the case whose summary is on the page. */
  let held = "";
  const ofStudy = () => Boolean(specification.study) && page.state.view === "map";

  async function print() {
    try {
      const {texts: shown} = page.state.good, texts = JSON.stringify(shown);
      if (held !== texts && !ofStudy()) {
        const rows = await json("/api/summary", shown);
        const half = Math.ceil(rows.length / 2);
        fill(/** @type {HTMLTableElement} */ (one("print-summary")), [], Array.from({length: half}, (_, k) => [...rows[k], ...(rows[k + half] ?? ["", ""])]));
        held = texts;
      }
      begin();
      await new Promise((drawn) => setTimeout(drawn, 300));
      window.print();
      problem(null);
    } catch (error) {
      problem(error);
    }
  }

  function begin() {
    lit(true);
    if (ofStudy() || held !== JSON.stringify(page.state.good.texts)) {
      one("print-summary").replaceChildren();
      held = "";
    }
    head([...(ofStudy() ? aboutStudy() : aboutCase(page)), [phrase("print.computed"), `rocking ${specification.version}, ${new Date().toISOString().slice(0, 10)}`],
      [phrase("print.address"), address(page.state)]]);
  }

  one("print").addEventListener("click", print);
  window.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "p") { event.preventDefault(); void print(); }
  });
  window.addEventListener("beforeprint", begin);
  window.addEventListener("afterprint", () => lit(false));
}

/** Say what it is, who computed it, and where it is found again. @param {string[][]} rows */
function head(rows) {
  one("print-head").replaceChildren(...rows.map(([name, text]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, [text])])));
}

/** The address, of an assessment without its list of records, which is on the page. @param {any} state */
function address({view, assessment}) {
  const given = new URLSearchParams(location.search);
  if (view !== "assessment" || !assessment.records) return `?${given}`;
  given.delete("records");
  return phrase("print.listed", {address: `?${given}`});
}

/** Which study it is, what of it is drawn, and what is fixed. @returns {string[][]} */
function aboutStudy() {
  const choices = /** @type {HTMLSelectElement[]} */ ([...document.querySelectorAll(":is(#map-tools, #study-tools) label:not([hidden]) select")]);
  return [[phrase("print.study"), `${specification.study.name}: ${specification.study.status}`],
    [phrase("print.slice"), choices.map((each) => `${each.previousSibling?.textContent?.trim()} ${each.selectedOptions[0]?.text}`).join(", ")]];
}

/** @param {any} page @returns {string[][]} */
function aboutCase({shown}) {
  if (!shown) return [];
  const {block, motion, model, treatment} = shown.header;
  const sides = block.sides.map((/** @type {any} */ side, /** @type {number} */ k) => phrase("print.side", {p: short(side.p), alpha: angle(side.alpha), eta: short(side.restitution), threshold: ofG(block.thresholds_g[k])}));
  return [
    [phrase("print.block"), sides[0] === sides[1] ? phrase("print.one_side", {description: block.description, side: sides[0]})
      : phrase("print.two_sides", {description: block.description, right: sides[0], left: sides[1]})],
    [phrase("print.motion"), !motion ? phrase("print.no_motion") : motion.vertical
      ? phrase("print.of_both", {name: motion.name, pga: ofG(motion.pga_g), vertical: motion.vertical.name, peak: ofG(motion.vertical.pga_g)})
      : phrase("print.of_motion", {name: motion.name, pga: ofG(motion.pga_g)})],
    [phrase("print.model"), phrase("print.ends", {model: phrase(`model.${model}`), treatment: treatmentName(treatment)})],
  ];
}
