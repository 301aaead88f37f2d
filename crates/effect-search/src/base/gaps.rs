//! Records with missing rows or samples of an input: the longest time for which an input may be held depends on the model, so a first fit
//! determines it.
//!
//! Inputs are held through a gap that is short compared with the fastest time constant and after which they are as before; otherwise the
//! record is cut, and the simulation starts again after the gap with states of its own ([`ct_signals::Gaps`]): the instant of a change in a
//! gap is not known, and a wrong one would look like an effect. The parts keep their time stamps and so their clock: a drift runs
//! through them. Results join them again to the records that were given ([`ct_signals::parts`]).
//!
//! An input is held through one missing row in any case, because each part costs its initial states. A model that only integrates has no
//! fastest time constant: inputs are held for at most a tenth of the record. If the first fit fails, longer gaps cut the record.

use std::collections::BTreeMap;

use ct_model::Model;
use ct_signals::{Gaps, LongestHold, MIN_ROWS, Record, parts};
use estimation::Stopping;
use greybox::{FitOptions, ModelSetup, PriorValue};
use serde::{Deserialize, Serialize};

/// An input is held through a gap of at most this part of the fastest time constant, and of the record.
pub const LONGEST_HOLD: f64 = 0.1;
/// For the first fit, inputs are held for this number of sampling intervals.
pub const FIRST_HOLD: f64 = 20.0;
/// An input is held through one missing row \[sampling intervals\].
const ONE_ROW: f64 = 1.5;
/// The first fit gives a time constant, no estimates.
const FIRST_FIT: FitOptions = FitOptions {
    starts: 6,
    seed: 1,
    noise_order: 0,
    stopping: Stopping {
        evaluations: 30,
        cost: 1e-3,
    },
};
/// Rows of all records for the first fit: they bound its time.
const FIRST_ROWS: usize = 4000;

/// Handling of gaps in records.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MendedGaps {
    /// Rows and places, those of held-out records too.
    #[serde(flatten)]
    pub gaps: Gaps,
    /// The fastest time constant of the model \[s\], by a first fit: infinite for a model that only integrates, NaN if the fit failed; both
    /// are `null` in JSON.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub time_constant: f64,
    /// The longest time for which unchanged inputs would have been held \[s\]; of several records the longest.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub limit: f64,
}

/// Records without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Whole {
    /// Parts of the fitted records.
    pub records: Vec<Record>,
    /// Parts of the held-out records.
    pub test: Vec<Record>,
    /// Handling of the gaps; `None` if there are none.
    pub gaps: Option<MendedGaps>,
}

/// What is known of the parameters of a model; names of other parameters are ignored.
#[derive(Debug, Clone, Copy)]
pub struct PriorKnowledge<'a> {
    /// The model.
    pub model: &'a Model,
    /// Parameters that are not fitted, by name \[unit of the text\].
    pub known: &'a BTreeMap<String, f64>,
    /// Prior knowledge of parameters.
    pub priors: &'a BTreeMap<String, PriorValue>,
    /// Seconds in one unit of the model's time.
    pub time_unit: f64,
}

/// Fills short gaps of fitted and held-out records, and cuts the records at long ones. The effects of a model file are not in the model of
/// the first fit.
///
/// # Errors
/// If a record is not sound, or no part of it has enough readings.
pub fn mend(
    (records, test): (Vec<Record>, Vec<Record>),
    prior: PriorKnowledge,
) -> Result<Whole, ct_signals::Error> {
    let lacks = |record: &Record| {
        record.has_gaps()
            || record
                .references
                .iter()
                .any(|reference| reference.missing() > 0)
    };
    let all = || records.iter().chain(&test);
    all().try_for_each(Record::validate)?;
    if !all().any(lacks) {
        return Ok(Whole {
            records,
            test,
            gaps: None,
        });
    }
    let time_constant = first_fit(&records, prior);
    let limit = |record: &Record| {
        let share = time_constant.map_or(0.0, |constant| constant.min(record.duration()));
        (LONGEST_HOLD * share).max(ONE_ROW * record.sample_interval())
    };
    let (fitted, of_fitted) = cut(&records, limit)?;
    let (held_out, of_test) = cut(&test, limit)?;
    let limits = all().filter(|record| lacks(record)).map(limit);
    Ok(Whole {
        gaps: Some(MendedGaps {
            gaps: of_fitted.and(of_test),
            time_constant: time_constant.unwrap_or(f64::NAN),
            limit: limits.fold(0.0, f64::max),
        }),
        records: fitted,
        test: held_out,
    })
}

/// Cuts records at gaps with a longer hold than `limit`, or in which an input has changed. If that leaves short parts, as with an input that
/// is recorded at a slow rate, inputs are held through all gaps up to the limit.
fn cut(
    records: &[Record],
    limit: impl Fn(&Record) -> f64,
) -> Result<(Vec<Record>, Gaps), ct_signals::Error> {
    let longest = |record: &Record| LongestHold {
        unchanged: limit(record),
        changed: ONE_ROW * record.sample_interval(),
    };
    if let Ok((parts, gaps)) = parts::without_gaps(records, longest) {
        let rows: usize = parts.iter().map(Record::len).sum();
        if rows >= MIN_ROWS * parts.len() {
            return Ok((parts, gaps));
        }
    }
    parts::without_gaps(records, |record| limit(record).into())
}

/// The fastest time constant of a first fit \[s\]; `None` if the fit fails.
fn first_fit(records: &[Record], prior: PriorKnowledge) -> Option<f64> {
    let is_parameter = |name: &str| {
        let mut all = prior.model.spec().parameters.iter();
        all.any(|parameter| parameter.about.name == name)
    };
    let known = prior.known.iter();
    let known = known.filter(|(name, _)| is_parameter(name));
    let known = known.map(|(name, value)| (name.clone(), *value)).collect();
    let priors = prior.priors.iter();
    let priors = priors.filter(|(name, _)| is_parameter(name));
    let priors = priors.map(|(name, value)| (name.clone(), *value)).collect();
    let mut rows = FIRST_ROWS;
    let first = provisional(records)?.into_iter().filter_map(|part| {
        let part = part.rows(0..rows);
        rows -= part.len();
        (!part.is_empty()).then_some(part)
    });
    let first: Vec<Record> = first.collect();
    let setup = ModelSetup::new(prior.model, &first, &known, prior.time_unit).ok()?;
    let setup = setup.with_priors(&priors).ok()?;
    let fit = setup.fit(&FIRST_FIT).ok()?;
    setup.fastest_time_constant(&fit.x)
}

/// Parts of records for the first fit: inputs are held for longer, up to a tenth of the record, if otherwise no part is left.
fn provisional(records: &[Record]) -> Option<Vec<Record>> {
    let mut hold = FIRST_HOLD;
    loop {
        let of = |record: &Record| {
            let most = LONGEST_HOLD * record.duration();
            let first = FIRST_HOLD * record.sample_interval();
            (hold * record.sample_interval())
                .min(most.max(first))
                .into()
        };
        if let Ok((parts, _)) = parts::without_gaps(records, of) {
            return Some(parts);
        }
        let longer =
            |record: &Record| hold * record.sample_interval() < LONGEST_HOLD * record.duration();
        if !records.iter().any(longer) {
            return None;
        }
        hold *= 2.0;
    }
}
