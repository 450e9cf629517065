// Elements of the page.

/** @param {string} id */
export const byId = (id) => document.getElementById(id);

/**
 * Element with properties and children.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Partial<HTMLElementTagNameMap[Name]>} properties
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[Name]}
 */
export const element = (name, properties = {}, ...children) => {
  const made = document.createElement(name);
  Object.assign(made, properties);
  made.append(...children);
  return made;
};

/**
 * Button with a label for those who do not see it.
 * @param {string} text
 * @param {string} label
 * @param {() => void} action
 */
export const button = (text, label, action) => {
  const made = element("button", {
    type: "button",
    textContent: text,
    title: label,
    onclick: action,
  });
  made.setAttribute("aria-label", label);
  return made;
};

/**
 * Choice among words.
 * @param {string} label
 * @param {string[]} words
 * @param {(number: number) => void} choose
 */
export const chooser = (label, words, choose) => {
  const options = words.map((text) => element("option", { textContent: text }));
  const choice = element("select", {}, ...options);
  choice.setAttribute("aria-label", label);
  choice.onchange = () => choose(choice.selectedIndex);
  return choice;
};

/**
 * Bar of buttons and choices.
 * @param {(Node | string)[]} children
 */
export const toolbar = (...children) => element("div", { className: "tools" }, ...children);

/**
 * Canvas with a role and a description.
 * @param {string} role
 * @param {string} label
 */
export const pictured = (role, label = "") => {
  const canvas = element("canvas");
  canvas.setAttribute("role", role);
  canvas.setAttribute("aria-label", label);
  return canvas;
};

/** Line of words that follows the pointer and the marker. */
export const readout = () => {
  const output = element("output", { className: "readout" });
  output.setAttribute("aria-live", "polite");
  return output;
};

/**
 * Shows which class each colour stands for.
 * @param {HTMLElement} legend
 * @param {[tone: string, text: string][]} entries
 */
export const tellLegend = (legend, entries) =>
  legend.replaceChildren(
    ...entries.map(([tone, text]) => {
      const patch = element("i");
      patch.style.background = tone;
      return element("span", {}, patch, text);
    }),
  );

/**
 * Calls `draw` at the next frame, once for all calls until then.
 * @param {() => void} draw
 */
export const nextFrame = (draw) => {
  let frame = 0;
  return () => {
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      draw();
    });
  };
};

/**
 * Draws again when the room or the colours change.
 * @param {HTMLCanvasElement} canvas
 * @param {() => void} draw
 */
export const drawnAgain = (canvas, draw) => {
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
};
