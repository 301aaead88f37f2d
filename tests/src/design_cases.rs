//! Records that leave two effects undecided, the experiment that is proposed for them, and what both records then say.

use ct_signals::Record;
use missing_effect::design::{Candidacy, Design, Limits, Prospect, design};
use missing_effect::{Diagnosis, Options, Problem, Verdict, diagnose};
use plants::{CATALOGUE, EffectInfo};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{Drive, Rig, draw};

/// The hidden effect of the plant, and the input of the first record: a nearly constant command, or a loop.
pub type Row = (&'static str, Drive, &'static str, usize, &'static [f64]);

/// Plants, loops and effects, the truth now one of a family, now another. Sizes are such that a record with a narrow command can
/// show that something is missing, and hardly what.
pub const ROWS: [Row; 24] = [
    ("single", Drive::Open, "pump_deadzone", 0, &[0.6]),
    ("linear", Drive::Open, "sqrt_outflow", 0, &[0.4]),
    ("single", Drive::Closed, "const_leak", 0, &[6.0]),
    ("cascaded", Drive::Open, "const_leak", 1, &[4.0]),
    ("single", Drive::Open, "laminar_outflow", 0, &[0.8]),
    ("single", Drive::Open, "sensor_lag", 0, &[10.0]),
    ("linear", Drive::Open, "pump_nonlinearity", 0, &[0.6]),
    ("single", Drive::Closed, "pump_deadzone", 0, &[0.6]),
    ("single", Drive::Open, "overflow", 0, &[19.5]),
    ("cascaded", Drive::Open, "pipe_height", 1, &[3.0]),
    ("single", Drive::Open, "valve_drift", 0, &[0.006]),
    ("linear", Drive::Open, "transport_delay", 0, &[5.0]),
    ("single", Drive::Open, "sensor_offset", 0, &[1.5]),
    ("single", Drive::Closed, "sensor_lag", 0, &[8.0]),
    (
        "single",
        Drive::Open,
        "pump_gain_drift",
        0,
        &[0.006, 2000.0],
    ),
    ("cascaded", Drive::Open, "pump_lag", 0, &[10.0]),
    ("single", Drive::Open, "sensor_saturation", 0, &[19.5]),
    ("single", Drive::Closed, "sensor_offset", 0, &[0.8]),
    ("single", Drive::Open, "pump_lag", 0, &[10.0]),
    ("linear", Drive::Open, "pump_saturation", 0, &[5.55]),
    ("cascaded", Drive::Open, "laminar_outflow", 1, &[0.8]),
    ("single", Drive::Open, "pump_nonlinearity", 0, &[-0.3]),
    ("cascaded", Drive::Open, "sensor_drift", 0, &[0.5]),
    ("single", Drive::Closed, "laminar_outflow", 0, &[0.5]),
];

/// Seeds of a row that are looked at.
pub const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;
/// Limits of the experiment, as multiples of the middle command or, in a loop, of the set point.
const RANGE: (f64, f64) = (0.5, 1.5);

/// The rig of a row: its command stays near the middle.
#[must_use]
pub fn rig(row: &Row) -> Rig {
    let (plant, drive, effect, vessel, parameters) = *row;
    let rig = match plant {
        "single" => Rig::single_tank(),
        "cascaded" => Rig::cascaded_tanks(),
        _ => Rig::linear_tank(),
    };
    Rig {
        command: (4.4, 5.6),
        drive,
        samples: 600,
        hidden: vec![(effect, vessel, parameters.to_vec())],
        ..rig
    }
}

/// A record that does not decide between the true effect and another one.
pub struct Undecided {
    /// The rig.
    pub rig: Rig,
    /// The record as a problem with its known constants.
    pub problem: Problem,
    /// The truth.
    pub truth: &'static str,
    /// The others of its group, best first.
    pub others: Vec<String>,
}

fn problem(rig: &Rig, records: Vec<Record>) -> Option<Problem> {
    let mut problem = rig.problem(records.first()?.clone());
    problem.records = records;
    problem.controller = (rig.drive == Drive::Closed).then(|| rig.controller());
    Some(problem)
}

fn diagnosed(problem: &Problem) -> Option<Diagnosis> {
    diagnose(problem, &Options::default(), &|_| {}).ok()
}

/// A rig drawn at random: any effect of the catalogue, any plant that it may act in, in open loop or in a loop, under white or coloured
/// noise, with a structural error of one to eight times the noise. `None` if the effect is not visible in any draw.
#[must_use]
pub fn drawn(seed: u64) -> Option<Rig> {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let effect = CATALOGUE[rng.random_range(0..CATALOGUE.len())];
    let drive = [Drive::Open, Drive::Closed][rng.random_range(0..2_usize)];
    let colour = [0.0, rng.random_range(0.3..0.9)][rng.random_range(0..2_usize)];
    let ratio = rng.random_range(0.0..8.0_f64.ln()).exp();
    draw::with_effect(
        effect,
        draw::Levels::Last,
        ratio,
        drive,
        colour,
        600,
        rng.random(),
    )
}

/// A rig's record, where its diagnosis is one group of several that contains the true value.
#[must_use]
pub fn undecided(rig: Rig, seed: u64) -> Option<Undecided> {
    let truth = rig.missing().first()?.0;
    let record = rig.run(&mut ChaCha8Rng::seed_from_u64(seed));
    let problem = problem(&rig, vec![record])?;
    let found = diagnosed(&problem)?;
    let [group] = &found.groups[..] else {
        return None;
    };
    let others: Vec<String> = group.iter().filter(|id| *id != truth).cloned().collect();
    let open = found.verdict == Verdict::Undecided && others.len() + 1 == group.len();
    (open && !others.is_empty()).then_some(Undecided {
        rig,
        problem,
        truth,
        others,
    })
}

/// The experiment between the truth and the best of the others that is no twin of it; `Err` holds the twins where all are.
///
/// # Errors
/// The twins.
pub fn proposed(case: &Undecided) -> Result<(String, Design), Vec<String>> {
    let middle = match case.rig.drive {
        Drive::Open => 0.5 * (case.rig.command.0 + case.rig.command.1),
        Drive::Closed => case.rig.levels.last().copied().unwrap_or_default(),
    };
    let limits = Limits {
        range: Some((RANGE.0 * middle, RANGE.1 * middle)),
        seed: 1,
        ..Limits::default()
    };
    let plan = |between, limits: &Limits| {
        design(&case.problem, between, limits, &Options::default(), &|_| {})
    };
    let mut twins = Vec::new();
    for other in &case.others {
        // The order of the two effects does not matter for a design.
        let named = [case.truth, other.as_str()].map(EffectInfo::find);
        let [Some(a), Some(b)] = named else { continue };
        let between = [a, b].map(|effect| Candidacy {
            effect,
            vessel: None,
        });
        match plan(between, &limits) {
            Ok(found) if found.prospect != Prospect::Twins => {
                return Ok((other.clone(), found));
            }
            _ => twins.push(other.clone()),
        }
    }
    Err(twins)
}

/// Result with both records.
pub struct Answer {
    /// The truth is named or in the one group, the other is not, and nothing else was added.
    pub pair_decided: bool,
    /// The truth is named, alone.
    pub truth_alone: bool,
    /// The groups.
    pub groups: Vec<Vec<String>>,
}

/// Applies the experiment to the rig, and diagnoses both records together.
#[must_use]
pub fn answered(case: &Undecided, other: &str, plan: &Design, seed: u64) -> Option<Answer> {
    // The number of repetitions from the design.
    let times = plan.times_as_long.unwrap_or(1);
    let values = plan.experiment.values.repeat(times);
    let mut next = case.rig.play(values, &mut ChaCha8Rng::seed_from_u64(seed));
    next.name = "next".to_string();
    let mut records = case.problem.records.clone();
    records.push(next);
    let found = diagnosed(&problem(&case.rig, records)?)?;
    let holds = |id: &str| found.groups.iter().flatten().any(|named| named == id);
    Some(Answer {
        pair_decided: found.groups.len() == 1 && holds(case.truth) && !holds(other),
        truth_alone: found.verdict == Verdict::Effect && found.effects == [case.truth],
        groups: found.groups,
    })
}
