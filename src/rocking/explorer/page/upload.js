// Record files: chosen, or dropped anywhere on the page.

import {Problem, json} from "./api.js";
import {one} from "./words.js";

const LARGEST = 16 * 2 ** 20;

/** @param {File} file */
export async function sendFile(file) {
  if (file.size > LARGEST) throw new Problem(`${file.name}: it is larger than 16 MiB; cut the record into smaller files`);
  return json("/api/records", {name: file.name}, {method: "POST", body: file});
}

/** @param {(file: () => Promise<any>, upwards: boolean) => Promise<void>} take @param {(files: File[]) => Promise<void>} list takes several at once */
export function acceptFiles(take, list) {
  const input = /** @type {HTMLInputElement} */ (one("file"));
  const dropping = one("dropping");
  let upwards = false;
  /** @param {File[]} files @param {boolean} up */
  const taken = (files, up) => {
    if (files.length > 1 && !up) void list(files);
    else if (files.length) void take(() => sendFile(files[0]), up);
  };
  for (const button of [one("choose-file"), one("choose-vertical")]) {
    button.addEventListener("click", () => { upwards = button.id === "choose-vertical"; input.multiple = !upwards; input.click(); });
  }
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    taken(files, upwards);
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
    taken([...(event.dataTransfer?.files ?? [])], false);
  });
}
