//! 121 starts of the recursive closed-loop estimator, gain and time constant each from a fifth to five times the true
//! one: where does condition (14) of Baysse, Carrillo and Habbadi hold, and from where does the recursion converge?
//!
//! The fixed filter gets five times as many samples as the adaptive one, to leave it no excuse.
//!
//! `cargo run --release -p ctid-examples --bin table_of_starts` prints the counts and writes `table_of_starts.svg`: a
//! square for each start, its colour the condition, a dot where the run ended at the truth and a cross where not.

use std::error::Error;
use std::path::Path;

use ct_lti::Hold;
use ct_signals::excitation;
use fcloe::{
    Controller, Filter, Noise, PlantModel, RecursiveSettings, StartRun, TableOfStarts, Verdict,
    continuous_loop, factors_to_five, noise_at_snr,
};
use plotters::prelude::*;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// Relative error of a parameter up to which a run has converged.
const TOLERANCE: f64 = 0.05;
const VERDICTS: [(Verdict, &str, RGBColor); 3] = [
    (Verdict::Holds, "> 1/2", RGBColor(140, 185, 225)),
    (Verdict::Positive, "0 to 1/2", RGBColor(245, 220, 130)),
    (Verdict::Negative, "< 0", RGBColor(235, 150, 140)),
];
/// Gains of the PI, and samples of a bit of the reference.
const LOOPS: [(f64, f64, usize); 3] = [(0.2292, 0.0021, 10), (0.5515, 0.074, 10), (0.02, 0.01, 20)];
const FILTERS: [(Filter, &str, usize); 2] = [
    (Filter::Fixed, "filter of the start", 10),
    (Filter::Adaptive, "adaptive filter", 2),
];
const POINTS: usize = 11;

/// Starts of one loop with one filter; the reference repeats itself after 127 bits, and its whole is `periods` of them.
fn table(
    (kp, ki, bit): (f64, f64, usize),
    filter: Filter,
    periods: usize,
) -> Result<TableOfStarts, Box<dyn Error>> {
    let plant = PlantModel::first_order(6.0, 110.0)?;
    let controller = Controller::pi(kp, ki)?;
    let r = excitation::prbs(127 * bit * periods, bit, -1.0, 1.0, 7)?;
    let simulate = |noise| continuous_loop(&plant, &controller, 1.0, &r, Hold::Zero, noise);
    let clean = simulate(Noise::None)?.y;
    let w = noise_at_snr(&clean, 20.0, &mut ChaCha8Rng::seed_from_u64(1))?;
    let y = simulate(Noise::InLoop(&w))?.y;
    let settings = RecursiveSettings::new(100.0, -0.98_f64.ln(), 1000.0, 0.2).with_filter(filter);
    let factors = factors_to_five(POINTS);
    let grid = (&factors[..], &factors[..]);
    Ok(TableOfStarts::run(
        &plant,
        &controller,
        (1.0, &r, &y),
        grid,
        settings,
    )?)
}

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "starts that end within {TOLERANCE} of the truth, of those whose least Re (P^/P) is\n"
    );
    let [holds, positive, negative] = VERDICTS.map(|(_, name, _)| name);
    println!(
        "{:<18} {:<20} {:>7} {holds:>11} {positive:>11} {negative:>11}",
        "PI", "", "samples"
    );
    let mut panels = Vec::new();
    for (filter, filter_name, periods) in FILTERS {
        for (kp, ki, bit) in LOOPS {
            let table = table((kp, ki, bit), filter, periods)?;
            let [holds, positive, negative] = VERDICTS.map(|(verdict, _, _)| {
                let (good, all) = table.converged(verdict, TOLERANCE);
                format!("{good} of {all}")
            });
            let controller = format!("{kp} + {ki}/p");
            println!(
                "{controller:<18} {filter_name:<20} {:>7} {holds:>11} {positive:>11} {negative:>11}",
                table.samples
            );
            panels.push((format!("PI {controller}, {filter_name}"), table));
        }
    }
    draw(Path::new("table_of_starts.svg"), &panels)
}

/// Pixels of a panel, and of the legend above all.
const PANEL: (u32, u32) = (360, 360);
const LEGEND: u32 = 40;

fn draw(path: &Path, panels: &[(String, TableOfStarts)]) -> Result<(), Box<dyn Error>> {
    let (columns, rows) = (LOOPS.len(), FILTERS.len());
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + LEGEND);
    let area = SVGBackend::new(path, size).into_drawing_area();
    area.fill(&WHITE)?;
    let (above, below) = area.split_vertically(LEGEND);
    legend(&above)?;
    for (place, (title, table)) in below.split_evenly((rows, columns)).iter().zip(panels) {
        panel(place, title, &table.runs)?;
    }
    area.present()?;
    Ok(())
}

type Place<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn legend(place: &Place<'_>) -> Result<(), Box<dyn Error>> {
    let font = ("sans-serif", 15).into_font();
    let mut x = 20;
    for (_, name, colour) in VERDICTS {
        place.draw(&Rectangle::new([(x, 12), (x + 18, 30)], colour.filled()))?;
        let text = format!("least Re (P^/P) {name}");
        place.draw(&Text::new(text, (x + 26, 14), font.clone()))?;
        x += 210;
    }
    place.draw(&Circle::new((x + 9, 21), 4, BLACK.filled()))?;
    place.draw(&Text::new("ended at the truth", (x + 26, 14), font.clone()))?;
    place.draw(&Cross::new((x + 209, 21), 5, BLACK.stroke_width(2)))?;
    place.draw(&Text::new("did not", (x + 226, 14), font))?;
    Ok(())
}

fn panel(place: &Place<'_>, title: &str, runs: &[StartRun]) -> Result<(), Box<dyn Error>> {
    // Axes are logarithms to the base of 5; a square is as wide as the grid.
    let half = 1.0 / (POINTS - 1) as f64;
    let range = || -1.0 - half..1.0 + half;
    let mut chart = ChartBuilder::on(place)
        .caption(title, ("sans-serif", 15))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(range(), range())?;
    let factor = |log: &f64| format!("{:.2}", 5.0_f64.powf(*log));
    chart
        .configure_mesh()
        .disable_mesh()
        .x_labels(5)
        .y_labels(5)
        .x_label_formatter(&factor)
        .y_label_formatter(&factor)
        .x_desc("gain of the start / true gain")
        .y_desc("time constant of the start / true one")
        .draw()?;
    for run in runs {
        let (x, y) = (
            run.gain_factor.ln() / 5.0_f64.ln(),
            run.time_factor.ln() / 5.0_f64.ln(),
        );
        let colour = VERDICTS
            .iter()
            .find(|(verdict, ..)| *verdict == run.condition.verdict);
        if let Some((_, _, colour)) = colour {
            let corners = [(x - half, y - half), (x + half, y + half)];
            chart.draw_series([Rectangle::new(corners, colour.filled())])?;
        }
        if run.error <= TOLERANCE {
            chart.draw_series([Circle::new((x, y), 3, BLACK.filled())])?;
        } else {
            chart.draw_series([Cross::new((x, y), 5, BLACK.stroke_width(2))])?;
        }
    }
    Ok(())
}
