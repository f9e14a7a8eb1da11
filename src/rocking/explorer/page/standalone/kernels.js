// Calls of the kernels, which are compiled to WebAssembly from the code of the package. Layouts of structs, codes and
// settings come from the package (DATA): here numbers are put into structs, and read from them.

/** What the package says of its kernels (`describe_computation`). @type {any} */
export const DATA = JSON.parse(/** @type {any} */ (globalThis).TEXT ?? document.getElementById("data")?.textContent ?? "{}");

/** Standard gravity, m/s². @type {number} */
export const GRAVITY = DATA.gravity;

/** @typedef {{breaks: ArrayLike<number>, rows: ArrayLike<number>[], error: number}} Pieces polynomials between breakpoints, m/s² */
/** @typedef {{p: number, alpha: number, restitution: number}} Side */
/** @typedef {{sides: Side[], model: string, threshold: number | null}} Body threshold of rest, as a share of p alpha; null: by proof */
/** @typedef {{side: number, u: number, v: number}} Start */
/** @typedef {{pieces: Pieces | null, factor: number}} Shaking */

const WIDTHS = /** @type {Record<string, number>} */ ({f8: 8, i8: 8, i4: 4, b1: 1});

/** Name of the templates of a body. @param {Body} body */
const kindOf = ({model, threshold}) => `${model} ${threshold === null ? "certified" : "velocity"}`;

/** Pieces of a ground that does not move. @type {Pieces} */
const STILL = {breaks: [0], rows: [], error: 0};

/** @param {string} text */
const fromHex = (text) => Uint8Array.from(text.match(/../g) ?? [], (each) => parseInt(each, 16));
/** @param {Record<string, string>} texts */
const templates = Object.fromEntries(Object.entries(/** @type {Record<string, string>} */ (DATA.templates ?? {})).map(([name, text]) => [name, fromHex(text)]));

/** Compile the kernels. @returns {Promise<Kernels>} */
export async function openKernels() {
  const {instance} = await WebAssembly.instantiate(Uint8Array.from(atob(DATA.wasm), (each) => each.charCodeAt(0)), {});
  return new Kernels(instance.exports);
}

export class Kernels {
  /** @param {any} exports */
  constructor(exports) {
    exports._initialize?.();
    this.exports = exports;
    /** @type {WebAssembly.Memory} */
    this.memory = exports.memory;
    this.start = (exports.__heap_base.value + 15) & ~15;
    this.top = this.floor = this.start;
    /** @type {Pieces | null} */
    this.pieces = null;
  }

  get view() { return new DataView(this.memory.buffer); }

  /** Zeroed memory. @param {number} size */
  take(size) {
    const at = this.top;
    this.top = (at + size + 15) & ~15;
    const lacking = this.top - this.memory.buffer.byteLength;
    if (lacking > 0) this.memory.grow(Math.ceil(lacking / 65536) + 64); // all views so far are void
    new Uint8Array(this.memory.buffer, at, size).fill(0);
    return at;
  }

  /** @param {Uint8Array} bytes */
  put(bytes) {
    const at = this.take(bytes.length);
    new Uint8Array(this.memory.buffer, at, bytes.length).set(bytes);
    return at;
  }

  /** @param {ArrayLike<number>} values */
  doubles(values) {
    const at = this.take(8 * values.length);
    new Float64Array(this.memory.buffer, at, values.length).set(values);
    return at;
  }

  /** Write a field of a struct; one number serves all its items. @param {string} layout @param {number} at @param {string} name @param {number | number[]} value */
  set(layout, at, name, value) {
    const [offset, kind, count] = DATA.layouts[layout].fields[name], {view} = this;
    for (let k = 0; k < count; k += 1) {
      const one = Array.isArray(value) ? value[k] : value, place = at + offset + k * WIDTHS[kind];
      if (kind === "f8") view.setFloat64(place, one, true);
      else if (kind === "i8") view.setBigInt64(place, BigInt(one), true);
      else view.setUint8(place, one);
    }
  }

  /** @param {string} layout @param {number} at @param {string} name @returns {number} */
  get(layout, at, name) {
    const [offset, kind] = DATA.layouts[layout].fields[name], {view} = this;
    return kind === "f8" ? view.getFloat64(at + offset, true) : kind === "i8" ? Number(view.getBigInt64(at + offset, true)) : view.getInt32(at + offset, true);
  }

  /** Call a kernel with its arguments, packed into eight bytes each. @param {string} name @param {number[]} values */
  call(name, values) {
    const {symbol, slots} = DATA.calls[name];
    if (values.length !== slots.length) throw new Error(`${name} accepts ${slots.length} numbers, not ${values.length}`);
    const packed = this.take(8 * values.length), answer = this.take(64), {view} = this;
    values.forEach((value, k) => (slots[k] === "d" ? view.setFloat64(packed + 8 * k, value, true) : view.setBigInt64(packed + 8 * k, BigInt(value), true)));
    return Number(this.exports[symbol](packed, answer) ?? 0);
  }

  /** Arguments of a ground under these pieces; those of the last one remain in memory. @param {Shaking} shaking @returns {number[]} */
  ground({pieces, factor}) {
    const chosen = pieces ?? STILL;
    if (this.pieces !== chosen) {
      this.top = this.start;
      const count = chosen.rows.length, width = Math.max(2, chosen.rows[0]?.length ?? 0), stretches = Math.ceil((count + 1) / DATA.ground.stretch);
      const flat = new Float64Array(count * width), {first} = DATA.ground, columns = first + width;
      chosen.rows.forEach((/** @type {ArrayLike<number>} */ row, /** @type {number} */ k) => flat.set(row, k * width));
      const rows = this.take(8 * (count + 1) * columns), bounds = this.take(16 * stretches);
      this.slots = [rows, count + 1, columns, bounds, stretches, 1, 2, chosen.error, width, first, 1, 1];
      this.floor = this.top;
      const breaks = this.doubles(chosen.breaks), coefficients = this.doubles(flat), scratch = this.doubles(new Float64Array(width));
      this.call("write_pieces", [breaks, chosen.breaks.length, coefficients, count, width, ...this.slots, scratch, width]);
      this.pieces = chosen;
    }
    this.top = this.floor;
    return [.../** @type {number[]} */ (this.slots).slice(0, -2), factor, 1 / GRAVITY];
  }

  /** The struct of a block. @param {Body} body */
  block(body) {
    const {sides, model, threshold} = body, at = this.put(templates[`block ${kindOf(body)}`]), linear = model === "linear", {sin, cos, tan} = this.exports;
    const fields = {
      stiffness: sides.map(({p}) => p * p), slenderness: sides.map(({alpha}) => alpha),
      sine: sides.map(({alpha}) => sin(alpha)), cosine: sides.map(({alpha}) => cos(alpha)),
      threshold: sides.map(({alpha}) => (linear ? alpha : tan(alpha))),
      restoring_gain: sides.map(({p, alpha}) => (linear ? p * p : p * p * cos(alpha))),
      restitution: sides.map(({restitution}) => restitution),
      ...(threshold === null ? {} : {rest_limit: sides.map(({p, alpha}) => threshold * p * alpha)}),
    };
    for (const [name, values] of Object.entries(fields)) this.set("block", at, name, values);
    return at;
  }

  /** Follow a block from its start, at rest by default, to rest or overturning. @param {Body} body @param {Shaking} shaking
   * @param {Start | null} [start] @param {boolean} [recorded] whether the rotation is wanted afterwards */
  march(body, shaking, start = null, recorded = false) {
    const ground = this.ground(shaking), block = this.block(body), scratch = this.take(DATA.layouts.scratch.size);
    const settings = this.put(templates[`settings ${kindOf(body)} ${recorded ? "record" : "state"}`]), state = this.put(templates.state);
    if (start) for (const [name, value] of Object.entries({...start, peak: start.u})) this.set("state", state, name, value);
    const {size} = DATA.layouts.table, {slice, total, per_piece: each} = DATA.budget;
    let rows = recorded ? 256 + 2 * ground[1] : 0, table = this.take(rows * size), status = DATA.statuses.PAUSED;
    for (let k = 0; k < Math.ceil((total + each * ground[1]) / slice) && status === DATA.statuses.PAUSED; k += 1) {
      this.set("state", state, "budget", slice);
      status = this.call("march", [...ground, block, settings, table, rows, scratch, state]);
      while (status === DATA.statuses.FULL) {
        const larger = this.take(2 * rows * size);
        new Uint8Array(this.memory.buffer).copyWithin(larger, table, table + rows * size);
        [table, rows] = [larger, 2 * rows];
        status = this.call("march", [...ground, block, settings, table, rows, scratch, state]);
      }
    }
    const number = (/** @type {string} */ name) => this.get("state", state, name);
    const outcome = {
      status, overturned: status === DATA.statuses.OVERTURNED, peak: number("peak"), peakTime: number("peak_time"), impacts: number("impact_count"),
      uplifts: number("uplift_count"), rests: number("rest_count"), end: number("end_time"), firstUplift: number("first_uplift"), firstRest: number("first_rest"), lastRest: number("last_rest_time"),
    };
    if (!recorded) return {...outcome, events: [], impactTimes: new Float64Array(0), nodes: new Uint8Array(0)};
    const row = (/** @type {number} */ k, /** @type {string} */ name) => this.get("table", table + k * size, name);
    const events = Array.from({length: number("event_count")}, (_, k) => ({time: row(k, "event.time"), kind: row(k, "event.kind"), side: row(k, "event.side")}));
    const impactTimes = Float64Array.from({length: outcome.impacts}, (_, k) => row(k, "impact.time"));
    const nodes = new Uint8Array(number("node_count") * DATA.layouts.node.size), [offset] = DATA.layouts.table.fields["node.time"];
    for (let k = 0; k * DATA.layouts.node.size < nodes.length; k += 1) {
      nodes.set(new Uint8Array(this.memory.buffer, table + k * size + offset, DATA.layouts.node.size), k * DATA.layouts.node.size);
    }
    return {...outcome, events, impactTimes, nodes};
  }

  /** Rotation, angular velocity and acceleration of a response at increasing times: three numbers each.
   * @param {Body} body @param {Shaking} shaking @param {{nodes: Uint8Array}} response @param {ArrayLike<number>} times */
  trace(body, shaking, response, times) {
    const ground = this.ground(shaking), block = this.block(body), {size} = DATA.layouts.node, count = response.nodes.length / size;
    if (!count) return new Float64Array(3 * times.length);
    const settings = this.put(templates[`settings ${kindOf(body)} record`]), nodes = this.put(response.nodes), at = this.doubles(times);
    const rows = this.take(8 * times.length), out = this.take(24 * times.length), scratch = this.take(DATA.layouts.scratch.size);
    const {view} = this, [offset] = DATA.layouts.node.fields.time;
    for (let k = 0, row = 0; k < times.length; k += 1) {
      while (row + 1 < count && view.getFloat64(nodes + (row + 1) * size + offset, true) <= times[k]) row += 1;
      view.setBigInt64(rows + 8 * k, BigInt(row), true);
    }
    this.call("trace", [...ground, block, settings, nodes, count, scratch, at, times.length, rows, times.length, out, times.length, 3]);
    return new Float64Array(this.memory.buffer.slice(out, out + 24 * times.length));
  }
}
