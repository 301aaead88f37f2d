// Two chains of effects side by side; what is not fitted yet is fitted, and the model file stays as it is.
import { $, button, fill, figure, make, plot, table, units } from "./dom.js";
import * as server from "./server.js";

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

let wanted = null;
let drawn = "";
let report = null;
let options = "";
let touched = false;

export function start(fail) {
  const select = (id, text) => [make("label", { htmlFor: id }, text), make("select", { id })];
  $("chains").addEventListener("change", () => { touched = true; });
  $("chains").append(...select("chain-a", "First"), ...select("chain-b", "Second"), button("Compare", { id: "compare-chains", className: "primary" }, () => {
    wanted = { pair: [$("chain-a").value, $("chain-b").value].map((text) => JSON.parse(text)), fail };
    drawn = "";
    show(server.current());
  }));
}

export const forget = () => { wanted = null; };

export async function show(state) {
  $("chains-part").hidden = !state.models.length;
  const all = state.chains.map((one) => ({ name: one.name, value: JSON.stringify(one.effects) }));
  const texts = JSON.stringify(all);
  if (texts !== options) {
    options = texts;
    ["chain-a", "chain-b"].forEach((id, k) => {
      const before = $(id).value;
      fill($(id), all.map((chain) => make("option", { value: chain.value }, chain.name)));
      // What somebody has chosen stays; else it is the base model and the model as it stands.
      const kept = touched && all.some((chain) => chain.value === before);
      $(id).value = kept ? before : all[Math.min(k, all.length - 1)]?.value ?? "";
    });
  }
  // What cannot be fitted is not tried again.
  if (state.failure) wanted = null;
  if (!wanted) return;
  const fitted = (chain) => state.models.find((one) => same(one.effects, chain));
  const missing = wanted.pair.find((chain) => !fitted(chain));
  if (missing) {
    if (!state.job) await server.run("chain", { effects: missing }).catch((e) => { const { fail } = wanted; wanted = null; fail(e.message); });
    return;
  }
  const pair = wanted.pair.map(fitted);
  const key = pair.map((one) => one.id).join("/");
  if (key === drawn) return;
  drawn = key;
  const bodies = await Promise.all(pair.map((one) => server.fit(one.id)));
  result(pair, bodies);
}

function result(pair, bodies) {
  const out = bodies[0].drawing.output_unit;
  const names = [...new Set(bodies.flatMap((body) => body.parameters.map((one) => one.name)))];
  const estimate = (body, name) => {
    const one = body.parameters.find((parameter) => parameter.name === name);
    return one ? [one.value, one.error ? ` ± ${one.error}` : "", " ", ...units(one.unit)] : "";
  };
  const sheet = make("table");
  const rows = pair[0].errors.flatMap(({ output }, o) => {
    const of = output === null ? "" : `${output}: `;
    const row = (title, key) => [`${of}${title}`, ...pair.map((one) => [one.errors[o][key], " ", ...units(out)])];
    return [row("Simulation error", "text"), ...(pair.some((one) => one.errors[o].test) ? [row("On held-out data", "test")] : [])];
  });
  rows.push(["BIC (smaller is better)", ...pair.map((one) => one.bic)]);
  for (const name of names) rows.push([make("code", {}, name), ...bodies.map((body) => estimate(body, name))]);
  table(sheet, [[""], [pair[0].name, true], [pair[1].name, true]], rows);
  fill($("chain-result"), figure("chains", "Both over the measurements"), make("div", { className: "scroll", tabIndex: 0, role: "region", ariaLabel: "Two chains" }, sheet));
  const steps = bodies.map((body, k) => ({ ...body.drawing.steps[body.drawing.steps.length - 1], label: pair[k].name }));
  report = { ...bodies[0].drawing, steps };
  draw();
}

export function draw() {
  const box = $("plot-chains");
  if (!box || !report || !window.Plotly) return;
  const record = Math.max(0, report.records.findIndex((one) => !one.held_out));
  const { figures } = diagnosisFigures(report, { chosen: 1, output: 0, residualRecord: record, sameAxes: true });
  const made = figures[`record-${record}`]();
  made.layout.shapes = [];
  plot(box, `record-${record}`, made);
}
