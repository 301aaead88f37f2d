//! Consistency of the parts of a problem, checked before any fit, because a held-out record is first simulated after the search.

use ct_signals::Channel;

use crate::{Error, Problem};

impl Problem {
    /// Rejects records whose outputs are not the model's, and a controller that reads an output that does not exist.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let outputs = self.known.outputs(self.plant).len();
        let Some(first) = self.records.first() else {
            return Err(greybox::Error::NoRecord.into());
        };
        if first.outputs.len() != outputs {
            return Err(Error::Fit(greybox::Error::Outputs {
                record: first.name.clone(),
                given: first.outputs.len(),
                needed: outputs,
            }));
        }
        for record in self.records[1..].iter().chain(&self.test) {
            let other = difference(&record.outputs, &first.outputs);
            if let Some((output, here, there)) = other {
                return Err(Error::OtherOutput {
                    record: record.name.clone(),
                    output: output + 1,
                    column: named(here),
                    first: first.name.clone(),
                    needed: named(there),
                });
            }
        }
        match &self.controller {
            Some(controller) if controller.output() >= outputs => Err(Error::ControlledOutput {
                output: controller.output() + 1,
                outputs,
            }),
            _ => Ok(()),
        }
    }
}

/// The first difference in the outputs of two records: an output that only one has, or that the other has at another position. A single
/// output may have different names.
fn difference<'a>(
    own: &'a [Channel],
    first: &'a [Channel],
) -> Option<(usize, Option<&'a Channel>, Option<&'a Channel>)> {
    let places = 0..own.len().max(first.len());
    let mut pairs = places.map(|o| (o, own.get(o), first.get(o)));
    pairs.find(|(_, here, there)| match (here, there) {
        (Some(here), Some(there)) => {
            here.name != there.name && first.iter().any(|output| output.name == here.name)
        }
        _ => true,
    })
}

/// Name of an output in messages.
fn named(output: Option<&Channel>) -> String {
    output.map_or("missing".to_string(), |output| {
        format!("column \"{}\"", output.name)
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use ct_signals::Record;
    use plants::{Known, Plant, controller::Controller};

    use super::*;
    use crate::{Options, compare, diagnose, simulated};

    fn record(name: &str, outputs: &[&str]) -> Record {
        let values: Vec<f64> = (0..60).map(|k| 1.0 + (k % 7) as f64).collect();
        let channels = |names: &[&str]| {
            let channel = |name: &&str| Channel::new(*name, "cm", values.clone());
            names.iter().map(channel).collect()
        };
        Record {
            name: name.to_string(),
            time: (0..60).map(f64::from).collect(),
            inputs: channels(&["u"]),
            outputs: channels(outputs),
            ..Record::default()
        }
    }

    fn two_levels() -> Problem {
        let known = Known {
            measured: vec![0, 1],
            ..Known::default()
        };
        let records = vec![record("a.csv", &["upper", "lower"])];
        simulated::problem(Plant::CascadedTanks, known, records)
    }

    /// Checks that `compare` and `diagnose` share, before any fit.
    fn refused(problem: &Problem) -> String {
        let stopped = std::sync::atomic::AtomicBool::new(true);
        let options = Options {
            stop: Some(&stopped),
            ..Options::default()
        };
        let compared = compare(problem, &options).unwrap_err().to_string();
        let diagnosed = diagnose(problem, &options, &|_| {}).unwrap_err();
        assert_eq!(compared, diagnosed.to_string());
        compared
    }

    #[test]
    fn records_with_other_outputs_are_refused_before_anything_is_fitted() {
        let with_test = |outputs: &[&str]| {
            let mut problem = two_levels();
            problem.test = vec![record("b.csv", outputs)];
            refused(&problem)
        };
        assert_eq!(
            with_test(&["upper"]),
            "b.csv: output 2 is missing, but in a.csv it is column \"lower\": give every record the same outputs in the same order"
        );
        assert!(with_test(&["lower", "upper"]).starts_with(
            "b.csv: output 1 is column \"lower\", but in a.csv it is column \"upper\""
        ));
        assert!(
            with_test(&["upper", "lower", "third"])
                .starts_with("b.csv: output 3 is column \"third\", but in a.csv it is missing")
        );
        let mut problem = two_levels();
        problem.records[0].outputs.truncate(1);
        assert!(refused(&problem).starts_with("a.csv: it has 1 outputs, but the model has 2"));
    }

    #[test]
    fn a_controller_of_an_output_that_there_is_not_is_refused() {
        let mut problem = two_levels();
        let controller = Controller::pi(0.6, 90.0, (0.0, 10.0)).unwrap();
        problem.controller = Some(controller.at_output(2));
        assert_eq!(
            refused(&problem),
            "controller: it reads output 3, but the model has 2: name one of these"
        );
    }

    #[test]
    fn names_may_differ_where_they_stand_for_the_same() {
        let mut problem = two_levels();
        problem.test = vec![record("b.csv", &["h1", "h2"])];
        assert!(problem.check().is_ok());
    }
}
