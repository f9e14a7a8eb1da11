// Records and meshes: chosen, or dropped anywhere on the page.

import {Problem, json} from "./api.js";
import {specification} from "./parameters.js";
import {one} from "./words.js";
import {phrase} from "./texts.js";

const LARGEST = 16 * 2 ** 20;

/** @typedef {"record" | "vertical" | "mesh"} Use */

/** What a file is for: one that is called as meshes are is a mesh, wherever it was chosen. @param {File} file @param {Use} use @returns {Use} */
const useOf = (file, use) => (specification.mesh_kinds.some((/** @type {string} */ kind) => file.name.toLowerCase().endsWith(`.${kind}`)) ? "mesh" : use);

/** @param {File} file @param {Use} [use] */
export async function sendFile(file, use = "record") {
  if (file.size > LARGEST) throw new Problem(phrase(use === "mesh" ? "file.large_mesh" : "file.large_record", {name: file.name}));
  // A folder, or what is no longer there, would fail as if nothing answered.
  try { await file.slice(0, 1).arrayBuffer(); } catch { throw new Problem(phrase("file.unreadable", {name: file.name})); }
  return json(use === "mesh" ? "/api/meshes" : "/api/records", {name: file.name}, {method: "POST", body: file});
}

/** @param {(file: () => Promise<any>, use: Use) => Promise<void>} take @param {(files: File[]) => Promise<void>} list takes several records at once
 * @param {(error: unknown) => void} problem is told what went wrong; the next files are read all the same */
export function acceptFiles(take, list, problem) {
  const input = /** @type {HTMLInputElement} */ (one("file"));
  const dropping = one("dropping");
  /** @type {Use} */
  let chosen = "record";
  const buttons = /** @type {Record<string, Use>} */ ({"choose-file": "record", "choose-vertical": "vertical", "choose-mesh": "mesh"});
  /** What was given before is read first: the last file that was given is the one that is used. @type {Promise<void>} */
  let before = Promise.resolve();
  /** @param {File[]} files @param {Use} wanted */
  const taken = (files, wanted) => { before = before.then(() => read(files, wanted)).catch(problem); };
  /** @param {File[]} files @param {Use} wanted */
  const read = async (files, wanted) => {
    const [meshes, records] = [true, false].map((each) => files.filter((file) => (useOf(file, wanted) === "mesh") === each));
    if (meshes.length) await take(() => sendFile(meshes[0], "mesh"), "mesh");
    if (records.length > 1 && wanted === "record") await list(records);
    else if (records.length) await take(() => sendFile(records[0], wanted), wanted);
  };
  for (const [id, use] of Object.entries(buttons)) {
    one(id).addEventListener("click", () => { chosen = use; input.multiple = use === "record"; input.click(); });
  }
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    taken(files, chosen);
  });
  // Text and links that are dragged are nothing to open, and the browser shall not go where they lead.
  const brings = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files") ?? false;
  let depth = 0;
  window.addEventListener("dragenter", (event) => { if (brings(event)) { depth += 1; dropping.hidden = false; } });
  window.addEventListener("dragleave", (event) => { if (brings(event)) { depth -= 1; dropping.hidden = depth <= 0; } });
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    if (event.dataTransfer && !brings(event)) event.dataTransfer.dropEffect = "none";
  });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    depth = 0;
    dropping.hidden = true;
    taken([...(event.dataTransfer?.files ?? [])], "record");
  });
}
