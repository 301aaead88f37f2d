//! A frame of measured data as the program reads its records: written as CSV in memory, and read by the same reader, so that samples, gaps
//! and dates mean the same, and messages name the row and the column. Row 1 is the header, as in a file.

use std::fmt::Write;

use ct_signals::{Columns, Hold, ReadOptions, Reading, parse_csv, parse_inputs_csv};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error;

/// A record before a model assigns its columns.
#[pyclass(frozen, module = "ctid._ctid")]
#[derive(Debug)]
pub struct Frame(pub Content);

/// Columns of a frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Content {
    pub name: String,
    /// Header of the column of the time.
    pub time: String,
    /// Headers of the columns of the signals.
    pub headers: Vec<String>,
    pub csv: Vec<u8>,
}

/// Instants as numbers, or as dates in text form.
#[derive(FromPyObject)]
enum Times<'py> {
    Numbers(PyReadonlyArray1<'py, f64>),
    Dates(Vec<String>),
}

/// Quotes a cell so that the reader takes it literally.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[pymethods]
impl Frame {
    /// `headers` and `columns`: those of the signals; `time`: the instants, under the header `time_header`.
    #[new]
    fn new(
        name: String,
        time_header: String,
        time: Times<'_>,
        headers: Vec<String>,
        columns: Vec<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
        let rows = match &time {
            Times::Numbers(time) => time.as_array().len(),
            Times::Dates(time) => time.len(),
        };
        for (header, column) in headers.iter().zip(&columns) {
            let found = column.as_array().len();
            if found != rows {
                return Err(error::of_data(format!(
                    "{name}: column \"{header}\" has {found} values, and the time has {rows}: give one for each instant"
                )));
            }
        }
        let mut csv = quoted(&time_header);
        for header in &headers {
            csv += ",";
            csv += &quoted(header);
        }
        csv += "\n";
        let number = |csv: &mut String, value: f64| {
            if !value.is_nan() {
                // Into memory nothing fails.
                let _ = write!(csv, "{value:?}");
            }
        };
        for k in 0..rows {
            match &time {
                Times::Numbers(time) => number(&mut csv, time.as_array()[k]),
                Times::Dates(time) => csv += &time[k],
            }
            for column in &columns {
                csv += ",";
                number(&mut csv, column.as_array()[k]);
            }
            csv += "\n";
        }
        Ok(Self(Content {
            name,
            time: time_header,
            headers,
            csv: csv.into_bytes(),
        }))
    }
}

impl Content {
    /// Reads it as a record to be fitted.
    pub fn record(
        &self,
        columns: &Columns,
        options: &ReadOptions,
    ) -> Result<Reading, ct_signals::Error> {
        parse_csv(&self.name, &self.csv, &self.columns(columns), options)
    }

    /// Reads it as a record on whose inputs a model runs.
    pub fn inputs(
        &self,
        columns: &Columns,
        options: &ReadOptions,
    ) -> Result<Reading, ct_signals::Error> {
        parse_inputs_csv(&self.name, &self.csv, &self.columns(columns), options)
    }

    /// The columns with the time of this frame.
    fn columns(&self, columns: &Columns) -> Columns {
        Columns {
            time: Some(self.time.clone()),
            ..columns.clone()
        }
    }
}

/// Frames that Python hands over.
pub fn contents(frames: &[Bound<'_, Frame>]) -> Vec<Content> {
    frames.iter().map(|frame| frame.get().0.clone()).collect()
}

/// What the inputs do between rows.
pub fn hold_of(hold: &str) -> PyResult<Hold> {
    match hold {
        "zero" => Ok(Hold::Zero),
        "first" => Ok(Hold::First),
        other => Err(error::of_model(format!(
            "hold is \"zero\" or \"first\", and not \"{other}\""
        ))),
    }
}
