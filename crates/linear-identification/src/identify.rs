//! Entry point: gaps are handled, then the method is called.

use ct_signals::Record;

use crate::{
    Error, Identification, Mended, Request, Warning,
    checks::{possible, whole},
    looped, mend, recursion, refined,
    warning::of_gaps,
};

/// Identifies from one record.
///
/// # Errors
/// [`Error::Signals`] for a record that is too short, [`Error::Untold`] where it does not determine the parameters, [`Error::Estimator`] where
/// the recursion has stopped; those of [`mend`].
pub fn identify(record: &Record, request: &Request) -> Result<Identification, Error> {
    let records = vec![record.clone()];
    let (mended, _) = mend(records, Vec::new(), request.order, request.integrator)?;
    identify_mended(&mended, request)
}

/// Identifies from records without gaps: one, or by SRIVC or RIVC one plant from several, of which the first is drawn.
///
/// # Errors
/// As [`identify`]; [`Error::InRecord`] with what `rivc` refuses.
pub fn identify_mended(records: &[Mended], request: &Request) -> Result<Identification, Error> {
    let first = records.first().ok_or(Error::NoRecord)?;
    possible(request.order)?;
    for mended in records {
        whole(&mended.whole)?;
        mended.parts.iter().try_for_each(whole)?;
        if mended.parts.is_empty() {
            return Err(Error::NoSample);
        }
    }
    let mut found = match request.method {
        method if method.is_refined() => refined::identify(records, request),
        method if method.is_of_loop() => looped::identify(&first.whole, request),
        _ => recursion::identify(&first.whole, request),
    }?;
    found.gaps = first.gaps;
    found.warnings.extend(of_gaps(first.gaps));
    let left_out = first.readings_left_out();
    if left_out > 0 && !request.method.is_refined() {
        found.warnings.push(Warning::ReadingsAfterGaps {
            method: request.method,
            readings: left_out,
        });
    }
    Ok(found)
}
