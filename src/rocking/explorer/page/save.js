// Files that are saved, code that is copied, and tables.

import {make, one} from "./standalone/dom.js";

/** Words of a name as parts of a file's name. @param {string} name */
export const slug = (name) => name.replaceAll("α", "alpha").replaceAll("°", "deg").normalize("NFKD").replace(/[^A-Za-z0-9.-]+/g, "-").replace(/[-.]+$|^-+/g, "").slice(0, 90);

/** Buttons that save files, and code. @param {any[][]} files names, labels, and functions that return the contents @param {string} python @param {string | null} command @param {any} page @param {string} [instead] of a command */
export function offer(files, python, command, page, instead = "No single command computes this; use the Python code.") {
  one("exports").replaceChildren(...files.map(([name, label, content]) => make("button", {type: "button", on: {click: async () => {
    try { save(name, await content()); page.problem(null, "exports"); } catch (error) { page.problem(error, "exports"); }
  }}}, [label])), make("button", {type: "button", on: {click: () => window.print()}}, ["Print"]));
  one("python").textContent = python;
  one("command").textContent = command ?? instead;
  /** @type {any} */ (document.querySelector("[data-copy=command]")).disabled = !command;
}

/** @param {string} name @param {Blob} content */
function save(name, content) {
  const link = make("a", {href: URL.createObjectURL(content), download: name});
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  one("said").textContent = `${name} is saved.`;
}

/** A table as a file. @param {(string | number)[][]} rows @param {string[]} [comments] */
export const csv = (rows, comments = []) => new Blob([[...comments.map((each) => `# ${each}`), ...rows.map((row) => row.map((each) => (typeof each === "number" ? (Number.isNaN(each) ? "" : each === Infinity ? "inf" : Number(each.toPrecision(8))) : /[",\n]/.test(each) ? `"${each.replaceAll('"', '""')}"` : each)).join(",")), ""].join("\n")], {type: "text/csv"});

export function copyButtons() {
  for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-copy]"))) button.addEventListener("click", async () => {
    const source = one(button.dataset.copy ?? "");
    try { await navigator.clipboard.writeText(source.textContent ?? ""); button.textContent = "Copied"; } catch {
      getSelection()?.selectAllChildren(source);
      button.textContent = "Selected";
    }
    window.setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
}

/** @param {Element} place @param {string[]} head @param {(string | Node)[][]} rows */
export function table(place, head, rows) {
  place.replaceChildren(...(head.length ? [make("thead", {}, [make("tr", {}, head.map((name) => (name ? make("th", {scope: "col"}, [name]) : make("td"))))])] : []),
    make("tbody", {}, rows.map((row) => make("tr", {}, row.map((cell) => make("td", {}, [cell]))))));
}

/** Figures with a name and a remark. @param {Element} place @param {[string, string, string][]} all */
export const figures = (place, all) => place.replaceChildren(...all.map(([name, value, more]) => make("div", {}, [make("dt", {}, [name]), make("dd", {}, [value, make("small", {}, [more])])])));
