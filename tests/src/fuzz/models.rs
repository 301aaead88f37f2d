//! Model files: every table and key, in any combination.

use plants::{CATALOGUE, Plant};

use super::Ended;
use super::process::Folder;
use super::records;
use super::source::Source;

/// A model file that fits most records.
pub(super) fn plain(source: &mut Source) -> String {
    let plants = [
        "single-tank",
        "single-tank-linear",
        "cascaded-tanks",
        "cascaded-tanks-linear",
        "first-order",
    ];
    let plant = if source.chance(0.5) {
        "single-tank"
    } else {
        source.pick(&plants)
    };
    let known = match plant {
        "single-tank" => "[known]\narea = 154.0\n",
        _ => "",
    };
    format!("plant = \"{plant}\"\neffects = []\n{known}")
}

/// A key and a value; of a number now and then one at an edge, or a word.
fn entry(source: &mut Source, key: &str, low: f64, high: f64) -> String {
    let value = if source.chance(0.95) {
        format!("{:.4}", source.uniform(low, high))
    } else {
        source.number()
    };
    format!("{key} = {value}\n")
}

fn list(source: &mut Source, most: usize) -> String {
    let numbers: Vec<String> = (0..source.below(most)).map(|_| source.number()).collect();
    format!("[{}]", numbers.join(", "))
}

fn known(source: &mut Source, plant: Plant) -> String {
    let mut text = "[known]\n".to_string();
    match plant {
        Plant::CascadedTanks => {
            text += &entry(source, "area_upper", 100.0, 200.0);
            text += &entry(source, "area_lower", 100.0, 200.0);
        }
        Plant::ThreeTank => {
            let tanks = ["T1", "T2", "T3", "T4"];
            text += &format!("measured = \"{}\"\n", source.pick(&tanks));
            text += &entry(source, "area", 100.0, 200.0);
            if source.chance(0.5) {
                text += "pipe_area = 0.5\ngravity = 981.0\n";
            }
        }
        _ if source.chance(0.7) => text += &entry(source, "area", 100.0, 200.0),
        _ => {}
    }
    for (key, low, high) in [("tank_height", 10.0, 60.0), ("input_range", 5.0, 12.0)] {
        if source.chance(0.2) {
            text += &entry(source, key, low, high);
        }
    }
    text
}

fn effect(source: &mut Source, id: &str) -> String {
    let mut text = format!("[effect.{id}]\n");
    if source.chance(0.6) {
        let places = [
            "upper", "lower", "T1", "T2", "T3", "pump_1", "pump_2", "sensor",
        ];
        text += &format!("where = \"{}\"\n", source.pick(&places));
    }
    for name in ["time_constant", "rim", "height", "size", "fixed"] {
        if source.chance(0.15) {
            text += &entry(source, name, 0.0, 30.0);
        }
    }
    text
}

fn controller(source: &mut Source) -> String {
    let mut text = "[controller]\n".to_string();
    if source.chance(0.6) {
        text += "type = \"PI\"\n";
        text += &entry(source, "gain", 0.1, 2.0);
        text += &entry(source, "integral_time", 10.0, 300.0);
    } else {
        text += &format!(
            "type = \"RS\"\nr = {}\ns = {}\n",
            list(source, 5),
            list(source, 5)
        );
        if source.chance(0.5) {
            text += "variable = \"p\"\n";
        }
    }
    for (key, low, high) in [("u_min", -1.0, 3.0), ("u_max", 7.0, 12.0)] {
        if source.chance(0.4) {
            text += &entry(source, key, low, high);
        }
    }
    text
}

fn term(source: &mut Source) -> String {
    let places = [
        "actuator", "sensor", "vessel", "upper", "lower", "T1", "nowhere",
    ];
    let variables = ["level", "rate", "input", "time", "u"];
    let (place, variable) = (source.pick(&places), source.pick(&variables));
    let mut text = format!("[term.mine]\nplace = \"{place}\"\nvariable = \"{variable}\"\n");
    if source.chance(0.8) {
        text += "at = [8.0, 11.0, 14.0]\nvalue = [-0.3, -4.0, -6.0]\n";
    } else {
        text += &format!("at = {}\nvalue = {}\n", list(source, 6), list(source, 6));
    }
    text + ["", "fixed = true\n", "unit = \"cm\"\n", "at_unit = \"m\"\n"][source.below(4)]
}

/// A model file.
pub(super) fn text(source: &mut Source) -> Vec<u8> {
    let plant = if source.chance(0.4) {
        Plant::SingleTank
    } else {
        Plant::ALL[source.below(Plant::ALL.len())]
    };
    let mut effects: Vec<&str> = Vec::new();
    for _ in 0..source.below(4) {
        let id = CATALOGUE[source.below(CATALOGUE.len())].id;
        if !effects.contains(&id) || source.chance(0.1) {
            effects.push(id);
        }
    }
    let own = source.chance(0.15);
    if own {
        effects.push("mine");
    }
    let quoted: Vec<String> = effects.iter().map(|id| format!("\"{id}\"")).collect();
    let mut tables = vec![known(source, plant)];
    for id in effects.iter().filter(|id| **id != "mine") {
        if source.chance(0.4) {
            tables.push(effect(source, id));
        }
    }
    if own {
        tables.push(term(source));
    }
    if source.chance(0.2) {
        tables.push(controller(source));
    }
    if source.chance(0.2) {
        tables.push(
            "[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\noutput = \"y [cm]\"\n".to_string(),
        );
        if source.chance(0.5) {
            tables.push(String::from("[start]\n") + &entry(source, "pump_gain", 5.0, 15.0));
        }
    }
    let hold = ["", "", "", "hold = \"first\"\n", "hold = \"zero\"\n"][source.below(5)];
    let head = format!(
        "plant = \"{}\"\neffects = [{}]\n{hold}",
        plant.id(),
        quoted.join(", ")
    );
    let text = head + "\n" + &tables.join("\n");
    if source.chance(0.5) {
        source.damaged(text.as_bytes(), '=')
    } else {
        text.into_bytes()
    }
}

/// A record that every model reads.
pub(super) fn record(source: &mut Source) -> String {
    let mut text = "t [s],u [V],y [cm],r [cm],u2 [V]\n".to_string();
    let (mut u, mut level) = (5.0, 16.0);
    for k in 0..50 {
        if k % 8 == 0 {
            u = source.uniform(3.5, 6.5);
        }
        text += &format!(
            "{},{u:.3},{:.3},16,{:.3}\n",
            2 * k,
            level + 0.05 * source.normal(),
            10.0 - u
        );
        level += 0.08 * (0.64 * u * u - level);
    }
    text
}

/// A run on a model file.
pub(super) fn case(source: &mut Source) -> Ended {
    let folder = Folder::new();
    folder.write("model.toml", text(source));
    if source.chance(0.3) {
        return edited(source, &folder);
    }
    for name in ["data.csv", "other.csv"] {
        folder.write(name, record(source));
    }
    folder.run(&records::command(source), None, &records::OUTPUTS)
}

/// The added entry can be read, and removed.
fn edited(source: &mut Source, folder: &Folder) -> Ended {
    let id = CATALOGUE[source.below(CATALOGUE.len())].id;
    let before = folder.read("model.toml");
    let added = folder.run(
        &format!("add {id} --model model.toml"),
        None,
        &["model.toml"],
    );
    if !added.accepted || added.fault.is_some() {
        return added;
    }
    if folder.read("model.toml") == before {
        let fault = Some(format!(
            "add {id} says that it is done, and nothing was written"
        ));
        return Ended { fault, ..added };
    }
    let removed = folder.run(
        &format!("remove {id} --model model.toml"),
        None,
        &["model.toml"],
    );
    if !removed.accepted && removed.fault.is_none() {
        let fault = Some(format!("what add {id} wrote cannot be read again"));
        return Ended { fault, ..removed };
    }
    if removed.fault.is_none() && id_is_gone(&folder.read("model.toml"), id) {
        return removed;
    }
    let fault = removed
        .fault
        .clone()
        .unwrap_or(format!("remove {id} leaves it in effects"));
    Ended {
        fault: Some(fault),
        ..removed
    }
}

/// Whether no line `effects` names it.
fn id_is_gone(text: &[u8], id: &str) -> bool {
    let text = String::from_utf8_lossy(text);
    let mut lines = text.lines().filter(|line| line.starts_with("effects"));
    !lines.any(|line| {
        line.split('#')
            .next()
            .unwrap_or_default()
            .contains(&format!("\"{id}\""))
    })
}
