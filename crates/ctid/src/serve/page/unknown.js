// The unexplained error: against time, and against what it depends on, as the report draws it.
import { $, figure, plot } from "./dom.js";
import * as server from "./server.js";

const VARIABLE = { rate: "net inflow", input: "command" };

let shown = null;
let drawing = null;

export async function show(state) {
  const found = state.diagnosis;
  const variable = found?.unknown;
  $("unknown-part").hidden = !variable;
  if (!variable || shown === found.id) return;
  shown = found.id;
  const { drawing: report } = await server.fit(found.id);
  if (shown !== found.id) return;
  drawing = diagnosisFigures(report, { chosen: report.steps.length - 1, output: 0, residualRecord: 0, sameAxes: true });
  const last = found.groups.length ? `with ${found.groups.map((one) => one.effect).join(", ")}` : "as it was diagnosed";
  $("unknown-lead").textContent = `The term that has to be added to the model ${last} so that it fits the data.`;
  const path = figure("unknown-path", "Against time", "Smoothed, with its 95 % band, on the first fitted record; shaded where the band excludes zero.");
  const shape = figure("unknown-shape", `Against the ${VARIABLE[variable] || variable}`, "Fitted with all parameters of the plant; the part that these parameters explain as well is removed. With its 95 % band.");
  $("unknown-figures").replaceChildren(path, ...(variable === "time" ? [] : [shape]));
  draw();
}

export function draw() {
  if (!drawing || !window.Plotly) return;
  for (const id of ["unknown-path", "unknown-shape"]) {
    const box = $(`plot-${id}`);
    if (box) plot(box, id, drawing.figures[id]());
  }
}
