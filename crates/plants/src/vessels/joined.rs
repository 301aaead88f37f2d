//! Tanks that are joined by valves: what flows through a valve, and how a step is cut and taken.
//!
//! **Model**: a head `d`, by how much the level on one side is above that on the other, drives `a s(d)`,
//! `s(d) = sign(d) sqrt(|d|)`, either way.
//!
//! **Where the levels are equal** the slope of `s` is infinite. A real orifice is laminar there, with a finite one. Within
//! `|d| < w` ([`WIDTH`] of the largest level that is read) `s` is the odd polynomial of degree five that meets value, slope and curvature at
//! `w`, `sqrt(w) (45 x - 18 x^3 + 5 x^5)/32`, `x = d/w`: smooth to the second derivative and monotone, exact beyond `w`. Within it a flow
//! errs by less than `0.18 a sqrt(w)`, which is 0.2 % of that at the largest level; a level errs by far less, since a head
//! that moves is through soon, and one that rests errs by less than `w`. Flows are shared by both tanks, so the balance of mass is kept
//! exactly.
//!
//! **Steps**: Runge-Kutta of order four resolves a root only as long as its argument changes by a share of itself, so a step is cut in
//! halves until every head, at its present rate, changes by less than [`SHARE`] of itself and `w` and the step is shorter than the fastest
//! exchange. The rates are those with all effects: a leak that a small head feeds keeps that head where it is, and a tank that a pipe
//! keeps a hair above empty is where the slope of the outflow has no bound. Where a part of 1/[`UNITS`] of a step is too long for that
//! still, and not stable where its heads come nearest to zero, it is [implicit](super::exchange). Lengths are chosen by values alone, on
//! a copy of the vessels without derivatives, so that derivatives follow one path. On the DTS200's numbers,
//! sampled every second, with six crossings of levels up to 30 cm, they err by 8e-6 cm against a fine solution of the equations without
//! the polynomial: `cargo test -p plants --test all joined:: -- --nocapture`.
//!
//! **Source**: Amira, DTS200 laboratory setup three-tank-system, 1996, for the balance.

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
/// A step may change a head by this share of itself.
const SHARE: f64 = 0.125;
/// How many time constants of the fastest exchange a step may last.
const LONGEST: f64 = 0.5;
/// The most parts that a step is cut into.
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

    /// `s` of a head.
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

    /// Its slope.
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
    /// Has its steps cut as these vessels say, which are the same without derivatives.
    pub(crate) fn cut_by(&mut self, values: Vessels<f64, N>) {
        self.values = Some(Box::new(values));
    }

    /// Moves on by `h` from time `start` with a second inflow, into the last vessel.
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

    /// The inflow beside that of the first pump: of the second one, or a measured disturbance.
    #[inline(always)]
    pub(super) fn fed(&self, t: f64) -> T {
        let Some(feed) = &self.feed else {
            return T::constant(0.0);
        };
        feed.at(|| self.time(t))
    }

    /// What the valve behind vessel `i` lets through at a head.
    #[inline(always)]
    pub(super) fn through_valve(&self, i: usize, head: T) -> T {
        let valves = self.valves.unwrap_or(Valves { width: WIDTH });
        self.vessels[i].coefficient * valves.root(head)
    }

    /// By how much more flows out of vessel `i` for one unit of level more in it, at values alone \[flow/level unit\].
    pub(super) fn valve_slope(&self, i: usize, levels: &Levels<T, N>, t: f64) -> f64 {
        let vessel = &self.vessels[i];
        let alpha = vessel.coefficient.value();
        let own = match self.valves {
            Some(valves) if i + 1 < N => {
                alpha * valves.slope(levels[i].value() - levels[i + 1].value())
            }
            _ => {
                // An empty vessel is taken as one with a little in it: it may be about to fill.
                let level = levels[i].value().max(A_LITTLE);
                alpha * slope_of_root(level)
            }
        };
        if vessel.laws.outflow.is_empty() && vessel.laws.head.is_empty() {
            return own;
        }
        // What the effects add, by a difference, so that it vanishes with them.
        let (level, now) = (levels[i].value(), T::constant(t));
        let step = 1e-6 * (level.abs() + 1e-3);
        let added = |level: f64| {
            let level = T::constant(level);
            let head = self.own_head(i, &level, levels);
            (self.outflow(i, &level, levels, &now) - self.own_outflow(i, &head)).value()
        };
        (own + (added(level + step) - added(level)) / step).max(0.0)
    }

    /// By how much a level of vessel `i` slows its own rise where it is higher \[1/s\], the other levels being as they are.
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

    /// A step, cut where a root or an exchange asks for it.
    pub(super) fn joined_part(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        // Only the copy has none, and nobody steps it.
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
            // The longest that is short enough: parts are halves of halves, wherever the one before ended.
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

/// How fast the levels are, over a step.
struct Pace<const N: usize> {
    rates: [f64; N],
    /// How many times longer than it may be the step is, as far as roots are concerned.
    roots: f64,
    /// As far as stability is concerned.
    stiff: f64,
}

/// What looks ahead needs no derivatives.
impl<const N: usize> Vessels<f64, N> {
    /// Takes the levels and modes of the vessels whose values it has.
    pub(super) fn stand_as<T: Scalar>(&mut self, vessels: &Vessels<T, N>) {
        self.levels = vessels.levels.map(T::value);
        if self.rims {
            for (own, vessel) in self.vessels.iter_mut().zip(&vessels.vessels) {
                own.spilling = vessel.spilling;
            }
        }
    }

    /// The head of vessel `i` that has a root, by how much it moves, and below what the root is none.
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

    /// How fast the levels are under an inflow `q`, over a step of length `h`.
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

    /// Whether a step is stable also where its heads are nearest to zero on their way.
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
