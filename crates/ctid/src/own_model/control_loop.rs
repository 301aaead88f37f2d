//! The loop of a user's own model: its controllers with the times of the records, their references, and what is said of it.

use ct_signals::{Channel, Columns, Heading, ReadSummary, Record};
use effect_search::{ControlLoop, NotSimulated};
use greybox::LoopController;

use super::controller::OwnController;
use super::file::{OwnModelFile, Records, convert};
use crate::look::Look;
use crate::sentences::of_the_loop;
use crate::{Error, MessageNames};

impl OwnModelFile {
    /// The columns of the controllers' references.
    pub fn references(&self) -> impl Iterator<Item = &String> {
        let controllers = self.controllers.iter();
        controllers.filter_map(|own| own.reference.as_ref())
    }

    /// Columns of a record that is fitted, with the references of the controllers: those that the record has and that are no signals of the
    /// model.
    pub fn columns_of_fit(&self, headings: &[Heading]) -> Columns {
        let mut columns = self.columns.clone();
        let has = |column: &String| {
            let name = Heading::of(column).name;
            headings.iter().any(|heading| heading.name == name)
        };
        for column in self.references() {
            let signals = columns.inputs.iter().chain(&columns.outputs);
            let mut known = signals.chain(&columns.references);
            if has(column) && !known.any(|own| own == column) {
                columns.references.push(column.clone());
            }
        }
        columns
    }

    /// The references of a record in the order of the controllers that have one, in the units of the outputs; none if the record lacks one.
    /// The channels of the record have the names of their columns.
    ///
    /// # Errors
    /// Where a column is in a unit of another dimension.
    pub(super) fn references_of(
        &self,
        record: &Record,
        summary: &mut ReadSummary,
    ) -> Result<Vec<Channel>, Error> {
        let spec = self.model.spec();
        let mut references = Vec::new();
        for own in &self.controllers {
            let Some(column) = &own.reference else {
                continue;
            };
            let name = Heading::of(column).name;
            let channels = record.references.iter().chain(&record.inputs);
            let mut channels = channels.chain(&record.outputs);
            let Some(channel) = channels.find(|channel| channel.name == name) else {
                return Ok(Vec::new());
            };
            let mut channel = channel.clone();
            let about = spec.about(spec.outputs[own.output].variable);
            convert(summary, &mut channel, about)?;
            channel.name = name;
            references.push(channel);
        }
        Ok(references)
    }

    /// Controllers with the times of the records, in seconds. The references are in the order of the controllers that have one.
    ///
    /// # Errors
    /// Where a controller cannot be sampled at the interval of the records, with its line.
    pub fn loop_controllers(&self, records: &Records) -> Result<Vec<LoopController>, Error> {
        let intervals = records.records.iter().map(Record::sample_interval);
        let interval = intervals.fold(0.0, f64::max);
        let mut references = 0..;
        let one = |own: &OwnController| {
            let controller = own.in_seconds(records.time_unit).controller(interval);
            let controller = controller.map_err(|error| Error::AtLine {
                file: self.name.clone(),
                line: own.line,
                what: format!("[{}]: {error}", own.table),
            })?;
            Ok(LoopController {
                controller: controller.at_output(own.output),
                input: own.input,
                reference: own.reference.as_ref().and_then(|_| references.next()),
            })
        };
        self.controllers.iter().map(one).collect()
    }

    /// What a result says of the loop of its records.
    pub fn loop_sentence(&self, known: &ControlLoop, names: &MessageNames) -> String {
        let driven = self.controllers.first().map(|controller| controller.input);
        let unit = driven.map_or("", |input| self.base.inputs[input].about.unit.as_str());
        let known = self.in_words_of_the_text(known);
        of_the_loop(&known, unit, names)
    }

    /// With the output's name in place of the flow that an effect of the reading inserts.
    fn in_words_of_the_text(&self, known: &ControlLoop) -> ControlLoop {
        let mut known = known.clone();
        if let Some(NotSimulated::HardNonlinearity { of }) = &mut known.not_simulated
            && let Some(output) = of.strip_suffix("_true")
            && self.base.find(of).is_none()
        {
            *of = output.to_string();
        }
        known
    }

    /// Warning of a command that does not simulate the loop although the file declares a controller; empty if it declares none.
    pub fn loop_said(&self, look: Look) -> String {
        if self.controllers.is_empty() {
            return String::new();
        }
        let controllers = self.controllers.iter();
        let tables = controllers.clone().map(|own| format!("[{}]", own.table));
        let inputs = controllers.map(|own| self.base.inputs[own.input].about.name.clone());
        let note = format!(
            "note: {}: the loop is not simulated here, the model runs on the measured {}",
            tables.collect::<Vec<_>>().join(", "),
            inputs.collect::<Vec<_>>().join(", ")
        );
        look.paragraph("", &note)
    }
}
