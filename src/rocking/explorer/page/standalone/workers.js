// Workers that compute beside the page: each runs the same code as the page. Without workers the page computes by itself.

import {openKernels} from "./kernels.js";
import {JOBS} from "./jobs.js";

/** Workers at most. */
const MOST = 4;

/** @typedef {{job: any, give: (result: any) => void}} Waiting */

export class Workers {
  constructor() {
    const text = `self.TEXT = ${JSON.stringify(document.getElementById("data")?.textContent)};\n${document.getElementById("core")?.textContent}\nserve();`;
    this.address = URL.createObjectURL(new Blob([text], {type: "text/javascript"}));
    /** Workers, each with what it computes. @type {{worker: Worker, doing: Waiting | null}[]} */
    this.workers = [];
    /** @type {Waiting[]} */
    this.queue = [];
    this.alone = false;
    /** @type {Promise<import("./kernels.js").Kernels> | null} */
    this.kernels = null;
    this.most = Math.max(1, Math.min(MOST, (navigator.hardwareConcurrency || 2) - 1));
  }

  /** Compute something: columns of a map in their order, all else before them. @param {any} job @returns {Promise<any>} */
  ask(job) {
    if (this.alone) return this.compute(job);
    return new Promise((give) => {
      if (job.kind === "column") this.queue.push({job, give}); else this.queue.unshift({job, give});
      this.next();
    });
  }

  /** Forget what waits and is of this kind. @param {string} kind */
  drop(kind) { this.queue = this.queue.filter(({job}) => job.kind !== kind); }

  /** Compute on the page itself, between what it draws. @param {any} job */
  async compute(job) {
    this.kernels ??= openKernels();
    const kernels = await this.kernels;
    await new Promise((wake) => setTimeout(wake));
    return JOBS[job.kind](kernels, job);
  }

  /** Do without workers. */
  resign() {
    this.alone = true;
    const left = this.workers.splice(0).flatMap(({doing}) => doing ?? []);
    for (const {job, give} of [...left, ...this.queue.splice(0)]) void this.compute(job).then(give);
  }

  next() {
    while (this.queue.length) {
      const free = this.workers.find(({doing}) => !doing) ?? (this.workers.length < this.most ? this.hire() : undefined);
      if (!free) return;
      free.doing = this.queue.shift() ?? null;
      free.worker.postMessage(free.doing?.job);
    }
  }

  /** Start another worker. */
  hire() {
    try {
      const worker = new Worker(this.address), hired = {worker, doing: /** @type {Waiting | null} */ (null)};
      worker.onerror = () => this.resign();
      worker.onmessage = ({data}) => {
        hired.doing?.give(data);
        hired.doing = null;
        this.next();
      };
      this.workers.push(hired);
      return hired;
    } catch {
      this.resign();
      return undefined;
    }
  }
}
