//! Models are Modelica: a compiler that no one here wrote reads what the project holds and what it writes, and simulates the same.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use ct_model::effects::{Visited, apply, candidates};
use ct_model::{Model, ModelSpec, Simulation};
use plants::Plant;
use serde_json::{Value, json};

/// Rows of a simulation, and those at which inputs have steps.
const ROWS: usize = 61;
const JUMPS: [usize; 2] = [20, 40];

/// Every function, operator and form of declaration of the language.
const EVERYTHING: &str = r#"
model Everything "all that may be written"
  constant Real pi = 3.14159;
  parameter Real p(unit="1/s", min=0, max=5) = 0.3 "with \"quotes\"";
  parameter Real n(min=-2) = -1.5e-1;
  final parameter Real twice = 2*p;
  final parameter Real q = 0.7;
  input Real u(unit="1");
  output Real y = x1 + x2;
  output Real x1(unit="1", min=-100, max=100, start=n + 1);
  Real x2(start=0.2, fixed=true);
  Real a = if x1 > 0.5 and not x2 < 0.1 then x1^2 elseif u >= 2 or x1 <= 0 then -x1^3 else (x1 - 1)^2/4;
  Real b = min(x1, 0.3) + max(x2, -0.2) + abs(x1 - x2) + sign(u - 1.7);
  Real c = sqrt(1 + x1^2) + exp(-x2) + log(2 + x1^2) + log10(3 + x2^2);
  Real d = sin(x1) + cos(x2) + tan(0.1*x1) + tanh(x2) + atan2(x1, 1 + x2^2) + sin(pi*time);
  Real e = noEvent(if x2 > 0 then x2 else 0) + smooth(0, x1) - (-x1) - (x1 - (x2 - 1)) / (2/(1 + x1^2));
equation
  twice*der(x1) = 0.1*(a + b) - x1 + u*0.1 - (x1^2)^q*0.01;
  (1 + p)*der(x2) = 0.05*(c + d + e) - x2;
end Everything;
"#;

/// A model of the examples with each effect in it that can be said in Modelica, at a start of its parameters.
fn mended(name: &str) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/models");
    let text = fs::read_to_string(folder.join(name).with_extension("mo")).unwrap();
    let spec = ModelSpec::parse(&text).unwrap();
    let all = candidates(&spec, &Visited::nominal(&spec));
    let own = ["play(", "stick_slip(", "stay_between(", "quantise("];
    let of_modelica = |text: &String| own.iter().all(|function| !text.contains(function));
    let texts = all.iter().map(|candidate| {
        let mut mended = apply(&spec, &[candidate]).unwrap();
        for own in &candidate.parameters {
            let mut parameters = mended.parameters.iter_mut();
            let parameter = parameters.find(|p| p.about.name == own.name).unwrap();
            parameter.value = own.starts[0];
        }
        let text = mended.to_string();
        // The same model results when it is read again.
        assert_eq!(ModelSpec::parse(&text).unwrap().to_string(), text);
        (candidate.id.clone(), text)
    });
    texts.filter(|(_, text)| of_modelica(text)).collect()
}

/// A text of the repository, and what its inputs are before, between and after the jumps.
struct Case {
    name: String,
    text: String,
    step: f64,
    levels: Vec<[f64; 3]>,
}

fn cases() -> Vec<Case> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/models");
    let own = |name: &str, step, levels: &[[f64; 3]]| Case {
        name: name.to_string(),
        text: fs::read_to_string(folder.join(name).with_extension("mo")).unwrap(),
        step,
        levels: levels.to_vec(),
    };
    let room = [20.0, 21.0, 19.0];
    let mut all = vec![
        own("heated-block", 10.0, &[[50.0, 0.0, 80.0], room]),
        own(
            "coupled-heaters",
            10.0,
            &[[30.0, 60.0, 0.0], [0.0, 70.0, 20.0], room],
        ),
        own("dc-motor", 0.002, &[[6.0, -8.0, 3.0]]),
        own("mass-spring", 0.05, &[[3.0, -4.0, 0.0]]),
        own(
            "house",
            0.5,
            &[[2.0, 5.0, 0.0], [0.0, 0.3, 0.5], [2.0, -3.0, 5.0]],
        ),
        own("bioreactor", 0.5, &[[0.1, 0.2, 0.25], [8.0, 12.0, 10.0]]),
        own("battery", 30.0, &[[1.0, -0.5, 2.0]]),
        own("quadruple-tank", 5.0, &[[3.0, 2.0, 4.0], [2.0, 4.0, 1.0]]),
    ];
    let texts = fs::read_dir(&folder).unwrap();
    let texts = texts.map(|entry| entry.unwrap().path());
    let is_text = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "mo");
    assert_eq!(texts.filter(is_text).count(), all.len());
    all.extend(Plant::ALL.map(|plant| Case {
        name: plant.id().to_string(),
        text: plant.text().to_string(),
        step: 0.05,
        levels: vec![[5.0, 3.0, 6.0]; plant.pumps()],
    }));
    all.push(Case {
        name: "everything".to_string(),
        text: EVERYTHING.to_string(),
        step: 0.1,
        levels: vec![[1.0, 2.5, 0.0]],
    });
    all
}

/// The text with its inputs as functions of time, which is what the other program can drive.
fn driven(text: &str, inputs: &[&str], case: &Case) -> String {
    let line = |line: &str| {
        let Some(rest) = line.trim_start().strip_prefix("input Real ") else {
            return line.to_string();
        };
        let (mut quoted, mut depth) = (false, 0);
        let end = rest.find(|character| {
            match character {
                '"' => quoted = !quoted,
                '(' if !quoted => depth += 1,
                ')' if !quoted => depth -= 1,
                _ => {}
            }
            !quoted && depth == 0 && (character == ' ' || character == ';')
        });
        let declared = &rest[..end.unwrap()];
        let name = declared.split('(').next().unwrap();
        let at = inputs.iter().position(|input| *input == name).unwrap();
        let [a, b, c] = case.levels[at];
        let [first, second] = JUMPS.map(|row| row as f64 * case.step);
        format!(
            "  Real {declared} = if time < {first} then {a} elseif time < {second} then {b} else {c};"
        )
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// States and outputs row by row, by their names.
fn simulated(spec: &ModelSpec, case: &Case) -> Vec<(String, Vec<f64>)> {
    let mut all = spec.clone();
    // States are read too.
    let states = (0..spec.states.len()).map(ct_model::Variable::State);
    all.outputs
        .extend(states.map(|variable| ct_model::Output { variable }));
    let model = Model::new(all);
    let spec = model.spec();
    let parameters = model.parameters();
    let mut simulation = Simulation::new(&model, &parameters, &model.starts(&parameters), 0.0);
    let names = spec
        .outputs
        .iter()
        .map(|output| &spec.about(output.variable).name);
    let mut series: Vec<_> = names.map(|name| (name.clone(), Vec::new())).collect();
    let mut read = vec![0.0; series.len()];
    for k in 0..ROWS {
        let which = JUMPS.iter().filter(|jump| k >= **jump).count();
        let inputs: Vec<f64> = case.levels.iter().map(|levels| levels[which]).collect();
        simulation.read(&inputs, &mut read);
        for ((_, series), value) in series.iter_mut().zip(&read) {
            series.push(*value);
        }
        let next = (k + 1) as f64 * case.step;
        simulation.advance(&inputs, &inputs, next).unwrap();
    }
    series
}

/// Results of the other program for texts: this number of rows of each, one step apart.
fn by_rumoca(cases: &[(String, f64, usize)]) -> Vec<Value> {
    let cases: Vec<Value> = cases
        .iter()
        .map(|(text, step, rows)| json!({ "text": text, "step": step, "rows": rows }))
        .collect();
    let mut python = Command::new("python3")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("modelica.py"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = python.stdin.take().unwrap();
    stdin
        .write_all(json!(cases).to_string().as_bytes())
        .unwrap();
    drop(stdin);
    let output = python.wait_with_output().unwrap();
    assert!(output.status.success());
    let found: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found.len(), cases.len());
    found
}

#[test]
#[cfg_attr(not(rumoca), ignore = "python3 has no package rumoca")]
fn another_compiler_reads_all_texts_as_they_stand_and_as_they_are_written() {
    let mut texts = Vec::new();
    for case in cases() {
        let spec = ModelSpec::parse(&case.text).unwrap();
        texts.push((case.name.clone(), case.text));
        texts.push((case.name + ", written", spec.to_string()));
    }
    let asked: Vec<_> = texts
        .iter()
        .map(|(_, text)| (text.clone(), 1.0, 0))
        .collect();
    for ((name, text), found) in texts.iter().zip(by_rumoca(&asked)) {
        assert_eq!(found.get("refused"), None, "{name}:\n{text}");
    }
    // Texts that it simulates with its own corners are read nevertheless.
    let late = "model Late parameter Real d = 2.5; input Real u; output Real y = x; Real x(start=0); equation der(x) = delay(u, d) - delay(x, 0.5); end Late;";
    let written = ModelSpec::parse(late).unwrap().to_string();
    assert_eq!(by_rumoca(&[(written, 1.0, 0)])[0].get("refused"), None);
    // Models with effects in them, but for the operators that are not Modelica's.
    let mended = mended("heated-block");
    assert!(mended.len() > 30, "{}", mended.len());
    let asked: Vec<_> = mended
        .iter()
        .map(|(_, text)| (text.clone(), 1.0, 0))
        .collect();
    for ((effect, text), found) in mended.iter().zip(by_rumoca(&asked)) {
        assert_eq!(found.get("refused"), None, "{effect}:\n{text}");
    }
    // The program rejects an error.
    let wrong = EVERYTHING.replace("^q*0.01", "^qq*0.01");
    assert!(by_rumoca(&[(wrong, 1.0, 0)])[0]["refused"].is_string());
}

#[test]
#[cfg_attr(not(rumoca), ignore = "python3 has no package rumoca")]
fn another_program_simulates_the_same() {
    let cases = cases();
    let specs: Vec<_> = cases
        .iter()
        .map(|case| ModelSpec::parse(&case.text).unwrap())
        .collect();
    let asked = cases.iter().zip(&specs).map(|(case, spec)| {
        let inputs: Vec<&str> = spec.inputs.iter().map(|i| i.about.name.as_str()).collect();
        (driven(&spec.to_string(), &inputs, case), case.step, ROWS)
    });
    let found = by_rumoca(&asked.collect::<Vec<_>>());
    for ((case, spec), found) in cases.iter().zip(&specs).zip(found) {
        for (name, own) in simulated(spec, case) {
            let other = &found["series"][&name];
            let other: Vec<f64> = serde_json::from_value(other.clone())
                .unwrap_or_else(|_| panic!("{}, {name}: {found}", case.name));
            let (low, high) = other
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |range, y| {
                    (range.0.min(*y), range.1.max(*y))
                });
            assert!(high > low, "{}, {name} stands still", case.name);
            for (k, (own, other)) in own.iter().zip(&other).enumerate() {
                let off = (own - other).abs() / (high - low);
                assert!(
                    off < 1e-7,
                    "{}, {name}, row {k}: {own} instead of {other}, {off:e} of the range",
                    case.name
                );
            }
        }
    }
}
