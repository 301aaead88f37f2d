//! Whether the control loop is simulated, and why not.

use effect_search::{ControlLoop, NotSimulated};

use crate::MessageNames;

/// Consequence of running a model on the measured command of a loop.
const MEASURED: &str = "The model runs on the measured command, which contains fed-back noise. Where the spectrum of the noise differs from the noise model, estimates and values of the criterion are biased; the standard errors are enlarged to allow for this.";

/// Description of the loop; `input_unit`: unit of the command.
pub fn of_the_loop(known: &ControlLoop, input_unit: &str) -> String {
    let mismatch = known.mismatch.unwrap_or(f64::NAN);
    if known.simulated {
        return format!(
            "The loop is simulated from its reference, so noise that is fed back through the command does not enter the model. The measured command differs from that of the controller by {mismatch:.4} {input_unit} rms."
        );
    }
    // A result of an earlier version does not say why.
    let Some(why) = &known.not_simulated else {
        return format!("The loop is not simulated. {MEASURED}");
    };
    let why = match why {
        NotSimulated::UnknownController { lags, input } => {
            let (command, table) = match input {
                None => ("the command", "controller".to_string()),
                Some(input) => (input.as_str(), format!("controller.{input}")),
            };
            return format!(
                "Feedback detected: {command} depends on the last {lags} residuals (F test beside its own past, p {}), and the model file has no [{table}]; give the controller and the reference, so that the loop can be simulated. {MEASURED}",
                chance(known.feedback_p.unwrap_or(f64::NAN))
            );
        }
        NotSimulated::AsRequested => "as requested".to_string(),
        NotSimulated::MissingReadings { record } => format!(
            "readings are missing in {record}, so the controller cannot be checked against its commands"
        ),
        NotSimulated::NoReference { record } => said(&greybox::Error::NoReference {
            record: record.clone(),
        }),
        NotSimulated::ConstantReference { record, value } => {
            said(&greybox::Error::ConstantReference {
                record: record.clone(),
                value: *value,
            })
        }
        NotSimulated::CommandNotHeld { record } => said(&greybox::Error::CommandNotHeld {
            record: record.clone(),
        }),
        NotSimulated::DirectTerm { output, input } => said(&greybox::Error::DirectTerm {
            output: output.clone(),
            input: input.clone(),
        }),
        NotSimulated::Unstable { radius } => format!(
            "the controller makes the fitted model unstable ({}), so it cannot have produced the record: check its sign, gain and times, and their units",
            match radius {
                Some(radius) =>
                    format!("an eigenvalue of magnitude {radius:.3} over a sampling interval"),
                None => "the simulation of the loop grows without bound".to_string(),
            }
        ),
        NotSimulated::ModelError { output, change } => format!(
            "in it the error at {output} would change by {:+.1} %, so the model lacks an effect; `ctid diagnose` simulates the loop to find it",
            100.0 * change
        ),
        NotSimulated::OtherController { share } => format!(
            "the measured command disagrees with the controller of the model file, R/S (r - y), by {mismatch:.3} {input_unit} rms, {:.0} % of its variation: check gain, integral_time (s), u_min and u_max, the sign, and that u is the command as it was recorded",
            100.0 * share
        ),
    };
    format!("The loop is not simulated: {why}. {MEASURED}")
}

fn said(error: &greybox::Error) -> String {
    error.worded(&MessageNames::PROGRAM.fit)
}

fn chance(p: f64) -> String {
    if p < 1e-9 {
        "< 1e-9".to_string()
    } else {
        format!("= {p:.0e}")
    }
}
