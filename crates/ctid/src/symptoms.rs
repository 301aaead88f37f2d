//! `ctid effects --like WORD`: effects by a description of symptoms.

use ct_model::effects::{Candidate, Effect, all_effects};
use ct_signals::quoted;
use plants::EffectInfo;

use crate::Error;

/// Beginnings of words with the same meaning at a plant; the first one names the family.
const FAMILIES: [&[&str]; 12] = [
    &[
        "clog",
        "foul",
        "block",
        "plug",
        "dirt",
        "lodged",
        "narrow",
        "scaling",
        "limescale",
        "corro",
        "rust",
        "deposit",
        "ice",
    ],
    &[
        "drift",
        "creep",
        "wander",
        "ages",
        "aging",
        "wear",
        "worn",
        "degrad",
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
    &[
        "hot",
        "heat",
        "temperature",
        "steam",
        "condens",
        "evaporat",
        "insulat",
    ],
];

/// Words that say nothing of a symptom.
const STOP_WORDS: [&str; 26] = [
    "a", "an", "and", "are", "as", "at", "be", "by", "for", "from", "in", "is", "it", "its", "my",
    "of", "on", "or", "that", "the", "this", "to", "too", "very", "was", "with",
];

/// Weight of a typed word, of a word of its family, and of a phrase.
const TYPED: u32 = 4;
const RELATED: u32 = 1;
const PHRASE: u32 = 4;

/// What a user typed: for each word the beginnings of words that match it, with their weights; and the phrases, which are pairs of
/// neighbouring words, and all words together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sought {
    said: String,
    words: Vec<Vec<(String, u32)>>,
    phrases: Vec<String>,
}

impl Sought {
    /// Search terms from the typed text.
    pub fn of(said: &str) -> Self {
        let typed = said.to_lowercase().replace(['_', ','], " ");
        let all: Vec<&str> = typed.split_whitespace().collect();
        let is_stop = |word: &&str| STOP_WORDS.contains(word);
        let words = all.iter().filter(|word| !is_stop(word));
        let pairs = all.windows(2).filter(|pair| !pair.iter().all(is_stop));
        let whole = (all.len() > 2 && !all.iter().all(is_stop)).then(|| all.join(" "));
        Self {
            said: said.to_string(),
            words: words.map(|word| stems(word)).collect(),
            phrases: pairs.map(|pair| pair.join(" ")).chain(whole).collect(),
        }
    }

    /// Sum over the texts and the typed words, with the largest weight for the first text; zero without a match.
    fn score(&self, texts: &[(&str, u32)]) -> u32 {
        let mut score = 0;
        for (text, weight) in texts {
            let text = text.to_lowercase().replace('_', " ");
            let begins = |stem: &str| {
                let mut places = text.match_indices(stem);
                places.any(|(at, _)| !text[..at].ends_with(|c: char| c.is_alphanumeric()))
            };
            for stems in &self.words {
                let found = stems.iter().filter(|(stem, _)| begins(stem));
                score += weight * found.map(|(_, counts)| counts).max().unwrap_or(&0);
            }
            let phrases = self.phrases.iter().filter(|phrase| begins(phrase)).count();
            score += weight * PHRASE * u32::try_from(phrases).unwrap_or(0);
        }
        score
    }

    /// Score of an effect of a tank.
    pub fn score_of_plant(&self, effect: &EffectInfo) -> u32 {
        let is_at_port = |other: &&ct_model::effects::Effect| {
            let mut ports = effect.at_ports.iter();
            ports.any(|port| port.split('(').next() == Some(other.id))
        };
        let symptoms: Vec<&str> = all_effects()
            .filter(is_at_port)
            .flat_map(|other| other.symptoms)
            .copied()
            .collect();
        self.score(&[
            (effect.id, 4),
            (effect.physics, 2),
            (effect.general.unwrap_or_default(), 1),
            (&symptoms.join(", "), 2),
        ])
    }

    /// Score of an effect at the ports of models.
    pub fn score_of_effect(&self, effect: &Effect) -> u32 {
        let symptoms = effect.symptoms.join(", ");
        self.score(&[(effect.id, 4), (&symptoms, 2), (effect.physics, 1)])
    }

    /// Score of an effect at a port, or of a candidate of the model file.
    pub fn score_of(&self, candidate: &Candidate) -> u32 {
        match candidate.effect {
            Some(effect) => self.score_of_effect(effect),
            None => self.score(&[(&candidate.id, 4)]),
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

/// Beginnings of words that match a typed word, with their weights.
fn stems(word: &str) -> Vec<(String, u32)> {
    let means = |stem: &&str| word.starts_with(stem) || word.len() > 3 && stem.starts_with(word);
    if let Some(family) = FAMILIES.iter().find(|family| family.iter().any(&means)) {
        let weight = |stem: &&str| if means(stem) { TYPED } else { RELATED };
        let stems = family
            .iter()
            .map(|stem| ((*stem).to_string(), weight(stem)));
        return stems.collect();
    }
    let mut short = ["ing", "ed", "es", "s"]
        .into_iter()
        .filter_map(|end| word.strip_suffix(end));
    let short = short.find(|short| short.len() > 2).unwrap_or(word);
    vec![(short.to_string(), TYPED)]
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
    use ct_model::effects::{Visited, candidates};
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

    /// Effects at all ports, best first: `lag(y)`.
    fn at_ports(said: &str) -> Vec<String> {
        let sought = Sought::of(said);
        let all = best(all_effects(), |effect| sought.score_of_effect(effect));
        let id = |effect: &&Effect| format!("{}({})", effect.id, effect.port_names());
        all.iter().map(id).collect()
    }

    #[test]
    fn every_process_word_finds_general_effects() {
        for (said, effect) in [
            ("clog", "drift(p)"),
            ("drift", "drift(y)"),
            ("leak", "constant(x)"),
            ("stick", "hysteresis(y)"),
            ("stick", "backlash(u)"),
            ("late", "delay(u)"),
            ("noisy", "quantisation(y)"),
        ] {
            let found = at_ports(said);
            assert!(
                found[..found.len().min(5)].iter().any(|id| id == effect),
                "{said}: {found:?}"
            );
            assert!(found.len() < 20, "{said}: {found:?}");
        }
    }

    #[test]
    fn a_literal_symptom_is_first() {
        for (said, effect) in [
            ("reads too high", "offset(y)"),
            ("the sensor reads too low", "offset(y)"),
            ("end stop", "end_stop(v,x)"),
            ("dead time", "delay(u)"),
            ("right at one level only", "varies_with(p,x)"),
        ] {
            assert_eq!(at_ports(said)[0], effect, "{said}: {:?}", at_ports(said));
        }
        assert_eq!(of_tanks("reads too high")[0], "sensor_offset");
        assert_eq!(of_tanks("end stop")[0], "overflow");
        assert!(at_ports("it is too").is_empty());
    }

    #[test]
    fn every_process_word_finds_an_effect_of_the_example_models() {
        let block = include_str!("../models/heated-block.mo");
        let spec = ct_model::ModelSpec::parse(block).unwrap();
        let all = candidates(&spec, &Visited::nominal(&spec));
        for (said, right) in [
            ("clog", &["drift(k)", "drift(g)"][..]),
            ("drift", &["drift(y)", "gain_drift(u)"]),
            ("leak", &["constant(T)", "loss(T)"]),
            ("stick", &["backlash(u)", "hysteresis(y)"]),
            ("late", &["delay(u)", "lag(u)"]),
            ("noisy", &["quantisation(y)"]),
        ] {
            let sought = Sought::of(said);
            let found = best(all.iter(), |candidate| sought.score_of(candidate));
            let first: Vec<&str> = found.iter().take(3).map(|c| c.id.as_str()).collect();
            assert!(
                first.iter().any(|id| right.contains(id)),
                "{said}: {first:?}"
            );
        }
    }
}
