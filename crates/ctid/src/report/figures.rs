//! Figures that are curves in panels: what `figures.js` draws.

use serde::Serialize;

use super::data::rounded;
use super::decimate::min_max;

/// Script that draws the figures.
pub(super) const SCRIPT: &str = include_str!("figures.js");

/// Points of one curve that are drawn at most.
const POINTS: usize = 3_000;

/// Panels one above the other, over one abscissa.
#[derive(Debug, Serialize)]
pub(super) struct Figure {
    /// Identifier of the figure's place in the page.
    pub id: String,
    /// In pixels.
    pub height: u32,
    pub x_title: &'static str,
    pub x_unit: String,
    pub x_range: Option<[f64; 2]>,
    /// A shaded interval of the abscissa.
    pub x_band: Option<[f64; 2]>,
    /// The ordinate has names instead of numbers.
    pub categories: bool,
    pub panels: Vec<Panel>,
    pub curves: Vec<Curve>,
}

/// A panel with one ordinate.
#[derive(Debug, Serialize)]
pub(super) struct Panel {
    pub title: String,
    pub unit: String,
    pub log: bool,
    /// Powers of ten for a logarithmic axis.
    pub range: Option<[f64; 2]>,
    /// Part of the height.
    pub share: f64,
    /// Values that are marked by a dashed line.
    pub lines: Vec<f64>,
}

/// Colour of a curve.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(untagged)]
pub(super) enum Colour {
    /// A named colour of the page.
    Named(&'static str),
    /// One of a set of distinct colours.
    Of(usize),
}

/// Numbers or names along an axis.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Names(Vec<&'static str>),
}

#[derive(Debug, Serialize)]
pub(super) struct Curve {
    pub name: String,
    /// Index of the panel, from 0.
    pub panel: usize,
    pub colour: Colour,
    pub dash: &'static str,
    pub width: f64,
    /// Symbol of points without a line.
    pub marker: Option<&'static str>,
    /// Whether a value is held until the next one.
    pub held: bool,
    pub legend: bool,
    pub x: Vec<f64>,
    pub y: Values,
    /// A band around the curve, or nothing.
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
}

impl Figure {
    /// A figure over time.
    pub(super) fn over_time(id: &str, height: u32, panels: Vec<Panel>, curves: Vec<Curve>) -> Self {
        Self {
            id: id.to_owned(),
            height,
            x_title: "time",
            x_unit: "s".to_owned(),
            x_range: None,
            x_band: None,
            categories: false,
            panels,
            curves,
        }
    }
}

impl Panel {
    /// Output, residual and input of a fit.
    pub(super) fn of_fit(output_unit: &str, input_unit: &str) -> Vec<Self> {
        vec![
            Self {
                share: 2.0,
                ..Self::new("output", output_unit)
            },
            Self {
                lines: vec![0.0],
                ..Self::new("residual", output_unit)
            },
            Self::new("input", input_unit),
        ]
    }

    pub(super) fn new(title: &str, unit: &str) -> Self {
        Self {
            title: title.to_owned(),
            unit: unit.to_owned(),
            log: false,
            range: None,
            share: 1.0,
            lines: Vec::new(),
        }
    }
}

impl Curve {
    /// An input, which is held.
    pub(super) fn input(panel: usize, data: (&[f64], &[f64])) -> Self {
        Self {
            held: true,
            ..Self::line("input", panel, Colour::Named("faint"), data)
        }
    }

    /// A line, thinned for display.
    pub(super) fn line(
        name: &str,
        panel: usize,
        colour: Colour,
        (time, values): (&[f64], &[f64]),
    ) -> Self {
        let at = kept(time, values);
        Self {
            name: name.to_owned(),
            panel,
            colour,
            dash: "solid",
            width: 1.8,
            marker: None,
            held: false,
            legend: false,
            x: picked(time, &at, 10),
            y: Values::Numbers(picked(values, &at, 6)),
            lower: Vec::new(),
            upper: Vec::new(),
        }
    }

    /// Adds a band of this half width.
    pub(super) fn with_band(mut self, (time, values): (&[f64], &[f64]), half: &[f64]) -> Self {
        let at = kept(time, values);
        let edge = |sign: f64| -> Vec<f64> {
            let edges = values
                .iter()
                .zip(half)
                .map(|(value, half)| value + sign * half);
            picked(&edges.collect::<Vec<_>>(), &at, 6)
        };
        self.lower = edge(-1.0);
        self.upper = edge(1.0);
        self
    }

    pub(super) fn named(self) -> Self {
        Self {
            legend: true,
            ..self
        }
    }

    pub(super) fn dashed(self, dash: &'static str) -> Self {
        Self { dash, ..self }
    }
}

fn kept(time: &[f64], values: &[f64]) -> Vec<usize> {
    min_max(&values[..values.len().min(time.len())], POINTS)
}

fn picked(values: &[f64], at: &[usize], digits: usize) -> Vec<f64> {
    at.iter()
        .filter_map(|&i| values.get(i))
        .map(|&value| rounded(value, digits))
        .collect()
}

/// The JSON of a page's figures, safe inside a `<script>` element. What is not finite becomes `null`.
pub(super) fn json(figures: &[Figure]) -> String {
    #[derive(Serialize)]
    struct Data<'a> {
        figures: &'a [Figure],
    }
    super::data::script_safe(&Data { figures })
}
