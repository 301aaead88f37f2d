//! Smooth functions of the model's variables: without physics, for the shape of a term that no effect of the catalogue has.
//!
//! `shape` depends on a state or an input, `course` on time. A function is a sum of bells (Gaussian radial basis) at equal distances over
//! the visited range, as wide as their distance: linear in its parameters, smooth, and of any form that is not much narrower than a bell.
//! They are not candidates of the search, because such a function can fit any error.
//!
//! **Reference**: S. Chen, S. A. Billings, P. M. Grant, Int. J. Control 55 (1992) 1051-1070 (radial basis functions in identification).

use super::{Effect, Place, Role, Starts};

/// The value of a sum of Gaussian bells at a share of the range, given their heights in order.
#[must_use]
pub fn bells(heights: &[f64], share: f64) -> f64 {
    let z = share * heights.len().saturating_sub(1) as f64;
    let bell = |(k, height): (usize, &f64)| height * (-0.5 * (z - k as f64).powi(2)).exp();
    heights.iter().enumerate().map(bell).sum()
}

/// Heights of bells as parameters, with a unit and a bound.
macro_rules! heights {
    ($unit:literal, $bound:literal, $($name:literal),+) => {
        concat!($(
            "  parameter Real ", $name, "(unit=\"", $unit, "\", min=-", $bound, ", max=", $bound, ") = 0 \"height of a bell\";\n",
        )+)
    };
}

/// A shape function of the signal `x` (or `u`): its interval, the unit and bound of its heights, and the text before and after the sum.
macro_rules! of_signal {
    ($inputs:literal, $x:literal, $unit:literal, $bound:literal, $before:literal, $behind:literal) => {
        concat!(
            "model shape\n",
            $inputs,
            "  constant Real low(unit=\"signal\") = 0;\n",
            "  constant Real width(unit=\"signal\") = 1;\n",
            "  constant Real balance(unit=\"balance\") = 1;\n",
            heights!($unit, $bound, "h0", "h1", "h2", "h3", "h4", "h5", "h6"),
            "  Real z = (",
            $x,
            " - low)/width;\n  output Real v = ",
            $before,
            "h0*exp(-18*(z - 0/6)^2) + h1*exp(-18*(z - 1/6)^2) + h2*exp(-18*(z - 2/6)^2) + h3*exp(-18*(z - 3/6)^2) + h4*exp(-18*(z - 4/6)^2) + h5*exp(-18*(z - 5/6)^2) + h6*exp(-18*(z - 6/6)^2)",
            $behind,
            ";\nend shape;\n"
        )
    };
}

/// Shape functions of time, from the beginning of the record to its end.
macro_rules! of_time {
    ($inputs:literal, $unit:literal, $bound:literal, $before:literal, $behind:literal) => {
        concat!(
            "model course\n",
            $inputs,
            "  constant Real begin(unit=\"time\") = 0;\n",
            "  constant Real duration(unit=\"time\") = 1;\n",
            "  constant Real width(unit=\"signal\") = 1;\n",
            "  constant Real balance(unit=\"balance\") = 1;\n",
            heights!($unit, $bound, "h0", "h1", "h2", "h3", "h4", "h5", "h6", "h7", "h8", "h9", "h10", "h11"),
            "  Real z = (time - begin)/duration;\n  output Real v = ",
            $before,
            "h0*exp(-60.5*(z - 0/11)^2) + h1*exp(-60.5*(z - 1/11)^2) + h2*exp(-60.5*(z - 2/11)^2) + h3*exp(-60.5*(z - 3/11)^2) + h4*exp(-60.5*(z - 4/11)^2) + h5*exp(-60.5*(z - 5/11)^2) + h6*exp(-60.5*(z - 6/11)^2) + h7*exp(-60.5*(z - 7/11)^2) + h8*exp(-60.5*(z - 8/11)^2) + h9*exp(-60.5*(z - 9/11)^2) + h10*exp(-60.5*(z - 10/11)^2) + h11*exp(-60.5*(z - 11/11)^2)",
            $behind,
            ";\nend course;\n"
        )
    };
}

/// Names of the heights.
const NAMES: [&str; 12] = [
    "h0", "h1", "h2", "h3", "h4", "h5", "h6", "h7", "h8", "h9", "h10", "h11",
];

/// The given number of first heights, with their starts.
const fn heights<const N: usize>(starts: Starts) -> [(&'static str, Role, Starts); N] {
    let mut all = [("", Role::Size, starts); N];
    let mut k = 0;
    while k < N {
        all[k].0 = NAMES[k];
        k += 1;
    }
    all
}

const OF_BALANCE: Starts = Starts::Balances(&[0.1]);
const OF_WIDTH: Starts = Starts::Widths(&[0.1]);
const RELATIVE: Starts = Starts::Values(&[0.1]);

const OF_EQUATION: Effect = Effect {
    id: "shape",
    place: Place::BalanceAndSignal,
    text: of_signal!("  input Real x;\n", "x", "balance", "20*balance", "", ""),
    parameters: &heights::<7>(OF_BALANCE),
    physics: "A term of this equation that is a smooth function of the signal.",
    confused_with: &["loss(x)", "varies_with(p,x)"],
    confirm: "Look at the shape of the function, and write the physical law with this shape as a candidate in the model file.",
    symptoms: &["nobody knows what it is"],
};

const OF_INPUT: Effect = Effect {
    place: Place::Input,
    text: of_signal!("  input Real u;\n", "u", "port", "3*width", "u + ", ""),
    parameters: &heights::<7>(OF_WIDTH),
    physics: "The output of the actuator is another function of the command than the model's.",
    ..OF_EQUATION
};

const EQUATION_IN_TIME: Effect = Effect {
    id: "course",
    place: Place::Balance,
    text: of_time!("  input Real x;\n", "balance", "20*balance", "", ""),
    parameters: &heights::<12>(OF_BALANCE),
    physics: "A disturbance of this balance that is a smooth function of time.",
    confused_with: &["periodic(x)", "step(x)", "constant(x)"],
    confirm: "Compare the estimated disturbance with the log of the plant: what happened when it changed?",
    symptoms: &["nobody knows what it is"],
};

const INPUT_IN_TIME: Effect = Effect {
    place: Place::Input,
    text: of_time!("  input Real u;\n", "port", "3*width", "u + ", ""),
    parameters: &heights::<12>(OF_WIDTH),
    physics: "A disturbance that is a function of time adds to the input.",
    ..EQUATION_IN_TIME
};

/// All shape effects: in a balance, at an input, at an output, and at a parameter or a named flow.
pub(super) const EFFECTS: [Effect; 8] = [
    OF_EQUATION,
    OF_INPUT,
    Effect {
        place: Place::Output,
        physics: "The reading is another function of the measured quantity than the model's.",
        ..OF_INPUT
    },
    Effect {
        place: Place::ParameterAndSignal,
        text: of_signal!(
            "  input Real p;\n  input Real x;\n",
            "x",
            "1",
            "3",
            "p*(1 + ",
            ")"
        ),
        parameters: &heights::<7>(RELATIVE),
        physics: "The parameter is not constant, but a smooth function of the signal.",
        ..OF_EQUATION
    },
    EQUATION_IN_TIME,
    INPUT_IN_TIME,
    Effect {
        place: Place::Output,
        physics: "The reading has an error that is a function of time.",
        ..INPUT_IN_TIME
    },
    Effect {
        place: Place::Parameter,
        text: of_time!("  input Real p;\n", "1", "3", "p*(1 + ", ")"),
        parameters: &heights::<12>(RELATIVE),
        physics: "The parameter is a smooth function of time.",
        ..EQUATION_IN_TIME
    },
];
