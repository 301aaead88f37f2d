//! Which column of a file is the time, the input, the output and the reference.
//!
//! A column that is named is looked for by its whole header first, then by its name without the
//! unit. A unit that the file gives is converted to the one that the model gives, where both do. A column
//! that is not named is guessed from the letter that control engineers give it: `t`, `u`, `y`, `r`. A second input or output is never
//! guessed: whether there is one is for the model to say.

mod header;

use serde::{Deserialize, Serialize};

use self::header::{Header, INPUT, OUTPUT, REFERENCE, Role, TIME};
use crate::{ColumnFault, Error, ReadError, Zone, quoted, unit, unit::Conversion};

/// The names of the columns, as `[columns]` of a model file gives them; what is absent is guessed.
///
/// A unit may follow in brackets: `y [cm]`, `y (cm)`, or as a suffix: `y_cm`. Where the file has another unit of the same dimension,
/// its values are converted.
#[derive(Deserialize, Serialize, Default, Clone, Debug, PartialEq)]
#[serde(from = "Named", into = "Named")]
pub struct Columns {
    /// Sampling instants, in us, ms, s, min, h or d, without a unit in s; or dates and times. Guessed: `t...`.
    pub time: Option<String>,
    /// The commands to the actuators and the measured disturbances. Guessed, one: `u...`, `input`; so is a first one that is empty.
    pub inputs: Vec<String>,
    /// The sensors' readings. Guessed, one: `y...`, `output`.
    pub outputs: Vec<String>,
    /// The set points. Guessed, one: `r`, `r_...`, `ref`, `reference`, `setpoint`; may be missing when none is named.
    pub references: Vec<String>,
    /// Format of dates and times in the notation of `strftime`: `%d.%m.%Y %H:%M:%S`. Without it the format is found from the column.
    pub time_format: Option<String>,
    /// Zone of dates without a zone: `Europe/Berlin`, `UTC`, `+01:00`. Default UTC.
    pub time_zone: Option<String>,
    /// Words and numbers that mark a missing sample, in addition to the usual ones: `-999`, `Offline`.
    pub missing: Vec<String>,
    /// The model has no inputs: none is guessed. It follows from the model and is not written down.
    pub without_inputs: bool,
}

/// A column name as a model file writes it: one name or a list of names.
#[derive(Deserialize, Serialize, Default)]
#[serde(deny_unknown_fields, default)]
struct Named {
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    input: Option<Names>,
    #[serde(skip_serializing_if = "Option::is_none")]
    input_2: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<Names>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<Names>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_format: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none", deserialize_with = "zone")]
    time_zone: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    missing: Vec<String>,
}

/// Reads the name of an existing zone.
fn zone<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<String>, D::Error> {
    let name = Option::<String>::deserialize(deserializer)?;
    if let Some(name) = &name {
        Zone::named(name).map_err(serde::de::Error::custom)?;
    }
    Ok(name)
}

#[derive(Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "a column's name in quotes, such as \"y [cm]\", or a list of them"
)]
enum Names {
    One(String),
    Several(Vec<String>),
}

impl Names {
    fn of(mut names: Vec<String>) -> Option<Self> {
        match names.len() {
            0 => None,
            1 => names.pop().map(Self::One),
            _ => Some(Self::Several(names)),
        }
    }

    fn all(names: Option<Self>) -> Vec<String> {
        match names {
            None => Vec::new(),
            Some(Self::One(name)) => vec![name],
            Some(Self::Several(names)) => names,
        }
    }
}

impl From<Named> for Columns {
    fn from(named: Named) -> Self {
        let mut inputs = Names::all(named.input);
        if let Some(second) = named.input_2 {
            // The first one is guessed where only the second is named.
            if inputs.is_empty() {
                inputs.push(String::new());
            }
            inputs.push(second);
        }
        Self {
            time: named.time,
            inputs,
            outputs: Names::all(named.output),
            references: Names::all(named.reference),
            time_format: named.time_format,
            time_zone: named.time_zone,
            missing: named.missing,
            without_inputs: false,
        }
    }
}

impl From<Columns> for Named {
    fn from(mut columns: Columns) -> Self {
        // Two have names of their own.
        let input_2 = (columns.inputs.len() == 2).then(|| columns.inputs.remove(1));
        columns.inputs.retain(|name| !name.is_empty());
        Self {
            time: columns.time,
            input: Names::of(columns.inputs),
            input_2,
            output: Names::of(columns.outputs),
            reference: Names::of(columns.references),
            time_format: columns.time_format,
            time_zone: columns.time_zone,
            missing: columns.missing,
        }
    }
}

/// The header of a column.
#[derive(Serialize, Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// The whole header.
    pub header: String,
    /// The header without the unit.
    pub name: String,
    /// The unit; empty if the header has none.
    pub unit: String,
}

impl Heading {
    /// Splits a header.
    #[must_use]
    pub fn of(header: &str) -> Self {
        let (name, unit) = unit::split(header);
        Self {
            header: header.into(),
            name: name.into(),
            unit: unit.into(),
        }
    }
}

/// A column that was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    pub index: usize,
    pub header: String,
    pub name: String,
    /// The unit in which the values are wanted.
    pub unit: String,
    /// The file's unit and the conversion from it, where it is another one.
    pub converted: Option<(String, Conversion)>,
}

/// The position of every column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    pub time: Found,
    /// Seconds in one unit of the time column.
    pub seconds: f64,
    pub inputs: Vec<Found>,
    pub outputs: Vec<Found>,
    pub references: Vec<Found>,
    /// Named outputs that the file does not have, with their positions among the named ones; empty if outputs are required.
    pub absent: Vec<(usize, String)>,
}

/// Purpose of reading a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// A fit, which needs every output.
    Fit,
    /// A simulation on its inputs: outputs may be missing.
    Simulation,
}

impl Layout {
    /// The columns with values: inputs, outputs, references.
    pub fn channels(&self) -> impl Iterator<Item = &Found> {
        self.inputs
            .iter()
            .chain(&self.outputs)
            .chain(&self.references)
    }
}

impl Columns {
    /// Whether a column is named.
    #[must_use]
    pub fn names_any(&self) -> bool {
        let lists = [&self.inputs, &self.outputs, &self.references];
        self.time.is_some() || lists.iter().any(|names| !names.is_empty())
    }

    /// The unit that is given for the first output; empty where none is.
    #[must_use]
    pub fn output_unit(&self) -> &str {
        self.outputs
            .first()
            .map_or("", |output| unit::split(output).1)
    }

    /// Header of the time column for a new file with these columns, with its unit, and the unit in seconds; `t [s]` if no column is named,
    /// or if its unit is no unit of time.
    #[must_use]
    pub fn time_header(&self) -> (String, f64) {
        let named = self.time.as_deref().map(unit::split);
        let known = named.and_then(|(name, unit)| Some((name, unit, unit::seconds(unit)?)));
        match known {
            Some((name, "", seconds)) => (format!("{name} [s]"), seconds),
            Some((name, unit, seconds)) => (format!("{name} [{unit}]"), seconds),
            None => ("t [s]".to_string(), 1.0),
        }
    }

    /// The columns that are chosen without names; ambiguous ones are left out.
    #[must_use]
    pub fn guessed(headings: &[Heading]) -> Self {
        let names: Vec<String> = headings.iter().map(|h| h.header.clone()).collect();
        let header = Header {
            file: "",
            row: 0,
            names: &names,
        };
        let mut taken = Vec::new();
        let mut guess = |role: &Role| {
            let found = header.guess(role, &taken).ok().flatten()?;
            taken.push((found.index, role.name));
            Some(found.header)
        };
        Self {
            time: guess(&TIME),
            // A second one is one only where it is named.
            inputs: guess(&INPUT).into_iter().collect(),
            outputs: guess(&OUTPUT).into_iter().collect(),
            references: guess(&REFERENCE).into_iter().collect(),
            ..Self::default()
        }
    }

    /// Finds the columns in a header row (`row` is its line number).
    pub(crate) fn resolve(
        &self,
        file: &str,
        row: u64,
        headers: &[String],
        purpose: Purpose,
    ) -> Result<Layout, Error> {
        let header = Header {
            file,
            row,
            names: headers,
        };
        // The named ones first, so that none of them is guessed for another role.
        let named = |role: &Role, wanted: &[String]| {
            let wanted = wanted.iter().filter(|wanted| !wanted.is_empty());
            let found = wanted.map(|wanted| header.named(role, wanted));
            found.collect::<Result<Vec<Found>, Error>>()
        };
        let time: Vec<String> = self.time.iter().cloned().collect();
        let mut time = named(&TIME, &time)?;
        let mut inputs = named(&INPUT, &self.inputs)?;
        let mut absent = Vec::new();
        let mut wanted = Vec::new();
        for (at, output) in self.outputs.iter().enumerate() {
            let there = purpose == Purpose::Fit || !header.lacks(&OUTPUT, output);
            if there {
                wanted.push(output.clone());
            } else {
                absent.push((at, output.clone()));
            }
        }
        let mut outputs = named(&OUTPUT, &wanted)?;
        let mut references = named(&REFERENCE, &self.references)?;

        let mut taken: Vec<(usize, &'static str)> = Vec::new();
        let all = [
            (TIME, &time),
            (INPUT, &inputs),
            (OUTPUT, &outputs),
            (REFERENCE, &references),
        ];
        for (role, column) in all
            .iter()
            .flat_map(|(role, columns)| columns.iter().map(move |column| (role, column)))
        {
            if let Some((_, first)) = taken.iter().find(|(index, _)| *index == column.index) {
                return Err(header.fault(ColumnFault::Shared {
                    column: quoted(&column.header),
                    first,
                    second: role.name,
                }));
            }
            taken.push((column.index, role.name));
        }

        for (role, columns) in [
            (&TIME, &mut time),
            (&INPUT, &mut inputs),
            (&OUTPUT, &mut outputs),
        ] {
            let first_input = self.inputs.first().is_some_and(String::is_empty);
            let optional = role.name == OUTPUT.name && purpose == Purpose::Simulation;
            if role.name == INPUT.name && self.without_inputs {
                continue;
            }
            if optional && columns.is_empty() {
                if self.outputs.is_empty() {
                    columns.extend(header.guess(role, &taken).ok().flatten());
                }
                continue;
            }
            if columns.is_empty() || role.name == INPUT.name && first_input {
                let guessed = header.guess(role, &taken)?;
                columns.insert(0, guessed.ok_or_else(|| header.missing(role, None))?);
            }
        }
        let time = time.swap_remove(0);
        // A reference is optional: if several columns could be the reference, there is none.
        if references.is_empty() {
            references.extend(header.guess(&REFERENCE, &taken).ok().flatten());
        }
        let seconds = unit::seconds(&time.unit).ok_or_else(|| {
            Error::Read(ReadError::UnknownTimeUnit {
                file: file.into(),
                row,
                column: quoted(&time.header),
                unit: quoted(&time.unit),
            })
        })?;
        Ok(Layout {
            time,
            seconds,
            inputs,
            outputs,
            references,
            absent,
        })
    }
}
