//! Models of one's own: texts of the library with words exchanged, or damaged, and the commands that read them, except for `monitor` and the
//! page.

use ct_model::ModelSpec;

use super::Ended;
use super::process::Folder;
use super::records::OUTPUTS;
use super::source::Source;

/// Texts whose words are exchanged, and the sampling interval of their records: most parts of the language are in one of them.
const TEXTS: [(&str, f64); 5] = [
    (
        include_str!("../../../examples/models/heated-block.mo"),
        5.0,
    ),
    (
        include_str!("../../../examples/models/coupled-heaters.mo"),
        5.0,
    ),
    (include_str!("../../../examples/models/dc-motor.mo"), 0.005),
    (include_str!("../../../examples/models/bioreactor.mo"), 0.2),
    (
        r#"model Tank "a tank that runs over, its inflow delayed"
  parameter Real A(unit="cm2", min=0) = 150 "cross-section";
  parameter Real a(unit="cm2.5/s", min=0) = 12 "outlet";
  parameter Real tau(unit="s", min=0, max=20) = 4 "pipe";
  final parameter Real rim(unit="cm") = 18;
  input Real u(unit="V");
  output Real y(unit="cm") = quantise(h, 0.05);
  Real h(unit="cm", start=10, min=0);
  Real q = 10*max(u - 0.5, 0) "inflow";
  Real spill = if h > rim then 40*(h - rim) else 0;
equation
  A*der(h) = delay(q, tau) - a*sqrt(h) - spill;
end Tank;
"#,
        2.0,
    ),
];

/// Words that stand in the place of another one.
const WORDS: [&str; 30] = [
    "0", "1", "-1", "1e-9", "1e30", "1e300", "time", "u", "y", "T", "h", "x", "sqrt", "log", "exp",
    "tanh", "abs", "min", "max", "delay", "quantise", "der", "if", "then", "+", "-", "*", "/", "^",
    ";",
];

/// Units that a column may have.
const UNITS: [&str; 6] = ["", " [V]", " [cm]", " [degC]", " [1]", " [furlong]"];

/// A text in which some words are others: mostly names in equations by other names or numbers, so that most texts are models still.
fn text(source: &mut Source, original: &str, names: &[&str]) -> String {
    let mut pieces: Vec<&str> = original
        .split_inclusive(|c: char| !c.is_alphanumeric())
        .flat_map(|piece| {
            let word = piece.trim_end_matches(|c: char| !c.is_alphanumeric());
            [word, &piece[word.len()..]]
        })
        .collect();
    for _ in 0..source.below(4) {
        if source.chance(0.15) {
            let at = source.below(pieces.len());
            pieces[at] = source.pick(&WORDS);
            continue;
        }
        let begin = pieces.iter().position(|piece| *piece == "equation");
        let begin = begin.unwrap_or(0);
        let at = begin + source.below(pieces.len() - begin);
        if names.contains(&pieces[at]) {
            pieces[at] = if source.chance(0.3) {
                source.pick(&["0", "1", "time", "1e-9", "1e30"])
            } else {
                source.pick(names)
            };
        }
    }
    pieces.concat()
}

/// The names of the inputs and outputs.
fn signals(spec: &ModelSpec) -> impl Iterator<Item = &str> {
    let inputs = spec.inputs.iter().map(|input| &input.about);
    let outputs = spec
        .outputs
        .iter()
        .map(|output| spec.about(output.variable));
    inputs.chain(outputs).map(|about| about.name.as_str())
}

/// The names in a text that may be a port, or any word.
fn port<'a>(source: &mut Source, names: &[&'a str]) -> &'a str {
    names[source.below(names.len())]
}

/// Identifiers of effects at ports that may be there.
fn effect(source: &mut Source, names: &[&str]) -> String {
    const ONE: [&str; 22] = [
        "lag",
        "delay",
        "dead_zone",
        "saturation",
        "nonlinearity",
        "gain_drift",
        "backlash",
        "offset",
        "drift",
        "quantisation",
        "hysteresis",
        "constant",
        "loss",
        "step",
        "periodic",
        "hidden_state",
        "limit",
        "stiction",
        "coulomb",
        "quadratic_drag",
        "radiation",
        "leak_at_height",
    ];
    const TWO: [&str; 4] = ["varies_with", "coupling", "input_to", "overflow"];
    let (first, second) = (port(source, names), port(source, names));
    match source.below(8) {
        0 => source.pick(&ONE).to_string(),
        1 | 2 => format!("{}({first},{second})", source.pick(&TWO)),
        _ => format!("{}({first})", source.pick(&ONE)),
    }
}

/// A record with the columns of the model; its outputs follow the inputs slowly. `usual`: its sampling interval, nearly.
fn record(source: &mut Source, spec: &ModelSpec, usual: f64) -> String {
    let names: Vec<&str> = ["t"].into_iter().chain(signals(spec)).collect();
    let mut text = names.join(",") + "\n";
    let (scale, size) = (source.scale(0.1, 50.0), source.scale(0.1, 30.0));
    // Much slower records are simulated in many steps, up to the time limit of a command.
    let step = usual * source.scale(0.2, 5.0);
    let noise = if source.chance(0.8) { 0.02 * size } else { 0.0 };
    let mut u: Vec<f64> = vec![scale; spec.inputs.len()];
    let mut y: Vec<f64> = vec![size; spec.outputs.len()];
    for k in 0..60 {
        let mut cells = vec![format!("{}", step * f64::from(k))];
        for value in &mut u {
            if k % 9 == 0 {
                *value = scale * source.uniform(0.0, 2.0);
            }
            cells.push(format!("{value:.4}"));
        }
        let pull: f64 = u.iter().sum::<f64>() / scale;
        for value in &mut y {
            *value += 0.1 * (size * pull - *value);
            if source.chance(0.02) {
                cells.push(String::new());
            } else {
                cells.push(format!("{:.5}", *value + noise * source.normal()));
            }
        }
        text += &(cells.join(",") + "\n");
    }
    text
}

/// A model file that names the text.
fn model_file(source: &mut Source, spec: &ModelSpec, names: &[&str]) -> String {
    let effects: Vec<String> = (0..source.below(8) / 6)
        .map(|_| format!("\"{}\"", effect(source, names)))
        .collect();
    let mut file = format!("model = \"own.mo\"\neffects = [{}]\n", effects.join(", "));
    if source.chance(0.2) {
        file += ["hold = \"first\"\n", "hold = \"zero\"\n"][source.below(2)];
    }
    file += "[columns]\ntime = \"t\"\n";
    for name in signals(spec) {
        let unit = if source.chance(0.95) {
            ""
        } else {
            source.pick(&UNITS)
        };
        file += &format!("{name} = \"{name}{unit}\"\n");
    }
    if source.chance(0.2) {
        let name = port(source, names);
        file += &format!("[known]\n{name} = {}\n", source.number());
    }
    if source.chance(0.15) {
        file += &format!(
            "[prior]\n{} = [{}, {}]\n",
            port(source, names),
            source.number(),
            source.number()
        );
    }
    if source.chance(0.15) {
        let (at, other) = (port(source, names), port(source, names));
        file += &format!(
            "[candidates.mine]\nparameters = {{ p = {{ start = {} }} }}\nterms = {{ {at} = \"-p*{other}{}\" }}\n",
            source.number(),
            ["", "^2", "*time", "/0", "*(", "*q"][source.below(6)]
        );
    }
    if source.chance(0.1) {
        let damaged = source.damaged(file.as_bytes(), '=');
        return String::from_utf8_lossy(&damaged).into_owned();
    }
    file
}

/// Arguments of a command.
fn command(source: &mut Source, names: &[&str]) -> String {
    match source.below(12) {
        0 => "check own.mo".to_string(),
        1 => "check model.toml".to_string(),
        2 => "diagnose data.csv --model model.toml --effort quick --max-effects 1 --json out.json --report out.html".to_string(),
        3 => "simulate model.toml data.csv --out out.csv --json out.json".to_string(),
        4 => "simulate --effort quick model.toml data.csv --fit data.csv --out out.csv --json out.json".to_string(),
        5 => "export --effort quick model.toml data.csv --modelica out.mo".to_string(),
        6 => "export --effort quick model.toml data.csv --csv out.csv".to_string(),
        7 => "effects --model model.toml".to_string(),
        8 => format!("add {} --model model.toml", effect(source, names)),
        9 => format!(
            "design data.csv --model model.toml --effort quick --between {} {} --out out.csv --json out.json",
            effect(source, names),
            effect(source, names)
        ),
        10 => "identify data.csv --model model.toml --method rivc --json out.json".to_string(),
        _ => "compare data.csv --effort quick --model model.toml --json out.json --report out.html".to_string(),
    }
}

/// A run on a text.
pub(super) fn case(source: &mut Source) -> Ended {
    let folder = Folder::with_threads(1 + source.below(2));
    let (original, usual) = TEXTS[source.below(TEXTS.len())];
    // The record has the columns of the original: of the changed text some may be missing, or others.
    let spec = match ModelSpec::parse(original) {
        Ok(spec) => spec,
        Err(error) => return Ended::without_process(false, String::new(), Some(error.to_string())),
    };
    let states = spec.states.iter().map(|state| state.about.name.as_str());
    let parameters = spec.parameters.iter().map(|p| p.about.name.as_str());
    let names: Vec<&str> = signals(&spec).chain(states).chain(parameters).collect();
    let changed = text(source, original, &names);
    if source.chance(0.1) {
        folder.write("own.mo", source.damaged(changed.as_bytes(), '='));
    } else {
        folder.write("own.mo", changed);
    }
    folder.write("data.csv", record(source, &spec, usual));
    folder.write("model.toml", model_file(source, &spec, &names));
    let words = command(source, &names);
    let written: &[&str] = if words.starts_with("add ") {
        &["model.toml"]
    } else {
        &OUTPUTS
    };
    folder.run(&words, None, written)
}
