// One printed page of what is shown: the case in its head, light figures, the verdict, the summary, no controls.

import {json} from "./api.js";
import {specification} from "./parameters.js";
import {lit} from "./theme.js";
import {angle, ofG, treatmentName} from "./units.js";
import {fill, make, one} from "./words.js";
import {short} from "./numbers.js";
import {phrase} from "./texts.js";

/** @param {any} page @param {(error: unknown) => void} problem */
export function makePrinting(page, problem) {
  /** Texts of the case whose summary is on the page. */
  let held = "";

  async function print() {
    try {
      const {texts: shown} = page.state.good, texts = JSON.stringify(shown);
      if (held !== texts) {
        const rows = await json("/api/summary", shown);
        const half = Math.ceil(rows.length / 2);
        fill(/** @type {HTMLTableElement} */ (one("print-summary")), [], Array.from({length: half}, (_, k) => [...rows[k], ...(rows[k + half] ?? ["", ""])]));
        held = texts;
      }
      begin();
      await new Promise((drawn) => setTimeout(drawn, 300));
      window.print();
    } catch (error) {
      problem(error);
    }
  }

  function begin() {
    lit(true);
    if (held !== JSON.stringify(page.state.good.texts)) one("print-summary").replaceChildren();
    head(page);
  }

  one("print").addEventListener("click", print);
  window.addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "p") { event.preventDefault(); void print(); }
  });
  window.addEventListener("beforeprint", begin);
  window.addEventListener("afterprint", () => lit(false));
}

/** Say which case it is, who computed it, and where it is found again. @param {any} page */
function head({state, shown}) {
  if (!shown) return;
  const {block, motion, model, treatment} = shown.header;
  const sides = block.sides.map((/** @type {any} */ side, /** @type {number} */ k) => phrase("print.side", {p: short(side.p), alpha: angle(side.alpha), eta: short(side.restitution), threshold: ofG(block.thresholds_g[k])}));
  const rows = [
    [phrase("print.block"), sides[0] === sides[1] ? phrase("print.one_side", {description: block.description, side: sides[0]})
      : phrase("print.two_sides", {description: block.description, right: sides[0], left: sides[1]})],
    [phrase("print.motion"), !motion ? phrase("print.no_motion") : motion.vertical
      ? phrase("print.of_both", {name: motion.name, pga: ofG(motion.pga_g), vertical: motion.vertical.name, peak: ofG(motion.vertical.pga_g)})
      : phrase("print.of_motion", {name: motion.name, pga: ofG(motion.pga_g)})],
    [phrase("print.model"), phrase("print.ends", {model: phrase(`model.${model}`), treatment: treatmentName(treatment)})],
    [phrase("print.computed"), `rocking ${specification.version}, ${new Date().toISOString().slice(0, 10)}`],
    [phrase("print.address"), `?${location.search.slice(1)}`],
  ];
  if (state.view === "assessment" && state.assessment.records) rows[4][1] = phrase("print.listed", {address: `?${new URLSearchParams(state.good.texts)}&view=assessment`});
  one("print-head").replaceChildren(...rows.map(([name, text]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, [text])])));
}
