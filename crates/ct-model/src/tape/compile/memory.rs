//! The functions with memory: play, stick-slip, and values that stay between two others.

use super::Compiler;
use crate::expression::Comparison;
use crate::tape::{Branch, Operation, Play, Register};

/// Perturbation of the half-width of stiction for its finite difference, as a share of it.
const PERTURBATION: f64 = 0.05;

impl Compiler<'_> {
    pub(super) fn play(&mut self, from: Register, half_width: Register) -> Register {
        self.play_from(from, from, half_width)
    }

    /// A play whose first value is `first`.
    fn play_from(&mut self, first: Register, of: Register, half_width: Register) -> Register {
        let low = self.operation(Operation::Subtract(of, half_width));
        let high = self.operation(Operation::Add(of, half_width));
        self.stay_between(first, low, high)
    }

    /// A value that stays between two others and begins at `from`: a generalised play (Krasnosel'skii and Pokrovskii, Systems with
    /// Hysteresis, 1989).
    pub(super) fn stay_between(
        &mut self,
        from: Register,
        low: Register,
        high: Register,
    ) -> Register {
        let held = self.first_play + self.plays.len();
        let pushed = self.larger(held, low);
        let to = self.smaller(pushed, high);
        self.plays.push(Play { from, held, to });
        to
    }

    /// Stiction, with a finite difference in place of its derivative by the half-width: a narrower and a wider element follow the same
    /// signal. The derivative itself is zero almost everywhere if the jump is complete: the result changes only where a jump occurs or no
    /// longer occurs. Without a jump it is a play, with its exact derivative. `begin`: the first position within the band, whose derivative
    /// is that up to the first jump.
    pub(super) fn stick_slip(
        &mut self,
        of: Register,
        [half_width, jump, begin]: [Register; 3],
    ) -> Register {
        let [zero, one, share] = [0.0, 1.0, PERTURBATION].map(|n| self.number(n));
        let first = self.within_band(of, begin, half_width);
        let play = self.play_from(first, of, half_width);
        let width = self.operation(Operation::Scale(one, half_width));
        let reach = self.operation(Operation::Multiply(share, width));
        let narrower = self.operation(Operation::Subtract(width, reach));
        let wider = self.operation(Operation::Add(width, reach));
        let [below, middle, above] =
            [narrower, width, wider].map(|width| self.stick(of, [width, jump, begin]));
        let rise = self.operation(Operation::Subtract(above, below));
        let run = self.operation(Operation::Add(reach, reach));
        let slope = self.operation(Operation::Divide(rise, run));
        // Zero, but with the derivatives of the half-width.
        let change = self.operation(Operation::Subtract(half_width, width));
        let first_order = self.operation(Operation::Multiply(slope, change));
        let stuck = self.operation(Operation::Add(middle, first_order));
        let present = self.guard(Comparison::Greater, half_width, zero);
        let jumps = self.guard(Comparison::Greater, jump, zero);
        let both = Branch::And(Box::new(present), Box::new(jumps));
        self.select(both, stuck, play)
    }

    /// The value at a position within a band around another value: -1 and 1 are its ends.
    fn within_band(&mut self, of: Register, position: Register, half_band: Register) -> Register {
        let apart = self.operation(Operation::Multiply(position, half_band));
        self.operation(Operation::Add(of, apart))
    }

    /// An element that sticks until its input is further from it than `half_width*(1 + jump)`, and then moves to a distance of
    /// `half_width*(1 - jump)`.
    fn stick(&mut self, of: Register, [half_width, jump, begin]: [Register; 3]) -> Register {
        let jumped = self.operation(Operation::Multiply(half_width, jump));
        let band = self.operation(Operation::Add(half_width, jumped));
        let rest = self.operation(Operation::Subtract(half_width, jumped));
        let low = self.operation(Operation::Subtract(of, band));
        let high = self.operation(Operation::Add(of, band));
        let from_below = self.operation(Operation::Subtract(of, rest));
        let from_above = self.operation(Operation::Add(of, rest));
        let from = self.within_band(of, begin, band);
        let held = self.first_play + self.plays.len();
        let rises = self.guard(Comparison::Less, held, low);
        let falls = self.guard(Comparison::Greater, held, high);
        let lowered = self.select(falls, from_above, held);
        let to = self.select(rises, from_below, lowered);
        self.plays.push(Play { from, held, to });
        to
    }
}
