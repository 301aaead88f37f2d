//! `[controller.u]`: the controller that drove an input of a user's own model in a loop.

use std::collections::BTreeMap;

use ct_model::ModelSpec;
use ct_signals::quoted;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::model_file::{ControllerLaw, ControllerSettings, RawController, Source};
use crate::{Error, names};

/// All controllers of a model file, by the input that each drives.
pub(super) type RawControllers = BTreeMap<Spanned<String>, Spanned<RawController>>;

/// A controller of the model file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnController {
    /// The input that the controller drives, by its position.
    pub(crate) input: usize,
    /// The output that the controller reads, by its position.
    pub(crate) output: usize,
    /// The column of the reference.
    pub(crate) reference: Option<String>,
    /// Control law; times are in the unit of the model's time.
    settings: ControllerSettings,
    /// Name of the controller's table: `controller.u`.
    pub(super) table: String,
    /// The line of the table.
    pub(super) line: usize,
}

/// Reads and checks the controllers.
///
/// # Errors
/// One line that names the file, the line, what is wrong and the correction.
pub(super) fn read(
    spec: &ModelSpec,
    raw: &RawControllers,
    source: &Source,
) -> Result<Vec<OwnController>, Error> {
    let inputs: Vec<&str> = spec.about_inputs().map(|u| u.name.as_str()).collect();
    let outputs: Vec<&str> = spec.about_outputs().map(|y| y.name.as_str()).collect();
    let position = |at: usize, what: &str, known: &[&str], name: &str| {
        known.iter().position(|own| *own == name).ok_or_else(|| {
            source.at(
                at,
                format!(
                    "{} is not an {what} of {}: it has {}{}",
                    quoted(name),
                    spec.name,
                    known.join(", "),
                    names::suggestion(name, known.iter().copied())
                ),
            )
        })
    };
    let one = |(name, raw): (&Spanned<String>, &Spanned<RawController>)| {
        let (at, table) = (name.span().start, format!("controller.{}", name.as_ref()));
        let input = position(at, "input", &inputs, name.as_ref())?;
        let output = match (&raw.as_ref().output, &outputs[..]) {
            (Some(output), known) => {
                position(output.span().start, "output", known, output.as_ref())?
            }
            (None, [_]) => 0,
            (None, several) => {
                return Err(source.at(
                    at,
                    format!(
                        "[{table}] does not say which output it reads: write output = \"...\", one of {}",
                        several.join(", ")
                    ),
                ));
            }
        };
        let reference = raw.as_ref().reference.as_ref();
        Ok(OwnController {
            input,
            output,
            reference: reference.map(|column| column.as_ref().clone()),
            settings: source.controller_law(raw, &table)?,
            line: source.line_of(at),
            table,
        })
    };
    raw.iter().map(one).collect()
}

impl OwnController {
    /// Control law with times in seconds; `time_unit`: seconds in one unit of the model's time.
    pub(crate) fn in_seconds(&self, time_unit: f64) -> ControllerSettings {
        // For a polynomial in d/dt, highest power first.
        let scaled = |coefficients: &[f64]| -> Vec<f64> {
            let powers = coefficients.iter().rev().enumerate();
            let mut scaled: Vec<f64> = powers
                .map(|(k, c)| c * time_unit.powi(i32::try_from(k).unwrap_or(i32::MAX)))
                .collect();
            scaled.reverse();
            scaled
        };
        let law = match &self.settings.law {
            ControllerLaw::Pi {
                gain,
                integral_time,
            } => ControllerLaw::Pi {
                gain: *gain,
                integral_time: integral_time * time_unit,
            },
            ControllerLaw::Continuous { r, s } => ControllerLaw::Continuous {
                r: scaled(r),
                s: scaled(s),
            },
            sampled @ ControllerLaw::Sampled { .. } => sampled.clone(),
        };
        ControllerSettings {
            law,
            ..self.settings.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::Path;

    use super::*;
    use crate::own_model::OwnModelFile;

    const TEXT: &str = "model A\n parameter Real k = 1;\n input Real u;\n input Real d;\n output Real y = x;\n output Real z = k*x;\n Real x(start=0);\nequation\n der(x) = u + d - k*x;\nend A;\n";

    fn read(controller: &str) -> Result<OwnModelFile, String> {
        let text = format!("model = \"a.mo\"\n[columns]\ntime = \"t [min]\"\n{controller}\n");
        let spec = |_: &Path| Ok(ModelSpec::parse(TEXT).unwrap());
        let file = OwnModelFile::parse_with(Path::new("m.toml"), &text, spec);
        file.map_err(|error| error.to_string())
    }

    #[test]
    fn times_are_those_of_the_column() {
        let law = |text: &str| read(text).unwrap().controllers[0].in_seconds(60.0).law;
        let pi = law(
            "[controller.u]\ntype = \"PI\"\noutput = \"y\"\nreference = \"r\"\ngain = 2\nintegral_time = 1.5",
        );
        let expected = ControllerLaw::Pi {
            gain: 2.0,
            integral_time: 90.0,
        };
        assert_eq!(pi, expected);
        // The same controller as polynomials in d/dt: u = (2 p + 4/3)/p e, time in minutes.
        let rs = law(
            "[controller.u]\ntype = \"RS\"\noutput = \"y\"\nvariable = \"p\"\nr = [3.0, 2.0]\ns = [1.5, 0.0]",
        );
        let expected = ControllerLaw::Continuous {
            r: vec![180.0, 2.0],
            s: vec![90.0, 0.0],
        };
        assert_eq!(rs, expected);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line_and_the_mend() {
        let pi = "type = \"PI\"\ngain = 2\nintegral_time = 90";
        for (text, said) in [
            (
                format!("[controller.w]\noutput = \"y\"\n{pi}"),
                "m.toml:4: w is not an input of A: it has u, d",
            ),
            (
                format!("[controller.u]\noutput = \"x\"\n{pi}"),
                "m.toml:5: x is not an output of A: it has y, z",
            ),
            (
                format!("[controller.u]\n{pi}"),
                "m.toml:4: [controller.u] does not say which output it reads: write output = \"...\", one of y, z",
            ),
            (
                "[controller.u]\noutput = \"y\"\ntype = \"PI\"\ngain = 2".to_string(),
                "m.toml:4: [controller.u] has no integral_time; write integral_time = ...",
            ),
            (
                format!("[controller]\n{pi}"),
                "m.toml:4: [controller] does not say which input it drives: write [controller.u]",
            ),
        ] {
            let error = read(&text).err().unwrap();
            assert!(error.starts_with(said), "{error}");
        }
    }
}
