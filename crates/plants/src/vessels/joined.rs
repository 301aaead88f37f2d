//! Tanks that are joined by valves: what flows through a valve, and how a step is cut and taken.
//!
//! **Model**: a head `d`, by how much the level on one side is above that on the other, drives `a s(d)`,
//! `s(d) = sign(d) sqrt(|d|)`, either way.
//!
//! **Where the levels are equal** the slope of `s` is infinite. A real orifice is laminar there, with a finite one. Within
//! `|d| < w` ([`WIDTH`] of the largest measured level) `s` is the odd polynomial of degree five that meets value, slope and curvature at
//! `w`, `sqrt(w) (45 x - 18 x^3 + 5 x^5)/32`, `x = d/w`: smooth to the second derivative and monotone, exact beyond `w`. Within it a flow
//! errs by less than `0.18 a sqrt(w)`, which is 0.2 % of that at the largest level; a level errs by far less, since a head
//! that moves is through soon, and one that rests errs by less than `w`. Flows are shared by both tanks, so the balance of mass is kept
//! exactly.
//!
//! **Steps**: Runge-Kutta of order four resolves a root only as long as its argument changes by a share of itself, so a step is cut in
//! halves until every head changes by less than [`SHARE`] of itself and `w` and the step is shorter than the fastest exchange. Where a part
//! of 1/[`UNITS`] of a step is too long for that still, it is implicit (Euler's rule for all levels at once, solved by Newton's method) and of
//! order one. Lengths are chosen by values alone, so that derivatives follow one path. On the DTS200's numbers,
//! sampled every second, with six crossings of levels up to 30 cm, they err by 8e-6 cm against a fine solution of the equations without
//! the polynomial: `cargo test -p plants --test all joined:: -- --nocapture`.
//!
//! **Known fault**: at steps of half a minute and more a derivative may be without bound for an instant, where a level comes to rest where a law
//! jumps: a raised pipe and a leak in T2 (3.4, 3.1; 9.1, 8.7, 12.0, 1.9, 3.1 as parameters in their order), levels of 15, 11.5 and 8.2, a
//! steady command, 35 s. Levels are right.
//!
//! **Source**: Amira, DTS200 laboratory setup three-tank-system, 1996, for the balance.

use crate::{Scalar, inflow::Inflow};

use super::{
    Levels, Stretch, Vessels, Watch,
    torricelli::{A_LITTLE, slope_of_root, square_root},
};

/// `w` as a share of the largest measured level.
const WIDTH: f64 = 1e-4;
/// A step may change a head by this share of itself.
const SHARE: f64 = 0.125;
/// How many time constants of the fastest exchange a step may last.
const LONGEST: f64 = 0.5;
/// The most parts that a step is cut into.
const UNITS: usize = 128;
/// Iterations of Newton's method, and the share of the largest level to which it is taken.
const NEWTON: (usize, f64) = (30, 1e-13);

/// The valves between tanks.
#[derive(Clone, Copy)]
pub(crate) struct Valves {
    /// `w` \[level unit\].
    width: f64,
}

impl Valves {
    /// `largest`: the largest measured level, by magnitude.
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

/// What the second pump brings over a step that begins at `start`: `a + b s + c s^2`, `s` the share of its length.
pub(super) struct Feed<T> {
    start: T,
    length: T,
    coefficients: [T; 3],
    held: bool,
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Moves on by `h` from time `start` with a second inflow, into the last vessel.
    pub(crate) fn step_fed(
        &mut self,
        h: T,
        [q, second]: [&Inflow<T>; 2],
        start: T,
        watch: &mut Watch<T>,
    ) {
        let coefficients = second.coefficients();
        let [_, b, c] = coefficients;
        let nothing = |x: T| x.value() == 0.0 && x.same_derivatives(T::constant(0.0));
        self.feed = Some(Feed {
            start,
            length: h,
            coefficients,
            held: nothing(b) && nothing(c),
        });
        self.step(h, q, start, watch);
    }

    /// The second pump's inflow.
    #[inline(always)]
    pub(super) fn fed(&self, t: f64) -> T {
        let Some(feed) = &self.feed else {
            return T::constant(0.0);
        };
        let [a, b, c] = feed.coefficients;
        if feed.held || feed.length.value() == 0.0 {
            return a;
        }
        let share = (self.time(t) - feed.start) / feed.length;
        a + (b + c * share) * share
    }

    /// What the valve behind vessel `i` lets through at a head.
    #[inline(always)]
    pub(super) fn through_valve(&self, i: usize, head: T) -> T {
        let valves = self.valves.unwrap_or(Valves { width: WIDTH });
        self.vessels[i].coefficient * valves.root(head)
    }

    /// By how much more flows out of vessel `i` for one unit of level more in it, at values alone \[flow/level unit\].
    fn valve_slope(&self, i: usize, levels: &Levels<T, N>, t: f64) -> f64 {
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

    /// How many times longer than it may be a step of length `h` is, as far as roots are concerned, and as far as stability is.
    fn too_long(&self, h: f64, q: &Inflow<T>, t: f64) -> [f64; 2] {
        let Some(valves) = self.valves else {
            return [0.0; 2];
        };
        let mut fastest = 0.0_f64;
        let (mut before, mut inflow) = (0.0, q.start.value());
        let mut rates = [0.0; N];
        let mut slopes = [0.0; N];
        for i in 0..N {
            slopes[i] = self.valve_slope(i, &self.levels, t);
            let level = self.levels[i].value();
            let area = if self.vessels[i].laws.area.is_empty() {
                self.vessels[i].area.value()
            } else {
                self.area(i, &self.levels[i]).value()
            };
            fastest = fastest.max((before + slopes[i]) / area);
            // Rates but for what effects do: they are no more than a measure.
            let alpha = self.vessels[i].coefficient.value();
            let outflow = if i + 1 < N {
                alpha * valves.root(level - self.levels[i + 1].value())
            } else {
                inflow += self.fed(t).value();
                alpha * square_root(level)
            };
            if !self.vessels[i].spilling {
                rates[i] = (inflow - outflow) / area;
            }
            (before, inflow) = (slopes[i], outflow);
        }
        let mut most = 0.0_f64;
        for i in 0..N {
            let (head, moves) = if i + 1 < N {
                let head = self.levels[i].value() - self.levels[i + 1].value();
                (head, rates[i] - rates[i + 1])
            } else {
                (self.levels[i].value(), rates[i])
            };
            most = most.max(moves.abs() / (head.abs() + valves.width));
        }
        let losses = self.stiffness_of_losses(h, q, t);
        [h * most / SHARE, (h * fastest / LONGEST).max(losses)]
    }

    /// A step, cut where a root or an exchange asks for it.
    pub(super) fn joined_part(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let [roots, stiff] = self.too_long(h.value(), q, t);
        if roots.max(stiff) <= 1.0 {
            self.unit(h, q, t, watch);
            return;
        }
        let mut done = 0;
        while done < UNITS {
            let edge = |units: usize| units as f64 / UNITS as f64;
            let begin = t + h.value() * edge(done);
            let rest = q.part(T::constant(edge(done)), T::constant(1.0));
            let [roots, stiff] = self.too_long(h.value(), &rest, begin);
            // The longest that is short enough: parts are halves of halves, wherever the one before ended.
            let mut units = 1 << (UNITS - done).ilog2();
            while units > 1 && roots.max(stiff) * edge(units) > 1.0 {
                units /= 2;
            }
            let length = h * edge(units);
            let inflow = q.part(T::constant(edge(done)), T::constant(edge(done + units)));
            if stiff * edge(units) <= 1.0 {
                self.unit(length, &inflow, begin, watch);
            } else {
                self.exchange_implicitly(length, &inflow, begin, watch);
            }
            done += units;
        }
    }

    /// A step that cannot overshoot, whatever its length: Euler's implicit rule for all levels, of order one.
    fn exchange_implicitly(&mut self, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let end = t + h.value();
        self.settle_modes(q.start, t, None);
        let reach = self.levels.iter().map(|level| level.value().abs());
        let small = NEWTON.1 * reach.fold(1e-3, f64::max);
        let mut there = self.levels.map(|level| T::constant(level.value()));
        for _ in 0..NEWTON.0 {
            let next = self.newton(&there, h, q.end, end);
            let mut moved = 0.0_f64;
            for (i, to) in there.iter_mut().enumerate() {
                let rim = self.vessels[i].rim.level.value();
                let level = next[i].value().min(rim).max(0.0);
                moved = moved.max((level - to.value()).abs());
                *to = T::constant(level);
            }
            if moved.is_nan() || moved <= small {
                break;
            }
        }
        // A last step in duals gives the solution its derivatives.
        let next = self.newton(&there, h, q.end, end);
        if let Some(watch) = watch {
            let (before, after) = (self.levels[self.measured], next[self.measured]);
            watch(&Stretch::straight(h, before, after));
        }
        self.levels = next;
        self.keep_within();
    }

    /// A step of Newton's method for `x = levels + h f(x)`, from values `x`: a tridiagonal system, each row a tank.
    fn newton(&self, x: &Levels<T, N>, h: T, q: T, t: f64) -> Levels<T, N> {
        let dt = h.value();
        let rates = self.rates(x, q, t);
        let mut slopes = [0.0; N];
        for (i, slope) in slopes.iter_mut().enumerate() {
            *slope = self.valve_slope(i, x, t);
        }
        let mut upper = [0.0; N];
        let mut excess: Levels<T, N> = [T::constant(0.0); N];
        for i in 0..N {
            let area = self.area(i, &x[i]).value();
            let share = if self.vessels[i].spilling {
                0.0
            } else {
                dt / area
            };
            let loss = if self.vessels[i].laws.by_level.is_empty() {
                0.0
            } else {
                self.loss_slope(i, x[i], &T::constant(t)).value().max(0.0)
            };
            let before = if i > 0 { slopes[i - 1] } else { 0.0 };
            let lower = -share * before;
            let mut diagonal = 1.0 + share * (before + slopes[i] + loss);
            let mut right = self.levels[i] - x[i] + rates[i] * h;
            if i > 0 {
                diagonal -= lower * upper[i - 1];
                right = right - excess[i - 1] * lower;
            }
            upper[i] = if i + 1 < N {
                -share * slopes[i] / diagonal
            } else {
                0.0
            };
            excess[i] = right * (1.0 / diagonal);
        }
        let mut next = *x;
        for i in (0..N).rev() {
            if i + 1 < N {
                let ahead = excess[i + 1] * upper[i];
                excess[i] = excess[i] - ahead;
            }
            next[i] = next[i] + excess[i];
        }
        next
    }
}
