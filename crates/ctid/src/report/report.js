// Draws the plots of a diagnosis: every figure for the chosen step.
"use strict";
(() => {
  const report = JSON.parse(document.getElementById("data").textContent);
  const { narrow, tight, theme, plain, pretty, named, axis, config } = plots;
  const records = report.records || [];
  const steps = report.steps || [];
  const located = Math.max(0, records.findIndex((record) => !record.held_out));
  let chosen = steps.length - 1;
  let residualRecord = located;
  let sameAxes = true;

  const DASHES = ["dash", "solid", "dot", "dashdot", "longdash", "longdashdot"];
  const stepColour = (k) => theme().steps[k % theme().steps.length];

  // --- words -------------------------------------------------------------------------------

  const OUT = pretty(report.output_unit);
  const IN = pretty(report.input_unit);
  const sized = (value, unit) => `${value === null ? "–" : Number(value.toPrecision(2))} ${unit}`.trim();

  // --- parts of a figure -------------------------------------------------------------------

  // The curves that were switched on stay so while the step stays.
  const layout = (height, more) => {
    const made = plots.layout(height, more);
    made.legend.uirevision = chosen;
    return made;
  };

  const present = (values) => values.filter((v) => v !== null && v !== undefined);
  const largest = (values) => present(values).reduce((most, v) => Math.max(most, Math.abs(v)), 0);
  // What the axes must hold: every step, so that a fall is seen as a fall, or the chosen one alone.
  const seen = () => (sameAxes ? steps : [steps[chosen]]);
  const level = () => (report.noise_floor > 0 ? report.noise_floor : null);

  // The windows of a record in which the chosen step fails: the larger the error, the stronger.
  function failingWindows(r) {
    const most = largest(seen().flatMap((s) => s.failures.by_time.map((b) => b.rms))) || 1;
    return steps[chosen].failures.by_time.filter((b) => b.fails && b.record === r).map((b) => ({
      type: "rect", xref: "x", yref: "paper", x0: b.from, x1: b.to, y0: 0, y1: 1, layer: "below",
      fillcolor: theme().failing, opacity: 0.08 + 0.37 * ((b.rms || 0) / most), line: { width: 0 },
    }));
  }

  const across = (y, yref, colour, dash) => ({
    type: "line", xref: "paper", x0: 0, x1: 1, yref, y0: y, y1: y, line: { color: colour, width: 1.5, dash },
  });
  const floorLine = (yref) => (level() === null ? [] : [across(level(), yref, theme().text, "dash")]);

  const hatch = (where) => ({
    shape: where.map((yes) => (yes ? "/" : "")), fgcolor: where.map(() => theme().ground), fgopacity: 0.7, fillmode: "overlay", size: 8, solidity: 0.2,
  });
  const barMarker = (bins) => ({
    color: bins.map((b) => (b.fails ? theme().failing : theme().passing)),
    pattern: hatch(bins.map((b) => b.fails)),
  });
  const binHover = (bins, name) => bins.map((b, k) =>
    `${name(b, k)}<br>${b.count} values, rms ${sized(b.rms, OUT)}, mean ${sized(b.mean, OUT)}${b.fails ? "<br>fails" : ""}`);

  const tallest = (kind) => 1.08 * largest([level(), ...seen().flatMap((s) => s.failures[kind].map((b) => b.rms))]) || 1;

  // --- the figures -------------------------------------------------------------------------

  function recordFigure(r) {
    const record = records[r];
    const c = theme();
    const data = [{
      name: "measured", x: record.output.t, y: record.output.y, mode: "lines", line: { color: c.measured, width: 1.3 }, opacity: 0.75,
      hovertemplate: `%{y:.4~g} ${OUT}`,
    }];
    steps.forEach((step, k) => {
      const run = step.runs[r];
      if (!run) return;
      const main = k === chosen;
      data.push({
        name: plain(step.label), x: run.output.t, y: run.output.y, mode: "lines",
        line: { color: stepColour(k), width: main ? 2.6 : 1.6, dash: main ? "solid" : DASHES[k % DASHES.length] },
        visible: main || k === 0 ? true : "legendonly", legendrank: 1001 + k, zorder: main ? 2 : 1,
        hovertemplate: `%{y:.4~g} ${OUT}`,
      });
    });
    data.push({
      name: "input", x: record.input.t, y: record.input.y, yaxis: "y2", mode: "lines", showlegend: false,
      line: { color: c.faint, width: 1.2, shape: "hv" }, hovertemplate: `%{y:.4~g} ${IN}`,
    });
    return { data, layout: layout(narrow.matches ? 400 : 460, {
      showlegend: true, hovermode: "x unified", hoversubplots: "axis", shapes: failingWindows(r),
      xaxis: axis("time [s]", { anchor: "y2", exponentformat: "none", hoverformat: ".6~g", showspikes: false }),
      yaxis: axis(named("output", OUT), { domain: [0.33, 1] }),
      yaxis2: axis(named("input", IN), { domain: [0, 0.24], nticks: 4 }),
    }) };
  }

  function byTime() {
    const run = steps[chosen].runs[residualRecord];
    if (!run) return null;
    const most = 1.05 * largest(seen().flatMap((s) => (s.runs[residualRecord] ? s.runs[residualRecord].residual.y : []))) || 1;
    const floor = level() === null ? [] : [across(level(), "y", theme().text, "dash"), across(-level(), "y", theme().text, "dash")];
    return { data: [{
      x: run.residual.t, y: run.residual.y, mode: "lines", line: { color: stepColour(chosen), width: 1.4 }, name: "residual",
      hovertemplate: `%{x:.6~g} s: %{y:.3~g} ${OUT}<extra></extra>`,
    }], layout: layout(narrow.matches ? 240 : 280, {
      hovermode: "x", shapes: failingWindows(residualRecord).concat(floor),
      xaxis: axis("time [s]", { exponentformat: "none", hoverformat: ".6~g" }), yaxis: axis(named("residual", OUT), { range: [-most, most] }),
    }) };
  }

  // Every sample and the bin means above, the rms of the bins below.
  function binned(kind, at, title) {
    const bins = steps[chosen].failures[kind].filter((b) => b.count > 0);
    if (!bins.length) return null;
    const cloud = steps[chosen].cloud;
    const centre = bins.map((b) => (b.from + b.to) / 2);
    const most = 1.05 * largest(seen().flatMap((s) => (s.cloud ? s.cloud.residual : s.failures[kind].map((b) => b.mean)))) || 1;
    const data = [];
    if (cloud) {
      data.push({
        x: cloud[at], y: cloud.residual, mode: "markers", marker: { color: stepColour(chosen), size: 4, opacity: 0.4 },
        hovertemplate: `%{x:.4~g}: %{y:.3~g} ${OUT}<extra></extra>`,
      });
    }
    data.push({
      x: centre, y: bins.map((b) => b.mean), mode: "lines+markers", line: { color: theme().text, width: 2 }, marker: { size: 6 },
      hovertemplate: "mean %{y:.3~g}<extra></extra>",
    }, {
      type: "bar", x: centre, y: bins.map((b) => b.rms), width: bins.map((b) => 0.9 * (b.to - b.from)), yaxis: "y2", marker: barMarker(bins),
      hovertext: binHover(bins, (b) => `${sized(b.from, "")} to ${sized(b.to, "")}`), hoverinfo: "text", textposition: "none",
    });
    return { data, layout: layout(400, {
      hovermode: "closest", shapes: floorLine("y2"),
      xaxis: axis(title, { anchor: "y2" }),
      yaxis: axis(named("residual", OUT), { domain: [0.42, 1], range: [-most, most] }),
      yaxis2: axis(named("rms", OUT), { domain: [0, 0.34], range: [0, tallest(kind)], nticks: 4 }),
    }) };
  }

  function bars(kind, name, means, title) {
    const bins = steps[chosen].failures[kind];
    if (!bins.length) return null;
    const names = bins.map(name);
    const data = [{
      type: "bar", x: names, y: bins.map((b) => b.rms), marker: barMarker(bins), hovertext: binHover(bins, name), hoverinfo: "text", textposition: "none",
    }];
    let low = 0;
    if (means) {
      low = Math.min(0, ...present(seen().flatMap((s) => s.failures[kind].map((b) => b.mean)))) * 1.15;
      data.push({
        x: names, y: bins.map((b) => b.mean), mode: "markers", marker: { symbol: "diamond", size: 11, color: theme().text, line: { color: theme().ground, width: 2 } },
        hovertemplate: "mean %{y:.3~g}<extra></extra>",
      });
    }
    return { data, layout: layout(300, {
      hovermode: "closest", shapes: floorLine("y"), xaxis: axis(title, { type: "category" }),
      yaxis: axis(named("residual", OUT), { range: [low, tallest(kind)] }),
    }) };
  }

  function directionName(bin, k, bins) {
    const all = bins || steps[chosen].failures.by_direction;
    if (all.length === 3) return ["falling", "steady", "rising"][k];
    return `${sized(bin.from, "")} to ${sized(bin.to, "")} /s`;
  }

  // 0.002 Hz reads as 2 mHz.
  const hertz = (f) => (f === null ? "∞" : f < 0.1 ? `${Number((1000 * f).toPrecision(2))} m` : `${Number(f.toPrecision(2))} `);
  const bandName = (bin) => {
    const [from, to] = [hertz(bin.from), hertz(bin.to)];
    return from.endsWith("m") === to.endsWith("m") ? `${parseFloat(from)}–${to}Hz` : `${from}Hz–${to}Hz`;
  };

  function correlation(kind, bound, first) {
    const values = steps[chosen].tests[kind].slice(first);
    if (!values.length) return null;
    const lags = values.map((_, k) => k + first);
    const half = steps[chosen].tests[bound];
    const most = Math.min(1.05, 1.1 * largest(seen().flatMap((s) => [...s.tests[kind].slice(first), s.tests[bound]])) || 1);
    const c = theme();
    const outside = values.map((v) => (half !== null && Math.abs(v) > half ? c.failing : c.passing));
    return { data: [
      { type: "bar", x: lags, y: values, width: 0.22, marker: { color: outside }, hoverinfo: "skip" },
      { x: lags, y: values, mode: "markers", marker: { color: outside, size: 7 }, hovertemplate: "lag %{x}: %{y:.2f}<extra></extra>" },
    ], layout: layout(280, {
      hovermode: "closest",
      shapes: half === null ? [] : [
        { type: "rect", xref: "paper", x0: 0, x1: 1, y0: -half, y1: half, fillcolor: c.band, line: { width: 0 }, layer: "below" },
        across(half, "y", c.best, "dot"), across(-half, "y", c.best, "dot")],
      xaxis: axis("lag [samples]", { range: [first - 0.7, lags[lags.length - 1] + 0.7] }),
      yaxis: axis("correlation", { range: [-most, most] }),
    }) };
  }

  function scores() {
    const c = theme();
    const best = report.scores.map((s, k) => ({ ...s, added: report.added[k], equal: report.equal[k] })).reverse();
    const gains = present(best.map((s) => s.bic_gain));
    const [low, high] = [Math.min(0, ...gains), Math.max(1, ...gains)];
    const room = (narrow.matches ? 0.5 : 0.08) * (high - low);
    const names = best.map((s) => plain(s.place ? `${s.effect} (${s.place})` : s.effect));
    return { data: [{
      type: "bar", orientation: "h", y: names, x: best.map((s) => s.bic_gain),
      marker: { color: best.map((s) => (s.added ? c.best : s.equal ? c.equal : c.passing)),
        pattern: hatch(best.map((s) => s.equal)) },
      text: best.map((s) => (s.bic_gain === null ? "" : s.bic_gain.toFixed(1).replace("-", "−"))), textposition: "outside", cliponaxis: false,
      hovertext: best.map((s) => `${plain(s.effect)}: error after the refit ${sized(s.rmse, OUT)}`), hoverinfo: "text",
    }], layout: layout(70 + 26 * best.length, {
      hovermode: "closest", margin: { l: 20, r: tight() ? 10 : 40, t: 10, b: 40 },
      // Room for the numbers at the ends of the bars.
      xaxis: axis("fall of BIC (larger is better)", { range: [low < 0 ? low - room : 0, high + room] }), yaxis: axis("", { type: "category", ticksuffix: " ", nticks: best.length + 1, dtick: 1, fixedrange: true }),
    }) };
  }

  function trail() {
    const c = theme();
    const names = steps.map((s) => plain(s.label));
    const size = steps.map((_, k) => (k === chosen ? 14 : 9));
    const data = [{ name: "fitted data", x: names, y: steps.map((s) => s.rmse), mode: "lines+markers", line: { color: c.best, width: 2.5 }, marker: { size, opacity: 1 } }];
    if (steps.some((s) => s.rmse_test !== null)) {
      data.push({ name: "held-out data", x: names, y: steps.map((s) => s.rmse_test), mode: "lines+markers", line: { color: c.held, width: 2.5, dash: "dot" }, marker: { size, opacity: 1, symbol: "square" } });
    }
    data.forEach((d) => { d.hovertemplate = `%{y:.3~g} ${OUT}`; });
    if (level() !== null) {
      data.push({ name: "noise floor", x: names, y: names.map(level), mode: "lines", line: { color: c.text, width: 1.5, dash: "dash" }, hovertemplate: `%{y:.3~g} ${OUT}` });
    }
    return { data, layout: layout(340, {
      showlegend: true, hovermode: "x unified", xaxis: axis("", { type: "category", range: [-0.4, names.length - 0.6] }),
      yaxis: axis(named("simulation error, rms", OUT), { rangemode: "tozero" }),
    }) };
  }

  // A curve with its band.
  function banded(x, y, error, title, name) {
    const c = theme();
    const edge = (sign) => y.map((v, k) => v + sign * 1.96 * error[k]);
    const unit = pretty(report.unknown.unit);
    const line = { width: 0 };
    return { data: [
      { x, y: edge(-1), mode: "lines", line, hoverinfo: "skip" },
      { x, y: edge(1), mode: "lines", line, fill: "tonexty", fillcolor: c.band, hoverinfo: "skip" },
      { x, y, mode: x.length > 20 ? "lines" : "lines+markers", line: { color: c.best, width: 2.2 }, marker: { size: 6 },
        customdata: error.map((e) => 1.96 * e), hovertemplate: `%{x:.5~g}: %{y:.3~g} ± %{customdata:.2~g} ${unit}<extra></extra>` },
    ], layout: layout(narrow.matches ? 260 : 300, {
      hovermode: "closest", xaxis: axis(title, { exponentformat: "none" }), yaxis: axis(named(name, unit), { zeroline: true }),
    }) };
  }

  function unknownPath() {
    const u = report.unknown;
    const made = banded(u.time, u.value, u.std_error, "time [s]", "missing term");
    made.layout.shapes = u.windows.map((w) => ({
      type: "rect", xref: "x", yref: "paper", x0: w.from, x1: w.to, y0: 0, y1: 1, layer: "below", fillcolor: theme().failing, opacity: 0.12, line: { width: 0 },
    }));
    return made;
  }

  function unknownShape() {
    const u = report.unknown;
    const name = { rate: "net inflow", input: "command" }[u.variable] || u.variable;
    return banded(u.knots, u.ordinates, u.ordinate_errors, named(name, pretty(u.variable_unit)), "missing term");
  }

  const figures = {
    "unknown-path": unknownPath,
    "unknown-shape": unknownShape,
    "by-time": byTime,
    "by-level": () => binned("by_level", "level", named("simulated output", OUT)),
    "by-flow": () => binned("by_flow", "flow", named("input", IN)),
    "by-direction": () => bars("by_direction", directionName, true, ""),
    "by-frequency": () => bars("by_frequency", bandName, false, ""),
    autocorrelation: () => correlation("autocorrelation", "autocorrelation_bound", 1),
    "cross-correlation": () => correlation("cross_correlation", "cross_correlation_bound", 0),
    scores,
    trail,
  };
  records.forEach((_, r) => { figures[`record-${r}`] = () => recordFigure(r); });

  // --- drawing -----------------------------------------------------------------------------

  // Where the tools stand above, only the plots worth a zoom have them.
  const ZOOMED = /^(record-\d+|by-time|by-level|by-flow|unknown-path)$/;
  function withTools({ data, layout }) {
    plots.toolsAbove(layout);
    const { modeBarButtonsToRemove } = config();
    return [data, layout, config({ displayModeBar: true, modeBarButtonsToRemove: [...modeBarButtonsToRemove, "toImage"] })];
  }

  const place = (id) => document.getElementById(`plot-${id}`);

  function draw(id) {
    const box = place(id);
    if (!box) return;
    const made = steps.length ? figures[id]() : null;
    box.parentElement.hidden = made === null;
    if (made) Plotly.react(box, ...(tight() && ZOOMED.test(id) ? withTools(made) : [made.data, made.layout, config()]));
  }

  const drawAll = () => Object.keys(figures).forEach(draw);

  function words() {
    const step = steps[chosen];
    if (!step) return;
    const put = (id, text) => { const e = document.getElementById(id); if (e) e.textContent = text; };
    put("whiteness", step.whiteness);
    put("input-test", step.input_test);
    put("shown", `${step.label}: simulation error ${step.rmse === null ? "unknown" : sized(step.rmse, report.output_unit || "")}`);
    const list = document.getElementById("failure-sentences");
    if (list) list.replaceChildren(...step.failures.sentences.map((s) => { const item = document.createElement("li"); item.textContent = s; return item; }));
    document.querySelectorAll("#steps [data-step]").forEach((b) => {
      const here = Number(b.dataset.step) === chosen;
      b.setAttribute("aria-pressed", String(here));
      // On a narrow screen the buttons scroll.
      if (here) b.parentElement.scrollTop = b.offsetTop - (b.parentElement.clientHeight - b.offsetHeight) / 2;
    });
    if (steps.length > 1) document.querySelectorAll("table [data-step]").forEach((cell) => cell.classList.toggle("chosen", Number(cell.dataset.step) === chosen));
  }

  function paint() {
    document.querySelectorAll("#steps [data-step] .swatch").forEach((s, k) => { s.style.background = stepColour(k); });
  }

  function choose(k) {
    chosen = Math.min(Math.max(k, 0), steps.length - 1);
    words();
    // The ranking is that of the first step, the unknown that of the last: they stay.
    Object.keys(figures).filter((id) => id !== "scores" && !id.startsWith("unknown")).forEach(draw);
  }

  // The residual and its record show the same stretch of time.
  function link() {
    const pair = () => [place(`record-${residualRecord}`), place("by-time")];
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
        playing = setInterval(() => { choose(chosen + 1); if (chosen === steps.length - 1) stop(); }, 1500);
      });
      nav.addEventListener("keydown", (event) => {
        const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!move || event.target.id === "play") return;
        event.preventDefault();
        stop();
        choose(chosen + move);
        nav.querySelector(`[data-step="${chosen}"]`).focus();
      });
    }
    const select = document.getElementById("residual-record");
    if (select) {
      select.value = String(residualRecord);
      select.addEventListener("change", () => {
        residualRecord = Number(select.value);
        draw("by-time");
        Plotly.relayout(place("by-time"), { "xaxis.autorange": true });
      });
    }
    const axes = document.getElementById("same-axes");
    if (axes) axes.addEventListener("change", () => { sameAxes = axes.checked; choose(chosen); });
  }

  paint();
  words();
  plots.start(() => { paint(); drawAll(); }, () => { link(); listen(); });
})();
