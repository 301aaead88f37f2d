//! Effects and ports of a user's own model.

use ct_model::ModelSpec;
use ct_model::effects::{Candidate, Place, Port, Visited, candidates};

use super::OwnModelFile;
use super::effects::every_candidate;
use super::words::EffectWords;
use crate::Error;
use crate::look::Look;
use crate::symptoms::{Sought, best};

/// Headings in the order in which candidates are listed.
const HEADINGS: [&str; 6] = [
    "inputs: between the command and the model",
    "outputs: between the model and the reading",
    "balances: in the equation of a state",
    "parameters and named flows",
    "between",
    "of the model file",
];

/// Heading of a candidate's group.
fn group(candidate: &Candidate) -> usize {
    match candidate.port {
        Port::Input(_) => 0,
        Port::Output(_) => 1,
        Port::Balance(_) => 2,
        Port::Value(_) | Port::Dependence(..) => 3,
        Port::Between(..) | Port::InputAndBalance(..) => 4,
        Port::BalanceAnd(..) => 2,
        Port::OutputAnd(..) => 1,
        Port::Own => 5,
    }
}

/// All candidates of a search: from the catalogue and from the model file.
fn searched(file: &OwnModelFile) -> Result<Vec<Candidate>, Error> {
    let mut all = every_candidate(&file.base, &file.candidates)?;
    all.retain(|candidate| !candidate.is_shape());
    Ok(all)
}

/// `ctid effects --model M.toml`: every effect with the identifiers of its ports, by place.
///
/// # Errors
/// As [`own_candidates`], which the model file has passed.
pub(crate) fn listed(file: &OwnModelFile, look: Look) -> Result<String, Error> {
    let all = searched(file)?;
    let words = EffectWords::of(&file.base, &file.candidates);
    let mut text = String::new();
    for (i, heading) in HEADINGS.into_iter().enumerate() {
        let here: Vec<&Candidate> = all.iter().filter(|c| group(c) == i).collect();
        if here.is_empty() {
            continue;
        }
        text += &format!("{}\n", look.heading(heading));
        text += &by_effect(&here, &words, look);
        text.push('\n');
    }
    Ok(text)
}

/// Candidates, with consecutive ones of the same effect together, and the effect's physics.
fn by_effect(all: &[&Candidate], words: &EffectWords, look: Look) -> String {
    let mut text = String::new();
    let mut rest = all;
    while let Some(first) = rest.first() {
        let same = |c: &&&Candidate| c.effect == first.effect && c.effect.is_some();
        let count = rest.iter().take_while(same).count().max(1);
        let ids: Vec<&str> = rest[..count].iter().map(|c| c.id.as_str()).collect();
        text += &look.paragraph("  ", &look.strong(ids.join(", ")));
        let physics = format!("{}.", words.physics(&first.id));
        text += &look.paragraph("      ", &physics);
        rest = &rest[count..];
    }
    text
}

/// `ctid effects --like WORD --model M.toml`: the effects that match a symptom, best first.
///
/// # Errors
/// Where none does.
pub(crate) fn like(file: &OwnModelFile, sought: &Sought, look: Look) -> Result<String, Error> {
    let all = searched(file)?;
    let found = best(all.iter(), |candidate| sought.score_of(candidate));
    if found.is_empty() {
        return Err(sought.nothing());
    }
    let words = EffectWords::of(&file.base, &file.candidates);
    Ok(by_effect(&found, &words, look))
}

/// `ctid check`: a short list of the ports with the names of their effects.
pub(crate) fn summary(spec: &ModelSpec, look: Look) -> String {
    let all = candidates(spec, &Visited::nominal(spec));
    let ports = [
        ("inputs", Place::Input),
        ("outputs", Place::Output),
        ("balances", Place::Balance),
        ("parameters", Place::Parameter),
    ];
    let mut text = format!("\n{}\n", look.heading("What can act where"));
    let mut row = |kind: &str, what: &str| text += &look.paragraph(&format!("  {kind:<12}"), what);
    for (kind, place) in ports {
        let here = || {
            all.iter()
                .filter(|c| c.effect.is_some_and(|effect| effect.place == place))
        };
        let mut names: Vec<String> = here().map(|c| c.port.names(spec)).collect();
        let mut seen = std::collections::BTreeSet::new();
        names.retain(|name| seen.insert(name.clone()));
        let mut effects: Vec<&str> = here().filter_map(|c| c.effect).map(|e| e.id).collect();
        effects.dedup();
        if place == Place::Parameter && all.iter().any(|c| matches!(c.port, Port::Dependence(..))) {
            effects.push("varies_with(p,x)");
        }
        if !names.is_empty() {
            row(
                kind,
                &format!("{}: {}", names.join(", "), effects.join(", ")),
            );
        }
    }
    let others = all.iter().filter(|c| {
        let place = c.effect.map(|effect| effect.place);
        place.is_some_and(|place| {
            place != Place::ParameterAndSignal && ports.iter().all(|(_, other)| *other != place)
        })
    });
    let ids: Vec<&str> = others.map(|c| c.id.as_str()).collect();
    if !ids.is_empty() {
        row("between", &ids.join(", "));
    }
    text
}
