//! Tanks that are connected by valves: the flow through a valve, and the choice and computation of the steps.
//!
//! **Model**: the head `d`, the level difference between the two sides, drives the flow `a s(d)`, `s(d) = sign(d) sqrt(|d|)`, in either
//! direction.
//!
//! **Near equal levels** the slope of `s` is infinite at `d = 0`. A real orifice has laminar flow there, with a finite slope. For `|d| < w`
//! ([`WIDTH`] times the largest level that is read), `s` is replaced by the odd polynomial of degree five with the same value, slope and
//! curvature at `w`, `sqrt(w) (45 x - 18 x^3 + 5 x^5)/32`, `x = d/w`: twice continuously differentiable and monotone; for `|d| >= w` `s` is
//! exact. The error of the flow within `|d| < w` is below `0.18 a sqrt(w)`, which is 0.2 % of the flow at the largest level. The error of a
//! level is far smaller, since a changing head crosses this range quickly, and a constant head is wrong by less than `w`. The flow of a
//! valve leaves one tank and enters the other, so mass is conserved exactly.
//!
//! **Steps**: a Runge-Kutta step of order four is accurate for a square root only if the relative change of its argument is small. A step
//! is therefore halved until every head, at its present rate, changes by less than [`SHARE`] of the head plus `w`, and the step is shorter
//! than the fastest time constant allows. The rates include all effects: a leak that is fed by a small head keeps that head constant, and
//! the outflow of a tank that a pipe keeps nearly empty has an unbounded slope. If even a part of 1/[`UNITS`] of a step is too long, and
//! not stable where its heads are nearest to zero, that part is [implicit](super::exchange). Step lengths are chosen from values only, on a
//! copy of the vessels without derivatives, so that values and derivatives are integrated with the same steps. With the parameters of the
//! DTS200, sampled every second, and six crossings of levels up to 30 cm, the error is 8e-6 cm relative to a fine solution of the equations
//! without the polynomial: `cargo test -p plants --test all joined:: -- --nocapture`.
//!
//! **Source**: Amira, DTS200 laboratory setup three-tank-system, 1996, for the balance equations.

use crate::{
    Scalar,
    inflow::{Feed, Inflow},
};

use super::{
    Levels, Vessels, Watch,
    torricelli::{A_LITTLE, NEARLY_EMPTY, slope_of_root},
};

/// `w` as a share of the largest level that is read.
const WIDTH: f64 = 1e-4;
/// Largest change of a head in a step, as a share of the head.
const SHARE: f64 = 0.125;
/// Largest length of a step in time constants of the fastest exchange between tanks.
const LONGEST: f64 = 0.5;
/// Largest number of parts of a step.
const UNITS: usize = 128;

/// The valves between tanks.
#[derive(Clone, Copy)]
pub(crate) struct Valves {
    /// `w` \[level unit\].
    pub(super) width: f64,
}

impl Valves {
    /// `largest`: the largest level that is read, by magnitude.
    pub(crate) fn new(largest: f64) -> Self {
        let width = WIDTH * largest;
        Self {
            width: if width.is_finite() && width > 0.0 {
                width
            } else {
                WIDTH
            },
        }
    }

    /// The function `s` of a head.
    #[inline(always)]
    fn root<T: Scalar>(self, head: T) -> T {
        let d = head.value();
        if d >= self.width {
            head.sqrt()
        } else if d <= -self.width {
            -((-head).sqrt())
        } else {
            let x = head * (1.0 / self.width);
            let square = x * x;
            x * ((square * 5.0 - 18.0) * square + 45.0) * (self.width.sqrt() / 32.0)
        }
    }

    /// The derivative of `s` by the head.
    #[inline(always)]
    fn slope(self, head: f64) -> f64 {
        if head.abs() >= self.width {
            0.5 / head.abs().sqrt()
        } else {
            let square = (head / self.width).powi(2);
            ((25.0 * square - 54.0) * square + 45.0) / (32.0 * self.width.sqrt())
        }
    }
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Sets the copy of these vessels without derivatives, on which step lengths are chosen.
    pub(crate) fn cut_by(&mut self, values: Vessels<f64, N>) {
        self.values = Some(Box::new(values));
    }

    /// Advances by `h` from time `start` with a second inflow, into the last vessel.
    pub(crate) fn step_fed(
        &mut self,
        h: T,
        [q, second]: [&Inflow<T>; 2],
        start: T,
        watch: &mut Watch<T>,
    ) {
        let feed = Feed::new(start, h, second.coefficients());
        if let Some(values) = &mut self.values {
            values.feed = Some(feed.values());
        }
        self.feed = Some(feed);
        self.step(h, q, start, watch);
    }

    /// The inflow in addition to that of the first pump: of the second pump, or a measured disturbance.
    #[inline(always)]
    pub(super) fn fed(&self, t: f64) -> T {
        let Some(feed) = &self.feed else {
            return T::constant(0.0);
        };
        feed.at(|| self.time(t))
    }

    /// Flow through the valve behind vessel `i` at a head.
    #[inline(always)]
    pub(super) fn through_valve(&self, i: usize, head: T) -> T {
        let valves = self.valves.unwrap_or(Valves { width: WIDTH });
        self.vessels[i].coefficient * valves.root(head)
    }

    /// Derivative of the outflow of vessel `i` by its level, from values only \[flow/level unit\].
    pub(super) fn valve_slope(&self, i: usize, levels: &Levels<T, N>, t: f64) -> f64 {
        let vessel = &self.vessels[i];
        let alpha = vessel.coefficient.value();
        let own = match self.valves {
            Some(valves) if i + 1 < N => {
                alpha * valves.slope(levels[i].value() - levels[i + 1].value())
            }
            _ => {
                // An empty vessel is replaced by a nearly empty one: the vessel may begin to fill.
                let level = levels[i].value().max(A_LITTLE);
                alpha * slope_of_root(level)
            }
        };
        if vessel.laws.outflow.is_empty() && vessel.laws.head.is_empty() {
            return own;
        }
        // The contribution of the effects is a finite difference, so that it is zero for effects at their absent values.
        let (level, now) = (levels[i].value(), T::constant(t));
        let step = 1e-6 * (level.abs() + 1e-3);
        let added = |level: f64| {
            let level = T::constant(level);
            let head = self.own_head(i, &level, levels);
            (self.outflow(i, &level, levels, &now) - self.own_outflow(i, &head)).value()
        };
        (own + (added(level + step) - added(level)) / step).max(0.0)
    }

    /// Decay rate of vessel `i` at a level, the negative derivative of the level's rate by the level, with the other levels held \[1/s\].
    pub(super) fn joined_slope(&self, i: usize, level: T, t: f64) -> T {
        let mut levels = self.levels;
        levels[i] = level;
        let mut slope = self.valve_slope(i, &levels, t);
        if i > 0 {
            slope += self.valve_slope(i - 1, &levels, t);
        }
        if !self.vessels[i].laws.by_level.is_empty() {
            slope += self.loss_slope(i, level, &T::constant(t)).value();
        }
        T::constant(slope / self.area(i, &level).value())
    }

    /// A step in parts that are stable, and short enough for the square roots of low levels.
    pub(super) fn joined_part(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        // Only the copy itself has no copy, and the copy is never stepped.
        let Some(mut values) = self.values.take() else {
            return;
        };
        let given = Inflow {
            start: q.start.value(),
            middle: q.middle.value(),
            end: q.end.value(),
        };
        let mut done = 0;
        while done < UNITS {
            let edge = |units: usize| units as f64 / UNITS as f64;
            let begin = t + h.value() * edge(done);
            let start = given.part(edge(done), 1.0).start;
            values.stand_as(self);
            let pace = values.pace(h.value(), start, begin);
            // The longest part that is short enough: a power of two of units, from the end of the previous part on.
            let mut units = 1 << (UNITS - done).ilog2();
            while units > 1 && pace.roots.max(pace.stiff) * edge(units) > 1.0 {
                units /= 2;
            }
            if units == UNITS && pace.roots.max(pace.stiff) <= 1.0 {
                self.unit(h, q, t, watch);
                break;
            }
            let length = h * edge(units);
            let inflow = q.part(T::constant(edge(done)), T::constant(edge(done + units)));
            let short = pace.stiff * edge(units) <= 1.0
                && (pace.roots * edge(units) <= 1.0
                    || values.slow_at_a_root(length.value(), &pace.rates, begin));
            if short {
                self.unit(length, &inflow, begin, watch);
            } else {
                self.exchange_implicitly(&mut values, length, &inflow, begin, watch);
            }
            done += units;
        }
        self.values = Some(values);
    }
}

/// The length of a step relative to the allowed lengths.
struct Pace<const N: usize> {
    rates: [f64; N],
    /// Length relative to the longest step that is accurate at the square roots.
    roots: f64,
    /// Length relative to the longest stable step.
    stiff: f64,
}

/// The choice of the step length, from values only.
impl<const N: usize> Vessels<f64, N> {
    /// Copies the levels and modes of the vessels with derivatives.
    pub(super) fn stand_as<T: Scalar>(&mut self, vessels: &Vessels<T, N>) {
        self.levels = vessels.levels.map(T::value);
        if self.rims {
            for (own, vessel) in self.vessels.iter_mut().zip(&vessels.vessels) {
                own.spilling = vessel.spilling;
            }
        }
    }

    /// For the outlet of vessel `i`: the head under the square root, its rate, and the width of the range near zero where the root is
    /// replaced.
    fn head_of_root(&self, i: usize, rates: &[f64; N]) -> (f64, f64, f64) {
        match self.valves {
            Some(valves) if i + 1 < N => (
                self.levels[i] - self.levels[i + 1],
                rates[i] - rates[i + 1],
                valves.width,
            ),
            _ => (self.levels[i], rates[i], NEARLY_EMPTY),
        }
    }

    /// The length of a step of length `h` under an inflow `q`, relative to the allowed lengths.
    fn pace(&self, h: f64, q: f64, t: f64) -> Pace<N> {
        let rates = self.rates(&self.levels, q, t);
        let (mut fastest, mut most, mut before) = (0.0_f64, 0.0_f64, 0.0);
        for i in 0..N {
            let slope = self.valve_slope(i, &self.levels, t);
            fastest = fastest.max((before + slope) / self.area(i, &self.levels[i]));
            before = slope;
            let (head, moves, width) = self.head_of_root(i, &rates);
            most = most.max(moves.abs() / (head.abs() + width));
        }
        let losses = self.stiffness_of_losses(h, &Inflow::held(q), t);
        Pace {
            rates,
            roots: h * most / SHARE,
            stiff: (h * fastest / LONGEST).max(losses),
        }
    }

    /// Whether a step is stable also at the heads nearest to zero that occur within it.
    fn slow_at_a_root(&self, h: f64, rates: &[f64; N], t: f64) -> bool {
        let mut before = 0.0;
        (0..N).all(|i| {
            let (head, moves, _) = self.head_of_root(i, rates);
            let after = head + h * moves;
            let nearest = if after * head <= 0.0 {
                0.0
            } else if after.abs() < head.abs() {
                after
            } else {
                head
            };
            let mut there = self.levels;
            there[i] += nearest - head;
            let slope = self.valve_slope(i, &there, t);
            let sum = before + slope;
            before = slope;
            h * sum <= LONGEST * self.area(i, &there[i])
        })
    }
}
