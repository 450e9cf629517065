// The worker of a live page: it iterates the map of the page and answers messages. It knows no
// names and draws nothing.

import { grazeOffset } from "./graze.js";
import { basin, chart } from "./grid.js";
import { LaneMap } from "./lanes.js";
import { images, orbit, probe, speed } from "./orbits.js";
import { reach } from "./reach.js";
import { sweep } from "./sweep.js";

/** @import { CourseRequest, WorkerMessage } from "../types" */

/** Milliseconds between two messages of a sweep. */
const SLICE = 24;

/** @type {LaneMap} */
let map;
/** Number of the sweeps that are being made; newer ones end them. */
let current = 0;
/** @type {CourseRequest[]} */
let waiting = [];

/**
 * Generator of the results of a request.
 * @param {CourseRequest} request
 */
function begin(request) {
  if (request.course === "sweep") return sweep(map, request);
  return request.course === "chart" ? chart(map, request) : basin(map, request);
}

/** Runs the next sweep in slices of time, so that newer ones can end it. */
function next() {
  const request = waiting.shift();
  if (!request) return;
  const number = current;
  const heading = request.course === "sweep" ? request.heading : undefined;
  const attractors = request.course === "basin" ? request.attractors : undefined;
  const course = begin(request);
  const began = performance.now();
  const before = map.made;
  let flushed = false;
  const slice = () => {
    if (current !== number) return;
    const until = performance.now() + SLICE;
    let step, found;
    do {
      step = course.next(flushed);
      flushed = false;
      if (step.value) found = step.value;
    } while (!step.done && performance.now() < until);
    if (found && found.length) {
      postMessage({ kind: "found", number, heading, attractors, found });
      flushed = true;
    }
    if (!step.done) {
      setTimeout(slice);
      return;
    }
    const time = performance.now() - began;
    postMessage({ kind: "done", number, heading, time, iterates: map.made - before });
    next();
  };
  slice();
}

/** @param {WorkerMessage} message */
function answer(message) {
  switch (message.kind) {
    case "images":
      return images(map, message);
    case "orbit":
      return orbit(map, message);
    case "probe":
      return probe(map, message);
    case "reach":
      return reach(map, message);
    case "graze":
      return grazeOffset(map, message);
    case "speed":
      return speed(map, message);
    default:
      return null;
  }
}

/** @param {MessageEvent<WorkerMessage>} event */
onmessage = ({ data: message }) => {
  if (message.kind === "begin") {
    // Sweeps of another map have ended.
    current = 0;
    waiting = [];
    map = new LaneMap(message.module, message.data);
    postMessage({ kind: "ready" });
  } else if (message.kind === "sweeps") {
    current = message.number;
    waiting = message.sweeps;
    next();
  } else {
    postMessage({ token: message.token, ...answer(message) });
  }
};
