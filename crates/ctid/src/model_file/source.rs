//! The file being read: what is wrong in it is said with its line.

use ct_signals::{Columns, quoted, shown};
use plants::{Known, MAX_VESSELS, Plant};
use toml::Spanned;

use super::raw::{Number, RawKnown, Words};
use crate::{Error, names};

/// The file being read: it knows its lines.
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

    /// What the parser refuses, in one line, with the key that was probably meant.
    pub(crate) fn syntax(&self, error: &toml::de::Error) -> Error {
        // Words of the file stand between backquotes.
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
            // The only key that takes one of some words without being looked at afterwards.
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

    /// The line that the parser refuses.
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
            format!("{key} = {} has to be above zero; correct it, or delete the line where it is not known", shown(value)),
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

    pub(super) fn known(
        &self,
        plant: Plant,
        raw: &RawKnown,
        outputs: usize,
    ) -> Result<Known, Error> {
        let id = plant.id();
        let of_one = [("area", &raw.area)];
        let of_two = [
            ("area_upper", &raw.area_upper),
            ("area_lower", &raw.area_lower),
        ];
        let of_three = [
            ("area_1", &raw.area_1),
            ("area_3", &raw.area_3),
            ("area_2", &raw.area_2),
            ("pipe_area", &raw.pipe_area),
            ("gravity", &raw.gravity),
        ];
        let (foreign, mend): (Vec<_>, _) = match plant.vessels() {
            1 => (
                of_two.iter().chain(&of_three).collect(),
                "has one vessel; write area",
            ),
            2 => (
                of_one.iter().chain(&of_three).collect(),
                "has two vessels; write area_upper and area_lower",
            ),
            _ => (
                of_two.iter().collect(),
                "has three tanks; write area, or area_1, area_2 and area_3,",
            ),
        };
        for (key, number) in foreign {
            let Some(number) = number else { continue };
            let what = if matches!(*key, "pipe_area" | "gravity") {
                format!("plant {id} has no joined tanks; delete {key}")
            } else {
                format!("plant {id} {mend} instead of {key}")
            };
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
        let area = match plant.vessels() {
            1 => [take("area", &raw.area)?, None, None],
            2 => [
                take("area_upper", &raw.area_upper)?,
                take("area_lower", &raw.area_lower)?,
                None,
            ],
            _ => self.areas_of_three(raw)?,
        };
        Ok(Known {
            area,
            measured: self.measured(plant, raw.measured.as_ref(), outputs)?,
            disturbance: self.disturbance(plant, raw.disturbance.as_ref())?,
            orifice: self.orifice(raw, area[0].is_some())?,
            tank_height: take("tank_height", &raw.tank_height)?,
            input_range: take("input_range", &raw.input_range)?,
        })
    }

    /// The areas of three tanks, as they stand: one for all, or each its own.
    fn areas_of_three(&self, raw: &RawKnown) -> Result<[Option<f64>; MAX_VESSELS], Error> {
        let each = [
            ("area_1", &raw.area_1),
            ("area_3", &raw.area_3),
            ("area_2", &raw.area_2),
        ];
        let given = each.iter().find_map(|(_, number)| number.as_ref());
        if let Some(area) = &raw.area {
            if let Some(own) = given {
                return Err(self.at(
                    own.span().start,
                    "area is that of all three tanks; give it, or area_1, area_2 and area_3, not both",
                ));
            }
            return Ok([Some(self.positive("area", area)?); MAX_VESSELS]);
        }
        let mut areas = [None; MAX_VESSELS];
        let Some(given) = given else {
            return Ok(areas);
        };
        for (area, (key, number)) in areas.iter_mut().zip(each) {
            let Some(number) = number else {
                return Err(self.at(
                    given.span().start,
                    format!("{key} is missing; give area_1, area_2 and area_3, or area where all are alike"),
                ));
            };
            *area = Some(self.positive(key, number)?);
        }
        Ok(areas)
    }

    /// The vessels whose levels are the outputs, in their order. Without a word it is the last one; of tanks that are joined, and of several
    /// outputs, it has to be said.
    fn measured(
        &self,
        plant: Plant,
        words: Option<&Spanned<Words>>,
        outputs: usize,
    ) -> Result<Vec<usize>, Error> {
        let names: Vec<&str> = (0..plant.vessels())
            .filter_map(|vessel| plant.vessel_name(vessel))
            .collect();
        let written = |names: &[&str]| {
            let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            quoted.join(", ")
        };
        if outputs > plant.vessels() {
            let what = format!(
                "[columns] names {outputs} outputs, but plant {} has {}; name a column for each level that is measured",
                plant.id(),
                match plant.vessels() {
                    1 => "one level".to_string(),
                    levels => format!("{levels} levels"),
                }
            );
            return Err(self.at(self.text.find("output").unwrap_or(0), what));
        }
        let Some(words) = words else {
            let what = if outputs > 1 {
                format!(
                    "[columns] names {outputs} outputs, but nothing says which levels they are; write measured = [{}] under [known], in the order of the outputs",
                    written(&names[..outputs])
                )
            } else if plant.joined() {
                format!(
                    "nothing says in which tank the level is measured; write measured = {} under [known]",
                    "\"T1\", \"T2\" or \"T3\""
                )
            } else {
                return Ok(Vec::new());
            };
            return Err(Error::File {
                file: self.file.to_string(),
                what,
            });
        };
        let at = words.span().start;
        let words = words.as_ref().all();
        if names.is_empty() {
            let what = format!("plant {} has one level; delete measured", plant.id());
            return Err(self.at(at, what));
        }
        let mut vessels: Vec<usize> = Vec::new();
        for word in words {
            let Some(vessel) = names.iter().position(|name| name == word) else {
                let what = format!(
                    "measured = \"{}\" is no tank; write one of {}",
                    quoted(word),
                    written(&names)
                );
                return Err(self.at(at, what));
            };
            if vessels.contains(&vessel) {
                let what = format!("measured names {word} twice; name each tank once");
                return Err(self.at(at, what));
            }
            vessels.push(vessel);
        }
        if vessels.len() != outputs.max(1) {
            let what = format!(
                "measured names {} of the tanks, but [columns] names {} of the outputs; as many of both, in the same order",
                vessels.len(),
                outputs.max(1)
            );
            return Err(self.at(at, what));
        }
        // Nothing of what is below would show in the level of what is above.
        let last = plant.vessels() - 1;
        if !plant.joined() && !vessels.contains(&last) {
            let what = format!(
                "the level of the {} tank is not among the outputs, so nothing shows how it behaves; take plant = \"single-tank\" for the tank that is measured",
                names[last]
            );
            return Err(self.at(at, what));
        }
        Ok(vessels)
    }

    /// The vessel into which a measured disturbance flows.
    fn disturbance(
        &self,
        plant: Plant,
        word: Option<&Spanned<String>>,
    ) -> Result<Option<usize>, Error> {
        let Some(word) = word else { return Ok(None) };
        let at = word.span().start;
        if plant.joined() {
            let what = format!(
                "plant {} takes no measured disturbance: its second input is the second pump; delete disturbance",
                plant.id()
            );
            return Err(self.at(at, what));
        }
        let name = word.as_ref();
        let found = (0..plant.vessels()).find(|&vessel| match plant.vessel_name(vessel) {
            Some(known) => known == name,
            None => name == ONLY,
        });
        found.map(Some).ok_or_else(|| {
            self.at(
                at,
                format!(
                    "disturbance = \"{}\" says nothing of where it flows in; write {}",
                    quoted(name),
                    disturbed(plant).join(" or ")
                ),
            )
        })
    }

    /// What a valve lets through at one unit of head and a flow coefficient of one.
    fn orifice(&self, raw: &RawKnown, area_known: bool) -> Result<Option<f64>, Error> {
        match (&raw.pipe_area, &raw.gravity) {
            (None, None) => Ok(None),
            (Some(pipe), Some(gravity)) => {
                if !area_known {
                    return Err(self.at(
                        pipe.span().start,
                        "pipe_area says nothing of the levels without the area of the tanks; give area too, in the same unit",
                    ));
                }
                let section = self.positive("pipe_area", pipe)?;
                let gravity = self.positive("gravity", gravity)?;
                Ok(Some(section * (2.0 * gravity).sqrt()))
            }
            (Some(only), None) | (None, Some(only)) => Err(self.at(
                only.span().start,
                "pipe_area and gravity make flow coefficients pure numbers together; give both (gravity = 981 where levels are in cm, 9.81 in m), or neither",
            )),
        }
    }
}

/// The only vessel of a plant, as `disturbance` names it.
const ONLY: &str = "tank";

/// What `disturbance` may say, in quotes.
fn disturbed(plant: Plant) -> Vec<String> {
    let names = (0..plant.vessels()).map(|vessel| plant.vessel_name(vessel).unwrap_or(ONLY));
    names.map(|name| format!("\"{name}\"")).collect()
}

/// A line as it was meant, where its value begins as a number and has a unit behind it or a decimal comma.
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
    // 1,000.0 may be a thousand, or a slip.
    if word.matches([',', '.']).count() > 1 {
        return Some(format!("{key} = 154.0, say"));
    }
    let point = word.replace(',', ".");
    let number = (1..=point.len())
        .rev()
        .find_map(|end| point.get(..end)?.parse::<f64>().ok())?;
    Some(format!("{key} = {number:?}"))
}
