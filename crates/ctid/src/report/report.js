// Draws the plots of a diagnosis: every figure for the chosen step.
"use strict";
(() => {
  const report = JSON.parse(document.getElementById("data").textContent);
  const records = report.records || [];
  const steps = report.steps || [];
  const located = Math.max(0, records.findIndex((record) => !record.held_out));
  const view = { chosen: steps.length - 1, output: 0, residualRecord: located, sameAxes: true };
  const { figures, stepColour, sized, several } = diagnosisFigures(report, view);

  // --- drawing -----------------------------------------------------------------------------

  const place = (id) => document.getElementById(`plot-${id}`);

  function draw(id) {
    const box = place(id);
    if (!box) return;
    const made = steps.length ? figures[id]() : null;
    box.parentElement.hidden = made === null;
    if (made) Plotly.react(box, ...plots.tooled(id, made));
  }

  const drawAll = () => Object.keys(figures).forEach(draw);

  function words() {
    const step = steps[view.chosen];
    if (!step) return;
    const put = (id, text) => { const e = document.getElementById(id); if (e) e.textContent = text; };
    put("whiteness", step.outputs[view.output].whiteness);
    put("input-test", step.outputs[view.output].input_test);
    const error = ({ rmse }, o) => `${several ? `${report.outputs[o].name} ` : ""}${rmse === null ? "unknown" : sized(rmse, report.outputs[o].unit)}`;
    put("shown", `${step.label}: simulation error ${step.outputs.map(error).join(", ")}`);
    const list = document.getElementById("failure-sentences");
    if (list) list.replaceChildren(...step.sentences.map((s) => { const item = document.createElement("li"); item.textContent = s; return item; }));
    document.querySelectorAll("#steps [data-step]").forEach((b) => {
      const here = Number(b.dataset.step) === view.chosen;
      b.setAttribute("aria-pressed", String(here));
      // On a narrow screen the buttons scroll.
      if (here) b.parentElement.scrollTop = b.offsetTop - (b.parentElement.clientHeight - b.offsetHeight) / 2;
    });
    if (steps.length > 1) document.querySelectorAll("table [data-step]").forEach((cell) => cell.classList.toggle("chosen", Number(cell.dataset.step) === view.chosen));
  }

  function paint() {
    document.querySelectorAll("#steps [data-step] .swatch").forEach((s, k) => { s.style.background = stepColour(k); });
  }

  function choose(k) {
    view.chosen = Math.min(Math.max(k, 0), steps.length - 1);
    words();
    // The ranking is that of the first step, the unknown that of the last: they stay.
    Object.keys(figures).filter((id) => id !== "scores" && !id.startsWith("unknown")).forEach(draw);
  }

  // The residual and its record show the same stretch of time.
  function link() {
    const pair = () => [place(`record-${view.residualRecord}`), place("by-time")];
    let busy = false;
    const follow = (from) => (change) => {
      const [a, b] = pair();
      if (busy || !a || !b || (from !== a && from !== b)) return;
      const other = from === a ? b : a;
      const update = {};
      if ("xaxis.autorange" in change) update["xaxis.autorange"] = true;
      else if ("xaxis.range[0]" in change) update["xaxis.range"] = [change["xaxis.range[0]"], change["xaxis.range[1]"]];
      else return;
      busy = true;
      Plotly.relayout(other, update).finally(() => { busy = false; });
    };
    ["by-time", ...records.map((_, r) => `record-${r}`)].map(place).filter((box) => box && box.on).forEach((box) => box.on("plotly_relayout", follow(box)));
  }

  function listen() {
    const nav = document.getElementById("steps");
    let playing = null;
    const stop = () => {
      clearInterval(playing);
      playing = null;
      const play = document.getElementById("play");
      if (play) { play.textContent = "▶ watch the error fall"; play.setAttribute("aria-pressed", "false"); }
    };
    if (nav) {
      nav.addEventListener("click", (event) => {
        const button = event.target.closest("button");
        if (!button) return;
        if (button.id !== "play") { stop(); choose(Number(button.dataset.step)); return; }
        if (playing !== null) { stop(); return; }
        button.textContent = "■ stop";
        button.setAttribute("aria-pressed", "true");
        choose(0);
        playing = setInterval(() => { choose(view.chosen + 1); if (view.chosen === steps.length - 1) stop(); }, 1500);
      });
      nav.addEventListener("keydown", (event) => {
        const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!move || event.target.id === "play" || event.target.id === "shown-output") return;
        event.preventDefault();
        stop();
        choose(view.chosen + move);
        nav.querySelector(`[data-step="${view.chosen}"]`).focus();
      });
    }
    const output = document.getElementById("shown-output");
    if (output) {
      output.value = String(view.output);
      output.addEventListener("change", () => { view.output = Number(output.value); choose(view.chosen); });
    }
    const select = document.getElementById("residual-record");
    if (select) {
      select.value = String(view.residualRecord);
      select.addEventListener("change", () => {
        view.residualRecord = Number(select.value);
        draw("by-time");
        Plotly.relayout(place("by-time"), { "xaxis.autorange": true });
      });
    }
    const axes = document.getElementById("same-axes");
    if (axes) axes.addEventListener("change", () => { view.sameAxes = axes.checked; choose(view.chosen); });
  }

  paint();
  words();
  plots.start(() => { paint(); drawAll(); }, () => { link(); listen(); });
})();
