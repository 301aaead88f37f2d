//! Texts with changed, lost and doubled pieces: a model or a message, never a panic.

use std::time::{Duration, Instant};

use ct_model::{Model, ModelSpec, Simulation, unit_warnings};
use proptest::prelude::*;

/// The longest that a text of this size may take until it can be simulated.
const LONGEST: Duration = Duration::from_millis(100);

const TEXT: &str = r#"model Block "a block"
  parameter Real C(unit="J/K", min=0) = 50 "heat capacity";
  final parameter Real A = 2*C; constant Real pi = 3.14;
  input Real u(unit="%"); input Real Ta;
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20, fixed=true);
  Real loss = if T > Ta and not u < 3 then max(A, 1e-3)*(T - Ta)^2 else delay(u, 2)/pi;
equation
  C*der(T) = -loss + u; // a comment
end Block;
"#;

const PIECES: [&str; 32] = [
    "(",
    ")",
    "=",
    ";",
    ",",
    "+",
    "-",
    "*",
    "/",
    "^",
    "if ",
    " then ",
    " else ",
    "der(",
    "T",
    "u",
    "Real ",
    "parameter ",
    "end ",
    "\"",
    "/*",
    "*/",
    "1e9",
    "0",
    ".",
    "[",
    "not ",
    "µ",
    "\n",
    "time",
    "equation ",
    "output ",
];

/// A deletion, a duplication, or an insertion at a place.
fn change() -> impl Strategy<Value = (u8, f64, usize, usize)> {
    (0..3_u8, 0.0..1.0, 1..12_usize, 0..PIECES.len())
}

fn changed(text: &str, (how, place, length, piece): (u8, f64, usize, usize)) -> String {
    let characters: Vec<char> = text.chars().collect();
    let at = (place * characters.len() as f64) as usize;
    let end = (at + length).min(characters.len());
    let string = |part: &[char]| part.iter().collect::<String>();
    let (before, part) = (string(&characters[..at]), string(&characters[at..end]));
    match how {
        0 => before + &string(&characters[end..]),
        1 => before + &part + &part + &string(&characters[end..]),
        _ => before + PIECES[piece] + &string(&characters[at..]),
    }
}

/// Reads and compiles a text; of three times the shortest counts, as other programs may be in the way.
fn ready(text: &str) -> Option<Model> {
    let mut shortest = Duration::MAX;
    for _ in 0..3 {
        let began = Instant::now();
        let model = ModelSpec::parse(text).ok().map(|spec| {
            let _ = unit_warnings(&spec);
            Model::new(spec)
        });
        shortest = shortest.min(began.elapsed());
        if shortest < LONGEST {
            return model;
        }
    }
    panic!("{shortest:?} for\n{text}");
}

/// Simulates three rows: a result, or none, but no panic.
fn simulate(model: &Model) {
    let parameters = model.parameters();
    let initial = model.starts(&parameters);
    let mut simulation = Simulation::new(model, &parameters, &initial, 0.0);
    let inputs = vec![1.0; model.spec().inputs.len()];
    let mut outputs = vec![0.0; model.spec().outputs.len()];
    for k in 1..4 {
        simulation.read(&inputs, &mut outputs);
        let to: Vec<f64> = inputs.iter().map(|u| u + f64::from(k % 2)).collect();
        if simulation.advance(&inputs, &to, f64::from(k)).is_err() {
            break;
        }
    }
}

/// Words that may stand for each other, so that most texts are models still.
const ALIKE: [&[&str]; 3] = [
    &[
        "T", "u", "Ta", "C", "A", "pi", "time", "0", "1e-9", "1e300", "(T - T)", "abs(T)",
        "sqrt(T)", "log(u)",
    ],
    &[" + ", " - ", "*", "/", "^"],
    &[" > ", " < ", " >= ", " <= ", " == "],
];

/// An equation of words drawn at random, in the frame of a model.
fn exchanged(draws: &[(usize, usize)]) -> String {
    let word = |kind: usize, draw: usize| ALIKE[kind][draw % ALIKE[kind].len()];
    let sum = |part: &[(usize, usize)]| {
        part.iter()
            .enumerate()
            .fold(String::new(), |text, (i, &(operator, operand))| {
                let operator = if i == 0 { "" } else { word(1, operator) };
                text + operator + word(0, operand)
            })
    };
    let (first, rest) = draws.split_at(draws.len() / 2);
    let compare = word(2, draws[0].0);
    format!(
        "model M parameter Real C(min=0) = 50; parameter Real A = 2; constant Real pi = 3; input Real u; input Real Ta; output Real y = T; \
         Real T(start=0); Real used = C + A + pi + u + Ta; \
         equation (1 + 0*used)*der(T) = if {}{compare}{} then {} else delay({}, 0.3); end M;",
        sum(&first[..1]),
        sum(&rest[..1]),
        sum(first),
        sum(rest)
    )
}

proptest! {
    // A million take some minutes: PROPTEST_CASES=1000000 cargo test --release -p ct-model mutated
    #![proptest_config(ProptestConfig { max_shrink_iters: 1000, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_text_gives_a_model_or_a_message(changes in prop::collection::vec(change(), 1..6)) {
        let text = changes.into_iter().fold(TEXT.to_string(), |text, change| changed(&text, change));
        let model = ready(&text);
        match ModelSpec::parse(&text) {
            Ok(spec) => {
                prop_assert_eq!(ModelSpec::parse(&spec.to_string()), Ok(spec));
                model.iter().for_each(simulate);
            }
            Err(error) => {
                let said = error.to_string();
                prop_assert_eq!(said.lines().count(), 1);
                let place = error.position;
                prop_assert!(place.line >= 1 && place.column >= 1);
                let begins = format!("{}:{}: ", place.line, place.column);
                prop_assert!(said.starts_with(&begins));
                // The end of a text is after its last character.
                let line = text.split('\n').nth(place.line - 1);
                prop_assert!(line.is_some_and(|line| place.column <= line.chars().count() + 1));
                prop_assert!(error.excerpt().lines().count() <= 2);
            }
        }
    }

    #[test]
    fn pieces_in_any_order(pieces in prop::collection::vec(0..PIECES.len(), 0..60)) {
        let text: String = pieces.into_iter().map(|i| PIECES[i]).collect();
        for text in [text.clone(), format!("model M {text}"), format!("model M output Real y = {text}; end M;")] {
            ready(&text).iter().for_each(simulate);
        }
    }

    #[test]
    fn models_of_any_words_are_simulated_or_end(draws in prop::collection::vec((0..100_usize, 0..100_usize), 2..12)) {
        ready(&exchanged(&draws)).iter().for_each(simulate);
    }
}
