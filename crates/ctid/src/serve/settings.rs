//! Settings of the model in the page's form: read from a model file, and written into it with comments and layout preserved.

use ct_signals::{Columns, Hold};
use plants::{EffectInfo, Plant};
use serde::{Deserialize, Serialize};
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

use crate::edit::{self, Edited};
use crate::{Error, model_file};

/// The part of a model file in the form. Every entry is optional; the content is checked as a model file after writing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Settings {
    plant: String,
    hold: Hold,
    columns: Columns,
    known: Known,
    controller: Option<Controller>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Known {
    area: Option<f64>,
    area_upper: Option<f64>,
    area_lower: Option<f64>,
    area_1: Option<f64>,
    area_2: Option<f64>,
    area_3: Option<f64>,
    pipe_area: Option<f64>,
    gravity: Option<f64>,
    measured: Option<Measured>,
    disturbance: Option<String>,
    tank_height: Option<f64>,
    input_range: Option<f64>,
}

/// Tanks with measured levels: one, or as many as there are outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Measured {
    One(String),
    Several(Vec<String>),
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Controller {
    #[serde(rename = "type")]
    kind: String,
    gain: Option<f64>,
    integral_time: Option<f64>,
    variable: Option<String>,
    r: Option<Vec<f64>>,
    s: Option<Vec<f64>>,
    u_min: Option<f64>,
    u_max: Option<f64>,
}

/// Content of a form: the current values, and the values before editing. The form of an empty model was empty.
#[derive(Debug, Deserialize)]
pub(super) struct Form {
    #[serde(flatten)]
    to: Settings,
    #[serde(default)]
    from: Settings,
}

impl Form {
    /// Writes the settings of the form into the text.
    ///
    /// # Errors
    /// [`Error::Changed`] where the text says something else than the form was filled from; if the result is not a model file.
    pub(super) fn written_into(&self, file: &str, text: &str) -> Result<Edited, Error> {
        let differing = differing(&self.from, &Settings::of(text));
        if !differing.is_empty() {
            let what = format!(
                "{} changed meanwhile, in another tab or by a command",
                differing.join(", ")
            );
            return Err(edit::changed(file, &what));
        }
        self.to.written_into(file, text)
    }
}

/// Keys of the model file in which two settings differ.
fn differing(a: &Settings, b: &Settings) -> Vec<String> {
    // Compared as the page has them: values that are not finite are null there.
    let [a, b] = [a, b].map(|settings| serde_json::to_value(settings).unwrap_or_default());
    let keys = a.as_object().into_iter().flat_map(|all| all.keys());
    let mut differing = Vec::new();
    for key in keys {
        match (a[key].as_object(), b[key].as_object()) {
            (Some(x), Some(y)) => {
                let inner = x.keys().filter(|inner| x.get(*inner) != y.get(*inner));
                differing.extend(inner.map(|inner| format!("{key}.{inner}")));
            }
            _ if a[key] != b[key] => differing.push(key.clone()),
            _ => {}
        }
    }
    differing
}

impl Settings {
    /// Settings of a text; unreadable parts are empty, and [`model_file::parse`] reports the error.
    pub(super) fn of(text: &str) -> Self {
        toml::from_str(text).unwrap_or_default()
    }

    /// The text with these settings; other entries do not change.
    ///
    /// # Errors
    /// If the result is not a model file.
    fn written_into(&self, file: &str, text: &str) -> Result<Edited, Error> {
        // If the settings cannot be read, the form is empty, and writing it would delete entries.
        if toml::from_str::<Self>(text).is_err() {
            model_file::parse(file, text)?;
        }
        let mut document = edit::document(file, text)?;
        let root = document.as_table_mut();
        put(root, "plant", Some(self.plant.as_str().into()));
        if !root.contains_key("effects") {
            root.insert("effects", Item::Value(Array::new().into()));
        }
        let hold = match self.hold {
            Hold::Zero => "zero",
            Hold::First => "first",
        };
        if root.contains_key("hold") || self.hold != Hold::Zero {
            put(root, "hold", Some(hold.into()));
        }
        let word = |word: &Option<String>| {
            let word = word.as_deref().filter(|w| !w.trim().is_empty());
            word.map(Value::from)
        };
        let names = |names: &[String]| -> Option<Value> {
            let mut given = names.iter().filter(|name| !name.trim().is_empty());
            let first = given.next()?;
            let others: Vec<&String> = given.collect();
            if others.is_empty() {
                return Some(first.as_str().into());
            }
            Some(
                std::iter::once(first)
                    .chain(others)
                    .collect::<Array>()
                    .into(),
            )
        };
        // The first one is guessed where only the second is named.
        let second = match &self.columns.inputs[..] {
            [first, second] if first.trim().is_empty() => Some(second.as_str().into()),
            _ => None,
        };
        let columns = [
            ("time", word(&self.columns.time)),
            (
                "input",
                names(if second.is_some() {
                    &[]
                } else {
                    &self.columns.inputs
                }),
            ),
            ("input_2", second),
            ("output", names(&self.columns.outputs)),
            ("reference", names(&self.columns.references)),
            ("time_format", word(&self.columns.time_format)),
            ("time_zone", word(&self.columns.time_zone)),
        ];
        section(&mut document, file, "columns", columns)?;
        let number = |value: Option<f64>| value.map(Value::from);
        let known = [
            (
                "measured",
                match &self.known.measured {
                    None => None,
                    Some(Measured::One(name)) => word(&Some(name.clone())),
                    Some(Measured::Several(all)) => names(all),
                },
            ),
            ("disturbance", word(&self.known.disturbance)),
            ("area", number(self.known.area)),
            ("area_upper", number(self.known.area_upper)),
            ("area_lower", number(self.known.area_lower)),
            ("area_1", number(self.known.area_1)),
            ("area_2", number(self.known.area_2)),
            ("area_3", number(self.known.area_3)),
            ("pipe_area", number(self.known.pipe_area)),
            ("gravity", number(self.known.gravity)),
            ("tank_height", number(self.known.tank_height)),
            ("input_range", number(self.known.input_range)),
        ];
        section(&mut document, file, "known", known)?;
        // The list of sensors is now known.
        forget_places(document.as_table_mut(), &self.plant);
        match &self.controller {
            None => {
                document.remove("controller");
            }
            Some(controller) => {
                let list = |list: &Option<Vec<f64>>| {
                    list.as_ref()
                        .map(|l| Value::Array(l.iter().copied().collect()))
                };
                let entries = [
                    ("type", word(&Some(controller.kind.clone()))),
                    ("gain", number(controller.gain)),
                    ("integral_time", number(controller.integral_time)),
                    ("variable", word(&controller.variable)),
                    ("r", list(&controller.r)),
                    ("s", list(&controller.s)),
                    ("u_min", number(controller.u_min)),
                    ("u_max", number(controller.u_max)),
                ];
                section(&mut document, file, "controller", entries)?;
            }
        }
        let text = document.to_string();
        model_file::parse(file, &text)?;
        Ok(Edited {
            text,
            done: format!("{file}: settings written"),
        })
    }
}

/// Removes places that this plant does not have from effects that are not in the model: such a place would cause errors with another plant,
/// and `ctid add` asks for the place again.
fn forget_places(root: &mut Table, plant: &str) {
    let Ok(plant) = plant.parse::<Plant>() else {
        return;
    };
    let on = root.get("effects").and_then(Item::as_array);
    let on: Vec<String> = on
        .into_iter()
        .flatten()
        .filter_map(|id| id.as_str().map(str::to_string))
        .collect();
    let known = known_outputs(root, plant);
    let Some(tables) = root.get_mut("effect").and_then(Item::as_table_like_mut) else {
        return;
    };
    for (id, table) in tables.iter_mut() {
        let effect = EffectInfo::find(id.get()).filter(|_| !on.iter().any(|on| on == id.get()));
        let (Some(effect), Some(table)) = (effect, table.as_table_like_mut()) else {
            continue;
        };
        let place = table.get("where").and_then(Item::as_str);
        if place.is_some_and(|word| model_file::vessel(plant, &known, effect, word).is_err()) {
            table.remove("where");
        }
    }
}

/// Measured levels that the file names.
fn known_outputs(root: &Table, plant: Plant) -> plants::Known {
    let measured = root
        .get("known")
        .and_then(Item::as_table_like)
        .and_then(|known| known.get("measured")?.as_array());
    let vessel = |word: &str| (0..plant.vessels()).find(|&i| plant.vessel_name(i) == Some(word));
    let words = measured
        .into_iter()
        .flatten()
        .filter_map(|word| word.as_str());
    plants::Known {
        measured: words.filter_map(vessel).collect(),
        ..plants::Known::default()
    }
}

/// Writes the entries of a table; creates the table if there are entries and no table exists.
fn section<const N: usize>(
    document: &mut DocumentMut,
    file: &str,
    name: &str,
    entries: [(&str, Option<Value>); N],
) -> Result<(), Error> {
    if !document.contains_key(name) && entries.iter().all(|(_, value)| value.is_none()) {
        return Ok(());
    }
    let mut new = Table::new();
    new.decor_mut().set_prefix("\n");
    let table = document
        .entry(name)
        .or_insert(Item::Table(new))
        .as_table_like_mut()
        .ok_or_else(|| Error::File {
            file: file.to_string(),
            what: format!("[{name}] is not a table; make it one"),
        })?;
    for (key, value) in entries {
        put(table, key, value);
    }
    Ok(())
}

/// Sets the value of a key; an equal value keeps its notation, and a comment after the value stays.
fn put(table: &mut dyn TableLike, key: &str, value: Option<Value>) {
    let Some(mut value) = value else {
        table.remove(key);
        return;
    };
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) if same(old, &value) => {}
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

fn number(value: &Value) -> Option<f64> {
    value
        .as_float()
        .or_else(|| value.as_integer().map(|integer| integer as f64))
}

fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::String(a), Value::String(b)) => a.value() == b.value(),
        (Value::Array(a), Value::Array(b)) => a.iter().map(number).eq(b.iter().map(number)),
        _ => number(a).is_some() && number(a) == number(b),
    }
}

#[cfg(test)]
mod tests;
