//! The columns of a header: found by their names, or guessed.

use super::Found;
use crate::{ColumnFault, Error, ReadError, quoted, unit};

/// A role, and the words that name it.
pub(super) struct Role {
    pub(super) name: &'static str,
    letter: char,
    words: &'static [&'static str],
}

pub(super) const TIME: Role = Role {
    name: "time",
    letter: 't',
    words: &["t", "time", "timestamp", "date", "datetime"],
};

pub(super) const INPUT: Role = Role {
    name: "input",
    letter: 'u',
    words: &["u", "input"],
};

pub(super) const OUTPUT: Role = Role {
    name: "output",
    letter: 'y',
    words: &["y", "output"],
};

pub(super) const REFERENCE: Role = Role {
    name: "reference",
    letter: 'r',
    words: &["r", "ref", "reference", "setpoint"],
};

/// A header row with its place, for messages.
pub(super) struct Header<'a> {
    pub(super) file: &'a str,
    pub(super) row: u64,
    pub(super) names: &'a [String],
}

impl Header<'_> {
    /// Whether no column has this name.
    pub(super) fn lacks(&self, role: &Role, wanted: &str) -> bool {
        self.named(role, wanted)
            .is_err_and(|error| error.lacks_a_column())
    }

    pub(super) fn named(&self, role: &Role, wanted: &str) -> Result<Found, Error> {
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
        // A name with brackets that are no unit: `T (inlet)` of `T (inlet) [degC]`.
        let whole = self.indices(|header| {
            unit::split_bracket(header)
                .is_some_and(|(name, unit)| name == wanted && !unit.is_empty())
        });
        if let [index] = whole[..] {
            let (_, unit) = unit::split(&self.names[index]);
            return Ok(self.found(index, unit));
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
        let mut found = self.found(
            index,
            if file_unit.is_empty() {
                model_unit
            } else {
                &file_unit
            },
        );
        if file_unit.is_empty() || model_unit.is_empty() || unit::same(&file_unit, model_unit) {
            return Ok(found);
        }
        // A unit of time is converted with the rest of the column.
        if role.name == TIME.name && unit::seconds(&file_unit).is_some() {
            return Ok(found);
        }
        let conversion = unit::conversion(&file_unit, model_unit).ok_or_else(|| {
            self.fault(ColumnFault::Unit {
                column: quoted(&self.names[index]),
                file_unit: quoted(&file_unit),
                named_unit: quoted(model_unit),
            })
        })?;
        found.unit = model_unit.into();
        found.converted = Some((file_unit, conversion));
        Ok(found)
    }

    /// The column whose name is one of the role's words; else whose name begins with such a word
    /// and an underscore; else, except for the reference, whose name begins with the letter.
    pub(super) fn guess(
        &self,
        role: &Role,
        taken: &[(usize, &'static str)],
    ) -> Result<Option<Found>, Error> {
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
            converted: None,
        }
    }

    pub(super) fn missing(&self, role: &Role, wanted: Option<&str>) -> Error {
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

    pub(super) fn fault(&self, fault: ColumnFault) -> Error {
        Error::Read(ReadError::Column {
            file: self.file.into(),
            row: self.row,
            fault: Box::new(fault),
        })
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
            let name = unit::split(header).0.to_lowercase();
            (strsim::levenshtein(&wanted, &name), header)
        })
        .filter(|(edits, _)| 2 * edits <= wanted.chars().count())
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, header)| header)
}
