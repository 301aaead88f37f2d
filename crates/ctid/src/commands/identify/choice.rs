//! `--method`: one of the methods, or all.

use clap::{ValueEnum, builder::PossibleValue};
use linear_identification::Method;

/// A method, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    One(Method),
    All,
}

impl ValueEnum for Choice {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::All,
            Self::One(Method::StabilizedOe),
            Self::One(Method::CtRls),
            Self::One(Method::Ls),
            Self::One(Method::Iv),
            Self::One(Method::Fcloe),
            Self::One(Method::RecursiveFcloe),
            Self::One(Method::Srivc),
            Self::One(Method::Rivc),
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::All => Some(PossibleValue::new("all").help("Every method, side by side")),
            Self::One(method) => method.to_possible_value(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_can_be_chosen() {
        let choices = Choice::value_variants();
        for method in Method::value_variants() {
            assert!(choices.contains(&Choice::One(*method)), "{}", method.id());
        }
    }
}
