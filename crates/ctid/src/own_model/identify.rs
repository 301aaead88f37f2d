//! The linear model from `ctid identify`, compared with the transfer function of a user's own model.

use std::path::Path;

use ct_model::{Linearity, TransferFunction};
use ct_signals::{Columns, Hold, OutOfRange, ReadSummary, Record, quoted};
use serde::Serialize;

use super::controller::OwnController;
use super::file::OwnModelFile;
use crate::Error;
use crate::look::{Look, Side, table_text};
use crate::model_file::ControllerSettings;
use crate::numbers;
use crate::output::Found;
use linear_identification::Order;

/// A zero this near to a pole, as a share of its size, cancels it.
const CANCELS: f64 = 1e-8;

/// One input and one output of a linear model.
pub(crate) struct OneByOne<'f> {
    file: &'f OwnModelFile,
    input: usize,
    output: usize,
}

/// The transfer function of the model's text, time in seconds: `A = 1 + a_1 s + ..` where `A(0)` is not zero.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OwnTransferFunction {
    /// The model's name.
    pub model: String,
    /// The input.
    pub input: String,
    /// The output.
    pub output: String,
    /// Coefficients of the input's polynomial, by powers of s.
    pub b: Vec<f64>,
    /// Coefficients of the output's polynomial, by powers of s.
    pub a: Vec<f64>,
    /// Inputs that are assumed constant.
    pub others: Vec<String>,
}

/// The identified model, and the transfer function of the user's model.
#[derive(Debug, Serialize)]
pub(crate) struct Beside<'t, T> {
    #[serde(flatten)]
    pub found: &'t T,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_model: Option<&'t OwnTransferFunction>,
}

impl<T: Found> Found for Beside<'_, T> {
    fn page(&self) -> String {
        self.found.page()
    }

    fn sentences(&self) -> Option<Vec<String>> {
        self.found.sentences()
    }
}

impl<'f> OneByOne<'f> {
    /// The chosen input and output, or the only ones.
    ///
    /// # Errors
    /// Where the model is not linear, or there are several and none was chosen, or none has this name.
    pub fn of(
        path: &Path,
        file: &'f OwnModelFile,
        (input, output): (Option<&str>, Option<&str>),
    ) -> Result<Self, Error> {
        let spec = file.model.spec();
        if let Linearity::Nonlinear { equations } = spec.linearity() {
            let names = equations.iter().map(|&v| spec.about(v).name.as_str());
            return Err(Error::file(
                path,
                format!(
                    "{} is not linear in the equation of {}, and identify fits linear models: fit it with `ctid compare`, or give the columns by --columns",
                    spec.name,
                    names.collect::<Vec<_>>().join(", ")
                ),
            ));
        }
        let inputs: Vec<&str> = spec.about_inputs().map(|u| u.name.as_str()).collect();
        let outputs: Vec<&str> = spec.about_outputs().map(|y| y.name.as_str()).collect();
        let chosen = |what: &str, names: &[&str], wanted: Option<&str>| match (wanted, names) {
            (_, []) => Err(Error::file(
                path,
                format!(
                    "{} has no {what}, and identify fits one output to one input: fit it with `ctid compare`, or give the columns by --columns",
                    spec.name
                ),
            )),
            (None, [_]) => Ok(0),
            (None, _) => Err(Error::file(
                path,
                format!(
                    "{} has {} {what}s, {}, and identify fits one input and one output at a time: choose with --{what} NAME",
                    spec.name,
                    names.len(),
                    names.join(", ")
                ),
            )),
            (Some(wanted), _) => {
                let at = names.iter().position(|name| *name == wanted);
                at.ok_or_else(|| {
                    Error::file(
                        path,
                        format!(
                            "{} has no {what} {}: it has {}{}",
                            spec.name,
                            quoted(wanted),
                            names.join(", "),
                            crate::names::suggestion(wanted, names.iter().copied())
                        ),
                    )
                })
            }
        };
        Ok(Self {
            input: chosen("input", &inputs, input)?,
            output: chosen("output", &outputs, output)?,
            file,
        })
    }

    /// The columns of both, and the hold of the input between samples.
    pub fn columns(&self) -> (Columns, Hold) {
        let all = &self.file.columns;
        let columns = Columns {
            inputs: vec![all.inputs[self.input].clone()],
            outputs: vec![all.outputs[self.output].clone()],
            references: self
                .loop_controller()
                .and_then(|own| own.reference.clone())
                .into_iter()
                .collect(),
            ..all.clone()
        };
        (columns, self.file.hold)
    }

    /// The controller between this output and this input.
    fn loop_controller(&self) -> Option<&OwnController> {
        let mut controllers = self.file.controllers.iter();
        controllers.find(|own| own.input == self.input && own.output == self.output)
    }

    /// Controller with times in seconds; `data`: a record whose header gives the unit of the time if the model file does not.
    ///
    /// # Errors
    /// Where the record cannot be read.
    pub fn controller(&self, data: &Path) -> Result<Option<ControllerSettings>, Error> {
        let controller = self.loop_controller();
        let in_seconds = |own: &OwnController| Ok(own.in_seconds(self.file.time_unit(data)?));
        controller.map(in_seconds).transpose()
    }

    /// Converts a record to the units of the model. A reference that no controller names contains no information about this loop, and is
    /// dropped.
    ///
    /// # Errors
    /// Where a unit is of another dimension.
    pub fn convert(&self, record: &mut Record, summary: &mut ReadSummary) -> Result<(), Error> {
        let spec = self.file.model.spec();
        let output = spec.about(spec.outputs[self.output].variable);
        if self
            .loop_controller()
            .is_none_or(|own| own.reference.is_none())
        {
            record.references.clear();
        }
        let signals = [&spec.inputs[self.input].about, output, output];
        let channels = record.inputs.iter_mut().chain(&mut record.outputs);
        let channels = channels.chain(record.references.first_mut());
        for (channel, about) in channels.zip(signals) {
            super::file::convert(summary, channel, about)?;
        }
        let about = &spec.inputs[self.input].about;
        let input = record.inputs.first();
        let outside = input.and_then(|input| OutOfRange::find(input, about.min, about.max));
        summary.out_of_range.extend(outside);
        Ok(())
    }

    /// The transfer function with the values of the text and of `[known]`; `None` if the model has a delay.
    ///
    /// `data`: a record, whose header says the unit of the time where the model file does not.
    ///
    /// # Errors
    /// Where the record cannot be read.
    pub fn transfer_function(&self, data: &Path) -> Result<Option<OwnTransferFunction>, Error> {
        let spec = self.file.model.spec();
        let mut parameters = self.file.model.parameters();
        for (value, parameter) in parameters.iter_mut().zip(&spec.parameters) {
            *value = *self.file.known.get(&parameter.about.name).unwrap_or(value);
        }
        let Some(linear) = self.file.model.linear(&parameters) else {
            return Ok(None);
        };
        let second = self.file.time_unit(data)?;
        let found = reduced(linear.transfer_function(self.input, self.output))?;
        let in_seconds = |coefficients: Vec<f64>| -> Vec<f64> {
            let powers = coefficients.into_iter().enumerate();
            powers
                .map(|(i, c)| c * second.powi(i32::try_from(i).unwrap_or(i32::MAX)))
                .collect()
        };
        let (mut a, mut b) = (in_seconds(found.denominator), in_seconds(found.numerator));
        let largest = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let scale = if a[0].abs() > 1e-12 * largest {
            a[0]
        } else {
            // The model has an integrator.
            a[0] = 0.0;
            a[1.min(a.len() - 1)]
        };
        a.iter_mut().chain(&mut b).for_each(|c| *c /= scale);
        let output = spec.about(spec.outputs[self.output].variable);
        let inputs = spec.inputs.iter().enumerate();
        let others = inputs.filter(|(i, _)| *i != self.input);
        Ok(Some(OwnTransferFunction {
            model: spec.name.clone(),
            input: spec.inputs[self.input].about.name.clone(),
            output: output.name.clone(),
            a,
            b,
            others: others.map(|(_, input)| input.about.name.clone()).collect(),
        }))
    }
}

/// Cancels common poles and zeros (modes that this input does not excite or this output does not contain), and removes leading zeros.
fn reduced(mut found: TransferFunction) -> Result<TransferFunction, Error> {
    let largest = found.numerator.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let rounding = 1e-14 * largest;
    while found.numerator.len() > 1 && found.numerator.last().is_some_and(|c| c.abs() <= rounding) {
        found.numerator.pop();
    }
    if largest == 0.0 || found.denominator.len() == 1 || found.numerator.len() == 1 {
        return Ok(found);
    }
    let mut zeros = ct_lti::Polynomial::new(found.numerator.clone())?.roots()?;
    let mut poles = ct_lti::Polynomial::new(found.denominator.clone())?.roots()?;
    let gain = found.numerator.last().copied().unwrap_or(0.0);
    let before = poles.len();
    let size = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    zeros.retain(|zero| {
        let near = |pole: &ct_lti::Complex64| (pole - zero).norm() <= CANCELS * size;
        match poles.iter().position(near) {
            Some(at) => {
                poles.swap_remove(at);
                false
            }
            None => true,
        }
    });
    if poles.len() == before {
        return Ok(found);
    }
    let of = |roots: &[ct_lti::Complex64], scale: f64| -> Result<Vec<f64>, Error> {
        let polynomial = ct_lti::Polynomial::from_roots(roots, scale)?;
        Ok(polynomial.coefficients().to_vec())
    };
    Ok(TransferFunction {
        numerator: of(&zeros, gain)?,
        denominator: of(&poles, 1.0)?,
    })
}

impl OwnTransferFunction {
    /// n and m.
    fn order(&self) -> (usize, usize) {
        (self.a.len() - 1, self.b.len() - 1)
    }

    /// Text that compares the model with the identified one: name, value and standard error of each coefficient.
    pub fn said(&self, found: Option<(Order, &[missing_effect::Parameter])>, look: Look) -> String {
        let title = format!(
            "{}: its own transfer function from {} to {}, with the values of its text and [known]",
            self.model, self.input, self.output
        );
        let mut text = format!("\n{}\n", look.heading(&title));
        let (n, m) = self.order();
        let integrates = self.a[0] == 0.0;
        let a = self.a.iter().enumerate().skip(1);
        let a = a.map(|(i, value)| (format!("a{i}"), *value));
        let b = self
            .b
            .iter()
            .enumerate()
            .map(|(j, value)| (format!("b{j}"), *value));
        let head = ["coefficient", "of the model", "identified", ""];
        let mut rows = vec![head.map(|name| look.faint(name)).to_vec()];
        for (name, value) in a.chain(b) {
            let identified = found.and_then(|(_, all)| all.iter().find(|p| p.name == name));
            let (found, unit) = match identified {
                None => ("-".to_string(), String::new()),
                Some(parameter) => {
                    let value = numbers::with_error(parameter.value, parameter.std_error);
                    (value, parameter.unit.clone())
                }
            };
            rows.push(vec![name, numbers::significant(value, 5), found, unit]);
        }
        let sides = [Side::Left, Side::Right, Side::Left, Side::Left];
        text += &table_text(&sides, &rows);
        let mut notes = Vec::new();
        if let Some((order, _)) = found
            && (order.n, order.m) != (n, m)
        {
            notes.push(format!(
                "the model is of order {n},{m}: --order {n},{m} compares coefficient by coefficient"
            ));
        }
        if integrates {
            notes.push(
                "the model integrates: --method srivc --integrator identifies such a one"
                    .to_string(),
            );
        }
        if !self.others.is_empty() {
            notes.push(format!(
                "{} {} not used as an input: the identified model is right only if {} constant",
                self.others.join(", "),
                if self.others.len() == 1 { "is" } else { "are" },
                if self.others.len() == 1 {
                    "it is"
                } else {
                    "they are"
                },
            ));
        }
        for note in notes {
            text += &look.paragraph("  ", &note);
        }
        text
    }
}
