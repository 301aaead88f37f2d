// The experiment that tells two effects of a model of one's own apart: at one of its inputs, or at several.
import { $, fill, figure, make, plot, table, units } from "./dom.js";
import * as server from "./server.js";

let shown = null;
let design = null;
let question = null;
let fields = "";

function number(id, what) {
  const text = $(id).value.trim().replace(",", ".");
  if (text && !Number.isFinite(Number(text))) throw new Error(`${what}: "${text}" is not a number; write it with digits and without a unit`);
  return text ? Number(text) : null;
}

/** What each input may do. */
function limits(signals) {
  return signals.map(({ name }, k) => {
    const [low, high] = [number(`own-low-${k}`, name), number(`own-high-${k}`, name)];
    if ((low === null) !== (high === null)) throw new Error(`${name}: one end of the range alone is not enough; give both, or neither`);
    return { name, apply: $(`own-apply-${k}`).checked, range: low === null ? null : [low, high], slew: number(`own-slew-${k}`, name) };
  });
}

const inputs = ({ own }) => (own?.signals || []).filter(({ role }) => role === "input");

/** Asks for the experiment that distinguishes two effects of a group, within what the plant allows. */
export async function ask(what, fail) {
  question = what;
  try {
    await server.run("design", { ...what, inputs: limits(inputs(server.current())), duration: number("own-duration", "duration") });
  } catch (error) {
    fail(error.message);
  }
}

/** A row of fields for each input. */
function form(state) {
  const all = inputs(state);
  const wanted = JSON.stringify(all.map(({ name, unit }) => [name, unit]));
  if (wanted === fields) return;
  fields = wanted;
  const field = (id, label, size) => make("label", {}, `${label} `, make("input", { id, size, inputMode: "decimal", autocomplete: "off" }));
  fill($("own-limits"), all.map(({ name, unit }, k) => make("div", { className: "limits" },
    make("label", {}, make("input", { id: `own-apply-${k}`, type: "checkbox", autocomplete: "off" }), " ", make("code", {}, name), ...(unit ? [" [", ...units(unit), "]"] : [])),
    field(`own-low-${k}`, "from", 6), field(`own-high-${k}`, "to", 6), field(`own-slew-${k}`, "at most a second", 6))));
}

export function start(fail) {
  $("own-design-again").addEventListener("click", () => question && ask(question, fail));
}

export function show(state) {
  form(state);
  design = state.own.design;
  $("own-experiment-part").hidden = !design;
  $("own-design-again").disabled = !question;
  if (!design || design.id === shown) return;
  const sheet = make("table");
  table(sheet, [["Experiment"], ["Outputs reach"], ["Power", true], ["Decides", true]], design.rows.map((row) => [row.what, row.reaches.map((one) => make("div", {}, units(one))), row.power, row.decides]));
  fill($("own-experiment"),
    make("p", { className: "lead" }, `${design.between[0]} or ${design.between[1]}; `, units(design.limits), "."),
    design.sentences.map((sentence) => make("p", {}, units(sentence))),
    design.twins ? null : design.inputs.map(({ name }, k) => figure(`own-input-${k}`, `The best one: ${name}`)),
    design.twins ? null : make("p", {}, make("a", { className: "button", href: server.link("experiment"), download: "next.csv" }, "Download next.csv")),
    make("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: "Experiments" }, sheet),
    make("p", { className: "caption" }, "Power: expected rise of the criterion of the wrong model; ~ before it is confirmed by a refit. Decides: the probability that it ends more than 6 above the right one."));
  $("own-experiment-part").focus();
  $("own-experiment-part").scrollIntoView({ block: "start" });
  shown = design.id;
  draw();
}

export function draw() {
  if (!design || design.twins || !window.Plotly) return;
  const { theme, axis, layout, named, plain, pretty } = plots;
  design.inputs.forEach(({ name, unit, values }, k) => {
    const box = $(`plot-own-input-${k}`);
    if (!box) return;
    const data = [{ x: design.time, y: values, mode: "lines", line: { shape: design.held ? "hv" : "linear", color: theme().best, width: 1.8 }, hovertemplate: "%{x:.6~g} s: %{y:.4~g}<extra></extra>" }];
    plot(box, `own-input-${k}`, { data, layout: layout(220, { xaxis: axis("time [s]", { exponentformat: "none" }), yaxis: axis(named(plain(name), pretty(unit))) }) });
  });
}
