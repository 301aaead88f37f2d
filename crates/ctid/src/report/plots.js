// What every page draws with: colours, axes, layout, and the unpacking of plotly.js.
"use strict";
const plots = (() => {
  const narrow = matchMedia("(max-width: 40rem)");
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const touch = matchMedia("(pointer: coarse)").matches;
  // Where one finger scrolls the page, or room is short, the tools stand above the plot.
  const tight = () => touch || narrow.matches;
  let printing = false;

  // Okabe and Ito's colours, which colour-blind readers can distinguish; lightened on a dark ground.
  const LIGHT = {
    text: "#1b1f26", faint: "#59616e", grid: "#e3e6eb", zero: "#a9b0bb", measured: "#1b1f26",
    failing: "#e69f00", passing: "#8794a6", ground: "#ffffff",
    band: "rgba(0,99,163,0.12)", held: "#a8518a", best: "#0072b2", equal: "#56a3d4",
    steps: ["#d55e00", "#0072b2", "#008a66", "#b5578f", "#8a6d00", "#4a6fa5", "#6b3fa0", "#9c2f3f"],
  };
  const DARK = {
    text: "#e7eaef", faint: "#a3acb9", grid: "#2b313a", zero: "#5c6674", measured: "#dfe3e9",
    failing: "#f0b428", passing: "#75839a", ground: "#14171c",
    band: "rgba(108,188,242,0.16)", held: "#e39ac8", best: "#56b4e9", equal: "#2f7fb0",
    steps: ["#ff8a3c", "#56b4e9", "#2fc79a", "#e39ac8", "#e0c341", "#9db4dd", "#b48cff", "#ff8f9c"],
  };
  const FONT = "system-ui, -apple-system, Segoe UI, Roboto, Arial, sans-serif";
  const theme = () => (dark.matches && !printing ? DARK : LIGHT);

  // plotly reads a little HTML in its texts; names from files are no HTML.
  const plain = (text) => String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
  const pretty = (unit) => plain(unit || "").replace(/\^(-?[\d.]+)/g, "<sup>$1</sup>");
  const named = (name, unit) => (unit ? `${name} [${unit}]` : name);

  function axis(title, more) {
    const c = theme();
    return Object.assign({
      title: { text: title, standoff: 8 }, gridcolor: c.grid, zerolinecolor: c.zero, linecolor: c.zero,
      tickcolor: c.zero, automargin: true, nticks: narrow.matches ? 6 : undefined,
    }, more);
  }

  function layout(height, more) {
    const c = theme();
    return Object.assign({
      height, autosize: true, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: FONT, size: narrow.matches ? 11 : 12.5, color: c.text },
      // Elsewhere they stand beside it, where neither names nor curves are.
      margin: { l: 52, r: tight() ? 10 : 40, t: 10, b: 40 },
      legend: { orientation: "h", x: 0, xanchor: "left", y: 1.01, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" },
      hoverlabel: { bgcolor: c.ground, bordercolor: c.zero, font: { color: c.text, family: FONT } },
      modebar: { orientation: tight() ? "h" : "v", bgcolor: "rgba(0,0,0,0)", color: c.faint, activecolor: c.best },
      dragmode: touch ? false : "zoom", uirevision: "kept", showlegend: false, bargap: 0.12,
    }, more);
  }

  // Tools above the plot, the names of the curves below it.
  function toolsAbove(made) {
    made.margin.t = 34;
    Object.assign(made.legend, { y: 0, yref: "container", yanchor: "bottom" });
  }

  const config = (more) => Object.assign({
    displaylogo: false, responsive: true, displayModeBar: tight() ? false : "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"], toImageButtonOptions: { scale: 2 },
  }, more);

  // Where the tools stand above, only the plots worth a zoom have them.
  const ZOOMED = /^(record-\d+|own-\d+|by-time|by-output|by-input-\d+|by-state-\d+|unknown-path)$/;
  function tooled(id, { data, layout }) {
    if (!tight() || !ZOOMED.test(id)) return [data, layout, config()];
    toolsAbove(layout);
    const { modeBarButtonsToRemove } = config();
    return [data, layout, config({ displayModeBar: true, modeBarButtonsToRemove: [...modeBarButtonsToRemove, "toImage"] })];
  }

  async function unpack() {
    // Where it is served it is there already.
    if (window.Plotly) return;
    const element = document.getElementById("plotly");
    const bytes = Uint8Array.from(atob(element.textContent), (c) => c.charCodeAt(0));
    element.remove();
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  }

  // Draws when plotly.js is there, and again in other colours, on another width, and on paper.
  function start(draw, drawn) {
    unpack().then(() => {
      draw();
      dark.addEventListener("change", draw);
      narrow.addEventListener("change", draw);
      // On paper: the light colours, and as wide as the sheet.
      const paper = (on) => {
        printing = on;
        draw();
        document.querySelectorAll(".js-plotly-plot").forEach((box) => Plotly.relayout(box, on ? { width: 660, autosize: false } : { width: null, autosize: true }));
      };
      addEventListener("beforeprint", () => paper(true));
      addEventListener("afterprint", () => paper(false));
      if (drawn) drawn();
      document.documentElement.dataset.drawn = "yes";
    }).catch((error) => {
      const notice = document.getElementById("no-plots");
      notice.textContent = `The plots could not be drawn (${error.message}). The findings and the tables are complete; a browser from 2023 or later draws the plots.`;
      notice.hidden = false;
      document.querySelectorAll("#steps, .choice, figure").forEach((part) => { part.hidden = true; });
    });
  }

  return { narrow, tight, theme, plain, pretty, named, axis, layout, toolsAbove, config, tooled, start };
})();
