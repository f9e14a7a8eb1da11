// The list of records, shipped and opened: what the server knows of each, which are ticked, and what was answered about files.

import {Problem, json} from "./api.js";
import {make} from "./standalone/dom.js";
import {namesOf, specification} from "./state.js";
import {short} from "./numbers.js";
import {acceleration} from "./units.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{texts: Texts, title: string, label: string, is_up: boolean, measures: Record<string, number> | null, key: string, file: string, missing: string[], raw: {pga: number, duration: number}, vertical: string}} Row */

const LARGEST = 16 * 2 ** 20;
/** Names of the texts that tell how a file is read, and of all texts of a motion that belong to its record. */
const ANSWERS = ["dt", "units", "baseline", "highpass"], OWN = ["motion", "channel", "vertical", ...ANSWERS];
/** Sampling steps that are offered, s. */
const STEPS = ["0.002", "0.005", "0.01", "0.02"];

/** What tells a record from others. @param {Texts} texts */
export const idOf = ({motion, channel}) => `${motion}#${channel ?? ""}`;

export class RecordList {
  constructor() {
    /** @type {{title: string, reason: string, rows: Row[]}[]} */
    this.groups = [];
    /** Meshes that were opened, by their texts. @type {Record<string, string>} */
    this.meshes = {};
    /** Answers about a file, by its key. @type {Record<string, Texts>} */
    this.answers = {};
    /** Ids of the ticked records; null: all horizontal ones. @type {Set<string> | null} */
    this.ticked = null;
    this.rising = false;
    /** @type {any} */
    this.usage = {};
  }

  /** Take over what an address says. @param {import("./state.js").State} state */
  read({texts, assessment: {records}}) {
    const entries = (records ?? "").split(";").filter(Boolean).map((entry) => /** @type {Texts} */ (Object.fromEntries(new URLSearchParams(entry))));
    this.ticked = records ? new Set(entries.map(idOf)) : null;
    if (records) this.rising = entries.some(({vertical}) => vertical);
    for (const {motion = "", ...given} of [...entries, texts]) {
      const told = Object.entries(given).filter(([name]) => ANSWERS.includes(name));
      if (told.length && motion.startsWith("file:")) this.answers[motion.replace("file:", "")] = Object.fromEntries(told);
    }
  }

  async load() {
    const answers = Object.entries(this.answers).map(([key, texts]) => new URLSearchParams({key, ...texts}).toString()).join(";");
    const {groups, usage} = await json("/api/list", /** @type {Texts} */ (answers ? {answers} : {}));
    Object.assign(this, {groups, usage});
  }

  rows() { return this.groups.flatMap(({rows}) => rows); }

  /** @param {Texts} texts */
  find(texts) { return this.rows().find((row) => idOf(row.texts) === idOf(texts)); }

  /** @param {Row} row */
  has(row) { return Boolean(row.measures) && (this.ticked ? this.ticked.has(idOf(row.texts)) : !row.is_up); }

  /** @param {Row[]} rows @param {boolean} on */
  tick(rows, on) {
    this.ticked ??= new Set(this.rows().filter((row) => this.has(row)).map(({texts}) => idOf(texts)));
    for (const {texts} of rows) if (on) this.ticked.add(idOf(texts)); else this.ticked.delete(idOf(texts));
  }

  /** Texts of the ticked records for the address. */
  entries() {
    return this.rows().filter((row) => this.has(row)).map(({texts, vertical}) => new URLSearchParams({...texts, ...(this.rising && vertical ? {vertical} : {})}).toString()).join(";");
  }

  /** Texts of a case with a record as its motion, scaled as before. @param {Texts} texts @param {Row} row @returns {Texts} */
  put(texts, row) {
    const gone = [...OWN, ...(texts.motion === "none" ? namesOf("start") : [])];
    return {...Object.fromEntries(Object.entries(texts).filter(([name]) => !gone.includes(name))), ...row.texts};
  }

  /** Vertical components that a record may have, its own first. @param {Row | undefined} row @returns {[string, string][]} */
  verticals(row) {
    const text = (/** @type {Row} */ {key, texts: {motion, channel}}) => (!channel ? motion : key === row?.key ? channel : `${motion}#${channel}`);
    const found = /** @type {[string, string][]} */ (this.rows().filter(({is_up: up, measures}) => up && measures).map((each) => [text(each), each.title]));
    return found.sort(([one], [other]) => Number(other === row?.vertical) - Number(one === row?.vertical));
  }
}

/** Send a file; a folder, or a file that is gone, is reported. @param {File} file */
export async function sendFile(file) {
  if (file.size > LARGEST) throw new Problem(`${file.name} is larger than 16 MiB; cut a record into smaller files, or make a mesh coarser.`);
  try { await file.slice(0, 1).arrayBuffer(); } catch { throw new Problem(`${file.name} cannot be read; it may be a folder, or gone.`); }
  return json("/api/files", {name: file.name}, {method: "POST", body: file});
}

/** Questions on what files do not say: one answer for all of them. @param {Row[]} rows @param {(rows: Row[], name: string, value: string) => void} answer */
export function questions(rows, answer) {
  return ["units", "dt"].flatMap((name) => {
    const open = [...new Map(rows.filter(({missing}) => missing.includes(name)).map((row) => [row.key, row])).values()];
    if (!open.length) return [];
    const choices = name === "units" ? Object.keys(specification.record_units) : STEPS;
    const result = (/** @type {Row} */ {raw: {pga, duration}}, /** @type {string} */ value) => (name === "units" ? `PGA ${acceleration(pga * specification.record_units[value])}` : `lasts ${short(duration * Number(value), 4)} s`);
    const other = make("input", {type: "text", size: 6, "aria-label": "Another sampling step, s", on: {change: () => answer(open, name, other.value)}});
    return [make("div", {class: "missing", role: "group"}, [
      make("p", {}, [`${open.length === 1 ? open[0].file : `${open.length} files`} ${name === "units" ? "without units" : "without a sampling step"}. Choose the right one:`]),
      make("table", {class: "rows"}, [
        ...(open.length > 1 ? [make("tr", {}, [make("td"), ...open.slice(0, 8).map((row) => make("th", {scope: "col"}, [row.file]))])] : []),
        ...choices.map((value) => make("tr", {}, [make("th", {scope: "row"}, [make("button", {type: "button", on: {click: () => answer(open, name, value)}}, [name === "dt" ? `${value} s` : value])]), ...open.slice(0, 8).map((row) => make("td", {}, [result(row, value)]))])),
      ]),
      ...(name === "dt" ? [make("label", {}, ["another (s) ", other])] : []),
    ])];
  });
}

/** Whether a file is a mesh by its name. @param {string} name */
export const isMesh = (name) => specification.mesh_kinds.some((/** @type {string} */ kind) => name.toLowerCase().endsWith(`.${kind}`));
