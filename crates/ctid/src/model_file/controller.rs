//! The controller of the loop.

use ct_signals::quoted;
use plants::controller::Controller;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::{
    raw::{Number, RawController},
    source::Source,
};
use crate::Error;

/// Control law, with `e = r - y`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ControllerLaw {
    /// `u = u_op + gain (e + (1/integral_time) int e dt)`.
    Pi {
        /// Proportional gain \[input/output\].
        gain: f64,
        /// Integral time \[s\].
        integral_time: f64,
    },
    /// `S(q^-1) u = R(q^-1) e`, the powers 0, 1, 2, ... of a delay of one sample.
    Sampled {
        /// R.
        r: Vec<f64>,
        /// S.
        s: Vec<f64>,
    },
    /// `S(p) u = R(p) e`, the highest power first.
    Continuous {
        /// R.
        r: Vec<f64>,
        /// S.
        s: Vec<f64>,
    },
}

/// The settings of a controller; those of a PI were accepted by [`Controller::pi`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerSettings {
    /// The control law.
    pub law: ControllerLaw,
    /// Smallest command \[input unit\]; minus infinity where none is given.
    pub u_min: f64,
    /// Largest command \[input unit\]; infinity where none is given.
    pub u_max: f64,
}

impl ControllerSettings {
    /// The controller in continuous time, without its limits.
    ///
    /// # Errors
    /// Where it is sampled, or is no controller.
    pub fn linear(&self) -> Result<fcloe::Controller, Error> {
        let polynomial = |highest_first: &[f64]| {
            ct_lti::Polynomial::new(highest_first.iter().rev().copied().collect::<Vec<_>>())
        };
        Ok(match &self.law {
            ControllerLaw::Pi {
                gain,
                integral_time,
            } => fcloe::Controller::pi(*gain, *gain / *integral_time)?,
            ControllerLaw::Continuous { r, s } => {
                fcloe::Controller::new(polynomial(r)?, polynomial(s)?)?
            }
            ControllerLaw::Sampled { .. } => {
                return Err(Error::Usage(
                    "[controller] is given in powers of a delay, but this method needs it in continuous time; write variable = \"p\" and its polynomials in p"
                        .to_owned(),
                ));
            }
        })
    }

    /// The controller, run every `interval` seconds.
    ///
    /// # Errors
    /// Where it cannot work.
    pub fn controller(&self, interval: f64) -> Result<Controller, plants::Error> {
        let limits = (self.u_min, self.u_max);
        match &self.law {
            ControllerLaw::Pi {
                gain,
                integral_time,
            } => Controller::pi(*gain, *integral_time, limits),
            ControllerLaw::Sampled { r, s } => Controller::sampled(r, s, limits),
            ControllerLaw::Continuous { r, s } => Controller::continuous(r, s, interval, limits),
        }
    }
}

impl Source<'_> {
    /// The controller of a plant, which reads the last output.
    pub(super) fn controller(
        &self,
        raw: &Spanned<RawController>,
    ) -> Result<ControllerSettings, Error> {
        let of_own = [
            ("output", &raw.as_ref().output),
            ("reference", &raw.as_ref().reference),
        ];
        for (key, word) in of_own {
            if let Some(word) = word {
                let what = format!(
                    "{key} is not a setting of the controller of a plant: write it under [columns]"
                );
                return Err(self.at(word.span().start, what));
            }
        }
        self.controller_law(raw, "controller")
    }

    /// Reads the control law; `table`: the name of its table.
    pub(crate) fn controller_law(
        &self,
        raw: &Spanned<RawController>,
        table: &str,
    ) -> Result<ControllerSettings, Error> {
        let at = raw.span().start;
        let raw = raw.as_ref();
        const TYPES: &str =
            "write type = \"PI\" with gain and integral_time, or type = \"RS\" with r and s";
        let Some(kind) = &raw.kind else {
            return Err(self.at(at, format!("[{table}] has no type; {TYPES}")));
        };
        let foreign: &[(&str, Option<usize>)] = match kind.as_ref().as_str() {
            "PI" => &[
                ("r", raw.r.as_ref().map(|r| r.span().start)),
                ("s", raw.s.as_ref().map(|s| s.span().start)),
                ("variable", raw.variable.as_ref().map(|v| v.span().start)),
            ],
            "RS" => &[
                ("gain", raw.gain.as_ref().map(|n| n.span().start)),
                (
                    "integral_time",
                    raw.integral_time.as_ref().map(|n| n.span().start),
                ),
            ],
            other => {
                let what = format!(
                    "controller type \"{}\" is not known; {TYPES}",
                    quoted(other)
                );
                return Err(self.at(kind.span().start, what));
            }
        };
        if let Some((key, Some(place))) = foreign.iter().find(|(_, place)| place.is_some()) {
            let what = format!(
                "{key} is not a setting of a controller of type \"{}\"; delete it",
                kind.as_ref()
            );
            return Err(self.at(*place, what));
        }
        let needed = |key: &str, number: &Option<Spanned<Number>>| match number {
            Some(number) => self.finite(key, number),
            None => Err(self.at(at, format!("[{table}] has no {key}; write {key} = ..."))),
        };
        let limit = |key: &str, number: &Option<Spanned<Number>>, none: f64| {
            number.as_ref().map_or(Ok(none), |n| self.finite(key, n))
        };
        let law = if kind.as_ref() == "PI" {
            ControllerLaw::Pi {
                gain: needed("gain", &raw.gain)?,
                integral_time: needed("integral_time", &raw.integral_time)?,
            }
        } else {
            let list = |key: &str, list: &Option<Spanned<Vec<Number>>>| match list {
                Some(list) => Ok(list
                    .as_ref()
                    .iter()
                    .map(|n| n.value())
                    .collect::<Vec<f64>>()),
                None => Err(self.at(at, format!("[{table}] has no {key}; write {key} = [...]"))),
            };
            let (r, s) = (list("r", &raw.r)?, list("s", &raw.s)?);
            match raw
                .variable
                .as_ref()
                .map(|v| (v.as_ref().as_str(), v.span().start))
            {
                None | Some(("q", _)) => ControllerLaw::Sampled { r, s },
                Some(("p", _)) => ControllerLaw::Continuous { r, s },
                Some((other, place)) => {
                    let what = format!(
                        "variable \"{}\" is not known; write variable = \"q\" for powers of a delay of one sample, or \"p\" for derivatives, highest power first",
                        quoted(other)
                    );
                    return Err(self.at(place, what));
                }
            }
        };
        let settings = ControllerSettings {
            law,
            u_min: limit("u_min", &raw.u_min, f64::NEG_INFINITY)?,
            u_max: limit("u_max", &raw.u_max, f64::INFINITY)?,
        };
        // The interval is that of the records; errors do not depend on it.
        settings
            .controller(1.0)
            .map_err(|error| self.at(at, error.to_string()))?;
        Ok(settings)
    }
}
