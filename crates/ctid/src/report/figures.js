// Draws the figures that a page describes as curves in panels, one above the other.
(() => {
  const { narrow, tight, theme, plain, pretty, named, axis, layout, toolsAbove, config } = plots;
  const figures = JSON.parse(document.getElementById("data").textContent).figures || [];

  const colour = (name) => (typeof name === "number" ? theme().steps[name % theme().steps.length] : theme()[name]);
  const faded = (hex) => `${hex}2e`;
  const suffix = (k) => (k === 0 ? "" : String(k + 1));

  // From the top down; a panel's share is its part of the height.
  function domains(panels) {
    const gap = panels.length > 1 ? 0.06 : 0;
    const whole = panels.reduce((sum, p) => sum + p.share, 0);
    const height = 1 - gap * (panels.length - 1);
    let top = 1;
    return panels.map((p) => {
      const bottom = top - (height * p.share) / whole;
      const domain = [Math.max(0, bottom), top];
      top = bottom - gap;
      return domain;
    });
  }

  function band(curve, yaxis) {
    const line = { width: 0, shape: curve.held ? "hv" : "linear" };
    const edge = (y, fill) => ({ x: curve.x, y, yaxis, mode: "lines", line, hoverinfo: "skip", showlegend: false, legendgroup: curve.name, fill, fillcolor: faded(colour(curve.colour)) });
    return [edge(curve.lower, "none"), edge(curve.upper, "tonexty")];
  }

  function traces(figure) {
    return figure.curves.flatMap((curve) => {
      const yaxis = `y${suffix(curve.panel)}`;
      const unit = pretty(figure.panels[curve.panel].unit);
      const look = curve.marker
        ? { mode: "markers", marker: { color: colour(curve.colour), size: 9, symbol: curve.marker, line: { color: theme().ground, width: 1 } } }
        : { mode: "lines", line: { color: colour(curve.colour), width: curve.width, dash: curve.dash, shape: curve.held ? "hv" : "linear" } };
      const main = Object.assign({
        name: plain(curve.name), x: curve.x, y: curve.y, yaxis, legendgroup: curve.name, showlegend: curve.legend,
        hovertemplate: figure.categories ? `%{y}: %{x:.3~g} ${pretty(figure.x_unit)}<extra>${plain(curve.name)}</extra>` : `%{y:.4~g} ${unit}`,
      }, look);
      return curve.lower.length ? [...band(curve, yaxis), main] : [main];
    });
  }

  function made(figure) {
    const c = theme();
    const last = figure.panels.length - 1;
    const where = domains(figure.panels);
    const shapes = figure.panels.flatMap((panel, k) => panel.lines.map((y) => (
      { type: "line", xref: "paper", x0: 0, x1: 1, yref: `y${suffix(k)}`, y0: y, y1: y, line: { color: c.text, width: 1.2, dash: "dash" } })));
    if (figure.x_band) {
      const [x0, x1] = figure.x_band;
      shapes.push({ type: "rect", yref: "paper", y0: 0, y1: 1, x0, x1, fillcolor: c.band, line: { width: 0 }, layer: "below" });
    }
    const more = {
      showlegend: figure.curves.some((curve) => curve.legend),
      hovermode: figure.categories || figure.curves.every((curve) => curve.marker) ? "closest" : "x unified", hoversubplots: "axis", shapes,
      xaxis: axis(named(plain(figure.x_title), pretty(figure.x_unit)), {
        anchor: `y${suffix(last)}`, exponentformat: "none", hoverformat: ".6~g", range: figure.x_range || undefined, showspikes: false,
      }),
    };
    figure.panels.forEach((panel, k) => {
      more[`yaxis${suffix(k)}`] = axis(named(plain(panel.title), pretty(panel.unit)), figure.categories
        ? { type: "category", autorange: "reversed", ticksuffix: " ", dtick: 1, nticks: 40, fixedrange: true }
        : { domain: where[k], type: panel.log ? "log" : "linear", range: panel.range || undefined, exponentformat: "power", nticks: panel.log ? undefined : 5 });
    });
    const drawn = layout(narrow.matches ? Math.round(0.85 * figure.height) : figure.height, more);
    if (tight() && !figure.categories) toolsAbove(drawn);
    return [traces(figure), drawn, config(tight() ? { displayModeBar: !figure.categories } : {})];
  }

  plots.start(() => figures.forEach((figure) => {
    const box = document.getElementById(`plot-${figure.id}`);
    if (box) Plotly.react(box, ...made(figure));
  }));
})();
