//! Curves over time, below each other, as one picture that any browser shows.

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;

/// One curve.
pub struct Curve {
    /// Legend of the curve.
    pub name: &'static str,
    /// Time \[s\] and value.
    pub points: Vec<(f64, f64)>,
}

/// Curves that share an axis.
pub struct Panel {
    /// Label of the axis, with its unit.
    pub title: String,
    /// Curves, at most as many as there are colours.
    pub curves: Vec<Curve>,
}

const COLOURS: [RGBColor; 3] = [
    RGBColor(0, 90, 160),
    RGBColor(200, 90, 0),
    RGBColor(0, 138, 102),
];
/// Width and height of a panel, pixels.
const SIZE: (u32, u32) = (640, 260);

/// Writes `columns` of panels, each with its title, as SVG.
///
/// # Errors
/// Where the file cannot be written.
pub fn write(path: &Path, columns: &[(String, Vec<Panel>)]) -> Result<(), Box<dyn Error>> {
    let rows = columns.iter().map(|(_, panels)| panels.len()).max();
    let size = (
        SIZE.0 * columns.len() as u32,
        SIZE.1 * rows.unwrap_or(0) as u32 + 40,
    );
    let area = SVGBackend::new(path, size).into_drawing_area();
    area.fill(&WHITE)?;
    for (place, (title, panels)) in area.split_evenly((1, columns.len())).iter().zip(columns) {
        let place = place.titled(title, ("sans-serif", 20))?;
        for (place, panel) in place.split_evenly((panels.len(), 1)).iter().zip(panels) {
            draw(place, panel)?;
        }
    }
    area.present()?;
    Ok(())
}

type Place<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(place: &Place<'_>, panel: &Panel) -> Result<(), Box<dyn Error>> {
    let points = || panel.curves.iter().flat_map(|curve| &curve.points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        points().map(of).fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(low, high): (f64, f64), x| (low.min(x), high.max(x)),
        )
    };
    let ((from, to), (low, high)) = (range(|p| p.0), range(|p| p.1));
    // Room above for the legend.
    let rows = panel.curves.len() as f64;
    let (below, above) = (0.06 * (high - low), 0.17 * rows * (high - low));
    let mut chart = ChartBuilder::on(place)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(10)
        .x_label_area_size(30)
        .y_label_area_size(48)
        .build_cartesian_2d(from..to, low - below..high + above)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_label_formatter(&|time| format!("{time:.0}"))
        .x_desc("time [s]")
        .draw()?;
    for (curve, colour) in panel.curves.iter().zip(COLOURS) {
        chart
            .draw_series(LineSeries::new(
                curve.points.iter().copied(),
                colour.stroke_width(2),
            ))?
            .label(curve.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
    }
    if panel.curves.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .margin(2)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
    }
    Ok(())
}
