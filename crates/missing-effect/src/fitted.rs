//! The fitted model for further use: simulation on other inputs, and its curves.

use greybox::{Fit, FitUncertainty, Setup};

use crate::{
    ControlLoop, Error, Options, Problem,
    base::{closed_loop::moved_by_weighting, gaps::Mended},
    compare::{Believed, believed},
    fit::noise_model::NOISE_ORDER,
};

/// Result of a fit of the believed model.
#[derive(Debug, Clone, Copy)]
pub struct Fitted<'f, 'a> {
    /// The plant with its effects against the records, cut where gaps are long.
    pub setup: &'f Setup<'a>,
    /// The fit.
    pub fit: &'f Fit,
    /// Uncertainty of its parameters; `None` if the records do not determine them.
    pub uncertainty: Option<&'f FitUncertainty>,
    /// The model is incomplete: its residual is more than noise.
    pub lacking: bool,
}

/// Fits the believed model as [`crate::compare`] does, and passes the fit on.
///
/// # Errors
/// Where the records, the plant or the fit do not allow it.
pub fn fitted<R>(
    problem: &Problem,
    options: &Options,
    then: impl FnOnce(Fitted<'_, '_>) -> R,
) -> Result<R, Error> {
    problem.check()?;
    match Mended::of(problem, options)? {
        None => of_whole(problem, options, then),
        Some(mended) => of_whole(&mended.problem, options, then),
    }
}

fn of_whole<R>(
    problem: &Problem,
    options: &Options,
    then: impl FnOnce(Fitted<'_, '_>) -> R,
) -> Result<R, Error> {
    let Believed {
        shown,
        control_loop,
        lacking,
        ..
    } = believed(problem, options)?;
    let (setup, fit) = (&shown.setup, &shown.fit);
    let parameters = setup.parameter_count();
    let mut uncertainty = FitUncertainty::of(setup, fit, parameters, NOISE_ORDER)?;
    if let (Some(known), true) = (&mut uncertainty, ControlLoop::widens(control_loop.as_ref())) {
        known.widen(&moved_by_weighting(setup, fit)?);
    }
    Ok(then(Fitted {
        setup,
        fit,
        uncertainty: uncertainty.as_ref(),
        lacking,
    }))
}
