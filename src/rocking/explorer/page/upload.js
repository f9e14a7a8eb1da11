// Record files: chosen, or dropped anywhere on the page.

import {Problem, json} from "./api.js";
import {one} from "./words.js";

const LARGEST = 16 * 2 ** 20;

/** @param {File} file */
async function sendFile(file) {
  if (file.size > LARGEST) throw new Problem(`${file.name}: it is larger than 16 MiB; cut the record into smaller files`);
  return json("/api/records", {name: file.name}, {method: "POST", body: file});
}

/** @param {(file: () => Promise<any>, upwards: boolean) => Promise<void>} take */
export function acceptFiles(take) {
  const input = /** @type {HTMLInputElement} */ (one("file"));
  const dropping = one("dropping");
  let upwards = false;
  for (const button of [one("choose-file"), one("choose-vertical")]) {
    button.addEventListener("click", () => { upwards = button.id === "choose-vertical"; input.click(); });
  }
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    input.value = "";
    if (file) void take(() => sendFile(file), upwards);
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
    const file = event.dataTransfer?.files?.[0];
    if (file) void take(() => sendFile(file), false);
  });
}
