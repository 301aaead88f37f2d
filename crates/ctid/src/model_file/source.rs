//! The file being read: what is wrong in it is said with its line.

use plants::{Known, Plant};
use toml::Spanned;

use super::raw::{Number, RawKnown};
use crate::{Error, names};

/// The file being read: it knows its lines.
pub(super) struct Source<'a> {
    pub(super) file: &'a str,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// An error at a byte of the text.
    pub(super) fn at(&self, byte: usize, what: impl Into<String>) -> Error {
        Error::AtLine {
            file: self.file.to_string(),
            line: 1 + self.text.bytes().take(byte).filter(|&b| b == b'\n').count(),
            what: what.into(),
        }
    }

    /// What the parser refuses, in one line, with the key that was probably meant.
    pub(super) fn syntax(&self, error: &toml::de::Error) -> Error {
        let mut what = error.message().trim().replace('\n', "; ");
        if let Some(rest) = what.strip_prefix("unknown field `") {
            let mut names = rest.split('`').step_by(2);
            let written = names.next().unwrap_or_default();
            let known: Vec<&str> = rest.split('`').skip(2).step_by(2).collect();
            what = format!(
                "unknown key {written}: one of {} may stand here{}",
                known.join(", "),
                names::suggestion(written, known.iter().copied())
            );
        } else if let Some((_, rest)) = what.split_once("unknown variant `") {
            what = format!("unknown word `{rest}");
        } else if let Some(word) = what
            .strip_prefix("invalid type: string ")
            .and_then(|rest| rest.strip_suffix(", expected a sequence"))
        {
            let start = error.span().map_or(0, |span| span.start);
            let before = self.text.get(..start).unwrap_or_default();
            let line = before.rsplit('\n').next().unwrap_or_default();
            let key = line.split('=').next().unwrap_or_default().trim();
            what = format!("{key} is a list; write {key} = [{word}]");
        } else if toml::from_str::<toml::Table>(self.text).is_err() {
            // what is wrong is the writing, not what it says
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
                "unknown plant \"{name_text}\": take one of {all}{}",
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
            format!("{key} = {value} is not a finite number; give one, or delete the line"),
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
            format!("{key} = {value} has to be above zero; correct it, or delete the line where it is not known"),
        ))
    }

    pub(super) fn known(&self, plant: Plant, raw: &RawKnown) -> Result<Known, Error> {
        let id = plant.id();
        let two = plant.vessels() > 1;
        let foreign = if two {
            vec![("area", &raw.area)]
        } else {
            vec![
                ("area_upper", &raw.area_upper),
                ("area_lower", &raw.area_lower),
            ]
        };
        for (key, number) in foreign {
            let Some(number) = number else { continue };
            let mend = if two {
                "has two vessels; write area_upper and area_lower"
            } else {
                "has one vessel; write area"
            };
            let what = format!("plant {id} {mend} instead of {key}");
            return Err(self.at(number.span().start, what));
        }
        let take = |key: &str, number: &Option<Spanned<Number>>| {
            number.as_ref().map(|n| self.positive(key, n)).transpose()
        };
        if let (Some(only), None) | (None, Some(only)) = (&raw.area_upper, &raw.area_lower) {
            return Err(self.at(
                only.span().start,
                "one area alone does not say how the levels compare; give both area_upper and area_lower, or neither",
            ));
        }
        let area = if two {
            [
                take("area_upper", &raw.area_upper)?,
                take("area_lower", &raw.area_lower)?,
            ]
        } else {
            [take("area", &raw.area)?, None]
        };
        Ok(Known {
            area,
            tank_height: take("tank_height", &raw.tank_height)?,
            input_range: take("input_range", &raw.input_range)?,
        })
    }
}
