// The models over the measurements: the trail of the falling error, curves, residuals, parameters.
import { $, fill, figure, make, named, plot, table, units } from "./dom.js";
import * as server from "./server.js";

const BINNED = "Above the samples with the mean of each bin, below the root mean square of each bin; hatched bars fail clearly.";
/** The places of the figures that show where a model fails. */
function fails(report) {
  const inputs = report.steps[0]?.outputs[0]?.failures.by_input ?? [];
  return [
    ["by-time", "Residual against time", "Measured minus model; shaded where it clearly fails, dashed the noise floor."],
    ["by-output", "Against the model's output", BINNED],
    ...inputs.map((input, k) => [`by-input-${k}`, inputs.length > 1 ? `Against the input ${input.name}` : "Against the input", BINNED]),
    ["by-direction", "By direction of the model's output", "Bars: root mean square; diamonds: mean."],
    ["by-frequency", "By frequency", "Root mean square of the residual in each octave."],
  ];
}

let drawing = null;
let view = { chosen: 0, output: 0, residualRecord: 0, sameAxes: true };
let fits = [];
let key = "";
let state = null;

const label = (trail, k) => {
  if (k === 0 || trail[k].effects.length - trail[k - 1].effects.length !== 1) return trail[k].name;
  const [effect, place] = trail[k].effects[trail[k].effects.length - 1];
  return `+ ${named({ effect, place })}`;
};

/** One report of all models on the trail. */
function joined(trail, bodies) {
  const last = bodies[bodies.length - 1].drawing;
  return { ...last, steps: bodies.map((body, k) => ({ ...body.drawing.steps[body.drawing.steps.length - 1], label: label(trail, k) })) };
}

export async function show(next) {
  state = next;
  $("empty").hidden = state.records.some((one) => one.read);
  const trail = state.trail;
  const wanted = JSON.stringify([trail.map((one) => one.id), state.records.map((one) => [one.name, one.held_out, one.read]), state.settings.columns]);
  document.querySelector(".see").classList.toggle("stale", trail.length > 0 && state.current === null);
  if (wanted === key) return;
  // While the next model is fitted the last one stays in sight, but not where the records are others.
  if (!trail.length && fits.length && state.job && sameRecords(wanted)) return;
  key = wanted;
  if (!state.records.some((one) => one.read)) { clear(); return; }
  const bodies = await Promise.all(trail.map((one) => server.fit(one.id)));
  const report = bodies.length ? joined(trail, bodies) : await server.data();
  if (key !== wanted) return;
  fits = bodies;
  const held = report.records.findIndex((record) => !record.held_out);
  const output = view.output < report.outputs.length ? view.output : 0;
  view = { ...view, chosen: Math.max(0, bodies.length - 1), output, residualRecord: Math.max(0, held) };
  drawing = diagnosisFigures(report, view);
  places(report);
  offer(report.outputs);
  words(trail, report);
  draw();
}

const sameRecords = (wanted) => key && JSON.stringify(JSON.parse(key).slice(1)) === JSON.stringify(JSON.parse(wanted).slice(1));

function clear() {
  fits = [];
  drawing = null;
  for (const part of ["trail-part", "fit-part", "fails-part", "parameters-part"]) $(part).hidden = true;
}

/** Makes the places of the plots, which stay as long as the records do. */
function places(report) {
  const wanted = report.records.map((record) => record.name + record.held_out).join("\n");
  if ($("record-figures").dataset.of !== wanted) {
    $("record-figures").dataset.of = wanted;
    $("record-figures").replaceChildren(...report.records.map((record, k) => figure(`record-${k}`, [record.name, " ", make("span", { className: "badge" }, record.held_out ? "held out" : "fitted")])));
  }
  const all = fails(report);
  const titles = all.map(([, title]) => title).join("\n");
  if ($("fail-figures").dataset.of !== titles) {
    $("fail-figures").dataset.of = titles;
    const [first, ...rest] = all.map((one) => figure(...one));
    $("fail-figures").replaceChildren(first, make("div", { className: "pairs" }, rest));
  }
}

/** The choice of the output that the figures show, where there are several. */
function offer(outputs) {
  $("output-choice").hidden = outputs.length < 2;
  fill($("shown-output"), outputs.map(({ name }, o) => make("option", { value: String(o) }, name)));
  $("shown-output").value = String(view.output);
  $("shown-output").onchange = () => {
    view.output = Number($("shown-output").value);
    draw();
  };
}

/** The error of each output: large where there is one, else each on a line with its name. */
function errors(one, unit) {
  const several = one.errors.length > 1;
  const line = ({ output, text }) => [text, " ", make("small", {}, units(unit), several ? ` ${output}` : null)];
  const held = ({ output, test }) => make("span", { className: "test" }, `held out ${test} `, units(unit), several ? ` ${output}` : null);
  return {
    number: make("span", { className: several ? "number several" : "number" }, several ? one.errors.map((error) => make("span", {}, line(error))) : line(one.errors[0])),
    held: one.errors.filter(({ test }) => test !== null).map(held),
  };
}

function words(trail, report) {
  const some = fits.length > 0;
  $("fit-part").hidden = false;
  $("h-fit").textContent = some ? "Measured against model" : "The record";
  $("fit-lead").textContent = some
    ? `Above the ${report.outputs.length > 1 ? "readings of each output" : "reading"} and the models, below the input. Shaded: where the chosen model clearly fails. Drag to zoom, double-click to see all again.`
    : "As it was measured. Choose a plant, and the model is drawn over it.";
  for (const part of ["trail-part", "fails-part", "parameters-part"]) $(part).hidden = !some;
  if (!some) return;
  const out = fits[0].drawing.output_unit;
  const held = trail.some((one) => one.errors.some(({ test }) => test !== null));
  fill($("trail"), trail.map((one, k) => {
    const of = errors(one, out);
    const text = [of.number, make("span", { className: "label" }, label(trail, k)), ...of.held];
    const pick = make("button", { type: "button", id: `step-${k}`, className: "step", ariaPressed: String(k === view.chosen), title: "show this model" }, text);
    pick.addEventListener("click", () => choose(k));
    return make("li", {}, pick);
  }));
  $("trail-test").textContent = held ? " Below it the same on the held-out record, which was not used for fits or selection." : "";
  chosenWords();
}

function chosenWords() {
  const fit = fits[view.chosen];
  const step = fit.drawing.steps[fit.drawing.steps.length - 1];
  document.querySelectorAll("#trail .step").forEach((one, k) => one.setAttribute("aria-pressed", String(k === view.chosen)));
  fill($("fails"), step.sentences.map((sentence) => make("li", {}, units(sentence))));
  fill($("fit-sentences"), fit.sentences.map((sentence) => make("p", {}, units(sentence))));
  $("held-out-parts").hidden = !fit.held_out_error;
  fill($("held-out-parts"), units(fit.held_out_error));
  table($("parameters"), [["Parameter"], ["Estimate", true], ["± standard error", true], ["Unit"]],
    fit.parameters.map((one) => [make("code", {}, one.name), one.value, one.error ?? "–", units(one.unit)]));
  $("parameters-caption").textContent = `${fit.starts_agree === 0 ? `None of ${fit.starts} starts around it reached it` : `${fit.starts_agree} of ${fit.starts} starts ended in this minimum`}. –: the data do not determine it, or it is at a bound.`;
}

function choose(k) {
  view.chosen = k;
  chosenWords();
  draw();
}

/** Draws every figure that has a place, again where the scheme or the width has changed. */
export function draw() {
  if (!drawing || !window.Plotly) return;
  for (const [id, figure] of Object.entries(drawing.figures)) {
    const box = $(`plot-${id}`);
    // The unexplained error is that of the diagnosis, not of these fits.
    if (!box || id.startsWith("unknown-") || !id.startsWith("record-") && !fits.length) continue;
    const made = id === "trail" && fits.length < 2 ? null : figure();
    if (made && id === "trail") {
      made.layout.height = 240;
      made.layout.yaxis.title.text = drawing.ofOutput("error");
    }
    box.parentElement.hidden = !made;
    if (made) plot(box, id, made);
  }
  link();
}

/** The residual shows the stretch of time that the record shows, and the other way round. */
function link() {
  const pair = [$(`plot-record-${view.residualRecord}`), $("plot-by-time")];
  if (!fits.length || pair.some((box) => !box || !box.on || box.dataset.linked)) return;
  let busy = false;
  pair.forEach((box, k) => {
    box.dataset.linked = "yes";
    box.on("plotly_relayout", (change) => {
      const all = "xaxis.autorange" in change;
      if (busy || !all && !("xaxis.range[0]" in change)) return;
      busy = true;
      const update = all ? { "xaxis.autorange": true } : { "xaxis.range": [change["xaxis.range[0]"], change["xaxis.range[1]"]] };
      Plotly.relayout(pair[1 - k], update).finally(() => { busy = false; });
    });
  });
}
