// The experiment that distinguishes two effects.
import { $, fill, figure, make, plot, table, units } from "./dom.js";
import * as server from "./server.js";

let shown = null;
let design = null;
let question = null;

const limit = (id) => {
  const text = $(`limit-${id}`).value.trim().replace(",", ".");
  if (text && !Number.isFinite(Number(text))) throw new Error(`"${text}" is not a number; write it with digits and without a unit`);
  return text ? Number(text) : null;
};

/** Asks for the experiment that distinguishes two effects of a group, within what the plant allows. */
export async function ask(what, fail) {
  question = what;
  try {
    const [low, high] = [limit("low"), limit("high")];
    if ((low === null) !== (high === null)) throw new Error("one end of the range alone is not enough; give both, or neither");
    await server.run("design", { ...what, range: low === null ? null : [low, high], slew: limit("slew"), duration: limit("duration") });
  } catch (error) {
    fail(error.message);
  }
}

export function start(fail) {
  $("design-again").addEventListener("click", () => question && ask(question, fail));
}

export function show(state) {
  design = state.design;
  $("experiment-part").hidden = !design;
  $("design-again").disabled = !question;
  if (!design || design.id === shown) return;
  const sheet = make("table");
  table(sheet, [["Experiment"], ["Range"], ["Held for"], ["Level"], ["Power", true], ["Decides", true]],
    design.rows.map((row) => [row.kind, row.range, row.held || "", row.level || "", row.power, row.decides]));
  fill($("experiment"),
    make("p", { className: "lead" }, `${design.between[0]} or ${design.between[1]}; ${design.name} from ${design.limits}.`),
    design.sentences.map((sentence) => make("p", {}, units(sentence))),
    design.twins ? null : figure("experiment", `The best one: ${design.name}`),
    design.twins ? null : make("p", {}, make("a", { className: "button", href: server.link("experiment"), download: "next.csv" }, "Download next.csv")),
    make("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: "Experiments" }, sheet),
    make("p", { className: "caption" }, "Power: expected rise of the criterion of the wrong model. Decides: the probability that it ends more than 6 above the right one."));
  $("experiment-part").focus();
  $("experiment-part").scrollIntoView({ block: "start" });
  shown = design.id;
  draw();
}

export function draw() {
  const box = $("plot-experiment");
  if (!box || !design || !window.Plotly) return;
  const { theme, axis, layout, named, plain, pretty } = plots;
  const data = [{ x: design.time, y: design.values, mode: "lines", line: { shape: "hv", color: theme().best, width: 1.8 }, hovertemplate: "%{x:.6~g} s: %{y:.4~g}<extra></extra>" }];
  plot(box, "experiment", { data, layout: layout(260, { xaxis: axis("time [s]", { exponentformat: "none" }), yaxis: axis(named(plain(design.name), pretty(design.unit))) }) });
}
