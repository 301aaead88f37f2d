//! Units as engineers write them in headers, and their conversions.

use super::*;
use approx::assert_relative_eq;
use proptest::prelude::*;

fn unit(text: &str) -> Unit {
    Unit::parse(text).unwrap_or_else(|| panic!("{text} is not understood"))
}

fn convert(value: f64, from: &str, to: &str) -> Option<f64> {
    Some(unit(from).conversion_to(&unit(to))?.apply(value))
}

/// Units as in headers, with the word for the quantity, and the size in SI units.
const HEADERS: &[(&str, &str, f64)] = &[
    ("l/min", "flow", 1e-3 / 60.0),
    ("L/h", "flow", 1e-3 / 3600.0),
    ("m3/h", "flow", 1.0 / 3600.0),
    ("m^3/h", "flow", 1.0 / 3600.0),
    ("m**3/h", "flow", 1.0 / 3600.0),
    ("m³ / h", "flow", 1.0 / 3600.0),
    ("cm³/s", "flow", 1e-6),
    ("lmin", "flow", 1e-3 / 60.0),
    ("ml", "volume", 1e-6),
    ("mL", "volume", 1e-6),
    ("l", "volume", 1e-3),
    ("L", "volume", 1e-3),
    ("litre", "volume", 1e-3),
    ("litres", "volume", 1e-3),
    ("Liter", "volume", 1e-3),
    ("dm^3", "volume", 1e-3),
    ("gal", "volume", 0.003_785_411_784),
    ("bar", "pressure", 1e5),
    ("mbar", "pressure", 100.0),
    ("Pa", "pressure", 1.0),
    ("kPa", "pressure", 1e3),
    ("N/mm2", "pressure", 1e6),
    ("psi", "pressure", 6_894.757_293_168_361),
    ("%", "ratio", 0.01),
    ("pct", "ratio", 0.01),
    ("percent", "ratio", 0.01),
    ("1", "ratio", 1.0),
    ("-", "ratio", 1.0),
    ("V", "voltage", 1.0),
    ("volts", "voltage", 1.0),
    ("mV", "voltage", 1e-3),
    ("A", "current", 1.0),
    ("mA", "current", 1e-3),
    ("kΩ", "resistance", 1e3),
    ("W", "power", 1.0),
    ("kW", "power", 1e3),
    ("kWh", "energy", 3.6e6),
    ("W/m²", "irradiance", 1.0),
    ("m", "length", 1.0),
    ("cm", "length", 0.01),
    ("mm", "length", 1e-3),
    ("µm", "length", 1e-6),
    ("in", "length", 0.0254),
    ("cm2", "area", 1e-4),
    ("m/s^2", "acceleration", 1.0),
    ("m/s/s", "acceleration", 1.0),
    ("m s-2", "acceleration", 1.0),
    ("m·s⁻²", "acceleration", 1.0),
    ("km/h", "velocity", 1.0 / 3.6),
    ("kg/h", "mass flow", 1.0 / 3600.0),
    ("kg/m3", "density", 1.0),
    ("J/K", "heat capacity", 1.0),
    ("kJ/degC", "heat capacity", 1e3),
    ("W/K", "thermal conductance", 1.0),
    ("K/W", "thermal resistance", 1.0),
    ("J/(kg K)", "specific heat capacity", 1.0),
    ("kJ/(kg*°C)", "specific heat capacity", 1e3),
    ("N", "force", 1.0),
    ("Nm", "energy", 1.0),
    ("N m", "energy", 1.0),
    ("kg.m.m/s2", "energy", 1.0),
    ("s", "time", 1.0),
    ("min", "time", 60.0),
    ("h", "time", 3600.0),
    ("d", "time", 86_400.0),
    ("ms", "time", 1e-3),
    ("us", "time", 1e-6),
    ("μs", "time", 1e-6),
    ("K/min", "heating rate", 1.0 / 60.0),
    ("mol/l", "concentration", 1e3),
    ("rpm", "frequency", 1.0 / 60.0),
    ("1/min", "frequency", 1.0 / 60.0),
    ("min^-1", "frequency", 1.0 / 60.0),
    ("Hz", "frequency", 1.0),
    ("kHz", "frequency", 1e3),
    ("1/s", "frequency", 1.0),
];

#[test]
fn what_engineers_write_in_headers_is_understood() {
    for &(text, kind, size) in HEADERS {
        let unit = unit(text);
        assert_eq!(unit.kind(), Some(kind), "{text}");
        assert_relative_eq!(unit.size.0 / unit.size.1, size, max_relative = 1e-15);
    }
    for (text, kind) in [
        ("degC", Some("temperature")),
        ("°C", Some("temperature")),
        ("C", Some("temperature")),
        ("deg C", Some("temperature")),
        ("K", Some("temperature")),
        ("degF", Some("temperature")),
        ("rad", Some("angle")),
        ("deg", Some("angle")),
        ("rad/s", Some("angular velocity")),
        ("Nm/rad", None),
        ("V/m", None),
    ] {
        assert_eq!(unit(text).kind(), kind, "{text}");
    }
}

#[test]
fn what_is_not_plain_is_not_understood() {
    for text in [
        "", " ", "x", "bananas", "J/kg K", "W/m2K", "m/", "/s", "m//s", "m^", "m^0", "m^2.5",
        "m22", "m2x", "(m", "m)", "((m))", "10 m", "0", "--", "m*", "mC", "kmin", "bar(g)", "m^-",
        "mmm", "V²²", "é", "m × s",
    ] {
        assert_eq!(Unit::parse(text), None, "{text}");
    }
    assert_eq!(Unit::parse(&"m9 ".repeat(1000)), None);
    assert_eq!(Unit::parse(&"(".repeat(100_000)), None);
}

#[test]
fn values_are_converted() {
    for (value, from, to, expected) in [
        (3.0, "m3/h", "l/min", 50.0),
        (1.0, "m", "mm", 1000.0),
        (250.0, "mm", "m", 0.25),
        (50.0, "%", "1", 0.5),
        (1.0, "gal", "litres", 3.785_411_784),
        (20.0, "degC", "K", 293.15),
        (300.0, "K", "C", 26.85),
        (100.0, "degC", "degF", 212.0),
        (-40.0, "°F", "°C", -40.0),
        (1.8, "W/degC", "W/degF", 1.0),
        (2.0, "W/degC", "W/K", 2.0),
        (90.0, "deg", "rad", std::f64::consts::FRAC_PI_2),
        (60.0, "rpm", "rad/s", std::f64::consts::TAU),
        (60.0, "rpm", "deg/s", 360.0),
        (1500.0, "rpm", "1/min", 1500.0),
        (1500.0, "1/min", "rpm", 1500.0),
        (50.0, "Hz", "rpm", 3000.0),
        (50.0, "Hz", "1/s", 50.0),
        (1.0, "kWh", "MJ", 3.6),
        (1.0, "Nm", "J", 1.0),
    ] {
        let found = convert(value, from, to).unwrap();
        assert_relative_eq!(found, expected, max_relative = 1e-14);
    }
    for (from, to, factor, offset) in [
        ("m", "mm", 1000.0, 0.0),
        ("h", "s", 3600.0, 0.0),
        ("degC", "degF", 1.8, 32.0),
        ("degC", "K", 1.0, 273.15),
        ("rpm", "1/min", 1.0, 0.0),
    ] {
        let exact = Conversion { factor, offset };
        assert_eq!(unit(from).conversion_to(&unit(to)), Some(exact));
    }
    assert!(
        unit("l/min")
            .conversion_to(&unit("L min^-1"))
            .unwrap()
            .is_identity()
    );
    assert!(
        !unit("degC")
            .conversion_to(&unit("K"))
            .unwrap()
            .is_identity()
    );
}

#[test]
fn different_quantities_are_not_converted() {
    for (from, to) in [
        ("m", "m2"),
        ("V", "A"),
        ("kg/h", "l/h"),
        ("rad", "1"),
        ("deg", "%"),
        ("rad/s", "1/s"),
        ("1/min", "deg/s"),
        ("Nm/rad", "Nm"),
        ("degC", "W"),
    ] {
        assert_eq!(convert(1.0, from, to), None, "{from} to {to}");
        assert_eq!(convert(1.0, to, from), None, "{to} to {from}");
    }
}

proptest! {
    #[test]
    fn a_conversion_has_its_inverse(
        from in 0..HEADERS.len() + 4,
        to in 0..HEADERS.len() + 4,
        value in -1e6..1e6_f64,
    ) {
        let text = |index: usize| {
            HEADERS.get(index).map_or_else(
                || ["degC", "K", "degF", "rad/s"][index - HEADERS.len()],
                |header| header.0,
            )
        };
        let (from, to) = (unit(text(from)), unit(text(to)));
        let (there, back) = (from.conversion_to(&to), to.conversion_to(&from));
        prop_assert_eq!(there.is_some(), back.is_some());
        if let (Some(there), Some(back)) = (there, back) {
            let again = back.apply(there.apply(value));
            prop_assert!((again - value).abs() <= 1e-12 * (value.abs() + 500.0), "{again} {value}");
        }
    }

    #[test]
    fn no_text_panics(text in "\\PC{0,20}", near in "[mslKVW%°CdegNPa123/*.^ ()²³⁻·-]{0,20}") {
        for text in [text, near] {
            if let Some(unit) = Unit::parse(&text) {
                prop_assert!(unit.conversion_to(&unit).unwrap().is_identity(), "{text}");
            }
        }
    }
}
