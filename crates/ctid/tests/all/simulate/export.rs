//! Models and curves exported.

use super::{FILE, column, place, table};
use crate::common::Place;

#[test]
fn what_is_exported_reads_back() {
    let place = place();
    let said = place.succeeds("export m.toml a.csv --modelica fitted.mo --csv curves.csv");
    assert!(
        said.contains("wrote fitted.mo") && said.contains("wrote curves.csv"),
        "{said}"
    );
    let text = place.read("fitted.mo");
    assert!(
        text.starts_with("// Written by ctid export from block.mo, fitted to a.csv."),
        "{text}"
    );
    assert!(
        text.contains("//   C: known, not fitted") && text.contains("//   k: "),
        "{text}"
    );
    place.succeeds("check fitted.mo");
    // A simulation of the exported file gives the curves of the fit.
    place.write("again.toml", FILE.replace("block.mo", "fitted.mo"));
    let inputs = place.read("a.csv");
    let inputs = inputs.lines().map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[..3].join(",") + "\n"
    });
    place.write("inputs.csv", inputs.collect::<String>());
    place.succeeds("simulate again.toml inputs.csv --out again.csv");
    let (curves, again) = (place.read("curves.csv"), place.read("again.csv"));
    for (name, unit) in [("block", "degC"), ("loss", "W")] {
        let model = column(&curves, &format!("{name} model [{unit}]"));
        let own = column(&again, &format!("{name} [{unit}]"));
        assert_eq!(model.len(), 300);
        for (model, own) in model.iter().zip(&own) {
            assert!(
                (model - own).abs() < 1e-9 * (1.0 + model.abs()),
                "{model} {own}"
            );
        }
        let measured = column(&curves, &format!("{name} [{unit}]"));
        let residual = column(&curves, &format!("{name} residual [{unit}]"));
        for ((y, m), r) in measured.iter().zip(&model).zip(&residual) {
            assert!((y - m - r).abs() < 1e-12 * (1.0 + y.abs()));
        }
    }
    // The curves are a record: a fit to it gives the same result.
    place.succeeds("simulate m.toml inputs.csv --fit curves.csv --out of-curves.csv");
    place.succeeds("simulate m.toml inputs.csv --fit a.csv --out of-record.csv");
    assert_eq!(place.read("of-curves.csv"), place.read("of-record.csv"));
    // Without records the values are those of the text and of [known].
    place.succeeds("export m.toml --modelica plain.mo");
    let plain = place.read("plain.mo");
    assert!(
        plain.contains("nothing was fitted") && plain.contains("C(unit=\"J/K\", min=0) = 52 "),
        "{plain}"
    );
    assert!(plain.contains("k(unit=\"W/K\", min=0) = 0.1 "), "{plain}");
}

#[test]
fn what_cannot_be_exported_is_refused_in_one_line() {
    let place = place();
    place.refuses(
        "export m.toml a.csv --modelica block.mo",
        &["block.mo", "one of the inputs"],
    );
    place.write("mine.mo", "// mine\n");
    place.refuses(
        "export m.toml --modelica mine.mo",
        &["mine.mo", "the file exists already"],
    );
    place.refuses("export m.toml", &["--modelica", "--csv"]);
    place.refuses("export m.toml --csv c.csv", &["DATA.csv"]);
    place.write("tank.toml", "plant = \"single-tank\"\n");
    place.refuses(
        "export tank.toml --modelica t.mo",
        &[
            "tank.toml: a model file of a plant contains start values",
            "DATA.csv",
        ],
    );
}

#[test]
fn the_curves_of_a_plant_are_exported() {
    let place = Place::new();
    place.succeeds("export tour.toml tour.csv --csv curves.csv");
    let (curves, record) = (place.read("curves.csv"), place.read("tour.csv"));
    let (head, rows) = table(&curves);
    assert_eq!(
        head,
        [
            "record",
            "t [s]",
            "u [V]",
            "y [cm]",
            "y model [cm]",
            "y residual [cm]"
        ]
    );
    assert!(rows.iter().all(|row| row[0] == "tour.csv"));
    for name in ["t [s]", "u [V]", "y [cm]"] {
        assert_eq!(column(&curves, name), column(&record, name));
    }
    let residual = column(&curves, "y residual [cm]");
    let rms = (residual.iter().map(|r| r * r).sum::<f64>() / residual.len() as f64).sqrt();
    let compared = place.result("compare tour.csv --model tour.toml");
    let rmse = compared["steps"][0]["rmse"].as_f64().unwrap();
    assert!((rms / rmse - 1.0).abs() < 1e-6, "{rms} {rmse}");
}

/// The effect of the bundled record, as the effect at a port of the plant's text.
#[test]
fn a_plant_with_an_effect_is_exported_as_modelica() {
    let place = Place::new();
    place.succeeds("add overflow --model tour.toml");
    place.succeeds("export tour.toml tour.csv --modelica mended.mo");
    let text = place.read("mended.mo");
    assert!(
        text.contains("fitted to tour.csv") && text.contains("overflow is limit(level)"),
        "{text}"
    );
    place.succeeds("check mended.mo");
    place.write(
        "mended.toml",
        "model = \"mended.mo\"\n[columns]\ntime = \"t [s]\"\nu = \"u [V]\"\nlevel = \"y [cm]\"\n",
    );
    // A simulation of the text has the error of the plant's fit, without another fit.
    let record = place.read("tour.csv");
    place.succeeds("simulate mended.toml tour.csv --out again.csv");
    let (measured, again) = (
        column(&record, "y [cm]"),
        column(&place.read("again.csv"), "y [cm]"),
    );
    let squares = measured
        .iter()
        .zip(&again)
        .map(|(y, model)| (y - model).powi(2));
    let of_text = (squares.sum::<f64>() / measured.len() as f64).sqrt();
    let of_plant = place.result("compare tour.csv --model tour.toml");
    let of_plant = of_plant["steps"][0]["rmse"].as_f64().unwrap();
    assert!(
        (of_text / of_plant - 1.0).abs() < 0.01,
        "{of_text} {of_plant}"
    );
    // The text has no such parameter.
    place.write(
        "fixed.toml",
        place.read("tour.toml") + "\n[effect.overflow]\nrim = 20.0\nfixed = [\"rim\"]\n",
    );
    place.refuses(
        "export fixed.toml tour.csv --modelica fixed.mo",
        &["fixed.toml: --modelica: overflow.rim is given"],
    );
}

/// With a measured flow into the lower tank, of which both levels are read.
#[test]
fn a_plant_of_several_inputs_and_outputs_is_exported_as_modelica() {
    let place = Place::new();
    let mut text = String::from("t [s],u [V],d [l/min],a [cm],b [cm]\n");
    let (mut upper, mut lower) = (9.0_f64, 9.0_f64);
    for k in 0..400 {
        let u = if k / 30 % 2 == 0 { 4.0 } else { 5.5 };
        let d = if k / 47 % 2 == 0 { 0.0 } else { 2.0 };
        let noise = 0.02 * (7.0 * f64::from(k)).sin();
        text += &format!("{k},{u},{d},{:.4},{:.4}\n", upper + noise, lower - noise);
        for _ in 0..100 {
            let (above, below) = (5.0 * upper.sqrt(), 6.0 * lower.sqrt());
            upper += 0.01 * (3.3 * u - above) / 20.0;
            lower += 0.01 * (above + 1.5 * d - below) / 20.0;
        }
    }
    place.write("d.csv", text);
    place.write(
        "tank.toml",
        "plant = \"cascaded-tanks\"\n[known]\nmeasured = [\"upper\", \"lower\"]\ndisturbance = \"lower\"\narea_upper = 20.0\narea_lower = 20.0\n[columns]\ntime = \"t [s]\"\ninput = \"u [V]\"\ninput_2 = \"d [l/min]\"\noutput = [\"a [cm]\", \"b [cm]\"]\n",
    );
    place.succeeds("export tank.toml d.csv --modelica tank.mo --csv curves.csv");
    place.succeeds("check tank.mo");
    place.write(
        "own.toml",
        "model = \"tank.mo\"\n[columns]\ntime = \"t [s]\"\nu = \"u [V]\"\nd = \"d [l/min]\"\nlevel_upper = \"a [cm]\"\nlevel_lower = \"b [cm]\"\n",
    );
    let record = place.read("d.csv");
    let inputs = record.lines().map(|line| {
        let cells: Vec<&str> = line.split(',').take(3).collect();
        cells.join(",") + "\n"
    });
    place.write("in.csv", inputs.collect::<String>());
    place.succeeds("simulate own.toml in.csv --out y.csv");
    let curves = place.read("curves.csv");
    for output in ["a", "b"] {
        let own = column(&place.read("y.csv"), &format!("{output} [cm]"));
        let model = column(&curves, &format!("{output} model [cm]"));
        assert_eq!(own.len(), model.len());
        for (own, model) in own.iter().zip(&model) {
            assert!((own - model).abs() < 1e-5, "{own} {model}");
        }
    }
}

#[test]
fn a_plant_is_exported_as_modelica_and_reads_back() {
    let place = Place::new();
    place.succeeds("export tour.toml tour.csv --modelica tank.mo --csv curves.csv");
    place.succeeds("check tank.mo");
    place.write(
        "own.toml",
        "model = \"tank.mo\"\n[columns]\ntime = \"t [s]\"\nu = \"u [V]\"\nlevel = \"y [cm]\"\n",
    );
    let record = place.read("tour.csv");
    let inputs = record
        .lines()
        .map(|line| line.rsplit_once(',').unwrap().0.to_string() + "\n");
    place.write("in.csv", inputs.collect::<String>());
    place.succeeds("simulate own.toml in.csv --out y.csv");
    let own = column(&place.read("y.csv"), "y [cm]");
    let model = column(&place.read("curves.csv"), "y model [cm]");
    assert_eq!(own.len(), model.len());
    for (own, model) in own.iter().zip(&model) {
        assert!((own - model).abs() < 1e-5, "{own} {model}");
    }
}
