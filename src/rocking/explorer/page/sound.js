// A click for each impact, louder with its speed, at the pace at which the block is shown: chattering is heard as it is seen.

/** Seconds of a click, and how fast it fades, per second. */
const LENGTH = 0.03, FADING = 220;
/** Hertz of its tone. */
const PITCH = 900;
/** Clicks of one frame at most: what is denser is one sound. */
const MOST = 48;
/** Part of full loudness with which the softest impact is heard. */
const SOFTEST = 0.06;

export class Clicks {
  constructor() {
    this.on = false;
    /** @type {AudioContext | null} */
    this.context = null;
    /** @type {AudioBuffer | null} */
    this.click = null;
    /** Where a recording takes the sound from. @type {MediaStreamAudioDestinationNode | null} */
    this.recorded = null;
    /** Speed of the hardest impact, and the impacts it was found for. @type {[number, Float64Array | null]} */
    this.hardest = [0, null];
  }

  /** @param {boolean} on */
  turn(on) {
    this.on = on;
    if (!on) return;
    if (!this.context) this.build();
    void this.context?.resume();
  }

  build() {
    const context = new AudioContext();
    const {sampleRate} = context;
    const click = context.createBuffer(1, Math.round(LENGTH * sampleRate), sampleRate);
    click.getChannelData(0).forEach((_, k, samples) => { samples[k] = Math.exp((-FADING * k) / sampleRate) * Math.sin((2 * Math.PI * PITCH * k) / sampleRate); });
    [this.context, this.click] = [context, click];
  }

  /** Sound as a recording takes it, or null where there is none. */
  stream() {
    if (!this.on || !this.context) return null;
    this.recorded ??= this.context.createMediaStreamDestination();
    return this.recorded.stream;
  }

  /** The impacts between two times have been shown, at a pace. @param {number} from @param {number} to @param {number} pace seconds of the block per second
   * @param {Float64Array} times @param {Float64Array} speeds */
  pass(from, to, pace, times, speeds) {
    if (!this.on || !(to > from)) return;
    if (this.hardest[1] !== speeds) this.hardest = [speeds.reduce((most, each) => Math.max(most, each), 0), speeds];
    const first = times.findIndex((each) => each > from);
    if (first < 0) return;
    let end = first;
    while (end < times.length && times[end] <= to) end += 1;
    const stride = Math.max(1, Math.ceil((end - first) / MOST));
    for (let k = first; k < end; k += stride) this.sound((times[k] - from) / pace, SOFTEST + (1 - SOFTEST) * (speeds[k] / (this.hardest[0] || 1)));
  }

  /** @param {number} after seconds from now @param {number} loudness from 0 to 1 */
  sound(after, loudness) {
    const {context} = this;
    if (!context) return;
    const source = context.createBufferSource(), gain = context.createGain();
    source.buffer = this.click;
    gain.gain.value = loudness;
    source.connect(gain).connect(context.destination);
    if (this.recorded) gain.connect(this.recorded);
    source.start(context.currentTime + after);
  }
}
