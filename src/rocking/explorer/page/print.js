// One printed page of what is shown: the case in its head, light figures, the verdict, the summary, no controls.

import {json} from "./api.js";
import {specification} from "./parameters.js";
import {lit} from "./theme.js";
import {angle, ofG} from "./units.js";
import {fill, make, one, short} from "./words.js";

/** @param {any} page @param {(error: unknown) => void} problem */
export function makePrinting(page, problem) {
  /** Texts of the case whose summary is on the page. */
  let held = "";

  async function print() {
    try {
      const texts = JSON.stringify(page.state.texts);
      if (held !== texts) {
        const rows = await json("/api/summary", page.state.texts);
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
    if (held !== JSON.stringify(page.state.texts)) one("print-summary").replaceChildren();
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
  const sides = block.sides.map((/** @type {any} */ side, /** @type {number} */ k) => `p = ${short(side.p)} rad/s, α = ${angle(side.alpha)}, η = ${short(side.restitution)}, lifts above ${ofG(block.thresholds_g[k])}`);
  const rows = [
    ["Block", `${block.description}. ${sides[0] === sides[1] ? sides[0] : `To the right ${sides[0]}. To the left ${sides[1]}`}.`],
    ["Ground motion", motion ? `${motion.name}, PGA ${ofG(motion.pga_g)}${motion.vertical ? `, with ${motion.vertical.name}, ${ofG(motion.vertical.pga_g)}` : ""}` : "none"],
    ["Model", `${specification.models.find((/** @type {string[]} */ [name]) => name === model)?.[1] ?? model}; chattering ends by: ${treatment}`],
    ["Computed by", `rocking ${specification.version}, ${new Date().toISOString().slice(0, 10)}`],
    ["Address", `?${location.search.slice(1)}`],
  ];
  if (state.view === "assessment" && state.assessment.records) rows[4][1] = `?${new URLSearchParams(state.texts)}&view=assessment, with its list of records`;
  one("print-head").replaceChildren(...rows.map(([name, text]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, [text])])));
}
