// What makes the page of a run alive. Without it the page is whole: pictures, tables and words.
// Everything that names something is data of the page, and is shown as text.
"use strict";

(() => {
  const byId = (id) => document.getElementById(id);
  const element = (name, properties = {}, ...children) => {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  };
  const button = (text, label, action) => {
    const made = element("button", {
      type: "button",
      textContent: text,
      title: label,
      onclick: action,
    });
    made.setAttribute("aria-label", label);
    return made;
  };

  // Files that the page hands out.
  const save = (name, content, type) => {
    const url = URL.createObjectURL(
      content instanceof Blob ? content : new Blob([content], { type }),
    );
    element("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  };
  const savePicture = (name, svg) => {
    const text = new XMLSerializer().serializeToString(svg);
    const image = new Image();
    image.onload = () => {
      const { width, height } = svg.viewBox.baseVal;
      const canvas = element("canvas", { width: 2 * width, height: 2 * height });
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0, 2 * width, 2 * height);
      canvas.toBlob((blob) => save(name, blob));
    };
    image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(text);
  };
  for (const [number, figure] of document.querySelectorAll("figure:not(.table)").entries()) {
    const svg = figure.querySelector(".card svg");
    const bitmap = figure.querySelector(".card img");
    const bar = element("div", { className: "tools" });
    const name = `figure-${number + 1}`;
    if (svg) {
      const text = () => new XMLSerializer().serializeToString(svg);
      bar.append(
        button("SVG", `Save figure ${number + 1} as SVG`, () =>
          save(name + ".svg", text(), "image/svg+xml"),
        ),
      );
      bar.append(
        button("PNG", `Save figure ${number + 1} as PNG`, () => savePicture(name + ".png", svg)),
      );
    } else if (bitmap) {
      const bytes = () => Uint8Array.from(atob(bitmap.src.split(",")[1]), (c) => c.charCodeAt(0));
      bar.append(
        button("PNG", `Save figure ${number + 1} as PNG`, () =>
          save(name + ".png", new Blob([bytes()], { type: "image/png" })),
        ),
      );
    }
    const points = figure.querySelector("script.points");
    if (points) {
      bar.append(
        button("CSV", `Save the points of figure ${number + 1} as CSV`, () =>
          save(name + ".csv", JSON.parse(points.textContent), "text/csv"),
        ),
      );
    }
    if (bar.children.length) figure.append(bar);
  }
  for (const [number, figure] of document.querySelectorAll("figure.table").entries()) {
    const rows = () =>
      [...figure.querySelectorAll("tr")].map((row) =>
        [...row.cells]
          .map((cell) => {
            const text = cell.textContent.trim();
            return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
          })
          .join(","),
      );
    const bar = element("div", { className: "tools" });
    bar.append(
      button("CSV", `Save table ${number + 1} as CSV`, () =>
        save(`table-${number + 1}.csv`, rows().join("\n") + "\n", "text/csv"),
      ),
    );
    figure.append(bar);
  }
  for (const line of document.querySelectorAll(".command, .quote")) {
    const code = line.querySelector("code, p");
    const what = line.matches(".quote") ? "Copy these words" : "Copy the command";
    const copy = button("copy", what, async () => {
      try {
        await navigator.clipboard.writeText(code.textContent);
      } catch {
        getSelection().selectAllChildren(code);
        document.execCommand("copy");
      }
      copy.textContent = "copied";
      setTimeout(() => (copy.textContent = "copy"), 1500);
    });
    line.append(copy);
  }

  // The map, in a worker.
  if (!byId("map-module")) return;
  const data = JSON.parse(byId("map-data").textContent);
  const modules = byId("map-module").textContent.trim().split(" ");
  const moduleBytes = modules.map((module) =>
    Uint8Array.from(atob(module), (c) => c.charCodeAt(0)),
  );
  const source = new Blob([byId("map-worker").textContent], { type: "text/javascript" });
  const panes = [];
  const startWorker = (receive, module = moduleBytes[0]) => {
    const worker = new Worker(URL.createObjectURL(source));
    worker.onmessage = ({ data: message }) => receive(message);
    worker.postMessage({ kind: "begin", module, data });
    return worker;
  };
  const answers = new Map();
  let token = 0;
  const asked = [];
  /** A question to a worker of its own, so that no sweep delays the answer; of one of the modules. */
  const ask = (question, chosen = 0) => {
    asked[chosen] ??= startWorker((message) => {
      answers.get(message.token)?.(message);
      answers.delete(message.token);
    }, moduleBytes[chosen]);
    return new Promise((resolve) => {
      answers.set(++token, resolve);
      asked[chosen].postMessage({ ...question, token });
    });
  };
  // For a console: images of a state and their depths, one after another.
  window.grazemap = {
    data,
    panes,
    iterate: async (state, parameters, count) =>
      (await ask({ kind: "orbit", state, parameters, count })).values,
    speed: async (parameters, count) => (await ask({ kind: "speed", parameters, count })).time,
  };

  /** A number in so many digits, with a proper minus. */
  const shown = (value, digits = 6) => {
    if (value === 0) return "0";
    const size = Math.abs(value);
    const text =
      size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : value.toPrecision(digits);
    const [mantissa, power] = text.split("e");
    const short = mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa;
    return (power ? `${short}e${Number(power)}` : short).replaceAll("-", "−");
  };
  /** Round values on an axis, and the power of ten that their labels leave out. */
  const ticks = (from, to, count, plain = false) => {
    const rough = (to - from) / count;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find((n) => n * unit >= rough * 0.999);
    const first = Math.ceil(from / step - 1e-9);
    const values = [];
    for (let n = first; n * step <= to + 1e-9 * step && values.length < 50; n++)
      values.push(n * step);
    const largest = Math.max(Math.abs(from), Math.abs(to));
    const leaves = largest >= (plain ? 1e6 : 1e4) || largest < (plain ? 1e-4 : 1e-2);
    const power = leaves ? Math.floor(Math.log10(largest)) : 0;
    const digits = Math.max(0, Math.ceil(power - Math.log10(step) - 1e-9));
    const label = (value) =>
      (value / 10 ** power)
        .toFixed(Math.min(digits, 17))
        .replace(/^-(?=[0.]*$)/, "")
        .replace("-", "−");
    return { values, power, label, step };
  };
  const place = (room, [rx, ry], [a, b]) => [
    room.x + ((a - rx[0]) / (rx[1] - rx[0])) * room.w,
    room.y + room.h - ((b - ry[0]) / (ry[1] - ry[0])) * room.h,
  ];
  /**
   * A frame with round values and names: offsets below, so many pixels lower, and on the left; on
   * the sides across, where there is one, the values that they are offsets from.
   */
  const drawAxes = (g, room, ranges, labels, { values = [], foot = 0 } = {}) => {
    const ends = [ranges[0], ranges[1]];
    const write = (text, x, y, align) => {
      g.textAlign = align;
      g.fillText(text, x, y);
    };
    const sideways = (text, x, y) => {
      g.save();
      g.translate(x, y);
      g.rotate(-Math.PI / 2);
      write(text, 0, 0, "center");
      g.restore();
    };
    // A label in the middle of a tick, or beside it at the border.
    const below = (text, x, y) => {
      const half = 3.3 * text.length;
      write(text, Math.min(x, room.x + room.w + 10 - half), y, "center");
    };
    const named = (name, power) => name + (power ? ` / 10${superscript(power)}` : "");
    const middle = [room.x + room.w / 2, room.y + room.h / 2];
    g.font = "12px system-ui, sans-serif";
    g.lineWidth = 1;
    g.strokeStyle = colour("--soft");
    g.strokeRect(room.x, room.y, room.w, room.h);
    g.fillStyle = colour("--ink");
    const x = ticks(...ranges[0], Math.max(4, Math.floor(room.w / 80)));
    const bottom = room.y + room.h + foot;
    for (const value of x.values) {
      const [at] = place(room, ends, [value, 0]);
      g.fillRect(at - 0.5, bottom, 1, 4);
      below(x.label(value), at, bottom + 16);
    }
    write(named(labels[0], x.power), middle[0], bottom + 34, "center");
    const y = ticks(...ranges[1], Math.max(4, Math.floor(room.h / 50)));
    for (const value of y.values) {
      const [, at] = place(room, ends, [0, value]);
      g.fillRect(room.x - 4, at - 0.5, 4, 1);
      write(y.label(value), room.x - 7, at + 4, "right");
    }
    sideways(named(labels[1], y.power), 13, middle[1]);
    g.fillStyle = colour("--soft");
    for (const [n, own] of values.entries()) {
      if (!own) continue;
      const shifted = ranges[n].map((end) => own.grazing + end);
      // Fewer where they are long; none where doubles cannot tell them apart.
      let count = n ? Math.floor(room.h / 50) : Math.floor(room.w / 60);
      let found;
      do found = ticks(...shifted, count, true);
      while (!n && found.values.length * (7 * found.label(shifted[0]).length + 14) > room.w && --count);
      if (!count || found.step < 1e-15 * Math.abs(own.grazing)) continue;
      for (const value of found.values) {
        const [left, up] = place(room, ends, [value - own.grazing, value - own.grazing]);
        if (n) {
          g.fillRect(room.x + room.w, up - 0.5, 4, 1);
          write(found.label(value), room.x + room.w + 7, up + 4, "left");
        } else {
          g.fillRect(left - 0.5, room.y - 4, 1, 4);
          below(found.label(value), left, room.y - 7);
        }
      }
      const name = named(own.symbol, found.power);
      if (n) sideways(name, room.x + room.w + values.room, middle[1]);
      else write(name, middle[0], room.y - 23, "center");
    }
  };
  const superscript = (power) =>
    String(power)
      .replace("-", "⁻")
      .replace(/\d/g, (d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  /** Words with a rim of the paper, legible over everything. */
  const writeOver = (g, text, x, y) => {
    g.strokeStyle = colour("--paper");
    g.lineWidth = 3;
    g.strokeText(text, x, y);
    g.lineWidth = 1;
    g.fillText(text, x, y);
  };

  /** What a canvas is drawn with, as far as the panes use it, writing an SVG. */
  function svgContext(width, height) {
    const make = (name, properties, parent) => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(properties)) made.setAttribute(key, value);
      parent?.append(made);
      return made;
    };
    const round = (value) => Math.round(value * 100) / 100;
    const svg = make("svg", { width, height, viewBox: `0 0 ${width} ${height}` });
    let group = svg;
    let path = "";
    let dash = [];
    let clips = 0;
    const kept = [];
    const pen = () => ({
      fill: "none",
      stroke: g.strokeStyle,
      "stroke-width": g.lineWidth,
      "stroke-linejoin": "round",
      ...(dash.length ? { "stroke-dasharray": dash.join(" ") } : {}),
    });
    const box = (x, y, w, h) => ({
      x: round(Math.min(x, x + w)),
      y: round(Math.min(y, y + h)),
      width: round(Math.abs(w)),
      height: round(Math.abs(h)),
    });
    const shift = (transform) => (group = make("g", { transform }, group));
    const write = (text, x, y, ink) => {
      const [, size, family] = g.font.match(/(\d+)px (.*)/);
      const anchor = { left: "start", center: "middle", right: "end" }[g.textAlign];
      const own = { x: round(x), y: round(y), "text-anchor": anchor, "font-size": size };
      make("text", { ...own, "font-family": family, ...ink }, group).textContent = text;
    };
    const g = {
      svg,
      fillStyle: "#000",
      strokeStyle: "#000",
      lineWidth: 1,
      font: "12px sans-serif",
      textAlign: "left",
      save: () => {
        const { fillStyle, strokeStyle, lineWidth, font, textAlign } = g;
        kept.push([group, dash, { fillStyle, strokeStyle, lineWidth, font, textAlign }]);
      },
      restore: () => {
        let own;
        [group, dash, own] = kept.pop();
        Object.assign(g, own);
      },
      translate: (x, y) => shift(`translate(${round(x)} ${round(y)})`),
      rotate: (angle) => shift(`rotate(${round((angle * 180) / Math.PI)})`),
      beginPath: () => (path = ""),
      moveTo: (x, y) => (path += `M${round(x)} ${round(y)}`),
      lineTo: (x, y) => (path += `${path ? "L" : "M"}${round(x)} ${round(y)}`),
      arc: (x, y, r) =>
        (path += `M${round(x - r)} ${round(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`),
      rect: (x, y, w, h) => (path += `M${x} ${y}h${w}v${h}h${-w}z`),
      clip: () => {
        const id = `clip-${++clips}`;
        make("path", { d: path }, make("clipPath", { id }, group));
        group = make("g", { "clip-path": `url(#${id})` }, group);
      },
      setLineDash: (own) => (dash = own),
      stroke: () => make("path", { d: path, ...pen() }, group),
      fill: () => make("path", { d: path, fill: g.fillStyle }, group),
      fillRect: (...own) => make("rect", { ...box(...own), fill: g.fillStyle }, group),
      strokeRect: (...own) => make("rect", { ...box(...own), ...pen() }, group),
      fillText: (text, x, y) => write(text, x, y, { fill: g.fillStyle }),
      strokeText: (text, x, y) => write(text, x, y, pen()),
      drawImage: (picture, x, y, w, h) => {
        const href = picture.toDataURL();
        const style = "image-rendering: pixelated";
        make("image", { ...box(x, y, w, h), preserveAspectRatio: "none", style, href }, group);
      },
    };
    return g;
  }
  /** Draws on a canvas of so many pixels of the page, sharply. */
  const drawOn = (canvas, [width, height], paint) => {
    const ratio = Math.min(2, devicePixelRatio || 1);
    const sides = [width, height].map((side) => Math.round(side * ratio));
    if (canvas.width !== sides[0] || canvas.height !== sides[1])
      [canvas.width, canvas.height] = sides;
    canvas.style.height = `${height}px`;
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.imageSmoothingEnabled = false;
    onPaper(g, width, height, paint);
  };
  const onPaper = (g, width, height, paint) => {
    g.fillStyle = colour("--paper");
    g.fillRect(0, 0, width, height);
    paint(g);
  };
  /** Buttons that save what a canvas shows: as drawn anew for an SVG, as pixels, as numbers. */
  const savers = (what, name, { canvas, paint, csv }) => [
    button("SVG", `Save ${what} as SVG`, () => {
      const size = [canvas.clientWidth, canvas.clientHeight];
      const g = svgContext(...size);
      onPaper(g, ...size, paint);
      save(`${name()}.svg`, new XMLSerializer().serializeToString(g.svg), "image/svg+xml");
    }),
    button("PNG", `Save ${what} as PNG`, () =>
      canvas.toBlob((blob) => save(`${name()}.png`, blob)),
    ),
    button("CSV", `Save the numbers of ${what} as CSV`, () =>
      save(`${name()}.csv`, csv(), "text/csv"),
    ),
  ];
  const observables = [
    ...data.passages.map((name, depth) => ({
      text: data.passages.length > 1 ? `gap h at “${name}”` : "gap h",
      depth,
    })),
    ...data.coordinates.map(({ symbol }, coordinate) => ({
      text: `${symbol} − ${symbol}*`,
      coordinate,
    })),
  ];

  /**
   * Hands what a reader does on a canvas to the pane that draws it, points in the canvas's own
   * coordinates; `keys(event)` has the pane's actions by key, beside those that zoom.
   */
  const listen = (canvas, { press, move, release, cancel, zoom, zoomAt, reset, keys }) => {
    const point = (event) => {
      const place = canvas.getBoundingClientRect();
      return [event.clientX - place.left, event.clientY - place.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      press(point(event), event);
    });
    canvas.addEventListener("pointermove", (event) => move(point(event)));
    canvas.addEventListener("pointerup", (event) => release(point(event)));
    canvas.addEventListener("pointercancel", cancel);
    canvas.addEventListener("dblclick", reset);
    canvas.addEventListener(
      "wheel",
      (event) => {
        // The page scrolls over a picture that is not being worked with.
        if (document.activeElement !== canvas && !event.ctrlKey) return;
        event.preventDefault();
        zoomAt(Math.exp(Math.sign(event.deltaY) * 0.25), point(event), event);
      },
      { passive: false },
    );
    canvas.addEventListener("keydown", (event) => {
      const zooms = { "+": () => zoom(0.6), "=": () => zoom(0.6), "-": () => zoom(1 / 0.6) };
      const action = { ...zooms, 0: reset, Home: reset, ...keys(event) }[event.key];
      if (!action || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      action();
    });
  };

  const PERIODS = [
    "#88ccee",
    "#ddcc77",
    "#cc6677",
    "#117733",
    "#aa4499",
    "#999933",
    "#882255",
    "#44aa99",
    "#332288",
  ];
  const WITHOUT_CONTACT = -1;
  const OUTSIDE = -2;
  const ESCAPED = -3;
  const NOT_SETTLED = -4;
  /** Whether white letters are read on a colour, and not black ones. */
  const isDark = (tone) =>
    [1, 3, 5].reduce((sum, at, n) => sum + parseInt(tone.slice(at, at + 2), 16) * [3, 6, 1][n], 0) < 1275;
  /** Words and colours of the classes that are no periods. */
  const CLASSES = {
    [WITHOUT_CONTACT]: ["period 1 without contact", "#f7eec3"],
    [OUTSIDE]: ["outside the measured window", "#b3b7bc"],
    [NOT_SETTLED]: ["not settled, still converging", "#6a7078"],
    0: ["no period", "#1f2328"],
  };
  const classWords = (kind) => (kind === undefined ? "" : (CLASSES[kind]?.[0] ?? `period ${kind}`));
  const classColour = (kind) => CLASSES[kind]?.[1] ?? PERIODS[Math.min(kind, 9) - 1];
  const offsetOf = (coordinate) => {
    const { symbol } = data.coordinates[coordinate];
    return `${symbol} − ${symbol}*`;
  };

  /** Numbers that the page holds packed. */
  const unpacked = (text) =>
    new Float64Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);

  /** A choice among words. */
  const chooser = (label, words, choose) => {
    const choice = element(
      "select",
      {},
      ...words.map((text) => element("option", { textContent: text })),
    );
    choice.setAttribute("aria-label", label);
    choice.onchange = () => choose(choice.selectedIndex);
    return choice;
  };
  /** Draws again where the room or the colours change. */
  const drawnAgain = (canvas, draw) => {
    new ResizeObserver(draw).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  };

  /** Height of a panel of what is at a marker. */
  const PANEL = 230;
  const panelRoom = (canvas) => ({
    x: 62,
    y: 10,
    w: (canvas.clientWidth || 300) - 76,
    h: PANEL - 50,
  });
  /** A panel that draws lines and points of an orbit. */
  function orbitPanel(what, name) {
    const canvas = element("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", what[0].toUpperCase() + what.slice(1));
    let [lines, names, pale] = [[], ["", ""], false];
    const paint = (g) => {
      if (!lines.length) return;
      const room = panelRoom(canvas);
      const ranges = [0, 1].map((n) => {
        const values = lines.flatMap(({ points }) => points.map((point) => point[n]));
        const [low, high] = [Math.min(...values), Math.max(...values)];
        // A period of one has an extent of rounding.
        const moves = high - low > 1e-6 * Math.max(Math.abs(high), Math.abs(low));
        const edge = moves ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1e-12;
        return [low - edge, high + edge];
      });
      drawAxes(g, room, ranges, names);
      for (const { points, tone, joined, bare } of lines) {
        g.fillStyle = g.strokeStyle = colour(pale ? "--outside" : tone);
        if (joined) {
          g.beginPath();
          for (const point of points) g.lineTo(...place(room, ranges, point));
          g.stroke();
        }
        for (const point of bare ? [] : points) {
          const [x, y] = place(room, ranges, point);
          g.fillRect(x - 1.5, y - 1.5, 3, 3);
        }
      }
    };
    const csv = () =>
      [
        ["line", ...names.map((own) => `"${own.replaceAll('"', '""')}"`)],
        ...lines.flatMap(({ points }, n) => points.map((point) => [n + 1, ...point])),
      ].join("\n") + "\n";
    const tools = element(
      "div",
      { className: "tools" },
      ...savers(what, name, { canvas, paint, csv }),
    );
    const draw = () => drawOn(canvas, [canvas.clientWidth || 300, PANEL], paint);
    drawnAgain(canvas, draw);
    const show = (...own) => {
      [pale, lines, names] = own;
      draw();
    };
    return { node: element("div", {}, canvas, tools), tools, show };
  }

  /** The live diagram of one of the run's. */
  function diagramPane(host, diagram) {
    const axis = diagram.axis;
    const parameter = data.parameters[axis];
    const home = { x: [diagram.from, diagram.to], y: null };
    let view = { x: home.x.slice(), y: null };
    // The views before this one.
    let past = [];
    let auto = true;
    let base = data.parameters.map(() => 0);
    let observe = observables[diagram.observe] ?? observables[0];
    /** Points by direct simulation of what is drawn. */
    const directOf = () =>
      data.direct
        .filter((own) => own.axis === axis && observables[own.observe] === observe)
        .flatMap(({ points }) => {
          const numbers = unpacked(points);
          return Array.from({ length: numbers.length / 2 }, (_, n) => [
            numbers[2 * n],
            numbers[2 * n + 1],
          ]);
        });
    let direct = directOf();
    // Columns of iterates by their number, of each sweep; "map" before those of the map itself
    // where another of lower orders is drawn.
    let layers = {};
    let extent = [];
    let show = {
      up: diagram.headings.includes("up"),
      down: diagram.headings.includes("down"),
      branches: true,
      direct: false,
    };
    const branches = data.branches
      .filter((branch) => branch.axis === axis)
      .map((branch) => ({
        ...branch,
        lines: branch.lines.map((line) => ({ ...line, points: unpacked(line.points) })),
      }));
    let curves = [];
    let labels = [];
    let number = 0;
    let started = 0;
    let marker = null;
    // What is known of the period at the marker: where it begins and ends.
    let reach = null;
    let status = "";
    let lastTimes = {};

    const canvas = element("canvas", { tabIndex: 0 });
    canvas.setAttribute("role", "application");
    const readout = element("output", { className: "readout" });
    readout.setAttribute("aria-live", "polite");
    const controls = element("div", { className: "tools" });
    const panels = element("div", { className: "panels", hidden: true });
    const single = data.coordinates.length === 1;
    const fileName = (what) => () => `${data.scene}-${parameter.name}-${what}`;
    const portrait = single
      ? orbitPanel("the cobweb of the orbit on the graph of the map", fileName("cobweb"))
      : orbitPanel("the states of the orbit on the section", fileName("section"));
    const series = orbitPanel("the gap in each return", fileName("gaps"));
    const facts = element("div", { className: "facts" });
    panels.append(facts, portrait.node, series.node);
    const basin = single ? null : basinPane(panels);
    // The plane of the section that is drawn.
    let plane = [0, 1];
    const planes = data.coordinates.flatMap((_, b) => data.coordinates.slice(0, b).map((_, a) => [a, b]));
    if (planes.length > 1) {
      const choice = chooser(
        "Coordinates of the plane of states and basins",
        planes.map((own) => own.map((axis) => data.coordinates[axis].symbol).join(", ")),
        (number) => {
          plane = planes[number];
          drawPortrait();
          basin.choose(plane);
        },
      );
      portrait.tools.prepend(choice);
    }
    const about = `Bifurcation diagram of the map over ${parameter.name}. Arrow keys move the marker, plus and minus zoom, page up and page down move, 0 shows the whole.`;
    canvas.setAttribute("aria-label", about);
    /** The diagram in words: which periods are found where. */
    function described() {
      const heading = show.up ? "up" : "down";
      const runs = [];
      for (const column of [...(layers[heading]?.values() ?? [])].sort((a, b) => a.offset - b.offset)) {
        const kind = kindOf(column);
        if (runs.at(-1)?.kind === kind) runs.at(-1).count += 1;
        else runs.push({ kind, from: column.offset, count: 1 });
      }
      const wide = runs.filter(({ count }) => count >= 8).slice(0, 12);
      return `${about} From left to right: ${wide.map(({ kind, from }) => `${classWords(kind)} from offset ${shown(from, 3)}`).join(", ")}.`;
    }

    let chosen = 0;
    const receive = (before) => (message) => {
      if (message.kind === "ready") return before ? beneath() : sweep();
      if (message.number !== number) return;
      const name = before + message.heading;
      if (message.kind === "done") {
        if (!before) {
          lastTimes[name] = message.time;
          pane.rate = message.iterates / message.time / 1000;
          pane.times = { ...lastTimes };
        }
        finished.add(name);
        if (sweepsOf().every((own) => finished.has(own))) {
          status = "";
          old = null;
          // The same height in the end, whatever came first.
          fit.is = null;
          if (auto) fit();
          pane.whole = performance.now() - started;
          pane.done = true;
          canvas.setAttribute("aria-label", described());
        }
      } else {
        pane.first ||= performance.now() - started;
        take(name, message.found);
      }
      redraw();
    };
    const worker = startWorker(receive(""));
    let other = null;
    const finished = new Set();
    /** The sweeps that are seen, those beneath the others first. */
    const sweepsOf = () => {
      const own = ["down", "up"].filter((heading) => show[heading]);
      return chosen ? [...own.map((heading) => "map " + heading), ...own] : own;
    };

    /** Takes columns in: those of a later pass replace a preview, those of the last add to it. */
    function take(name, found) {
      const layer = (layers[name] ??= new Map());
      for (const column of found) {
        const known = layer.get(column.column);
        if (column.pass === 2 && known) {
          known.chunks.push(column.values);
          known.state = column.state;
        } else {
          layer.set(column.column, { ...column, chunks: [column.values] });
          for (const value of column.values) {
            if (!(value >= extent[0])) extent[0] = value;
            if (!(value <= extent[1])) extent[1] = value;
          }
        }
        if (sums) count(name, column);
      }
      if (auto) fit();
    }

    /** The height that shows all iterates, and the branches where the iterates have none. */
    function fit() {
      let [low, high] = extent.length ? extent : [Infinity, -Infinity];
      const shownCurves = show.branches && !otherMoved() ? curves : [];
      for (const ofAll of [false, true]) {
        const ends = shownCurves
          .filter(({ stable }) => stable || ofAll)
          .flatMap(({ points }) => points)
          .filter(([offset]) => offset >= view.x[0] && offset <= view.x[1])
          .map(([, value]) => value);
        const [least, most] = [Math.min(...ends), Math.max(...ends)];
        if (!(high - low >= 1e-3 * (most - least)))
          [low, high] = [Math.min(low, least), Math.max(high, most)];
        if (high > low) break;
      }
      if (!(low <= high)) return;
      if (view.y && fit.is === number && low >= view.y[0] && high <= view.y[1]) return;
      fit.is = number;
      const edge = 0.04 * (high - low) || Math.abs(high) * 0.1 || 1e-12;
      const found = [low - edge, high + edge];
      if (view.y?.every((end, n) => end === found[n])) return;
      view.y = found;
      sums = null;
    }

    // Height of the strip of a sweep, below the plot.
    const [STRIP, GAP] = [14, 6];
    const size = () => {
      const width = Math.max(280, canvas.clientWidth || 700);
      const strips = GAP + STRIP * ["up", "down"].filter((heading) => show[heading]).length;
      const height = Math.round(Math.min(460, Math.max(320, width * 0.6))) + strips;
      const [left, top] = [68, 40];
      return {
        width,
        height,
        strips,
        plot: { x: left, y: top, w: width - left - 14, h: height - top - 40 - strips },
      };
    };
    const sharpness = () => Math.min(2, devicePixelRatio || 1);
    const columns = () => Math.min(1000, Math.round(size().plot.w * sharpness()));

    /** Asks for the iterates of what is seen. */
    function sweep(delay = 0) {
      clearTimeout(sweep.timer);
      sweep.timer = setTimeout(() => {
        number += 1;
        started = performance.now();
        pane.first = 0;
        pane.done = false;
        pane.number = number;
        lastTimes = {};
        finished.clear();
        keepOld();
        layers = {};
        extent = [];
        sums = null;
        status = "computing …";
        worker.postMessage({ kind: "sweeps", number, sweeps: requests() });
        if (chosen) beneath();
        redraw();
      }, delay);
    }
    function requests() {
      const keep = Math.min(diagram.keep, 400);
      const common = {
        course: "sweep",
        axis,
        parameters: base,
        columns: columns(),
        from: view.x[0],
        to: view.x[1],
        observe: { depth: observe.depth, coordinate: observe.coordinate },
        transient: diagram.transient,
        keep,
        more: Math.max(0, Math.ceil(1200 / keep) - 1),
        start: diagram.start,
      };
      const [low, high] = [Math.min(...home.x), Math.max(...home.x)];
      return ["up", "down"]
        .filter((heading) => show[heading])
        .map((heading) => ({ ...common, heading, anchor: heading === "up" ? low : high }));
    }
    /** The map's own iterates, beneath those of lower orders. */
    function beneath() {
      other ??= startWorker(receive("map "));
      other.postMessage({ kind: "sweeps", number, sweeps: requests() });
    }

    const toX = (offset, plot) =>
      plot.x + ((offset - view.x[0]) / (view.x[1] - view.x[0])) * plot.w;
    const toY = (value, plot) =>
      plot.y + plot.h - ((value - view.y[0]) / (view.y[1] - view.y[0])) * plot.h;
    const fromX = (x, plot) => view.x[0] + ((x - plot.x) / plot.w) * (view.x[1] - view.x[0]);
    const fromY = (y, plot) =>
      view.y[0] + ((plot.y + plot.h - y) / plot.h) * (view.y[1] - view.y[0]);

    // Iterates counted by pixel, one column of pixels after another, of each sweep; of one view.
    let sums = null;
    // The picture of the counts, and that of an earlier view until there are columns of this one.
    const back = element("canvas");
    let painted = null;
    let old = null;
    const sameView = (a, b) =>
      [0, 1].every((n) => a.x[n] === b.x[n] && a.y && b.y && a.y[n] === b.y[n]);
    function keepOld() {
      if (!sums || !painted || sums.fresh.reduce((sum, is) => sum + is, 0) < 0.5 * sums.w) return;
      const picture = element("canvas", { width: back.width, height: back.height });
      if (!back.width) return;
      picture.getContext("2d").drawImage(back, 0, 0);
      old = { picture, ...painted };
    }

    /** The pixels of a column, from and to. */
    function pixels({ offset, width }) {
      const { w, view } = sums;
      const span = view.x[1] - view.x[0];
      const [middle, half] = [((offset - view.x[0]) / span) * w, ((width / span) * w) / 2];
      const left = Math.max(0, Math.round(middle - half));
      return [left, Math.min(w, Math.max(left + 1, Math.round(middle + half)))];
    }
    /** Adds the newest iterates of a column to the counts. */
    function count(name, { pass, values, ...column }) {
      const { w, h, view, fresh } = sums;
      const own = (sums.layers[name] ??= { counts: new Uint8Array(w * h), outside: new Uint8Array(w) });
      const [left, right] = pixels(column);
      if (pass < 2) {
        own.counts.fill(0, left * h, right * h);
        own.outside.fill(column.outside, left, right);
        fresh.fill(1, left, right);
      }
      sums.stale.fill(1, left, right);
      const scale = h / (view.y[1] - view.y[0]);
      for (let n = 0; n < values.length; n++) {
        const y = h - 1 - Math.floor((values[n] - view.y[0]) * scale);
        if (y < 0 || y >= h) continue;
        for (let x = left; x < right; x++) {
          const place = x * h + y;
          if (own.counts[place] < 255) own.counts[place]++;
        }
      }
    }
    /** Counts of all that there is, of this view. */
    function countAll(plot) {
      const [w, h] = [plot.w, plot.h].map((side) => Math.round(side * sharpness()));
      sums = { w, h, view: structuredClone(view), layers: {}, image: new ImageData(w, h) };
      sums.fresh = new Uint8Array(w);
      sums.stale = new Uint8Array(w).fill(1);
      for (const name of sweepsOf()) {
        for (const column of layers[name]?.values() ?? []) {
          for (const [n, values] of column.chunks.entries())
            count(name, { ...column, values, pass: n ? 2 : column.pass });
        }
      }
    }
    /** Density of the iterates, as a picture of the plot. */
    function paintDensity() {
      const { w, h, image } = sums;
      const pixels = new Uint32Array(image.data.buffer);
      const names = ["--up", "--down", "--both", "--outside", "--reference"];
      const shades = names.map((name) => {
        const [red, green, blue] = [1, 3, 5].map((n) => parseInt(colour(name).slice(n, n + 2), 16));
        const opaque = (count) => Math.min(255, Math.round(90 + 45 * Math.log2(1 + count)));
        return Array.from(
          { length: 16 },
          (_, count) => ((opaque(count) << 24) | (blue << 16) | (green << 8) | red) >>> 0,
        );
      });
      const none = { counts: new Uint8Array(w * h), outside: new Uint8Array(w) };
      const of = (name) => (sweepsOf().includes(name) && sums.layers[name]) || none;
      const [up, down, mapUp, mapDown] = ["up", "down", "map up", "map down"].map(of);
      for (let x = 0; x < w; x++) {
        if (!sums.stale[x]) continue;
        for (let y = 0; y < h; y++) {
          const at = x * h + y;
          const a = up.counts[at];
          const b = down.counts[at];
          let count = a + b;
          // Blue, orange or both; what is outside the window grey; else what lies beneath.
          let tone = (a && !up.outside[x] ? 1 : 0) + (b && !down.outside[x] ? 2 : 0) - 1;
          if (tone < 0 && count) tone = 3;
          if (!count) {
            tone = 4;
            count = mapUp.counts[at] + mapDown.counts[at];
          }
          pixels[y * w + x] = count ? shades[tone][Math.min(15, count)] : 0;
        }
      }
      [back.width, back.height] = [w, h];
      back.getContext("2d").putImageData(image, 0, 0);
      painted = sums.view;
      sums.stale.fill(0);
    }
    /** The picture, over that of an earlier view where it has no columns yet. */
    function drawDensity(g, plot) {
      if (old) {
        const at = (x, y) => place(plot, [view.x, view.y], [x, y]);
        const [[x0, y1], [x1, y0]] = [at(old.x[0], old.y[1]), at(old.x[1], old.y[0])];
        g.save();
        g.beginPath();
        const step = plot.w / sums.w;
        for (let x = 0; x < sums.w; x++)
          if (!sums.fresh[x]) g.rect(plot.x + x * step, plot.y, step, plot.h);
        g.clip();
        g.drawImage(old.picture, x0, y1, x1 - x0, y0 - y1);
        g.restore();
      }
      g.drawImage(back, plot.x, plot.y, plot.w, plot.h);
    }

    /** The period at every value, in colours and, where there is room, numbers. */
    function drawStrip(g, plot, heading, top) {
      g.fillStyle = colour("--soft");
      g.font = "11px system-ui, sans-serif";
      g.textAlign = "right";
      const words = show.up && show.down ? `period ${heading === "up" ? "↑" : "↓"}` : "period";
      g.fillText(words, plot.x - 4, top + 11);
      const sorted = [...(layers[heading]?.values() ?? [])].sort((a, b) => a.offset - b.offset);
      const runs = [];
      for (const column of sorted) {
        const kind = kindOf(column);
        const ends = [column.offset - column.width / 2, column.offset + column.width / 2];
        const [left, right] = ends.map((end) =>
          Math.min(plot.x + plot.w, Math.max(plot.x, toX(end, plot))),
        );
        const last = runs.at(-1);
        if (last?.kind === kind && last.period === column.period && left - last.right < 1)
          last.right = right;
        else runs.push({ kind, left, right, period: column.period });
      }
      for (const { kind, left, right } of runs) {
        g.fillStyle = kind === ESCAPED ? colour("--rule") : classColour(kind);
        g.fillRect(left, top + 1, right - left, STRIP - 2);
      }
      g.textAlign = "center";
      for (const { kind, left, right, period } of runs) {
        const texts = period ? [`${period}`] : period === 0 ? ["no period"] : ["escapes"];
        if (kind === WITHOUT_CONTACT) texts.unshift("1, no contact");
        if (kind === OUTSIDE) texts.unshift(`${period || "no period"}, outside the window`);
        const text = texts.find((own) => 8 + 6 * own.length < right - left);
        if (!text) continue;
        g.fillStyle =
          kind === ESCAPED ? colour("--ink") : isDark(classColour(kind)) ? "#fff" : "#000";
        g.fillText(text, (left + right) / 2, top + 11);
      }
    }
    /** The class of what a column settles on. */
    const kindOf = ({ gone, outside, period, touches }) =>
      gone ? ESCAPED : outside ? OUTSIDE : period === 1 && !touches ? WITHOUT_CONTACT : period;

    let frame = 0;
    function redraw() {
      if (!frame) frame = requestAnimationFrame(() => ((frame = 0), draw()));
    }
    function draw() {
      const { width, height, plot } = size();
      if (view.y) {
        const [w, h] = [plot.w, plot.h].map((side) => Math.round(side * sharpness()));
        if (!sums || sums.w !== w || sums.h !== h || !sameView(sums.view, view)) {
          if (sums) keepOld();
          countAll(plot);
        }
        if (sums.stale.includes(1)) paintDensity();
      }
      drawOn(canvas, [width, height], paint);
      pane.view = { x: view.x.slice(), y: view.y && view.y.slice() };
    }

    function paint(g) {
      const { width, height, plot, strips } = size();
      // Beyond the window in the parameter.
      const bound = parameter.width;
      if (bound !== null) {
        g.fillStyle = colour("--panel");
        const [left, right] = [-bound, bound].map((x) =>
          Math.min(plot.x + plot.w, Math.max(plot.x, toX(x, plot))),
        );
        g.fillRect(plot.x, plot.y, left - plot.x, plot.h);
        g.fillRect(right, plot.y, plot.x + plot.w - right, plot.h);
      }
      if (view.y) drawDensity(g, plot);
      drawLayers(g, plot);
      const headings = ["up", "down"].filter((heading) => show[heading]);
      for (const [n, heading] of headings.entries())
        drawStrip(g, plot, heading, plot.y + plot.h + GAP + n * STRIP);
      const names = [`${parameter.symbol} − ${parameter.symbol}*`, observe.text];
      const ranges = [view.x, view.y ?? [0, 1]];
      drawAxes(g, plot, ranges, names, { values: [parameter], foot: strips });
      // The graze, the marker, and where its period ends.
      const line = (offset, style, dash, width = 1) => {
        if (!(offset >= view.x[0] && offset <= view.x[1])) return;
        g.strokeStyle = style;
        g.lineWidth = width;
        g.setLineDash(dash);
        g.beginPath();
        g.moveTo(toX(offset, plot), plot.y);
        g.lineTo(toX(offset, plot), plot.y + plot.h + strips);
        g.stroke();
        g.setLineDash([]);
        g.lineWidth = 1;
      };
      line(0, colour("--soft"), [3, 3]);
      for (const end of reach ?? []) line(end.offset, colour("--accent"), [6, 3]);
      if (marker !== null) line(marker, colour("--accent"), [], 1.5);
      g.font = "11px system-ui, sans-serif";
      if (view.x[0] < 0 && view.x[1] > 0) {
        g.fillStyle = colour("--soft");
        g.textAlign = "center";
        writeOver(g, "graze", toX(0, plot), plot.y + 14);
      }
      if (box) {
        const [x, y, w, h] = boxOf(plot);
        g.fillStyle = colour("--accent") + "22";
        g.strokeStyle = colour("--accent");
        g.fillRect(x, y, w, h);
        g.strokeRect(x, y, w, h);
      }
      if (pane.done && !extent.length) {
        g.textAlign = "center";
        g.fillStyle = colour("--ink");
        writeOver(g, "The orbit of the map escapes here.", plot.x + plot.w / 2, plot.y + plot.h / 2);
      }
      if (status) {
        g.textAlign = "right";
        g.fillStyle = colour("--soft");
        writeOver(g, status, plot.x + plot.w - 6, plot.y + 16);
      }
    }

    /** The box that is being drawn; a flat one is as high as the plot. */
    function boxOf(plot) {
      const within = (ends, from, size) =>
        ends.map((end) => Math.min(from + size, Math.max(from, end))).sort((a, b) => a - b);
      const [x0, x1] = within([box[0], box[2]], plot.x, plot.w);
      const [y0, y1] = within([box[1], box[3]], plot.y, plot.h);
      return isFlat() ? [x0, plot.y, x1 - x0, plot.h] : [x0, y0, x1 - x0, y1 - y0];
    }
    const isFlat = () => Math.abs(box[3] - box[1]) <= 24;

    /** Branches as curves of what is drawn: depths by the map, at the points of the branches. */
    async function trace() {
      const wanted = observe;
      const count = data.coordinates.length;
      const zero = data.parameters.map(() => 0);
      const points = [];
      const point = (offset, state) => points.push({ parameters: zero.with(axis, offset), state });
      for (const { period, lines, special } of branches) {
        for (const { points: own } of lines) {
          for (let first = 0; first < own.length; first += 1 + period * count) {
            for (let n = 0; n < period; n++) {
              const from = first + 1 + n * count;
              point(own[first], [...own.subarray(from, from + count)]);
            }
          }
        }
        for (const { offset, state } of special) point(offset, state);
      }
      let values = points.map(({ state }) => state[wanted.coordinate]);
      if (wanted.depth !== undefined && points.length) {
        const width = count + data.passages.length;
        const { values: images } = await ask({ kind: "images", points });
        values = points.map((_, n) => -images[n * width + count + wanted.depth]);
      }
      if (observe !== wanted) return;
      let next = 0;
      const pair = () => [points[next].parameters[axis], values[next++]];
      [curves, labels] = [[], []];
      for (const { itinerary, period, lines, special } of branches) {
        for (const { stable, points: own } of lines) {
          const returns = Array.from({ length: period }, () => []);
          for (let n = 0; n < own.length / (1 + period * count); n++)
            for (const line of returns) line.push(pair());
          for (const line of returns) curves.push({ itinerary, period, stable, points: line });
        }
        for (const { label } of special) labels.push({ text: label, at: pair() });
      }
      if (auto) fit();
      redraw();
    }

    const otherMoved = () => base.some((offset, n) => n !== axis && offset !== 0);

    /** Branches and points of direct simulation over the iterates; both are of the graze's other parameters. */
    function drawLayers(g, plot) {
      if (!view.y || otherMoved()) return;
      const at = ([offset, value]) => [toX(offset, plot), toY(value, plot)];
      g.save();
      g.beginPath();
      g.rect(plot.x, plot.y, plot.w, plot.h);
      g.clip();
      if (show.direct) {
        g.fillStyle = colour("--direct");
        for (const point of direct) {
          const [x, y] = at(point);
          g.fillRect(x - 1, y - 1, 2, 2);
        }
      }
      if (show.branches) {
        g.strokeStyle = g.fillStyle = colour("--ink");
        for (const { stable, points } of curves) {
          g.setLineDash(stable ? [] : [5, 4]);
          g.lineWidth = stable ? 1.8 : 1;
          g.beginPath();
          for (const point of points) g.lineTo(...at(point));
          g.stroke();
        }
        g.setLineDash([]);
        g.lineWidth = 1;
        g.font = "11px system-ui, sans-serif";
        g.textAlign = "left";
        // Points that fall together have one label.
        const written = [];
        for (const { text, at: point } of labels) {
          const [x, y] = at(point);
          const near = written.find((own) => Math.hypot(own.x - x, own.y - y) < 12);
          if (near) near.words.add(text);
          else written.push({ x, y, words: new Set([text]) });
        }
        for (const { x, y, words } of written) {
          g.beginPath();
          g.arc(x, y, 3.5, 0, 7);
          g.stroke();
          writeOver(g, [...words].join(", "), x + 6, y - 6);
          g.strokeStyle = colour("--ink");
        }
      }
      g.restore();
    }

    /** The branch that passes near a point, in words. */
    function branchNear(offset, value) {
      if (!show.branches || otherMoved() || value === undefined) return null;
      const { plot } = size();
      const [x, y] = [toX(offset, plot), toY(value, plot)];
      let [nearest, least] = [null, 8];
      for (const curve of curves) {
        for (let n = 1; n < curve.points.length; n++) {
          const [[a, b], [c, d]] = [curve.points[n - 1], curve.points[n]].map((point) => [
            toX(point[0], plot),
            toY(point[1], plot),
          ]);
          const length = (c - a) ** 2 + (d - b) ** 2;
          const share = Math.min(
            1,
            Math.max(0, ((x - a) * (c - a) + (y - b) * (d - b)) / (length || 1)),
          );
          const distance = Math.hypot(a + share * (c - a) - x, b + share * (d - b) - y);
          if (distance < least) [nearest, least] = [curve, distance];
        }
      }
      return (
        nearest &&
        `branch ${nearest.itinerary} of period ${nearest.period}, ${nearest.stable ? "stable" : "unstable"}`
      );
    }

    /** The column at an offset, of the sweep that is seen. */
    function columnAt(offset) {
      for (const heading of ["up", "down"]) {
        if (!show[heading]) continue;
        for (const column of layers[heading]?.values() ?? []) {
          if (!column.gone && Math.abs(column.offset - offset) <= 0.5 * column.width) return column;
        }
      }
      return null;
    }

    /** What is known at a value of the parameter. */
    async function inspect(offset, value, transient = 300) {
      const column = columnAt(offset);
      const at = column ? column.offset : offset;
      const own = base.slice();
      own[axis] = at;
      const request = {
        kind: "probe",
        parameters: own,
        state: column?.state ?? diagram.start,
        transient: column ? transient : Math.max(transient, 3000),
      };
      const answer = await ask(request, chosen);
      const parts = [
        `${parameter.name} = ${shown(parameter.grazing + at, 10)} (offset ${shown(at)})`,
      ];
      if (value !== undefined) parts.push(`${observe.text} ${shown(value)}`);
      const near = branchNear(offset, value);
      if (near) parts.push(near);
      if (answer.gone) {
        parts.push("the orbit of the map escapes");
      } else {
        const last = answer.states[answer.states.length - 1];
        parts.push(data.coordinates.map(({ name }, n) => `${name} ${shown(last[n])}`).join(", "));
        parts.push(answer.period ? `period ${answer.period}` : "no period up to 256");
        parts.push(`exponent ${shown(answer.exponent, 3)}`);
        if (answer.outside) parts.push("outside the measured window: not to be trusted");
      }
      return { answer, words: parts.join(" · ") };
    }

    let busy = false;
    let wanted = null;
    function hover(offset, value) {
      wanted = [offset, value];
      if (busy) return;
      busy = true;
      const [at, own] = wanted;
      wanted = null;
      inspect(at, own).then(({ words }) => {
        readout.textContent = words;
        busy = false;
        if (wanted) hover(...wanted);
      });
    }

    async function mark(offset) {
      marker = offset;
      reach = null;
      pane.marked = pane.reach = null;
      redraw();
      // Long enough for an approach that alternates, which would seem to have twice the period.
      const { answer, words } = await inspect(offset, undefined, 20_000);
      if (marker !== offset) return;
      readout.textContent = words;
      pane.marked = answer;
      panels.hidden = false;
      for (const own of panels.children) own.hidden = answer.gone && own !== facts;
      drawPanels(answer);
      if (answer.gone) return;
      basin?.mark(answer, chosen);
      if (!answer.period) return;
      const [low, high] = [Math.min(home.x[0], view.x[0]), Math.max(home.x[1], view.x[1])];
      const question = { kind: "reach", axis, low, high, step: (view.x[1] - view.x[0]) / 100 };
      const { ends } = await ask({ ...answer, ...question }, chosen);
      if (pane.marked !== answer) return;
      reach = pane.reach = ends;
      tellReach();
      redraw();
    }

    /** Where the period at the marker begins and ends, and why. */
    function tellReach() {
      const ways = {
        flip: "flip: a multiplier goes to −1",
        fold: "fold: a multiplier goes to 1",
        torus: "closed curve: a pair of multipliers goes to modulus 1",
        graze: "graze: a contact begins or ends",
        end: "the diagram's end",
        lost: "lost there",
      };
      const room = facts.querySelector(".reach");
      room.replaceChildren(
        ...reach.map(({ offset: found, way, outside }, n) => {
          // The graze itself, to rounding.
          const offset = Math.abs(found) < 1e-9 * (home.x[1] - home.x[0]) ? 0 : found;
          return element("div", {
            textContent: `${n ? "to" : "from"} ${parameter.symbol} = ${shown(parameter.grazing + offset, 12)} (offset ${shown(offset, 8)}), ${ways[way]}${outside ? "; outside the measured window" : ""}`,
          });
        }),
      );
    }

    /** The states on the section, the depths, and what is said of the orbit at the marker. */
    function drawPanels(answer) {
      const number = (value) => shown(value, 5);
      facts.replaceChildren();
      if (answer.gone) {
        facts.append(element("p", { textContent: "The orbit of the map escapes here." }));
        return;
      }
      const own = answer.multipliers.sort((a, b) => Math.hypot(...b) - Math.hypot(...a));
      const largest = Math.hypot(...(own[0] ?? []));
      const multipliers = own.map(([re, im]) =>
        Math.hypot(re, im) < 1e-13 * largest
          ? "0 to rounding"
          : Math.abs(im) > 1e-9 * Math.hypot(re, im)
          ? `${number(re)} ${im < 0 ? "−" : "+"} ${number(Math.abs(im))} i`
          : number(re),
      );
      const touched = answer.depths
        .slice(0, answer.period || 32)
        .map((own) => (own.some((depth) => depth > 0) ? "1" : "0"))
        .join("");
      // Which return comes first is the start's doing: the itinerary begins with its contacts.
      const turned = Array.from(touched, (_, n) => touched.slice(n) + touched.slice(0, n));
      const contacts = answer.period ? turned.sort().at(-1) : touched;
      const rows = [
        ["Period", answer.period ? `${answer.period}` : "none up to 256"],
        ...(answer.period ? [["Holds", ""]] : []),
        [
          "Contacts",
          `${contacts.slice(0, 48)}${contacts.length > 48 ? "…" : ""} (1: a return with contact)`,
        ],
        ["Multipliers", multipliers.join(", ") || "–"],
        ["Exponent", number(answer.exponent)],
        [
          "Offsets from",
          data.coordinates.map(({ symbol, value }) => `${symbol}* = ${shown(value, 8)}`).join(", "),
        ],
        ["Window", answer.outside ? "outside: not to be trusted" : "inside"],
      ];
      facts.append(
        element(
          "dl",
          {},
          ...rows.flatMap(([name, text]) => [
            element("dt", { textContent: name }),
            element("dd", { textContent: text, className: text ? "" : "reach" }),
          ]),
        ),
      );
      drawPortrait();
      const lines = data.passages.map((_, passage) => ({
        points: answer.depths.slice(0, 60).map((own, n) => [n, -own[passage]]),
        tone: ["--up", "--down", "--direct"][passage % 3],
        joined: true,
      }));
      const name = data.passages.length > 1 ? `gaps h at ${data.passages.join(", ")}` : "gap h";
      series.show(answer.outside, lines, ["return", name]);
    }

    function drawPortrait() {
      const answer = pane.marked;
      if (!answer || answer.gone) return;
      const kept = answer.states.slice(0, answer.period ? Math.max(answer.period, 2) : undefined);
      if (single) return drawCobweb(answer, kept);
      const points = kept.map((state) => plane.map((axis) => state[axis]));
      portrait.show(answer.outside, [{ points, tone: "--up" }], plane.map(offsetOf));
    }

    /** Steps between the graph of a map of one coordinate and the diagonal. */
    async function drawCobweb(answer, kept) {
      const values = answer.states.map(([value]) => value);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const width = data.window.state[0];
      const edge = Math.max(0.1 * (high - low), 0.02 * (width ?? Math.abs(high))) || 1e-12;
      const count = 240;
      const from = low - edge;
      const across = Array.from(
        { length: count + 1 },
        (_, n) => from + ((high - low + 2 * edge) * n) / count,
      );
      const { parameters } = answer;
      const points = across.map((value) => ({ parameters, state: [value] }));
      const { values: images } = await ask({ kind: "images", points }, chosen);
      if (pane.marked !== answer) return;
      const stride = 1 + data.passages.length;
      const graph = across.map((value, n) => [value, images[n * stride]]);
      const steps = kept
        .slice(0, 60)
        .flatMap(([value], n) => [
          [value, value],
          [value, answer.states[n + 1][0]],
        ]);
      pane.cobweb = { graph, steps };
      const ends = [across[0], across[count]];
      const beneath = [graph, ends.map((end) => [end, end])];
      portrait.show(
        answer.outside,
        [
          ...beneath.map((points) => ({ points, tone: "--soft", joined: true, bare: true })),
          { points: steps, tone: "--up", joined: true },
        ],
        [`${offsetOf(0)}: a return`, "the next"],
      );
    }

    // Zoom about a point, shift, choose.
    function look(x, y, delay) {
      const least = 1e-13 * Math.max(Math.abs(parameter.grazing), home.x[1] - home.x[0]);
      if (!(x[1] - x[0] > least)) return;
      // Moves that follow each other are one.
      const goesOn = delay > 0 && performance.now() - look.at < 500;
      if (!goesOn) past.push({ view: structuredClone(view), auto });
      past = past.slice(-50);
      undo.disabled = !past.length;
      look.at = delay > 0 ? performance.now() : -Infinity;
      view.x = x;
      if (y) {
        view.y = y;
        auto = false;
      }
      redraw();
      sweep(delay);
    }
    look.at = -Infinity;
    const scaled = (ends, middle, factor) => ends.map((end) => middle + (end - middle) * factor);
    function zoom(factor, point, onlyX) {
      const x = scaled(view.x, point?.[0] ?? marker ?? (view.x[0] + view.x[1]) / 2, factor);
      const y =
        onlyX || !view.y ? null : scaled(view.y, point?.[1] ?? (view.y[0] + view.y[1]) / 2, factor);
      look(x, y, 60);
    }
    function reset() {
      auto = true;
      look(home.x.slice(), null, 0);
    }

    let box = null;
    let grip = null;
    /** The marker follows the pointer as fast as its orbit is known. */
    async function drag(x) {
      pane.marking = true;
      await mark(fromX(x, size().plot));
      pane.marking = false;
    }
    function press([x, y], event) {
      grip = {
        x,
        y,
        view: { x: view.x.slice(), y: view.y && view.y.slice() },
        pans: event.shiftKey,
        marks: marker !== null && Math.abs(toX(marker, size().plot) - x) < 6,
      };
    }
    function move([x, y]) {
      const { plot } = size();
      if (!grip) {
        if (view.y && x >= plot.x && x <= plot.x + plot.w) hover(fromX(x, plot), fromY(y, plot));
        return;
      }
      if (grip.marks) {
        if (!pane.marking) drag(Math.min(plot.x + plot.w, Math.max(plot.x, x)));
      } else if (grip.pans) {
        const dx = ((grip.x - x) / plot.w) * (view.x[1] - view.x[0]);
        const dy = view.y ? ((y - grip.y) / plot.h) * (view.y[1] - view.y[0]) : 0;
        look(
          grip.view.x.map((end) => end + dx),
          grip.view.y?.map((end) => end + dy),
          60,
        );
      } else if (Math.hypot(x - grip.x, y - grip.y) > 5) {
        box = [grip.x, grip.y, x, y];
        const ends = [grip.x, x].sort((a, b) => a - b).map((end) => fromX(end, plot));
        readout.textContent = `Let go to see ${parameter.symbol} from ${ends.map((end) => `${shown(parameter.grazing + end, 8)} (offset ${shown(end, 4)})`).join(" to ")}`;
        redraw();
      }
    }
    function release([x, y]) {
      const { plot } = size();
      const held = grip;
      grip = null;
      if (!held || held.pans) return;
      if (held.marks) return mark(fromX(Math.min(plot.x + plot.w, Math.max(plot.x, x)), plot));
      if (box) {
        box = [held.x, held.y, x, y];
        const [left, top, w, h] = boxOf(plot);
        const across = [left, left + w].map((end) => fromX(end, plot));
        const up = isFlat() ? null : [top + h, top].map((end) => fromY(end, plot));
        box = null;
        look(across, up, 0);
      } else if (x >= plot.x && x <= plot.x + plot.w) {
        mark(fromX(x, plot));
      }
    }
    function zoomAt(factor, [x, y], event) {
      const { plot } = size();
      zoom(factor, [fromX(x, plot), view.y ? fromY(y, plot) : 0], event.altKey);
    }
    function keys(event) {
      const step = ((view.x[1] - view.x[0]) / columns()) * (event.shiftKey ? 10 : 1);
      const shift = (share) =>
        look(
          view.x.map((end) => end + share * (view.x[1] - view.x[0])),
          null,
          60,
        );
      const middle = marker ?? (view.x[0] + view.x[1]) / 2;
      return {
        ArrowLeft: () => mark(Math.max(view.x[0], middle - step)),
        ArrowRight: () => mark(Math.min(view.x[1], middle + step)),
        Escape: cancel,
        Backspace: () => undo.click(),
        PageUp: () => shift(-0.25),
        PageDown: () => shift(0.25),
      };
    }
    const cancel = () => ((grip = box = null), redraw());
    listen(canvas, { press, move, release, cancel, zoom, zoomAt, reset, keys });

    // What can be chosen.
    function toggle(name, changed) {
      const box = element("input", { type: "checkbox", checked: show[name] });
      box.onchange = () => {
        show[name] = box.checked;
        changed();
      };
      return element("label", { className: name }, box, name);
    }
    for (const heading of ["up", "down"]) {
      controls.append(toggle(heading, sweep));
    }
    if (branches.length) controls.append(toggle("branches", redraw));
    if (direct.length) controls.append(toggle("direct", redraw));
    if (observables.length > 1) {
      const choice = chooser(
        "What is drawn",
        observables.map(({ text }) => text),
        (number) => {
          observe = observables[number];
          direct = directOf();
          auto = true;
          sweep();
          trace();
        },
      );
      choice.selectedIndex = observables.indexOf(observe);
      controls.append(choice);
    }
    if (data.orders.length > 1) {
      const choice = chooser(
        "Orders of the map that is drawn; below it in a colour of its own the map itself",
        data.orders.map(([n, w], k) => `N ${n}, W ${w}${k ? "" : " (the map)"}`),
        (number) => {
          chosen = number;
          worker.postMessage({ kind: "begin", module: moduleBytes[chosen], data });
          if (marker !== null) mark(marker);
        },
      );
      controls.append(choice);
    }
    const csv = () => {
      const rows = ["heading,offset,value,outside,observed"];
      for (const heading of ["up", "down"]) {
        for (const column of show[heading]
          ? [...(layers[heading]?.values() ?? [])].sort((a, b) => a.offset - b.offset)
          : []) {
          for (const chunk of column.chunks)
            for (const v of chunk)
              rows.push(
                `${heading},${column.offset},${parameter.grazing + column.offset},${Number(column.outside)},${v}`,
              );
        }
      }
      return rows.join("\n") + "\n";
    };
    const undo = button("back", "Back to the view before", () => {
      const last = past.pop();
      auto = last.auto;
      view = last.view;
      undo.disabled = !past.length;
      look.at = -Infinity;
      redraw();
      sweep();
    });
    undo.disabled = true;
    controls.append(
      button("+", "Zoom in", () => zoom(0.6)),
      button("−", "Zoom out", () => zoom(1 / 0.6)),
      undo,
      button("whole", "Show the whole diagram", reset),
      ...savers("what is seen", () => `${data.scene}-${parameter.name}`, { canvas, paint, csv }),
    );
    const sliders = element("div", { className: "sliders" });
    data.parameters.forEach((other, n) => {
      if (n === axis) return;
      const reach = other.width ?? Math.abs(other.grazing) * 1e-3;
      const slider = element("input", { type: "range", min: -100, max: 100, step: 1, value: 0 });
      const says = element("output");
      slider.follow = () => {
        slider.value = Math.round((base[n] / reach) * 100);
        tell();
      };
      const tell = () => {
        says.textContent = `${other.symbol} = ${shown(other.grazing + base[n], 8)} (offset ${shown(base[n], 3)})`;
        slider.setAttribute("aria-valuetext", says.textContent);
      };
      slider.oninput = () => {
        base = base.slice();
        base[n] = (slider.value / 100) * reach;
        tell();
        sweep(30);
        if (marker !== null) mark(marker);
      };
      tell();
      slider.setAttribute("aria-label", other.name);
      sliders.append(element("div", {}, element("span", { textContent: other.name }), slider, says));
    });
    const hint = element("p", {
      className: "hint",
      textContent: `Drag across the diagram to zoom in. Click to see the orbit there and where its period ends. The strip below it is the period: black for none, pale without contact, grey outside the measured window.`,
    });
    const rest = data.branches_left_out;
    const more = [
      `By the map alone, over offsets of ${parameter.name} from its value at the graze, ${parameter.symbol}* = ${shown(parameter.grazing, 12)}; its values stand above. The gap h is negative where the free flow would pass the stop: h = −y².`,
      "A flat drag chooses the parameter alone, a higher one a box; Shift and drag moves the view; the wheel zooms after a click, with Alt the parameter alone; a double click shows the whole.",
      "Keys: left and right move the marker (with Shift faster), + and − zoom about it, page up and page down move the view, 0 shows the whole, Backspace the view before, Escape lets go of a drag.",
      ...(branches.length
        ? [
            `Branches are periodic orbits of the map, solid where stable, dashed where not, with the other parameters at the graze. GR graze, SN fold, PD flip, NS closed curve, BP branch point.${rest ? ` Of longer periods ${rest} ${rest > 1 ? "are" : "is"} left out.` : ""}`,
          ]
        : []),
    ];
    const help = element(
      "details",
      { className: "hint" },
      element("summary", { textContent: "What is drawn, mouse and keys" }),
      ...more.map((textContent) => element("p", { textContent })),
    );
    host.append(hint, controls, canvas, readout, sliders, panels, help);
    host.hidden = false;

    /** Goes to values of all parameters. */
    const goTo = (parameters) => {
      base = parameters.with(axis, 0);
      sliders.querySelectorAll("input").forEach((slider) => slider.follow());
      sweep();
      mark(parameters[axis]);
    };
    const pane = {
      goTo,
      diagram,
      canvas,
      readout,
      mark,
      look,
      reset,
      layers: () => layers,
      plot: () => size().plot,
      curves: () => curves,
      labels: () => labels,
      direct: () => direct,
      basin,
      first: 0,
      done: false,
    };
    panes.push(pane);
    trace();
    drawnAgain(canvas, () => {
      sums?.stale.fill(1);
      redraw();
    });
  }

  /** Cells as a worker finds them, each of so many columns and rows: painted, and kept by number. */
  const paintCells = (picture, found, cells, toneOf) => {
    const [g, { width, height }] = [picture.getContext("2d"), picture];
    for (const [column, row, every, kind] of found) {
      g.fillStyle = toneOf(kind);
      g.fillRect(column, height - row - every, every, every);
      for (let n = 0; n < every * every; n++)
        cells.set((row + Math.floor(n / every)) * width + column + (n % every), kind);
    }
  };

  /** Where the map takes the states about the attractor at a marker; a pane among its others. */
  function basinPane(host) {
    const [columns, rows] = [96, 72];
    const canvas = element("canvas", { tabIndex: 0 });
    canvas.setAttribute("role", "img");
    const legend = element("div", { className: "legend" });
    const says = element("output", { className: "readout" });
    let axes = [0, 1];
    let view = { x: [-1, 1], y: [-1, 1] };
    let cells = new Map();
    let attractors = [];
    let number = 0;
    let marked = null;
    let of = 0;
    const picture = element("canvas", { width: columns, height: rows });
    const workers = [];
    const receive = (message) => {
      if (message.number !== number) return;
      if (message.kind === "done") {
        pane.done = true;
        pane.time = message.time;
      } else if (message.kind === "found") {
        attractors = message.attractors;
        paintCells(picture, message.found, cells, toneOf);
      }
      draw();
    };
    const classOf = ({ period, touches }) =>
      period === 1 && !touches ? WITHOUT_CONTACT : period;
    /** The colour of its period; of a second attractor of that period one that no other has. */
    const tones = () => {
      const taken = [];
      for (const own of attractors) {
        const wanted = classColour(classOf(own));
        const free = PERIODS.find((tone) => !taken.includes(tone));
        taken.push(taken.includes(wanted) ? (free ?? wanted) : wanted);
      }
      return taken;
    };
    const toneOf = (kind) =>
      kind >= 0 ? tones()[kind] : kind === OUTSIDE ? classColour(OUTSIDE) : colour("--paper");
    const wordsOf = (kind) => {
      if (kind === undefined) return "";
      if (kind === ESCAPED) return "the orbit of the map escapes";
      if (kind === OUTSIDE) return "leaves the measured window";
      const own = classOf(attractors[kind]);
      const same = attractors.slice(0, kind).filter((other) => classOf(other) === own).length;
      return classWords(own) + (same ? `, another (${same + 1})` : "");
    };

    /** The plane of the window in which the map was measured: where a step stays inside it. */
    async function plane() {
      const { states } = marked;
      const reach = axes.map((axis) => {
        const far = Math.max(...states.map((state) => Math.abs(state[axis])));
        return data.window.state[axis] ?? (4 * far || data.escape[axis] || 1);
      });
      const count = 48;
      const middle = (n, axis) => reach[axis] * ((2 * n + 1) / count - 1);
      const points = [];
      for (let row = 0; row < count; row++)
        for (let column = 0; column < count; column++)
          points.push({
            parameters: marked.parameters,
            state: states[0].with(axes[0], middle(column, 0)).with(axes[1], middle(row, 1)),
          });
      const { values } = await ask({ kind: "images", points }, of);
      const [d, s] = [data.coordinates.length, data.passages.length];
      const inside = (n) => {
        for (let k = 0; k < d; k++)
          if (!(Math.abs(values[n * (d + s) + k]) <= (data.window.state[k] ?? Infinity)))
            return false;
        for (let k = d; k < d + s; k++)
          if (!(values[n * (d + s) + k] <= (data.window.depth ?? Infinity))) return false;
        return true;
      };
      const cell = [0, 1].map((axis) => reach[axis] / count);
      const ends = [0, 1].map((axis) => {
        const own = points
          .filter((_, n) => inside(n))
          .map(({ state }) => state[axes[axis]])
          .concat(states.map((state) => state[axes[axis]]));
        return [Math.min(...own) - cell[axis], Math.max(...own) + cell[axis]];
      });
      return { x: ends[0], y: ends[1] };
    }

    /** The orbit at the marker, where it is periodic, is an attractor that is known. */
    const known = () => {
      const { period, states, depths } = marked;
      const touches = depths.slice(0, period).some((own) => own.some((depth) => depth > 0));
      return period ? [{ period, touches, states: states.slice(0, period) }] : [];
    };

    async function compute() {
      const own = ++number;
      pane.done = false;
      const found = await plane();
      if (own !== number) return;
      view = found;
      cells = new Map();
      attractors = [];
      workers[of] ??= startWorker(receive, moduleBytes[of]);
      const sweep = {
        course: "basin",
        axes,
        ...view,
        columns,
        rows,
        parameters: marked.parameters,
        state: marked.states[0],
        transient: 2000,
        longest: 64,
        attractors: known(),
      };
      workers[of].postMessage({ kind: "sweeps", number, sweeps: [sweep] });
    }
    /** The basin at a marker whose orbit stays; a moment later, where the marker moves on. */
    function mark(answer, chosen) {
      [marked, of] = [answer, chosen];
      clearTimeout(mark.timer);
      pane.done = false;
      mark.timer = setTimeout(compute, 150);
    }

    const room = () => panelRoom(canvas);
    const nameOf = (axis) => data.coordinates[axes[axis]].name;
    function paint(g) {
      const plot = room();
      g.drawImage(picture, plot.x, plot.y, plot.w, plot.h);
      const ranges = [view.x, view.y];
      g.strokeStyle = colour("--paper");
      g.fillStyle = colour("--ink");
      for (const { period, states } of attractors) {
        for (const state of period ? states : []) {
          const [x, y] = place(plot, ranges, [state[axes[0]], state[axes[1]]]);
          g.beginPath();
          g.arc(x, y, 2.5, 0, 7);
          g.fill();
          g.stroke();
        }
      }
      drawAxes(g, plot, ranges, axes.map(offsetOf));
    }
    function draw() {
      drawOn(canvas, [canvas.clientWidth || 300, PANEL], paint);
      const kinds = [...new Set(cells.values())].sort((a, b) => b - a);
      legend.replaceChildren(
        ...kinds.map((kind) => {
          const patch = element("i");
          patch.style.background = toneOf(kind);
          return element("span", {}, patch, wordsOf(kind));
        }),
      );
      canvas.setAttribute(
        "aria-label",
        `Basins of attraction at the marker over ${nameOf(0)} and ${nameOf(1)}: ${kinds.map(wordsOf).join(", ")}`,
      );
    }
    const middle = (cell) => [
      view.x[0] + (((cell % columns) + 0.5) / columns) * (view.x[1] - view.x[0]),
      view.y[0] + ((Math.floor(cell / columns) + 0.5) / rows) * (view.y[1] - view.y[0]),
    ];
    canvas.addEventListener("pointermove", (event) => {
      const [plot, box] = [room(), canvas.getBoundingClientRect()];
      const column = Math.floor(((event.clientX - box.left - plot.x) / plot.w) * columns);
      const row = Math.floor(((plot.y + plot.h - event.clientY + box.top) / plot.h) * rows);
      if (column < 0 || column >= columns || row < 0 || row >= rows) return;
      const cell = row * columns + column;
      const at = middle(cell).map((value, axis) => `${nameOf(axis)} ${shown(value, 4)}`);
      says.textContent = [...at, wordsOf(cells.get(cell))].join(" · ");
    });
    const csv = () =>
      [
        `${nameOf(0)},${nameOf(1)},class`,
        ...[...cells]
          .sort(([a], [b]) => a - b)
          .map(([cell, kind]) => [...middle(cell), wordsOf(kind).replaceAll(",", "")].join(",")),
      ].join("\n") + "\n";
    const controls = element(
      "div",
      { className: "tools" },
      ...savers("the basins", () => `${data.scene}-basin`, { canvas, paint, csv }),
    );
    host.append(element("div", { className: "basin" }, canvas, controls, legend, says));
    const choose = (plane) => {
      axes = plane;
      if (marked) compute();
    };
    const pane = {
      mark,
      choose,
      canvas,
      done: false,
      columns,
      rows,
      view: () => view,
      cells: () => cells,
      attractors: () => attractors,
      words: wordsOf,
    };
    return pane;
  }

  /** The live chart of one of the run's. */
  function chartPane(host, chart) {
    const home = { x: chart.x, y: chart.y };
    let view = { x: home.x.slice(), y: home.y.slice() };
    const [across, upwards] = chart.axes.map((axis) => data.parameters[axis]);
    // The values beside the offsets, and the room of those on the right.
    const sides = Object.assign([across, upwards], { room: 76 });
    const [columns, rows] = [160, 120];
    const canvas = element("canvas", { tabIndex: 0 });
    canvas.setAttribute("role", "application");
    canvas.setAttribute(
      "aria-label",
      `Chart of the periods of the map over ${across.name} and ${upwards.name}. Arrow keys move the marker, plus and minus zoom, 0 shows the whole.`,
    );
    const readout = element("output", { className: "readout" });
    readout.setAttribute("aria-live", "polite");
    const legend = element("div", { className: "legend" });
    let cells = new Map();
    let layers = [];
    let number = 0;
    let marker = null;
    let box = null;
    let grip = null;
    const room = () => {
      const width = Math.max(280, canvas.clientWidth || 700);
      return { width, height: Math.round(Math.min(480, width * 0.66)), x: 68, y: 40 };
    };
    const inner = () => {
      const { width, height, x, y } = room();
      return { x, y, w: width - x - 84, h: height - y - 42 };
    };
    const worker = startWorker((message) => {
      if (message.kind === "ready") return compute();
      if (message.number !== number) return;
      if (message.kind === "done") {
        pane.done = true;
        pane.time = message.time;
        return tellLegend();
      }
      paintCells(layers.at(-1).canvas, message.found, cells, classColour);
      redraw();
    });
    function compute(delay = 0) {
      clearTimeout(compute.timer);
      compute.timer = setTimeout(() => {
        number += 1;
        pane.done = false;
        pane.number = number;
        cells = new Map();
        layers = [
          ...layers.slice(-1),
          {
            view: structuredClone(view),
            canvas: element("canvas", { width: columns, height: rows }),
          },
        ];
        const parameters = data.parameters.map(() => 0);
        worker.postMessage({
          kind: "sweeps",
          number,
          sweeps: [
            {
              course: "chart",
              axes: chart.axes,
              ...view,
              columns,
              rows,
              parameters,
              start: chart.start,
              transient: chart.transient,
              longest: chart.longest,
            },
          ],
        });
      }, delay);
    }
    function tellLegend() {
      const kinds = [...new Set(cells.values())].sort(
        (a, b) => (a < 1 ? 100 - a : a) - (b < 1 ? 100 - b : b),
      );
      const shownKinds = kinds
        .filter((kind) => kind < 9)
        .map((kind) => [classColour(kind), classWords(kind)]);
      if (kinds.some((kind) => kind >= 9))
        shownKinds.push([PERIODS[8], `period 9 to ${chart.longest}`]);
      legend.replaceChildren(
        ...shownKinds.map(([tone, text]) => {
          const patch = element("i");
          patch.style.background = tone;
          return element("span", {}, patch, text);
        }),
      );
    }
    let frame = 0;
    const redraw = () => {
      if (!frame) frame = requestAnimationFrame(() => ((frame = 0), draw()));
    };
    function draw() {
      const { width, height } = room();
      drawOn(canvas, [width, height], paint);
    }
    function paint(g) {
      const plot = inner();
      const ranges = [view.x, view.y];
      g.save();
      g.beginPath();
      g.rect(plot.x, plot.y, plot.w, plot.h);
      g.clip();
      for (const layer of layers) {
        const [x0, y1] = place(plot, ranges, [layer.view.x[0], layer.view.y[1]]);
        const [x1, y0] = place(plot, ranges, [layer.view.x[1], layer.view.y[0]]);
        g.drawImage(layer.canvas, x0, y1, x1 - x0, y0 - y1);
      }
      // The graze, and the marker.
      const [x, y] = place(plot, ranges, [0, 0]);
      g.fillStyle = colour("--paper");
      g.strokeStyle = colour("--ink");
      g.beginPath();
      g.arc(x, y, 4, 0, 7);
      g.fill();
      g.stroke();
      g.fillStyle = colour("--ink");
      g.font = "11px system-ui, sans-serif";
      g.textAlign = "left";
      writeOver(g, "graze", x + 8, y + 4);
      if (marker) {
        const [x, y] = place(plot, ranges, marker);
        for (const [tone, width] of [
          ["--paper", 4],
          ["--accent", 2],
        ]) {
          g.strokeStyle = colour(tone);
          g.lineWidth = width;
          g.beginPath();
          g.arc(x, y, 6, 0, 7);
          g.stroke();
        }
        g.lineWidth = 1;
      }
      if (box) {
        g.fillStyle = colour("--accent") + "44";
        g.strokeStyle = colour("--paper");
        g.fillRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
        g.strokeRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
      }
      g.restore();
      const names = [across, upwards].map(({ symbol }) => `${symbol} − ${symbol}*`);
      drawAxes(g, plot, ranges, names, { values: sides });
    }
    const from = ([x, y]) => {
      const plot = inner();
      return [
        view.x[0] + ((x - plot.x) / plot.w) * (view.x[1] - view.x[0]),
        view.y[0] + ((plot.y + plot.h - y) / plot.h) * (view.y[1] - view.y[0]),
      ];
    };
    const kindAt = ([a, b]) => {
      const column = Math.floor(((a - view.x[0]) / (view.x[1] - view.x[0])) * columns);
      const row = Math.floor(((b - view.y[0]) / (view.y[1] - view.y[0])) * rows);
      return column < 0 || column >= columns || row < 0 || row >= rows
        ? undefined
        : cells.get(row * columns + column);
    };
    const say = (point) => {
      const values = [across, upwards].map(
        (own, n) =>
          `${own.name} = ${shown(own.grazing + point[n], 8)} (offset ${shown(point[n], 4)})`,
      );
      readout.textContent = [...values, classWords(kindAt(point))].filter(Boolean).join(" · ");
    };
    function mark(point) {
      marker = point;
      say(point);
      redraw();
      const parameters = data.parameters
        .map(() => 0)
        .with(chart.axes[0], point[0])
        .with(chart.axes[1], point[1]);
      for (const pane of panes)
        if (pane.goTo && chart.axes.includes(pane.diagram.axis)) pane.goTo(parameters);
    }
    const look = (x, y, delay) => {
      if (
        !(x[1] - x[0] > 1e-13 * (Math.abs(across.grazing) || 1e-3)) ||
        !(y[1] - y[0] > 1e-13 * (Math.abs(upwards.grazing) || 1e-3))
      )
        return;
      view = { x, y };
      redraw();
      compute(delay);
    };
    const zoom = (factor, point) => {
      const [a, b] = point ?? marker ?? [(view.x[0] + view.x[1]) / 2, (view.y[0] + view.y[1]) / 2];
      look(
        view.x.map((end) => a + (end - a) * factor),
        view.y.map((end) => b + (end - b) * factor),
        60,
      );
    };
    const reset = () => look(home.x.slice(), home.y.slice(), 0);
    const press = (own) => (grip = own);
    const move = (own) => {
      if (grip && Math.hypot(own[0] - grip[0], own[1] - grip[1]) > 5) box = [...grip, ...own];
      if (grip) return redraw();
      if (kindAt(from(own)) !== undefined) say(from(own));
    };
    const release = (own) => {
      const held = grip;
      grip = null;
      if (!held) return;
      if (!box) return mark(from(own));
      box = null;
      const [a, b] = [from(held), from(own)];
      const sorted = (n) => [Math.min(a[n], b[n]), Math.max(a[n], b[n])];
      look(sorted(0), sorted(1), 0);
    };
    const zoomAt = (factor, own) => zoom(factor, from(own));
    const cancel = () => ((grip = box = null), redraw());
    const keys = () => {
      const [a, b] = marker ?? [(view.x[0] + view.x[1]) / 2, (view.y[0] + view.y[1]) / 2];
      const step = [(view.x[1] - view.x[0]) / columns, (view.y[1] - view.y[0]) / rows];
      return {
        ArrowLeft: () => mark([a - step[0], b]),
        ArrowRight: () => mark([a + step[0], b]),
        ArrowUp: () => mark([a, b + step[1]]),
        ArrowDown: () => mark([a, b - step[1]]),
        Escape: cancel,
      };
    };
    listen(canvas, { press, move, release, cancel, zoom, zoomAt, reset, keys });
    const name = `${data.scene}-${across.name}-${upwards.name}`;
    const csv = () => {
      const lines = [...cells]
        .sort(([a], [b]) => a - b)
        .map(([cell, kind]) => {
          const at = [
            view.x[0] + (((cell % columns) + 0.5) / columns) * (view.x[1] - view.x[0]),
            view.y[0] + ((Math.floor(cell / columns) + 0.5) / rows) * (view.y[1] - view.y[0]),
          ];
          return [
            at[0],
            at[1],
            across.grazing + at[0],
            upwards.grazing + at[1],
            classWords(kind),
          ].join(",");
        });
      return (
        [
          `${across.name},${upwards.name},${across.name}_value,${upwards.name}_value,class`,
          ...lines,
        ].join("\n") + "\n"
      );
    };
    const controls = element(
      "div",
      { className: "tools" },
      button("+", "Zoom in", () => zoom(0.6)),
      button("−", "Zoom out", () => zoom(1 / 0.6)),
      button("whole", "Show the whole chart", reset),
      ...savers("the chart that is seen", () => name, { canvas, paint, csv }),
    );
    const hint = element("p", {
      className: "hint",
      textContent:
        "Drag a box to zoom in, click to go to these parameters in the diagrams above, double click for the whole; the wheel zooms after a click. Keys: arrows move the marker, + and − zoom, 0 shows the whole. By the map alone, each cell from the same start.",
    });
    host.append(hint, controls, canvas, legend, readout);
    const pane = { chart, canvas, plot: inner, done: false, cells: () => cells };
    panes.push(pane);
    drawnAgain(canvas, redraw);
  }

  try {
    for (const host of document.querySelectorAll(".live")) {
      const diagram = data.diagrams[host.dataset.diagram];
      const chart = data.charts[host.dataset.chart];
      if (!diagram && !chart) continue;
      // A diagram is computed when it comes into sight.
      const observer = new IntersectionObserver(
        (entries) => {
          if (!entries.some((entry) => entry.isIntersecting)) return;
          observer.disconnect();
          if (diagram) diagramPane(host, diagram);
          else chartPane(host, chart);
        },
        { rootMargin: "200px" },
      );
      host.hidden = false;
      observer.observe(host);
    }
  } catch (error) {
    console.warn("the page stays as the run drew it:", error);
  }
})();
