//! Texts with changed, lost and doubled pieces: a model or a message, never a panic.

use ct_model::ModelSpec;
use proptest::prelude::*;

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

/// A cut, a doubled part, or a piece put in, at a place.
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

proptest! {
    // A million take a minute: PROPTEST_CASES=1000000 cargo test --release -p ct-model mutated
    #![proptest_config(ProptestConfig { max_shrink_iters: 1000, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_text_gives_a_model_or_a_message(changes in prop::collection::vec(change(), 1..6)) {
        let text = changes.into_iter().fold(TEXT.to_string(), |text, change| changed(&text, change));
        match ModelSpec::parse(&text) {
            Ok(spec) => prop_assert_eq!(ModelSpec::parse(&spec.to_string()), Ok(spec)),
            Err(error) => {
                let said = error.to_string();
                prop_assert_eq!(said.lines().count(), 1);
                prop_assert!(error.position.line <= text.matches('\n').count() + 1);
                prop_assert!(error.excerpt().lines().count() <= 2);
            }
        }
    }

    #[test]
    fn pieces_in_any_order(pieces in prop::collection::vec(0..PIECES.len(), 0..60)) {
        let text: String = pieces.into_iter().map(|i| PIECES[i]).collect();
        for text in [text.clone(), format!("model M {text}"), format!("model M output Real y = {text}; end M;")] {
            let _ = ModelSpec::parse(&text);
        }
    }
}
