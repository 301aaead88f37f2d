// A model of one's own: its text and its model file as they are typed, what the text holds, and the fit to the records.
import { $, button, fill, figure, make, plot, table, units } from "./dom.js";
import * as experiment from "./own_experiment.js";
import * as server from "./server.js";
import * as unknown from "./own_unknown.js";

/** So long after the last key what was typed is sent. */
const PAUSE = 600;
// What the plants have and a model of one's own has not.
const PLANTS = ["model", "missing", "columns", "trail-part", "fit-part", "fails-part", "unknown-part", "parameters-part", "chains-part", "experiment-part"];
const OWN = ["own", "own-missing", "own-fit-part", "own-parameters-part", "own-ports-part", "own-unknown-part", "own-experiment-part", "own-check-part"];
// Box, key of the request, what is wrong with it.
const TEXTS = [["own-text", "text", "own-text-error"], ["own-file", "file", "own-file-error"]];

let fail = () => {};
let timer = 0;
let sending = Promise.resolve();
let body = null;
let shown = "";
let drawn = "";

const change = (what) => server.send("api/own", what);
const complain = (error) => fail(error.message);
export const is = (state) => Boolean(state.own);

/** What was typed and is not sent yet. */
function typed() {
  const { own } = server.current();
  const said = {};
  for (const [box, key] of TEXTS) {
    if (own && $(box).value !== own[key]) said[key] = $(box).value;
  }
  return said;
}

/** Sends what was typed, one after the other. */
function flush() {
  clearTimeout(timer);
  sending = sending.catch(() => {}).then(() => {
    const said = typed();
    return Object.keys(said).length ? change({ do: "write", ...said }) : null;
  });
  return sending;
}

async function fit() {
  try {
    await flush();
    await server.run("compare");
  } catch (error) {
    complain(error);
  }
}

/** An example in place of what is there, and its fit. */
export async function example(name) {
  if (!name) return;
  const state = server.current();
  const there = state.records.length || (state.own && state.own.fit);
  if (there && !confirm(`Put the example ${name} in place of the records and the model of this tab?`)) return;
  try {
    forget();
    await change({ do: "example", name });
    await server.run("compare");
  } catch (error) {
    complain(error);
  }
}

/** A dropped text of a model, or the model file of one. */
export const take = async (file) => {
  const text = await file.text();
  forget();
  await change({ do: "write", [/\.mo$/i.test(file.name) ? "text" : "file"]: text });
};
export const isModelFile = (text) => /^\s*model\s*=/m.test(text);

/** What was typed gives way to what comes. */
function forget() {
  clearTimeout(timer);
  document.activeElement?.blur?.();
  for (const [box] of TEXTS) $(box).dataset.typed = "";
}

/** Selects the place that a message names, line and column. */
function find(box, message) {
  const place = /^(\d+):(\d+):/.exec(message);
  if (!place) return;
  const lines = box.value.split("\n");
  const at = lines.slice(0, Number(place[1]) - 1).reduce((sum, line) => sum + line.length + 1, 0) + Number(place[2]) - 1;
  box.focus();
  box.setSelectionRange(at, Math.min(at + 1, box.value.length));
}

function message(box, at, text) {
  $(at).hidden = !text;
  $(box).setAttribute("aria-invalid", String(Boolean(text)));
  if (!text) return;
  const place = /^(\d+):(\d+): ?/.exec(text);
  const words = place ? [`Line ${place[1]}, column ${place[2]}: ${text.slice(place[0].length)} `, button("Show", { className: "quiet" }, () => find($(box), text))] : [text];
  fill($(at), words);
}

function columns(state) {
  const { own, headings } = state;
  const signals = own.signals || [];
  $("own-columns").hidden = !headings || !signals.length;
  if ($("own-columns").hidden || $("own-column-fields").contains(document.activeElement)) return;
  const split = (text) => (/^(.*?)\s*[[(][^\])]*[\])]$/.exec(text || "") || ["", text || ""])[1];
  const select = (name, title, column) => {
    const found = headings.find((h) => h.header === column) || headings.find((h) => h.name === split(column) || h.header === split(column));
    const box = make("select", { id: `own-column-${name}` },
      make("option", { value: "" }, "choose…"),
      headings.map((h) => make("option", { value: h.header, selected: found === h }, h.header)));
    box.addEventListener("change", () => change({ do: "column", signal: name, column: box.value }).catch(complain));
    return [make("label", { htmlFor: box.id }, title), box];
  };
  const named = ({ role, name, unit, description }) => [role === "input" ? "Input " : "Output ", make("code", {}, name), ...(unit ? [" [", ...units(unit), "]"] : []), description ? make("small", {}, ` ${description}`) : null];
  fill($("own-column-fields"), select("time", "Time", own.time || state.guessed.time), signals.flatMap((one) => select(one.name, named(one), one.column)));
  if (state.records.some((one) => one.error)) $("own-columns").open = true;
}

/** Adds an effect to the model file, or removes it, and fits the model again. */
async function edit(doing, effect) {
  try {
    await flush();
    forget();
    await change({ do: doing, effect });
    await server.run("compare");
  } catch (error) {
    complain(error);
  }
}

const toggle = (own, effect, id) => {
  const on = own.effects.includes(effect);
  const press = () => edit(on ? "remove" : "add", effect);
  return button(on ? "Remove" : "Add", { id, className: on ? "added" : "primary", ariaLabel: `${on ? "Remove" : "Add"} ${effect}` }, press);
};

// The field stays while the page is drawn again, with what was typed.
const termName = make("input", { id: "own-keep-name", size: 12, autocomplete: "off", placeholder: "its name", spellcheck: false });
termName.setAttribute("aria-label", "Name of the term; without one, the name of the function");
termName.addEventListener("keydown", (event) => { if (event.key === "Enter") $("own-keep").click(); });

/** The unexplained function becomes a term under a name of the user's choice; without a name it keeps its own. */
function keep(own, effect) {
  const kept = Object.entries(own.functions || {}).find(([name, one]) => one === effect && own.effects.includes(name))?.[0];
  if (kept) return ["In the model as ", make("code", {}, kept), ". ", toggle(own, kept, "own-keep")];
  if (own.effects.includes(effect)) return [toggle(own, effect, "own-keep")];
  const press = () => edit("add", termName.value.trim() || effect);
  return [termName, " ", button("Add", { id: "own-keep", className: "primary", ariaLabel: `Add ${effect} under this name` }, press)];
}

/** What a diagnosis found: the effects, each with its port in words, and the effects that cannot be distinguished from it. */
function findings(own) {
  const found = own.diagnosis;
  const line = (one, id) => make("div", { className: "head" }, make("code", { className: "name" }, one.placed), toggle(own, one.effect, id));
  $("own-diagnose").textContent = found ? "Diagnose again" : "Diagnose";
  $("own-diagnose-hint").hidden = Boolean(found);
  fill($("own-effects"), own.effects.length ? ["In the model: ", own.effects.map((effect, k) => [make("code", {}, effect), " ", toggle(own, effect, `own-on-${k}`), " "])].flat(2) : "");
  if (!found) { fill($("own-findings")); return; }
  const heads = [["Model"], ...found.outputs.map(({ name, unit }) => [unit ? `${name} [${unit}]` : name, true])];
  const errors = make("table");
  table(errors, heads, found.steps.map(({ name, errors: each }) => [make("code", {}, name), ...each]));
  fill($("own-findings"),
    make("p", { className: "verdict-line" }, found.headline),
    found.of_this_model ? null : make("p", { className: "caption" }, "Text, model file or records have changed since: diagnose again."),
    found.groups.length ? make("ul", { className: "groups" }, found.groups.map((one, k) => make("li", { className: "found" },
      line(one, `own-found-${k}`),
      make("p", { className: "figures" }, one.sizes.map((size) => make("span", {}, units(size)))),
      make("p", {}, `${one.physics}.`),
      one.others.length ? [make("p", { className: "caption" }, "These records do not distinguish it from:"), make("ul", { className: "others" }, one.others.map((other, l) => make("li", {}, line(other, `own-other-${k}-${l}`),
        button("Design an experiment", { id: `own-tell-${k}-${l}`, ariaLabel: `Which experiment distinguishes ${one.effect} from ${other.effect}?` }, () => experiment.ask({ group: k, between: [one.effect, other.effect] }, fail)))))] : null))) : null,
    found.sentences.map((sentence) => make("p", {}, units(sentence))),
    make("div", { className: "scroll", tabIndex: 0, role: "region", "aria-label": "How the error fell" }, errors),
    make("p", { className: "caption" }, `${found.candidates} candidates in ${found.seconds.toFixed(1)} s. Simulation error, root mean square.`));
}

/** The ports of the model, with the effects that sit there. */
function ports(own) {
  $("own-ports-part").hidden = !(own.ports || []).length;
  const marked = ({ on, found }) => [...on.map((id) => [make("code", {}, id), " in the model "]), ...found.filter((id) => !on.includes(id)).map((id) => [make("code", { className: "name" }, id), " found "])].flat();
  table($("own-ports"), [["Port"], ["Name"], ["Unit"], ["Meaning"], ["Effects"]],
    (own.ports || []).map((one) => [one.kind, make("code", {}, one.name), units(one.unit), one.description, make("span", {}, marked(one))]));
}

/** What to do next. */
export function next(state) {
  const { own } = state;
  if (own.text_error) return "correct the text of the model at the place in the message";
  if (own.file_error) return "correct the model file at the place in the message";
  if (!state.records.some((one) => !one.held_out)) return "drop a record";
  if (state.records.some((one) => one.error)) return "assign the columns";
  if (!own.fitted) return "fit the model";
  const term = own.diagnosis?.unknown?.effect;
  const open = (own.diagnosis?.groups || []).find((one) => ![one, ...one.others].some(({ effect }) => own.effects.includes(effect)));
  if (open) return `add ${open.effect}, and watch the error fall`;
  if (term && own.diagnosis.of_this_model) return `look at the unexplained error, and add ${term} or write a candidate of your own`;
  return own.diagnosis ? "" : "diagnose what is missing";
}

export async function show(state) {
  const mine = is(state);
  document.body.classList.toggle("own", mine);
  if (!mine) {
    for (const part of OWN) $(part).hidden = true;
    $("columns").hidden = false;
    shown = "";
    return;
  }
  const { own } = state;
  for (const part of PLANTS) $(part).hidden = true;
  $("empty").hidden = true;
  $("own").hidden = false;
  for (const [box, key, at] of TEXTS) {
    if (document.activeElement !== $(box) || !$(box).dataset.typed) $(box).value = own[key];
    message(box, at, own[`${key}_error`]);
  }
  if (own.file_error) $("own-file-part").open = true;
  columns(state);
  $("own-check-part").hidden = !own.check;
  $("own-check").textContent = own.check || "";
  const unused = (own.unused || []).map((one) => `[${one}]`).join(", ");
  $("own-unused").hidden = !unused;
  $("own-unused").textContent = unused ? `Fits do not use ${unused}.` : "";
  const ready = !own.text_error && !own.file_error && !state.job && state.records.some((one) => !one.held_out) && state.records.every((one) => one.read);
  $("own-fit").disabled = !ready;
  $("own-diagnose").disabled = !ready;
  $("own-missing").hidden = Boolean(own.text_error || own.file_error);
  if (!own.file_error && !own.text_error) {
    findings(own);
    ports(own);
    unknown.show(own, (effect) => keep(own, effect));
    experiment.show(state);
  } else {
    for (const part of ["own-ports-part", "own-unknown-part", "own-experiment-part"]) $(part).hidden = true;
  }
  document.querySelector(".see").classList.toggle("stale", own.fit !== null && !own.fitted);
  const wanted = `${own.fit}`;
  if (wanted !== shown) {
    shown = wanted;
    const found = own.fit === null ? null : await server.fit(own.fit);
    if (shown !== wanted) return;
    body = found;
    words();
    draw();
  }
  for (const part of ["own-fit-part", "own-parameters-part"]) $(part).hidden = !body;
  fall(state);
}

/** The errors in the line at the top. */
function fall({ own }) {
  const there = body && own.fitted;
  $("fall").hidden = !there;
  if (!there) return;
  const each = body.outputs.flatMap((one, k) => [k ? "; " : "", body.outputs.length > 1 ? `${one.name} ` : "", make("b", {}, one.rmse ?? "–"), " ", ...units(one.unit)]);
  fill($("fall"), "Simulation error ", each, ".");
}

function words() {
  if (!body) return;
  const held = body.outputs.some((one) => one.test !== null);
  table($("own-errors"), [["Output"], ["Simulation error", true], ...(held ? [["Held out", true]] : []), ["Unit"]],
    body.outputs.map((one) => [make("code", {}, one.name), one.rmse ?? "–", ...(held ? [one.test ?? "–"] : []), units(one.unit)]));
  $("own-weighted").textContent = `Root mean square; the model is simulated, and never corrected by a reading.${body.outputs.length > 1 ? ` Together ${body.weighted} times the noise's innovations.` : ""}`;
  table($("own-parameters"), [["Parameter"], ["Estimate", true], ["± standard error", true], ["Unit"]],
    body.parameters.map((one) => [make("code", {}, one.name), one.value, one.error ?? (one.known ? "known" : "–"), units(one.unit)]));
  $("own-starts").textContent = `${body.starts_agree} of ${body.starts} starts ended in this minimum. –: the data do not determine it, or it is at a bound.`;
  const known = [body.gaps, body.loop].filter(Boolean).map((said) => make("p", {}, said));
  fill($("own-untold"), body.not_determined.map((of) => make("p", { className: "warning" },
    of.includes(",") ? `These records determine only a combination of ${of}: give one of them under [known], or a [prior].` : `${of} has no effect on the readings of these records: give it under [known], or excite the plant more.`)).concat(known));
}

const inUnit = (name, unit) => plots.named(plots.plain(name), plots.pretty(unit));

function curves(one) {
  const c = plots.theme();
  const line = (of, name, color, width, axis = "y") => ({ x: of.x, y: of.y, name, yaxis: axis, mode: "lines", line: { color, width }, connectgaps: false });
  const points = { ...line(one.measured, "measured", c.measured, 1), mode: "markers", marker: { color: c.measured, size: 3, opacity: 0.7 } };
  return {
    data: [points, line(one.model, "model", c.steps[0], 2), { ...line(one.residual, "measured minus model", c.steps[1], 1, "y2"), showlegend: false }],
    layout: plots.layout(380, {
      showlegend: true,
      xaxis: plots.axis("time [s]", { anchor: "y2" }),
      yaxis: plots.axis(inUnit(one.output, one.unit), { domain: [0.36, 1] }),
      yaxis2: plots.axis(inUnit("residual", one.unit), { domain: [0, 0.27] }),
    }),
  };
}

export function draw() {
  unknown.draw();
  experiment.draw();
  if (!body || !window.Plotly) return;
  const wanted = `${body.id}`;
  if (drawn !== wanted) {
    drawn = wanted;
    const several = new Set(body.curves.map((one) => one.record)).size > 1;
    $("own-figures").replaceChildren(...body.curves.map((one, k) => figure(`own-${k}`, several ? `${one.output}, ${one.record}` : one.output)));
  }
  body.curves.forEach((one, k) => plot($(`plot-own-${k}`), `own-${k}`, curves(one)));
}

export function start(examples, told) {
  fail = told;
  experiment.start(told);
  for (const id of ["example", "own-example"]) {
    fill($(id), make("option", { value: "" }, "try an example…"), examples.map((name) => make("option", { value: name }, name)));
    $(id).addEventListener("change", async () => {
      const name = $(id).value;
      $(id).value = "";
      await example(name);
    });
  }
  for (const [box] of TEXTS) {
    $(box).addEventListener("input", () => {
      $(box).dataset.typed = "yes";
      clearTimeout(timer);
      timer = setTimeout(() => flush().catch(complain), PAUSE);
    });
    $(box).addEventListener("blur", () => flush().then(() => { $(box).dataset.typed = ""; }, complain));
  }
  $("own-load").addEventListener("change", async () => {
    try {
      for (const file of $("own-load").files) await take(file);
    } catch (error) {
      complain(error);
    }
    $("own-load").value = "";
  });
  $("own-fit").addEventListener("click", fit);
  $("own-diagnose").addEventListener("click", async () => {
    try {
      await flush();
      await server.run("diagnose", { max_effects: null, effort: $("own-effort").value });
    } catch (error) {
      complain(error);
    }
  });
  $("begin-own").addEventListener("click", () => change({ do: "begin" }).catch(complain));
  $("begin-own-2").addEventListener("click", () => change({ do: "begin" }).catch(complain));
  $("own-end").addEventListener("click", () => change({ do: "end" }).catch(complain));
}
