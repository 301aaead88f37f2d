// Small helpers for the page: every text from a file or a model goes in as text, never as HTML.

export const $ = (id) => document.getElementById(id);

/** An element with properties and children; strings become text. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined) continue;
    if (name in element && name !== "list") element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** Replaces the children, but only where they differ: focus and selection stay. */
export function fill(element, ...children) {
  const next = make("div", {}, ...children);
  if (next.innerHTML === element.innerHTML && !next.querySelector("button, input, select")) return;
  const focused = element.contains(document.activeElement) ? document.activeElement.id : "";
  element.replaceChildren(...next.childNodes);
  if (focused) document.getElementById(focused)?.focus();
}

export const button = (text, properties, press) => {
  const element = make("button", { type: "button", ...properties }, text);
  element.addEventListener("click", press);
  return element;
};

/** An effect, and where it acts where there is a choice. */
export const named = ({ effect, place }) => (place ? `${effect} (${place})` : effect);

const raised = (text) => text.split(/\^(-?\d+(?:\.\d+)?)/).map((part, k) => (k % 2 ? make("sup", {}, part) : part));

/** A command of which no option breaks between two lines. */
const command = (text) => make("code", {}, text.split(/(--[\w-]+)/).map((part, k) => (k % 2 ? make("span", { className: "option" }, part) : part)));

/** A text in which units have raised exponents, and commands look like it. */
export function units(text) {
  return String(text ?? "").split(/`([^`]+)`/).flatMap((part, k) => (k % 2 ? command(part) : raised(part)));
}

export function table(element, heads, rows) {
  fill(element,
    make("thead", {}, make("tr", {}, heads.map(([text, number]) => make("th", { scope: "col", className: number ? "number" : "" }, text)))),
    make("tbody", {}, rows.map((cells) => make("tr", {}, cells.map((cell, k) => make(k ? "td" : "th", { className: heads[k][1] ? "number" : "", ...(k ? {} : { scope: "row" }) }, cell))))));
}

// A plot follows its place, whatever has changed that: plotly looks at the window alone.
const watched = new ResizeObserver((changes) => {
  for (const { target } of changes) {
    if (target.classList.contains("js-plotly-plot") && target.clientWidth > 0 && target.clientWidth !== target._fullLayout?.width) Plotly.Plots.resize(target);
  }
});

/** Draws a figure in its place. */
export function plot(box, id, made) {
  Plotly.react(box, ...plots.tooled(id, made));
  watched.observe(box);
}

/** A place for a plot. */
export function figure(id, heading, caption = "") {
  return make("figure", { "aria-labelledby": `plot-${id}-name` },
    make("figcaption", {}, make("h3", { id: `plot-${id}-name` }, heading), caption ? make("p", { className: "caption" }, caption) : null),
    make("div", { className: "plot", id: `plot-${id}` }));
}
