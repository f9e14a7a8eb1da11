// A video of the stage as it plays, in whatever form the browser writes.

import {save} from "./exports.js";
import {one, say} from "./words.js";
import {short} from "./numbers.js";
import {phrase} from "./texts.js";

const FORMS = /** @type {[string, string][]} */ ([
  ["video/webm;codecs=vp9,opus", "webm"], ["video/webm;codecs=vp8,opus", "webm"], ["video/webm", "webm"], ["video/mp4", "mp4"],
]);
/** Bits per second. */
const RATE = 6_000_000;

export class Recording {
  /** @param {import("./block.js").View} view what plays @param {import("./sound.js").Clicks} clicks */
  constructor(view, clicks) {
    this.view = view;
    this.clicks = clicks;
    /** @type {MediaRecorder | null} */
    this.recorder = null;
    this.button = one("record");
    this.form = "MediaRecorder" in window ? FORMS.find(([type]) => MediaRecorder.isTypeSupported(type)) : undefined;
    if (!this.form) {
      /** @type {HTMLButtonElement} */ (this.button).disabled = true;
      this.button.title = phrase("stage.no_recording");
    }
    this.button.addEventListener("click", () => { if (this.recorder) this.view.stop(); else this.start(); });
  }

  get on() { return this.recorder !== null; }

  /** Play from here, or from the start where all is played, and record it. */
  start() {
    if (!this.form) return;
    const [type, ending] = this.form;
    const stream = this.view.canvas.captureStream();
    for (const track of this.clicks.stream()?.getAudioTracks() ?? []) stream.addTrack(track);
    /** @type {Blob[]} */
    const parts = [];
    const recorder = new MediaRecorder(stream, {mimeType: type, videoBitsPerSecond: RATE});
    recorder.addEventListener("dataavailable", ({data}) => { if (data.size) parts.push(data); });
    recorder.addEventListener("stop", () => {
      if (!parts.length) { say(phrase("stage.nothing_recorded")); return; }
      save(`rocking-animation.${ending}`, new Blob(parts, {type: type.split(";")[0]}));
    });
    this.recorder = recorder;
    this.button.textContent = phrase("stage.stop_recording");
    one("recorded").hidden = false;
    recorder.start(500);
    if (!this.view.playing) this.view.toggle();
    this.from = this.view.time;
    this.progress();
    say(phrase("stage.is_recorded"));
  }

  /** Say how much of the window has been recorded. */
  progress() {
    if (!this.recorder) return;
    const {view, from = 0} = this, whole = view.right() - from;
    /** @type {HTMLProgressElement} */ (one("record-progress")).value = whole > 0 ? (view.time - from) / whole : 1;
    one("record-words").textContent = phrase("stage.recorded", {done: short(view.time - from, 2), whole: short(whole, 2)});
  }

  /** The animation has stopped: what was recorded is saved. */
  stop() {
    if (!this.recorder) return;
    this.recorder.stop();
    this.recorder = null;
    this.button.textContent = phrase("stage.record");
    one("recorded").hidden = true;
  }
}
