// Requests to the server: one at a time for each purpose, and the latest wins.

import {headers} from "./secret.js";
import {phrase} from "./texts.js";

/** @typedef {Record<string, string>} Texts */
/** @typedef {{header: any, arrays: Record<string, Float64Array>}} Payload */

/** What went wrong, in a sentence for people, and the argument that is wrong, where it is one. */
export class Problem extends Error {
  /** @param {string} sentence @param {string | null} [argument] */
  constructor(sentence, argument = null) {
    super(sentence);
    this.argument = argument;
  }
}

/** @param {string} path @param {Texts} texts */
function address(path, texts) {
  const query = new URLSearchParams(texts).toString();
  return query ? `${path}?${query}` : path;
}

/** @param {string} path @param {Texts} texts @param {RequestInit} [options] */
async function answer(path, texts, options) {
  let response;
  try {
    response = await fetch(address(path, texts), {...options, headers});
  } catch (error) {
    if (error instanceof DOMException) throw error;
    throw new Problem(phrase("page.silent"));
  }
  if (response.ok) return response;
  const text = await response.text();
  const {problem, argument} = response.headers.get("content-type") === "application/json" ? JSON.parse(text) : {problem: text};
  throw new Problem(problem, argument);
}

/** @param {string} path @param {Texts} texts @param {RequestInit} [options] @returns {Promise<any>} */
export async function json(path, texts, options) {
  return (await answer(path, texts, options)).json();
}

/** A file that the server makes. @param {string} path @param {Texts} texts @returns {Promise<Blob>} */
export async function file(path, texts) {
  return (await answer(path, texts)).blob();
}

/** Header and arrays; the arrays are views of what came, not copies.
 * @param {string} path @param {Texts} texts @param {RequestInit} [options] @returns {Promise<Payload>} */
export async function payload(path, texts, options) {
  return unpacked(await (await answer(path, texts, options)).arrayBuffer());
}

/** @param {ArrayBuffer} buffer @returns {Payload} */
export function unpacked(buffer) {
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

/** The first byte of what is written as JSON. */
const BRACE = 123;

/** Parts of a stream, each behind its length in 4 bytes: the first says what it is, and any may say what went wrong.
 * @param {string} path @param {Texts} texts @param {AbortSignal} signal */
export async function* frames(path, texts, signal) {
  const response = await answer(path, texts, {signal});
  const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader();
  /** @type {Uint8Array} */
  let held = new Uint8Array(0);
  for (;;) {
    while (held.length >= 4) {
      const size = new DataView(held.buffer, held.byteOffset).getUint32(0, true);
      if (held.length < 4 + size) break;
      signal.throwIfAborted(); // what has come already is of no use, either
      const part = held.slice(4, 4 + size);
      if (part[0] === BRACE) {
        const {problem, argument} = JSON.parse(new TextDecoder().decode(part));
        if (problem) throw new Problem(problem, argument);
      }
      yield part;
      held = held.subarray(4 + size);
    }
    const {done, value} = await reader.read();
    if (done) return;
    const joined = new Uint8Array(held.length + value.length);
    joined.set(held);
    joined.set(value, held.length);
    held = joined;
  }
}

/** Work of which one is under way, and of all that is asked for meanwhile only the last is done. */
export class Latest {
  /** @param {(...given: any[]) => Promise<void>} work @param {(error: unknown) => void} settled is told what went wrong, or null */
  constructor(work, settled) {
    this.work = work;
    this.settled = settled;
    this.busy = false;
    /** Comes when nothing is under way any more. @type {Promise<void>} */
    this.idle = Promise.resolve();
    /** @type {any[] | null} */
    this.next = null;
  }

  /** @param {any[]} given */
  ask(...given) {
    this.next = given;
    if (!this.busy) this.idle = this.run();
    return this.idle;
  }

  async run() {
    this.busy = true;
    while (this.next) {
      const now = this.next;
      this.next = null;
      try {
        await this.work(...now);
        this.settled(null);
      } catch (error) {
        this.settled(error);
      }
    }
    this.busy = false;
  }
}
