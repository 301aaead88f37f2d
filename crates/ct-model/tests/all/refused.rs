//! Rejected texts: one line with position, words and correction.

use ct_model::ModelSpec;

/// A model whose line 5 is this.
fn around(line: &str) -> String {
    format!(
        "model M\n  parameter Real k(min=0) = 2;\n  input Real u;\n  Real x(start=0);\n{line}\n  output Real y = x;\nequation\n  der(x) = u - k*x;\nend M;\n"
    )
}

fn refuses_text(text: &str, begins: &str, mend: &str) {
    let error = match ModelSpec::parse(text) {
        Ok(spec) => panic!("{text}\nis taken as {spec}"),
        Err(error) => error,
    };
    let said = error.to_string();
    assert!(said.starts_with(begins), "{said}\ninstead of\n{begins}");
    assert!(said.contains(mend), "{said}\ndoes not say\n{mend}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let lines: Vec<&str> = text.lines().collect();
    let line = error.position.line - 1;
    if let Some(source) = lines.get(line) {
        let printable = source.replace(|c: char| c.is_control(), " ");
        let begin: String = printable.chars().take(200).collect();
        assert!(error.source_line.starts_with(&begin), "{said}");
    }
}

/// Refused in line 5, at this column.
#[track_caller]
fn refuses(line: &str, column: usize, what: &str, mend: &str) {
    refuses_text(&around(line), &format!("5:{column}: {what}"), mend);
}

#[test]
fn the_frame_is_a_model() {
    ModelSpec::parse(&around("")).unwrap();
}

#[test]
fn names() {
    refuses(
        "  Real q = kk*x;",
        12,
        "`kk` is not declared",
        "did you mean `k`",
    );
    refuses(
        "  Real q = K*x;",
        12,
        "`K` is not declared",
        "did you mean `k`",
    );
    refuses(
        "  Real q = zeta*x;",
        12,
        "`zeta` is not declared",
        "parameter Real zeta = ...;",
    );
    refuses("  Real x;", 8, "`x` is declared twice", "another name");
    refuses(
        "  Real time = 1;",
        8,
        "`time` is a reserved word",
        "another name",
    );
    refuses(
        "  Real min = 1;",
        8,
        "`min` is a reserved word",
        "another name",
    );
    refuses("  Real end = 1;", 8, "`end` where a variable's name", "");
    refuses("  Real 2x = 1;", 8, "`2x` begins with a digit", "letter");
    refuses(
        "  Real 'a b' = 1;",
        8,
        "`'` has no meaning",
        "letters, digits",
    );
    refuses("  Real Ä = 1;", 8, "`Ä` has no meaning", "delete it");
}

#[test]
fn definitions() {
    refuses("  Real q;", 8, "nothing defines `q`", "q = ...;");
    refuses(
        "  Real a = b; Real b = c; Real c = a;",
        8,
        "a -> b -> c -> a form an algebraic loop",
        "make one of them a state",
    );
    refuses("  Real a = a;", 8, "a -> a form an algebraic loop", "");
    refuses(
        "  parameter Real p = 1;",
        18,
        "the parameter `p` is used nowhere",
        "delete it",
    );
    refuses(
        "  input Real v;",
        14,
        "the input `v` is used nowhere",
        "delete it",
    );
    refuses(
        "  parameter Real p; Real q = p;",
        18,
        "`p` has no value",
        "= ...",
    );
    refuses(
        "  input Real v = 3; Real q = v;",
        18,
        "`v` is an input",
        "leave its value out",
    );
    refuses(
        "  Real z(start=1) = x;",
        10,
        "start is an attribute of states, and `z` is not a state",
        "behind `=`",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y;\nequation\n y = u;\n y = 2*u;\nend M;",
        "6:2: `y` is defined twice",
        "keep one",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y;\nequation\n y + u = 1;\nend M;",
        "5:2: the left side must be one variable",
        "solve the equation for it",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y = u;\nequation\n u = 1;\nend M;",
        "5:2: `u` is an input",
        "declare it as `Real u;`",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y;\nequation\n der(y) = u;\n der(y) = 1;\nend M;",
        "6:2: `y` is defined twice",
        "keep one",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y = 1;\nequation\n der(y) = u;\nend M;",
        "3:18: `y` has an equation with its derivative",
        "keep one",
    );
    refuses_text(
        "model M\n input Real u;\n output Real y = der(u);\nend M;",
        "3:18: a derivative stands alone on the left",
        "name what it is equal to",
    );
    refuses_text(
        "model M\n input Real u;\n Real y = u;\nend M;",
        "1:1: the model has no output",
        "output Real y",
    );
}

#[test]
fn expressions() {
    refuses("  Real q = 2*-x;", 14, "`-` behind an operator", "`(-x)`");
    refuses("  Real q = x^2^3;", 15, "`^` after `^`", "(a^b)^c");
    refuses(
        "  Real q = x > 0;",
        12,
        "a condition where a number",
        "if ... then",
    );
    refuses(
        "  Real q = if x then 1 else 0;",
        15,
        "a number where a condition",
        "x > 0",
    );
    refuses("  Real q = if x > 0 then 1;", 27, "`;` where `else`", "");
    refuses("  Real q = (x + 1;", 18, "`;` where `)`", "");
    refuses("  Real q = x +;", 15, "`;` where a number", "");
    refuses(
        "  Real q = sinh(x);",
        12,
        "`sinh` is not a supported function",
        "tanh",
    );
    refuses(
        "  Real q = sin(x, x);",
        12,
        "sin takes one argument",
        "2 are given here",
    );
    refuses(
        "  Real q = max(x);",
        12,
        "max takes two arguments",
        "1 are given here",
    );
    refuses(
        "  Real q = stick_slip(x, 1);",
        12,
        "stick_slip takes four arguments",
        "2 are given here",
    );
    refuses(
        "  Real q = 1 + if x > 0 then 1 else 2;",
        16,
        "`if` within an expression",
        "brackets",
    );
    refuses(
        "  Real q = delay(x, x);",
        21,
        "a dead time may depend on numbers",
        "not supported",
    );
    refuses("  Real q = 1e999;", 12, "`1e999` is too large", "");
    refuses("  Real q = x ! 2;", 14, "`!` has no meaning", "`not`");
    refuses("  Real q = .5*x;", 12, "`.` has no meaning", "0.5");
    refuses(
        &format!("  Real q = {}x{};", "(".repeat(300), ")".repeat(300)),
        212,
        "more than 200 brackets",
        "define a variable",
    );
    refuses(
        &format!("  Real q = x{};", " + x".repeat(300)),
        12,
        "an expression of more than 200 operators",
        "define a variable",
    );
}

#[test]
fn attributes() {
    refuses(
        "  Real q(unt=\"m\") = x;",
        10,
        "`unt` is not an attribute",
        "unit",
    );
    refuses(
        "  Real q(unit=m) = x;",
        10,
        "unit is a text",
        "unit=\"...\"",
    );
    refuses(
        "  Real q(min=\"0\") = x;",
        10,
        "min is a value",
        "without quotes",
    );
    refuses(
        "  Real q(min=0, min=1) = x;",
        17,
        "`min` stands here twice",
        "",
    );
    refuses(
        "  Real q(min=x) = x;",
        14,
        "`x` is not a parameter",
        "only numbers and parameters",
    );
    refuses(
        "  parameter Real p(min=2) = 1; Real q = p;",
        29,
        "p = 1 is outside its bounds",
        "correct",
    );
    refuses(
        "  parameter Real p(min=2, max=1) = 1; Real q = p;",
        18,
        "min = 2 is above max = 1",
        "exchange",
    );
    refuses(
        "  parameter Real p = 1/0; Real q = p;",
        22,
        "it has the value inf",
        "finite",
    );
    refuses(
        "  parameter Real p = r; parameter Real r = 1; Real q = p*r;",
        22,
        "`r` is declared below",
        "before",
    );
}

#[test]
fn outside_the_subset() {
    refuses(
        "  Real q[3];",
        9,
        "`[`: arrays are not supported",
        "a separate variable",
    );
    refuses("  Real q = {1, 2};", 12, "`{`: arrays", "");
    refuses(
        "  Integer n = 3;",
        3,
        "`Integer`: every variable is a `Real`",
        "",
    );
    refuses(
        "  Modelica.Units.SI.Mass m;",
        11,
        "`.` has no meaning",
        "packages",
    );
    refuses("  Resistor r;", 3, "`Resistor` is not a type", "`Real`");
    refuses(
        "  extends Base;",
        3,
        "`extends`: a model is a single text",
        "",
    );
    refuses(
        "  annotation(x=1);",
        3,
        "`annotation`: annotations are not supported",
        "delete",
    );
    refuses(
        "  protected Real q = x;",
        3,
        "`protected`: it has no meaning",
        "delete",
    );
    refuses(
        "  algorithm x := 1;",
        3,
        "`algorithm`: algorithms",
        "equation",
    );
    refuses(
        "  initial algorithm x := 1;",
        11,
        "`algorithm`: algorithms",
        "equation",
    );
    let equation = |line: &str, begins: &str, mend: &str| {
        let text = format!(
            "model M\n input Real u;\n output Real y;\nequation\n y = u;\n{line}\nend M;\n"
        );
        refuses_text(&text, begins, mend);
    };
    equation(
        " connect(a, b);",
        "6:2: `connect`: connections",
        "equations",
    );
    equation(
        " when u > 1 then\n",
        "6:2: `when`: `when` is not supported",
        "if",
    );
    equation(" if u > 1 then\n", "6:2: equations within `if`", "x = if c");
    equation(
        " for i in 1:3 loop\n",
        "6:2: `for`: loops",
        "every equation",
    );
    equation(" y := 1;", "6:4: `:=`: an equation is written with `=`", "");
    equation(" y == 1;", "6:4: `==` where `=`", "");
    equation(" assert(u > 1, \"x\");", "6:2: `assert`", "");
}

#[test]
fn frames() {
    refuses_text("", "1:1: the end of the text where `model`", "");
    refuses_text("block M\nend M;", "1:1: `block`: a text is one `model`", "");
    refuses_text("model M\n  Real x", "2:9: the end of the text", "");
    refuses_text(
        "model M\n input Real u; output Real y = u;\nend N;",
        "3:5: `N` ends here, but `M` began",
        "same name",
    );
    refuses_text(
        "model M\n input Real u; output Real y = u;\nend M;\nmodel N",
        "4:1: `model` where the end",
        "",
    );
    refuses_text("model M /* \n", "1:9: a comment without an end", "*/");
    refuses_text("model M \"abc\n", "1:9: a description without an end", "");
    refuses_text(
        "model M\n\tReal\u{7}q;",
        "2:6: `\u{20}` has no meaning here",
        "",
    );
}
