//! The output that README.md shows is the program's.

use crate::common::Place;

/// A block of README.md that shows commands of the bundled record: each command with the lines that it is shown to print.
fn shown(block: &str) -> Vec<(&str, Vec<&str>)> {
    let mut commands: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in block.lines() {
        if let Some(words) = line.strip_prefix("$ ctid ") {
            commands.push((words, Vec::new()));
        } else if let Some((_, lines)) = commands.last_mut() {
            lines.push(line);
        }
    }
    commands
}

/// The words of a line without its numbers, and the numbers.
fn parts(line: &str) -> (String, Vec<f64>) {
    let mut words = String::new();
    let mut numbers = Vec::new();
    for word in line.split_whitespace() {
        let number = word.trim_matches(|c: char| !(c.is_ascii_digit() || c == '-' || c == '+'));
        match number.parse::<f64>() {
            Ok(value) => {
                numbers.push(value);
                words += &word.replace(number, "#");
            }
            Err(_) => words += word,
        }
        words.push(' ');
    }
    (words, numbers)
}

/// Whether a printed line is the one that is shown. Processors round differently: numbers agree to a twentieth.
fn is(shown: &str, printed: &str) -> bool {
    // A line may end in a part that differs from run to run.
    let (shown, printed) = match shown.strip_suffix("[...]") {
        Some(begin) => {
            let count = begin.split_whitespace().count();
            let same: Vec<&str> = printed.split_whitespace().take(count).collect();
            (begin, same.join(" "))
        }
        None => (shown, printed.to_string()),
    };
    let ((words, numbers), (found, values)) = (parts(shown), parts(&printed));
    words == found
        && numbers.len() == values.len()
        && numbers
            .iter()
            .zip(&values)
            .all(|(a, b)| (a - b).abs() <= 0.05 * b.abs())
}

#[test]
fn the_program_prints_what_is_shown() {
    let readme = include_str!("../../../../README.md");
    let mut commands = 0;
    for block in readme.split("```").skip(1).step_by(2) {
        let of_the_tour = shown(block).iter().all(|(words, _)| words.contains("tour"));
        if !block.contains("\n$ ctid ") || !of_the_tour {
            continue;
        }
        // A block is run from its first to its last command: `add` changes the model of the next one.
        let place = Place::new();
        for (words, lines) in shown(block) {
            commands += 1;
            let out = place.succeeds(words);
            let printed: Vec<&str> = out.lines().filter(|line| !line.trim().is_empty()).collect();
            let mut at = 0;
            let mut anywhere = false;
            for line in lines.iter().filter(|line| !line.trim().is_empty()) {
                if *line == "[...]" {
                    anywhere = true;
                    continue;
                }
                let next = if anywhere {
                    (at..printed.len()).find(|i| is(line, printed[*i]))
                } else {
                    Some(at).filter(|i| printed.get(*i).is_some_and(|printed| is(line, printed)))
                };
                let Some(next) = next else {
                    panic!(
                        "README.md shows a line that `ctid {words}` does not print there:\n{line}\nIt prints:\n{}",
                        printed[at.min(printed.len())..].join("\n")
                    );
                };
                (at, anywhere) = (next + 1, false);
            }
        }
    }
    assert!(commands >= 6, "{commands} commands are shown");
}
