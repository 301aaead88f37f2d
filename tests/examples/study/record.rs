//! One record of the study: its generation, and its diagnosis.

use ct_signals::Record;
use ctid_tests::{
    Drive, Rig,
    draw::{self, Levels, PLANTS},
    measured::claims_feedback,
    outside::OUTSIDE,
};
use missing_effect::{Diagnosis, Options, Problem, diagnose};
use plants::{EffectInfo, Fitted, Place, Plant, Term, Variable};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::outcome::{Answer, Outcome};
use crate::{as_text, mark};

/// Correlation of the coloured noise from sample to sample, in turn.
const COLOURS: [f64; 2] = [0.8, 0.95];

/// Standard deviation of the random walk at the end of a record with integrated noise, over that of its white noise.
const WALK: f64 = 0.5;
/// Part of the interval by which its time stamps jitter.
const JITTER: f64 = 0.03;

/// A record of the study.
#[derive(Debug, Clone, Copy)]
pub enum Job {
    /// An effect is hidden in it.
    Effect {
        /// The effect.
        effect: &'static EffectInfo,
        /// Measured levels.
        levels: Levels,
        /// Structural error over noise.
        ratio: f64,
        /// Open or closed loop.
        drive: Drive,
        /// The noise is coloured.
        coloured: bool,
        /// Number in its cell.
        number: u64,
    },
    /// Two effects are hidden in it, drawn at random.
    Pair {
        /// Structural error of each alone over noise.
        ratio: f64,
        /// Open or closed loop.
        drive: Drive,
        /// The noise is coloured.
        coloured: bool,
        /// Number in its cell.
        number: u64,
    },
    /// No effect is missing.
    Nothing {
        /// Which levels are measured.
        levels: Levels,
        /// Number of its kind.
        number: u64,
    },
    /// No effect is missing, but the noise is white noise plus a random walk, and the time stamps jitter.
    Integrated(u64),
    /// A disturbance that no effect describes.
    Unknown {
        /// Which.
        kind: usize,
        /// Number of its kind.
        number: u64,
    },
}

/// A term of the balance or of the pump that is none of the catalogue's: what it is, and how it depends on its variable.
type Strange = (&'static str, Place, Variable, fn(f64) -> f64);

const STRANGE: [Strange; 3] = [
    ("a wave in the level", Place::Vessel, Variable::Level, |h| {
        2.5 * (1.1 * h).sin()
    }),
    ("a dip in the level", Place::Vessel, Variable::Level, |h| {
        -4.0 * (-(h - 14.0).powi(2)).exp()
    }),
    (
        "a wave in the command",
        Place::Actuator,
        Variable::Input,
        |u| 0.15 * (4.0 * u).sin(),
    ),
];

/// Number of kinds of unknown disturbances.
pub fn kinds_of_unknown() -> usize {
    OUTSIDE.len() + STRANGE.len()
}

impl Job {
    /// In short.
    pub fn name(&self) -> String {
        match self {
            Self::Effect {
                effect,
                ratio,
                drive,
                coloured,
                number,
                ..
            } => format!(
                "{} {ratio} {} {number}",
                effect.id,
                condition(*drive, *coloured)
            ),
            Self::Pair {
                ratio,
                drive,
                coloured,
                number,
            } => format!("pair {ratio} {} {number}", condition(*drive, *coloured)),
            Self::Nothing { number, .. } => format!("nothing {number}"),
            Self::Integrated(number) => format!("integrated {number}"),
            Self::Unknown { kind, number } => format!("{} {number}", unknown_name(*kind)),
        }
    }

    /// The seed of the record; it does not depend on which other records are run.
    fn seed(&self) -> u64 {
        match self {
            Self::Effect {
                effect,
                ratio,
                drive,
                coloured,
                number,
                ..
            } => {
                let position = plants::CATALOGUE
                    .iter()
                    .position(|known| known.id == effect.id)
                    .unwrap_or(0) as u64;
                let cell =
                    4 * position + 2 * u64::from(*drive == Drive::Closed) + u64::from(*coloured);
                1_000_000 * cell + 1000 * (100.0 * ratio).round() as u64 + number
            }
            Self::Pair {
                ratio,
                drive,
                coloured,
                number,
            } => {
                let cell = 2 * u64::from(*drive == Drive::Closed) + u64::from(*coloured);
                3_000_000_000 + 1_000_000 * cell + 1000 * (100.0 * ratio).round() as u64 + number
            }
            Self::Nothing { number, .. } => 1_000_000_000 + number,
            Self::Integrated(number) => 4_000_000_000 + number,
            Self::Unknown { kind, number } => 2_000_000_000 + 1000 * *kind as u64 + number,
        }
    }

    /// Makes the record and diagnoses it.
    pub fn run(&self, samples: usize, wants_mark: bool, text: bool) -> Outcome {
        let refused = |why: String| Outcome {
            answer: None,
            refused: Some(why),
        };
        let Some(rig) = self.rig(samples) else {
            return refused("the effect can be given this size in none of the plants drawn".into());
        };
        let problem = problem(&rig, rig.run(&mut ChaCha8Rng::seed_from_u64(self.seed())));
        if text {
            let found = as_text::diagnosed(&rig, &problem);
            let answer = found.and_then(|found| as_text::answer(&rig, &found));
            return answer.map_or_else(
                |why| refused(why.to_string()),
                |answer| Outcome {
                    answer: Some(answer),
                    refused: None,
                },
            );
        }
        match diagnose(&problem, &Options::default(), &|_| {}) {
            Err(why) => refused(why.to_string()),
            Ok(found) => {
                let mut answer = answer(&rig, &found);
                if let (true, Self::Effect { effect, .. }) = (wants_mark, self)
                    && answer.group(effect.id).is_none()
                {
                    answer.mark = mark::mark(&rig, &problem, &answer.effects);
                }
                if matches!(self, Self::Pair { .. }) && answer.found() < answer.hidden.len() {
                    answer.pair_falls = mark::pair(&rig, &problem, &found);
                }
                Outcome {
                    answer: Some(answer),
                    refused: None,
                }
            }
        }
    }

    fn rig(&self, samples: usize) -> Option<Rig> {
        let seed = self.seed();
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        match *self {
            Self::Effect {
                effect,
                levels,
                ratio,
                drive,
                coloured,
                number,
            } => {
                let colour = colour(coloured, number);
                draw::with_effect(effect, levels, ratio, drive, colour, samples, seed)
            }
            Self::Pair {
                ratio,
                drive,
                coloured,
                number,
            } => draw::with_pair(ratio, drive, colour(coloured, number), samples, seed),
            Self::Nothing { levels, number } => {
                let plants = levels.plants();
                let plant = plants[number as usize % plants.len()];
                let number = number / plants.len() as u64;
                let drive = [Drive::Open, Drive::Closed][number as usize % 2];
                let colour = colour((number / 2).is_multiple_of(2), number / 4);
                Some(levels.of(draw::rig(plant, drive, colour, samples, rng)))
            }
            Self::Integrated(number) => {
                let plant = PLANTS[number as usize % PLANTS.len()];
                let number = number / PLANTS.len() as u64;
                let drive = [Drive::Open, Drive::Closed][number as usize % 2];
                let rig = draw::rig(plant, drive, 0.0, samples, rng);
                Some(Rig {
                    walk: WALK * rig.noise,
                    jitter: JITTER,
                    ..rig
                })
            }
            Self::Unknown { kind, .. } => {
                let rig = draw::rig(Plant::SingleTank, Drive::Open, 0.0, samples, rng);
                // The disturbances are in seconds of a record of 2000 s.
                let rig = Rig {
                    samples: 1000,
                    interval: 2.0,
                    hold: (20, 90),
                    noise: 0.05,
                    ..rig
                };
                Some(match OUTSIDE.get(kind) {
                    Some((_, outside)) => Rig {
                        outside: *outside,
                        ..rig
                    },
                    None => Rig {
                        terms: vec![strange(STRANGE[kind - OUTSIDE.len()])],
                        ..rig
                    },
                })
            }
        }
    }
}

/// Name of a kind of unknown disturbance.
pub fn unknown_name(kind: usize) -> String {
    const OUTSIDE_NAMES: [&str; OUTSIDE.len()] = [
        "a slow course of the reading",
        "the reading jumps by 3 cm",
        "the reading jumps by 0.3 cm",
        "a flow nobody recorded, 200 s",
        "a flow nobody recorded, 100 s",
        "a loss nobody recorded, 100 s",
    ];
    OUTSIDE_NAMES.get(kind).map_or_else(
        || STRANGE[kind - OUTSIDE.len()].0.to_string(),
        ToString::to_string,
    )
}

/// Open or closed loop, white or coloured noise.
pub fn condition(drive: Drive, coloured: bool) -> &'static str {
    match (drive, coloured) {
        (Drive::Open, false) => "open, white",
        (Drive::Open, true) => "open, coloured",
        (Drive::Closed, false) => "closed, white",
        (Drive::Closed, true) => "closed, coloured",
    }
}

fn colour(coloured: bool, number: u64) -> f64 {
    if coloured {
        COLOURS[number as usize % COLOURS.len()]
    } else {
        0.0
    }
}

/// Knowledge of the user: the plant, and the controller of a closed loop.
fn problem(rig: &Rig, record: Record) -> Problem {
    Problem {
        controller: (rig.drive == Drive::Closed).then(|| rig.controller()),
        ..rig.problem(record)
    }
}

fn answer(rig: &Rig, found: &Diagnosis) -> Answer {
    let named = (found.effects.clone(), found.groups.clone());
    Answer {
        feedback: claims_feedback(found),
        ..Answer::new(rig, found.verdict, named, found.seconds)
    }
}

fn strange((name, place, variable, f): Strange) -> Term {
    let (low, high) = if variable == Variable::Input {
        (0.0, 10.0)
    } else {
        (0.0, 40.0)
    };
    let knots: Vec<f64> = (0..200)
        .map(|i| low + (high - low) * f64::from(i) / 199.0)
        .collect();
    Term {
        name: name.replace(' ', "_"),
        place,
        vessel: 0,
        variable,
        ordinates: knots.iter().map(|v| f(*v)).collect(),
        knots,
        fitted: Fitted::Scale,
    }
}
