//! The accepted effects: group, place, size, acceptance.

use missing_effect::{Acceptance, Diagnosis, Step, Verdict};
use plants::{Domain, EffectInfo};

use super::{list, with_error};

/// Description of an effect outside hydraulics; `None` in hydraulics, where the name is sufficient, and for a user's own term.
fn in_general(effect: &str, domain: Domain) -> Option<&'static str> {
    let effect = EffectInfo::find(effect).filter(|_| domain == Domain::General)?;
    effect.general
}

/// A sentence for each accepted effect: its group, its place and its size.
pub(super) fn of_effects(diagnosis: &Diagnosis, last: &Step) -> Vec<String> {
    let domain = diagnosis.domain();
    let added = diagnosis.effects.iter().zip(&diagnosis.groups);
    added
        .zip(diagnosis.steps.iter().skip(1))
        .enumerate()
        .map(|(k, ((effect, group), step))| {
            let it_is = if diagnosis.verdict == Verdict::Partial && k == 0 {
                "It is mostly"
            } else {
                "It is"
            };
            let size = size_of(effect, last);
            let place = match diagnosis.places.get(k).map(Vec::as_slice) {
                Some([best, other, ..]) if other.relative_likelihood > SAME_PLACE_LIKELIHOOD => {
                    format!(
                        " ({} or the {} one: the place is not determined)",
                        domain.place_words(effect, &best.place),
                        domain.vessel_words(&other.place).0
                    )
                }
                _ => step
                    .place
                    .as_ref()
                    .map_or(String::new(), |place| {
                        format!(" {}", domain.place_words(effect, place))
                    }),
            };
            let doubt = if diagnosis.in_doubt.get(k) == Some(&true) {
                " Uncertain: its size is at a bound of its plausible range, so it may describe the data without being the cause."
            } else {
                ""
            };
            let named = |effect: &String| match in_general(effect, domain) {
                Some(clause) => format!("{effect} ({clause})"),
                None => effect.clone(),
            };
            if group.len() > 1 {
                let group_named: Vec<String> = group.iter().map(named).collect();
                format!(
                    "{it_is} {}: these data do not distinguish them; {effect}{place}{size} fits best.{doubt}{}",
                    list(&group_named, "or"),
                    next_experiment(group, diagnosis.effects.len())
                )
            } else {
                let clause = in_general(effect, domain);
                let clause = clause.map_or(String::new(), |clause| format!(": {clause}"));
                format!("{it_is} {effect}{place}{size}{clause}.{doubt}")
            }
        })
        .collect()
}

/// Another place is reported as possible from this relative likelihood on.
const SAME_PLACE_LIKELIHOOD: f64 = 0.05;

/// The parameters of an effect with their standard errors, in brackets.
fn size_of(effect: &str, step: &Step) -> String {
    let prefix = format!("{effect}.");
    let sizes: Vec<String> = step
        .parameters
        .iter()
        .filter_map(|p| Some((p, p.name.strip_prefix(&prefix)?)))
        // The initial state of a lag is not a size of the effect.
        .filter(|(_, name)| !name.starts_with("before"))
        .enumerate()
        .filter(|(k, (p, _))| *k == 0 || p.std_error.is_some())
        .map(|(_, (p, name))| format!("{name} = {}", with_error(p)))
        .collect();
    if sizes.is_empty() {
        String::new()
    } else {
        format!(" ({})", sizes.join(", "))
    }
}

/// Share of the excess error that the effects of a partial explanation explain.
pub(super) fn of_acceptance(acceptance: &Acceptance) -> Option<String> {
    let share = acceptance.share?;
    let held_out = acceptance.share_test.map_or(String::new(), |share| {
        format!(", {:.0} % on held-out data", 100.0 * share)
    });
    Some(format!(
        "That is {:.0} % of the squared error above the noise floor{held_out}; {:.0} % are needed to accept it as the explanation.",
        100.0 * share,
        100.0 * acceptance.required
    ))
}

/// The command that designs an experiment to distinguish the first two effects of a group.
fn next_experiment(group: &[String], added: usize) -> String {
    let [a, b, ..] = group else {
        return String::new();
    };
    let others = if added > 1 {
        ", once the other effects are in the model file,"
    } else {
        ""
    };
    format!(
        " `ctid design ... --between {a} {b}`{others} says whether an experiment would, and which."
    )
}
