//! Effects and ports of a user's own model.

use ct_model::ModelSpec;
use ct_model::effects::{Candidate, Effect, Place, Port, Role, Visited, candidates};

use super::OwnModelFile;
use super::effects::{every_candidate, find};
use super::raw_effects::plain;
use super::words::{EffectWords, shown_unit};
use crate::Error;
use crate::generic::{self, Sheet};
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
    let mut all = every_candidate(&file.base, &file.candidates, &file.effects.functions)?;
    all.retain(|candidate| !candidate.is_shape());
    Ok(all)
}

/// `ctid effects --model M.toml`: every effect with the identifiers of its ports, by place.
///
/// # Errors
/// As [`own_candidates`], which the model file has passed.
pub(crate) fn listed(file: &OwnModelFile, look: Look) -> Result<String, Error> {
    let all = searched(file)?;
    let words = EffectWords::of(file);
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
    for here in alike(all, words) {
        let ids: Vec<&str> = here.iter().map(|c| c.id.as_str()).collect();
        text += &look.paragraph("  ", &look.strong(ids.join(", ")));
        let physics = format!("{}.", words.physics(&here[0].id));
        text += &look.paragraph("      ", &physics);
    }
    text
}

/// Consecutive candidates of the same effect with the same physics.
fn alike<'a>(
    all: &'a [&'a Candidate],
    words: &EffectWords,
) -> impl Iterator<Item = &'a [&'a Candidate]> {
    all.chunk_by(|a, b| {
        a.effect.is_some() && a.effect == b.effect && words.physics(&a.id) == words.physics(&b.id)
    })
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
    let words = EffectWords::of(file);
    Ok(by_effect(&found, &words, look))
}

/// `ctid effects EFFECT --model M.toml`: everything the catalogue knows of an effect, at its ports in this model.
///
/// # Errors
/// Where no effect of this name can act in the model, with the nearest name.
pub(crate) fn described(file: &OwnModelFile, written: &str, look: Look) -> Result<String, Error> {
    let all = searched(file)?;
    let wanted = plain(written);
    // A name without a port stands for every port.
    let is_meant = |c: &&Candidate| c.id == wanted || c.id.split('(').next() == Some(&wanted);
    let mut found: Vec<&Candidate> = all.iter().filter(is_meant).collect();
    if found.is_empty() {
        found.push(find(&file.base, &all, written).map_err(Error::UnknownEffect)?);
    }
    let words = EffectWords::of(file);
    let sheets = alike(&found, &words).map(|here| sheet(file, here, &words, look));
    Ok(sheets.collect::<Vec<String>>().join("\n"))
}

/// Description of candidates of one effect, which differ in their ports alone.
fn sheet(file: &OwnModelFile, here: &[&Candidate], words: &EffectWords, look: Look) -> String {
    let first = here[0];
    let ids: Vec<&str> = here.iter().map(|c| c.id.as_str()).collect();
    let places: Vec<&str> = here.iter().map(|c| words.place(&c.id)).collect();
    let declared = first
        .effect
        .map_or(Vec::new(), Effect::described_parameters);
    let parameters = first.parameters.iter().map(|own| {
        let declared = declared.iter().find(|known| known.name == own.short);
        let absent = match declared {
            Some(declared) => declared.absent.to_string(),
            None if matches!(own.role, Role::Size | Role::Threshold) => "0".to_string(),
            None => String::new(),
        };
        [
            own.name.clone(),
            shown_unit(&own.unit).to_string(),
            absent,
            own.description.clone(),
        ]
    });
    // The letters of the equation.
    let letters = first.effect.map_or(String::new(), |effect| {
        format!(" ({})", generic::place(effect.place))
    });
    let sheet = Sheet {
        heading: ids.join(", "),
        physics: format!("{}.", words.physics(&first.id)),
        place: places.join("; ") + &letters,
        parameters: parameters.collect(),
        effect: first.effect,
        confirm: first.described(&file.base).map(|text| text.confirm),
        add: format!("ctid add '{}' --model {}", first.id, file.name),
    };
    sheet.text(look)
}

/// `ctid check`: a short list of the ports with the names of their effects; ports with the same effects are together.
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
        let mut names: Vec<(String, Vec<&str>)> = Vec::new();
        for candidate in &all {
            let Some(effect) = candidate.effect else {
                continue;
            };
            let (name, id) = match candidate.port {
                Port::Dependence(value, _) if place == Place::Parameter => {
                    (spec.about(value).name.clone(), "varies_with(p,x)")
                }
                port if effect.place == place => (port.names(spec), effect.id),
                _ => continue,
            };
            match names.iter_mut().find(|(known, _)| *known == name) {
                Some((_, effects)) if effects.contains(&id) => {}
                Some((_, effects)) => effects.push(id),
                None => names.push((name, vec![id])),
            }
        }
        let mut kind = kind;
        while let Some((_, effects)) = names.first().cloned() {
            let alike = names.extract_if(.., |(_, own)| *own == effects);
            let alike: Vec<String> = alike.map(|(name, _)| name).collect();
            row(
                kind,
                &format!("{}: {}", alike.join(", "), effects.join(", ")),
            );
            kind = "";
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
