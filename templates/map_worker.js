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
const APPROACH_TOLERANCE = 1e-5;
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

/**
 * A state to go on from. An offset that decays for good would end among the numbers below the
 * normal ones, with which processors are slow.
 */
const going = (state) => state.map((value) => (Math.abs(value) < 1e-100 ? 0 : value));

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

/** Whether the last iterates of a lane made contact. */
const touches = (number) =>
  lane(places.extents, number, sizes.states + sizes.passages)
    .slice(sizes.states)
    .some((depth) => depth > 0);

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
    carried = escaped(0) ? start.slice() : going(lane(places.states, 0, sizes.states));
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
        const state = gone ? start.slice() : going(lastKept(n, pass.keep));
        const own = request.parameters.slice();
        own[request.axis] = offsets[n];
        if (n * stretch + place < columns) {
          const values = gone ? new Float64Array(0) : observed(n, request.observe, pass.keep);
          const entry = { offset: offsets[n], width: width * pass.every, values, state };
          const period = gone ? null : periodSeen(values, request.observe);
          const what = { outside: outside(n, own), touches: touches(n), gone, period };
          found.push({ ...entry, ...what, pass: number, column: taken[n] });
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
        last[column] = going(lastKept(n, keep));
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
const NOT_SETTLED = -4;
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
        const apart = distances(states);
        kind = periodOf(states) || approached(states.length, apart, APPROACH_TOLERANCE);
        if (!kind && converges(states.length, apart)) kind = NOT_SETTLED;
        if (kind === 1 && !touches(n)) kind = WITHOUT_CONTACT;
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
        kind = attractorOf(attractors, states, touches(n));
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
  const distance = (a, b) =>
    Math.max(...a.map((value, n) => Math.abs(value - b[n]) / (data.window.state[n] ?? 1)));
  // A multiplier of modulus near 1 leaves an orbit long on its way: it comes nearer.
  const approaches = (other) => {
    const far = other.states.map((own) => distance(own, states[0]));
    const first = far.indexOf(Math.min(...far));
    const turns = 2 * other.period * Math.floor((states.length - 1) / (2 * other.period));
    const then = distance(other.states[first], states[turns]);
    return turns > 0 && far[first] < 0.05 && then < 0.98 * far[first];
  };
  const same = (other) =>
    (other.period === period && (!period || other.states.some((own) => near(own, states[0])))) ||
    (other.period && approaches(other));
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

/** Share of its first amplitude below which an alternation has shrunk. */
const SHRUNK = 0.95;

/** Distance of states a period apart, in scales, of an orbit that converges, at most. */
const NEARBY = 0.1;

/** Fewest and most parts of a run in which its states come nearer. */
const PARTS = [4, 8];

/** The largest distance of states from those so many later, from one state to before another. */
function farthest(apart, shift, first, end) {
  let most = 0;
  for (let n = first; n < end; n++) most = Math.max(most, apart(n, shift));
  return most;
}

/**
 * Period of a run of so many states that repeat, 0 where none does; `apart(n, shift)` is how far a
 * state is from the one so many later. An orbit that approaches a period by alternating about it
 * seems to have twice that period: where the alternation shrinks, it is the half. As the program
 * finds it.
 */
function periodIn(count, apart, tolerance, longest = count >> 1) {
  for (let period = 1; period <= Math.min(longest, count >> 1); period++) {
    let n = 0;
    while (n + period < count && apart(n, period) <= tolerance) n++;
    if (n + period < count) continue;
    const half = period / 2;
    if (period % 2 || count < half + 2 * period) return period;
    const began = farthest(apart, half, 0, period);
    const ended = farthest(apart, half, count - half - period, count - half);
    return ended < SHRUNK * began ? half : period;
  }
  return 0;
}

/** The period that a run of states comes nearer to, 0 where it does to none. */
function approached(count, apart, tolerance) {
  for (let shift = 1; shift <= count / 3; shift++) {
    const pairs = count - shift;
    const began = farthest(apart, shift, 0, pairs >> 1);
    if (!(began <= tolerance)) continue;
    if (farthest(apart, shift, pairs - (pairs >> 1), pairs) < SHRUNK * began) return shift;
  }
  return 0;
}

/** Whether states come nearer to later ones, by any period, in every part of a run. */
function converges(count, apart) {
  const comesNearer = (shift) => {
    const pairs = count - shift;
    const parts = Math.min(Math.floor(pairs / shift), PARTS[1]);
    const end = (part) => Math.floor((part * pairs) / parts);
    let before = NEARBY;
    for (let part = 0; part < parts; part++) {
      const distance = farthest(apart, shift, end(part), end(part + 1));
      if (!(distance < before)) return false;
      before = distance;
    }
    return true;
  };
  for (let shift = 1; shift <= count / (PARTS[0] + 1); shift++) if (comesNearer(shift)) return true;
  return false;
}

/** How far states are from later ones; in half-widths or, where larger, extents. */
function distances(states) {
  const scales = states[0].map((_, n) => {
    const own = states.map((state) => state[n]);
    return Math.max(data.window.state[n] ?? 1, Math.max(...own) - Math.min(...own));
  });
  return (number, shift) => {
    const [a, b] = [states[number], states[number + shift]];
    let most = 0;
    for (let n = 0; n < a.length; n++) {
      const distance = Math.abs(a[n] - b[n]) / scales[n];
      if (!(distance <= most)) most = distance;
    }
    return most;
  };
}

/** Period of states that repeat. */
const periodOf = (states) => periodIn(states.length, distances(states), PERIOD_TOLERANCE);

/** Period of what is drawn, as an eye would tell it. */
function periodSeen(values, { depth, coordinate }) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const width = depth === undefined ? data.window.state[coordinate] : data.window.depth;
  if (!(high - low > 1e-9 * (width ?? 1))) return 1;
  const apart = (n, shift) => Math.abs(values[n] - values[n + shift]);
  return periodIn(values.length, apart, 1e-3 * (high - low), 64);
}

/** Eigenvalues of a small matrix, by its characteristic polynomial. */
function eigenvalues(matrix) {
  const size = matrix.length;
  // Faddeev and LeVerrier.
  const coefficients = [1];
  let power = matrix.map((row) => row.map(() => 0));
  for (let k = 1; k <= size; k++) {
    const shifted = power.map((row, i) =>
      row.map((v, j) => v + (i === j ? coefficients[k - 1] : 0)),
    );
    power = times(matrix, shifted);
    coefficients.push(-power.reduce((sum, row, n) => sum + row[n], 0) / k);
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
  const product = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
  const over = ([a, b], [c, d]) => {
    const norm = c * c + d * d || 1e-300;
    return [(a * c + b * d) / norm, (b * c - a * d) / norm];
  };
  let roots = matrix.map((_, n) => [Math.cos(1 + 2 * n), Math.sin(1 + 2 * n)]);
  for (let step = 0; step < 200; step++) {
    roots = roots.map((root, n) => {
      const value = coefficients.reduce(
        (sum, c) => product(sum, root).map((v, i) => (i ? v : v + c)),
        [0, 0],
      );
      const rest = roots.reduce(
        (own, other, m) => (m === n ? own : product(own, [root[0] - other[0], root[1] - other[1]])),
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
  let product = identity(d);
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
      product = times(rows, product);
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

/**
 * A periodic orbit near a state, by Newton's method on all its returns together; null where there
 * is none. With its multipliers, contacts, the least and the largest depth.
 */
function periodicOrbit(parameters, state, period) {
  const { states: d, passages: s, parameters: p } = sizes;
  at(places.parameters, p).set(parameters);
  map.freeze(places.parameters, places.coefficients);
  let from = state;
  let last = Infinity;
  for (let turn = 0; turn < 30; turn++) {
    const orbit = { states: [], depths: [], product: identity(d) };
    let own = from;
    for (let n = 0; n < period; n++) {
      at(places.states, d).set(own);
      const { coefficients, states, records, extents, jacobian } = places;
      map.step_jacobian(coefficients, states, records, extents, jacobian);
      const rows = Array.from({ length: d }, (_, i) => [...at(jacobian + 8 * d * i, d)]);
      orbit.product = times(rows, orbit.product);
      orbit.states.push(own);
      orbit.depths.push([...at(extents, s)]);
      own = [...at(records, d)];
    }
    const residual = own.map((value, n) => value - from[n]);
    const matrix = orbit.product.map((row, i) => row.map((v, j) => (i === j ? 1 - v : -v)));
    const step = solve(matrix, residual);
    if (!step?.every(Number.isFinite)) return null;
    const scale = (n) => data.window.state[n] ?? Math.abs(from[n]) + 1e-6;
    const size = Math.max(...step.map((value, n) => Math.abs(value) / scale(n)));
    // Rounding ends the fall of the steps.
    if (size < 1e-15 || (size < 1e-11 && size >= last)) {
      orbit.parameters = parameters;
      orbit.multipliers = eigenvalues(orbit.product);
      orbit.contacts = orbit.depths.map((row) => row.map((depth) => Number(depth > 0)).join("")).join();
      return orbit;
    }
    if (!(size < 1e3)) return null;
    last = size;
    from = from.map((value, n) => value + step[n]);
  }
  return null;
}

const identity = (size) =>
  Array.from({ length: size }, (_, i) => Array.from({ length: size }, (_, j) => Number(i === j)));

const times = (rows, other) =>
  rows.map((row) => other[0].map((_, j) => row.reduce((sum, v, i) => sum + v * other[i][j], 0)));

/** The solution of a small linear system, by elimination; null where it has none. */
function solve(matrix, right) {
  const rows = matrix.map((row, n) => [...row, right[n]]);
  const size = rows.length;
  for (let n = 0; n < size; n++) {
    let pivot = n;
    for (let k = n + 1; k < size; k++)
      if (Math.abs(rows[k][n]) > Math.abs(rows[pivot][n])) pivot = k;
    [rows[n], rows[pivot]] = [rows[pivot], rows[n]];
    if (!rows[n][n]) return null;
    for (let k = 0; k < size; k++) {
      if (k === n) continue;
      const share = rows[k][n] / rows[n][n];
      for (let j = n; j <= size; j++) rows[k][j] -= share * rows[n][j];
    }
  }
  return rows.map((row, n) => row[size] / row[n]);
}

/**
 * How far a stable periodic orbit goes along a parameter with its contacts, both ways: steps that
 * become shorter until the border is known, and what ends it.
 */
function reach({ token, axis, low, high, step, parameters, states, period }) {
  const first = periodicOrbit(parameters, states[0], period);
  const modulus = (orbit) => Math.max(...orbit.multipliers.map(([re, im]) => Math.hypot(re, im)));
  const holds = (orbit) => orbit && orbit.contacts === first.contacts && modulus(orbit) < 1;
  const least = 1e-13 * Math.max(step, Math.abs(parameters[axis]));
  const follow = (end) => {
    const way = Math.sign(end - parameters[axis]);
    let [here, before, length, failed] = [first, null, step, null];
    const value = (orbit) => orbit.parameters[axis];
    for (let turn = 0; turn < 2000 && length > least; turn++) {
      const left = (end - value(here)) * way;
      if (left <= least) return { orbit: here, way: "end" };
      length = Math.min(length, left);
      const next = length < left ? value(here) + way * length : end;
      // Along the line through the last two.
      const share = before && (next - value(here)) / (value(here) - value(before));
      const from = here.states[0].map((v, n) => v + (before ? share * (v - before.states[0][n]) : 0));
      const orbit = periodicOrbit(parameters.with(axis, next), from, period);
      if (holds(orbit)) {
        [before, here] = [here, orbit];
        length = failed ? length : 1.5 * length;
      } else {
        failed = orbit ?? failed;
        length /= 2;
      }
    }
    return { orbit: here, way: ending(here, failed) };
  };
  const ending = (orbit, beyond) => {
    const sizes = (own) => own.depths.flat().map(Math.abs);
    const deepest = Math.max(data.window.depth ?? 0, ...sizes(first));
    const least = Math.min(...sizes(orbit));
    const [re, im] = orbit.multipliers.find(([re, im]) => Math.hypot(re, im) === modulus(orbit));
    if (modulus(orbit) > 0.99) return Math.abs(im) > 1e-6 ? "torus" : re < 0 ? "flip" : "fold";
    return least < 1e-5 * deepest || beyond ? "graze" : "lost";
  };
  const beyond = (value, width) => !(Math.abs(value) <= (width ?? Infinity));
  const isOutside = ({ parameters, states, depths }) =>
    parameters.some((value, n) => beyond(value, data.window.parameter[n])) ||
    states.some((state) => state.some((value, n) => beyond(value, data.window.state[n]))) ||
    depths.flat().some((value) => !(value <= (data.window.depth ?? Infinity)));
  const ends = holds(first)
    ? [low, high].map((end) => {
        const { orbit, way } = follow(end);
        return { offset: orbit.parameters[axis], way, outside: isOutside(orbit) };
      })
    : [];
  return { kind: "reach", token, ends };
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

/** How long so many iterates take that are not kept: the speed of the map by itself. */
function speed({ token, parameters, count }) {
  freezeAll(new Array(sizes.lanes).fill(parameters));
  for (let n = 0; n < sizes.lanes; n++) put(places.states, n, data.coordinates.map(() => 0));
  const began = performance.now();
  const { coefficients, states, extents, records } = places;
  map.iterate_lanes(coefficients, states, extents, records, Math.ceil(count / sizes.lanes), 0);
  return { kind: "speed", token, time: performance.now() - began };
}

onmessage = ({ data: message }) => {
  if (message.kind === "begin") {
    begin(message);
    postMessage({ kind: "ready" });
  } else if (message.kind === "sweeps") {
    current = message.number;
    waiting = message.sweeps.map((own) => ({ ...own, number: message.number }));
    next();
  } else {
    postMessage({ images, orbit, probe, reach, speed }[message.kind](message));
  }
};
