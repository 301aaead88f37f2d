//! Units that do not fit together.

use std::path::Path;

use ct_model::{ModelSpec, check_units, implied_time_unit, unit_warnings};

/// Warnings for a heated block after a replacement in its text.
fn said(from: &str, to: &str) -> Vec<String> {
    let text = r#"model Block
  parameter Real C(unit="J/K") = 50;
  parameter Real k(unit="W/K") = 0.1;
  parameter Real tau(unit="s") = 3;
  input Real u(unit="W");
  input Real Ta(unit="degC");
  output Real T(unit="degC", start=20);
  Real v(unit="m/s") = sqrt(2*g*h);
  final parameter Real g(unit="m/s2") = 9.81;
  Real h(unit="m") = 0.001*v0*delay(time, tau);
  input Real v0(unit="m/s");
equation
  C*der(T) = u - k*(T - Ta) + min(u, 3)*exp(-time/tau) + 0*v*v/(v^2)*u;
end Block;"#;
    assert!(text.contains(from), "{from}");
    let model = ModelSpec::parse(&text.replace(from, to)).unwrap();
    let said = unit_warnings(&model);
    said.into_iter()
        .map(|warning| format!("{}: {}", warning.of, warning.what))
        .collect()
}

#[test]
fn units_that_fit_are_not_spoken_of() {
    assert_eq!(said("C", "C"), Vec::<String>::new());
    // A variable without unit fits everything, and sizes may differ.
    assert_eq!(said("k(unit=\"W/K\")", "k"), Vec::<String>::new());
    assert_eq!(
        said("k(unit=\"W/K\")", "k(unit=\"bananas\")"),
        Vec::<String>::new()
    );
    assert_eq!(
        said("C(unit=\"J/K\")", "C(unit=\"kW.h/K\")"),
        Vec::<String>::new()
    );
}

#[test]
fn both_sides_are_named() {
    assert_eq!(
        said("C*der(T) = u - k*(T - Ta)", "C*der(T) = u - k*(T - Ta)*T"),
        ["T: `u` is power (m^2 kg s^-3), but `k*(T - Ta)*T` is m^2 kg s^-3 K"]
    );
    assert_eq!(
        said("unit=\"J/K\"", "unit=\"J\""),
        [
            "T: `C*der(T)` is m^2 kg s^-3 K, but `u - k*(T - Ta) + min(u, 3)*exp(-time/tau) + 0*v*v/v^2*u` is power (m^2 kg s^-3)"
        ]
    );
    assert_eq!(
        said("exp(-time/tau)", "exp(-time)"),
        ["T: `-time` is time (s), and exp takes a pure number"]
    );
    assert_eq!(
        said("min(u, 3)", "min(u, T)"),
        ["T: `u` is power (m^2 kg s^-3), but `T` is temperature (K)"]
    );
    assert_eq!(
        said("sqrt(2*g*h)", "2*g*h"),
        ["v: `v` is velocity (m s^-1), but `2*g*h` is m^2 s^-2"]
    );
}

#[test]
fn the_place_is_that_of_the_equation_or_of_the_start() {
    let text = "model Tank
  parameter Real A(unit=\"cm2\") = 50;
  parameter Real tau(unit=\"bananas\") = 50;
  input Real q(unit=\"cm3/s\");
  output Real h(unit=\"cm\", start=A);
  Real out(unit=\"cm3/s\") =
    h/tau*A*A;
  Real back(unit=\"cm\");
equation
  back = h + A;
  A*der(h) = q - out +
    h;
end Tank;";
    let found = check_units(text).unwrap();
    let found: Vec<_> = found
        .iter()
        .map(|error| {
            (
                error.position.line,
                error.position.column,
                &error.what[..26],
            )
        })
        .collect();
    assert_eq!(
        found,
        [
            (3, 22, "unit `bananas` is unknown:"),
            (10, 3, "units in the equation of b"),
            (11, 3, "units in the equation of h"),
            (5, 28, "units in the start value o"),
        ]
    );
}

fn implied(declarations: &str, equations: &str) -> Option<f64> {
    let text = format!("model M\n{declarations}\nequation\n{equations}\nend M;");
    let model = ModelSpec::parse(&text).unwrap_or_else(|error| panic!("{}", error.excerpt()));
    implied_time_unit(&model)
}

#[test]
fn units_of_the_text_imply_one_of_time() {
    let block = |c: &str, k: &str, g: &str| {
        let declarations = format!(
            "parameter Real C(unit=\"{c}\") = 50;
             parameter Real k(unit=\"{k}\") = 0.1;
             parameter Real g(unit=\"{g}\") = 0.2;
             input Real u(unit=\"%\");
             output Real T(unit=\"degC\", start=20);"
        );
        implied(&declarations, "C*der(T) = g*u - k*(T - 20);")
    };
    assert_eq!(block("J/K", "W/K", "W"), Some(1.0));
    assert_eq!(block("J/K", "W/K", "W/%"), Some(1.0));
    assert_eq!(block("kW.h/K", "kW/K", "kW"), Some(3600.0));
    // A sum of different units, a missing one, and one of no unit of time.
    assert_eq!(block("J/K", "W/K", "kW"), None);
    assert_eq!(block("J/K", "W/K", ""), None);
    assert_eq!(block("kJ/K", "J/K", "J"), None);
    let battery = "parameter Real Q(unit=\"A.h\") = 2; input Real i(unit=\"A\");
        output Real soc(unit=\"1\", start=0.5);";
    assert_eq!(implied(battery, "3600*Q*der(soc) = -i;"), Some(1.0));
    assert_eq!(implied(battery, "Q*der(soc) = -i;"), Some(3600.0));
    let mass =
        "parameter Real m = 2; input Real F; output Real x(unit=\"mm\"); Real v(unit=\"m/s\");";
    assert_eq!(implied(mass, "der(x) = v; m*der(v) = F;"), Some(1e-3));
    assert_eq!(implied(mass, "der(x) = 1000*v; m*der(v) = F;"), Some(1.0));
    // Constants of nature in the text, and factors that convert shares and angles, are no conversions of time.
    for (declarations, equation) in [
        (
            "parameter Real V(unit=\"l\") = 1; input Real P(unit=\"kW\"); output Real T(unit=\"degC\");",
            "4.186*V*der(T) = P;",
        ),
        (
            "parameter Real m(unit=\"g\") = 1; input Real P(unit=\"W\"); output Real T(unit=\"degC\");",
            "4.186*m*der(T) = P;",
        ),
        (
            "input Real u(unit=\"V\"); output Real x(unit=\"V\");",
            "1000*der(x) = u - x;",
        ),
        (
            "input Real u(unit=\"V\"); output Real x(unit=\"V\");",
            "der(x) = 0.001*(u - x);",
        ),
        (
            "parameter Real Q(unit=\"A.h\") = 2; input Real i(unit=\"A\"); output Real soc(unit=\"%\");",
            "der(soc) = -i/(36*Q);",
        ),
        (
            "input Real n(unit=\"rpm\"); output Real phi(unit=\"deg\");",
            "der(phi) = 6*n;",
        ),
        (
            "input Real n(unit=\"rpm\"); output Real phi(unit=\"rad\");",
            "der(phi) = 0.10472*n;",
        ),
    ] {
        assert_eq!(implied(declarations, equation), None, "{equation}");
    }
    // Two equations that contradict each other.
    let two = "input Real u(unit=\"m/s\"); output Real x(unit=\"m\"); output Real z(unit=\"m\");";
    assert_eq!(implied(two, "der(x) = u; der(z) = 60*u;"), None);
}

/// The models next to the checkout are read, written and read again, and their units are consistent.
#[test]
fn models_of_the_domains() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/domains/public");
    let Ok(cases) = std::fs::read_dir(&folder) else {
        println!("skipped: there is no {}", folder.display());
        return;
    };
    let mut count = 0;
    for case in cases {
        let path = case.unwrap().path().join("base.mo");
        let Ok(text) = std::fs::read_to_string(&path) else {
            continue;
        };
        let model = ModelSpec::parse(&text)
            .unwrap_or_else(|error| panic!("{}:{error}\n{}", path.display(), error.excerpt()));
        assert_eq!(ModelSpec::parse(&model.to_string()).as_ref(), Ok(&model));
        assert_eq!(unit_warnings(&model), [], "{}", path.display());
        let model_file = std::fs::read_to_string(path.with_file_name("model.toml")).unwrap();
        let unit = if model_file.contains("[h]") {
            3600.0
        } else {
            1.0
        };
        assert!(
            implied_time_unit(&model).is_none_or(|implied| implied == unit),
            "{}",
            path.display()
        );
        count += 1;
    }
    println!("{count} models");
}
