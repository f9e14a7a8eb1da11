// The list of records, which two views share: what the server knows of each, which are ticked, and what was answered of files.

import {json} from "./api.js";
import {namesOf} from "./parameters.js";

/** @typedef {import("./api.js").Texts} Texts */
/** @typedef {{pga: number, pgv: number, significant: number, duration: number}} Measures */
/** @typedef {{texts: Texts, title: string, label: string, is_up: boolean, measures: Measures | null, key: string, file: string, missing: string[],
 * choices: Record<string, [string, Record<string, number>][]>, vertical: string}} Row */
/** @typedef {{title: string, reason: string | import("./texts.js").Message, rows: Row[]}} Group */

/** What tells a record from others. @param {Texts} texts */
export const idOf = ({motion, channel}) => `${motion}#${channel ?? ""}`;

export class RecordList {
  /** @param {import("./parameters.js").State} state */
  constructor(state) {
    this.state = state;
    /** @type {Group[]} */
    this.groups = [];
    /** What was answered of a file, by its key. @type {Record<string, Texts>} */
    this.answers = {};
    /** Keys of the files that came together. @type {string[][]} */
    this.drops = [];
    /** Those that are ticked; at first all horizontal ones of which everything is known. @type {Set<string> | null} */
    this.ticked = null;
    /** Whether records come with their vertical components. */
    this.rising = false;
    /** How often the list was asked for. */
    this.turn = 0;
    this.read();
  }

  /** Take what the address says. */
  read() {
    const {records} = this.state.assessment;
    this.ticked = null;
    this.rising = false;
    if (!records) return;
    const entries = records.split(";").map((entry) => /** @type {Texts} */ (Object.fromEntries(new URLSearchParams(entry)))).filter(({motion}) => motion);
    this.ticked = new Set(entries.map(idOf));
    this.rising = entries.some(({vertical}) => vertical);
    for (const {motion, dt, units} of entries) if (dt || units) this.answers[motion.replace("file:", "")] = {...(dt && {dt}), ...(units && {units})};
  }

  /** Ask the server for the list; an answer that a later one has overtaken is not taken. @returns {Promise<void>} */
  load() {
    this.current = this.fetch();
    return this.current;
  }

  /** @returns {Promise<void>} */
  async fetch() {
    const answers = Object.entries(this.answers).map(([key, texts]) => new URLSearchParams({key, ...texts}).toString()).join(";");
    const turn = this.turn += 1;
    const {groups, usage} = await json("/api/list", /** @type {Texts} */ (answers ? {answers} : {}));
    if (turn !== this.turn) return this.current;
    this.groups = groups;
    this.usage = usage;
    const known = new Set(this.drops.flat());
    const others = [...new Set(this.rows().map(({key}) => key))].filter((key) => key && !known.has(key));
    if (others.length) this.drops.push(others);
    return undefined;
  }

  rows() { return this.groups.flatMap(({rows}) => rows); }

  /** Whether a record is ticked. @param {Row} row */
  has(row) {
    if (!row.measures) return false;
    return this.ticked ? this.ticked.has(idOf(row.texts)) : !row.is_up;
  }

  /** Tick records, or not. @param {Row[]} rows @param {boolean} on */
  tick(rows, on) {
    this.ticked ??= new Set(this.rows().filter((row) => this.has(row)).map(({texts}) => idOf(texts)));
    for (const {texts} of rows) if (on) this.ticked.add(idOf(texts)); else this.ticked.delete(idOf(texts));
  }

  /** Texts of a record as the motion of a case, with its vertical component where that is wanted. @param {Row} row @returns {Texts} */
  motion({texts, vertical}) { return {...texts, ...(this.rising && vertical ? {vertical} : {})}; }

  /** Texts of a case shaken by a record, scaled as it was; what nothing shook is released no more. @param {Row} row @returns {Texts} */
  casePut(row) {
    const gone = namesOf("motion").filter((name) => !["scale", "pga", "pgv", "sa"].includes(name));
    if (this.state.texts.motion === "none") gone.push(...namesOf("start"));
    return {...Object.fromEntries(Object.entries(this.state.texts).filter(([name]) => !gone.includes(name))), ...this.motion(row)};
  }

  /** All that are ticked, as an address has them; a mark alone where none is, since an address without entries means all. */
  entries() {
    return this.rows().filter((row) => this.has(row)).map((row) => new URLSearchParams(this.motion(row)).toString()).join(";") || ";";
  }
}
