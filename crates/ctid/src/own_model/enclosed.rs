//! A fit in the control loop of its records.

use std::sync::Arc;

use effect_search::{ControlLoop, NotSimulated, Thresholds, enclose, first_fit};
use greybox::{Fit, FitOptions, ModelSetup, SimulatedLoop};

use super::blame::blame_search;
use super::file::{OwnModelFile, Records};
use crate::Error;

/// If the residual in the simulated loop is not independent of the signals from outside, the model lacks an effect. If then the error of an
/// output changes by a larger share than this, the fit on the measured inputs is the result: its error is the smallest that the model can have. Chosen.
const SAME_ERROR: f64 = 0.005;

/// A fit in the loop of its records, if that can be simulated; the loop, and what is known of it.
pub(super) type InLoop = (Fit, Option<Arc<SimulatedLoop>>, Option<ControlLoop>);

/// The first fit of a model, in the loop of its records if the model does not follow them on the measured inputs.
pub(super) fn first_fit_of<'a>(
    file: &OwnModelFile,
    records: &Records,
    setup: ModelSetup<'a>,
    (options, simulate): (&FitOptions, bool),
) -> Result<(ModelSetup<'a>, Fit), Error> {
    let controllers = match simulate {
        true => file.loop_controllers(records)?,
        false => Vec::new(),
    };
    let found = first_fit(setup, &controllers, options, &Thresholds::DEFAULT);
    found.map_err(|error| blame_search(&records.records, error))
}

/// Closes the loop around a fitted model, if that can be simulated.
pub(super) fn in_loop(
    file: &OwnModelFile,
    records: &Records,
    (setup, fit): (ModelSetup, Fit),
    (options, simulate): (&FitOptions, bool),
) -> Result<InLoop, Error> {
    let controllers = file.loop_controllers(records)?;
    let timed = setup.model().spec().reads_time();
    // The loop is fitted with the output weights of the given fit.
    let scales = (setup.outputs() > 1)
        .then(|| setup.output_noise(&fit.x))
        .flatten();
    let setup = match scales {
        Some(scales) => setup.with_scales(scales),
        None => setup,
    };
    let of_loop = (&controllers[..], simulate);
    let how = (options.stopping, &Thresholds::DEFAULT);
    let enclosed = enclose(setup, fit.clone(), of_loop, !timed, how);
    let enclosed = enclosed.map_err(|error| blame_search(&records.records, error))?;
    if !enclosed.setup.is_run_in_loop()
        && let Some((change, output)) = enclosed.change_of_error(&fit)
        && change.abs() > SAME_ERROR
        && enclosed.depends_on_external_signals()
    {
        let output = output.to_string();
        let why = NotSimulated::ModelError { output, change };
        return Ok((fit, None, Some(ControlLoop::measured(why))));
    }
    let simulated_loop = enclosed.setup.simulated_loop().cloned();
    Ok((enclosed.fit, simulated_loop, enclosed.control_loop))
}
