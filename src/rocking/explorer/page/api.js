// Requests to the server, which carry the secret of its link; and work of which only the latest request counts.

/** @typedef {Record<string, string>} Texts */
/** @typedef {{header: any, arrays: Record<string, Float64Array>}} Payload */

const KEPT = "rocking-secret";
let secret = "";

/** What went wrong, in a sentence, and the argument that is wrong, if it is one. */
export class Problem extends Error {
  /** @param {string} sentence @param {string | null} [argument] */
  constructor(sentence, argument = null) {
    super(sentence);
    this.argument = argument;
  }
}

/** The secret that this origin has stored. A browser may refuse it: then the page keeps the secret until it is closed. */
function stored() {
  try { return localStorage.getItem(KEPT) ?? secret; } catch { return secret; }
}

/** Exchange the token of the link for the secret, or use the stored one. */
export async function openSession() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  secret = stored();
  if (!token) return;
  history.replaceState(null, "", location.pathname + location.search);
  const response = await fetch("/api/secret", {method: "POST", headers: {authorization: `Bearer ${token}`}}).catch(() => null);
  if (!response?.ok) return;
  secret = await response.text();
  try { localStorage.setItem(KEPT, secret); } catch { /* see above */ }
}

/** @param {string} path @param {Texts} [texts] @param {RequestInit} [options] @returns {Promise<Response>} */
async function answer(path, texts = {}, options = {}) {
  const query = new URLSearchParams(texts).toString(), used = secret;
  let response;
  try {
    response = await fetch(query ? `${path}?${query}` : path, {...options, headers: {authorization: `Bearer ${used}`}});
  } catch (error) {
    if (error instanceof DOMException) throw error;
    throw new Problem("The explorer does not answer. Start it again with rocking explore, and open its link.");
  }
  if (response.ok) return response;
  secret = stored();
  if (response.status === 403 && secret !== used) return answer(path, texts, options); // another tab has opened a new link
  const {problem, argument} = await response.json().catch(() => ({problem: `The server responded with ${response.status}.`}));
  throw new Problem(problem, argument);
}

/** @param {string} path @param {Texts} [texts] @param {RequestInit} [options] @returns {Promise<any>} */
export const json = async (path, texts, options) => (await answer(path, texts, options)).json();

/** @param {string} path @param {Texts} texts */
export const file = async (path, texts) => (await answer(path, texts)).blob();

/** @param {string} path @param {Texts} texts */
export const payload = async (path, texts) => unpack(await (await answer(path, texts)).arrayBuffer());

/** Header and arrays, which are views of the buffer. @param {ArrayBuffer} buffer @returns {Payload} */
function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  /** @type {Record<string, Float64Array>} */
  const arrays = {};
  let at = 4 + length;
  for (const [name, size] of Object.entries(header.arrays)) {
    arrays[name] = new Float64Array(buffer, at, Number(size));
    at += 8 * Number(size);
  }
  return {header, arrays};
}

/** Payloads of a stream, each behind its length in 8 bytes. @param {string} path @param {Texts} texts @param {AbortSignal} signal */
export async function* parts(path, texts, signal) {
  const reader = /** @type {ReadableStream<Uint8Array>} */ ((await answer(path, texts, {signal})).body).getReader();
  /** @type {Uint8Array} */
  let held = new Uint8Array(0);
  for (;;) {
    while (held.length >= 8) {
      const size = new DataView(held.buffer, held.byteOffset).getUint32(0, true);
      if (held.length < 8 + size) break;
      signal.throwIfAborted();
      const part = unpack(/** @type {ArrayBuffer} */ (held.slice(8, 8 + size).buffer));
      if (part.header.problem) throw new Problem(part.header.problem, part.header.argument);
      yield part;
      held = held.subarray(8 + size);
    }
    const {done, value} = await reader.read();
    if (done) return;
    const joined = new Uint8Array(held.length + value.length);
    joined.set(held);
    joined.set(value, held.length);
    held = joined;
  }
}

/** Work of which one is under way; of all that is requested meanwhile, only the last is done. */
export class Latest {
  /** @param {(...given: any[]) => Promise<void>} work @param {(error: unknown) => void} settled receives what went wrong, or null */
  constructor(work, settled) {
    this.work = work;
    this.settled = settled;
    this.busy = false;
    /** @type {any[] | null} */
    this.next = null;
  }

  /** @param {any[]} given */
  async ask(...given) {
    this.next = given;
    if (this.busy) return;
    this.busy = true;
    while (this.next) {
      const now = this.next;
      this.next = null;
      try { await this.work(...now); this.settled(null); } catch (error) { this.settled(error); }
    }
    this.busy = false;
  }
}
