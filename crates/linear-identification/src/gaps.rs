//! Preparation of records with missing rows or samples of the input.
//!
//! As everywhere else ([`ct_signals::Gaps`]) the input is held through a gap of at most a tenth of the plant's fastest time constant, which
//! is estimated by a first fit (SRIVC of the requested order). At a longer gap the record is cut.
//!
//! | methods | what they take |
//! |---|---|
//! | SRIVC, RIVC | the parts, each with its own initial state, with a common offset and noise model |
//! | all others, which begin at rest or from one state | the whole record: the input is held through the gap, and the readings in the gap and after it are left out until the response to the unknown input has decayed to 1 % (by the slowest time constant) |
//!
//! Missing readings of the output are no gaps: each method leaves them out in its own way.

use ct_signals::Record;
use missing_effect::{FIRST_HOLD, LONGEST_HOLD, MendedGaps};

use crate::{
    Error, Method, Order, Request,
    checks::{possible, whole},
    refined,
};

/// A gap is forgotten when the plant's response to it has decayed to this share.
const FORGOTTEN: f64 = 0.01;

/// A record without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Mended {
    /// On one clock: inputs held through every gap, readings left out after long ones.
    pub whole: Record,
    /// Between long gaps.
    pub parts: Vec<Record>,
    /// Handling of gaps; `None` if there are no gaps.
    pub gaps: Option<MendedGaps>,
}

impl Mended {
    /// Number of readings of the parts that the whole lacks.
    pub(crate) fn readings_left_out(&self) -> usize {
        let readings = |record: &Record| record.outputs.first().map_or(0, |y| y.present().count());
        let of_parts: usize = self.parts.iter().map(readings).sum();
        of_parts.saturating_sub(readings(&self.whole))
    }
}

/// Fastest and slowest time constant of a plant, s.
#[derive(Debug, Clone, Copy)]
struct TimeConstants {
    fastest: f64,
    slowest: f64,
}

/// The fitted records, and others of the same plant, without gaps, for models of at most this order.
///
/// # Errors
/// [`Error::Signals`] for a record that is not sound, or of which nothing is left; [`Error::NoSignal`] without a signal;
/// [`Error::FirstFit`] where its first fit fails.
pub fn mend(
    fitted: Vec<Record>,
    others: Vec<Record>,
    order: Order,
    integrator: bool,
) -> Result<(Vec<Mended>, Vec<Mended>), Error> {
    possible(order)?;
    fitted.iter().chain(&others).try_for_each(whole)?;
    let has_gaps =
        |record: &Record| record.has_gaps() || record.references.iter().any(|r| r.missing() > 0);
    if !fitted.iter().chain(&others).any(has_gaps) {
        let untouched = |record: Record| Mended {
            parts: vec![record.clone()],
            whole: record,
            gaps: None,
        };
        let all = |records: Vec<Record>| records.into_iter().map(untouched).collect();
        return Ok((all(fitted), all(others)));
    }
    let first = fitted
        .iter()
        .map(|record| cut(record, FIRST_HOLD * record.sample_interval(), f64::INFINITY))
        .collect::<Result<Vec<_>, _>>()?;
    let found = time_constants(&first, order, integrator)?;
    let limit = LONGEST_HOLD * found.fastest;
    let all = |records: &[Record]| -> Result<Vec<Mended>, Error> {
        let each = records.iter().map(|record| {
            let mut mended = cut(record, limit, found.slowest * -FORGOTTEN.ln())?;
            if let Some(gaps) = &mut mended.gaps {
                gaps.time_constant = found.fastest;
            }
            Ok(mended)
        });
        each.collect()
    };
    Ok((all(&fitted)?, all(&others)?))
}

/// A record with inputs held for at most `limit`; after longer gaps the readings within `memory` \[s\] are left out of the whole record.
fn cut(record: &Record, limit: f64, memory: f64) -> Result<Mended, Error> {
    let one = std::slice::from_ref(record);
    let (parts, gaps) = ct_signals::parts::without_gaps(one, |_| limit.into())?;
    let (mut whole, _) = ct_signals::parts::without_gaps(one, |_| f64::INFINITY.into())?;
    let mut whole = whole.swap_remove(0);
    let begin = whole.time.first().copied().unwrap_or(0.0);
    let known = |t: f64| {
        parts
            .iter()
            .any(|part| match (part.time.first(), part.time.last()) {
                (Some(first), Some(last)) => {
                    let from = if *first > begin {
                        first + memory
                    } else {
                        *first
                    };
                    (from..=*last).contains(&t)
                }
                _ => false,
            })
    };
    let unknown: Vec<bool> = whole.time.iter().map(|t| !known(*t)).collect();
    for output in &mut whole.outputs {
        for (value, unknown) in output.values.iter_mut().zip(&unknown) {
            if *unknown {
                *value = f64::NAN;
            }
        }
    }
    Ok(Mended {
        whole,
        parts,
        gaps: Some(MendedGaps {
            gaps,
            time_constant: f64::NAN,
            limit,
        }),
    })
}

/// Time constants of a first fit by SRIVC, with the highest order that is determined.
fn time_constants(
    records: &[Mended],
    order: Order,
    integrator: bool,
) -> Result<TimeConstants, Error> {
    let mut first_error = None;
    for n in (1..=order.n).rev() {
        let request = Request {
            integrator,
            ..Request::new(
                Method::Srivc,
                Order {
                    n,
                    m: order.m.min(n),
                },
            )
        };
        let found = match refined::plant(records, &request) {
            Ok((plant, true)) => plant,
            // With the lowest order, an undetermined result is accepted.
            Ok((plant, false)) if n == 1 => plant,
            Ok(_) => continue,
            Err(error) => {
                first_error.get_or_insert(error);
                continue;
            }
        };
        let a = if integrator {
            &found.a[1..]
        } else {
            &found.a[..]
        };
        if a.len() < 2 {
            // A pure integrator never forgets; its filter gives the fast limit.
            let duration = records.iter().map(|mended| mended.whole.duration());
            return Ok(TimeConstants {
                fastest: duration.fold(f64::INFINITY, f64::min),
                slowest: f64::INFINITY,
            });
        }
        let poles = ct_lti::Polynomial::new(a.to_vec())?.roots()?;
        let of = |size: fn(&ct_lti::Complex64) -> f64| poles.iter().map(move |p| 1.0 / size(p));
        return Ok(TimeConstants {
            fastest: of(|p| p.norm()).fold(f64::INFINITY, f64::min),
            slowest: match integrator {
                true => f64::INFINITY,
                false => of(|p| p.re.abs()).fold(0.0, f64::max),
            },
        });
    }
    let name = records.first().map(|mended| mended.whole.name.clone());
    let why = first_error.map_or_else(
        || "it did not converge".to_owned(),
        |error| error.to_string(),
    );
    Err(Error::FirstFit {
        record: name.unwrap_or_default(),
        why,
    })
}
