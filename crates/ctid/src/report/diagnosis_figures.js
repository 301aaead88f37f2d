// The figures of a diagnosis. `view` says how it is looked at: the chosen step, the output of the figures that show one, the record of
// the residual, and whether the axes hold every step or the chosen one alone; it may change between two drawings.
"use strict";
const diagnosisFigures = (report, view) => {
  const { narrow, tight, theme, plain, pretty, named, axis } = plots;
  const records = report.records || [];
  const steps = report.steps || [];
  const outputs = report.outputs || [];
  const several = outputs.length > 1;

  const DASHES = ["dash", "solid", "dot", "dashdot", "longdash", "longdashdot"];
  const stepColour = (k) => theme().steps[k % theme().steps.length];

  // --- words -------------------------------------------------------------------------------

  const unitOf = (o) => pretty(outputs[o]?.unit ?? report.output_unit);
  const OUT = () => unitOf(view.output);
  const sized = (value, unit) => `${value === null || value === undefined ? "–" : Number(value.toPrecision(2))} ${unit}`.trim();

  const outputName = (o) => plain(outputs[o]?.name ?? "");
  // What a figure shows of the chosen output; its name only where there are others.
  const ofOutput = (what) => (several ? `${what} of ${outputName(view.output)}` : what);

  // --- parts of a figure -------------------------------------------------------------------

  // The curves that were switched on stay so while the step stays.
  const layout = (height, more) => {
    const made = plots.layout(height, more);
    made.legend.uirevision = view.chosen;
    return made;
  };

  const present = (values) => values.filter((v) => v !== null && v !== undefined);
  const largest = (values) => present(values).reduce((most, v) => Math.max(most, Math.abs(v)), 0);
  // What the axes must hold: every step, so that a fall is seen as a fall, or the chosen one alone.
  const seen = () => (view.sameAxes ? steps : [steps[view.chosen]]).map((step) => step.outputs[view.output]);
  // The chosen step at the chosen output.
  const chosen = () => steps[view.chosen].outputs[view.output];
  const level = () => (outputs[view.output]?.noise_floor > 0 ? outputs[view.output].noise_floor : null);
  // Another output has another range: what was zoomed into is not there.
  const zoomOfOutput = () => (several ? `output ${view.output}` : "kept");

  // Times as they are drawn: numbers in the unit that fits the records' length, or dates.
  const clock = report.clock;
  const DATED = clock.start_ms !== null;
  const at = (t) => (DATED ? clock.start_ms + 1000 * t : t / clock.seconds);
  const timeAxis = (more) => (DATED
    ? axis("", { type: "date", hoverformat: "%Y-%m-%d %H:%M:%S", ...more })
    : axis(`time [${clock.unit}]`, { exponentformat: "none", hoverformat: ".6~g", ...more }));

  // The windows of a record in which the chosen step fails at an output: the larger the error, the stronger.
  function failingWindows(r, o, yref) {
    if (!steps.length) return [];
    const compared = (view.sameAxes ? steps : [steps[view.chosen]]).map((step) => step.outputs[o]);
    const most = largest(compared.flatMap((s) => s.failures.by_time.map((b) => b.rms))) || 1;
    return steps[view.chosen].outputs[o].failures.by_time.filter((b) => b.fails && b.record === r).map((b) => ({
      type: "rect", xref: "x", yref, x0: at(b.from), x1: at(b.to), y0: 0, y1: 1, layer: "below",
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
    `${name(b, k)}<br>${b.count} values, rms ${sized(b.rms, OUT())}, mean ${sized(b.mean, OUT())}${b.fails ? "<br>fails" : ""}`);

  const tallest = (of) => 1.08 * largest([level(), ...seen().flatMap((s) => of(s.failures).map((b) => b.rms))]) || 1;

  // --- the figures -------------------------------------------------------------------------

  // A panel for each output, and below them one for the input.
  function recordFigure(r) {
    const record = records[r];
    const c = theme();
    const count = record.outputs.length;
    // Inputs of one unit share a panel.
    const panels = [...record.inputs.reduce((by, one) => by.set(one.unit, [...(by.get(one.unit) ?? []), one]), new Map()).values()];
    // Heights of a panel with the space below it and of the inputs', in those of a figure with one output.
    const [panel, space, low, gap] = [0.67, 0.09, 0.24, 0.06];
    const total = count * (panel + space) + Math.max(panels.length, 1) * (low + gap) - gap;
    const axisOf = (k) => (k ? `y${k + 1}` : "y");
    const data = [];
    const axes = {};
    const shapes = [];
    record.outputs.forEach((measured, o) => {
      const yaxis = axisOf(o);
      // One entry of the legend switches a model on and off in every panel.
      const shared = (group) => (several ? { yaxis, legendgroup: group, showlegend: o === 0 } : {});
      const hovertemplate = `%{y:.4~g} ${unitOf(o)}${several ? ` (${outputName(o)})` : ""}`;
      data.push({
        name: "measured", x: measured.t.map(at), y: measured.y, mode: "lines", line: { color: c.measured, width: 1.3 }, opacity: 0.75,
        hovertemplate, ...shared("measured"),
      });
      steps.forEach((step, k) => {
        const run = step.outputs[o]?.runs[r];
        if (!run) return;
        const main = k === view.chosen;
        data.push({
          name: plain(step.label), x: run.output.t.map(at), y: run.output.y, mode: "lines",
          line: { color: stepColour(k), width: main ? 2.6 : 1.6, dash: main ? "solid" : DASHES[k % DASHES.length] },
          visible: main || k === 0 ? true : "legendonly", legendrank: 1001 + k, zorder: main ? 2 : 1,
          hovertemplate, ...shared(`step ${k}`),
        });
      });
      const top = 1 - (o * (panel + space)) / total;
      axes[o ? `yaxis${o + 1}` : "yaxis"] = axis(named(several ? outputName(o) : "output", unitOf(o)), { domain: [top - panel / total, top] });
      shapes.push(...failingWindows(r, o, several ? `${yaxis} domain` : "paper"));
    });
    const looks = [[c.faint, "solid"], [c.text, "dot"], [c.best, "dash"], [c.held, "dashdot"]];
    panels.forEach((inputs, p) => {
      const yaxis = axisOf(count + p);
      inputs.forEach(({ name, unit, t, y }, k) => {
        const [color, dash] = looks[k % looks.length];
        data.push({
          name: plain(name), x: t.map(at), y, yaxis, mode: "lines", showlegend: record.inputs.length > 1, legendrank: 2000 + p,
          line: { color, width: 1.2, dash, shape: "hv" }, hovertemplate: `%{y:.4~g} ${pretty(unit)}`,
        });
      });
      const foot = ((panels.length - 1 - p) * (low + gap)) / total;
      const title = inputs.length > 1 ? "inputs" : plain(inputs[0].name);
      axes[`yaxis${count + p + 1}`] = axis(named(title, pretty(inputs[0].unit)), { domain: [foot, foot + low / total], nticks: 4 });
    });
    return { data, layout: layout((narrow.matches ? 400 : 460) * total, {
      showlegend: true, hovermode: "x unified", hoversubplots: "axis", shapes,
      xaxis: timeAxis({ anchor: axisOf(count + Math.max(panels.length, 1) - 1), showspikes: false }),
      ...axes,
    }) };
  }

  function byTime() {
    const run = chosen().runs[view.residualRecord];
    if (!run) return null;
    const most = 1.05 * largest(seen().flatMap((s) => (s.runs[view.residualRecord] ? s.runs[view.residualRecord].residual.y : []))) || 1;
    const floor = level() === null ? [] : [across(level(), "y", theme().text, "dash"), across(-level(), "y", theme().text, "dash")];
    return { data: [{
      x: run.residual.t.map(at), y: run.residual.y, mode: "lines", line: { color: stepColour(view.chosen), width: 1.4 }, name: "residual",
      hovertemplate: `${DATED ? "%{x}" : `%{x:.6~g} ${clock.unit}`}: %{y:.3~g} ${OUT()}<extra></extra>`,
    }], layout: layout(narrow.matches ? 240 : 280, {
      hovermode: "x", shapes: failingWindows(view.residualRecord, view.output, "paper").concat(floor),
      xaxis: timeAxis({}), yaxis: axis(named(ofOutput("residual"), OUT()), { range: [-most, most], uirevision: zoomOfOutput() }),
    }) };
  }

  // Every sample and the bin means above, the rms of the bins below.
  // Of a signal without samples in the page, the means and the bars. `of`: the bins of a model's failures.
  function binned(of, at, title) {
    const bins = of(chosen().failures).filter((b) => b.count > 0);
    if (!bins.length) return null;
    const cloud = at && chosen().cloud;
    const centre = bins.map((b) => (b.from + b.to) / 2);
    const most = 1.05 * largest(seen().flatMap((s) => (at && s.cloud ? s.cloud.residual : of(s.failures).map((b) => b.mean)))) || 1;
    const data = [];
    if (cloud) {
      data.push({
        x: cloud[at], y: cloud.residual, mode: "markers", marker: { color: stepColour(view.chosen), size: 4, opacity: 0.4 },
        hovertemplate: `%{x:.4~g}: %{y:.3~g} ${OUT()}<extra></extra>`,
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
      uirevision: zoomOfOutput(), hovermode: "closest", shapes: floorLine("y2"),
      xaxis: axis(title, { anchor: "y2" }),
      yaxis: axis(named(ofOutput("residual"), OUT()), { domain: [0.42, 1], range: [-most, most] }),
      yaxis2: axis(named("rms", OUT()), { domain: [0, 0.34], range: [0, tallest(of)], nticks: 4 }),
    }) };
  }

  function bars(kind, name, means, title) {
    const bins = chosen().failures[kind];
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
      yaxis: axis(named(ofOutput("residual"), OUT()), { range: [low, tallest((failures) => failures[kind])] }),
    }) };
  }

  function directionName(bin, k, bins) {
    const all = bins || chosen().failures.by_direction;
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
    const values = chosen().tests[kind].slice(first);
    if (!values.length) return null;
    const lags = values.map((_, k) => k + first);
    const half = chosen().tests[bound];
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
      hovertext: best.map((s) => `${plain(s.effect)}: error after the refit ${several ? sized(s.weighted_rmse, "times the noise") : sized(s.rmse, OUT())}`), hoverinfo: "text",
    }], layout: layout(70 + 26 * best.length, {
      hovermode: "closest", margin: { l: 20, r: tight() ? 10 : 40, t: 10, b: 40 },
      // Room for the numbers at the ends of the bars.
      xaxis: axis("fall of BIC (larger is better)", { range: [low < 0 ? low - room : 0, high + room] }), yaxis: axis("", { type: "category", ticksuffix: " ", nticks: best.length + 1, dtick: 1, fixedrange: true }),
    }) };
  }

  function trail() {
    const c = theme();
    const names = steps.map((s) => plain(s.label));
    const size = steps.map((_, k) => (k === view.chosen ? 14 : 9));
    const errors = steps.map((s) => s.outputs[view.output]);
    const data = [{ name: "fitted data", x: names, y: errors.map((s) => s.rmse), mode: "lines+markers", line: { color: c.best, width: 2.5 }, marker: { size, opacity: 1 } }];
    if (errors.some((s) => s.rmse_test !== null)) {
      data.push({ name: "held-out data", x: names, y: errors.map((s) => s.rmse_test), mode: "lines+markers", line: { color: c.held, width: 2.5, dash: "dot" }, marker: { size, opacity: 1, symbol: "square" } });
    }
    data.forEach((d) => { d.hovertemplate = `%{y:.3~g} ${OUT()}`; });
    if (level() !== null) {
      data.push({ name: "noise floor", x: names, y: names.map(level), mode: "lines", line: { color: c.text, width: 1.5, dash: "dash" }, hovertemplate: `%{y:.3~g} ${OUT()}` });
    }
    return { data, layout: layout(340, {
      showlegend: true, hovermode: "x unified", xaxis: axis("", { type: "category", range: [-0.4, names.length - 0.6] }),
      yaxis: axis(named(`${ofOutput("simulation error")}, rms`, OUT()), { rangemode: "tozero" }),
    }) };
  }

  // A curve with its band.
  function banded(x, y, error, title, name) {
    const c = theme();
    // Where the error is not known there is no band.
    const known = (k) => error[k] !== null && error[k] !== undefined;
    const edge = (sign) => y.map((v, k) => (known(k) ? v + sign * 1.96 * error[k] : null));
    const unit = pretty(report.unknown.unit);
    const line = { width: 0 };
    return { data: [
      { x, y: edge(-1), mode: "lines", line, hoverinfo: "skip" },
      { x, y: edge(1), mode: "lines", line, fill: "tonexty", fillcolor: c.band, hoverinfo: "skip" },
      { x, y, mode: x.length > 20 ? "lines" : "lines+markers", line: { color: c.best, width: 2.2 }, marker: { size: 6 },
        customdata: error.map((e, k) => (known(k) ? ` ± ${Number((1.96 * e).toPrecision(2))}` : "")), hovertemplate: `%{x:.5~g}: %{y:.3~g}%{customdata} ${unit}<extra></extra>` },
    ], layout: layout(narrow.matches ? 260 : 300, {
      hovermode: "closest", xaxis: axis(title, { exponentformat: "none" }), yaxis: axis(named(name, unit), { zeroline: true }),
    }) };
  }

  function unknownPath() {
    const u = report.unknown;
    const made = banded(u.time.map(at), u.value, u.std_error, "", "missing term");
    made.layout.xaxis = timeAxis({});
    made.layout.shapes = u.windows.map((w) => ({
      type: "rect", xref: "x", yref: "paper", x0: at(w.from), x1: at(w.to), y0: 0, y1: 1, layer: "below", fillcolor: theme().failing, opacity: 0.12, line: { width: 0 },
    }));
    return made;
  }

  function unknownShape() {
    const u = report.unknown;
    // A model of one's own names its signals, a plant has a few.
    const name = u.shown_term ? plain(u.variable) : { rate: "net inflow", input: "command" }[u.variable] || u.variable;
    return banded(u.knots, u.ordinates, u.ordinate_errors, named(name, pretty(u.variable_unit)), u.shown_term ? plain(u.shown_term) : "missing term");
  }

  const figures = {
    "unknown-path": unknownPath,
    "unknown-shape": unknownShape,
    "by-time": byTime,
    "by-output": () => binned((failures) => failures.by_output, "level", named(several ? `simulated ${outputName(view.output)}` : "simulated output", OUT())),
    "by-direction": () => bars("by_direction", directionName, true, ""),
    "by-frequency": () => bars("by_frequency", bandName, false, ""),
    autocorrelation: () => correlation("autocorrelation", "autocorrelation_bound", 1),
    "cross-correlation": () => correlation("cross_correlation", "cross_correlation_bound", 0),
    scores,
    trail,
  };
  // Every input, and every state that is not an output. The samples of the first input are in the page.
  for (const kind of ["input", "state"]) {
    const most = Math.max(0, ...steps.flatMap((s) => s.outputs.map((o) => o.failures[`by_${kind}`].length)));
    for (let k = 0; k < most; k += 1) {
      const of = (failures) => failures[`by_${kind}`][k]?.bins ?? [];
      figures[`by-${kind}-${k}`] = () => {
        const signal = chosen().failures[`by_${kind}`][k];
        return signal ? binned(of, kind === "input" && k === 0 ? "flow" : null, named(plain(signal.name), pretty(signal.unit))) : null;
      };
    }
  }
  records.forEach((_, r) => { figures[`record-${r}`] = () => recordFigure(r); });

  return { figures, stepColour, sized, several, ofOutput };
};
