//! Records with missing rows or samples of an input: the longest time for which an input may be held depends on the model, so a first fit
//! determines it.
//!
//! Through a gap that is short beside the fastest time constant the input is held; at a longer one the record is cut, and the simulation
//! starts again after it with states of its own ([`ct_signals::Gaps`]). The parts keep their time stamps and so their clock: a drift runs
//! through them. Results join them again to the records that were given ([`ct_signals::parts`]).

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use ct_model::Model;
use ct_signals::{Gaps, Record, parts};
use estimation::Stopping;
use greybox::{FitOptions, ModelSetup, TimeLimit};
use serde::{Deserialize, Serialize};

/// An input is held through a gap of at most this part of the fastest time constant.
pub const LONGEST_HOLD: f64 = 0.1;
/// For the first fit, inputs are held for this number of sampling intervals.
pub const FIRST_HOLD: f64 = 20.0;
/// Whatever the time constant, an input is held through one missing row: a part costs its initial states. \[sampling intervals\]
const ONE_ROW: f64 = 1.5;
/// The first fit gives a time constant, no estimates.
const FIRST_FIT: FitOptions = FitOptions {
    starts: 2,
    seed: 1,
    noise_order: 0,
    stopping: Stopping {
        evaluations: 40,
        cost: 1e-4,
    },
};
/// Time limit of the first fit.
const FIRST_FIT_TIME: Duration = Duration::from_secs(3);

/// Handling of gaps in records.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MendedGaps {
    /// Rows and places.
    #[serde(flatten)]
    pub gaps: Gaps,
    /// The fastest time constant of the model \[s\], by a first fit; not finite if there is none.
    #[serde(deserialize_with = "crate::not_finite::number")]
    pub time_constant: f64,
    /// The longest time for which an input would have been held \[s\].
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

/// Fills short gaps of fitted and held-out records, and cuts the records at long ones. `model`: with what is known of its parameters, and
/// the seconds in one unit of its time; names that are none of its parameters are ignored.
///
/// # Errors
/// If no part of a record has enough readings.
pub fn mend(
    (records, test): (Vec<Record>, Vec<Record>),
    (model, known, time_unit): (&Model, &BTreeMap<String, f64>, f64),
) -> Result<Whole, ct_signals::Error> {
    let lacks = |record: &Record| {
        record.has_gaps()
            || record
                .references
                .iter()
                .any(|reference| reference.missing() > 0)
    };
    if !records.iter().chain(&test).any(lacks) {
        return Ok(Whole {
            records,
            test,
            gaps: None,
        });
    }
    let interval = records.iter().map(Record::sample_interval);
    let interval = interval.fold(0.0, f64::max);
    let longest = records.iter().map(Record::duration).fold(0.0, f64::max);
    let (first, _) = parts::without_gaps(&records, FIRST_HOLD * interval)?;
    let is_parameter = |name: &str| {
        let mut all = model.spec().parameters.iter();
        all.any(|parameter| parameter.about.name == name)
    };
    let known = known.iter().filter(|(name, _)| is_parameter(name));
    let known = known.map(|(name, value)| (name.clone(), *value)).collect();
    let setup = ModelSetup::new(model, &first, &known, time_unit);
    let time_constant = setup.ok().and_then(|setup| {
        let time = Arc::new(TimeLimit::new(Some(FIRST_FIT_TIME)));
        let setup = setup.with_time_limit(time, None);
        let fit = setup.fit(&FIRST_FIT).ok()?;
        setup.fastest_time_constant(&fit.x)
    });
    let time_constant = time_constant.unwrap_or(f64::NAN);
    // An integrator never forgets: the hold is then short beside the record.
    let limit = (LONGEST_HOLD * time_constant.min(longest)).max(ONE_ROW * interval);
    let (records, of_fitted) = parts::without_gaps(&records, limit)?;
    let (test, of_test) = parts::without_gaps(&test, limit)?;
    Ok(Whole {
        records,
        test,
        gaps: Some(MendedGaps {
            gaps: of_fitted.and(of_test),
            time_constant,
            limit,
        }),
    })
}
