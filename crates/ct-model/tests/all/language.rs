//! Meaning of the language subset.

use ct_model::{Expression, Given, Linearity, Model, ModelSpec, Simulation, Variable};

fn model(body: &str) -> ModelSpec {
    ModelSpec::parse(&format!("model M\n{body}\nend M;")).unwrap_or_else(|error| panic!("{error}"))
}

/// The value of an expression of the parameters `a = 2`, `b = 3`, `c = 5`.
fn value(expression: &str) -> f64 {
    let spec = model(&format!(
        "parameter Real a = 2; parameter Real b = 3; parameter Real c = 5;
         output Real y = {expression}; output Real all = a + b + c;"
    ));
    let of = |variable| match variable {
        Variable::Parameter(i) => spec.parameters[i].value,
        other => panic!("{other:?}"),
    };
    spec.flows[0].value.value(7.0, &of)
}

#[test]
fn precedence_is_that_of_modelica() {
    for (text, expected) in [
        ("a + b*c", 17.0),
        ("(a + b)*c", 25.0),
        ("a - b - c", -6.0),
        ("a/b/c", 2.0 / 15.0),
        ("a*b^2", 18.0),
        ("-a^2", -4.0),
        ("-a + b", 1.0),
        ("-a*b + c", -1.0),
        ("+a", 2.0),
        ("2^(-1)", 0.5),
        ("1e1 + 1.5E-1 + 2.", 12.15),
        ("if a > b then 1 else 2", 2.0),
        ("if a > b then 1 elseif a < b then 4 else 2", 4.0),
        ("if not a > b and c == 5 then 1 else 2", 1.0),
        ("if a > b or c <> 5 or true then 1 else 2", 1.0),
        ("if a >= 2 and (b < 1 or c <= 5) then 1 else 2", 1.0),
        ("if a > b then 1 else 2 + c", 7.0),
        ("(if a > b then 1 else 2) + c", 7.0),
        ("min(a, max(b, c)) + abs(-c)", 7.0),
        ("sign(-c) + sign(0) + sign(c)", 0.0),
        ("sqrt(exp(log(16))) + log10(100)", 6.0),
        ("sin(0) + cos(0) + tan(0) + tanh(0) + atan2(0, 1)", 1.0),
        ("noEvent(a) + smooth(1, b)", 5.0),
        ("time*a", 14.0),
    ] {
        let found = value(text);
        assert!((found - expected).abs() < 1e-12, "{text}: {found}");
    }
}

#[test]
fn a_model_of_the_domains() {
    let spec = ModelSpec::parse(
        r#"model HouseRc
  "House: indoor air and envelope, 2R2C" /* a comment
  of two lines */
  parameter Real Ci(unit="kW.h/K", min=0) = 1.1 "heat capacity of air and light mass";
  parameter Real Ce(unit="kW.h/K", min=0) = 8.6, Uie(min=0) = 0.72;
  final parameter Real Uea(unit="kW/K", min=0) = 0.22 "envelope - outdoors";
  constant Real thousand = 1000;
  input Real P(unit="kW") "heating power, metered"; // one of three
  input Real Ta(unit="degC", displayUnit="degF", nominal=10);
  output Real y(unit="degC") "indoor temperature";
  Real Ti(unit="degC", start=19.29, fixed=true);
  Real Te(unit="degC", start=-Ce + 15);
  Real q_ie(unit="kW");
  Real q_ea(unit="kW") = Uea*(Ta-Te);
equation
  y = Ti;
  Ci*der(Ti) = q_ie + P/thousand "the air";
  der(Te)*Ce = q_ea - q_ie;
  q_ie = Uie*(Te-Ti);
end HouseRc;
"#,
    )
    .unwrap();
    assert_eq!(spec.name, "HouseRc");
    assert_eq!(spec.description, "House: indoor air and envelope, 2R2C");
    let given: Vec<Given> = spec.parameters.iter().map(|p| p.given).collect();
    use Given::{Constant, Fitted, Measured};
    assert_eq!(given, [Fitted, Fitted, Fitted, Measured, Constant]);
    let ci = &spec.parameters[0];
    assert_eq!((ci.value, ci.about.min), (1.1, 0.0));
    assert_eq!(ci.about.max, f64::INFINITY);
    assert_eq!(ci.about.unit, "kW.h/K");
    assert_eq!(ci.about.description, "heat capacity of air and light mass");
    assert_eq!(spec.inputs.len(), 2);
    assert!(spec.states[0].fixed && !spec.states[1].fixed);
    assert_eq!(spec.write(&spec.states[1].start), "-Ce + 15");
    let names: Vec<&str> = spec.flows.iter().map(|f| f.about.name.as_str()).collect();
    assert_eq!(names, ["y", "q_ie", "q_ea"]);
    let coefficient = spec.states[1].coefficient.as_ref().unwrap();
    assert_eq!(spec.write(coefficient), "Ce");
    assert_eq!(spec.outputs[0].variable, Variable::Flow(0));
    assert_eq!(spec.find("Te"), Some(Variable::State(1)));
}

#[test]
fn assignments_are_computed_in_an_order_that_works() {
    let spec =
        model("input Real u; output Real y = c + a; Real a = b*b; Real b = 2*c; Real c = u;");
    let names: Vec<&str> = spec
        .order
        .iter()
        .map(|&i| spec.flows[i].about.name.as_str())
        .collect();
    assert_eq!(names, ["c", "b", "a", "y"]);
}

#[test]
fn an_output_may_be_a_state_and_may_be_used() {
    let spec = model(
        "input Real u; Real x2(start=0); output Real x1(start=1); output Real e = u - x1;
         equation der(x1) = e - x2; der(x2) = x1;",
    );
    assert_eq!(spec.outputs[0].variable, Variable::State(1));
    assert_eq!(spec.outputs[1].variable, Variable::Flow(0));
}

#[test]
fn parameters_that_others_define_follow_them() {
    let spec = model(
        "constant Real pi = 3.25; final parameter Real d(unit=\"m\") = 0.2;
         final parameter Real A = pi*d^2/4; parameter Real h = 2; parameter Real h2 = 3*h;
         final parameter Real V = A*h; input Real u; output Real y = u*V + h2;",
    );
    // A measured parameter is a value, a fitted one an expression.
    assert!((spec.parameters[2].value - 3.25 * 0.01).abs() < 1e-12);
    assert_eq!(
        (spec.parameters[4].value, spec.parameters[4].given),
        (6.0, Given::Fitted)
    );
    assert!(spec.flows[0].of_parameters);
    assert_eq!(spec.write(&spec.flows[0].value), "A*h");
}

#[test]
fn a_delay_is_of_parameters() {
    let spec = model(
        "parameter Real d(min=0) = 3; input Real u; output Real y = delay(u + 1, 2*d) + delay(y0, 1); Real y0 = u;",
    );
    let delayed = spec.flows[0]
        .value
        .any(&|part| matches!(part, Expression::Delay(..)));
    assert!(delayed);
}

#[test]
fn descriptions_keep_what_stands_in_them() {
    let spec = ModelSpec::parse(
        "model M \"a \\\"b\\\" ü; model\" + \" c\"\r\n input Real u; output Real y = u \"µ // no comment\"; end M;\n",
    )
    .unwrap();
    assert_eq!(spec.description, "a \"b\" ü; model c");
    assert_eq!(spec.flows[0].about.description, "µ // no comment");
}

#[test]
fn linear_models_are_told_from_their_text() {
    let of = |right: &str| {
        let spec = model(&format!(
            "parameter Real k = 2; input Real u; Real x(start=1); Real q = {right}; output Real y = q + x;
             equation exp(k)*der(x) = -k^2*x + u + q;"
        ));
        match spec.linearity() {
            Linearity::Linear => Vec::new(),
            Linearity::Nonlinear { equations } => {
                let name = |v: &Variable| spec.about(*v).name.clone();
                equations.iter().map(name).collect()
            }
        }
    };
    for linear in [
        "x/k - 3*(u + 1)",
        "delay(u, k)*sqrt(k)",
        "if k > 1 then x else 2*u",
        "-k",
    ] {
        assert_eq!(of(linear), Vec::<String>::new(), "{linear}");
    }
    for nonlinear in [
        "x*u",
        "k/x",
        "x^2",
        "abs(x)",
        "time",
        "if x > 1 then 1 else 0",
        "max(u, 0)",
    ] {
        assert_eq!(of(nonlinear), ["q"], "{nonlinear}");
    }
    let spec = model("input Real u; output Real x(start=1); equation x*der(x) = u;");
    assert_ne!(spec.linearity(), Linearity::Linear);
}

/// Each parameter uses the preceding one twice: computing it again for each use would double the time with each line, and a test of 200
/// lines would not end.
#[test]
fn a_long_chain_of_parameters_is_compiled_in_one_pass() {
    let chain: String = (1..=200)
        .map(|i| format!("final parameter Real p{i} = p{0}*p{0};\n", i - 1))
        .collect();
    let text = format!(
        "model Chain\nparameter Real p0 = 1;\n{chain}output Real x(start=1);\nequation\nder(x) = -x/p200;\nend Chain;"
    );
    let model = Model::new(ModelSpec::parse(&text).unwrap());
    let parameters = model.parameters();
    let initial = model.starts(&parameters);
    let mut simulation = Simulation::<f64>::new(&model, &parameters, &initial, 0.0);
    simulation.advance(&[], &[], 1.0).unwrap();
    let mut y = [0.0];
    simulation.read(&[], &mut y);
    assert!((y[0] - (-1.0_f64).exp()).abs() < 1e-9, "{}", y[0]);
}
