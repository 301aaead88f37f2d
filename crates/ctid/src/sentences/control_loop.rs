//! Whether the control loop is simulated, and why not.

use effect_search::{ControlLoop, NotSimulated};

use crate::MessageNames;

/// Consequence of running a model on the measured command of a loop.
const MEASURED: &str = "The model runs on the measured command, which contains fed-back noise. Where the spectrum of the noise differs from the noise model, estimates and values of the criterion are biased; the standard errors are enlarged to allow for this.";

/// Description of the loop; `input_unit`: unit of the command.
pub fn of_the_loop(known: &ControlLoop, input_unit: &str, names: &MessageNames) -> String {
    let said = |error: &greybox::Error| error.worded(&names.fit);
    let mismatch = known.mismatch.unwrap_or(f64::NAN);
    if known.simulated && known.needed {
        return format!(
            "The model is unstable without its controller and does not follow the record on the measured command. All simulations run in the loop, from its reference. The measured command differs from that of the controller by {mismatch:.4} {input_unit} rms."
        );
    }
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
        NotSimulated::HardNonlinearity { of } => format!(
            "a hard nonlinearity of {of} acts in the records (a limit, a dead zone, friction, backlash, a branch), and a simulated loop needs a linear plant to remove fed-back noise from the residual"
        ),
        NotSimulated::Unstable { radius } => format!(
            "the controller makes the fitted model unstable ({}), so it cannot have produced the record: check its sign, gain and times, and their units",
            match radius {
                Some(radius) =>
                    format!("an eigenvalue of magnitude {radius:.3} over a sampling interval"),
                None => "the simulation of the loop grows without bound".to_string(),
            }
        ),
        NotSimulated::ModelError { output, change } => format!(
            "in it the error at {output} would change by {:+.1} %, so the model lacks an effect; {} simulates the loop to find it",
            100.0 * change,
            names.diagnose
        ),
        NotSimulated::OtherController { share } => format!(
            "the measured command disagrees with {}, R/S (r - y), by {mismatch:.3} {input_unit} rms, {:.0} % of its variation: check gain, integral_time and its unit, u_min and u_max, the sign, and that u is the command as it was recorded",
            names.controller,
            100.0 * share
        ),
    };
    format!("The loop is not simulated: {why}. {MEASURED}")
}

fn chance(p: f64) -> String {
    if p < 1e-9 {
        "< 1e-9".to_string()
    } else {
        format!("= {p:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correction_has_the_names_of_the_reader() {
        let fit = greybox::Names {
            reference: "<reference>",
            held: "<held>",
            ..MessageNames::PROGRAM.fit
        };
        let names = MessageNames {
            fit,
            controller: "<controller>",
            diagnose: "<diagnose>",
            ..MessageNames::PROGRAM
        };
        let record = "a.csv".to_string();
        for (why, own) in [
            (
                NotSimulated::NoReference {
                    record: record.clone(),
                },
                "<reference>",
            ),
            (NotSimulated::CommandNotHeld { record }, "<held>"),
            (
                NotSimulated::OtherController { share: 0.3 },
                "<controller>, R/S",
            ),
            (
                NotSimulated::ModelError {
                    output: "y".to_string(),
                    change: 0.1,
                },
                "<diagnose> simulates",
            ),
        ] {
            let known = ControlLoop {
                simulated: false,
                needed: false,
                feedback_p: None,
                mismatch: None,
                not_simulated: Some(why),
            };
            let said = of_the_loop(&known, "V", &names);
            assert!(said.contains(own), "{said}");
        }
    }
}
