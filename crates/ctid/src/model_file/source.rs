//! The file being read: errors contain their line.

mod known;

use ct_signals::{Columns, quoted, shown};
use plants::{Known, Plant};
use toml::Spanned;

use self::known::disturbed;
use super::raw::Number;
use crate::{Error, names};

/// The file being read, with its line numbers.
pub(crate) struct Source<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
}

impl Source<'_> {
    /// An error at a byte of the text.
    pub(crate) fn at(&self, byte: usize, what: impl Into<String>) -> Error {
        Error::AtLine {
            file: self.file.to_string(),
            line: self.line_of(byte),
            what: what.into(),
        }
    }

    /// The line of a byte of the text, the first one is 1.
    pub(crate) fn line_of(&self, byte: usize) -> usize {
        1 + self.text.bytes().take(byte).filter(|&b| b == b'\n').count()
    }

    /// The parser's error in one line, with the key that was probably meant.
    pub(crate) fn syntax(&self, error: &toml::de::Error) -> Error {
        // Words of the file are between backquotes.
        let parts = error.message().trim().split('`').enumerate();
        let parts = parts.map(|(i, part)| {
            if i % 2 == 1 {
                quoted(part)
            } else {
                part.replace('\n', "; ")
            }
        });
        let mut what = parts.collect::<Vec<_>>().join("`");
        if let Some(rest) = what.strip_prefix("unknown field `") {
            let mut names = rest.split('`').step_by(2);
            let written = names.next().unwrap_or_default();
            let known: Vec<&str> = rest.split('`').skip(2).step_by(2).collect();
            what = format!(
                "unknown key {}: one of {} may stand here{}",
                quoted(written),
                known.join(", "),
                names::suggestion(written, known.iter().copied())
            );
        } else if let Some((_, rest)) = what.split_once("unknown variant `") {
            // The only key with a fixed list of words that is not checked later.
            let word = rest.split('`').next().unwrap_or_default();
            what = format!(
                "hold = \"{}\" is not known; write hold = \"zero\" (the command is held between rows) or hold = \"first\" (a straight line between rows)",
                quoted(word)
            );
        } else if let Some(word) = what
            .strip_prefix("invalid type: string ")
            .and_then(|rest| rest.strip_suffix(", expected a sequence"))
        {
            let line = self.line(error);
            let key = quoted(line.split('=').next().unwrap_or_default().trim());
            let word = quoted(word);
            what = format!("{key} is a list; write {key} = [{word}]");
        } else if let Some(mend) = number_with_more(self.line(error)) {
            what = format!("numbers without a unit and with a decimal point: {mend}");
        } else if toml::from_str::<toml::Table>(self.text).is_err() {
            // the notation is wrong, not the content
            what += "; write `key = value`, words in quotes, numbers without quotes and without a unit, each key once";
        }
        let Some(span) = error.span() else {
            return Error::File {
                file: self.file.to_string(),
                what,
            };
        };
        self.at(span.start, what)
    }

    /// The line of a parser error.
    fn line(&self, error: &toml::de::Error) -> &str {
        let start = error.span().map_or(0, |span| span.start);
        let (before, behind) = self.text.split_at_checked(start).unwrap_or_default();
        let begin = before.rfind('\n').map_or(0, |at| at + 1);
        let end = start + behind.find('\n').unwrap_or(behind.len());
        self.text.get(begin..end).unwrap_or_default()
    }

    pub(super) fn plant(&self, name: Option<&Spanned<String>>) -> Result<Plant, Error> {
        let ids = || Plant::ALL.into_iter().map(Plant::id);
        let all = ids().collect::<Vec<_>>().join(", ");
        let Some(name) = name else {
            return Err(Error::File {
                file: self.file.to_string(),
                what: format!("no plant is named; write plant = \"...\" first, with one of {all}"),
            });
        };
        name.as_ref().parse().map_err(|_| {
            let name_text = name.as_ref();
            let what = format!(
                "unknown plant \"{}\": take one of {all}{}",
                quoted(name_text),
                names::suggestion(name_text, ids())
            );
            self.at(name.span().start, what)
        })
    }

    /// A finite number.
    pub(super) fn finite(&self, key: &str, number: &Spanned<Number>) -> Result<f64, Error> {
        let value = number.as_ref().value();
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.at(
            number.span().start,
            format!(
                "{key} = {} is not a finite number; give one, or delete the line",
                shown(value)
            ),
        ))
    }

    /// A finite number above zero.
    pub(super) fn positive(&self, key: &str, number: &Spanned<Number>) -> Result<f64, Error> {
        let value = self.finite(key, number)?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.at(
            number.span().start,
            format!("{key} = {} has to be above zero; correct it, or delete the line if the value is not known", shown(value)),
        ))
    }

    /// A second input is for a plant with a second pump, or a measured disturbance.
    pub(super) fn check_input_2(
        &self,
        plant: Plant,
        columns: &Columns,
        (known, disturbance): (&Known, Option<&Spanned<String>>),
    ) -> Result<(), Error> {
        let most = plant.pumps() + usize::from(known.disturbance.is_some());
        if known.disturbance.is_some() && columns.inputs.len() < most {
            return Err(self.at(
                disturbance.map_or(0, |word| word.span().start),
                "[known] says where a measured disturbance flows in, but [columns] names no column for it; write input_2 = \"...\", or delete disturbance",
            ));
        }
        if columns.inputs.len() <= most {
            return Ok(());
        }
        if plant.pumps() == 1 && columns.inputs.len() == 2 {
            return Err(self.at(
                self.text.find("input_2").or(self.text.find("input")).unwrap_or(0),
                format!(
                    "plant {} has one pump; where the second input is a measured disturbance, write under [known] where it flows in: disturbance = {}; else delete input_2, or take plant = \"three-tank\"",
                    plant.id(),
                    disturbed(plant).join(" or ")
                ),
            ));
        }
        let at = self.text.find("input_2").or(self.text.find("input"));
        let pumps = match plant.pumps() {
            1 => "one pump",
            _ => "two pumps",
        };
        Err(self.at(
            at.unwrap_or(0),
            format!("plant {} has {pumps}; delete the others", plant.id()),
        ))
    }
}

/// The probably intended line, if its value begins as a number and has a unit or a decimal comma.
fn number_with_more(line: &str) -> Option<String> {
    let (key, value) = line.split_once('=')?;
    let word = value.split_whitespace().next()?;
    let begins = word.trim_start_matches(['+', '-']);
    if !begins.starts_with(|c: char| c.is_ascii_digit())
        || toml::from_str::<toml::Table>(line).is_ok()
    {
        return None;
    }
    let key = quoted(key.trim());
    // 1,000.0 may be a thousand, or a typing error.
    if word.matches([',', '.']).count() > 1 {
        return Some(format!("{key} = 154.0, say"));
    }
    let point = word.replace(',', ".");
    let number = (1..=point.len())
        .rev()
        .find_map(|end| point.get(..end)?.parse::<f64>().ok())?;
    Some(format!("{key} = {number:?}"))
}
