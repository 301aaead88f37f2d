//! Delayed expressions: the past values of each one, stored in pieces that are smooth between jumps.
//!
//! A jump of an input reaches the delay's output at a time that depends on the delay. Steps end there, and the time carries derivatives.

use std::collections::VecDeque;

use super::Method;
use crate::scalar::Scalar;

/// Number of equidistant points at which the values of a piece are stored.
pub(super) const POINTS: usize = 5;

#[derive(Debug, Clone)]
pub(super) struct Piece<T> {
    pub begin: T,
    pub length: T,
    pub values: [T; POINTS],
    /// All values and their derivatives are equal, as those of a held input are.
    is_constant: bool,
    /// Number of jumps before the piece.
    jumps: usize,
}

impl<T: Scalar> Piece<T> {
    /// The interpolating polynomial of degree four through the piece's points.
    fn at(&self, time: T) -> T {
        if self.is_constant {
            return self.values[0];
        }
        let share = (time - self.begin) / self.length;
        let z = share.value() * (POINTS - 1) as f64;
        let mut of = [(share, 0.0); POINTS + 1];
        let (mut value, mut rise) = (0.0, 0.0);
        for (i, own) in self.values.iter().enumerate() {
            let (mut weight, mut slope) = (1.0, 0.0);
            for j in (0..POINTS).filter(|&j| j != i) {
                let distance = i as f64 - j as f64;
                slope = (slope * (z - j as f64) + weight) / distance;
                weight *= (z - j as f64) / distance;
            }
            value += weight * own.value();
            rise += slope * (POINTS - 1) as f64 * own.value();
            of[i] = (*own, weight);
        }
        of[POINTS].1 = rise;
        T::with_slopes(value, of)
    }
}

/// One delayed expression.
#[derive(Debug, Clone)]
pub(super) struct Delay<T> {
    /// The delay.
    pub by: T,
    /// The expression depends only on inputs and time, so its values in an interval are known at the beginning of the interval.
    pub known_ahead: bool,
    /// Outputs alone read the delay, and its expression has no jumps ([`crate::tape::Tape::delays_of_outputs`]): no step has to end where a value
    /// leaves it.
    pub of_output: bool,
    /// The value before the record.
    before: T,
    pieces: VecDeque<Piece<T>>,
    /// Times at which jumps entered the delay, for those that have not left it.
    jumps: VecDeque<T>,
    /// Number of jumps that have entered the delay.
    gone_in: usize,
    /// Number of jumps that have left the delay.
    out: usize,
}

#[derive(Debug, Clone)]
pub(super) struct Delays<T> {
    pub all: Vec<Delay<T>>,
    /// Outputs are read: delays that outputs alone read have values only then.
    pub for_outputs: bool,
}

impl<T: Scalar> Delay<T> {
    pub fn new(by: T, known_ahead: bool, of_output: bool) -> Self {
        Self {
            by,
            known_ahead,
            of_output,
            before: T::constant(0.0),
            pieces: VecDeque::new(),
            jumps: VecDeque::new(),
            gone_in: 0,
            out: 0,
        }
    }

    /// Starts the record; `value` is also the value before the record.
    pub fn begin(&mut self, time: T, value: T) {
        self.before = value;
        self.jump(time);
    }

    /// Notes a jump of the expression or of its slope at this time.
    pub fn jump(&mut self, time: T) {
        if !self.of_output {
            self.jumps.push_back(time);
            self.gone_in += 1;
        }
    }

    /// Stores the values of the expression over an interval.
    pub fn push(&mut self, begin: T, length: T, values: [T; POINTS]) {
        let first = values[0];
        let is_first = |value: &T| value.value() == first.value() && value.same_derivatives(first);
        self.pieces.push_back(Piece {
            begin,
            length,
            values,
            is_constant: values.iter().all(is_first),
            jumps: self.gone_in,
        });
    }

    /// The time at which the next jump leaves the delay.
    pub fn next_out(&self) -> Option<T> {
        Some(*self.jumps.front()? + self.by)
    }

    /// Notes that the next jump has left the delay.
    pub fn let_out(&mut self) {
        if self.jumps.pop_front().is_some() {
            self.out += 1;
        }
    }

    /// Drops the pieces that are not needed from this time on.
    pub fn forget(&mut self, time: f64) {
        let oldest = time - self.by.value();
        let passed = |piece: &Piece<T>| piece.jumps <= self.out && piece.begin.value() < oldest;
        while self.pieces.len() > 2 && passed(&self.pieces[1]) {
            self.pieces.pop_front();
        }
    }

    fn at(&self, time: T) -> T {
        let time = time - self.by;
        let first_begin = self.pieces.front().map(|piece| piece.begin.value());
        let is_before = if self.of_output {
            first_begin.is_none_or(|begin| time.value() < begin)
        } else {
            self.out == 0
        };
        if is_before {
            return self.before;
        }
        let first = self.pieces.partition_point(|piece| piece.jumps < self.out);
        let begun = |piece: &Piece<T>| {
            let since_jump = piece.jumps == self.out && piece.begin.value() <= time.value();
            piece.jumps < self.out || since_jump
        };
        let later = self.pieces.partition_point(begun).saturating_sub(1);
        // Before the first piece after the jump, or if there is none yet, the nearest piece is extrapolated.
        let at = later.max(first).min(self.pieces.len().saturating_sub(1));
        self.pieces
            .get(at)
            .map_or(self.before, |piece| piece.at(time))
    }
}

impl<T: Scalar> Delays<T> {
    /// The longest step, but at least `least`, in which no delayed value is needed that the step itself produces.
    pub fn longest_step(&self, method: Method, least: f64) -> f64 {
        // Within an implicit step the values are interpolated linearly.
        let no_limit = |delay: &Delay<T>| delay.of_output && method != Method::Implicit;
        let all = self.all.iter();
        all.filter(|delay| !delay.known_ahead && !no_limit(delay))
            .map(|delay| delay.by.value().max(least))
            .fold(f64::INFINITY, f64::min)
    }

    /// The delayed value at a time; `None` for one that is not read now.
    pub fn at(&self, i: usize, time: T) -> Option<T> {
        let delay = &self.all[i];
        (self.for_outputs || !delay.of_output).then(|| delay.at(time))
    }
}
