//! Definition of an effect: a small model, and settings that its text cannot contain.

use std::collections::BTreeMap;

use crate::spec::Given;
use crate::text::parse_effect;

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Between an input and the model: the effect of `u` supplies the model's input.
    Input,
    /// Between the measured quantity and the reading: the effect of `y` supplies the reading.
    Output,
    /// In the equation of a state `x`: an addition to its right-hand side or, as a function of `rate`, its replacement.
    Balance,
    /// A parameter or a named flow `p`, which the effect replaces.
    Parameter,
    /// A parameter or a named flow `p` that depends on a state or an input `x`.
    ParameterAndSignal,
    /// A flow from a state `x1` to a state `x2`.
    States,
    /// An input `u`, and the equation of a state that it is added to.
    InputAndBalance,
    /// The equation of a state `x`, to which a surrounding of the same quantity `a` (a state or an input) belongs.
    BalanceAndSurrounding,
    /// The equation of a state, and a state or an input `x` that it depends on.
    BalanceAndSignal,
    /// The equation of a speed `x`.
    Motion,
    /// The equation of a speed `a`, and its position `x`.
    MotionAndPosition,
    /// The equation of a speed `a` that depends on its position `x`.
    Spring,
    /// The equation of a level `x`.
    Level,
    /// Between a level and its reading: the effect of `y` supplies the reading.
    LevelReading,
    /// A flow from a tank of level `x1` to one of level `x2` that it drains into.
    TankAndTankBelow,
    /// A voltage that is read, `y`, with a current that is an input, `a`.
    Terminal,
}

/// Role of an effect's parameter in a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// At the absent value the effect vanishes, and the outputs have a derivative with respect to the parameter (one-sided at a bound).
    Size,
    /// The parameter states when, where or how fast the effect acts. No output depends on it while the size of the effect is zero. A grid
    /// of starts covers it.
    Shape,
    /// At the absent value the effect vanishes, but the outputs have no derivative with respect to the parameter there, or one that says
    /// little of larger values: a limit at the edge of the visited range, a quantisation step, a dead zone. A grid of starts is used.
    Threshold,
    /// The parameter states in which position the effect begins. It says nothing of the time after the effect's first move.
    Begin,
    /// The parameter takes one of its start values and no value in between: upper or lower. It is not fitted.
    Choice,
}

/// Start values of fits of a parameter, as shares of the visited range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Starts {
    /// The values themselves.
    Values(&'static [f64]),
    /// 1 and -1 for an effect at one end of the signal's range, and 0 for both ends if the signal goes about as far below zero as
    /// above it.
    Sides,
    /// Quantiles of the signal, or the same shares of its range if no quantiles are known; of a signal with few levels, values between
    /// them ([`super::Span::thresholds`]).
    Quantiles(&'static [f64]),
    /// Zero, half the smallest magnitude of the signal that is not zero, and quantiles of these magnitudes ([`super::Span::thresholds`]).
    Magnitudes(&'static [f64]),
    /// Shares of the width of the signal's range.
    Widths(&'static [f64]),
    /// Values in the signal's range: shares of it, from its lower end.
    Range(&'static [f64]),
    /// Instants: shares of the record, from its beginning.
    Times(&'static [f64]),
    /// Shares of the record's duration.
    Durations(&'static [f64]),
    /// Multiples of the interval between rows.
    Intervals(&'static [f64]),
    /// Shares of the largest term of the equation.
    Balances(&'static [f64]),
    /// Shares of the largest term of the equation, per width of the signal's range.
    BalancesPerWidth(&'static [f64]),
}

/// An effect.
///
/// Its text is a model: the inputs are the port (their names say which part of it: [`Place`]), the output `v` is what the effect gives (and
/// `w` the part of it that the second state of a port gets, where that is not the whole), the value of a parameter is the absent one, and a
/// `final parameter` is a [`Role::Choice`]. Constants of these names take the values that the data visit: `low`, `high`, `middle`, `width`,
/// `first` (of the signal), `begin`, `duration`, `interval` (of the record), `zero` (of a temperature's unit above absolute zero), `balance`
/// (the largest term of the equation). In units `port` (or `signal`), `value`, `time` and `balance` stand for those of the signal, of the
/// parameter or flow, of the time and of the equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Name of the effect: `lag`.
    pub id: &'static str,
    /// Where the effect acts.
    pub place: Place,
    /// Model text of the effect.
    pub text: &'static str,
    /// Role and starts of the parameters.
    pub parameters: &'static [(&'static str, Role, Starts)],
    /// Physics of the effect in a sentence.
    pub physics: &'static str,
    /// Effects with similar signatures, as `name(port)`.
    pub confused_with: &'static [&'static str],
    /// How to confirm the effect at the plant.
    pub confirm: &'static str,
    /// Words that a person may describe it with.
    pub symptoms: &'static [&'static str],
}

/// What an effect is and how to confirm it, in the terms of the port's physical domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EffectText {
    /// Physics of the effect in a sentence.
    pub physics: &'static str,
    /// How to confirm the effect at the plant.
    pub confirm: &'static str,
}

/// Values from a record (ranges, means, durations) that the text of an effect may contain.
pub(super) const RECORD_NUMBERS: [&str; 10] = [
    "low", "high", "middle", "width", "first", "begin", "zero", "duration", "interval", "balance",
];

impl Effect {
    /// Constants of the effect's text whose values come from the range of the data: `low`, `duration`. With the same constants the effect is
    /// the same for another record.
    #[must_use]
    pub fn record_numbers(&self) -> Vec<&'static str> {
        // A test reads every text.
        let parameters =
            parse_effect(self.text, &BTreeMap::new()).map_or_else(|_| Vec::new(), |s| s.parameters);
        let is_constant = |name: &&str| {
            let mut parameters = parameters.iter();
            parameters.any(|p| p.given == Given::Constant && p.about.name == **name)
        };
        RECORD_NUMBERS.into_iter().filter(is_constant).collect()
    }
}
