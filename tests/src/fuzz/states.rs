//! Saved states of the monitor: damaged ones, and such whose numbers were changed and the checksum with them.

use std::sync::OnceLock;

use serde_json::{Value, json};

use super::process::Folder;
use super::source::Source;
use super::{Ended, streams};

const MODEL: &str = "plant = \"single-tank\"\n[known]\narea = 154.0\n";
const HEADER: &str = "t [s],u [V],y [cm]\n";

/// Rows after which a state is saved: while it learns, shortly after, and later.
const ROWS: [usize; 3] = [60, 140, 400];

/// A state that the monitor has written.
fn written(which: usize) -> Result<&'static [u8], String> {
    static STATES: [OnceLock<Result<Vec<u8>, String>>; 3] = [const { OnceLock::new() }; 3];
    let state = STATES[which].get_or_init(|| {
        let folder = Folder::new();
        folder.write("model.toml", MODEL);
        let rows = streams::rows(&mut Source::new(0), ROWS[which], 0.0);
        folder.write("rows.csv", HEADER.to_string() + &rows.join("\n") + "\n");
        let ended = folder.run(
            "monitor --model model.toml --learn 100 --state state.json",
            Some("rows.csv"),
            &["state.json"],
        );
        match ended.fault {
            None if ended.accepted => Ok(folder.read("state.json")),
            fault => Err(fault.unwrap_or(ended.refusal)),
        }
    });
    state.as_deref().map_err(Clone::clone)
}

/// Changes a value somewhere below.
fn changed(source: &mut Source, value: &mut Value) {
    match value {
        Value::Object(entries) if !entries.is_empty() && source.chance(0.995) => {
            let at = source.below(entries.len());
            let Some(key) = entries.keys().nth(at).cloned() else {
                return;
            };
            if source.chance(0.01) {
                entries.remove(&key);
            } else if let Some(inner) = entries.get_mut(&key) {
                changed(source, inner);
            }
        }
        Value::Array(items) if !items.is_empty() && source.chance(0.995) => {
            let at = source.below(items.len());
            match source.below(100) {
                0 => drop(items.remove(at)),
                1 => items.insert(at, items[at].clone()),
                2 => items.truncate(at),
                _ => changed(source, &mut items[at]),
            }
        }
        _ => *value = other(source, value),
    }
}

/// Another value, mostly of the same type.
fn other(source: &mut Source, value: &Value) -> Value {
    if source.chance(0.03) {
        return [Value::Null, json!("x"), json!([]), json!(true), json!(-1)][source.below(5)]
            .clone();
    }
    match value {
        Value::Bool(value) => json!(!value),
        Value::Number(number) if number.is_u64() => {
            let near = number.as_u64().unwrap_or(0);
            [
                json!(0),
                json!(1),
                json!(near.wrapping_add(1)),
                json!(u32::MAX),
                json!(u64::MAX),
            ][source.below(5)]
            .clone()
        }
        Value::Number(number) => {
            let near = number.as_f64().unwrap_or(0.0);
            let edge = source.number().parse::<f64>().unwrap_or(0.0);
            [json!(near * 1.5), json!(-near), json!(edge), json!(0.0)][source.below(4)].clone()
        }
        _ => json!(source.name()),
    }
}

/// A state with some of its values changed. Its checksum is that of the numbers as they now stand.
fn forged(source: &mut Source, state: &[u8]) -> Vec<u8> {
    let Ok(mut file) = serde_json::from_slice::<Value>(state) else {
        return state.to_vec();
    };
    for _ in 0..=source.below(3) {
        if let Some(inner) = file.get_mut("state") {
            changed(source, inner);
        }
    }
    if let Ok(state) = serde_json::from_value::<monitor::State>(file["state"].clone()) {
        let text = serde_json::to_vec(&state).unwrap_or_default();
        file["checksum"] = json!(crc32fast::hash(&text));
    }
    serde_json::to_vec(&file).unwrap_or_default()
}

/// A run that continues from a saved state.
pub(super) fn case(source: &mut Source) -> Ended {
    let state = match written(source.below(ROWS.len())) {
        Ok(state) => state,
        Err(fault) => {
            return Ended::without_process(false, String::new(), Some(fault));
        }
    };
    let folder = Folder::new();
    folder.write("model.toml", MODEL);
    let forge = source.chance(0.85);
    folder.write(
        "state.json",
        if forge {
            forged(source, state)
        } else {
            source.damaged(state, ',')
        },
    );
    let rows = streams::rows(source, 60, 800.0);
    folder.write("rows.csv", HEADER.to_string() + &rows.join("\n") + "\n");
    folder.run(
        "monitor --model model.toml --learn 100 --state state.json --estimates --interval 20",
        Some("rows.csv"),
        &["state.json"],
    )
}
