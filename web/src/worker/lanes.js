// The map as a module of WebAssembly that iterates several points at once, one in each lane.

/** @import { Data, Kernel, Observable } from "../types" */
/**
 * @typedef {"parameters" | "coefficients" | "states" | "extents" | "records" | "jacobian"} Place
 */

/** Number of records that the memory has room for. */
const RECORDS = 2048;

/**
 * State to go on from. An offset that decays for good would end among subnormal numbers, with which
 * processors are slow.
 * @param {number[]} state
 */
export const going = (state) => state.map((value) => (Math.abs(value) < 1e-100 ? 0 : value));

/**
 * Whether a value is beyond a half-width.
 * @param {number} value
 * @param {number | null | undefined} width
 */
export const beyond = (value, width) => !(Math.abs(value) <= (width ?? Infinity));

export class LaneMap {
  /**
   * Instantiates a module and lays out its memory.
   * @param {Uint8Array<ArrayBuffer>} module
   * @param {Data} data
   */
  constructor(module, data) {
    this.data = data;
    const instance = new WebAssembly.Instance(new WebAssembly.Module(module));
    this.kernel = /** @type {Kernel} */ (/** @type {unknown} */ (instance.exports));
    this.dimension = Number(this.kernel.DIMENSION.value);
    this.parameters = Number(this.kernel.PARAMETERS.value);
    this.passages = Number(this.kernel.PASSAGES.value);
    this.lanes = Number(this.kernel.LANES.value);
    this.records = RECORDS;
    /** Numbers in a record of one point: its image and its depths. */
    this.width = this.dimension + this.passages;
    /** Bytes of a record of all lanes. */
    this.record = 8 * this.width * this.lanes;
    /** Iterates made so far. */
    this.made = 0;
    let free = Number(this.kernel.FREE_MEMORY.value);
    /** @param {number} count */
    const take = (count) => (free += 8 * count) - 8 * count;
    const { dimension: d, lanes } = this;
    /** @type {Record<Place, number>} */
    this.places = {
      parameters: take(this.parameters * lanes),
      coefficients: take(Number(this.kernel.COEFFICIENTS.value) * lanes),
      states: take(d * lanes),
      extents: take(this.width * lanes),
      records: take(this.width * lanes * RECORDS),
      jacobian: take(d * d),
    };
    const { memory } = this.kernel;
    const missing = Math.ceil(free / 65536) - memory.buffer.byteLength / 65536;
    if (missing > 0) memory.grow(missing);
    this.memory = new Float64Array(memory.buffer);
  }

  /**
   * Numbers from an address on.
   * @param {number} place
   * @param {number} count
   */
  at(place, count) {
    return this.memory.subarray(place / 8, place / 8 + count);
  }

  /**
   * Puts one point into a lane.
   * @param {number} place
   * @param {number} lane
   * @param {number[]} values
   */
  put(place, lane, values) {
    values.forEach((value, n) => (this.memory[place / 8 + n * this.lanes + lane] = value));
  }

  /**
   * Takes one point out of a lane.
   * @param {number} place
   * @param {number} lane
   * @param {number} count
   */
  take(place, lane, count) {
    return Array.from({ length: count }, (_, n) => this.memory[place / 8 + n * this.lanes + lane]);
  }

  /**
   * Iterates all lanes; keeps the records of at most as many iterates as there is room for.
   * @param {number} count
   * @param {boolean} keeps
   */
  iterate(count, keeps) {
    this.made += count * this.lanes;
    const { coefficients, states, extents, records } = this.places;
    this.at(extents, this.record / 8).fill(0);
    const bytes = keeps ? this.record : 0;
    this.kernel.iterate_lanes(coefficients, states, extents, records, count, bytes);
  }

  /**
   * Sets the parameters of every lane.
   * @param {number[][]} parameters
   */
  freeze(parameters) {
    parameters.forEach((own, n) => this.put(this.places.parameters, n, own));
    this.kernel.freeze_lanes(this.places.parameters, this.places.coefficients);
  }

  /**
   * Puts a state into every lane.
   * @param {number[][]} states
   */
  start(states) {
    states.forEach((state, n) => this.put(this.places.states, n, state));
  }

  /**
   * Whether the orbit of a lane escaped: the map has no image, or its states are too large.
   * @param {number} lane
   */
  escaped(lane) {
    const reached = this.take(this.places.extents, lane, this.dimension);
    const last = this.take(this.places.states, lane, this.dimension);
    /** @type {(value: number, n: number) => boolean} */
    const far = (value, n) => !(value <= (this.data.escape[n] ?? Infinity));
    return reached.some(far) || last.some((value, n) => far(Math.abs(value), n));
  }

  /**
   * Whether the last iterates of a lane left the measured window.
   * @param {number} lane
   * @param {number[]} parameters
   */
  outside(lane, parameters) {
    const { window } = this.data;
    const reached = this.take(this.places.extents, lane, this.width);
    return (
      parameters.some((value, n) => beyond(value, window.parameter[n])) ||
      reached.some((value, n) =>
        n < this.dimension
          ? beyond(value, window.state[n])
          : !(value <= (window.depth ?? Infinity)),
      )
    );
  }

  /**
   * Whether the last iterates of a lane made contact.
   * @param {number} lane
   */
  touches(lane) {
    const reached = this.take(this.places.extents, lane, this.width);
    return reached.slice(this.dimension).some((depth) => depth > 0);
  }

  /**
   * Drawn values of the kept iterates of a lane: a coordinate's offset, or −depth of a passage.
   * @param {number} lane
   * @param {Observable} observable
   * @param {number} keep
   */
  observed(lane, { depth, coordinate = 0 }, keep) {
    const record = this.record / 8;
    const row = depth === undefined ? coordinate : this.dimension + depth;
    // The depth in a record is that of the state before the step.
    const after = depth === undefined ? 0 : record;
    const first = this.places.records / 8 + row * this.lanes + lane + after;
    const values = new Float64Array(keep);
    for (let n = 0; n < keep; n++) {
      const value = this.memory[first + n * record];
      values[n] = depth === undefined ? value : -value;
    }
    return values;
  }

  /**
   * Kept states of a lane.
   * @param {number} lane
   * @param {number} count
   */
  kept(lane, count) {
    return Array.from({ length: count }, (_, n) =>
      this.take(this.places.records + n * this.record, lane, this.dimension),
    );
  }

  /**
   * Last kept state of a lane, whose depth stands in the record after it.
   * @param {number} lane
   * @param {number} keep
   */
  lastKept(lane, keep) {
    return this.take(this.places.records + (keep - 1) * this.record, lane, this.dimension);
  }

  /**
   * Sets the parameters of single steps.
   * @param {number[]} parameters
   */
  freezeOne(parameters) {
    this.at(this.places.parameters, this.parameters).set(parameters);
    this.kernel.freeze(this.places.parameters, this.places.coefficients);
  }

  /**
   * Image of one state, its depths and the Jacobian of the map there.
   * @param {number[]} state
   */
  step(state) {
    const { dimension: d, places } = this;
    this.at(places.states, d).set(state);
    const { coefficients, states, records, extents, jacobian } = places;
    this.kernel.step_jacobian(coefficients, states, records, extents, jacobian);
    const rows = Array.from({ length: d }, (_, i) => [...this.at(jacobian + 8 * d * i, d)]);
    return { image: [...this.at(records, d)], depths: [...this.at(extents, this.passages)], rows };
  }
}
