// The unexplained error in a model of one's own: the function at a port that stands for it, as the report draws it.
import { $, fill, figure, make, plot, table, units } from "./dom.js";

let shown = null;
let drawing = null;

/** `keep`: the field for a name and the button that put the function into the model file, or take it out. */
export function show({ diagnosis: found }, keep) {
  const term = found?.unknown;
  $("own-unknown-part").hidden = !term;
  if (!term) { shown = drawing = null; return; }
  fill($("own-unknown-lead"),
    "The best function is ", make("code", {}, term.placed), ", of ", make("code", {}, term.variable), `. It is ${term.shown_term}`,
    term.unit ? [", in ", ...units(term.unit)] : null, ". Keep it in the model until its physics is known: ", ...keep(term.effect),
    " or, on the command line, ", units(`\`${term.command}\``), ".");
  if (shown === found.id) return;
  shown = found.id;
  const clock = { start_ms: null, seconds: 1, unit: "s" };
  drawing = diagnosisFigures({ clock, unknown: term }, { chosen: 0, output: 0 });
  $("own-unknown-figure").replaceChildren(figure("unknown-shape", `${term.effect} against ${term.variable}`,
    "Fitted with all parameters of the model, over the range that the records visited; with its 95 % band."));
  table($("own-unknown-places"), [["Function"], ["Fall of BIC", true], ["Fall of the left-out error", true]],
    term.places.map((one) => [one.placed, one.bic_gain, one.left_out || "–"]));
  $("own-unknown-compared").textContent = found.compared;
  draw();
}

export function draw() {
  const box = $("own-unknown-figure").querySelector(".plot");
  if (box && drawing && window.Plotly) plot(box, "unknown-shape", drawing.figures["unknown-shape"]());
}
