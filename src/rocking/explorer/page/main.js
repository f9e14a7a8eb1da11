// The page: one state, in its address; forms that change it, and five views that show it.

import {accepted, ends, readAddress, specification, writeAddress, writeNow} from "./parameters.js";
import {Latest, Problem, json, payload} from "./api.js";
import {ChatteringPanel} from "./chattering.js";
import {makeCopying, showCode, showFiles} from "./exports.js";
import {BlockForm, ModelForm, MotionForm} from "./forms.js";
import {Cursor} from "./cursor.js";
import {Examples} from "./examples.js";
import {Ghosts} from "./ghosts.js";
import {Histories} from "./histories.js";
import {PhasePanel} from "./phase.js";
import {Lecture} from "./lecture.js";
import {Sheet} from "./sheet.js";
import {Snapshots} from "./snapshots.js";
import {RecordList} from "./list.js";
import {makePrinting} from "./print.js";
import {angle, caseName, ofG, unitFields, unitsChosen} from "./units.js";
import {acceptFiles} from "./upload.js";
import {keepingFocus} from "./focus.js";
import {begin, settle} from "./visits.js";
import {counted, legend, make, one, say, tell} from "./words.js";
import {NONE, fixed, short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** @typedef {import("./api.js").Texts} Texts */

const state = readAddress();
/** Id of the field that has loaded the page again, where the keys go on. @type {string | undefined} */
const keysAt = history.state?.focus;

/** What the views share.
 * @type {{state: import("./parameters.js").State, shown: import("./api.js").Payload | null, go: typeof go, problem: typeof problem, restate: typeof restate, follow: typeof follow, list: RecordList, remember: (parts: Partial<import("./parameters.js").Good>) => void}} */
const page = {state, shown: null, go, problem, restate, follow, list: new RecordList(state), remember: (parts) => { accepted(state, parts); examples.check(); }};
/** Views that somebody has opened, by name. @type {Record<string, any>} */
const views = {};
/** The number of the last view that was asked for. */
let turn = 0;

const forms = {
  block: new BlockForm(one("block-form"), changed, () => load.idle),
  motion: new MotionForm(one("motion-form"), changed),
  model: new ModelForm(one("model-form"), changed),
};
const histories = new Histories(one("histories"), {
  window: showWindow, asked: () => state.window, load: () => load, cursor: (time) => { if (time === null) cursor.show(); else cursor.hover(time); }, pick: (time) => cursor.set(time),
});
const phase = new PhasePanel(page, (time) => cursor.set(time));
const cursor = new Cursor(page, {mark: (time) => { histories.mark(time); phase.mark(time); }, seek: (time) => { if (state.view === "block") views.block?.seek(time); }});
const chattering = new ChatteringPanel({window: showWindow, asked: () => state.window}, problem);
const lecture = new Lecture(page, histories);
const examples = new Examples(state, revisit, problem);
new Sheet();
const ghosts = new Ghosts(histories);
new Snapshots({problem: (error) => problem(error, "snapshots"), now: () => (page.shown ? {name: caseName(page.shown.header), texts: {...state.good.texts}} : null), open: restate, changed: () => views.compare?.repinned()});

/** Whether a case is drawn, be it the one that the state says or another one. */
let drawn = false;
/** What is wrong at each place of the page, by its id. @type {Record<string, string | null>} */
const problems = {};
/** Places where somebody has just done something: what is wrong there is said before what views make of it. */
const FIRST = ["settings", "files", "snapshots", "exports", "print-head"];

/** Say what is wrong, or that nothing is, and mark the field that is wrong. @param {unknown} error @param {string} [place] id of what holds the field */
function problem(error, place = "settings") {
  if (error instanceof DOMException && error.name === "AbortError") return;
  if (!error && !problems[place]) return;
  if (error && !(error instanceof Problem)) console.error(error);
  if (one(place).closest("[hidden]")) error = null; // what is wrong where nobody looks any more is of no use
  delete problems[place]; // so that the last is the newest
  problems[place] = error instanceof Problem ? error.message : error ? phrase("page.fault", {error: String(error)}) : null;
  for (const each of one(place).querySelectorAll("[aria-invalid]")) each.removeAttribute("aria-invalid");
  for (const each of one(place).querySelectorAll("[data-problem]")) each.removeAttribute("data-problem");
  const argument = error instanceof Problem && error.argument;
  for (const each of argument ? one(place).querySelectorAll(`[data-argument="${CSS.escape(argument)}"]`) : []) {
    if (!each.checkVisibility()) continue;
    each.setAttribute("aria-invalid", "true");
    each.setAttribute("aria-errormessage", "problem");
    const around = each.closest(".number, .choice, label");
    around?.setAttribute("data-problem", problems[place] ?? "");
    if (place === "settings") around?.scrollIntoView({block: "nearest"});
  }
  one(place === "settings" ? "main" : place).classList.toggle("old", Boolean(error && drawn));
  one("old").hidden = !(problems.settings && drawn);
  const wrong = Object.entries(problems).filter(([, each]) => each);
  const sentence = (wrong.findLast(([each]) => FIRST.includes(each)) ?? wrong.at(-1))?.[1];
  one("problem").hidden = !sentence;
  if (sentence) one("problem").textContent = sentence;
}

/** How long sliders must lie still before all is drawn, ms. */
const PAUSE = 120;
let pause = 0;
/** Texts of the case that is shown. @type {Texts} */
let texts = state.texts;
/** Whether the case must be computed; else another window of it is enough. */
let stale = true;
/** What was shown when all was drawn last. @type {import("./api.js").Payload | null} */
let rested = null;

/** Show what the state says: one request after the other, so that no answer overtakes a later one. */
const load = new Latest(() => (stale || !page.shown || !state.window ? compute() : look()), problem);

/** The whole case. */
async function compute() {
  window.clearTimeout(pause);
  stale = false;
  const {texts: asked, good} = state;
  try {
    const found = await payload("/api/case", {...asked, ...ends(state)});
    if (state.good !== good) return; // somebody went back meanwhile
    page.shown = found;
    drawn = true;
    texts = asked;
    if (state.texts === asked) forms.block.known = found.header.block.sides;
    // It was chosen for a longer response; where two are compared, the other may be longer.
    if (state.view !== "compare" && state.window && state.window[0] >= found.header.duration) state.window = null;
    accepted(state, {texts, window: state.window});
    one("to-block").hidden = !specification.block_page;
    /** @type {HTMLAnchorElement} */ (one("to-block")).href = `/block#${new URLSearchParams(texts)}`;
    draw();
    counted("drawn");
  } catch (error) {
    stale = true;
    throw error;
  } finally {
    pause = window.setTimeout(() => afterPause.ask(), PAUSE);
  }
}

/** Another window of the case that is shown. */
async function look() {
  const {window: asked, good} = state, {header, arrays} = await payload("/api/window", {...texts, ...ends(state)});
  if (!page.shown || state.good !== good) return; // another case is on its way, or somebody went back
  accepted(state, {window: asked});
  page.shown.header.window = header.window;
  Object.assign(page.shown.arrays, arrays);
  draw();
  chattering.window(header.window);
  phase.update();
  cursor.show();
  counted("drawn");
}

/** What nobody reads while a slider moves. */
const afterPause = new Latest(async () => {
  const {shown} = page;
  if (!shown || shown === rested) return;
  const {header} = shown, of = texts;
  if (state.texts === of) forms.block.show(of, header.block.sides);
  entitle(header);
  showNotes(header);
  showLegend(header);
  chattering.window(header.window);
  if (state.view === "response") chattering.draw(shown, of);
  phase.update();
  cursor.show();
  await forms.block.mesh.learn(of);
  if (!ofOwn(state.view)) {
    if (state.view !== "compare") showFiles(state, (error) => problem(error, "exports"));
    const {python, command} = await json("/api/code", of);
    if (texts === of && !ofOwn(state.view)) showCode("case", python, command);
  }
  rested = shown;
  if (state.texts !== of) return;
  counted("rested");
}, (error) => { if (error) problem(error); }); // that all is well with what is shown says nothing of what is in the fields

/** The block is shown at another time: the plots follow, and where it stands still, so does the cursor.
 * @param {number} time @param {boolean} playing */
function follow(time, playing) {
  if (playing) { histories.mark(time); phase.mark(time); } else if (time !== state.at) cursor.take(time);
}

/** @param {[number, number] | null} chosen */
function showWindow(chosen) {
  state.window = chosen;
  void load.ask();
}

/** A form has changed the case: new texts stand for all those that they replace. @param {Texts} given @param {string[]} replaced */
function changed(given, replaced) {
  if (replaced.includes("motion") && state.texts.motion !== given.motion) state.window = state.at = null;
  const kept = Object.entries(state.texts).filter(([name]) => !replaced.includes(name));
  state.texts = {...Object.fromEntries(kept), ...given};
  stale = true;
  views[state.view]?.update?.();
  examples.check();
  void load.ask();
}

/** Other texts altogether: show them in the forms, too. @param {Texts} given */
function restate(given) {
  begin();
  state.window = state.at = null;
  showForms(given);
  changed(given, Object.keys(state.texts));
}

/** @param {Texts} given */
function showForms(given) {
  for (const form of Object.values(forms)) form.show(given);
}

/** Go back or forward in the browser's history. */
function revisit() {
  settle();
  views[state.view]?.leave?.(); // what is under way belongs to the state that is left
  const units = String(unitsChosen()), before = JSON.stringify(state.texts);
  Object.assign(state, readAddress());
  page.list.read();
  if (JSON.stringify(state.texts) !== before) page.shown = null;
  cursor.show();
  if (String(unitsChosen()) !== units) { location.reload(); return; } // every field has its unit from the start
  showForms(state.texts);
  void examples.show();
  if (state.lecture && !lecture.on) void lecture.enter();
  else if (lecture.on && !state.lecture) lecture.leave(state.view);
  else void go(state.view);
}

/** Whether a view shows something else than a response, with files and code of its own. @param {string} name */
const ofOwn = (name) => name === "map" || name === "periodic" || name === "assessment";

/** The view of a name, whose code is loaded when it is opened first. @param {string} name */
async function made(name) {
  if (name === "response" || views[name]) return views[name];
  const module = await import(`./${name}.js`).catch(() => { throw new Problem(phrase("page.silent")); });
  return views[name] ??= new module.View(page, histories);
}

/** Show another view, once its code is there: what is chosen in it is heard from the start. @param {string} name */
async function go(name) {
  const here = turn += 1;
  try {
    if (name !== "response" && !views[name]) await made(name);
  } catch (error) {
    problem(error);
    return;
  }
  if (here !== turn) return; // another view was chosen meanwhile
  state.view = name;
  for (const button of document.querySelectorAll("[data-view]")) {
    if (/** @type {HTMLElement} */ (button).dataset.view === name) {
      button.setAttribute("aria-current", "page");
      button.scrollIntoView({block: "nearest", inline: "nearest"});
    }
    else button.removeAttribute("aria-current");
  }
  const parts = {
    summary: !ofOwn(name) || name === "assessment", "view-histories": name === "response" || name === "block", "view-response": name === "response",
    "view-phase": name === "response" || name === "block",
    "view-block": name === "block", "view-map": name === "map", "view-periodic": name === "periodic",
    "view-compare": name === "compare", "view-records": name === "records", "view-assessment": name === "assessment",
  };
  keepingFocus(() => { for (const [id, shown] of Object.entries(parts)) one(id).hidden = !shown; },
    () => document.querySelector(`[data-view="${name}"]`));
  one("figures").hidden = one("at-slider").hidden = name === "block";
  if (name === "block") histories.size(190, 140);
  else if (name === "response") histories.size(290, 190);
  writeNow(state);
  examples.check();
  for (const [each, view] of Object.entries(views)) if (each !== name) view.leave?.();
  for (const place of Object.keys(problems)) if (one(place).closest("[hidden]")) problem(null, place);
  problem(null, "exports"); // another view has other files
  views[name]?.enter?.();
  if (page.shown) {
    entitle(page.shown.header);
    draw();
  }
  stale = true;
  rested = null; // files and code are those of the view
  void load.ask();
}

/** Draw what a slider changes. */
function draw() {
  if (!page.shown) return;
  const {header, arrays} = page.shown;
  tell(one("verdict"), inWords(header.verdict));
  showFigures(header);
  const [plus, minus] = header.block.thresholds_g;
  const [right, left] = header.block.sides.map((/** @type {any} */ side, /** @type {number} */ k) =>
    phrase("block.side", {p: short(side.p), alpha: angle(side.alpha), eta: short(side.restitution), threshold: ofG([plus, minus][k])}));
  const {body} = header.block;
  tell(one("derived"), right === left ? phrase("block.same", {side: right})
    : body ? phrase("block.towards", {to: short(body.azimuth, 4), fro: short((body.azimuth + 180) % 360, 4), right, left}) : phrase("block.differing", {right, left}));
  forms.block.mesh.turn(body);
  if (state.view === "response" || state.view === "block") {
    const lines = /** @type {any} */ (arrays);
    ghosts.next(header, lines);
    histories.draw(header, {lines, rest: arrays.rest, uplift: arrays.uplift, block: header.block});
  }
  views[state.view]?.draw?.();
}

/** Name the view and the case, for tabs and bookmarks. @param {any} header */
function entitle({block, motion}) {
  const view = document.querySelector("[data-view][aria-current]")?.textContent ?? "";
  const {study} = specification;
  const shown = study && state.view === "map" ? phrase("page.study", {name: study.name}) : caseName({block, motion});
  document.title = phrase("page.case_title", {view, shown});
}

/** @param {any} header */
function showLegend({motion, overturned, peak_over_slenderness: peak}) {
  const vertical = motion?.vertical;
  const entries = [["line", phrase("legend.rotation")], ["rest", phrase("legend.rest")], ["impact", phrase("legend.impact")], ["uplift", phrase("legend.uplift")],
    ["ground", phrase("legend.ground")], ["beyond", phrase("legend.beyond")]];
  if (vertical) entries.push(["up", phrase("legend.vertical", {name: vertical.name, peak: ofG(vertical.pga_g)})]);
  if (overturned || peak > 0.9) entries.push(["over", phrase("legend.over")]);
  legend("legend", entries);
}

/** @param {any} header of the case; null before there is one */
function showFigures(header) {
  const rows = header ? [
    [phrase("figure.peak"), header.overturned ? phrase("figure.overturns") : `${short(header.peak_over_slenderness)} α`,
      header.overturned ? phrase("figure.overturn_time", {time: fixed(header.overturn_time, 3)}) : phrase("figure.peak_at", {angle: angle(header.peak_rotation), time: fixed(header.peak_time, 2)})],
    [phrase("figure.rests"), phrase("figure.times", {count: header.rests}),
      header.rests ? (header.proven === header.rests ? phrase("figure.all_proven") : phrase("figure.proven", {count: header.proven})) : phrase("figure.no_rest")],
    [phrase("figure.impacts"), fixed(header.impacts, 0), phrase(header.rests ? "figure.until" : "figure.resolved")],
    [phrase("figure.share"), header.share_at_rest === null ? NONE : phrase("figure.percent", {share: short(100 * header.share_at_rest, 2)}), phrase("figure.strong")],
  ] : [phrase("figure.peak"), phrase("figure.rests"), phrase("figure.impacts"), phrase("figure.share")].map((name) => [name, NONE, "\u00a0"]);
  const list = one("figures");
  if (!list.childNodes.length) list.append(...rows.map(([name]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, ["", make("small")])])));
  const values = list.getElementsByTagName("dd");
  rows.forEach(([, value, more], k) => {
    const [number, small] = values[k].childNodes;
    tell(number, value);
    tell(small, more);
  });
}

/** @param {any} header */
function showNotes(header) {
  const notes = [...header.block.notes, ...(header.motion?.notes ?? [])];
  one("notes").hidden = !notes.length;
  one("notes").replaceChildren(...notes.map((/** @type {string} */ note) => make("li", {}, [note])));
}

for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => { begin(); void go(/** @type {any} */ (button).dataset.view); });
for (const button of document.querySelectorAll("[data-zoom]")) button.addEventListener("click", () => void histories.zoom(/** @type {any} */ (button).dataset.zoom));
for (const button of document.querySelectorAll("button.what[aria-controls]")) {
  button.addEventListener("click", () => {
    const words = one(/** @type {string} */ (button.getAttribute("aria-controls")));
    words.hidden = !words.hidden;
    button.setAttribute("aria-expanded", String(!words.hidden));
  });
}
one("in-words").addEventListener("toggle", () => chattering.words());
one("settings").addEventListener("submit", (event) => event.preventDefault());
makeCopying();
acceptFiles(async (file, use) => {
  try {
    const found = await file();
    if (use === "mesh") forms.block.take(found);
    else forms.motion.take(found, use === "vertical");
    if (state.view === "records") void views.records?.loading.ask();
    say(use === "mesh" ? phrase("file.is_body", {name: found.name}) : phrase("file.is_record", {name: found.name, format: found.format}));
    problem(null, "files");
  } catch (error) {
    problem(error, "files");
  }
}, async (files) => {
  await go("records");
  await views.records?.add(files);
}, (error) => problem(error, "files"));
makePrinting(page, (error) => problem(error, "print-head"));
unitFields(async (name) => {
  await load.idle; // what was changed before belongs into the address that is loaded again
  writeAddress(state);
  window.setTimeout(() => {
    history.replaceState({focus: name}, ""); // the keys go on there
    location.reload();
  }, 250);
});
window.addEventListener("popstate", revisit);
await examples.arrive();
showForms(state.texts);
showFigures(null);
await (state.lecture ? lecture.enter() : go(state.view));
document.body.inert = false;
if (keysAt) {
  one(keysAt)?.focus({preventScroll: true});
  history.replaceState(null, "");
}
document.body.dataset.ready = String(performance.now());
