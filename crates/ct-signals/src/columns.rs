//! Which column of a file is the time, the input, the output and the reference.
//!
//! A column that is named is looked for by its whole header first, then by its name without the
//! unit. A unit that the file gives must be the one that the model gives, where both do. A column
//! that is not named is guessed from the letter that control engineers give it: `t`, `u`, `y`, `r`. The second input is never
//! guessed: whether there is one is for the model to say.

use serde::{Deserialize, Serialize};

use crate::{ColumnFault, Error, quoted, unit};

/// The names of the columns, as `[columns]` of a model file gives them; what is absent is guessed.
///
/// A unit may follow in brackets: `y [cm]`, `y (cm)`, or as a suffix: `y_cm`.
#[derive(Deserialize, Serialize, Default, Clone, Debug, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct Columns {
    /// Sampling instants, in us, ms, s, min, h or d; without a unit in s. Guessed: `t...`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// The command to the actuator. Guessed: `u...`, `input`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// The command to a second actuator, of a plant that has two; not guessed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_2: Option<String>,
    /// The sensor's reading. Guessed: `y...`, `output`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<String>,
    /// The set point. Guessed: `r`, `r_...`, `ref`, `reference`, `setpoint`; may be missing when
    /// it is not named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
}

/// What stands above a column.
#[derive(Serialize, Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// All of it.
    pub header: String,
    /// Without the unit.
    pub name: String,
    /// The unit; empty where the header does not say.
    pub unit: String,
}

impl Heading {
    pub(crate) fn of(header: &str) -> Self {
        let (name, unit) = unit::split(header);
        Self {
            header: header.into(),
            name: name.into(),
            unit: unit.into(),
        }
    }
}

/// One column that was found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    pub index: usize,
    pub header: String,
    pub name: String,
    pub unit: String,
}

/// Where everything is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    pub time: Found,
    /// Seconds in one unit of the time column.
    pub seconds: f64,
    pub input: Found,
    pub input_2: Option<Found>,
    pub output: Found,
    pub reference: Option<Found>,
}

/// What is looked for: a role and the words it goes by.
struct Role {
    name: &'static str,
    letter: char,
    words: &'static [&'static str],
}

const TIME: Role = Role {
    name: "time",
    letter: 't',
    words: &["t", "time", "timestamp"],
};
const INPUT: Role = Role {
    name: "input",
    letter: 'u',
    words: &["u", "input"],
};
const INPUT_2: Role = Role {
    name: "input_2",
    letter: 'u',
    words: &[],
};
const OUTPUT: Role = Role {
    name: "output",
    letter: 'y',
    words: &["y", "output"],
};
const REFERENCE: Role = Role {
    name: "reference",
    letter: 'r',
    words: &["r", "ref", "reference", "setpoint"],
};

/// A header row with its place, for messages.
struct Header<'a> {
    file: &'a str,
    row: u64,
    names: &'a [String],
}

impl Columns {
    /// The header of the time as a file that goes with these columns has it, with its unit, and the seconds in that; `t [s]`
    /// where none is named, or its unit is none of the time.
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

    /// The columns that would be taken where none is named; what is not plain is left out.
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
            input: guess(&INPUT),
            // A second command is one only where it is named.
            input_2: None,
            output: guess(&OUTPUT),
            reference: guess(&REFERENCE),
        }
    }

    /// Finds the columns in a header row (`row` is its line number).
    pub(crate) fn resolve(
        &self,
        file: &str,
        row: u64,
        headers: &[String],
    ) -> Result<Layout, Error> {
        let header = Header {
            file,
            row,
            names: headers,
        };
        // The named ones first, so that none of them is guessed for another role.
        let named = |role: &Role, wanted: &Option<String>| {
            wanted
                .as_deref()
                .map(|wanted| header.named(role, wanted))
                .transpose()
        };
        let time = named(&TIME, &self.time)?;
        let input = named(&INPUT, &self.input)?;
        let input_2 = named(&INPUT_2, &self.input_2)?;
        let output = named(&OUTPUT, &self.output)?;
        let reference = named(&REFERENCE, &self.reference)?;

        let mut taken: Vec<(usize, &'static str)> = Vec::new();
        for (role, column) in [
            (TIME, &time),
            (INPUT, &input),
            (INPUT_2, &input_2),
            (OUTPUT, &output),
            (REFERENCE, &reference),
        ] {
            let Some(column) = column else { continue };
            if let Some((_, first)) = taken.iter().find(|(index, _)| *index == column.index) {
                return Err(header.fault(ColumnFault::Shared {
                    column: quoted(&column.header),
                    first,
                    second: role.name,
                }));
            }
            taken.push((column.index, role.name));
        }

        let needed = |role: &Role, column: Option<Found>| match column {
            Some(column) => Ok(column),
            None => header
                .guess(role, &taken)?
                .ok_or_else(|| header.missing(role, None)),
        };
        let time = needed(&TIME, time)?;
        let input = needed(&INPUT, input)?;
        let output = needed(&OUTPUT, output)?;
        // Nobody has to have a reference: where it is not plain which column it is, there is none.
        let reference = reference.or_else(|| header.guess(&REFERENCE, &taken).ok().flatten());
        let seconds = unit::seconds(&time.unit).ok_or_else(|| Error::UnknownTimeUnit {
            file: file.into(),
            row,
            column: quoted(&time.header),
            unit: quoted(&time.unit),
        })?;
        Ok(Layout {
            time,
            seconds,
            input,
            input_2,
            output,
            reference,
        })
    }
}

impl Header<'_> {
    fn named(&self, role: &Role, wanted: &str) -> Result<Found, Error> {
        let wanted = wanted.trim();
        let exact: Vec<usize> = self.indices(|header| header == wanted);
        match exact[..] {
            [index] => {
                let (_, unit) = unit::split(wanted);
                return Ok(self.found(index, unit));
            }
            [_, _, ..] => return Err(self.ambiguous(role, &exact)),
            [] => {}
        }
        let (name, model_unit) = unit::split(wanted);
        // The unit that the file gives: none where the header is, as a whole, the model's name.
        let file_unit = |header: &str| {
            if header == name {
                String::new()
            } else {
                unit::split(header).1.to_string()
            }
        };
        let by_name = self.indices(|header| header == name || unit::split(header).0 == name);
        let index = match by_name[..] {
            [] => return Err(self.missing(role, Some(wanted))),
            [index] => index,
            _ => {
                let same_unit: Vec<usize> = by_name
                    .iter()
                    .copied()
                    .filter(|&index| unit::same(&file_unit(&self.names[index]), model_unit))
                    .collect();
                match same_unit[..] {
                    [index] => index,
                    _ => return Err(self.ambiguous(role, &by_name)),
                }
            }
        };
        let file_unit = file_unit(&self.names[index]);
        if !file_unit.is_empty() && !model_unit.is_empty() && !unit::same(&file_unit, model_unit) {
            return Err(self.fault(ColumnFault::Unit {
                column: quoted(&self.names[index]),
                file_unit: quoted(&file_unit),
                named_unit: quoted(model_unit),
            }));
        }
        if !file_unit.is_empty() {
            Ok(self.found(index, &file_unit))
        } else {
            Ok(self.found(index, model_unit))
        }
    }

    /// The column whose name is one of the role's words; else whose name begins with such a word
    /// and an underscore; else, except for the reference, whose name begins with the letter.
    fn guess(&self, role: &Role, taken: &[(usize, &'static str)]) -> Result<Option<Found>, Error> {
        let lower = |header: &str| unit::split(header).0.to_lowercase();
        let is_word = |name: &str| role.words.contains(&name);
        let tiers: [&dyn Fn(&str) -> bool; 3] = [
            &|header| is_word(&lower(header)),
            &|header| {
                let name = lower(header);
                let first = name.split(['_', ' ', '.']).next().unwrap_or_default();
                is_word(first.trim_end_matches(|c: char| c.is_ascii_digit()))
            },
            &|header| role.name != REFERENCE.name && lower(header).starts_with(role.letter),
        ];
        for tier in tiers {
            let mut fits = self.indices(tier);
            fits.retain(|index| taken.iter().all(|(other, _)| other != index));
            match fits[..] {
                [] => {}
                [index] => return Ok(Some(self.found(index, unit::split(&self.names[index]).1))),
                _ => return Err(self.ambiguous(role, &fits)),
            }
        }
        Ok(None)
    }

    fn indices(&self, fits: impl Fn(&str) -> bool) -> Vec<usize> {
        (0..self.names.len())
            .filter(|&index| fits(&self.names[index]))
            .collect()
    }

    fn found(&self, index: usize, unit: &str) -> Found {
        let header = self.names[index].clone();
        // A header that ends in its unit loses it; otherwise all of it is the name.
        let name = match unit::split(&header) {
            (name, own) if !own.is_empty() && unit::same(own, unit) => name.to_string(),
            _ => header.clone(),
        };
        Found {
            index,
            header,
            name,
            unit: unit.into(),
        }
    }

    fn missing(&self, role: &Role, wanted: Option<&str>) -> Error {
        self.fault(ColumnFault::Missing {
            role: role.name,
            wanted: match wanted {
                Some(wanted) => format!("\"{}\"", quoted(wanted)),
                None => format!("beginning with \"{}\"", role.letter),
            },
            columns: list(self.names.iter()),
            closest: wanted.and_then(|wanted| Some(quoted(closest(wanted, self.names)?))),
        })
    }

    fn ambiguous(&self, role: &Role, indices: &[usize]) -> Error {
        self.fault(ColumnFault::Ambiguous {
            role: role.name,
            candidates: list(indices.iter().map(|&index| &self.names[index])),
        })
    }

    fn fault(&self, fault: ColumnFault) -> Error {
        Error::Column {
            file: self.file.into(),
            row: self.row,
            fault: Box::new(fault),
        }
    }
}

/// Names as messages list them: the first ones.
fn list<'a>(names: impl Iterator<Item = &'a String>) -> String {
    const MOST: usize = 12;
    let mut names = names.map(|name| format!("\"{}\"", quoted(name)));
    let first: Vec<String> = names.by_ref().take(MOST).collect();
    match names.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// The header whose name is fewest edits away, when that is at most half of the name.
fn closest<'a>(wanted: &str, headers: &'a [String]) -> Option<&'a String> {
    let wanted = unit::split(wanted).0.to_lowercase();
    headers
        .iter()
        .map(|header| {
            (
                edits(&wanted, &unit::split(header).0.to_lowercase()),
                header,
            )
        })
        .filter(|(edits, _)| 2 * edits <= wanted.chars().count())
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, header)| header)
}

/// Insertions, deletions and replacements that lead from `a` to `b` (Levenshtein's distance).
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
