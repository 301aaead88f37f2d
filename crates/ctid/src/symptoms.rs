//! `ctid effects --like WORD`: effects by a description of symptoms.

use ct_model::effects::Candidate;
use ct_signals::quoted;
use plants::EffectInfo;

use crate::Error;

/// Beginnings of words with the same meaning at a plant; the first one names the family.
const FAMILIES: [&[&str]; 12] = [
    &["clog", "foul", "block", "plug", "dirt", "lodged", "narrow"],
    &[
        "drift",
        "creep",
        "wander",
        "ages",
        "aging",
        "wears",
        "over time",
    ],
    &["leak", "loses", "loss", "hole", "escape", "spill"],
    &[
        "stick",
        "sticti",
        "play",
        "slack",
        "backlash",
        "hysteresis",
        "jam",
        "coulomb",
        "friction",
        "stribeck",
    ],
    &[
        "late",
        "dead time",
        "delay",
        "lag",
        "slow",
        "sluggish",
        "time constant",
    ],
    &[
        "noisy",
        "noise",
        "coarse",
        "stairs",
        "quantis",
        "round",
        "resolution",
        "rough",
    ],
    &[
        "sudden",
        "jump",
        "instant",
        "step",
        "different since",
        "broke",
    ],
    &[
        "oscillat",
        "period",
        "hum",
        "rhythm",
        "vibrat",
        "swing",
        "day and night",
    ],
    &[
        "saturat", "limit", "clip", "flat top", "end stop", "cuts out", "rim",
    ],
    &["offset", "zero", "shift", "calibrat"],
    &["bend", "bent", "nonlinear", "curved", "operating point"],
    &["hot", "heat", "temperature", "steam"],
];

/// Search terms: beginnings of words, and their weights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sought {
    said: String,
    stems: Vec<(String, u32)>,
}

impl Sought {
    /// Search terms from the typed text.
    pub fn of(said: &str) -> Self {
        let mut stems: Vec<(String, u32)> = Vec::new();
        for word in said.to_lowercase().split_whitespace() {
            let means =
                |stem: &&str| word.starts_with(stem) || word.len() > 3 && stem.starts_with(word);
            let family = FAMILIES.iter().find(|family| family.iter().any(&means));
            let of_family = family.into_iter().flat_map(|family| family.iter());
            // The word itself has more weight than related words.
            stems.extend(
                of_family.map(|stem| ((*stem).to_string(), if means(stem) { 4 } else { 1 })),
            );
            if family.is_none() {
                let short = ["ing", "ed", "es", "s"]
                    .into_iter()
                    .find_map(|end| word.strip_suffix(end));
                stems.push((
                    short
                        .filter(|short| short.len() > 2)
                        .unwrap_or(word)
                        .to_string(),
                    4,
                ));
            }
        }
        Self {
            said: said.to_string(),
            stems,
        }
    }

    /// Score of texts, with the largest weight for the first text; zero without a match.
    fn score(&self, texts: &[&str]) -> u32 {
        let mut score = 0;
        for (text, weight) in texts.iter().zip([4, 2, 1]) {
            let text = text.to_lowercase().replace('_', " ");
            let begins = |stem: &str| {
                let mut places = text.match_indices(stem);
                places.any(|(at, _)| !text[..at].ends_with(|c: char| c.is_alphanumeric()))
            };
            let found = self.stems.iter().filter(|(stem, _)| begins(stem));
            score += weight * found.map(|(_, counts)| counts).max().unwrap_or(&0);
        }
        score
    }

    /// Score of an effect of a tank.
    pub fn score_of_plant(&self, effect: &EffectInfo) -> u32 {
        self.score(&[
            effect.id,
            effect.physics,
            effect.general.unwrap_or_default(),
        ])
    }

    /// Score of an effect at a port, or of a candidate of the model file.
    pub fn score_of(&self, candidate: &Candidate) -> u32 {
        match candidate.effect {
            Some(effect) => self.score(&[effect.id, &effect.symptoms.join(", "), effect.physics]),
            None => self.score(&[&candidate.id]),
        }
    }

    /// Message without a match.
    pub fn nothing(&self) -> Error {
        let known: Vec<&str> = FAMILIES.iter().map(|family| family[0]).collect();
        Error::UnknownEffect(format!(
            "no effect is described by \"{}\": try one of {}, or `ctid effects` for all",
            quoted(&self.said),
            known.join(", ")
        ))
    }
}

/// Items with a score, best first; equal scores keep their order.
pub(crate) fn best<T>(all: impl IntoIterator<Item = T>, score: impl Fn(&T) -> u32) -> Vec<T> {
    let scored = all.into_iter().map(|one| (score(&one), one));
    let mut scored: Vec<(u32, T)> = scored.filter(|(score, _)| *score > 0).collect();
    scored.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
    scored.into_iter().map(|(_, one)| one).collect()
}

#[cfg(test)]
mod tests {
    use ct_model::effects::all_effects;
    use plants::CATALOGUE;

    use super::*;

    fn of_tanks(said: &str) -> Vec<&'static str> {
        let sought = Sought::of(said);
        let all = best(CATALOGUE.iter(), |effect| sought.score_of_plant(effect));
        all.iter().map(|effect| effect.id).collect()
    }

    #[test]
    fn process_words_find_the_effects_of_tanks() {
        for (said, first) in [
            ("clog", "valve_drift"),
            ("clogging", "valve_drift"),
            ("stick", "stiction_backlash"),
            ("noisy", "coarse_quantisation"),
        ] {
            assert_eq!(of_tanks(said)[0], first, "{said}: {:?}", of_tanks(said));
        }
        for (said, among) in [
            (
                "drift",
                &["sensor_drift", "pump_gain_drift", "valve_drift"][..],
            ),
            ("leaks", &["const_leak", "leak_at_height"]),
            ("late", &["pump_lag", "sensor_lag", "transport_delay"]),
        ] {
            let mut first = of_tanks(said)[..among.len()].to_vec();
            first.sort_unstable();
            let mut among = among.to_vec();
            among.sort_unstable();
            assert_eq!(first, among, "{said}");
        }
        assert!(of_tanks("xyzzy").is_empty());
    }

    #[test]
    fn every_process_word_finds_general_effects() {
        let first = |said: &str| -> Vec<&str> {
            let sought = Sought::of(said);
            let score = |effect: &&ct_model::effects::Effect| {
                sought.score(&[effect.id, &effect.symptoms.join(", "), effect.physics])
            };
            best(all_effects(), score)
                .iter()
                .map(|effect| effect.id)
                .collect()
        };
        for (said, effect) in [
            ("clog", "drift"),
            ("drift", "drift"),
            ("leak", "constant"),
            ("stick", "coulomb"),
            ("late", "delay"),
            ("noisy", "quantisation"),
        ] {
            let found = first(said);
            assert!(
                found[..found.len().min(5)].contains(&effect),
                "{said}: {found:?}"
            );
            assert!(found.len() < 20, "{said}: {found:?}");
        }
    }
}
