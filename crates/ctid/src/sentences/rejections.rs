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
                " of an effect that follows time alone"
            } else {
                ""
            };
            return format!(
                "explains {:.0} % of the excess error, {:.0} % required{of_time}",
                100.0 * share,
                100.0 * required,
            );
        }
        Rejection::NotSignificant => {
            "several effects together are very flexible, and with a separate noise model the model without them is as probable"
        }
        Rejection::Innovations => "the changes from sample to sample contradict it",
        Rejection::NotPredictive => {
            "what is fitted to one half of the record does not predict the other"
        }
        Rejection::FunctionOfTime => {
            "with an effect that is a function of time, the set fits any disturbance"
        }
        Rejection::RandomWalk => "a random walk explains as much",
        Rejection::NotPhysical => "a size is at a bound, or a state is not physical",
        Rejection::LevelShift => "a single level shift of the reading explains more",
        Rejection::NarrowBand => {
            "in a loop that is not simulated, a disturbance fed back through the command looks like a periodic effect"
        }
    };
    text.to_string()
}
