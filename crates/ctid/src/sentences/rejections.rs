//! Why a set of effects is not accepted.

use missing_effect::{Acceptance, Rejection};

/// Sentences about the conditions that the tested effects do not meet; empty if they are accepted.
#[must_use]
pub fn of_rejections(test: &Acceptance) -> Vec<String> {
    test.rejections.iter().map(of_rejection).collect()
}

fn of_rejection(rejection: &Rejection) -> String {
    let text = match rejection {
        Rejection::Share {
            share,
            required,
            of_time,
        } => {
            let of_time = if *of_time {
                " of a set with an effect that depends on time only"
            } else {
                ""
            };
            return format!(
                "explains {:.0} % of the squared error above the noise; {:.0} % are required{of_time}",
                100.0 * share,
                100.0 * required,
            );
        }
        Rejection::NotSignificant => {
            "not significant: each with the noise model of its own residual, the model without these effects is as probable"
        }
        Rejection::Innovations => {
            "its innovations (one-step prediction errors) are larger than those of the model without it"
        }
        Rejection::NotPredictive => {
            "fitted to one half of the record, it does not predict the other half"
        }
        Rejection::FunctionOfTime => {
            "one of several effects is a function of time, so that the set fits any disturbance"
        }
        Rejection::RandomWalk => "a random walk explains as much",
        Rejection::NotPhysical => {
            "a parameter is at a bound, or a state has a value that is physically impossible"
        }
        Rejection::LevelShift => "a single level shift of the reading explains more",
        Rejection::NarrowBand => {
            "in a loop that is not simulated, a disturbance that the controller feeds back to the command looks like stiction with a narrow band"
        }
    };
    text.to_string()
}
