// The form of the model: the plant, what is known of it, the controller, and the effects that it has.
import { $, button, fill, make, named, units } from "./dom.js";
import * as server from "./server.js";
import * as data from "./data.js";

let plants = [];
// What was typed and refused, or waits for more, stays until it is mended or the settings are others: those that it was typed over.
let draft = null;
// What the model said when the fields were filled: the server writes over nothing else.
let from = { plant: "", known: {}, controller: null };
// What stands in the model once what was sent is answered: what is sent before that was filled in over it.
let turn = null;
// So many changes were sent and are not answered: until then the form is ahead of the model, and is not filled.
let unanswered = 0;
// Somebody else has written what the form was about to write over.
let overtaken = null;
// The list of effects as it stands there.
let written = "";

const KNOWN = {
  area: "Area", area_upper: "Area of the upper tank", area_lower: "Area of the lower tank", area_1: "Area of T1", area_2: "Area of T2", area_3: "Area of T3",
  pipe_area: "Cross-section of the pipes", gravity: "Gravity", tank_height: "Height of the tank", input_range: "Full range of the command",
};
// Of three tanks each has its own area only where they are not alike.
const ALIKE = "Area of each tank, where alike";
const LAWS = {
  PI: [["gain", "Gain"], ["integral_time", "Integral time [s]"]],
  RS: [["r", "R, powers of the delay"], ["s", "S, powers of the delay"]],
  RSp: [["r", "R, highest power first"], ["s", "S, highest power first"]],
};
const LIMITS = [["u_min", "Smallest command"], ["u_max", "Largest command"]];

const plant = (id) => plants.find((one) => one.id === id);
const label = (key, of) => (key === "area" && of.joined ? ALIKE : KNOWN[key]);

/** What the form says is not the model's yet. */
export const drafting = () => draft !== null && draft === JSON.stringify(server.current().settings);
/** Pumps and levels of a plant, by default the one in the form. */
export const signals = (of = plant($("plant").value)) => ({ pumps: of?.pumps ?? 1, levels: Math.max(1, of?.levels.length ?? 1) });

const READINGS = ["The reading", "The second reading", "The third reading"];
/** Which levels are measured has to be said of several readings, and where tanks are joined. */
const asked = (known, columns) => {
  const count = Math.min(data.outputs(columns), signals(known).levels);
  return count > 1 || known.joined ? READINGS.slice(0, count).map((title, k) => [k ? `known-measured-${k + 1}` : "known-measured", title]) : [];
};
const measuredOf = (known) => [known.measured ?? []].flat();

const keep = () => { draft = JSON.stringify(server.current().settings); };

function input(id, label, value, suffix) {
  const text = Array.isArray(value) ? value.join(", ") : value ?? "";
  return [make("label", { htmlFor: id }, label), make("span", { className: "pair" },
    make("input", { id, value: text, inputMode: "decimal", autocomplete: "off", size: 9 }), make("span", { className: "unit" }, units(suffix)))];
}

/** A number with a point or a comma; null if the field is empty; throws an error that names the field if the text is not a number. */
function number(id, label) {
  const box = $(id);
  const text = box.value.trim();
  if (!text) return null;
  const value = Number(text.replace(",", "."));
  box.setAttribute("aria-invalid", String(!Number.isFinite(value)));
  if (!Number.isFinite(value)) throw new Error(`${label}: "${text}" is not a number; write it with digits and without a unit, such as 154.0`);
  return value;
}

function list(id, label) {
  const text = $(id).value.trim();
  if (!text) return null;
  const values = text.split(/[\s,;]+/).filter(Boolean).map(Number);
  if (!values.every(Number.isFinite)) throw new Error(`${label}: write numbers with commas between them, such as 0.62, -0.60`);
  return values;
}

function controller() {
  const law = $("law").value;
  if (!law) return null;
  const said = { type: law === "PI" ? "PI" : "RS" };
  for (const [key, label] of LAWS[law]) said[key] = law === "PI" ? number(`law-${key}`, label) : list(`law-${key}`, label);
  if (law === "RSp") said.variable = "p";
  for (const [key, label] of LIMITS) said[key] = number(`law-${key}`, label);
  return said;
}

function settings() {
  const chosen = plant($("plant").value);
  const known = {};
  const was = server.current().settings.known;
  // What another plant's form said is nothing of this one; what has no field yet stays.
  for (const key of chosen.known) known[key] = $(`known-${key}`) ? number(`known-${key}`, label(key, chosen)) : was[key] ?? null;
  const columns = data.columns();
  const fields = asked(chosen, columns);
  if (fields.length) {
    const levels = fields.map(([id], k) => ($(id) ? $(id).value : measuredOf(was)[k]));
    // The choice appears with a further reading.
    if (!fields.every(([id]) => $(id))) knownFields(chosen, server.current(), columns);
    if (!levels.every(Boolean)) throw new Error(fields.length > 1 ? "First choose the tanks whose levels are read." : "First choose the tank whose level is read.");
    known.measured = levels.length > 1 ? levels : levels[0];
  } else if (measuredOf(was).length > 1) {
    // Of several readings one is left, and nobody has said which: the level of the reading that stays.
    const before = server.current().settings.columns.output;
    const at = [before].flat().indexOf(columns.output);
    known.measured = measuredOf(was)[at] ?? null;
  }
  if (chosen.known.includes("gravity") && (known.pipe_area === null) !== (known.gravity === null)) {
    throw new Error("The cross-section of the pipes and gravity make the flow coefficients pure numbers together: give both, or neither.");
  }
  if (chosen.pumps < 2) {
    // A measured disturbance stays; what another plant's vessels are called says nothing of this one's.
    const stays = columns.input_2 && was.disturbance && server.current().settings.plant === chosen.id;
    if (stays) known.disturbance = was.disturbance;
    else delete columns.input_2;
  }
  return { plant: chosen.id, hold: data.hold(), columns, known, controller: controller() };
}

/** The fields of what may be known of a plant, with these columns. */
function knownFields(known, state, columns = state.settings.columns) {
  const fields = asked(known, columns);
  const read = state.records.find((one) => one.read)?.read;
  const [level, command] = [read?.outputs[0].unit || "", read?.input.unit || ""];
  const units = { tank_height: level, input_range: command, gravity: level ? `${level}/s^2` : "" };
  const square = level ? `${level}^2` : "";
  const values = state.settings.known;
  const form = JSON.stringify([known.id, level, command, fields.length]);
  const at = document.activeElement;
  if ($("known-fields").contains(at) && $("known-fields").dataset.of === form) {
    // The field in which somebody is stays as it is.
    const now = [...known.known.map((key) => [`known-${key}`, values[key]]), ...fields.map(([id], k) => [id, measuredOf(values)[k]])];
    for (const [id, value] of now) {
      if ($(id) !== at) $(id).value = value ?? "";
    }
    const here = at.id.replace("known-", "").replace(/^measured-.*/, "measured");
    from.known = { ...values, [here]: from.known[here] };
    return;
  }
  from.known = values;
  $("known-fields").dataset.of = form;
  const measured = fields.flatMap(([id, title], k) => [make("label", { htmlFor: id }, `${title} is the level of`),
    make("select", { id }, make("option", { value: "" }, "choose…"),
      known.levels.map((name) => make("option", { value: name, selected: measuredOf(values)[k] === name }, name)))]);
  fill($("known-fields"), measured, known.known.flatMap((key) => input(`known-${key}`, label(key, known), values[key], units[key] ?? square)));
}

/** Asks for the plant where it alone is missing: without it no choice of columns has any effect. */
export function askForPlant() {
  const { headings } = server.current();
  const said = headings ? data.columns() : {};
  const missing = !$("plant").value && ["time", "input", "output"].every((role) => said[role]);
  $("plant-missing").hidden = !missing;
  $("plant").setAttribute("aria-invalid", String(missing));
  return missing;
}

/** Another plant: one of which more has to be said waits for that. */
function chosen() {
  const known = plant($("plant").value);
  const state = server.current();
  trouble(null);
  askForPlant();
  if (!known) {
    draft = null;
    form(state);
    data.columnFields(state, signals());
    return;
  }
  const fields = asked(known, data.columns());
  if (fields.length) knownFields(known, state, data.columns());
  if (measuredOf(state.settings.known).length >= fields.length) {
    changed();
    return;
  }
  keep();
  $("known").hidden = false;
  $("equation").textContent = `${known.model}. Choose the tank whose level is read, and the column of the command of pump 2.`;
  data.columnFields(state, signals(known));
  $("columns").open = true;
  $("known-measured").focus();
}

/** Sends the form. Columns are said to the model only where they differ from what is guessed, or stand there already. */
export async function changed() {
  if (!$("plant").value) {
    if (askForPlant()) $("plant-missing").scrollIntoView({ block: "nearest" });
    return;
  }
  unanswered += 1;
  let refused = null;
  try {
    const said = settings();
    const { guessed, settings: { columns } } = server.current();
    for (const role of Object.keys(said.columns)) {
      if (!columns[role] && said.columns[role] === guessed[role]) delete said.columns[role];
    }
    draft = null;
    overtaken = null;
    const before = turn ?? Promise.resolve({ ...from, ...data.filled() });
    const written = before.then((stands) => server.send("api/settings", { ...said, from: stands }));
    const after = written.then(() => said, () => before);
    turn = after;
    after.then(() => { if (turn === after) turn = null; });
    await written;
    from = { plant: said.plant, known: said.known, controller: said.controller };
    data.wrote(said);
  } catch (error) {
    refused = error;
    // What waits for more stays also where a change that was sent before is answered after it.
    await turn;
  }
  unanswered -= 1;
  if (!refused) settle(server.current());
  else if (refused.status === 409) await refill(refused.message);
  else {
    keep();
    trouble(refused.message);
    $("model-error").scrollIntoView({ block: "nearest" });
  }
}

/** The form as the model is now, whoever has changed it. */
async function refill(why) {
  draft = null;
  const at = document.activeElement;
  at.blur();
  await server.renew();
  const state = server.current();
  overtaken = { why, text: state.text };
  form(state);
  if (state.headings) data.columnFields(state, signals());
  trouble(why);
  $("model-error").scrollIntoView({ block: "nearest" });
  if (at.id) $(at.id)?.focus();
}

function trouble(what) {
  $("model-error").textContent = what || "";
  $("model-error").hidden = !what;
}

function laws(settings) {
  const law = $("law").value;
  from.controller = settings.controller;
  const said = settings.controller || {};
  fill($("law-fields"), law ? [...LAWS[law], ...LIMITS].flatMap(([key, label]) => input(`law-${key}`, label, said[key], "")) : []);
}

export function start(known, fail) {
  plants = known;
  fill($("plant"), make("option", { value: "" }, "choose a plant…"), plants.map((one) => make("option", { value: one.id }, one.id)));
  $("plant").addEventListener("change", chosen);
  $("known-fields").addEventListener("change", changed);
  $("law").addEventListener("change", () => {
    laws(server.current().settings);
    // Another law is said once its numbers are.
    if (!$("law").value || server.current().settings.controller) changed();
    else $("law-fields").querySelector("input").focus();
  });
  $("loop").addEventListener("change", () => server.send("api/loop", { measured: $("loop").value === "measured" }).catch((e) => fail(e.message)));
  $("law-fields").addEventListener("change", () => {
    const boxes = [...$("law-fields").querySelectorAll("input")].slice(0, 2);
    if (boxes.every((box) => box.value.trim())) changed();
  });
}

function effect(one, fail) {
  const name = named(one);
  const remove = () => server.send("api/effect", { do: "remove", effect: one.effect }).catch((e) => fail(e.message));
  return make("li", { title: one.physics }, make("code", {}, name), button("Remove", { className: "quiet", ariaLabel: `Remove ${name}` }, remove));
}

/** Any effect of the catalogue that is offered for this model and is not in it. */
function more(state, fail) {
  const free = state.offered.filter((one) => !state.effects.some((on) => on.effect === one.effect));
  const select = make("select", { id: "any-effect" }, make("option", { value: "" }, "any other effect…"),
    [...free, ...state.waiting].map((one) => make("option", { value: JSON.stringify(one) }, named(one))));
  select.setAttribute("aria-label", "An effect to add");
  return make("li", { className: "more" }, select, button("Add", { id: "add-any" }, () => {
    if (!select.value) return;
    server.send("api/effect", { do: "add", ...JSON.parse(select.value) }).catch((e) => fail(e.message));
  }));
}

export function show(state, fail) {
  $("model").hidden = !state.records.length && !state.file;
  const known = plant(state.settings.plant);
  $("h-effects").hidden = !known;
  const wanted = JSON.stringify([state.effects, state.waiting, state.offered, known]);
  if (known && wanted !== written) {
    written = wanted;
    fill($("effects"), state.effects.map((one) => effect(one, fail)), state.effects.length ? null : make("li", { className: "caption" }, "none"), more(state, fail));
  }
  $("text").textContent = state.text || "(written once a plant is chosen)";
  $("loop").value = state.loop.measured ? "measured" : "simulated";
  const fitted = state.records.filter((one) => !one.held_out);
  $("loop-line").hidden = !(state.loop.known && fitted.length && fitted.every((one) => one.read?.reference));
  settle(state);
}

/** The form as the model has it, once nothing is under way, and what is wrong with the model. */
function settle(state) {
  if (unanswered || drafting()) return;
  if (overtaken && overtaken.text !== state.text) overtaken = null;
  trouble(overtaken?.why ?? (state.text && state.model_error ? state.model_error : null));
  form(state);
}

/** The form as the model has it. */
function form(state) {
  const known = plant(state.settings.plant);
  from.plant = state.settings.plant;
  $("plant").value = state.settings.plant;
  $("known").hidden = !known;
  $("controller").hidden = !known;
  $("equation").textContent = known ? known.model : "";
  if (known) knownFields(known, state);
  else from.known = state.settings.known;
  if ($("law-fields").contains(document.activeElement)) return;
  const said = state.settings.controller;
  $("law").value = said ? (said.type === "PI" ? "PI" : said.variable === "p" ? "RSp" : "RS") : "";
  laws(state.settings);
  if (known && said) $("controller").open = true;
}
