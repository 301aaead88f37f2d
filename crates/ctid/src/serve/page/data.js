// The records: dropped, listed, and which of their columns is what.
import { $, button, fill, make } from "./dom.js";
import * as server from "./server.js";
import * as own from "./own.js";

const OUTPUTS = ["output", "output_2", "output_3"];
const ROLES = [["time", "Time"], ["input", "Command u"], ["input_2", "Command of pump 2"],
  ["output", "Reading y"], ["output_2", "Second reading"], ["output_3", "Third reading"], ["reference", "Reference r"]];
// Without these columns a record is one.
const OPTIONAL = { reference: "none", input_2: "none (off)", output_2: "none", output_3: "none" };

/** Several names are a list in the model, and fields of their own in the form. */
const listed = (names) => (Array.isArray(names) ? names : [names]).filter(Boolean);

/** How many outputs the model's columns name; one is guessed. */
export const outputs = (columns) => Math.max(1, listed(columns.output).length);

/** The columns as the form has them. */
const apart = (columns) => ({ ...columns, ...Object.fromEntries(OUTPUTS.map((role, k) => [role, listed(columns.output)[k]])) });

/** The columns as the model has them. */
function together(said) {
  const columns = Object.fromEntries(Object.entries(said).filter(([role]) => !OUTPUTS.includes(role)));
  const names = listed(OUTPUTS.map((role) => said[role]));
  if (names.length) columns.output = names.length > 1 ? names : names[0];
  return columns;
}

/** Another model in place of this one; what stands in a file of the user's goes, so it is asked first. */
async function replace(file) {
  const { file: old, text: from } = server.current();
  if (old && !confirm(`Overwrite ${old} with ${file.name}? The old content is lost.`)) return;
  await server.send("api/text", { text: await file.text(), from });
}

/** Takes dropped files: a model file is taken for the model, everything else for a record. */
async function take(files, heldOut, fail) {
  for (const file of files) {
    try {
      if (/\.mo$/i.test(file.name) || (/\.toml$/i.test(file.name) && own.isModelFile(await file.text()))) await own.take(file);
      else if (/\.toml$/i.test(file.name)) await replace(file);
      else await server.upload(file, heldOut);
    } catch (error) {
      fail(error.message);
      return;
    }
  }
}

function listen(zone, input, heldOut, fail) {
  input.addEventListener("change", async () => {
    await take([...input.files], heldOut, fail);
    input.value = "";
  });
  const over = (on) => (event) => { event.preventDefault(); zone.classList.toggle("over", on); };
  zone.addEventListener("dragenter", over(true));
  zone.addEventListener("dragover", over(true));
  zone.addEventListener("dragleave", over(false));
  zone.addEventListener("drop", (event) => {
    over(false)(event);
    event.stopPropagation();
    take([...event.dataTransfer.files], heldOut, fail);
  });
}

export function start(changed, fail) {
  listen($("drop-fitted"), $("file-fitted"), false, fail);
  listen($("drop-test"), $("file-test"), true, fail);
  // A file that misses its zone is not to take the place of the page.
  for (const kind of ["dragover", "drop"]) addEventListener(kind, (event) => event.preventDefault());
  $("hold").addEventListener("change", changed);
  $("column-fields").addEventListener("change", changed);
}

const signals = (read) => [...read.inputs, ...read.outputs].map((one) => `${one.name} ${one.range}`).join(", ");

function record(one, fail) {
  const { read } = one;
  const about = read
    ? `${read.samples} samples, ${read.length}, every ${read.interval}; ${signals(read)}`
    : one.error;
  return make("li", {},
    make("div", {}, make("strong", {}, one.name), " ", make("span", { className: "badge" }, one.held_out ? "held out" : "fitted")),
    make("p", { className: read ? "caption" : "alert" }, about),
    button("Remove", { className: "quiet", ariaLabel: `Remove ${one.name}` }, () => server.send("api/forget", { name: one.name }).catch((e) => fail(e.message))));
}

// `y [cm]` is `y` in `cm`.
const split = (text) => { const found = /^(.*?)\s*[[(]([^\])]*)[\])]$/.exec(text || ""); return found ? [found[1], found[2]] : [text || "", ""]; };

/** The heading that a name of the model means. */
function meant(headings, named) {
  const [name] = split(named);
  return headings.find((h) => h.header === named) || headings.find((h) => h.name === name || h.header === name);
}

function field(role, title, headings, named, guess) {
  const found = named ? meant(headings, named) : headings.find((h) => h.header === guess);
  const select = make("select", { id: `column-${role}` },
    make("option", { value: "" }, OPTIONAL[role] || "choose…"),
    headings.map((h) => make("option", { value: h.header, selected: found === h }, h.header)));
  const ours = found && found.unit ? found.unit : split(named)[1];
  const input = make("input", { id: `unit-${role}`, value: ours, size: 6, disabled: !found || Boolean(found.unit), placeholder: role === "time" ? "s" : "unit", autocomplete: "off" });
  input.setAttribute("aria-label", `Unit of the ${title.toLowerCase()}`);
  if (found && found.unit) input.title = "as the header says";
  return [make("label", { htmlFor: select.id }, title), make("span", { className: "pair" }, select, input)];
}

/** What the form says of the columns, as the model file has them. */
export function columns() {
  const { headings, settings } = server.current();
  // Without a record there is nothing to choose from: what the model says stays.
  if (!headings) return { ...settings.columns };
  const said = {};
  for (const [role] of ROLES) {
    const [select, input] = [$(`column-${role}`), $(`unit-${role}`)];
    if (!select || !select.value) continue;
    const heading = headings.find((h) => h.header === select.value);
    const unit = input.value.trim();
    said[role] = heading && !heading.unit && unit ? `${heading.name} [${unit}]` : select.value;
  }
  return together(said);
}

export const hold = () => $("hold").value;

// What the model said when the fields were filled.
const from = { hold: "zero", columns: {} };
export const filled = () => from;
export function wrote(said) {
  from.hold = said.hold;
  from.columns = said.columns;
}

/** The columns as the model names them; before there is one, as they were chosen. `plant` is that of the form: pumps and levels. */
export function columnFields(state, { pumps, levels }) {
  from.columns = state.settings.columns;
  const { columns: named, plant } = state.settings;
  const chosen = () => Object.fromEntries(Object.entries(apart(columns())).filter(([, said]) => said && meant(state.headings || [], said)));
  const kept = plant ? apart(named) : chosen();
  const roles = ROLES.filter(([role]) => (role !== "input_2" || pumps > 1 || named.input_2) && OUTPUTS.indexOf(role) < levels);
  const of = pumps > 1 ? { input: "Command of pump 1" } : { input_2: "Measured disturbance" };
  const title = (role, alone) => of[role] ?? alone;
  fill($("column-fields"), roles.flatMap(([role, alone]) => field(role, title(role, alone), state.headings || [], kept[role], state.guessed[role])));
}

/** `signals` are pumps and levels of the plant in the form; a draft keeps what was chosen. */
export function show(state, fail, signals, draft) {
  fill($("records"), state.records.map((one) => record(one, fail)));
  fill($("record-warnings"), state.warnings.map((warning) => make("p", { className: "warning" }, warning)));
  $("after-record").hidden = !state.records.length;
  const fitted = state.records.some((one) => !one.held_out);
  $("drop-fitted").classList.toggle("small", fitted);
  $("drop-what").textContent = fitted ? "Another record" : "Drop a CSV here";
  $("drop-how").textContent = fitted ? "fitted together with the first" : "or choose one: time, command and reading, with a header";
  if ($("columns").contains(document.activeElement)) return;
  // What the file says shows without a record too.
  if (state.settings.plant) $("hold").value = state.settings.hold;
  from.hold = state.settings.hold;
  if (!state.headings) {
    from.columns = state.settings.columns;
    return;
  }
  if (!draft || !$("column-fields").childElementCount) columnFields(state, signals);
  if (state.records.some((one) => one.error)) $("columns").open = true;
}
