// What can be saved or copied: figures, data, and the case as code.

import {ends} from "./parameters.js";
import {file} from "./api.js";
import {make, one, say} from "./words.js";
import {phrase} from "./texts.js";

const FORMS = /** @type {[string, string, boolean][]} */ ([
  ["svg", phrase("save.svg"), true], ["png", phrase("save.png"), true], ["csv", phrase("save.csv"), false], ["events.csv", phrase("save.events"), false],
  ["impacts.csv", phrase("save.impacts"), false], ["nc", phrase("save.netcdf"), false],
]);

/** Files of a case, which the server makes; figures show its window. @param {import("./parameters.js").State} state
 * @param {(error: unknown) => void} problem is told what went wrong, or null */
export function showFiles(state, problem) {
  offer(FORMS.map(([form, label, windowed]) => [
    `rocking-response.${form}`, label, () => file("/api/export", {...state.good.texts, form, ...(windowed ? ends(state.good) : {})}),
  ]), problem);
}

/** @typedef {[string, string, () => Promise<Blob>][]} Files names, labels, and what makes them */
/** Buttons that save files. @param {Files} files @param {(error: unknown) => void} problem is told what went wrong, or null */
export function offer(files, problem) {
  one("exports").replaceChildren(...files.map(([name, label, content]) => make("button", {type: "button", on: {click: async () => {
    try {
      save(name, await content());
      problem(null);
    } catch (error) { problem(error); }
  }}}, [label])));
}

/** Files of a map or a diagram, which the page makes of what it has. @param {string} what @param {string} python @param {string | null} command
 * @param {Files} files @param {(error: unknown) => void} problem is told what went wrong, or null */
export function showExports(what, python, command, files, problem) {
  offer(files, problem);
  showCode(what, python, command);
}

/** @param {string} what @param {string} python @param {string | null} command */
export function showCode(what, python, command) {
  one("python-title").textContent = phrase(`save.${what}_python`);
  one("python").textContent = python;
  one("command").replaceChildren(...(command ? command.split(/( +)/).map((part, k) => (k % 2 ? part : make("span", {}, [part]))) : [phrase(`save.no_${what}_command`)]));
  /** @type {HTMLButtonElement} */ (document.querySelector("[data-copy=command]")).disabled = !command;
}

const ROW = 22;

/** A picture with what its colours mean below it. @param {Blob} picture @param {[string, string][]} entries @param {number} width @param {number} height
 * @param {number} columns
 * @returns {Promise<Blob>} */
export async function withLegend(picture, entries, width, height, columns = 2) {
  const rows = entries.map(([text, ink], k) => ({text, ink, x: 62 + (k % columns) * 0.45 * width, y: height + 10 + ROW * Math.floor(k / columns)}));
  const whole = height + ROW * Math.ceil(entries.length / columns) + 18;
  const style = getComputedStyle(document.documentElement);
  const [paper, ink] = ["--paper", "--ink"].map((name) => style.getPropertyValue(name).trim());
  return picture.type === "image/png" ? onCanvas(picture, rows, width, height, whole, paper, ink) : inDrawing(picture, rows, width, height, whole, paper, ink);
}

/** @typedef {{text: string, ink: string, x: number, y: number}[]} Rows */
/** @param {Blob} picture @param {Rows} rows @param {number} width @param {number} height @param {number} whole @param {string} paper @param {string} ink
 * @returns {Promise<Blob>} */
async function onCanvas(picture, rows, width, height, whole, paper, ink) {
  const image = await createImageBitmap(picture);
  const ratio = image.width / width;
  const canvas = /** @type {HTMLCanvasElement} */ (make("canvas", {width: image.width, height: Math.round(whole * ratio)}));
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.fillStyle = paper;
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, 0, 0);
  pen.scale(ratio, ratio);
  pen.font = "13px system-ui, sans-serif";
  pen.strokeStyle = ink;
  for (const row of rows) {
    pen.fillStyle = row.ink;
    pen.fillRect(row.x, row.y, 14, 14);
    pen.strokeRect(row.x, row.y, 14, 14);
    pen.fillStyle = ink;
    pen.fillText(row.text, row.x + 22, row.y + 12);
  }
  return new Promise((done) => { canvas.toBlob((blob) => done(/** @type {Blob} */ (blob)), "image/png"); });
}

/** @param {Blob} picture @param {Rows} rows @param {number} width @param {number} height @param {number} whole @param {string} paper @param {string} ink */
async function inDrawing(picture, rows, width, height, whole, paper, ink) {
  const drawing = new DOMParser().parseFromString(await picture.text(), "image/svg+xml");
  const root = drawing.documentElement;
  /** @param {string} name @param {Record<string, string | number>} given @param {string} [text] */
  const add = (name, given, text = "") => {
    const made = drawing.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(given)) made.setAttribute(key, String(value));
    made.textContent = text;
    root.append(made);
  };
  root.setAttribute("height", String(whole));
  root.removeAttribute("viewBox");
  add("rect", {x: 0, y: height, width, height: whole - height, fill: paper});
  for (const row of rows) {
    add("rect", {x: row.x, y: row.y, width: 14, height: 14, fill: row.ink, stroke: ink});
    add("text", {x: row.x + 22, y: row.y + 12, fill: ink, "font-size": 13, "font-family": "system-ui, sans-serif"}, row.text);
  }
  return new Blob([new XMLSerializer().serializeToString(drawing)], {type: "image/svg+xml"});
}

/** @param {string} name @param {Blob} content */
export function save(name, content) {
  const link = /** @type {HTMLAnchorElement} */ (make("a", {href: URL.createObjectURL(content), download: name}));
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  say(phrase("save.saved", {name}));
}

export function makeCopying() {
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", async () => {
      const source = one(/** @type {HTMLElement} */ (button).dataset.copy ?? "");
      try {
        await navigator.clipboard.writeText(source.textContent ?? "");
        button.textContent = phrase("save.copied");
        say(phrase("save.said_copied"));
      } catch {
        getSelection()?.selectAllChildren(source);
        button.textContent = phrase("save.selected");
      }
      window.setTimeout(() => { button.textContent = phrase("save.copy"); }, 1500);
    });
  }
}
