//! States that slide along a switch: a right-hand side that jumps where `g(t, x) = 0`, and drives the states back there from either side.
//!
//! They stay on `g = 0` with the mean of the slopes of both sides that keeps them there (Filippov): with `f_0` where every such `g` is
//! negative and `f_k` where the `k`-th is positive,
//! `dx/dt = f_0 + sum_k a_k (f_k - f_0)`, `a` such that `dg_j/dt = 0` for all `j`.
//! They leave a switch once its `a` leaves the range from 0 to 1. Friction that holds a mass and a relay that holds a level are of this kind.
//! For several switches at a time the jumps are taken to add up, as those of separate terms do.
//!
//! After each step the states are put back on `g = 0` along the jumps, which is exact in the derivatives, too.
//!
//! **Reference**: A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988, section 4.

use super::step::Drive;
use crate::scalar::Scalar;
use crate::tape::{Register, Registers, Tape};

/// Distance of the differences that give the rate of a guard, as a share of the interval.
const DISTANCE: f64 = 1e-4;
/// The right-hand side jumps where a state moves apart by more than this share of its size in an interval.
const JUMP: f64 = 1e-9;
/// A guard has been moved off zero, by an input that jumps, where it is further away than this share of what its rate makes of an interval.
const OFF: f64 = 1e-9;

/// A guard that stays at zero.
#[derive(Debug, Clone, Copy)]
struct Surface {
    difference: Register,
    /// The state whose rate is the guard's, and its sign: of a state against a number.
    state: Option<(usize, f64)>,
}

#[derive(Debug, Clone)]
pub(super) struct Sliding<T> {
    surfaces: Vec<Surface>,
    /// With all guards negative, then with each of them positive.
    sides: Vec<Registers<T>>,
    /// What each side gives: slopes of the states, one side after the other.
    slopes: Vec<T>,
    /// Rate of each guard (rows) on each side.
    rates: Vec<T>,
    /// The share of each guard's positive side.
    shares: Vec<T>,
    matrix: Vec<T>,
}

impl<T: Scalar> Sliding<T> {
    pub fn none() -> Self {
        Self {
            surfaces: Vec::new(),
            sides: Vec::new(),
            slopes: Vec::new(),
            rates: Vec::new(),
            shares: Vec::new(),
            matrix: Vec::new(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// Whether this difference is kept at zero.
    pub fn holds(&self, difference: Register) -> bool {
        self.surfaces.iter().any(|s| s.difference == difference)
    }

    /// The share of a guard's positive side in the last slopes that were computed.
    pub fn share(&self, k: usize) -> f64 {
        self.shares[k].value()
    }

    /// Keeps one difference more at zero. The registers answer for its negative side from here on.
    pub fn add(&mut self, tape: &Tape, registers: &mut Registers<T>, difference: Register) {
        self.surfaces.push(Surface {
            difference,
            state: tape.state_of(difference),
        });
        self.follow(tape, registers);
    }

    /// Lets one go, to a side.
    pub fn remove(
        &mut self,
        tape: &Tape,
        registers: &mut Registers<T>,
        k: usize,
        positive: bool,
    ) -> Register {
        let surface = self.surfaces.remove(k);
        tape.answer(registers, surface.difference, positive);
        self.follow(tape, registers);
        surface.difference
    }

    /// Has all sides answer as the registers do, but for the guards that stay at zero.
    pub fn follow(&mut self, tape: &Tape, registers: &mut Registers<T>) {
        for surface in &self.surfaces {
            tape.answer(registers, surface.difference, false);
        }
        if self.surfaces.is_empty() {
            return;
        }
        let (n, m) = (tape.states, self.surfaces.len());
        let zero = T::constant(0.0);
        self.slopes.resize((m + 1) * n, zero);
        self.rates.resize((m + 1) * m, zero);
        self.shares.resize(m, zero);
        for side in 0..=m {
            if side == self.sides.len() {
                self.sides.push(registers.clone());
                self.sides[side].held = false;
            }
            tape.copy_answers(registers, &mut self.sides[side]);
            if let Some(own) = side.checked_sub(1) {
                let difference = self.surfaces[own].difference;
                tape.answer(&mut self.sides[side], difference, true);
            }
        }
    }

    /// Puts the mean of the slopes in the place of those that the registers hold, which stand for the negative side.
    pub fn mean_slopes(&mut self, tape: &Tape, registers: &mut Registers<T>, drive: &Drive<'_, T>) {
        let (n, m) = (tape.states, self.surfaces.len());
        let up_to = tape.delayed(tape.delays.len() + tape.plays.len());
        for side in 0..=m {
            let own = &mut self.sides[side];
            own.values[..up_to].copy_from_slice(&registers.values[..up_to]);
            own.extended = registers.extended;
            let from = if side == 0 {
                &*registers
            } else {
                tape.evaluate_slopes(own);
                own
            };
            for (i, &register) in tape.derivatives.iter().enumerate() {
                self.slopes[side * n + i] = from.values[register];
            }
            for j in 0..m {
                self.rates[j * (m + 1) + side] = match self.surfaces[j].state {
                    Some((state, sign)) => self.slopes[side * n + state] * sign,
                    None => self.rate(tape, registers, drive, (j, side)),
                };
            }
        }
        let wanted = |j: usize| -self.rates[j * (m + 1)];
        let wanted: Vec<T> = (0..m).map(wanted).collect();
        self.shares.copy_from_slice(&wanted);
        self.solve();
        for (i, &register) in tape.derivatives.iter().enumerate() {
            // What is a state or made of inputs alone is the same on all sides.
            if register >= up_to && !tape.of_inputs[register] {
                registers.values[register] = self.mean(i, n);
            }
        }
    }

    fn mean(&self, i: usize, n: usize) -> T {
        let negative = self.slopes[i];
        let others = self.shares.iter().zip(self.slopes[n..].chunks_exact(n));
        others.fold(negative, |sum, (share, slopes)| {
            sum + *share * (slopes[i] - negative)
        })
    }

    /// The rate of a guard along the slopes of a side, by central differences.
    fn rate(
        &mut self,
        tape: &Tape,
        at: &Registers<T>,
        drive: &Drive<'_, T>,
        (guard, side): (usize, usize),
    ) -> T {
        let (n, first) = (tape.states, tape.state(0));
        let distance = DISTANCE * drive.interval.length;
        let own = &mut self.sides[side];
        let ends = [distance, -distance].map(|by| {
            own.values[0] = at.values[0] + by;
            for (i, rise) in drive.interval.rise.iter().enumerate() {
                own.values[tape.input(i)] = at.values[tape.input(i)] + rise * by;
            }
            for i in 0..n {
                let slope = self.slopes[side * n + i];
                own.values[first + i] = at.values[first + i] + slope * by;
            }
            for i in 0..tape.delays.len() {
                own.values[tape.delayed(i)] = drive.delays.at(i, at.values[0] + by);
            }
            tape.evaluate_slopes(own);
            tape.evaluate_guards(own);
            own.values[self.surfaces[guard].difference]
        });
        (ends[0] - ends[1]) * (0.5 / distance)
    }

    /// Solves `sum_k (r_jk - r_j0) a_k = b_j`, with `b` in the place of the shares, by elimination.
    fn solve(&mut self) {
        let m = self.surfaces.len();
        let rates = self.rates.chunks_exact(m + 1);
        self.matrix.clear();
        self.matrix
            .extend(rates.flat_map(|row| row[1..].iter().map(|rate| *rate - row[0])));
        let (a, b) = (&mut self.matrix, &mut self.shares);
        for k in 0..m {
            let size = |a: &[T], j: usize| a[j * m + k].value().abs();
            let largest = (k..m).max_by(|&i, &j| size(a, i).total_cmp(&size(a, j)));
            let pivot = largest.unwrap_or(k);
            b.swap(k, pivot);
            for i in 0..m {
                a.swap(k * m + i, pivot * m + i);
            }
            for j in k + 1..m {
                let factor = a[j * m + k] / a[k * m + k];
                for i in k..m {
                    a[j * m + i] = a[j * m + i] - factor * a[k * m + i];
                }
                b[j] = b[j] - factor * b[k];
            }
        }
        for k in (0..m).rev() {
            for i in k + 1..m {
                b[k] = b[k] - a[k * m + i] * b[i];
            }
            b[k] = b[k] / a[k * m + k];
        }
    }

    /// Whether both sides drive the states onto the guard that was added last, of the slopes computed last.
    pub fn is_attractive(&self, interval: f64, largest: &[f64]) -> bool {
        let (n, m) = (largest.len(), self.surfaces.len());
        let row = &self.rates[(m - 1) * (m + 1)..];
        let share = self.share(m - 1);
        let jumps = |i: usize| {
            let jump = (self.slopes[m * n + i] - self.slopes[i]).value().abs();
            jump * interval > JUMP * largest[i]
        };
        row[m].value() < row[0].value() && share > 0.0 && share < 1.0 && (0..n).any(jumps)
    }

    /// A guard that is not kept at zero any more, and to which side it goes, of the slopes computed last.
    pub fn let_go(&self, registers: &Registers<T>, interval: f64) -> Option<(usize, bool)> {
        let m = self.surfaces.len();
        (0..m).find_map(|k| {
            let row = &self.rates[k * (m + 1)..];
            let rate = row[0].value().abs().max(row[k + 1].value().abs());
            let difference = registers.values[self.surfaces[k].difference].value();
            if difference.abs() > OFF * interval * rate {
                return Some((k, difference > 0.0));
            }
            let share = self.share(k);
            (!(0.0..=1.0).contains(&share)).then_some((k, share > 1.0))
        })
    }

    /// Puts states back onto the guards, of the slopes computed last.
    pub fn put_back(&mut self, registers: &Registers<T>, x: &mut [T]) {
        let n = x.len();
        for (share, surface) in self.shares.iter_mut().zip(&self.surfaces) {
            *share = -registers.values[surface.difference];
        }
        self.solve();
        for (i, x) in x.iter_mut().enumerate() {
            *x = *x + self.mean(i, n) - self.slopes[i];
        }
    }

    /// The mean of the outputs of the sides, of the slopes computed last.
    pub fn read(&mut self, tape: &Tape, registers: &mut Registers<T>, outputs: &mut [T]) {
        tape.evaluate(registers);
        for (output, &register) in outputs.iter_mut().zip(&tape.outputs) {
            *output = registers.values[register];
        }
        let up_to = tape.delayed(tape.delays.len() + tape.plays.len());
        for (share, own) in self.shares.iter().zip(&mut self.sides[1..]) {
            own.values[..up_to].copy_from_slice(&registers.values[..up_to]);
            tape.evaluate(own);
            let share = if (0.0..=1.0).contains(&share.value()) {
                *share
            } else {
                T::constant(share.value().clamp(0.0, 1.0))
            };
            for (output, &register) in outputs.iter_mut().zip(&tape.outputs) {
                let there = own.values[register] - registers.values[register];
                *output = *output + share * there;
            }
        }
    }
}
