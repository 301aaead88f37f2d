//! Guards: signs that select branches, and branch conditions on these signs.

use super::Register;
use crate::expression::Comparison;

/// A difference whose sign decides on a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Guard {
    /// The difference.
    pub difference: Register,
    pub(super) comparison: Comparison,
}

impl Guard {
    /// Answer of the guard for this difference.
    pub fn holds(self, difference: f64) -> bool {
        match self.comparison {
            Comparison::Less => difference < 0.0,
            Comparison::LessOrEqual => difference <= 0.0,
            Comparison::Greater => difference > 0.0,
            Comparison::GreaterOrEqual => difference >= 0.0,
            Comparison::Equal => difference == 0.0,
            Comparison::NotEqual => difference != 0.0,
        }
    }

    /// Whether the difference has left the side of the given answer.
    pub fn is_crossed(self, answer: bool, difference: f64) -> bool {
        let positive = match self.comparison {
            Comparison::Less | Comparison::LessOrEqual => !answer,
            Comparison::Greater | Comparison::GreaterOrEqual => answer,
            // Two numbers that change with time are equal only at an instant.
            Comparison::Equal | Comparison::NotEqual => return false,
        };
        if positive {
            difference < 0.0
        } else {
            difference > 0.0
        }
    }
}

/// Condition for a branch, in terms of the answers of guards.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Branch {
    Constant(bool),
    Guard(usize),
    Not(Box<Branch>),
    And(Box<Branch>, Box<Branch>),
    Or(Box<Branch>, Box<Branch>),
}

impl Branch {
    /// Calls `each` for every guard.
    pub(super) fn each_guard(&self, each: &mut impl FnMut(usize)) {
        match self {
            Self::Constant(_) => {}
            Self::Guard(guard) => each(*guard),
            Self::Not(a) => a.each_guard(each),
            Self::And(a, b) | Self::Or(a, b) => {
                a.each_guard(each);
                b.each_guard(each);
            }
        }
    }

    pub(super) fn holds(&self, answers: &[bool]) -> bool {
        match self {
            Self::Constant(value) => *value,
            Self::Guard(guard) => answers[*guard],
            Self::Not(a) => !a.holds(answers),
            Self::And(a, b) => a.holds(answers) && b.holds(answers),
            Self::Or(a, b) => a.holds(answers) || b.holds(answers),
        }
    }
}
