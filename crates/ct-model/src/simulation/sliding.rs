//! Sliding modes: the right-hand side is discontinuous at `g(t, x) = 0` and drives the states towards this surface from both sides.
//!
//! The states stay on `g = 0`. Their slope is the convex combination of the slopes of both sides that keeps them there (Filippov): with
//! `f_0` where every such `g` is negative and `f_k` where the `k`-th is positive,
//! `dx/dt = f_0 + sum_k a_k (f_k - f_0)`, `a` such that `dg_j/dt = 0` for all `j`.
//! Sliding on a surface ends when its `a` leaves the range from 0 to 1. Examples: a mass that dry friction holds, a level that a relay
//! holds. For several surfaces at a time, the jumps of the slope are assumed to add up, as for separate terms.
//!
//! After each step the states are projected onto `g = 0` along the jumps of the slope; the projection is exact for the derivatives too.
//!
//! **Reference**: A. F. Filippov, Differential Equations with Discontinuous Righthand Sides, Kluwer 1988, section 4.

use super::drive::Drive;
use crate::scalar::Scalar;
use crate::tape::{Register, Registers, Tape};

/// Perturbation for the finite differences that give the rate of a guard, as a share of the interval.
const DISTANCE: f64 = 1e-4;
/// The right-hand side has a jump if the slopes of both sides change a state differently by more than this share of its size in an
/// interval.
const JUMP: f64 = 1e-9;
/// An input jump has moved a guard off zero if its distance from zero exceeds this share of the change that its rate causes in an interval.
const OFF: f64 = 1e-9;

/// A guard on whose surface the states slide.
#[derive(Debug, Clone, Copy)]
struct Surface {
    difference: Register,
    /// If the guard compares a state with a number: the state, and the sign with which it enters.
    state: Option<(usize, f64)>,
}

#[derive(Debug, Clone)]
pub(super) struct Sliding<T> {
    surfaces: Vec<Surface>,
    /// Registers with all guards negative, then with each guard positive in turn.
    sides: Vec<Registers<T>>,
    /// The slopes of the states on each side, one side after the other.
    slopes: Vec<T>,
    /// Rate of each guard (rows) on each side.
    rates: Vec<T>,
    /// The weight `a` of each guard's positive side.
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

    /// Whether the states slide on the surface of this difference.
    pub fn holds(&self, difference: Register) -> bool {
        self.surfaces.iter().any(|s| s.difference == difference)
    }

    /// The weight of a guard's positive side in the slopes that were computed last.
    pub fn share(&self, k: usize) -> f64 {
        self.shares[k].value()
    }

    /// Adds a surface on which the states slide. From here on, the registers take the branches of its negative side.
    pub fn add(&mut self, tape: &Tape, registers: &mut Registers<T>, difference: Register) {
        self.surfaces.push(Surface {
            difference,
            state: tape.state_of(difference),
        });
        self.follow(tape, registers);
    }

    /// Ends the sliding on a surface; the guard goes to the given side.
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

    /// Sets the branches of all sides to those of the registers, except for the guards on which the states slide.
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
                self.sides.push(registers.copied());
                self.sides[side].held = false;
            }
            tape.copy_answers(registers, &mut self.sides[side]);
            if let Some(own) = side.checked_sub(1) {
                let difference = self.surfaces[own].difference;
                tape.answer(&mut self.sides[side], difference, true);
            }
        }
    }

    /// Replaces the slopes in the registers, which are those of the negative side, by the convex combination of all sides.
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
            // States and functions of inputs alone have the same values on all sides.
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
                if let Some(value) = drive.delays.at(i, at.values[0] + by) {
                    own.values[tape.delayed(i)] = value;
                }
            }
            tape.evaluate_slopes(own);
            tape.evaluate_guards(own);
            own.values[self.surfaces[guard].difference]
        });
        (ends[0] - ends[1]) * (0.5 / distance)
    }

    /// Solves `sum_k (r_jk - r_j0) a_k = b_j` by elimination; on entry the shares hold `b`, on return `a`.
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

    /// Whether both sides drive the states onto the surface that was added last, by the slopes that were computed last.
    pub fn is_attractive(&self, registers: &Registers<T>, interval: f64, largest: &[f64]) -> bool {
        let (n, m) = (largest.len(), self.surfaces.len());
        if self.is_off(m - 1, registers, interval) {
            return false;
        }
        let row = &self.rates[(m - 1) * (m + 1)..];
        let share = self.share(m - 1);
        let jumps = |i: usize| {
            let jump = (self.slopes[m * n + i] - self.slopes[i]).value().abs();
            jump * interval > JUMP * largest[i]
        };
        row[m].value() < row[0].value() && share > 0.0 && share < 1.0 && (0..n).any(jumps)
    }

    /// Whether the states are off a surface: something has made its difference jump.
    fn is_off(&self, k: usize, registers: &Registers<T>, interval: f64) -> bool {
        let row = &self.rates[k * (self.surfaces.len() + 1)..];
        let rate = row[0].value().abs().max(row[k + 1].value().abs());
        let difference = registers.values[self.surfaces[k].difference].value();
        difference.abs() > OFF * interval * rate
    }

    /// A guard on which sliding ends, and whether it becomes positive, by the slopes that were computed last.
    pub fn let_go(&self, registers: &Registers<T>, interval: f64) -> Option<(usize, bool)> {
        let m = self.surfaces.len();
        (0..m).find_map(|k| {
            if self.is_off(k, registers, interval) {
                let difference = registers.values[self.surfaces[k].difference];
                return Some((k, difference.value() > 0.0));
            }
            let share = self.share(k);
            (!(0.0..=1.0).contains(&share)).then_some((k, share > 1.0))
        })
    }

    /// Projects the states onto the surfaces, with the slopes that were computed last.
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

    /// The weighted mean of the outputs of all sides, with the weights that were computed last.
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
