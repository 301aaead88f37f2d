//! Models of one's own: texts of the library with words exchanged, or damaged, and the commands that read them, except for `monitor` and the
//! page.

use ct_model::ModelSpec;
use ct_model::effects::{Visited, candidates};

use super::Ended;
use super::process::Folder;
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

/// Files that the commands write, but for `add`.
const OUTPUTS: [&str; 4] = ["out.json", "out.html", "out.csv", "out.mo"];

/// Units that a column may have.
const UNITS: [&str; 6] = ["", " [V]", " [cm]", " [degC]", " [1]", " [furlong]"];

/// A text in which up to three words are others: mostly names by other names or numbers, so that most texts are models still.
fn text(source: &mut Source, original: &str, names: &[&str]) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut pieces: Vec<&str> = Vec::new();
    for piece in original.split_inclusive(|c| !is_word(c)) {
        let word = piece.trim_end_matches(|c| !is_word(c));
        pieces.extend([word, &piece[word.len()..]]);
    }
    let of_names: Vec<usize> = (0..pieces.len())
        .filter(|&i| names.contains(&pieces[i]))
        .collect();
    for _ in 0..source.below(4) {
        if source.chance(0.15) {
            let at = source.below(pieces.len());
            pieces[at] = source.pick(&WORDS);
            continue;
        }
        let at = of_names[source.below(of_names.len())];
        pieces[at] = if source.chance(0.3) {
            source.pick(&["0", "1", "time", "1e-9", "1e30"])
        } else {
            source.pick(names)
        };
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

/// The names of a model that effects and model files may give.
struct Names<'a> {
    /// Inputs, outputs, states, parameters and flows.
    all: Vec<&'a str>,
    /// Identifiers of the effects that can act in it.
    effects: Vec<String>,
}

impl<'a> Names<'a> {
    fn of(spec: &'a ModelSpec) -> Self {
        let variables = spec.variables().map(|v| spec.about(v).name.as_str());
        let effects = candidates(spec, &Visited::nominal(spec));
        Self {
            all: variables.collect(),
            effects: effects.into_iter().map(|effect| effect.id).collect(),
        }
    }

    fn any(&self, source: &mut Source) -> &'a str {
        source.pick(&self.all)
    }

    /// Identifier of an effect, now and then of one that cannot act.
    fn effect(&self, source: &mut Source) -> String {
        let id = &self.effects[source.below(self.effects.len())];
        if source.chance(0.85) {
            return id.clone();
        }
        let name = id.split('(').next().unwrap_or_default();
        format!("{name}({},{})", self.any(source), self.any(source))
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
fn model_file(source: &mut Source, spec: &ModelSpec, names: &Names) -> String {
    let count = [0, 0, 0, 0, 0, 0, 1, 2][source.below(8)];
    let effects: Vec<String> = (0..count)
        .map(|_| format!("\"{}\"", names.effect(source)))
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
        let name = names.any(source);
        file += &format!("[known]\n{name} = {}\n", source.number());
    }
    if source.chance(0.15) {
        file += &format!(
            "[prior]\n{} = [{}, {}]\n",
            names.any(source),
            source.number(),
            source.number()
        );
    }
    if source.chance(0.15) {
        let (at, other) = (names.any(source), names.any(source));
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
fn command(source: &mut Source, names: &Names) -> String {
    match source.below(12) {
        0 => "check own.mo".to_string(),
        1 => "check model.toml".to_string(),
        2 => "diagnose data.csv --model model.toml --effort quick --max-effects 1 --json out.json --report out.html".to_string(),
        3 => "simulate model.toml data.csv --out out.csv --json out.json".to_string(),
        4 => "simulate --effort quick model.toml data.csv --fit data.csv --out out.csv --json out.json".to_string(),
        5 => "export --effort quick model.toml data.csv --modelica out.mo".to_string(),
        6 => "export --effort quick model.toml data.csv --csv out.csv".to_string(),
        7 => "effects --model model.toml".to_string(),
        8 => format!("add {} --model model.toml", names.effect(source)),
        9 => format!(
            "design data.csv --model model.toml --effort quick --between {} {} --out out.csv --json out.json",
            names.effect(source),
            names.effect(source)
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
    let names = Names::of(&spec);
    let changed = text(source, original, &names.all);
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
