// What a diagnosis found: the effects that are missing, each with the effects that cannot be distinguished from it, and the ranking.
import { $, button, fill, make, named, table, units } from "./dom.js";
import * as experiment from "./experiment.js";
import * as server from "./server.js";

export function start(fail) {
  $("diagnose").addEventListener("click", () => {
    const most = $("most").value.trim();
    if (most && !/^([1-9]\d?|1\d\d|2[0-4]\d|25[0-5])$/.test(most)) {
      fail(`"${most}" is not a valid number of effects; write a whole number from 1 to 255, or nothing`);
      return;
    }
    asked = true;
    server.run("diagnose", { max_effects: most ? Number(most) : null, effort: $("effort").value }).catch((e) => fail(e.message));
  });
}

const isOn = (state, effect) => state.effects.some((one) => one.effect === effect);

/** Takes an effect in the place of one that these data do not distinguish from it: both together would not be determined. */
function instead(on, effect, place, fail, id) {
  const press = async () => {
    try {
      await server.send("api/effect", { do: "remove", effect: on });
      await server.send("api/effect", { do: "add", effect, place });
    } catch (error) {
      fail(error.message);
    }
  };
  return button("Take instead", { id, ariaLabel: `Take ${named({ effect, place })} instead of ${on}` }, press);
}

/** Adds an effect, or takes it out where it is on. */
function toggle(state, effect, place, fail, id) {
  const on = isOn(state, effect);
  const name = named({ effect, place });
  const press = () => server.send("api/effect", { do: on ? "remove" : "add", effect, place: on ? null : place }).catch((e) => fail(e.message));
  return button(on ? "Remove" : "Add", { id, className: on ? "added" : "primary", ariaLabel: `${on ? "Remove" : "Add"} ${name}` }, press);
}

function group(state, one, k, fail) {
  const on = [one.effect, ...one.others].find((effect) => isOn(state, effect));
  const choice = (effect, place, id) => (on && on !== effect ? instead(on, effect, place, fail, id) : toggle(state, effect, place, fail, id));
  const others = one.others.map((other) => {
    const place = state.diagnosis.ranking.find((score) => score.effect === other)?.place ?? null;
    return make("li", {}, make("code", {}, other), " ",
      choice(other, place, `add-other-${k}-${other}`),
      button("Design an experiment", { id: `tell-${k}-${other}`, ariaLabel: `Which experiment distinguishes ${one.effect} from ${other}?` },
        () => experiment.ask({ group: k, between: [one.effect, other] }, fail)));
  });
  return make("li", { className: "found" },
    make("div", { className: "head" }, make("code", { className: "name" }, named(one)), choice(one.effect, one.place, `add-found-${k}`)),
    make("p", { className: "figures" }, one.size ? make("span", {}, units(one.size)) : null, one.rmse ? make("span", {}, "error then ", make("b", {}, units(one.rmse))) : null),
    one.sentence ? make("p", {}, units(one.sentence)) : null,
    one.places ? make("p", {}, `Where it acts, with relative likelihood: ${one.places}.`) : null,
    others.length ? [make("p", { className: "caption" }, "These data do not distinguish it from:"), make("ul", { className: "others" }, others)] : null);
}

function row(state, one, k, widest, fail) {
  if (one.effect === "none") return null;
  const bar = make("span", { className: one.found ? "bar found" : one.equal ? "bar equal" : "bar" });
  bar.style.width = `${(100 * Math.max(0, one.gain ?? 0)) / widest}%`;
  return make("li", {},
    make("div", { className: "head" },
      make("details", {}, make("summary", {}, make("code", {}, named(one))),
        make("p", {}, one.physics), make("p", {}, make("code", {}, one.equation)), one.confirm ? make("p", { className: "caption" }, `To confirm it: ${one.confirm}`) : null),
      toggle(state, one.effect, one.place, fail, `add-ranked-${k}`)),
    make("p", { className: "figures" }, make("span", {}, "error then ", make("b", {}, units(one.rmse))), make("span", { title: "fall of the Bayesian information criterion; below 6 is not significant" }, `BIC falls by ${one.evidence}`),
      one.size ? make("span", {}, units(one.size)) : null, one.visible ? make("span", {}, "detectable ", units(one.visible)) : null),
    make("div", { className: "track" }, bar));
}

// Under which names the shape of a diagnosis was kept.
const kept = new Map();

/** The unexplained error becomes a term of the user's own. */
function keep(state, found, fail) {
  const name = kept.get(found.id);
  if (state.effects.some((one) => one.effect === name)) return make("p", { className: "caption" }, `Added as ${name}: the fits scale its shape.`);
  const box = make("input", { id: "keep-name", size: 12, autocomplete: "off", placeholder: "its name", spellcheck: false });
  box.setAttribute("aria-label", "Name of the effect of your own");
  const press = async () => {
    const wanted = box.value.trim();
    if (!wanted) { box.focus(); return; }
    kept.set(found.id, wanted);
    await server.send("api/effect", { do: "keep", effect: wanted }).catch((e) => { kept.delete(found.id); fail(e.message); });
  };
  box.addEventListener("keydown", (event) => { if (event.key === "Enter") press(); });
  const alone = found.unknown === "time" ? " It is a function of time, so it cannot predict other records." : "";
  return [make("p", { className: "caption" }, `Its shape can be added to the model as an effect of your own; the fits scale it. It is drawn under “The unexplained error”.${alone}`),
    make("p", { className: "line" }, box, button("Keep the shape", { id: "keep" }, press))];
}

/** A table that scrolls inside its own box. */
function scrolled(name, heads, rows) {
  const element = make("table");
  table(element, heads, rows);
  return make("div", { className: "scroll", tabIndex: 0, role: "region", "aria-label": name }, element);
}

/** The acceptance test in numbers, behind its title. */
function acceptance(test) {
  return make("details", { id: "acceptance" }, make("summary", {}, test.title),
    scrolled(test.title, [["Measure"], ["Found", true], ["Required"]], test.rows.map((row) => row.map((cell) => make("span", {}, units(cell))))),
    test.reasons.length ? make("ul", {}, test.reasons.map((reason) => make("li", {}, units(reason)))) : null);
}

/** The two rankings side by side. */
const rankings = (two) => [make("h3", {}, "Two rankings"), make("p", { className: "caption" }, two.why),
  scrolled("Two rankings", [["#", true], ...two.heads.map((head) => [head])], two.rows.map(([rank, ...effects]) => [rank, ...effects.map((effect) => make("code", {}, effect))]))];

let all = false;
let shown = null;
// What stands there: what was unfolded stays so while that does.
let written = "";
// Somebody waits for what is found.
let asked = false;

export function show(state, fail) {
  $("missing").hidden = !state.current && !state.diagnosis;
  $("diagnose").disabled = Boolean(state.job) && state.job.what === "diagnose";
  const found = state.diagnosis;
  $("diagnose").textContent = found ? "Diagnose again" : "Diagnose";
  $("diagnose").classList.toggle("primary", !found);
  $("diagnose-hint").hidden = Boolean(found);
  const wanted = JSON.stringify([found, state.effects, all]);
  if (wanted === written) return;
  written = wanted;
  if (!found) { fill($("findings")); shown = null; return; }
  const gains = found.ranking.map((one) => one.gain ?? 0);
  const widest = Math.max(1, ...gains);
  const most = all ? found.ranking.length : plots.narrow.matches ? 4 : 8;
  const rest = found.ranking.length - most;
  fill($("findings"),
    make("p", { className: `verdict-line ${found.tone}` }, found.headline),
    make("p", { className: "caption" }, `Diagnosed of ${found.of}: error ${found.before}, noise floor ${found.noise}, ${found.seconds.toFixed(1)} s.`),
    found.groups.length ? make("ul", { className: "groups" }, found.groups.map((one, k) => group(state, one, k, fail))) : null,
    found.sentences.map((sentence) => make("p", {}, units(sentence))),
    found.effort.map((sentence) => make("p", { className: "caption" }, units(sentence))),
    found.held_out_error ? make("p", { className: "caption" }, "With what was found: ", units(found.held_out_error), ".") : null,
    found.acceptance ? acceptance(found.acceptance) : null,
    found.rankings ? rankings(found.rankings) : null,
    found.unknown ? keep(state, found, fail) : null,
    make("h3", {}, "One effect at a time, refitted"),
    make("p", { className: "caption" }, "The larger the fall of BIC, the better; a fall below 6 is not significant, and effects within 6 of each other are not distinguished."),
    make("ol", { className: "ranking" }, found.ranking.slice(0, most).map((one, k) => row(state, one, k, widest, fail))),
    rest > 0 || all ? button(all ? "Show fewer" : `Show ${rest} more`, { id: "more-ranked", className: "quiet" }, () => { all = !all; show(server.current(), fail); }) : null);
  if (asked && shown !== found.id) {
    asked = false;
    $("missing").scrollIntoView({ block: "start", behavior: "smooth" });
  }
  shown = found.id;
}
