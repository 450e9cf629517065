// Types of the data of a page and of the messages between the page and its workers. Written after
// `Data` in src/report/live.rs; a test holds the fields of both against each other.

export type Range = [number, number];
export type Point = [number, number];

export interface Coordinate {
  name: string;
  symbol: string;
  /** Value at the graze. */
  value: number;
}

export interface Parameter {
  name: string;
  symbol: string;
  /** Value at the graze. */
  grazing: number;
  /** Half-width of the measured window; null if unbounded. */
  width: number | null;
}

export interface MeasuredWindow {
  state: (number | null)[];
  parameter: (number | null)[];
  depth: number | null;
}

export type Heading = "up" | "down";

export interface LiveDiagram {
  axis: number;
  from: number;
  to: number;
  transient: number;
  keep: number;
  headings: Heading[];
  start: number[];
  observe: number;
}

export interface LiveChart {
  axes: [number, number];
  x: Range;
  y: Range;
  transient: number;
  longest: number;
  start: number[];
}

/** Line of a branch; `points` holds doubles in base64. */
export interface LiveLine {
  stable: boolean;
  points: string;
}

export interface LiveSpecial {
  label: string;
  offset: number;
  state: number[];
}

export interface LiveBranch {
  axis: number;
  itinerary: string;
  period: number;
  lines: LiveLine[];
  special: LiveSpecial[];
}

/** Iterates of direct simulation; `points` holds pairs of doubles in base64. */
export interface LiveDirect {
  axis: number;
  observe: number;
  points: string;
}

export interface Data {
  scene: string;
  digest: string;
  coordinates: Coordinate[];
  parameters: Parameter[];
  window: MeasuredWindow;
  passages: string[];
  orders: [number, number][];
  escape: (number | null)[];
  diagrams: (LiveDiagram | null)[];
  charts: (LiveChart | null)[];
  branches: LiveBranch[];
  branches_left_out: number;
  direct: LiveDirect[];
}

/** Drawn quantity: minus the depth of a passage, or the offset of a coordinate. */
export interface Observable {
  depth?: number;
  coordinate?: number;
}

/** Exports of the map's WebAssembly module; addresses are in bytes. */
export interface Kernel {
  memory: WebAssembly.Memory;
  freeze(parameters: number, coefficients: number): void;
  freeze_lanes(parameters: number, coefficients: number): void;
  iterate_lanes(
    coefficients: number,
    states: number,
    extents: number,
    records: number,
    count: number,
    bytes: number,
  ): void;
  step_jacobian(
    coefficients: number,
    states: number,
    images: number,
    depths: number,
    jacobian: number,
  ): void;
  DIMENSION: WebAssembly.Global;
  PARAMETERS: WebAssembly.Global;
  PASSAGES: WebAssembly.Global;
  COEFFICIENTS: WebAssembly.Global;
  LANES: WebAssembly.Global;
  FREE_MEMORY: WebAssembly.Global;
}

// Questions, which have one answer.

export interface MapPoint {
  parameters: number[];
  state: number[];
}

export interface ImagesQuestion {
  points: MapPoint[];
}

export interface OrbitQuestion extends MapPoint {
  count: number;
}

export interface SpeedQuestion {
  parameters: number[];
  count: number;
}

export interface ProbeQuestion extends MapPoint {
  transient: number;
}

/** Real and imaginary part. */
export type Complex = [number, number];

/** Settled orbit. All fields but the first two are set only if the orbit does not escape. */
export interface ProbeAnswer {
  parameters: number[];
  gone: boolean;
  outside: boolean;
  /** Period; 0 if none was found. */
  period: number;
  exponent: number;
  multipliers: Complex[];
  states: number[][];
  depths: number[][];
}

export interface ReachQuestion {
  axis: number;
  low: number;
  high: number;
  step: number;
  parameters: number[];
  states: number[][];
  period: number;
}

export type ReachWay = "flip" | "fold" | "torus" | "graze" | "end" | "lost";

export interface ReachEnd {
  offset: number;
  way: ReachWay;
  outside: boolean;
}

export interface ReachAnswer {
  ends: ReachEnd[];
}

export interface GrazeQuestion {
  axis: number;
  /** Offsets of all parameters; that of the swept one is not used. */
  parameters: number[];
  /** Range of the swept parameter, for one without a window. */
  span: number;
}

export interface GrazeAnswer {
  /** Offset of the swept parameter at the graze; null if it is not found. */
  offset: number | null;
}

export interface ValuesAnswer {
  values: Float64Array;
}

/** Questions to a worker by name, with their answers. */
export interface Questions {
  images: [ImagesQuestion, ValuesAnswer];
  orbit: [OrbitQuestion, ValuesAnswer];
  probe: [ProbeQuestion, ProbeAnswer];
  reach: [ReachQuestion, ReachAnswer];
  graze: [GrazeQuestion, GrazeAnswer];
  speed: [SpeedQuestion, { time: number }];
}

// Sweeps, which answer as they go on.

/** Column of iterates of a diagram. */
export interface Column {
  column: number;
  /** 0 for a preview, 1 for the sweep, 2 for further iterates. */
  pass: number;
  offset: number;
  width: number;
  values: Float64Array;
  state: number[];
  outside?: boolean;
  touches?: boolean;
  gone?: boolean;
  period?: number | null;
}

/** Cell of a chart or basin: column, row, columns and rows that it stands for, class. */
export type Cell = [column: number, row: number, every: number, kind: number];

export interface Attractor {
  period: number;
  touches: boolean;
  states: number[][];
}

export interface SweepRequest {
  course: "sweep";
  axis: number;
  parameters: number[];
  columns: number;
  from: number;
  to: number;
  observe: Observable;
  transient: number;
  keep: number;
  /** Number of further passes. */
  more: number;
  start: number[];
  heading: Heading;
  /** End of the diagram at which the sweep starts. */
  anchor: number;
}

/** Cells of a plane. */
export interface GridRequest {
  axes: [number, number];
  x: Range;
  y: Range;
  columns: number;
  rows: number;
  parameters: number[];
  transient: number;
  longest: number;
}

export interface ChartRequest extends GridRequest {
  course: "chart";
  start: number[];
}

export interface BasinRequest extends GridRequest {
  course: "basin";
  state: number[];
  /** Attractors known so far; the computation adds those that it finds. */
  attractors: Attractor[];
}

export type CourseRequest = SweepRequest | ChartRequest | BasinRequest;

export interface FoundMessage<Item> {
  kind: "found";
  number: number;
  heading?: Heading;
  attractors?: Attractor[];
  found: Item[];
}

export interface DoneMessage {
  kind: "done";
  number: number;
  heading?: Heading;
  /** Milliseconds. */
  time: number;
  iterates: number;
}

/** Message of a worker about a sweep. */
export type SweepMessage<Item> = { kind: "ready" } | FoundMessage<Item> | DoneMessage;

/** Message to a worker. */
export type WorkerMessage =
  | { kind: "begin"; module: Uint8Array<ArrayBuffer>; data: Data }
  | { kind: "sweeps"; number: number; sweeps: CourseRequest[] }
  | { [K in keyof Questions]: { kind: K; token: number } & Questions[K][0] }[keyof Questions];

// Drawing.

/** Rectangle of pixels. */
export interface Box {
  x: number;
  y: number;
  w: number;
  h: number;
}

type Drawing =
  | "fillStyle"
  | "strokeStyle"
  | "lineWidth"
  | "font"
  | "textAlign"
  | "save"
  | "restore"
  | "translate"
  | "rotate"
  | "beginPath"
  | "moveTo"
  | "lineTo"
  | "arc"
  | "rect"
  | "clip"
  | "stroke"
  | "setLineDash"
  | "fillRect"
  | "strokeRect"
  | "fillText"
  | "strokeText";

/** The part of a canvas's context that the panes draw with. */
export interface Pen extends Pick<CanvasRenderingContext2D, Drawing> {
  fill(): void;
  drawImage(picture: HTMLCanvasElement, x: number, y: number, w: number, h: number): void;
}

/** Drawn quantity with its label. */
export interface NamedObservable extends Observable {
  text: string;
}
