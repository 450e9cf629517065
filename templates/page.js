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
  for (const line of document.querySelectorAll(".command")) {
    const code = line.querySelector("code");
    const copy = button("copy", "Copy the command", async () => {
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
  const ticks = (from, to, count) => {
    const rough = (to - from) / count;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find((n) => n * unit >= rough * 0.999);
    const first = Math.ceil(from / step - 1e-9);
    const values = [];
    for (let n = first; n * step <= to + 1e-9 * step && values.length < 50; n++)
      values.push(n * step);
    const largest = Math.max(Math.abs(from), Math.abs(to));
    const power = largest >= 1e4 || largest < 1e-2 ? Math.floor(Math.log10(largest)) : 0;
    const digits = Math.max(0, Math.ceil(power - Math.log10(step) - 1e-9));
    const label = (value) => (value / 10 ** power).toFixed(Math.min(digits, 12)).replace("-", "−");
    return { values, power, label };
  };
  const place = (room, [rx, ry], [a, b]) => [
    room.x + ((a - rx[0]) / (rx[1] - rx[0])) * room.w,
    room.y + room.h - ((b - ry[0]) / (ry[1] - ry[0])) * room.h,
  ];
  /** A frame with round values and names below and on the left. */
  const drawAxes = (g, room, ranges, labels) => {
    g.font = "11px system-ui, sans-serif";
    g.strokeStyle = colour("--rule");
    g.strokeRect(room.x, room.y, room.w, room.h);
    g.fillStyle = colour("--ink");
    for (const [n, range] of ranges.entries()) {
      const { values, power, label } = ticks(
        range[0],
        range[1],
        n ? 4 : Math.max(2, Math.floor(room.w / 80)),
      );
      for (const value of values) {
        const [x, y] = place(room, ranges, n ? [ranges[0][0], value] : [value, ranges[1][0]]);
        g.textAlign = n ? "right" : "center";
        g.fillText(label(value), n ? x - 4 : x, n ? y + 4 : y + 14);
      }
      g.textAlign = "center";
      g.save();
      g.translate(
        n ? room.x - 45 : room.x + room.w / 2,
        n ? room.y + room.h / 2 : room.y + room.h + 32,
      );
      if (n) g.rotate(-Math.PI / 2);
      g.fillText(labels[n] + (power ? ` / 10${superscript(power)}` : ""), 0, 0);
      g.restore();
    }
  };
  const superscript = (power) =>
    String(power)
      .replace("-", "⁻")
      .replace(/\d/g, (d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const observables = [
    ...data.passages.map((name, depth) => ({
      text: data.passages.length > 1 ? `h at “${name}” (−y²)` : "h (−y²)",
      depth,
    })),
    ...data.coordinates.map(({ name }, coordinate) => ({ text: `${name} (offset)`, coordinate })),
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

  const offsetOf = (coordinate) => {
    const { name } = data.coordinates[coordinate];
    return `${name} − ${name}*`;
  };

  /** Numbers that the page holds packed. */
  const unpacked = (text) =>
    new Float64Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);

  /** The live diagram of one of the run's. */
  function diagramPane(host, diagram) {
    const axis = diagram.axis;
    const parameter = data.parameters[axis];
    const home = { x: [diagram.from, diagram.to], y: null };
    const margin = { left: 64, right: 12, top: 34, bottom: 42 };
    let view = { x: home.x.slice(), y: null };
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
    let layers = { up: new Map(), down: new Map() };
    let stale = { up: new Map(), down: new Map() };
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
    let drawn = false;
    let marker = null;
    let status = "";
    let lastTimes = {};

    const canvas = element("canvas", { tabIndex: 0 });
    canvas.setAttribute("role", "img");
    const readout = element("output", { className: "readout" });
    readout.setAttribute("aria-live", "polite");
    const controls = element("div", { className: "tools" });
    const panels = element("div", { className: "panels", hidden: true });
    const portrait = element("canvas");
    const series = element("canvas");
    const single = data.coordinates.length === 1;
    for (const [panel, label] of [
      [
        portrait,
        single ? "Cobweb of the orbit on the graph of the map" : "States of the orbit on the section",
      ],
      [series, "Depth in each iterate"],
    ]) {
      panel.setAttribute("role", "img");
      panel.setAttribute("aria-label", label);
    }
    const facts = element("div", { className: "facts" });
    panels.append(portrait, series);
    const basin = single ? null : basinPane(panels);
    panels.append(facts);
    const words = `Bifurcation diagram of the map over ${parameter.name}. Arrow keys move the marker, plus and minus zoom, page up and page down shift, 0 shows the whole.`;
    canvas.setAttribute("aria-label", words);

    let reference = null;
    let chosen = 0;
    const worker = startWorker((message) => {
      if (message.kind === "ready") return sweep();
      if (message.number !== number) return;
      if (message.kind === "done") {
        lastTimes[message.heading] = message.time;
        pane.rate = message.iterates / message.time / 1000;
        status = "";
        pane.done = Object.keys(lastTimes).length >= Number(show.up) + Number(show.down);
        pane.times = { ...lastTimes };
      } else {
        if (!drawn) pane.first = performance.now() - started;
        drawn = true;
        take(message);
      }
      redraw();
    });

    /** Takes columns in: those of a later pass replace a preview, those of the last add to it. */
    function take({ heading, found }) {
      const layer = layers[heading];
      for (const column of found) {
        const old = layer.get(column.column);
        if (column.pass === 2 && old) {
          old.chunks.push(column.values);
          old.state = column.state;
        } else {
          layer.set(column.column, { ...column, chunks: [column.values] });
        }
      }
      if (auto) fit();
    }

    /** The height that shows everything there is. */
    function fit() {
      let [low, high] = [Infinity, -Infinity];
      for (const heading of ["up", "down"]) {
        for (const { chunks, outside } of show[heading] ? layers[heading].values() : []) {
          for (const value of chunks[0]) {
            if (value < low) low = value;
            if (value > high) high = value;
          }
        }
      }
      const edge = 0.04 * (high - low) || Math.abs(high) * 0.1 || 1e-12;
      if (low <= high) view.y = [low - edge, high + edge];
    }

    const size = () => {
      const ratio = Math.min(2, devicePixelRatio || 1);
      const width = Math.max(280, canvas.clientWidth || 700);
      const height = Math.round(Math.min(460, Math.max(260, width * 0.6)));
      return {
        ratio,
        width,
        height,
        plot: {
          x: margin.left,
          y: margin.top,
          w: width - margin.left - margin.right,
          h: height - margin.top - margin.bottom,
        },
      };
    };
    const columns = () => Math.min(1000, Math.round(size().plot.w));

    /** Asks for the iterates of what is seen. */
    function sweep(delay = 0) {
      clearTimeout(sweep.timer);
      sweep.timer = setTimeout(() => {
        number += 1;
        started = performance.now();
        drawn = false;
        pane.done = false;
        pane.number = number;
        lastTimes = {};
        for (const heading of ["up", "down"]) {
          if (layers[heading].size) stale[heading] = layers[heading];
          layers[heading] = new Map();
        }
        const [from, to] = view.x;
        const common = {
          course: "sweep",
          axis,
          parameters: base,
          columns: columns(),
          from,
          to,
          observe: { depth: observe.depth, coordinate: observe.coordinate },
          transient: diagram.transient,
          keep: Math.min(diagram.keep, 400),
          more: Math.max(0, Math.ceil(1200 / Math.min(diagram.keep, 400)) - 1),
          start: diagram.start,
        };
        const [low, high] = [Math.min(...home.x), Math.max(...home.x)];
        const sweeps = ["up", "down"]
          .filter((heading) => show[heading])
          .map((heading) => ({ ...common, heading, anchor: heading === "up" ? low : high }));
        status = "computing …";
        worker.postMessage({ kind: "sweeps", number, sweeps });
        redraw();
      }, delay);
    }

    const toX = (offset, plot) =>
      plot.x + ((offset - view.x[0]) / (view.x[1] - view.x[0])) * plot.w;
    const toY = (value, plot) =>
      plot.y + plot.h - ((value - view.y[0]) / (view.y[1] - view.y[0])) * plot.h;
    const fromX = (x, plot) => view.x[0] + ((x - plot.x) / plot.w) * (view.x[1] - view.x[0]);
    const fromY = (y, plot) =>
      view.y[0] + ((plot.y + plot.h - y) / plot.h) * (view.y[1] - view.y[0]);

    /** Density of the iterates, as an image of the plot. */
    function density(plot, ratio) {
      const [w, h] = [Math.round(plot.w * ratio), Math.round(plot.h * ratio)];
      const image = new ImageData(w, h);
      if (!view.y) return image;
      const counts = new Uint16Array(w * h);
      const kind = new Uint8Array(w * h);
      const span = view.x[1] - view.x[0];
      const scale = h / (view.y[1] - view.y[0]);
      const paint = (layer, tone, cleared) => {
        for (const column of layer.values()) {
          const middle = ((column.offset - view.x[0]) / span) * w;
          const half = (column.width / span) * w * 0.5;
          const left = Math.max(0, Math.round(middle - half));
          const right = Math.min(w, Math.max(left + 1, Math.round(middle + half)));
          if (middle + half < 0 || middle - half > w) continue;
          if (cleared) for (let x = left; x < right; x++) cleared[x] = 1;
          for (const values of column.chunks) {
            for (let n = 0; n < values.length; n++) {
              const y = h - 1 - Math.floor((values[n] - view.y[0]) * scale);
              if (y < 0 || y >= h) continue;
              for (let x = left; x < right; x++) {
                const place = y * w + x;
                if (counts[place] < 65535) counts[place]++;
                kind[place] |= tone === 8 ? 8 : column.outside ? 4 : tone;
              }
            }
          }
        }
      };
      for (const heading of reference ? ["up", "down"] : []) {
        if (show[heading]) paint(reference[heading], 8, null);
      }
      for (const heading of ["down", "up"]) {
        if (!show[heading]) continue;
        const tone = heading === "up" ? 1 : 2;
        const fresh = new Uint8Array(w);
        paint(layers[heading], tone, fresh);
        const old = new Map(
          [...stale[heading]].filter(([, column]) => {
            const x = Math.round(((column.offset - view.x[0]) / span) * w);
            return x < -w || x > 2 * w || !fresh[Math.min(w - 1, Math.max(0, x))];
          }),
        );
        paint(old, tone, null);
      }
      const rgb = (name) => {
        const text = colour(name).replace("#", "");
        return [0, 2, 4].map((n) => parseInt(text.slice(n, n + 2), 16));
      };
      const tones = {
        1: rgb("--up"),
        2: rgb("--down"),
        3: rgb("--both"),
        4: rgb("--outside"),
        8: rgb("--reference"),
      };
      for (let place = 0; place < counts.length; place++) {
        const count = counts[place];
        if (!count) continue;
        const own = kind[place];
        const [r, g, b] = tones[own & 3 || own & 4 || 8];
        image.data.set([r, g, b, Math.min(255, 90 + 45 * Math.log2(1 + count))], 4 * place);
      }
      return image;
    }

    let frame = 0;
    function redraw() {
      if (!frame) frame = requestAnimationFrame(() => ((frame = 0), draw()));
    }
    const back = element("canvas");

    function draw() {
      const { ratio, width, height, plot } = size();
      if (canvas.width !== width * ratio || canvas.height !== height * ratio) {
        canvas.width = width * ratio;
        canvas.height = height * ratio;
        canvas.style.height = `${height}px`;
      }
      const g = canvas.getContext("2d");
      g.setTransform(ratio, 0, 0, ratio, 0, 0);
      const [ink, soft, rule, panel] = ["--ink", "--soft", "--rule", "--panel"].map(colour);
      g.fillStyle = colour("--paper");
      g.fillRect(0, 0, width, height);
      // Beyond the window in the parameter.
      const bound = parameter.width;
      if (bound !== null) {
        g.fillStyle = panel;
        const [left, right] = [-bound, bound].map((x) =>
          Math.min(plot.x + plot.w, Math.max(plot.x, toX(x, plot))),
        );
        g.fillRect(plot.x, plot.y, left - plot.x, plot.h);
        g.fillRect(right, plot.y, plot.x + plot.w - right, plot.h);
      }
      if (view.y) {
        const image = density(plot, ratio);
        back.width = image.width;
        back.height = image.height;
        back.getContext("2d").putImageData(image, 0, 0);
        g.imageSmoothingEnabled = false;
        g.drawImage(back, plot.x, plot.y, plot.w, plot.h);
      }
      drawLayers(g, plot);
      // Where no orbit of the map stays.
      g.fillStyle = colour("--outside");
      for (const heading of ["up", "down"]) {
        for (const { gone, offset, width: wide } of show[heading] ? layers[heading].values() : []) {
          if (!gone) continue;
          const [left, right] = [offset - wide / 2, offset + wide / 2].map((end) => toX(end, plot));
          g.fillRect(left, plot.y + plot.h - 4, right - left, 4);
        }
      }
      // Axes: offsets below, physical values above.
      g.font = "12px system-ui, sans-serif";
      g.strokeStyle = rule;
      g.fillStyle = ink;
      g.lineWidth = 1;
      g.strokeRect(plot.x + 0.5, plot.y + 0.5, plot.w - 1, plot.h - 1);
      const across = Math.max(3, Math.floor(plot.w / 90));
      const x = ticks(view.x[0], view.x[1], across);
      g.textAlign = "center";
      for (const value of x.values) {
        const at = toX(value, plot);
        g.fillRect(at, plot.y + plot.h, 1, 4);
        g.fillText(x.label(value), at, plot.y + plot.h + 17);
      }
      const power = (n) => (n ? ` / 10${superscript(n)}` : "");
      g.fillText(
        `${parameter.symbol} − ${parameter.symbol}*${power(x.power)}`,
        plot.x + plot.w / 2,
        height - 6,
      );
      g.fillStyle = soft;
      const digits = Math.min(
        15,
        Math.max(
          3,
          Math.ceil(Math.log10(Math.abs(parameter.grazing || 1) / (view.x[1] - view.x[0]))) + 3,
        ),
      );
      const few = Math.max(1, Math.floor(plot.w / (9 * digits + 60)));
      for (let n = 0; n <= few; n++) {
        const offset = view.x[0] + ((view.x[1] - view.x[0]) * n) / few;
        g.textAlign = n === 0 ? "left" : n === few ? "right" : "center";
        g.fillText(shown(parameter.grazing + offset, digits), toX(offset, plot), plot.y - 6);
      }
      g.textAlign = "center";
      g.fillText(parameter.symbol, plot.x + plot.w / 2, 12);
      if (view.y) {
        const y = ticks(view.y[0], view.y[1], Math.max(3, Math.floor(plot.h / 55)));
        g.fillStyle = ink;
        g.textAlign = "right";
        for (const value of y.values) {
          const at = toY(value, plot);
          g.fillRect(plot.x - 4, at, 4, 1);
          g.fillText(y.label(value), plot.x - 7, at + 4);
        }
        g.save();
        g.translate(13, plot.y + plot.h / 2);
        g.rotate(-Math.PI / 2);
        g.textAlign = "center";
        g.fillText(observe.text + power(y.power), 0, 0);
        g.restore();
      }
      // The graze and the marker.
      const line = (offset, style, dash) => {
        if (offset < view.x[0] || offset > view.x[1]) return;
        g.strokeStyle = style;
        g.setLineDash(dash);
        g.beginPath();
        g.moveTo(toX(offset, plot), plot.y);
        g.lineTo(toX(offset, plot), plot.y + plot.h);
        g.stroke();
        g.setLineDash([]);
      };
      line(0, soft, [3, 3]);
      if (marker !== null) line(marker, colour("--accent"), []);
      if (box) {
        g.strokeStyle = colour("--accent");
        g.strokeRect(
          Math.min(box[0], box[2]),
          Math.min(box[1], box[3]),
          Math.abs(box[2] - box[0]),
          Math.abs(box[3] - box[1]),
        );
      }
      g.textAlign = "right";
      g.fillStyle = soft;
      if (status) g.fillText(status, plot.x + plot.w - 6, plot.y + 16);
      pane.view = { x: view.x.slice(), y: view.y && view.y.slice() };
    }

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
        const written = [];
        for (const { text, at: point } of labels) {
          const [x, y] = at(point);
          if (written.some(([a, b, word]) => word === text && Math.hypot(a - x, b - y) < 14))
            continue;
          written.push([x, y, text]);
          g.beginPath();
          g.arc(x, y, 3.5, 0, 7);
          g.stroke();
          g.fillText(text, x + 6, y - 6);
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
        for (const column of layers[heading].values()) {
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
      pane.marked = null;
      redraw();
      // Long enough for an approach that alternates, which would seem to have twice the period.
      const { answer, words } = await inspect(offset, undefined, 20_000);
      if (marker !== offset) return;
      readout.textContent = words;
      pane.marked = answer;
      panels.hidden = false;
      drawPanels(answer);
      basin?.mark(answer, chosen);
    }

    /** The states on the section, the depths, and what is said of the orbit at the marker. */
    function drawPanels(answer) {
      const number = (value) => shown(value, 5);
      facts.replaceChildren();
      if (answer.gone) {
        facts.append(element("p", { textContent: "The orbit of the map escapes here." }));
        for (const own of [portrait, series])
          own.getContext("2d").clearRect(0, 0, own.width, own.height);
        return;
      }
      const own = answer.multipliers.sort((a, b) => Math.hypot(...b) - Math.hypot(...a));
      const multipliers = own.map(([re, im]) =>
        Math.abs(im) > 1e-9 * Math.hypot(re, im)
          ? `${number(re)} ${im < 0 ? "−" : "+"} ${number(Math.abs(im))} i`
          : number(re),
      );
      const touched = answer.depths
        .slice(0, answer.period || 32)
        .map((own) => (own.some((depth) => depth > 0) ? "1" : "0"))
        .join("");
      const rows = [
        ["Period", answer.period ? `${answer.period}` : "none up to 256"],
        [
          "Contacts",
          `${touched.slice(0, 48)}${touched.length > 48 ? "…" : ""} (1: a return with contact)`,
        ],
        ["Multipliers", multipliers.join(", ") || "–"],
        ["Exponent", number(answer.exponent)],
        ["Offsets from", data.coordinates.map(({ name, value }) => `${name}* = ${shown(value, 8)}`).join(", ")],
        ["Window", answer.outside ? "outside: not to be trusted" : "inside"],
      ];
      facts.append(
        element(
          "dl",
          {},
          ...rows.flatMap(([name, text]) => [
            element("dt", { textContent: name }),
            element("dd", { textContent: text }),
          ]),
        ),
      );
      const plot = (own, points, labels, { joined, beneath = [] } = {}) => {
        const ratio = Math.min(2, devicePixelRatio || 1);
        const [w, h] = [own.clientWidth || 300, 220];
        own.width = w * ratio;
        own.height = h * ratio;
        const g = own.getContext("2d");
        g.setTransform(ratio, 0, 0, ratio, 0, 0);
        const room = { x: 56, y: 10, w: w - 66, h: h - 48 };
        const range = (n) => {
          const values = [points, ...beneath].flat().map((point) => point[n]);
          const [low, high] = [Math.min(...values), Math.max(...values)];
          // A period of one has an extent of rounding.
          const moves = high - low > 1e-6 * Math.max(Math.abs(high), Math.abs(low));
          const edge = moves ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1e-12;
          return [low - edge, high + edge];
        };
        const [rx, ry] = [range(0), range(1)];
        const at = (point) => place(room, [rx, ry], point);
        drawAxes(g, room, [rx, ry], labels);
        g.strokeStyle = colour("--soft");
        const line = (points) => {
          g.beginPath();
          points.forEach((point) => g.lineTo(...at(point)));
          g.stroke();
        };
        beneath.forEach(line);
        g.fillStyle = g.strokeStyle = colour(answer.outside ? "--outside" : "--up");
        if (joined) line(points);
        for (const point of points) {
          const [x, y] = at(point);
          g.fillRect(x - 1.5, y - 1.5, 3, 3);
        }
      };
      const names = data.coordinates.map(({ name }) => name);
      const kept = answer.states.slice(0, answer.period ? Math.max(answer.period, 2) : undefined);
      if (names.length > 1)
        plot(
          portrait,
          kept.map((state) => [state[0], state[1]]),
          [0, 1].map(offsetOf),
        );
      else drawCobweb(answer, kept, (...own) => plot(portrait, ...own));
      plot(
        series,
        answer.depths.slice(0, 60).map((own, n) => [n, -own[0]]),
        ["return", observables[0].text],
        { joined: true },
      );
    }

    /** Steps between the graph of a map of one coordinate and the diagonal. */
    async function drawCobweb(answer, kept, plot) {
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
      plot(steps, [`${offsetOf(0)}: a return`, "the next"], {
        joined: true,
        beneath: [
          graph,
          [
            [across[0], across[0]],
            [across[count], across[count]],
          ],
        ],
      });
    }

    // Zoom about a point, shift, choose.
    function look(x, y, delay) {
      const least = 1e-13 * Math.max(Math.abs(parameter.grazing), home.x[1] - home.x[0]);
      if (!(x[1] - x[0] > least)) return;
      view.x = x;
      if (y) {
        view.y = y;
        auto = false;
      }
      redraw();
      sweep(delay);
    }
    const about = (ends, middle, factor) => ends.map((end) => middle + (end - middle) * factor);
    function zoom(factor, point, onlyX) {
      const x = about(view.x, point?.[0] ?? marker ?? (view.x[0] + view.x[1]) / 2, factor);
      const y =
        onlyX || !view.y ? null : about(view.y, point?.[1] ?? (view.y[0] + view.y[1]) / 2, factor);
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
        const [a, b] = [held.x, x].sort((p, q) => p - q).map((end) => fromX(end, plot));
        const [c, d] = [held.y, y].sort((p, q) => q - p).map((end) => fromY(end, plot));
        box = null;
        // A flat box chooses the parameter alone.
        look([a, b], Math.abs(y - held.y) > 12 ? [c, d] : null, 0);
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
      const choice = element(
        "select",
        {},
        ...observables.map(({ text }) => element("option", { textContent: text })),
      );
      choice.selectedIndex = observables.indexOf(observe);
      choice.setAttribute("aria-label", "What is drawn");
      choice.onchange = () => {
        observe = observables[choice.selectedIndex];
        direct = directOf();
        layers = { up: new Map(), down: new Map() };
        stale = { up: new Map(), down: new Map() };
        auto = true;
        sweep();
        trace();
      };
      controls.append(choice);
    }
    if (data.orders.length > 1) {
      const words = data.orders.map(([n, w], k) => `N ${n}, W ${w}${k ? "" : " (the map)"}`);
      const choice = element(
        "select",
        {},
        ...words.map((text) => element("option", { textContent: text })),
      );
      choice.setAttribute(
        "aria-label",
        "Orders of the map that is drawn; below it in a colour of its own the map itself",
      );
      choice.onchange = () => {
        chosen = choice.selectedIndex;
        // The map's own iterates stay beneath those of lower orders.
        if (chosen && !reference) reference = structuredClone(layers);
        if (!chosen) reference = null;
        layers = { up: new Map(), down: new Map() };
        stale = { up: new Map(), down: new Map() };
        worker.postMessage({ kind: "begin", module: moduleBytes[chosen], data });
      };
      controls.append(choice);
    }
    const csv = () => {
      const rows = ["heading,offset,value,outside,observed"];
      for (const heading of ["up", "down"]) {
        for (const column of show[heading]
          ? [...layers[heading].values()].sort((a, b) => a.offset - b.offset)
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
    const picture = () => {
      const { width, height } = size();
      const [ns, name] = ["http://www.w3.org/2000/svg", `${data.scene}-${parameter.name}`];
      const svg = document.createElementNS(ns, "svg");
      const image = document.createElementNS(ns, "image");
      for (const [key, value] of Object.entries({
        width,
        height,
        viewBox: `0 0 ${width} ${height}`,
      }))
        svg.setAttribute(key, value);
      for (const [key, value] of Object.entries({ width, height, href: canvas.toDataURL() }))
        image.setAttribute(key, value);
      svg.append(image);
      save(`${name}.svg`, new XMLSerializer().serializeToString(svg), "image/svg+xml");
    };
    controls.append(
      button("+", "Zoom in", () => zoom(0.6)),
      button("−", "Zoom out", () => zoom(1 / 0.6)),
      button("whole", "Show the whole diagram", reset),
      button("SVG", "Save what is seen as SVG", picture),
      button("PNG", "Save what is seen as PNG", () =>
        canvas.toBlob((blob) => save(`${data.scene}-${parameter.name}.png`, blob)),
      ),
      button("CSV", "Save the iterates that are seen as CSV", () =>
        save(`${data.scene}-${parameter.name}.csv`, csv(), "text/csv"),
      ),
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
      const tell = () =>
        (says.textContent = `${other.symbol} = ${shown(other.grazing + base[n], 8)} (offset ${shown(base[n], 3)})`);
      slider.oninput = () => {
        base = base.slice();
        base[n] = (slider.value / 100) * reach;
        tell();
        sweep(30);
        if (marker !== null) mark(marker);
      };
      tell();
      sliders.append(element("label", {}, `${other.name} `, slider, says));
    });
    const hint = element("p", {
      className: "hint",
      textContent:
        "Drag a box to zoom, Shift and drag to move, click for the orbit at a value, wheel after a click, double click for the whole; keys: arrows, + − 0. By the map alone; grey: outside the measured window; a bar at the foot: the orbit escapes.",
    });
    if (branches.length) {
      const rest = data.branches_left_out;
      hint.textContent += ` Branches of periodic orbits of the map: solid stable, dashed unstable; GR graze, SN fold, PD flip, NS closed curve, BP branch point; with the other parameters at the graze.${rest ? ` ${rest} more are left out.` : ""}`;
    }
    host.append(controls, canvas, readout, sliders, panels, hint);
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
      curves: () => curves,
      labels: () => labels,
      direct: () => direct,
      basin,
      first: 0,
      done: false,
    };
    panes.push(pane);
    trace();
    new ResizeObserver(() => redraw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    return pane;
  }

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
  const classWords = (kind) =>
    kind === undefined
      ? ""
      : kind === WITHOUT_CONTACT
        ? "period 1 without contact"
        : kind === OUTSIDE
          ? "outside the measured window"
          : kind === 0
            ? "no period"
            : `period ${kind}`;
  const classColour = (kind) =>
    kind === WITHOUT_CONTACT
      ? "#f7eec3"
      : kind === OUTSIDE
        ? "#b3b7bc"
        : kind === 0
          ? "#1f2328"
          : PERIODS[Math.min(kind, 9) - 1];
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
        attractors: [],
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

    const room = () => ({ x: 56, y: 10, w: (canvas.clientWidth || 300) - 66, h: 172 });
    const nameOf = (axis) => data.coordinates[axes[axis]].name;
    function draw() {
      const ratio = Math.min(2, devicePixelRatio || 1);
      const [w, h] = [canvas.clientWidth || 300, 220];
      canvas.width = w * ratio;
      canvas.height = h * ratio;
      const g = canvas.getContext("2d");
      g.setTransform(ratio, 0, 0, ratio, 0, 0);
      g.imageSmoothingEnabled = false;
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
      button("PNG", "Save the basins as PNG", () =>
        canvas.toBlob((blob) => save(`${data.scene}-basin.png`, blob)),
      ),
      button("CSV", "Save the cells of the basins as CSV", () =>
        save(`${data.scene}-basin.csv`, csv(), "text/csv"),
      ),
    );
    const pairs = data.coordinates.flatMap((_, a) => data.coordinates.map((_, b) => [a, b]));
    const planes = pairs.filter(([a, b]) => a < b);
    if (planes.length > 1) {
      const choice = element(
        "select",
        {},
        ...planes.map((pair) =>
          element("option", {
            textContent: pair.map((axis) => data.coordinates[axis].name).join(", "),
          }),
        ),
      );
      choice.setAttribute("aria-label", "Coordinates of the plane of the basins");
      choice.onchange = () => {
        axes = planes[choice.selectedIndex];
        if (marked) compute();
      };
      controls.prepend(choice);
    }
    host.append(element("div", { className: "basin" }, canvas, legend, says, controls));
    const pane = {
      mark,
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
    const [columns, rows] = [160, 120];
    const canvas = element("canvas", { tabIndex: 0 });
    canvas.setAttribute("role", "img");
    canvas.setAttribute(
      "aria-label",
      `Periods of the map over ${across.name} and ${upwards.name}. Arrow keys move the marker, plus and minus zoom, 0 shows the whole.`,
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
      return { width, height: Math.round(Math.min(440, width * 0.62)), x: 60, y: 12 };
    };
    const inner = () => {
      const { width, height, x, y } = room();
      return { x, y, w: width - 72, h: height - 56 };
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
      const ratio = Math.min(2, devicePixelRatio || 1);
      const { width, height } = room();
      canvas.width = width * ratio;
      canvas.height = height * ratio;
      canvas.style.height = `${height}px`;
      const g = canvas.getContext("2d");
      g.setTransform(ratio, 0, 0, ratio, 0, 0);
      g.fillStyle = colour("--paper");
      g.fillRect(0, 0, width, height);
      const plot = inner();
      const ranges = [view.x, view.y];
      g.save();
      g.beginPath();
      g.rect(plot.x, plot.y, plot.w, plot.h);
      g.clip();
      g.imageSmoothingEnabled = false;
      for (const layer of layers) {
        const [x0, y1] = place(plot, ranges, [layer.view.x[0], layer.view.y[1]]);
        const [x1, y0] = place(plot, ranges, [layer.view.x[1], layer.view.y[0]]);
        g.drawImage(layer.canvas, x0, y1, x1 - x0, y0 - y1);
      }
      g.strokeStyle = colour("--accent");
      if (marker) {
        const [x, y] = place(plot, ranges, marker);
        g.lineWidth = 2;
        g.beginPath();
        g.arc(x, y, 5, 0, 7);
        g.stroke();
        g.lineWidth = 1;
      }
      if (box) g.strokeRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
      g.restore();
      drawAxes(
        g,
        plot,
        ranges,
        [across, upwards].map(
          ({ symbol }) => `${symbol} − ${symbol}*`,
        ),
      );
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
    const keys = () => {
      const [a, b] = marker ?? [(view.x[0] + view.x[1]) / 2, (view.y[0] + view.y[1]) / 2];
      const step = [(view.x[1] - view.x[0]) / columns, (view.y[1] - view.y[0]) / rows];
      return {
        ArrowLeft: () => mark([a - step[0], b]),
        ArrowRight: () => mark([a + step[0], b]),
        ArrowUp: () => mark([a, b + step[1]]),
        ArrowDown: () => mark([a, b - step[1]]),
      };
    };
    const cancel = () => ((grip = box = null), redraw());
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
      button("PNG", "Save what is seen as PNG", () =>
        canvas.toBlob((blob) => save(`${name}.png`, blob)),
      ),
      button("CSV", "Save the cells that are seen as CSV", () =>
        save(`${name}.csv`, csv(), "text/csv"),
      ),
    );
    const hint = element("p", {
      className: "hint",
      textContent:
        "Drag a box to zoom, wheel after a click, double click for the whole; a click goes to these parameters in the diagrams above. By the map alone, each cell from the same start.",
    });
    hint.textContent += ` Offsets from ${[across, upwards].map(({ symbol, grazing }) => `${symbol}* = ${shown(grazing, 8)}`).join(", ")}.`;
    host.append(controls, canvas, readout, legend, hint);
    const pane = { chart, canvas, done: false, cells: () => cells };
    panes.push(pane);
    new ResizeObserver(redraw).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
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
