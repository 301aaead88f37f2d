//! Terms of a true model that neither the catalogue nor a candidate contains.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use ct_model::effects::{OwnCandidate, OwnParameter, OwnState, Visited};
use ct_model::{ModelSpec, Variable};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Names of the kinds.
pub const KINDS: [&str; 8] = [
    "square of a balance",
    "product of two states",
    "chirp",
    "random telegraph",
    "gain that depends on the rate",
    "for a while",
    "sensor that rings",
    "switched on and off",
];

/// One of these terms with the size parameter `size`, in a balance with the given scale per state.
pub fn candidate(
    kind: usize,
    spec: &ModelSpec,
    visited: &Visited,
    balances: &[(usize, f64)],
    rng: &mut ChaCha8Rng,
) -> OwnCandidate {
    let (state, balance) = balances[rng.random_range(0..balances.len())];
    let name = spec.states[state].about.name.clone();
    let share = |variable: Variable| {
        let span = visited.span(variable);
        let name = &spec.about(variable).name;
        format!("(({name} - ({:e}))/{:e})", span.low, span.width())
    };
    let (begin, duration) = (visited.begin, visited.duration);
    let part = format!("((time - ({begin:e}))/{duration:e})");
    let mut states = BTreeMap::new();
    let mut place = name.clone();
    let term = match kind {
        0 => format!("({0} - 0.3)^2", share(Variable::State(state))),
        1 => {
            let other =
                (state + 1 + rng.random_range(0..spec.states.len().max(2) - 1)) % spec.states.len();
            let other = if other == state {
                Variable::Input(0)
            } else {
                Variable::State(other)
            };
            format!(
                "({} - 0.5)*({} - 0.5)",
                share(Variable::State(state)),
                share(other)
            )
        }
        2 => {
            let (first, last) = (rng.random_range(2.0..5.0), rng.random_range(15.0..30.0));
            format!(
                "sin({TAU:e}*({first:e}*{part} + {:e}*{part}^2))",
                0.5 * (last - first)
            )
        }
        3 => {
            let mut terms = Vec::new();
            let mut at = 0.0;
            while at < 1.0 {
                let from: f64 = at + rng.random_range(0.02..0.1);
                let to = from + rng.random_range(0.02..0.1);
                terms.push(format!(
                    "(if {part} > {from:e} and {part} < {to:e} then 1 else 0)"
                ));
                at = to;
            }
            terms.join(" + ")
        }
        4 => {
            let input = &spec.inputs[0].about.name;
            let tau = visited.interval * rng.random_range(5.0..15.0);
            states.insert(
                "slow_input".to_string(),
                OwnState {
                    start: visited.span(Variable::Input(0)).first,
                    equation: format!("{tau:e}*der(slow_input) = {input} - slow_input"),
                    ..OwnState::default()
                },
            );
            let width = visited.span(Variable::Input(0)).width();
            format!(
                "({input} - slow_input)*abs({input} - slow_input)/{:e}",
                width * width
            )
        }
        5 => {
            let from: f64 = rng.random_range(0.2..0.5);
            let to = from + rng.random_range(0.08..0.25);
            format!("(if {part} > {from:e} and {part} < {to:e} then 1 else 0)")
        }
        6 => {
            let output = rng.random_range(0..spec.outputs.len());
            let variable = spec.outputs[output].variable;
            let measured = &spec.about(variable).name;
            place = measured.clone();
            let frequency = TAU / (visited.interval * rng.random_range(8.0..25.0));
            let first = visited.span(variable).first;
            let own = |start: f64, equation: String| OwnState {
                start,
                equation,
                ..OwnState::default()
            };
            states.insert(
                "ring".to_string(),
                own(first, "der(ring) = ring_rate".to_string()),
            );
            let equation = format!(
                "der(ring_rate) = {:e}*({measured} - ring) - {:e}*ring_rate",
                frequency * frequency,
                2.0 * 0.12 * frequency
            );
            states.insert("ring_rate".to_string(), own(0.0, equation));
            format!("(ring - {measured})")
        }
        _ => {
            let (cycles, duty) = (rng.random_range(5.0..14.0), rng.random_range(-0.5..0.5));
            format!(
                "(if sin({:e}*{part}) > {duty:e} then 1 else 0)",
                TAU * cycles
            )
        }
    };
    let size = if kind == 6 { 1.0 } else { 0.1 * balance };
    OwnCandidate {
        parameters: BTreeMap::from([(
            "size".to_string(),
            OwnParameter {
                start: size,
                ..OwnParameter::default()
            },
        )]),
        states,
        terms: BTreeMap::from([(place, format!("size*({term})"))]),
    }
}
