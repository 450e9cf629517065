// The worker of a live page: it iterates the map of the page, a module of WebAssembly, and answers
// messages. It knows no names and draws nothing.
"use strict";

let map, memory, sizes, places, data;
// The sweep that is being made, by its number; a newer one ends it.
let current = 0;
let waiting = [];
// Iterates made so far.
let made = 0;

const LONGEST_PERIOD = 256;
const PERIOD_TOLERANCE = 1e-8;
const SLICE = 24; // milliseconds between two messages

/** Instantiates the module and lays out its memory for so many records. */
function begin(message) {
  // A sweep of another map has ended.
  current = 0;
  waiting = [];
  data = message.data;
  map = new WebAssembly.Instance(new WebAssembly.Module(message.module)).exports;
  const size = (name) => map[name].value;
  sizes = {
    states: size("DIMENSION"),
    parameters: size("PARAMETERS"),
    passages: size("PASSAGES"),
    coefficients: size("COEFFICIENTS"),
    lanes: size("LANES"),
    records: 2048,
  };
  const { states: d, parameters: p, passages: s, coefficients: c, lanes, records } = sizes;
  let free = size("FREE_MEMORY");
  const take = (count) => (free += 8 * count) - 8 * count;
  places = {
    parameters: take(p * lanes),
    coefficients: take(c * lanes),
    states: take(d * lanes),
    extents: take((d + s) * lanes),
    records: take((d + s) * lanes * records),
    jacobian: take(d * d),
  };
  const missing = Math.ceil(free / 65536) - map.memory.buffer.byteLength / 65536;
  if (missing > 0) map.memory.grow(missing);
  memory = new Float64Array(map.memory.buffer);
}

/** The numbers from an address on. */
const at = (place, count) => memory.subarray(place / 8, place / 8 + count);

/** Puts one point into a lane. */
function put(place, lane, values) {
  values.forEach((value, n) => (memory[place / 8 + n * sizes.lanes + lane] = value));
}

/** Takes one point out of a lane. */
function lane(place, number, count) {
  return Array.from({ length: count }, (_, n) => memory[place / 8 + n * sizes.lanes + number]);
}

/** Iterates all lanes; keeps the records of at most as many as there is room for. */
function iterate(count, keeps) {
  const record = (sizes.states + sizes.passages) * sizes.lanes * 8;
  made += count * sizes.lanes;
  at(places.extents, record / 8).fill(0);
  const { coefficients, states, extents, records } = places;
  map.iterate_lanes(coefficients, states, extents, records, count, keeps ? record : 0);
}

/** Whether an orbit in a lane left for good: its map has no image, or its states are too large. */
function escaped(number) {
  const reached = lane(places.extents, number, sizes.states);
  const last = lane(places.states, number, sizes.states);
  const far = (value, n) => !(value <= (data.escape[n] ?? Infinity));
  return reached.some(far) || last.some((value, n) => far(Math.abs(value), n));
}

/** Whether the last iterates of a lane left the window in which the map was measured. */
function outside(number, parameters) {
  const beyond = (value, width) => !(Math.abs(value) <= (width ?? Infinity));
  const reached = lane(places.extents, number, sizes.states + sizes.passages);
  return (
    parameters.some((value, n) => beyond(value, data.window.parameter[n])) ||
    reached.some((value, n) =>
      n < sizes.states
        ? beyond(value, data.window.state[n])
        : !(value <= (data.window.depth ?? Infinity)),
    )
  );
}

/** What is drawn of the kept iterates of a lane: a coordinate's offset, or −depth of a passage. */
function observed(number, observable, keep) {
  const record = (sizes.states + sizes.passages) * sizes.lanes;
  const depth = observable.depth !== undefined;
  const row = depth ? sizes.states + observable.depth : observable.coordinate;
  // The depth in a record is that of the state before the step.
  const first = places.records / 8 + row * sizes.lanes + number + (depth ? record : 0);
  const values = new Float64Array(keep);
  for (let n = 0; n < keep; n++) {
    const value = memory[first + n * record];
    values[n] = depth ? -value : value;
  }
  return values;
}

/** The last kept state of a lane, whose depth stands in the record after it. */
function lastKept(number, keep) {
  const record = (sizes.states + sizes.passages) * sizes.lanes * 8;
  return lane(places.records + (keep - 1) * record, number, sizes.states);
}

/** Sets the parameters of every lane. */
function freezeAll(parameters) {
  parameters.forEach((own, number) => put(places.parameters, number, own));
  map.freeze_lanes(places.parameters, places.coefficients);
}

/** The same: those of the page, one of them at these offsets. */
const freeze = (request, offsets) =>
  freezeAll(offsets.map((offset) => request.parameters.with(request.axis, offset)));

/** A sweep: the last state is carried from value to value, in as many stretches as there are lanes. */
function* sweep(request) {
  const { columns, from, to, heading, start, keep, transient } = request;
  const width = (to - from) / columns;
  const offset = (column) => from + (column + 0.5) * width;
  const down = heading === "down";
  const ordered = (place) => (down ? columns - 1 - place : place);
  // From the end of the diagram to the view, then to the beginning of each stretch.
  let carried = start.slice();
  const settle = (value, count) => {
    freeze(request, new Array(sizes.lanes).fill(value));
    for (let n = 0; n < sizes.lanes; n++) put(places.states, n, carried);
    iterate(count, false);
    carried = escaped(0) ? start.slice() : lane(places.states, 0, sizes.states);
  };
  const anchor = request.anchor;
  const entry = offset(ordered(0));
  if ((entry - anchor) * (down ? -1 : 1) > 0) {
    for (let n = 0; n <= 40; n++) settle(anchor + ((entry - anchor) * n) / 40, 300);
  }
  const stretch = Math.ceil(columns / sizes.lanes);
  const carriedTo = [];
  for (let n = 0; n < sizes.lanes; n++) {
    for (let part = 0; part < 4; part++) {
      const place = Math.min(columns - 1, Math.floor((n + part / 4) * stretch));
      settle(offset(ordered(place)), 300);
      if (part === 0) carriedTo.push(carried);
    }
  }
  yield;
  const last = new Array(columns);
  let found = [];
  const passes = [
    { every: 8, transient: Math.min(300, transient), keep: Math.min(96, keep) },
    { every: 1, transient, keep },
  ];
  for (const [number, pass] of passes.entries()) {
    let states = carriedTo.map((state) => state.slice());
    for (let place = 0; place < stretch; place += pass.every) {
      const taken = states.map((_, n) => ordered(Math.min(n * stretch + place, columns - 1)));
      const offsets = taken.map(offset);
      freeze(request, offsets);
      states.forEach((state, n) => put(places.states, n, state));
      iterate(pass.transient, false);
      const lost = states.map((_, n) => escaped(n));
      lost.forEach((is, n) => is && put(places.states, n, start));
      iterate(pass.keep + 1, true);
      states = states.map((_, n) => {
        const gone = lost[n] || escaped(n);
        const state = gone ? start.slice() : lastKept(n, pass.keep);
        const own = request.parameters.slice();
        own[request.axis] = offsets[n];
        if (n * stretch + place < columns) {
          const values = gone ? new Float64Array(0) : observed(n, request.observe, pass.keep);
          const entry = { offset: offsets[n], width: width * pass.every, values, state };
          found.push({ ...entry, pass: number, column: taken[n], outside: outside(n, own), gone });
          if (pass.every === 1) last[taken[n]] = gone ? null : state;
        }
        return state;
      });
      if (yield found) found = [];
    }
  }
  // More iterates of every value, for the density.
  for (let more = 0; more < request.more; more++) {
    for (let first = 0; first < columns; first += sizes.lanes) {
      const lanes = Array.from({ length: sizes.lanes }, (_, n) => Math.min(first + n, columns - 1));
      freeze(request, lanes.map(offset));
      lanes.forEach((column, n) => put(places.states, n, last[column] ?? start));
      iterate(keep + 1, true);
      lanes.forEach((column, n) => {
        if (first + n >= columns || !last[column] || escaped(n)) return;
        const values = observed(n, request.observe, keep);
        last[column] = lastKept(n, keep);
        const entry = { offset: offset(column), width, values, state: last[column] };
        found.push({ ...entry, pass: 2, column });
      });
      if (yield found) found = [];
    }
  }
  yield found;
}

/** Classes of a cell that are no period; 0 is no period found. */
const WITHOUT_CONTACT = -1;
const OUTSIDE = -2;
const ESCAPED = -3;
/** Periodic states nearer than this, in half-widths, are of one attractor. */
const SAME_ATTRACTOR = 1e-5;

/** The middle of a cell of so many between two ends. */
const middle = (ends, number, count) => ends[0] + ((number + 0.5) / count) * (ends[1] - ends[0]);

/** Cells of a grid, of 4, 2 and 1 columns and rows, in batches of lanes; `count` are no repeats. */
function* batches(columns, rows, lanes) {
  for (const every of [4, 2, 1]) {
    const cells = [];
    for (let row = 0; row < rows; row += every) {
      for (let column = 0; column < columns; column += every) cells.push([column, row]);
    }
    for (let first = 0; first < cells.length; first += lanes) {
      const count = Math.min(lanes, cells.length - first);
      const own = Array.from({ length: lanes }, (_, n) => cells[first + Math.min(n, count - 1)]);
      yield { every, own, count };
    }
  }
}

/** What the map settles on over two parameters, in cells that become finer. */
function* chart(request) {
  const { axes, x, y, columns, rows, start } = request;
  const longest = Math.min(request.longest, LONGEST_PERIOD);
  const { states: d, passages: s, lanes } = sizes;
  const record = (d + s) * lanes * 8;
  let found = [];
  for (const { every, own, count } of batches(columns, rows, lanes)) {
    const transient = every === 1 ? request.transient : Math.min(request.transient, 500);
    const parameters = own.map(([column, row]) => {
      const half = every / 2 - 0.5;
      const across = middle(x, column + half, columns);
      return request.parameters.with(axes[0], across).with(axes[1], middle(y, row + half, rows));
    });
    freezeAll(parameters);
    own.forEach((_, n) => put(places.states, n, start));
    iterate(transient, false);
    const lost = own.map((_, n) => escaped(n));
    lost.forEach((is, n) => is && put(places.states, n, start));
    iterate(2 * longest, true);
    own.forEach(([column, row], n) => {
      if (n >= count) return;
      let kind = OUTSIDE;
      if (!lost[n] && !escaped(n) && !outside(n, parameters[n])) {
        const states = Array.from({ length: 2 * longest }, (_, k) =>
          lane(places.records + k * record, n, d),
        );
        kind = periodOf(states);
        const deepest = lane(places.extents, n, d + s).slice(d);
        if (kind === 1 && deepest.every((depth) => depth <= 0)) kind = WITHOUT_CONTACT;
      }
      found.push([column, row, every, kind]);
    });
    if (yield found) found = [];
  }
  yield found;
}

/** Where the map takes every state of a plane, in cells that become finer. */
function* basin(request) {
  const { axes, x, y, columns, rows, parameters, state, attractors } = request;
  const { states: d, passages: s, lanes } = sizes;
  const record = (d + s) * lanes * 8;
  const kept = 2 * request.longest;
  let found = [];
  for (const { every, own, count } of batches(columns, rows, lanes)) {
    freezeAll(new Array(lanes).fill(parameters));
    const half = every / 2 - 0.5;
    const starts = own.map(([column, row]) =>
      state
        .with(axes[0], middle(x, column + half, columns))
        .with(axes[1], middle(y, row + half, rows)),
    );
    starts.forEach((start, n) => put(places.states, n, start));
    iterate(request.transient, false);
    const lost = own.map((_, n) => escaped(n));
    // A start may lie outside by itself; what follows it on its way is in the extents.
    const left = own.map(
      (_, n) =>
        outside(n, parameters) ||
        starts[n].some((value, k) => Math.abs(value) > (data.window.state[k] ?? Infinity)),
    );
    lost.forEach((is, n) => is && put(places.states, n, state));
    iterate(kept, true);
    own.forEach(([column, row], n) => {
      if (n >= count) return;
      let kind = lost[n] || escaped(n) ? ESCAPED : OUTSIDE;
      if (kind === OUTSIDE && !left[n] && !outside(n, parameters)) {
        const states = Array.from({ length: kept }, (_, k) =>
          lane(places.records + k * record, n, d),
        );
        const touches = lane(places.extents, n, d + s).slice(d).some((depth) => depth > 0);
        kind = attractorOf(attractors, states, touches);
      }
      found.push([column, row, every, kind]);
    });
    if (yield found) found = [];
  }
  yield found;
}

/** The number of the attractor among those known, which it is added to where it is not. */
function attractorOf(known, states, touches) {
  const period = periodOf(states);
  const near = (a, b) =>
    a.every(
      (value, n) =>
        Math.abs(value - b[n]) <=
        SAME_ATTRACTOR * Math.max(data.window.state[n] ?? 0, Math.abs(value)),
    );
  const same = (other) =>
    other.period === period && (!period || other.states.some((own) => near(own, states[0])));
  const number = known.findIndex(same);
  if (number >= 0) return number;
  return known.push({ period, touches, states: states.slice(0, period || undefined) }) - 1;
}

/** Runs a sweep in slices of time, so that a newer one can end it. */
function run(request) {
  const course = { basin, chart, sweep }[request.course](request);
  const began = performance.now();
  const before = made;
  let flushed = false;
  const slice = () => {
    if (current !== request.number) return;
    const until = performance.now() + SLICE;
    let step, found;
    do {
      step = course.next(flushed);
      flushed = false;
      if (step.value) found = step.value;
    } while (!step.done && performance.now() < until);
    if (found && found.length) {
      const { number, heading, attractors } = request;
      postMessage({ kind: "found", number, heading, attractors, found });
      flushed = true;
    }
    if (!step.done) return setTimeout(slice);
    const time = performance.now() - began;
    const { number, heading } = request;
    postMessage({ kind: "done", number, heading, time, iterates: made - before });
    next();
  };
  slice();
}

/** The next sweep of those asked for together. */
function next() {
  const request = waiting.shift();
  if (request) run(request);
}

/** Period of states that repeat, 0 where none does; in half-widths or, where larger, extents. */
function periodOf(states) {
  const scales = states[0].map((_, n) => {
    const own = states.map((state) => state[n]);
    return Math.max(data.window.state[n] ?? 1, Math.max(...own) - Math.min(...own));
  });
  const apart = (a, b) => a.some((v, n) => !(Math.abs(v - b[n]) <= PERIOD_TOLERANCE * scales[n]));
  for (let period = 1; period <= states.length / 2; period++) {
    let n = 0;
    while (n + period < states.length && !apart(states[n], states[n + period])) n++;
    if (n + period === states.length) return period;
  }
  return 0;
}

/** Eigenvalues of a small matrix, by its characteristic polynomial. */
function eigenvalues(matrix) {
  const size = matrix.length;
  // Faddeev and LeVerrier.
  const coefficients = [1];
  let product = matrix.map((row) => row.map(() => 0));
  for (let k = 1; k <= size; k++) {
    const shifted = product.map((row, i) =>
      row.map((v, j) => v + (i === j ? coefficients[k - 1] : 0)),
    );
    product = matrix.map((row) =>
      shifted[0].map((_, j) => row.reduce((sum, v, n) => sum + v * shifted[n][j], 0)),
    );
    coefficients.push(-product.reduce((sum, row, n) => sum + row[n], 0) / k);
  }
  if (size === 1) return [[-coefficients[1], 0]];
  if (size === 2) {
    const [, b, c] = coefficients;
    const root = b * b - 4 * c;
    if (root < 0)
      return [
        [-b / 2, Math.sqrt(-root) / 2],
        [-b / 2, -Math.sqrt(-root) / 2],
      ];
    const larger = -(b + (b < 0 ? -1 : 1) * Math.sqrt(root)) / 2;
    return [
      [larger, 0],
      [larger === 0 ? 0 : c / larger, 0],
    ];
  }
  // Durand and Kerner.
  const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
  const over = ([a, b], [c, d]) => {
    const norm = c * c + d * d || 1e-300;
    return [(a * c + b * d) / norm, (b * c - a * d) / norm];
  };
  let roots = matrix.map((_, n) => [Math.cos(1 + 2 * n), Math.sin(1 + 2 * n)]);
  for (let step = 0; step < 200; step++) {
    roots = roots.map((root, n) => {
      const value = coefficients.reduce(
        (sum, c) => times(sum, root).map((v, i) => (i ? v : v + c)),
        [0, 0],
      );
      const rest = roots.reduce(
        (own, other, m) => (m === n ? own : times(own, [root[0] - other[0], root[1] - other[1]])),
        [1, 0],
      );
      const move = over(value, rest);
      return [root[0] - move[0], root[1] - move[1]];
    });
  }
  return roots;
}

/** What the map settles on at one value of the parameters: states, depths, period, multipliers. */
function probe(request) {
  const { states: d, passages: s, parameters: p, lanes } = sizes;
  const own = request.parameters;
  for (let n = 0; n < lanes; n++) {
    put(places.parameters, n, own);
    put(places.states, n, request.state);
  }
  map.freeze_lanes(places.parameters, places.coefficients);
  iterate(request.transient, false);
  const count = 2 * LONGEST_PERIOD;
  const gone = escaped(0);
  iterate(count + 1, true);
  const answer = { kind: "probe", token: request.token, parameters: own, gone: gone || escaped(0) };
  if (answer.gone) return answer;
  const record = (d + s) * lanes * 8;
  const states = [];
  const depths = [];
  for (let n = 0; n < count; n++) {
    states.push(lane(places.records + n * record, 0, d));
    depths.push(lane(places.records + (n + 1) * record + 8 * d * lanes, 0, s));
  }
  answer.outside = outside(0, own);
  answer.period = periodOf(states);
  // Jacobians along the orbit: one point at a time.
  at(places.parameters, p).set(own);
  map.freeze(places.parameters, places.coefficients);
  const length = answer.period || count;
  let product = states[0].map((_, i) => states[0].map((_, j) => Number(i === j)));
  let tangent = states[0].map((_, n) => 1 / (n + 1));
  let exponent = 0;
  const turns = answer.period ? Math.max(1, Math.ceil(64 / length)) : 1;
  for (let n = 0; n < length * turns; n++) {
    at(places.states, d).set(states[n % length]);
    const { coefficients, states: from, records, extents, jacobian } = places;
    map.step_jacobian(coefficients, from, records, extents, jacobian);
    const rows = Array.from({ length: d }, (_, i) => [...at(jacobian + 8 * d * i, d)]);
    const moved = rows.map((row) => row.reduce((sum, v, i) => sum + v * tangent[i], 0));
    const size = Math.hypot(...moved) || 1e-300;
    exponent += Math.log(size / Math.hypot(...tangent));
    tangent = moved.map((v) => v / size);
    if (n < length && answer.period) {
      product = rows.map((row) =>
        product[0].map((_, j) => row.reduce((sum, v, i) => sum + v * product[i][j], 0)),
      );
    }
  }
  answer.exponent = exponent / (length * turns);
  answer.multipliers = answer.period ? eigenvalues(product) : [];
  if (answer.period) {
    const largest = Math.max(...answer.multipliers.map(([re, im]) => Math.hypot(re, im)));
    answer.exponent = Math.log(largest) / answer.period;
  }
  answer.states = states;
  answer.depths = depths;
  return answer;
}

/** Images of a state, one after another, with depths: as `grazemap image --iterations` has them. */
function orbit(request) {
  const { states: d, passages: s, lanes, records } = sizes;
  for (let n = 0; n < lanes; n++) {
    put(places.parameters, n, request.parameters);
    put(places.states, n, request.state);
  }
  map.freeze_lanes(places.parameters, places.coefficients);
  const width = d + s;
  const values = new Float64Array(request.count * width);
  for (let first = 0; first < request.count; first += records) {
    const count = Math.min(records, request.count - first);
    iterate(count, true);
    for (let n = 0; n < count; n++) {
      const row = lane(places.records + n * width * lanes * 8, 0, width);
      values.set(row, (first + n) * width);
    }
  }
  return { kind: "orbit", token: request.token, values };
}

/** The image of every point, each with parameters of its own, and the depths that it has. */
function images(request) {
  const { states: d, passages: s, lanes } = sizes;
  const { points } = request;
  const values = new Float64Array(points.length * (d + s));
  for (let first = 0; first < points.length; first += lanes) {
    const own = Array.from(
      { length: lanes },
      (_, n) => points[Math.min(first + n, points.length - 1)],
    );
    freezeAll(own.map(({ parameters }) => parameters));
    own.forEach(({ state }, n) => put(places.states, n, state));
    iterate(1, true);
    for (let n = 0; n < lanes && first + n < points.length; n++)
      values.set(lane(places.records, n, d + s), (first + n) * (d + s));
  }
  return { kind: "images", token: request.token, values };
}

onmessage = ({ data: message }) => {
  if (message.kind === "begin") {
    begin(message);
    postMessage({ kind: "ready" });
  } else if (message.kind === "sweeps") {
    current = message.number;
    waiting = message.sweeps.map((own) => ({ ...own, number: message.number }));
    next();
  } else if (message.kind === "probe") {
    postMessage(probe(message));
  } else if (message.kind === "orbit") {
    postMessage(orbit(message));
  } else if (message.kind === "images") {
    postMessage(images(message));
  }
};
