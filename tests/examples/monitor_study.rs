//! Detection rate and false alarm rate of the monitor.
//!
//! `cargo run --release -p ctid-tests --example monitor_study -- [LOOPS] [--ratio R] [--quiet-rows N]`: 30 loops drawn at random in which
//! an effect of five kinds begins half-way, 1500 rows before and 1500 after, and 30 in which none does, 20 000 rows each. Plants,
//! controllers and set points are drawn, the noise is white in every other loop and correlated in the others; the size is such that the
//! believed model, refitted to the whole record without noise, misses it by `R` times the noise. `--lost S` takes the share S of the
//! readings away, at random or, with `--at-steps`, in bursts where the set point steps; `--open` opens the loops in which nothing begins.

use clap::Parser;
use ctid_tests::Drive;
use ctid_tests::onset::{Lost, Onset};
use monitor::{Alarm, Settings};
use rayon::prelude::*;

#[derive(Parser)]
struct Arguments {
    /// Loops with an effect, and as many without
    #[arg(default_value_t = 30)]
    loops: u64,
    /// Structural error over noise
    #[arg(long, default_value_t = 1.0)]
    ratio: f64,
    /// Rows of a loop with an effect
    #[arg(long, default_value_t = 3000)]
    rows: usize,
    /// Rows of a loop without
    #[arg(long, default_value_t = 20_000)]
    quiet_rows: usize,
    /// Rows between false alarms, as the monitor is set
    #[arg(long, default_value_t = Settings::default().rows_between_false_alarms)]
    between: f64,
    /// The noise's correlation from row to row in the odd loops; it is white in the even ones
    #[arg(long, default_value_t = 0.5)]
    colour: f64,
    /// Degrees of freedom of the noise, above two: its tails are heavy; without it the noise is Gaussian
    #[arg(long)]
    tails: Option<f64>,
    /// Number of the first loop: another thirty
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// Share of the readings that are lost
    #[arg(long)]
    lost: Option<f64>,
    /// Missing readings occur in bursts that begin at steps
    #[arg(long, requires = "lost")]
    at_steps: bool,
    /// The loops in which nothing begins are open
    #[arg(long)]
    open: bool,
    /// Leave out the loops in which an effect begins
    #[arg(long)]
    only_quiet: bool,
}

fn main() {
    let arguments = Arguments::parse();
    let settings = Settings {
        rows_between_false_alarms: arguments.between,
        ..Settings::default()
    };
    // Five effects in turn: each is seen in both kinds of noise.
    let colour = |number: u64| {
        if number.is_multiple_of(2) {
            0.0
        } else {
            arguments.colour
        }
    };
    let lost = arguments.lost.map(|share| Lost {
        share,
        at_steps: arguments.at_steps,
    });
    let numbers = arguments.first..arguments.first + arguments.loops;
    let with_effect = if arguments.only_quiet {
        0..0
    } else {
        numbers.clone()
    };
    let found: Vec<_> = with_effect
        .clone()
        .into_par_iter()
        .map(|number| {
            let mut onset = Onset::drawn(number, arguments.rows, arguments.ratio, colour(number))?;
            onset.tails = arguments.tails;
            onset.lost = lost;
            let alarms = onset.watched(settings, 500 + number)?;
            Some((onset, alarms))
        })
        .collect();
    println!(
        "effect           plant                  colour  tau/rows  delay  visible  named (last look)      group"
    );
    let (mut seen, mut seen_visible, mut named, mut named_at_once, mut early, mut drawn) =
        (0, 0, 0, 0, 0, 0);
    for (number, found) in with_effect.zip(&found) {
        let Some((onset, alarms)) = found else {
            println!("loop {number}: the effect can have this size in none of the rigs drawn");
            continue;
        };
        drawn += 1;
        let Some((placed, _)) = &onset.effect else {
            continue;
        };
        let begun = onset.row as f64 * onset.rig.interval;
        let tau = onset.time_constant();
        let visible = onset.visible_from().unwrap_or(onset.row) as f64 * onset.rig.interval;
        early += alarms.iter().filter(|alarm| alarm.time < begun).count();
        let of_it: Vec<&Alarm> = alarms.iter().filter(|alarm| alarm.time >= begun).collect();
        let delay = of_it.first().map(|alarm| (alarm.time - begun) / tau);
        let since_visible = of_it.first().map(|alarm| (alarm.time - visible) / tau);
        let holds = |alarm: &&&Alarm| alarm.effects.iter().any(|e| e == placed.effect.id);
        // Evaluations after the first alarm, up to the last one before learning restarts.
        let last = of_it
            .iter()
            .position(|alarm| alarm.event == monitor::Stage::Final)
            .map_or(of_it.last(), |at| of_it.get(at));
        seen += usize::from(delay.is_some_and(|d| d <= 3.0));
        seen_visible += usize::from(since_visible.is_some_and(|d| d <= 3.0));
        named += usize::from(last.as_ref().is_some_and(&holds));
        named_at_once += usize::from(of_it.first().as_ref().is_some_and(&holds));
        println!(
            "{:<16} {:<22} {:>5} {:>8.0} {:>7.2} {:>8.2}  {:<3} {:?}",
            placed.effect.id,
            onset.rig.plant.id(),
            onset.rig.colour,
            tau / onset.rig.interval,
            delay.unwrap_or(f64::NAN),
            since_visible.unwrap_or(f64::NAN),
            if last.as_ref().is_some_and(&holds) {
                "yes"
            } else {
                "no"
            },
            last.map(|l| (&l.effects, l.since.map(|s| (s - begun) / tau))),
        );
    }
    println!(
        "within 3 time constants of the onset {seen} of {drawn}, of being as large as the noise {seen_visible}; effect in the named group {named} (at the first look {named_at_once}); alarms before the onset {early}"
    );
    let quiet: Vec<_> = numbers
        .into_par_iter()
        .map(|number| {
            let mut onset = Onset::nothing(arguments.quiet_rows, colour(number), number);
            onset.tails = arguments.tails;
            onset.lost = lost;
            if arguments.open {
                onset.rig.drive = Drive::Open;
            }
            let alarms = onset.watched(settings, 900 + number);
            (onset, alarms)
        })
        .collect();
    let (mut most, mut all) = (0, 0);
    for (onset, alarms) in &quiet {
        let count = alarms.as_ref().map_or(usize::MAX, |alarms| {
            let new = |alarm: &&Alarm| alarm.event == monitor::Stage::Alarm;
            alarms.iter().filter(new).count()
        });
        most = most.max(count);
        all = usize::saturating_add(all, count);
        if count > 0 {
            println!(
                "nothing began: {count} alarms, {} colour {} tau {:.0}",
                onset.rig.plant.id(),
                onset.rig.colour,
                onset.time_constant() / onset.rig.interval
            );
        }
    }
    println!(
        "nothing began in {} loops of {} rows: {all} alarms, at most {most} in one",
        quiet.len(),
        arguments.quiet_rows
    );
}
