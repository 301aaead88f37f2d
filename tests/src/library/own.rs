//! Candidates as users of the models would write them. A record may contain one of them as its hidden effect; otherwise it is a wrong
//! candidate that the search has to reject.

use std::collections::BTreeMap;

use ct_model::effects::{OwnCandidate, OwnParameter, OwnState};

/// Name, parameters with their starts and whether they are positive, states with their equations, terms.
type Text = (
    &'static str,
    &'static [(&'static str, f64, bool)],
    &'static [(&'static str, &'static str)],
    &'static [(&'static str, &'static str)],
);

/// The candidates of a model.
pub fn candidates(model: &str) -> BTreeMap<String, OwnCandidate> {
    let all: &[Text] = match model {
        "heated-block" => &[
            (
                "radiation",
                &[("e", 5e-10, true)],
                &[],
                &[("T", "-e*((T + 273.15)^4 - (Ta + 273.15)^4)")],
            ),
            (
                "draught",
                &[("cd", 0.02, true)],
                &[],
                &[("T", "-cd*max(T - Ta, 0)^1.6")],
            ),
            (
                "heater_droops",
                &[("d", 0.0005, false)],
                &[],
                &[("T", "-d*u^2")],
            ),
            (
                "second_store",
                &[("h", 0.05, true), ("c2", 20.0, true)],
                &[("Tw", "c2*der(Tw) = h*(T - Tw)")],
                &[("T", "-h*(T - Tw)")],
            ),
        ],
        "coupled-heaters" => &[
            (
                "bridge_bends",
                &[("kq", 0.0005, true)],
                &[],
                &[
                    ("T1", "-kq*(T1 - T2)*abs(T1 - T2)"),
                    ("T2", "+kq*(T1 - T2)*abs(T1 - T2)"),
                ],
            ),
            (
                "heater_1_droops",
                &[("d1", 0.00003, false)],
                &[],
                &[("T1", "-d1*u1^2")],
            ),
            (
                "draught",
                &[("cd", 0.001, true)],
                &[],
                &[
                    ("T1", "-cd*max(T1 - Ta, 0)^1.3"),
                    ("T2", "-cd*max(T2 - Ta, 0)^1.3"),
                ],
            ),
        ],
        "dc-motor" => &[
            ("fan", &[("q", 2e-7, true)], &[], &[("w", "-q*w*abs(w)")]),
            (
                "brushes",
                &[("vb", 0.3, true)],
                &[],
                &[("i", "-vb*tanh(i/0.1)")],
            ),
            (
                "warm_winding",
                &[("rw", 0.02, true)],
                &[],
                &[("i", "-rw*i*abs(i)")],
            ),
        ],
        "mass-spring" => &[
            ("drag", &[("dq", 0.5, true)], &[], &[("v", "-dq*v*abs(v)")]),
            (
                "dry_friction",
                &[("fc", 0.1, true)],
                &[],
                &[("v", "-fc*tanh(v/0.01)")],
            ),
            (
                "one_sided_spring",
                &[("kq", 100.0, false)],
                &[],
                &[("v", "-kq*x*abs(x)")],
            ),
        ],
        "house" => &[
            (
                "infiltration",
                &[("vi", 0.02, true)],
                &[],
                &[("Ti", "-vi*(Ti - To)")],
            ),
            (
                "sun_on_walls",
                &[("aw", 1.0, true)],
                &[],
                &[("Tw", "+aw*sun")],
            ),
            (
                "stack_draught",
                &[("sd", 0.004, true)],
                &[],
                &[("Ti", "-sd*max(Ti - To, 0)^1.5")],
            ),
        ],
        "bioreactor" => &[
            (
                "haldane",
                &[("ki", 0.05, true)],
                &[],
                &[(
                    "growth",
                    "mu_max*S*X/(Ks + S + ki*S^2) - mu_max*S*X/(Ks + S)",
                )],
            ),
            ("maintenance", &[("ms", 0.01, true)], &[], &[("S", "-ms*X")]),
            ("retention", &[("cr", 0.05, true)], &[], &[("X", "+cr*D*X")]),
            (
                "crowding",
                &[("cx", 0.02, true)],
                &[],
                &[("growth", "-cx*X*X*mu_max*S/(Ks + S)")],
            ),
        ],
        "battery" => &[
            (
                "slow_pair",
                &[("r2", 0.01, true), ("tau2", 600.0, true)],
                &[("w2", "tau2*der(w2) = i - w2")],
                &[("v", "-r2*w2")],
            ),
            (
                "bent_drop",
                &[("rb", 0.002, false)],
                &[],
                &[("v", "-rb*i*abs(i)")],
            ),
            (
                "empty_drop",
                &[("re", 0.01, false)],
                &[],
                &[("v", "-re*i*(1 - z)")],
            ),
        ],
        "quadruple-tank" => &[
            (
                "crossflow",
                &[("ax", 0.5, true)],
                &[],
                &[
                    ("h1", "-ax*sign(h1 - h2)*sqrt(abs(h1 - h2))"),
                    ("h2", "+ax*sign(h1 - h2)*sqrt(abs(h1 - h2))"),
                ],
            ),
            (
                "side_hole",
                &[("ah", 1.0, true)],
                &[],
                &[("h1", "-ah*sqrt(max(h1 - 11, 0))")],
            ),
            (
                "pump_head",
                &[("cp", 0.02, false)],
                &[],
                &[("h1", "-cp*u1*h1")],
            ),
            (
                "leak_above",
                &[("al", 0.3, true)],
                &[],
                &[("h3", "-al*sqrt(max(h3, 0))")],
            ),
        ],
        _ => &[],
    };
    all.iter().map(read).collect()
}

fn read((name, parameters, states, terms): &Text) -> (String, OwnCandidate) {
    let parameter = |(name, start, positive): &(&str, f64, bool)| {
        let own = OwnParameter {
            min: positive.then_some(0.0),
            start: *start,
            ..OwnParameter::default()
        };
        (name.to_string(), own)
    };
    let state = |(name, equation): &(&str, &str)| {
        let own = OwnState {
            start: if name.starts_with('T') { 22.0 } else { 0.0 },
            equation: equation.to_string(),
            ..OwnState::default()
        };
        (name.to_string(), own)
    };
    let candidate = OwnCandidate {
        parameters: parameters.iter().map(parameter).collect(),
        states: states.iter().map(state).collect(),
        terms: terms
            .iter()
            .map(|(at, term)| (at.to_string(), term.to_string()))
            .collect(),
    };
    (name.to_string(), candidate)
}
