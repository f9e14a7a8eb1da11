// The list of records: searched, sorted, ticked; a click makes one the case's motion; files that leave something out are asked about.

import {Latest, Problem, json} from "./api.js";
import {remaking} from "./focus.js";
import {idOf} from "./list.js";
import {sendFile} from "./upload.js";
import {acceleration, velocity} from "./units.js";
import {counted, make, one, say} from "./words.js";
import {short} from "./numbers.js";
import {inWords, phrase} from "./texts.js";

/** @typedef {import("./list.js").Row} Row */
/** @typedef {import("./list.js").Group} Group */

/** What a heading sorts by. @type {[string, (row: Row) => number | string][]} */
const COLUMNS = [
  [phrase("records.record"), (row) => row.title], [phrase("records.pga"), (row) => row.measures?.pga ?? -1], [phrase("records.pgv"), (row) => row.measures?.pgv ?? -1],
  [phrase("records.significant"), (row) => row.measures?.significant ?? -1], [phrase("records.length"), (row) => row.measures?.duration ?? -1],
];

export class View {
  /** @param {any} page */
  constructor(page) {
    this.page = page;
    this.list = page.list;
    /** Column that the list is sorted by, if any, and whether upwards. @type {[number, boolean] | null} */
    this.order = null;
    this.loading = new Latest(async () => { await this.list.load(); remaking(one("view-records"), () => this.render()); counted("listed"); }, (error) => page.problem(error, "view-records"));
    one("records-search").addEventListener("input", () => this.render());
    one("records-vertical").addEventListener("change", () => {
      this.list.rising = /** @type {HTMLInputElement} */ (one("records-vertical")).checked;
      if (this.list.usage) this.remember(); else void this.reload();
    });
    one("records-choose").addEventListener("click", () => one("choose-file").click());
    one("records-assess").addEventListener("click", () => page.go("assessment"));
  }

  enter() {
    one("save").hidden = true;
    /** @type {HTMLInputElement} */ (one("records-vertical")).checked = this.list.rising;
    void this.loading.ask();
  }

  leave() { one("save").hidden = false; }

  /** The case has changed. */
  update() { this.mark(); }

  /** Take files that were dropped or chosen at once, and say what is wrong with those that are refused. @param {File[]} files */
  async add(files) {
    /** @type {string[]} */
    const keys = [];
    /** @type {string[]} */
    const refused = [];
    this.page.problem(null, "records-said");
    for (const [k, file] of files.entries()) {
      one("records-said").textContent = phrase("records.reading", {number: k + 1, count: files.length, name: file.name});
      try { keys.push((await sendFile(file)).key); } catch (error) {
        if (!(error instanceof Problem)) throw error;
        refused.push(error.message);
      }
    }
    if (keys.length) this.list.drops.push(keys);
    const words = phrase("records.read", {done: keys.length, count: files.length});
    one("records-said").textContent = words;
    say(words);
    // It stays whatever becomes of the list.
    if (refused.length) this.page.problem(new Problem(refused.join("\n")), "records-said");
    await this.loading.ask();
    counted("added");
  }

  /** What is ticked belongs into the address. */
  remember() {
    this.page.state.assessment.records = this.list.entries();
    this.page.remember({assessment: {...this.page.state.assessment}});
  }

  /** Load the list after a change of what is known of files; what of them is ticked changes in the address, too. */
  async reload() {
    await this.loading.ask();
    if (this.list.ticked) this.remember();
  }

  render() {
    const {list} = this, {usage} = list;
    if (!usage) return; // the list has not come yet
    if (!list.ticked) delete this.page.state.assessment.records; // what was not chosen one by one is all that is known now
    const wanted = /** @type {HTMLInputElement} */ (one("records-search")).value.toLowerCase().split(/\s+/).filter(Boolean);
    const seen = (/** @type {Group} */ group, /** @type {Row} */ row) => wanted.every((word) => `${group.title} ${row.title} ${row.label}`.toLowerCase().includes(word));
    const groups = list.groups.map((/** @type {Group} */ group) => ({...group, rows: group.rows.filter((row) => seen(group, row))})).filter((/** @type {Group} */ group) => group.rows.length);
    if (this.order) this.sort(groups);
    const heads = COLUMNS.map(([label], k) => make("th", {scope: "col", ...(this.order?.[0] === k ? {"aria-sort": this.order[1] ? "ascending" : "descending"} : {})}, [
      make("button", {type: "button", className: "sorting", on: {click: () => this.sorted(k)}}, [label]),
    ]));
    one("records-table").replaceChildren(
      make("thead", {}, [make("tr", {}, [make("td", {}, [""]), ...heads, make("td")])]),
      ...groups.map((/** @type {Group} */ group) => this.body(group)),
    );
    one("records-usage").textContent = phrase("records.shown", {
      shown: groups.reduce((/** @type {number} */ sum, /** @type {Group} */ each) => sum + each.rows.length, 0), count: list.rows().length,
      files: usage.files, most: usage.most_files, size: short(usage.bytes / 2 ** 20, 2), most_size: short(usage.most_bytes / 2 ** 20),
    });
    this.ask();
    this.mark();
  }

  /** Sort the rows of each station, and the stations by their first row. @param {Group[]} groups */
  sort(groups) {
    const [column, upwards] = this.order ?? [0, true], key = COLUMNS[column][1];
    const compare = (/** @type {Row} */ one_, /** @type {Row} */ other) => {
      const [first, second] = [key(one_), key(other)];
      return (upwards ? 1 : -1) * (typeof first === "string" ? first.localeCompare(String(second)) : first - Number(second));
    };
    for (const {rows} of groups) rows.sort((first, second) => Number(first.is_up) - Number(second.is_up) || compare(first, second));
    groups.sort((first, second) => compare(first.rows[0], second.rows[0]));
  }

  /** @param {number} column */
  sorted(column) {
    this.order = this.order?.[0] === column ? [column, !this.order[1]] : [column, column === 0];
    remaking(one("view-records"), () => this.render());
  }

  /** Rows of one station. @param {Group} group */
  body({title, reason, rows}) {
    const {list} = this;
    const [{key}] = rows;
    const head = make("tr", {className: "station"}, [make("th", {scope: "rowgroup", colSpan: 6}, [
      title, ...(reason ? [make("small", {}, [` ${inWords(reason)}`])] : []),
    ]), make("td", {}, key ? [make("button", {type: "button", "aria-label": phrase("records.take_out_about", {name: title}), on: {click: () => this.remove(rows)}}, [phrase("records.take_out")])] : [])]);
    return make("tbody", {}, [head, ...rows.map((row) => {
      const {measures} = row;
      const box = /** @type {HTMLInputElement} */ (make("input", {type: "checkbox", checked: list.has(row), disabled: !measures, "aria-label": phrase("records.assess_one", {name: row.title}), on: {change: () => {
        list.tick([row], box.checked);
        this.remember();
      }}}));
      const open = make("button", {type: "button", className: "record", disabled: !measures, "data-record": idOf(row.texts), on: {click: () => this.open(row)}}, [row.title]);
      const values = measures ? [acceleration(measures.pga), velocity(measures.pgv), phrase("time.seconds", {time: short(measures.significant)}), phrase("time.seconds", {time: short(measures.duration)})] : ["?", "?", "?", "?"];
      return make("tr", {}, [box, open, ...values, ""].map((cell) => make("td", {}, [cell])));
    })]);
  }

  /** Let a record shake the block. @param {Row} row */
  open(row) {
    this.page.restate(this.list.casePut(row));
    say(phrase("records.shakes", {name: row.title}));
  }

  /** Mark the case's own motion. */
  mark() {
    const here = idOf(this.page.state.texts);
    for (const each of document.querySelectorAll("[data-record]")) {
      if (/** @type {HTMLElement} */ (each).dataset.record === here) each.setAttribute("aria-current", "true");
      else each.removeAttribute("aria-current");
    }
  }

  /** @param {Row[]} rows */
  async remove(rows) {
    try {
      for (const key of new Set(rows.map((row) => row.key))) await json(`/api/records/${key}`, {}, {method: "DELETE"});
      if (this.list.ticked) this.list.tick(rows, false);
    } catch (error) {
      this.page.problem(error, "records-said");
    }
    void this.reload();
  }

  /** Ask for what the files of each drop do not say: one answer for all, beside what it would make of each. */
  ask() {
    const {list} = this, rows = /** @type {Row[]} */ (list.rows());
    const open = list.drops.flatMap((/** @type {string[]} */ keys) => ["units", "dt"].flatMap((name) => {
      const asked = [...new Map(rows.filter((row) => keys.includes(row.key) && row.missing.includes(name)).map((row) => [row.key, row])).values()];
      if (!asked.length) return [];
      const choices = asked[0].choices[name].map(([value]) => value);
      const dt = name === "dt", all = asked.length > 1;
      const named = (/** @type {string} */ value) => (dt ? phrase(all ? "records.all_dt" : "records.one_dt", {value}) : all ? phrase("records.all_units", {value}) : value);
      const heads = choices.map((value) => make("th", {scope: "col"}, [make("button", {type: "button", on: {click: () => this.answer(asked, name, value)}}, [named(value)])]));
      const lines = asked.map((row) => make("tr", {}, [make("th", {scope: "row"}, [row.file]),
        ...row.choices[name].map(([, figures]) => make("td", {}, [phrase(`file.of_${name}`, figures)]))]));
      return [
        make("p", {className: "derived"}, [phrase(`records.${name}_missing`, {count: asked.length})]),
        make("div", {className: "scroll"}, [make("table", {className: "rows asked"}, [make("thead", {}, [make("tr", {}, [make("th", {scope: "col"}, [phrase("records.file")]), ...heads])]), make("tbody", {}, lines)])]),
      ];
    }));
    one("records-missing").replaceChildren(...open);
    one("records-missing").hidden = !open.length;
  }

  /** @param {Row[]} rows @param {string} name @param {string} value */
  answer(rows, name, value) {
    for (const {key} of rows) this.list.answers[key] = {...this.list.answers[key], [name]: value};
    void this.reload();
  }
}
