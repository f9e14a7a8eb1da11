// The block to scale on its moving ground, in step with a cursor on the plots.

import {Latest, payload} from "./api.js";
import {at} from "./histories.js";
import {fillOutline} from "./plan.js";
import {Recording} from "./recording.js";
import {Clicks} from "./sound.js";
import {colour, sharpness, textSize, themed} from "./theme.js";
import {one, say} from "./words.js";
import {decimals, fixed, short} from "./numbers.js";
import {phrase} from "./texts.js";
import {ofG} from "./units.js";

/** Wall-clock seconds that an interval between impacts takes at least where playing slows down for them. */
const SEEN = 0.22;
/** Stretch that is fetched ahead, in wall-clock seconds. */
const AHEAD = 2.5;
/** Times as slow as chosen at most: what is faster then passes unseen. */
const SLOWEST = 50;
/** Times as large as it is that a rotation may be drawn, where the peak says how many. */
const LARGER = [1, 2, 3, 5, 10, 20, 30, 50, 100, 200, 300, 500, 1000];

const still = window.matchMedia("(prefers-reduced-motion: reduce)");

export class View {
  /** @param {any} page @param {import("./histories.js").Histories} histories */
  constructor(page, histories) {
    this.page = page;
    this.histories = histories;
    this.canvas = /** @type {HTMLCanvasElement} */ (one("stage"));
    this.scrubber = /** @type {HTMLInputElement} */ (one("scrub"));
    this.speed = /** @type {HTMLSelectElement} */ (one("speed"));
    this.time = 0;
    this.playing = false;
    this.pace = 1;
    /** @type {any} */
    this.lines = null;
    this.fetch = new Latest((from, to) => this.bring(from, to), (error) => { if (error) this.stop(); page.problem(error, "view-block"); });
    one("play").addEventListener("click", () => this.toggle());
    this.scrubber.addEventListener("input", () => this.seek(this.left() + (Number(this.scrubber.value) / 10000) * (this.right() - this.left())));
    one("to-uplift").addEventListener("click", () => this.jump("uplift"));
    one("to-rest").addEventListener("click", () => this.jump("rest"));
    one("magnify").addEventListener("change", () => this.draw());
    one("stage-frame").addEventListener("keydown", (event) => {
      if (event.key === " ") { event.preventDefault(); this.toggle(); }
    });
    this.clicks = new Clicks();
    one("sound").addEventListener("change", () => this.clicks.turn(/** @type {HTMLInputElement} */ (one("sound")).checked));
    this.recording = new Recording(this, this.clicks);
    still.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.paint()).observe(this.canvas);
    themed(() => this.paint());
  }

  left() { return this.page.shown?.header.window.from ?? 0; }
  right() { return this.page.shown?.header.window.to ?? 1; }

  enter() {
    this.time = this.page.state.at ?? this.time;
    this.draw();
  }

  leave() { if (this.playing) this.stop(); }

  draw() {
    const {header} = this.page.shown ?? {};
    if (!header) return;
    if (this.of !== JSON.stringify(this.page.state.good.texts)) {
      this.of = JSON.stringify(this.page.state.good.texts);
      const before = this.page.shown.arrays.uplift.filter((/** @type {number} */ each) => each <= header.peak_time);
      this.time = this.page.state.at ?? Math.max(this.left(), (before.at(-1) ?? 0) - 0.2);
      this.lines = null;
    }
    this.seek(Math.min(Math.max(this.time, 0), header.duration));
    const larger = this.larger();
    one("magnify").querySelectorAll("option")[0].textContent = this.byPeak() === 1 ? phrase("stage.by_peak_true") : phrase("stage.by_peak_larger", {times: this.byPeak()});
    one("stage-about").textContent = phrase("stage.turns", {
      larger: larger > 1 ? phrase("stage.turns_larger", {times: larger}) : "",
      ground: still.matches ? phrase("stage.still_ground") : header.motion?.filtered ? phrase("stage.filtered") : "",
    });
  }

  /** Times as large as it is that the largest rotation can be drawn without standing beyond its balance. */
  byPeak() {
    const {overturned, peak_over_slenderness: peak} = this.page.shown?.header ?? {};
    return overturned || !(peak > 0) ? 1 : LARGER.findLast((each) => each * peak <= 1) ?? 1;
  }

  /** Times as large as it is that the rotation is drawn. */
  larger() {
    const {value} = /** @type {HTMLSelectElement} */ (one("magnify"));
    return value === "peak" ? this.byPeak() : Number(value);
  }

  /** @param {string} to */
  jump(to) {
    const {arrays} = this.page.shown ?? {};
    if (!arrays) return;
    const sequences = Array.from({length: arrays.sequence.length / 6}, (_, k) => arrays.sequence[6 * k + 1] - 0.4 * Math.min(1, arrays.sequence[6 * k + 1] - arrays.sequence[6 * k] + 0.5));
    const times = to === "uplift" ? Array.from(arrays.uplift, (each) => /** @type {number} */ (each) - 0.1) : sequences;
    const next = times.find((each) => each > this.time + 0.05) ?? times[0];
    if (next !== undefined) this.seek(Math.max(0, next));
  }

  toggle() {
    if (this.playing) { this.stop(); return; }
    if (!this.page.shown) return;
    if (this.time >= this.right() - 1e-9) this.seek(this.left());
    this.playing = true;
    one("play").textContent = phrase("stage.pause");
    one("play").setAttribute("aria-pressed", "true");
    this.before = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  stop() {
    if (this.playing) say(phrase("stage.stands", {time: one("clock").textContent ?? ""}));
    this.playing = false;
    this.recording.stop();
    this.scrubber.setAttribute("aria-valuetext", one("clock").textContent ?? "");
    one("play").textContent = phrase("stage.play");
    one("play").setAttribute("aria-pressed", "false");
    if (this.page.shown) this.page.follow(this.time, false);
  }

  /** @param {number} now */
  tick(now) {
    if (!this.playing) return;
    const elapsed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    if (this.has(this.time)) {
      this.pace = this.slowed(Number(this.speed.value));
      const before = this.time, {impact_time: times, impact_speed: speeds} = this.page.shown.arrays;
      this.time += elapsed * this.pace;
      this.clicks.pass(before, this.time, this.pace, times, speeds);
    }
    if (this.time >= this.right()) { this.time = this.right(); this.stop(); }
    this.seek(this.time);
    if (this.playing) requestAnimationFrame((next) => this.tick(next));
  }

  /** Pace at which the interval between impacts can be seen. @param {number} chosen */
  slowed(chosen) {
    if (!/** @type {HTMLInputElement} */ (one("slow")).checked) return chosen;
    const {impact_time: impacts, interval} = this.page.shown.arrays;
    let low = 0, high = impacts.length;
    while (low < high) { const middle = (low + high) >> 1; if (impacts[middle] <= this.time) low = middle + 1; else high = middle; }
    const now = interval[low - 1];
    return Number.isFinite(now) && now > 0 ? Math.max(Math.min(chosen, now / SEEN), chosen / SLOWEST) : chosen;
  }

  /** @param {number} time */
  has(time) {
    return this.lines && this.lines.from <= time && time <= this.lines.to && this.lines.to - this.lines.from < 40 * AHEAD * Math.max(this.pace, 1e-9);
  }

  /** @param {number} time */
  seek(time) {
    const {header} = this.page.shown ?? {};
    if (!header) return;
    this.time = Math.min(Math.max(time, 0), header.duration);
    const width = AHEAD * this.pace;
    const near = this.has(this.time) && (this.lines.to >= header.duration || this.time < this.lines.to - 0.3 * width);
    if (!near) void this.fetch.ask(Math.max(0, this.time - 0.1 * width), Math.min(header.duration, this.time + width));
    this.paint();
    const shown = this.right() - this.left();
    this.scrubber.value = String(Math.round((10000 * (this.time - this.left())) / shown));
    const said = phrase("time.seconds", {time: fixed(this.time, decimals(Math.min(1, this.pace)))});
    if (!this.playing) this.scrubber.setAttribute("aria-valuetext", said);
    one("clock").textContent = said;
    this.recording.progress();
    this.page.follow(this.time, this.playing);
  }

  /** @param {number} from @param {number} to */
  async bring(from, to) {
    if (!(to > from)) return;
    const texts = {...this.page.state.good.texts, from: String(from), to: String(to), ground: "1", points: "1200"};
    const {of} = this, {header, arrays} = await payload("/api/window", texts);
    if (this.of !== of) return; // another case is shown meanwhile
    this.lines = {...header.window, ...arrays};
    if (!this.playing) this.paint();
  }

  /** Draw the block, its ground and what is behind it. */
  paint() {
    const {header} = this.page.shown ?? {};
    const ratio = sharpness();
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (!header || !width) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const inside = this.lines && this.time >= this.lines.from && this.time <= this.lines.to ? this.lines : null;
    if (!inside && this.lines) return; // what is drawn stays until the next stretch has come
    const pen = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (this.recording.on) {
      pen.fillStyle = colour("paper"); // a video has no page behind it
      pen.fillRect(0, 0, width, height);
    }
    this.canvas.dataset.shown = inside ? String(this.time) : "";
    if (!inside) {
      this.scene(pen, width, height, header.block.outline, 0, 0);
      return;
    }
    const after = this.time - inside.from;
    const theta = at(inside.time, inside.rotation, after), moved = still.matches ? 0 : at(inside.displacement_time, inside.displacement, after);
    this.scene(pen, width, height, header.block.outline, theta, moved);
    this.caption(pen, width, theta, at(inside.ground_time, inside.ground_g, after), moved);
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} width @param {number} height @param {any} outline @param {number} theta @param {number} moved */
  scene(pen, width, height, outline, theta, moved) {
    const {left, right, centre, top, widest} = outline;
    const reach = Math.hypot(2 * widest, top);
    const floor = height - 40, above = textSize(13) > 13 ? 122 : 52; // what large text needs
    const scale = (floor - above) / Math.max(reach, 1e-9);
    const drawn = theta * this.larger();
    // The ground moves across a still background; where it would leave the picture, the background moves instead.
    const widthBeside = Math.max(0, width / 2 - scale * reach * 0.75 - 20); // pixels that are free on each side of the block
    const shift = Math.max(-widthBeside, Math.min(widthBeside, scale * moved));
    const behind = scale * moved - shift;
    const middle = width / 2 + shift;
    const step = this.background(pen, width, floor, scale, behind);
    this.ground(pen, width, height, floor, middle);
    pen.fillStyle = colour("ink");
    pen.font = `${textSize(12)}px system-ui, sans-serif`;
    pen.textAlign = "right";
    pen.fillText(phrase("stage.grid", {step}), width - 10, height - 8);
    pen.save();
    const pivot = drawn >= 0 ? right : -left;
    pen.translate(middle + scale * pivot, floor);
    pen.rotate(drawn);
    pen.translate(-scale * pivot, 0);
    const {profile} = this.page.shown.arrays;
    if (profile) fillOutline(pen, profile, scale);
    else {
      pen.beginPath();
      pen.rect(-scale * left, -scale * top, scale * (left + right), scale * top);
      pen.fillStyle = colour("stone");
      pen.fill();
      pen.lineWidth = 1.5;
      pen.strokeStyle = colour("ink");
      pen.stroke();
    }
    pen.beginPath();
    pen.arc(0, -scale * centre, 3.5, 0, 2 * Math.PI);
    pen.fillStyle = colour("ink");
    pen.fill();
    pen.setLineDash([3, 4]);
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(scale * pivot, 0);
    pen.lineTo(0, -scale * centre);
    pen.stroke();
    pen.restore();
    if (drawn !== 0) {
      pen.beginPath();
      pen.arc(middle + scale * pivot, floor, 5, 0, 2 * Math.PI);
      pen.fillStyle = colour("accent");
      pen.fill();
      pen.lineWidth = 2;
      pen.strokeStyle = colour("paper");
      pen.stroke();
    }
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} width @param {number} floor @param {number} scale @param {number} behind */
  background(pen, width, floor, scale, behind) {
    const wanted = 70 / scale, power = 10 ** Math.floor(Math.log10(wanted));
    const step = power * ([1, 2, 5].find((each) => each * power >= wanted) ?? 10);
    pen.strokeStyle = colour("grid");
    pen.lineWidth = 1;
    pen.beginPath();
    const first = Math.floor((behind - width / 2) / (scale * step));
    for (let k = first; k * step * scale < behind + width / 2 + 1; k += 1) {
      const x = Math.round(width / 2 + k * step * scale - behind) + 0.5;
      pen.moveTo(x, 0);
      pen.lineTo(x, floor);
    }
    for (let y = floor; y > 0; y -= step * scale) { pen.moveTo(0, Math.round(y) + 0.5); pen.lineTo(width, Math.round(y) + 0.5); }
    pen.stroke();
    return step;
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} width @param {number} height @param {number} floor @param {number} middle */
  ground(pen, width, height, floor, middle) {
    pen.fillStyle = colour("rest");
    pen.fillRect(0, floor, width, height - floor);
    pen.strokeStyle = colour("earth");
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(0, floor);
    pen.lineTo(width, floor);
    const pitch = 16;
    for (let x = (((middle % pitch) + pitch) % pitch) - pitch; x < width + pitch; x += pitch) { pen.moveTo(x + 8, floor + 2); pen.lineTo(x - 2, floor + 14); }
    pen.stroke();
  }

  /** @param {CanvasRenderingContext2D} pen @param {number} width @param {number} theta @param {number} ground @param {number} moved */
  caption(pen, width, theta, ground, moved) {
    pen.fillStyle = colour("ink");
    const size = Math.min(textSize(13), Math.round(width / 20));
    pen.font = `${size}px system-ui, sans-serif`;
    pen.textAlign = "left";
    const alpha = this.page.shown.header.block.sides[theta >= 0 ? 0 : 1].alpha;
    const rows = [phrase("stage.rotation", {rotation: theta, share: short(theta / alpha)}), phrase("stage.ground", {acceleration: ofG(ground, 2), moved})];
    const larger = this.larger();
    if (larger > 1) rows.push(phrase("stage.larger", {times: larger}));
    rows.forEach((row, k) => pen.fillText(row, 12, 9 + size * (1 + 1.4 * k)));
    pen.textAlign = "right";
    if (this.playing && this.pace < 0.999 * Number(this.speed.value)) pen.fillText(phrase("stage.slowed", {pace: short(this.pace, 2)}), width - 12, 9 + size);
  }
}
