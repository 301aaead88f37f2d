//! Reads a CSV file and prints its summary and the time for reading: `cargo run --release -p ct-signals --example read [FILE.csv [TIME
//! INPUT OUTPUT]]`.
//!
//! Without a file a record of a million rows with dates is made, read and timed.

use std::time::Instant;

use ct_signals::{Columns, ReadOptions, parse_csv, read_file};

const ROWS: usize = 1_000_000;

/// A row a second from 2020 on, a hundredth of the readings missing.
fn made() -> Vec<u8> {
    let mut text = "time,u [V],y [cm]\n".to_string();
    for k in 0..ROWS {
        let (day, second) = (k / 86_400, k % 86_400);
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        text += &format!("2020-01-{:02}T{hour:02}:{minute:02}:{second:02},", day + 1);
        text += &format!("{},", 3 + k / 500 % 4);
        if k % 100 == 7 {
            text += "Bad\n";
        } else {
            text += &format!("{:.3}\n", 10.0 + 0.01 * (k % 97) as f64);
        }
    }
    text.into_bytes()
}

fn main() -> Result<(), ct_signals::Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let columns = match &arguments[..] {
        [_, time, input, output] => Columns {
            time: Some(time.clone()),
            inputs: vec![input.clone()],
            outputs: vec![output.clone()],
            ..Columns::default()
        },
        _ => Columns::default(),
    };
    let (name, content) = match arguments.first() {
        Some(file) => (file.as_str(), read_file(file.as_ref(), u64::MAX)?),
        None => ("made.csv", made()),
    };
    let begun = Instant::now();
    let reading = parse_csv(name, &content, &columns, &ReadOptions::default())?;
    let seconds = begun.elapsed().as_secs_f64();
    println!("{}", reading.summary);
    let rows = reading.record.len() as f64;
    println!(
        "{seconds:.3} s, {:.3} s a million rows, {:.0} MB of text",
        seconds * 1e6 / rows,
        content.len() as f64 / 1e6
    );
    Ok(())
}
