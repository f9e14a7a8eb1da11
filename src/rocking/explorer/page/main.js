// The page: one state, in its address; forms that change it, and four views that show it.

import * as address from "./address.js";
import {Latest, Problem, json, payload} from "./api.js";
import {BlockForm, ModelForm, MotionForm} from "./forms.js";
import {Histories} from "./histories.js";
import {ChatteringPanel} from "./chattering.js";
import {coarse} from "./theme.js";
import {makeCopying, showTaking} from "./taking.js";
import {acceptFiles} from "./upload.js";
import {make, one, say, short} from "./words.js";

/** @typedef {import("./api.js").Texts} Texts */

const offers = await json("/api/start", {});
const state = address.read(offers.opening);
if (!Object.keys(state.texts).length) state.texts = {...offers.default};
else if (!["width", "p", "pivots"].some((name) => name in state.texts)) state.texts = {width: offers.default.width, height: offers.default.height, ...state.texts};

/** What the views share.
 * @type {{offers: any, state: address.State, shown: import("./api.js").Payload | null, change: typeof change, go: typeof go, problem: typeof problem, restate: typeof restate, remember: () => void}} */
const page = {offers, state, shown: null, change, go, problem, restate, remember: () => address.write(state)};
/** @type {Record<string, any>} */
const views = {};

const forms = {
  block: new BlockForm(one("block-form"), offers, changed),
  motion: new MotionForm(one("motion-form"), offers, changed),
  model: new ModelForm(one("model-form"), offers, changed),
};
const histories = new Histories(one("histories"), {
  window: (chosen) => { state.window = chosen; address.write(state); look.ask(); },
  cursor: (text) => { one("cursor").textContent = text; },
  pick: (time) => views.block?.seek(time),
});
const chattering = new ChatteringPanel((chosen) => { state.window = chosen; address.write(state); look.ask(); });

/** @param {string | null} sentence */
function problem(sentence) {
  const box = one("problem");
  box.hidden = !sentence;
  if (sentence) box.textContent = sentence;
}

/** Do some work, and say it on the page when it fails. @param {() => Promise<void>} work */
async function told(work) {
  try {
    await work();
    problem(null);
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") return;
    problem(error instanceof Problem ? error.message : `The page stumbled: ${error}`);
    if (!(error instanceof Problem)) console.error(error);
  }
}

/** How long sliders must lie still before all is drawn, ms. */
const PAUSE = 120;
/** The timer; 0 where all is drawn. */
let resting = 0;

/** The whole case, where a form has changed it. */
const load = new Latest(async () => {
  window.clearTimeout(resting);
  await told(async () => {
    page.shown = await payload("/api/case", {...state.texts, ...ends()});
    draw();
    document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
    resting = -1;
  });
  if (resting) resting = window.setTimeout(drawRest, PAUSE);
});

/** Another window of the case that is shown. */
const look = new Latest(() => told(async () => {
  if (!page.shown) return;
  if (!state.window) { await load.work(); return; }
  const {header, arrays} = await payload("/api/window", {...state.texts, ...ends()});
  page.shown.header.window = header.window;
  Object.assign(page.shown.arrays, arrays);
  histories_draw();
  showTaking(page.shown.header, state);
  document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
}));

/** @returns {Texts} */
function ends() {
  return state.window ? {from: String(state.window[0]), to: String(state.window[1])} : {};
}

/** A form has changed some texts; those that are gone with them are not meant any more. @param {Texts} texts @param {string[]} gone */
function changed(texts, gone) {
  const kept = Object.fromEntries(Object.entries(state.texts).filter(([name]) => !gone.includes(name)));
  const other = gone.includes("motion") && (kept.motion ?? state.texts.motion) !== texts.motion;
  state.texts = {...kept, ...texts};
  if (other) state.window = null;
  change();
}

/** The texts have changed. */
function change() {
  address.write(state);
  if (state.view === "map" || state.view === "compare") views[state.view].update();
  void load.ask();
}

/** Other texts altogether: show them in the forms, too. @param {Texts} texts */
function restate(texts) {
  state.texts = texts;
  state.window = null;
  for (const form of Object.values(forms)) form.show(texts);
  change();
}

/** Show another view. @param {string} name */
async function go(name) {
  state.view = name;
  for (const button of document.querySelectorAll("[data-view]")) {
    if (/** @type {HTMLElement} */ (button).dataset.view === name) button.setAttribute("aria-current", "page");
    else button.removeAttribute("aria-current");
  }
  const parts = {
    summary: name !== "map", "view-histories": name === "response" || name === "block", "view-response": name === "response",
    "view-block": name === "block", "view-map": name === "map", "view-compare": name === "compare",
  };
  for (const [id, shown] of Object.entries(parts)) one(id).hidden = !shown;
  one("figures").hidden = name === "block";
  if (name === "block") histories.size(190, 140);
  else if (name === "response") histories.size(290, 190);
  address.write(state);
  if (name !== "response" && !views[name]) {
    const module = await import(`./${name}.js`);
    views[name] = new module.View(page, histories);
  }
  for (const [each, view] of Object.entries(views)) if (each !== name) view.leave?.();
  views[name]?.enter?.();
  if (page.shown) draw();
  void load.ask();
}

function draw() {
  if (!page.shown) return;
  const {header} = page.shown;
  if (one("verdict").textContent !== header.verdict) one("verdict").textContent = header.verdict;
  showFigures(header);
  showNotes(header);
  const [plus, minus] = header.block.thresholds_g;
  const [right, left] = header.block.sides.map((/** @type {any} */ side, /** @type {number} */ k) =>
    `p = ${short(side.p)} rad/s, α = ${short((side.alpha * 180) / Math.PI)}°, η = ${short(side.restitution)}; lifts above ${short([plus, minus][k])} g`);
  one("derived").textContent = right === left ? `${right}.` : `To the right ${right}. To the left ${left}.`;
  if (state.view === "response" || state.view === "block") histories_draw();
  views[state.view]?.draw?.();
}

/** What nobody reads while a slider moves. */
function drawRest() {
  resting = 0;
  if (!page.shown) return;
  const {header} = page.shown;
  forms.block.show(state.texts, header.block.sides);
  if (state.view !== "map") showTaking(header, state);
  if (state.view === "response") chattering.draw(page.shown, state.texts);
  document.body.dataset.rested = String(Number(document.body.dataset.rested ?? 0) + 1);
}

function histories_draw() {
  if (!page.shown) return;
  const {header, arrays} = page.shown;
  const lines = /** @type {any} */ (arrays);
  histories.draw([header.window.from, header.window.to], header.duration, {lines, rest: arrays.rest, uplift: arrays.uplift, sides: header.block.sides}, null, header.block.thresholds_g);
  showLegend(header.motion?.vertical);
  chattering.window(header.window);
}

/** @param {{name: string, pga_g: number} | null} [vertical] */
function showLegend(vertical) {
  const text = vertical ? `vertical acceleration (${vertical.name}, peak ${short(vertical.pga_g)} g), with which the thresholds move` : "";
  if (one("legend").dataset.vertical === text) return;
  one("legend").dataset.vertical = text;
  const entries = [["line", "rotation"], ["rest", "at rest"], ["impact", "impact"], ["uplift", "uplift"], ["ground", "ground acceleration"], ["beyond", "beyond the threshold of uplift"]];
  if (text) entries.push(["up", text]);
  one("legend").replaceChildren(...entries.map(([name, words]) => make("span", {}, [make("i", {className: `key ${name}`}), words])));
}

/** @param {any} header */
function showFigures(header) {
  const degrees = (header.peak_rotation * 180) / Math.PI;
  const rows = [
    ["Peak rotation", header.overturned ? "overturns" : `${short(header.peak_over_slenderness)} α`, header.overturned ? `at ${header.overturn_time.toFixed(3)} s` : `${short(degrees)}° at ${header.peak_time.toFixed(2)} s`],
    ["Comes to rest", `${header.rests} ×`, header.rests ? (header.proven === header.rests ? "each time proven" : `${header.proven} proven`) : "not at all"],
    ["Impacts", String(header.impacts), "resolved one by one"],
    ["At rest", header.share_at_rest === null ? "–" : `${short(100 * header.share_at_rest, 2)} %`, "of the strong shaking"],
  ];
  const list = one("figures");
  if (!list.childNodes.length) {
    list.append(...rows.map(([name]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, ["", make("small")])])));
  }
  rows.forEach(([, value, more], k) => {
    const [number, small] = list.querySelectorAll("dd")[k].childNodes;
    if (number.nodeValue !== value) number.nodeValue = value;
    if (small.textContent !== more) small.textContent = more;
  });
}

/** @param {any} header */
function showNotes(header) {
  const notes = [...header.block.notes, ...(header.motion?.notes ?? [])];
  one("notes").hidden = !notes.length;
  one("notes").replaceChildren(...notes.map((/** @type {string} */ note) => make("li", {}, [note])));
}

async function warm() {
  let {warming} = offers;
  while (!warming.done) {
    one("warming").hidden = warming.seconds < 3;
    await new Promise((wake) => setTimeout(wake, 500));
    try { ({warming} = await json("/api/start", {})); } catch { return; }
  }
  one("warming").hidden = true;
}

for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => go(/** @type {any} */ (button).dataset.view));
for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => histories.zoom(/** @type {any} */ (button).dataset.zoom));
for (const button of document.querySelectorAll("button.what[aria-controls]")) {
  button.addEventListener("click", () => {
    const words = one(/** @type {string} */ (button.getAttribute("aria-controls")));
    words.hidden = !words.hidden;
    button.setAttribute("aria-expanded", String(!words.hidden));
  });
}
one("in-words").addEventListener("toggle", () => chattering.words(state.texts));
if (coarse()) one("cursor").textContent = "Tap the plots to read them.";
one("settings").addEventListener("submit", (event) => event.preventDefault());
makeCopying();
acceptFiles(async (file, upwards) => told(async () => {
  const found = await file();
  forms.motion.take(found, upwards);
  say(`${found.name} was read as ${found.format}.`);
}));
for (const form of Object.values(forms)) form.show(state.texts);
void warm();
await go(state.view);
document.body.dataset.ready = String(performance.now());
