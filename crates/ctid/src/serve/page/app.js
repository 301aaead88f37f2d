// The page: takes the state from the server, and hands it to its parts.
import { $, fill, make } from "./dom.js";
import * as server from "./server.js";
import * as data from "./data.js";
import * as own from "./own.js";
import * as model from "./model.js";
import * as fit from "./fit.js";
import * as findings from "./findings.js";
import * as chains from "./chains.js";
import * as unknown from "./unknown.js";
import * as experiment from "./experiment.js";

const WORK = { compare: "fitting the model", diagnose: "searching for the missing effect", design: "designing the next experiment" };

let version = null;
let before = null;
let cancelled = null;
let said = "";

function fail(what) {
  $("failure").textContent = what || "";
  $("failure").hidden = !what;
}

function job(now) {
  $("working").hidden = !now;
  document.body.classList.toggle("busy", Boolean(now));
  if (!now) return;
  $("phase").textContent = now.phase || WORK[now.what];
  const bar = $("progress");
  if (now.total) { bar.max = now.total; bar.value = now.done; } else { bar.removeAttribute("value"); }
  const limit = now.limit ? ` of at most ${now.limit < 120 ? `${now.limit} s` : `${now.limit / 60} min`}` : "";
  $("clock").textContent = `${now.seconds.toFixed(0)} s${now.ending ? ", ending" : limit}`;
  $("finish").hidden = now.what !== "diagnose";
  $("finish").disabled = now.ending;
}

/** Reads out what has come of it; the same is not said twice. */
function say(text) {
  if (text === said) return;
  said = text;
  $("said").textContent = text;
}

/** What to do next. */
function next(state) {
  if (own.is(state)) return own.next(state);
  const fitted = state.records.filter((one) => !one.held_out);
  if (!fitted.length) return "drop a record";
  if (state.records.some((one) => one.error)) return "assign the columns";
  if (!state.text) return "choose the plant that you believe in";
  if (state.current === null) return "";
  const found = state.diagnosis;
  if (!found) return state.trail[state.trail.length - 1].adequate ? "" : "diagnose what is missing";
  const open = found.groups.find((one) => !state.effects.some((on) => on.effect === one.effect || one.others.includes(on.effect)));
  if (open) return `add ${open.effect}, and watch the error fall`;
  if (state.trail[state.trail.length - 1].adequate) return "";
  return found.of_this_model ? "" : "diagnose again, whether anything else is missing";
}

function fall(state) {
  const trail = state.trail;
  const todo = state.job ? "" : next(state);
  fill($("next"), todo ? [make("span", {}, "Next: "), todo] : "");
  const unit = state.records.find((one) => one.read)?.read.outputs[0].unit || "";
  $("fall").hidden = !trail.length;
  if (!trail.length) return;
  const number = (one, k, o) => make("b", { className: k === trail.length - 1 && (k > 0 || one.adequate) ? "last" : "" }, one.errors[o].text);
  const last = trail[trail.length - 1];
  // The error of each output, which has a name where there are several.
  const falls = last.errors.map(({ output }, o) => [o ? "; " : "", output === null ? "" : `${output} `,
    trail.flatMap((one, k) => (k ? [" → ", number(one, k, o)] : [number(one, k, o)])), ` ${unit}`]);
  const explained = last.adequate && state.current === last.id ? make("span", { className: "explained" }, " The residual looks like noise.") : null;
  fill($("fall"), "Simulation error ", falls.flat(2), ".", explained);
  if (state.current === last.id) say(`${last.name}: simulation error ${last.errors.map(({ output, text }) => `${output === null ? "" : `${output} `}${text} ${unit}`).join(", ")}`);
}

const compare = () => server.run("compare").catch((e) => fail(e.message));
const task = (state) => JSON.stringify([state.text, state.records.map((one) => [one.name, one.held_out])]);

/** What the state asks for by itself: a model that is not fitted yet is, but where somebody has cancelled just that. */
function compareIfNeeded(state) {
  const fitted = state.records.filter((one) => !one.held_out);
  const ready = state.text && !state.model_error && fitted.length && state.records.every((one) => one.read);
  const waits = !own.is(state) && ready && state.current === null && !state.job && !state.failure;
  $("fit").hidden = !(waits && cancelled === task(state));
  if (waits && cancelled !== task(state) && before !== state.version) {
    before = state.version;
    compare();
  }
}

function cancel() {
  cancelled = task(server.current());
  chains.forget();
  server.send("api/cancel").catch((e) => fail(e.message));
}

function show(state, trouble) {
  job(state.job);
  if (trouble) {
    fail(trouble);
    version = null;
    return;
  }
  if (state.version === version) return;
  version = state.version;
  fail(state.failure);
  const mine = own.is(state);
  $("place").textContent = state.file && !mine ? `edits ${state.file}` : "model kept in this tab";
  for (const [id, there] of [["text", mine], ["model", mine || state.text], ["report", mine ? state.own.fit !== null || state.own.diagnosis : state.current || state.diagnosis]]) {
    $(`download-${id}`).hidden = !there;
    $(`download-${id}`).href = server.link(id);
  }
  if (mine) {
    data.show(state, fail, model.signals(), true);
    fall({ ...state, trail: [] });
    compareIfNeeded(state);
    own.show(state).catch((e) => fail(e.message));
    return;
  }
  own.show(state).catch((e) => fail(e.message));
  model.show(state, fail);
  data.show(state, fail, model.signals(), model.drafting());
  model.askForPlant();
  findings.show(state, fail);
  experiment.show(state);
  fall(state);
  fit.show(state).catch((e) => fail(e.message));
  unknown.show(state).catch((e) => fail(e.message));
  chains.show(state).catch((e) => fail(e.message));
  compareIfNeeded(state);
}

try {
  const opened = await server.begin(show);
  data.start(model.changed, fail);
  own.start(opened.examples, fail);
  model.start(opened.plants, fail);
  findings.start(fail);
  chains.start(fail);
  experiment.start(fail);
  $("cancel").addEventListener("click", cancel);
  $("finish").addEventListener("click", () => server.send("api/finish").catch((e) => fail(e.message)));
  $("fit").addEventListener("click", compare);
  show(opened.state);
  plots.start(() => { own.draw(); fit.draw(); unknown.draw(); chains.draw(); experiment.draw(); });
} catch (error) {
  fail(error.message);
}
