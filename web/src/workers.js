// Workers with the map: those of sweeps, and one for each module that answers questions.

/** @import { Data, Questions, SweepMessage, WorkerMessage } from "./types" */

export class Workers {
  /**
   * @param {string} source
   * @param {Uint8Array<ArrayBuffer>[]} modules the map's, then those of lower orders
   * @param {Data} data
   */
  constructor(source, modules, data) {
    this.source = new Blob([source], { type: "text/javascript" });
    this.modules = modules;
    this.data = data;
    /** @type {Worker[]} */
    this.asked = [];
    /** @type {Map<number, (answer: any) => void>} */
    this.waiting = new Map();
    this.token = 0;
  }

  /**
   * Worker with one of the modules.
   * @template Item
   * @param {(message: SweepMessage<Item>) => void} receive
   */
  start(receive, chosen = 0) {
    const worker = new Worker(URL.createObjectURL(this.source));
    worker.onmessage = ({ data }) => receive(data);
    this.begin(worker, chosen);
    return worker;
  }

  /**
   * Gives a worker one of the modules.
   * @param {Worker} worker
   * @param {number} chosen
   */
  begin(worker, chosen) {
    /** @type {WorkerMessage} */
    const message = { kind: "begin", module: this.modules[chosen], data: this.data };
    worker.postMessage(message);
  }

  /**
   * Answer of a worker of its own, so that no sweep delays it; by one of the modules.
   * @template {keyof Questions} Kind
   * @param {Kind} kind
   * @param {Questions[Kind][0]} question
   * @returns {Promise<Questions[Kind][1]>}
   */
  ask(kind, question, chosen = 0) {
    if (!this.asked[chosen]) {
      const worker = new Worker(URL.createObjectURL(this.source));
      worker.onmessage = ({ data }) => {
        this.waiting.get(data.token)?.(data);
        this.waiting.delete(data.token);
      };
      this.begin(worker, chosen);
      this.asked[chosen] = worker;
    }
    const token = ++this.token;
    return new Promise((resolve) => {
      this.waiting.set(token, resolve);
      this.asked[chosen].postMessage({ ...question, kind, token });
    });
  }
}
