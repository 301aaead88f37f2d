//! The shape of a missing term as a CSV file: `ctid diagnose --unknown` writes it, `ctid add NAME --from` reads it, and a user may write
//! one.
//!
//! ```csv
//! place,variable,at [cm],value [cm^3/s],std_error [cm^3/s]
//! vessel,level,8.2,-0.3,0.2
//! vessel,level,11.0,-4.1,0.3
//! ```
//! `place` is `actuator` (of two pumps the first), `sensor` (of several `sensor upper`), `vessel`, or of several vessels the name of one;
//! `variable` is `level`, `rate` (the vessel's net inflow), `input` or `time` (since the record began). The standard errors are for the
//! reader alone.

use std::path::Path;

use ct_signals::{quoted, read_file};
use missing_effect::Unknown;
use plants::{Known, MOST_KNOTS, Place, Plant, Variable};

use crate::Error;
use crate::model_file::LARGEST;

/// The beginning of every such file.
pub(crate) const HEADER: &str = "place,variable,at";

/// A shape with the names that files use for place and variable, and its units; empty where they are not known.
#[derive(Debug, Clone, PartialEq)]
pub struct TermFile {
    /// Where it acts.
    pub place: String,
    /// Variable of the term.
    pub variable: String,
    /// Knots.
    pub at: Vec<f64>,
    /// Values at the knots.
    pub value: Vec<f64>,
    /// Unit of the knots.
    pub at_unit: String,
    /// Unit of the values.
    pub unit: String,
}

impl From<&Unknown> for TermFile {
    fn from(unknown: &Unknown) -> Self {
        Self {
            place: unknown.place.clone(),
            variable: unknown.variable.to_string(),
            at: unknown.knots.clone(),
            value: unknown.ordinates.clone(),
            at_unit: unknown.variable_unit.clone(),
            unit: unknown.unit.clone(),
        }
    }
}

/// The place and the vessel, or the output, of a name.
pub(crate) fn place_of(plant: Plant, known: &Known, word: &str) -> Result<(Place, usize), String> {
    let outputs = known.outputs(plant);
    match word {
        "actuator" => return Ok((Place::Actuator, 0)),
        "sensor" if outputs.len() == 1 => return Ok((Place::Sensor, 0)),
        "vessel" if plant.vessels() == 1 => return Ok((Place::Vessel, 0)),
        _ => {}
    }
    let at_sensor = || {
        let read = word.strip_prefix("sensor ")?;
        (0..outputs.len()).find(|&output| known.output_name(plant, output) == Some(read))
    };
    (0..plant.vessels())
        .find(|&vessel| plant.vessel_name(vessel) == Some(word))
        .map(|vessel| (Place::Vessel, vessel))
        .or_else(|| Some((Place::Sensor, at_sensor()?)))
        .ok_or_else(|| {
            let names = (0..plant.vessels()).filter_map(|vessel| plant.vessel_name(vessel));
            let names: Vec<&str> = names.collect();
            let vessels = if names.is_empty() {
                "vessel".to_string()
            } else {
                names.join(", ")
            };
            format!(
                "\"{}\" is not a place of plant {}; write actuator, {vessels} or {}",
                quoted(word),
                plant.id(),
                match &outputs[..] {
                    [_] => "sensor".to_string(),
                    several => {
                        let names = (0..several.len())
                            .filter_map(|output| known.output_name(plant, output))
                            .map(|name| format!("sensor {name}"));
                        names.collect::<Vec<String>>().join(" or ")
                    }
                }
            )
        })
}

/// The variable of a name.
pub(crate) fn variable_of(word: &str) -> Result<Variable, String> {
    Variable::ALL
        .into_iter()
        .find(|variable| variable.name() == word)
        .ok_or_else(|| {
            format!(
                "\"{}\" is not a variable; write level, rate, input or time",
                quoted(word)
            )
        })
}

/// Whether a file has the header of a diagnosis, with all its columns; in a user's file the last column is optional.
pub(crate) fn is_own(text: &str) -> bool {
    let header = text.lines().next().unwrap_or_default();
    let columns: Vec<&str> = header.split(',').collect();
    header.starts_with(HEADER)
        && matches!(&columns[..], [.., last] if last.starts_with("std_error ["))
        && columns.len() == 5
}

/// The file for the result of a diagnosis.
#[must_use]
pub fn text(unknown: &Unknown) -> String {
    let values = unknown.knots.iter().zip(&unknown.ordinates);
    let rows = values.zip(&unknown.ordinate_errors);
    of_curve(
        (&unknown.place, unknown.variable),
        (&unknown.variable_unit, &unknown.unit),
        rows.map(|((at, value), error)| (*at, *value, Some(*error))),
    )
}

/// The file of a curve: its place and variable, the units of the variable and of the term, and its points, values and standard errors.
pub(crate) fn of_curve(
    (place, variable): (&str, &str),
    (at, of): (&str, &str),
    rows: impl Iterator<Item = (f64, f64, Option<f64>)>,
) -> String {
    let mut text = format!("{HEADER} [{at}],value [{of}],std_error [{of}]\n");
    for (at, value, error) in rows {
        let error = error.map_or(String::new(), |error| error.to_string());
        text += &format!("{place},{variable},{at},{value},{error}\n");
    }
    text
}

/// Reads a file.
///
/// # Errors
/// One line that names the file, the row, the column and the correction.
pub fn read(path: &Path) -> Result<TermFile, Error> {
    let text = read_file(path, LARGEST as u64).map_err(|error| match error {
        ct_signals::Error::Read(ct_signals::ReadError::CannotOpen { source, .. }) => Error::file(
            path,
            format!("the shape cannot be read: {source}; check the path"),
        ),
        error => error.into(),
    })?;
    let text = String::from_utf8(text)
        .map_err(|_| Error::file(path, "the shape is not UTF-8 text; save it as UTF-8"))?;
    parse(&path.display().to_string(), &text)
}

/// Reads the text of a file; `file` names it in messages.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<TermFile, Error> {
    let at_line = |line: u64, what: String| Error::AtLine {
        file: file.to_string(),
        line: usize::try_from(line).unwrap_or(usize::MAX).max(1),
        what,
    };
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(true)
        .from_reader(text.as_bytes());
    let headers = reader
        .headers()
        .map_err(|error| at_line(1, error.to_string()))?
        .clone();
    let columns: Vec<(&str, &str)> = headers.iter().map(name_and_unit).collect();
    let column = |name: &str| {
        columns.iter().position(|(known, _)| *known == name).ok_or_else(|| {
            at_line(
                1,
                format!("no column \"{name}\"; the header is `place,variable,at [unit],value [unit]`"),
            )
        })
    };
    let (place, variable, at, value) = (
        column("place")?,
        column("variable")?,
        column("at")?,
        column("value")?,
    );
    let mut shape = TermFile {
        place: String::new(),
        variable: String::new(),
        at: Vec::new(),
        value: Vec::new(),
        at_unit: columns[at].1.to_string(),
        unit: columns[value].1.to_string(),
    };
    for row in reader.records() {
        let row = row.map_err(|error| {
            at_line(
                error.position().map_or(1, csv::Position::line),
                error.to_string(),
            )
        })?;
        let line = row.position().map_or(1, csv::Position::line);
        let cell = |index: usize, name: &str| match row.get(index) {
            None | Some("") => Err(at_line(
                line,
                format!("column \"{name}\" is empty; fill it in, or delete the row"),
            )),
            Some(cell) => Ok(cell),
        };
        let number = |index: usize, name: &str| {
            let text = cell(index, name)?;
            text.parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| {
                    at_line(
                        line,
                        format!(
                            "column \"{name}\" holds \"{}\", which is not a finite number; correct it",
                            quoted(text)
                        ),
                    )
                })
        };
        for (index, name, kept) in [
            (place, "place", &mut shape.place),
            (variable, "variable", &mut shape.variable),
        ] {
            let word = cell(index, name)?;
            if kept.is_empty() {
                *kept = word.to_string();
            } else if kept != word {
                return Err(at_line(
                    line,
                    format!(
                        "column \"{name}\" holds \"{}\", the rows before it \"{}\"; a term has one {name}",
                        quoted(word),
                        quoted(kept)
                    ),
                ));
            }
        }
        let knot = number(at, "at")?;
        if let Some(before) = shape.at.last().filter(|before| **before >= knot) {
            return Err(at_line(
                line,
                format!(
                    "column \"at\" holds {knot} after {before}; sort the rows by rising values, each once"
                ),
            ));
        }
        if shape.at.len() == MOST_KNOTS {
            return Err(at_line(
                line,
                format!(
                    "this is row {} of a shape; {MOST_KNOTS} rows are the most",
                    MOST_KNOTS + 1
                ),
            ));
        }
        shape.at.push(knot);
        shape.value.push(number(value, "value")?);
    }
    if shape.at.is_empty() {
        return Err(at_line(
            1,
            "there are no rows below the header; a shape has one at least".to_string(),
        ));
    }
    Ok(shape)
}

/// `at [cm]` is `at` in `cm`.
fn name_and_unit(header: &str) -> (&str, &str) {
    match header.split_once('[') {
        Some((name, unit)) => (name.trim(), unit.trim().trim_end_matches(']').trim()),
        None => (header.trim(), ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        parse("u.csv", text).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_named_with_its_row_and_column() {
        let head = "place,variable,at [cm],value [cm^3/s]\n";
        let rows = |rows: &str| refused(&format!("{head}{rows}"));
        assert_eq!(
            rows("vessel,level,1,2\nvessel,level,2,x\n"),
            "u.csv:3: column \"value\" holds \"x\", which is not a finite number; correct it"
        );
        assert!(rows("vessel,level,1,NaN\n").contains("\"NaN\", which is not a finite number"));
        assert!(rows("vessel,level,1\n").starts_with("u.csv:2: column \"value\" is empty"));
        assert!(
            rows("vessel,level,2,1\nvessel,level,2,1\n")
                .starts_with("u.csv:3: column \"at\" holds 2 after 2")
        );
        assert!(
            rows("vessel,level,1,1\nsensor,level,2,1\n")
                .contains("\"sensor\", the rows before it \"vessel\"")
        );
        assert!(rows("").contains("no rows below the header"));
        assert!(
            refused("place,variable,at\nvessel,level,1\n")
                .starts_with("u.csv:1: no column \"value\"")
        );
        assert!(refused("").starts_with("u.csv:1: no column \"place\""));
    }

    #[test]
    fn a_shape_is_read_with_its_units() {
        let read = parse(
            "u.csv",
            "# drawn by hand\nplace, variable, value [cm^3/s], at [cm]\nvessel, level, -1.5, 8\nvessel, level, 2, 9\n",
        )
        .unwrap();
        assert_eq!((read.at, read.value), (vec![8.0, 9.0], vec![-1.5, 2.0]));
        assert_eq!(
            (read.at_unit.as_str(), read.unit.as_str()),
            ("cm", "cm^3/s")
        );
    }
}
