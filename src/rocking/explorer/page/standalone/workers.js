// Workers that compute beside the page: each runs the same code as the page.

/** Workers at most. */
const MOST = 4;

export class Workers {
  constructor() {
    const text = `self.TEXT = ${JSON.stringify(document.getElementById("data")?.textContent)};\n${document.getElementById("core")?.textContent}\nserve();`;
    this.address = URL.createObjectURL(new Blob([text], {type: "text/javascript"}));
    /** @type {{worker: Worker, busy: boolean}[]} */
    this.workers = [];
    /** @type {{job: any, give: (result: any) => void}[]} */
    this.queue = [];
    this.most = Math.max(1, Math.min(MOST, (navigator.hardwareConcurrency || 2) - 1));
  }

  /** Compute something, after what is already waiting unless it is urgent. @param {any} job @returns {Promise<any>} */
  ask(job) {
    return new Promise((give) => {
      const waiting = {job, give};
      if (job.kind === "column") this.queue.push(waiting); else this.queue.unshift(waiting);
      this.next();
    });
  }

  /** Forget what waits and is of this kind. @param {string} kind */
  drop(kind) { this.queue = this.queue.filter(({job}) => job.kind !== kind); }

  next() {
    if (!this.queue.length) return;
    let free = this.workers.find(({busy}) => !busy);
    if (!free && this.workers.length < this.most) this.workers.push((free = {worker: new Worker(this.address), busy: false}));
    if (!free) return;
    const {job, give} = /** @type {any} */ (this.queue.shift()), chosen = free;
    chosen.busy = true;
    chosen.worker.onmessage = ({data: {id, result}}) => {
      if (id !== 1) { chosen.worker.postMessage({id: 1, job}); return; } // it is ready
      chosen.busy = false;
      chosen.worker.onmessage = null;
      give(result);
      this.next();
    };
    if (/** @type {any} */ (chosen).ready) chosen.worker.postMessage({id: 1, job});
    /** @type {any} */ (chosen).ready = true;
    this.next();
  }
}
