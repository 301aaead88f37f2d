//! The vessels' balances over one step: Runge-Kutta of order four in `f64` or duals, with the instant
//! at which a level meets its rim located, so that the step keeps its order and its derivatives.

use crate::{Law, Outlet, Rim, Scalar, linear::Propagators, structure::MAX_VESSELS};

/// Below this level Torricelli's root, whose slope is infinite at zero, gives way to a parabola \[level unit\].
const NEARLY_EMPTY: f64 = 1e-4;

/// `sqrt(level)`, zero for an empty vessel, with a finite slope at empty.
pub(crate) fn square_root<T: Scalar>(level: T) -> T {
    let h = level.value();
    if h >= NEARLY_EMPTY {
        level.sqrt()
    } else if h > 0.0 {
        // Value and slope meet those of the root at the join.
        let x = level * (1.0 / NEARLY_EMPTY);
        (x * 1.5 - x * x * 0.5) * NEARLY_EMPTY.sqrt()
    } else {
        T::constant(0.0)
    }
}

/// The inflow to the first vessel over a step: at its beginning, middle and end; a parabola through the three.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inflow<T> {
    pub start: T,
    pub middle: T,
    pub end: T,
}

impl<T: Scalar> Inflow<T> {
    pub(crate) fn held(q: T) -> Self {
        Self {
            start: q,
            middle: q,
            end: q,
        }
    }

    pub(crate) fn map(self, mut f: impl FnMut(T) -> T) -> Self {
        Self {
            start: f(self.start),
            middle: f(self.middle),
            end: f(self.end),
        }
    }

    /// Coefficients of `a + b s + c s^2`, `s` from 0 to 1 over the step.
    pub(crate) fn coefficients(self) -> [T; 3] {
        let b = self.middle * 4.0 - self.start * 3.0 - self.end;
        let c = (self.start + self.end) * 2.0 - self.middle * 4.0;
        [self.start, b, c]
    }

    /// The part from `from` to `to`, both in `[0, 1]`.
    pub(crate) fn part(self, from: T, to: T) -> Self {
        let [a, b, c] = self.coefficients();
        let at = |s: T| a + (b + c * s) * s;
        Self {
            start: at(from),
            middle: at((from + to) * 0.5),
            end: at(to),
        }
    }
}

type Levels<T> = [T; MAX_VESSELS];

/// Who wants to see the smooth stretches of the measured level, if anybody.
pub(crate) type Watch<'a, T> = Option<&'a mut dyn FnMut(&Stretch<T>)>;

/// One vessel as the balance sees it.
struct Vessel<T> {
    area: T,
    outlet: Outlet,
    /// `alpha` for Torricelli, `offset` for a linear outlet.
    coefficient: T,
    rim: Rim<T>,
    spilling: bool,
    /// Positions of the laws that act here.
    laws: Vec<usize>,
}

/// The vessels in series.
pub(crate) struct Vessels<T: Scalar> {
    vessels: Vec<Vessel<T>>,
    laws: Vec<Box<dyn Law<T>>>,
    pub(crate) levels: Levels<T>,
    /// For linear vessels without effects: exact propagation.
    propagators: Option<Propagators<T>>,
}

/// A stretch of time over which the measured level moved smoothly.
pub(crate) struct Stretch<T> {
    pub h: T,
    pub before: T,
    pub after: T,
    pub rate_before: T,
    pub rate_after: T,
}

impl<T: Scalar> Vessels<T> {
    /// `parts`: area, outlet and its coefficient for each vessel; `laws`: the vessel each acts in, and the law.
    pub(crate) fn new(
        parts: Vec<(T, Outlet, T)>,
        laws: Vec<(usize, Box<dyn Law<T>>)>,
        levels: &[T],
    ) -> Self {
        let mut vessels: Vec<Vessel<T>> = parts
            .into_iter()
            .map(|(area, outlet, coefficient)| Vessel {
                area,
                outlet,
                coefficient,
                rim: Rim {
                    level: T::constant(f64::INFINITY),
                    fraction: T::constant(0.0),
                },
                spilling: false,
                laws: Vec::new(),
            })
            .collect();
        let linear = laws.is_empty() && vessels.iter().all(|v| v.outlet == Outlet::Linear);
        let mut bound = Vec::with_capacity(laws.len());
        for (vessel, law) in laws {
            match law.rim() {
                Some(rim) => vessels[vessel].rim = rim,
                None => vessels[vessel].laws.push(bound.len()),
            }
            bound.push(law);
        }
        let propagators = linear
            .then(|| Propagators::new(vessels.iter().map(|v| (v.area, v.coefficient)).collect()));
        let mut initial = [T::constant(0.0); MAX_VESSELS];
        for (level, given) in initial.iter_mut().zip(levels) {
            *level = *given;
        }
        let mut all = Self {
            vessels,
            laws: bound,
            levels: initial,
            propagators,
        };
        all.keep_within();
        all
    }

    /// Levels lie between empty (where the outlet is Torricelli's) and the rim.
    fn keep_within(&mut self) {
        for (vessel, level) in self.vessels.iter().zip(&mut self.levels) {
            if level.value() > vessel.rim.level.value() {
                *level = vessel.rim.level;
            }
            if vessel.outlet == Outlet::Torricelli && level.value() < 0.0 {
                *level = T::constant(0.0);
            }
        }
    }

    /// What flows out of vessel `i` to the next one, and its net inflow, at a level.
    #[inline]
    fn balance(&self, i: usize, level: T, inflow: T, t: f64) -> (T, T) {
        let vessel = &self.vessels[i];
        let mut outflow = match vessel.outlet {
            Outlet::Torricelli => vessel.coefficient * square_root(level),
            Outlet::Linear => level - vessel.coefficient,
        };
        for &law in &vessel.laws {
            outflow = self.laws[law].outflow(level, outflow, t);
        }
        let mut net = inflow - outflow;
        for &law in &vessel.laws {
            net = self.laws[law].net(level, net, t);
        }
        (outflow, net)
    }

    /// Rates of all levels \[level unit/s\].
    #[inline]
    fn rates(&self, levels: &Levels<T>, q: T, t: f64) -> Levels<T> {
        let mut rates = [T::constant(0.0); MAX_VESSELS];
        let mut inflow = q;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let level = levels[i];
            let (outflow, net) = self.balance(i, level, inflow, t);
            inflow = outflow;
            if vessel.spilling {
                // The level stands at the rim, and the net inflow spills.
                if net.value() > 0.0 {
                    inflow = inflow + net * vessel.rim.fraction;
                }
            } else {
                let mut area = vessel.area;
                for &law in &vessel.laws {
                    area = self.laws[law].area(level, area);
                }
                rates[i] = net / area;
            }
        }
        rates
    }

    /// One Runge-Kutta step from the present levels, in the present modes.
    fn trial(&self, h: T, q: Inflow<T>, t: f64) -> Levels<T> {
        let n = self.vessels.len();
        let half = h * 0.5;
        let dt = h.value();
        let moved = |by: &Levels<T>, h: T| {
            let mut to = self.levels;
            for i in 0..n {
                to[i] = to[i] + by[i] * h;
            }
            to
        };
        let k1 = self.rates(&self.levels, q.start, t);
        let k2 = self.rates(&moved(&k1, half), q.middle, t + 0.5 * dt);
        let k3 = self.rates(&moved(&k2, half), q.middle, t + 0.5 * dt);
        let k4 = self.rates(&moved(&k3, h), q.end, t + dt);
        let mut next = self.levels;
        for i in 0..n {
            next[i] = next[i] + (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * h * (1.0 / 6.0);
        }
        next
    }

    /// Which vessels spill: those that stand at their rim with a positive net inflow.
    fn settle_modes(&mut self, q: T, t: f64) {
        let mut inflow = q;
        for i in 0..self.vessels.len() {
            let (outflow, net) = self.balance(i, self.levels[i], inflow, t);
            let vessel = &mut self.vessels[i];
            let rim = vessel.rim.level.value();
            // A level that was put on the rim by the search below is there up to rounding.
            let at_rim = self.levels[i].value() >= rim - 1e-12 * rim.abs();
            vessel.spilling = at_rim && net.value() > 0.0;
            inflow = outflow;
            if vessel.spilling {
                self.levels[i] = vessel.rim.level;
                inflow = inflow + net * vessel.rim.fraction;
            }
        }
    }

    /// Moves on by `h` from time `t`; `watch` sees every smooth stretch of the measured level in turn.
    pub(crate) fn step(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if let Some(propagators) = &mut self.propagators {
            let before = self.levels;
            let next = propagators.advance(&before, h, q);
            let last = self.vessels.len() - 1;
            if let Some(watch) = watch {
                let rate_before = self.rates(&before, q.start, t)[last];
                let rate_after = self.rates(&next, q.end, t + h.value())[last];
                watch(&Stretch {
                    h,
                    before: before[last],
                    after: next[last],
                    rate_before,
                    rate_after,
                });
            }
            self.levels = next;
            return;
        }
        if self
            .vessels
            .iter()
            .all(|v| v.rim.level.value() == f64::INFINITY)
        {
            let next = self.trial(h, q, t);
            self.accept(next, h, q, t, watch);
            return;
        }
        let (mut h, mut q, mut t) = (h, q, t);
        // Each vessel can meet its rim and leave it a few times within a step; more is chatter.
        for _ in 0..8 {
            self.settle_modes(q.start, t);
            let next = self.trial(h, q, t);
            let Some(part) = self.first_rim(&next, h, q, t) else {
                self.accept(next, h, q, t, watch);
                return;
            };
            let first = q.part(T::constant(0.0), part);
            let at_rim = self.trial(h * part, first, t);
            self.accept(at_rim, h * part, first, t, watch);
            t += (h * part).value();
            q = q.part(part, T::constant(1.0));
            h = h - h * part;
        }
        let next = self.trial(h, q, t);
        self.accept(next, h, q, t, watch);
    }

    fn accept(&mut self, next: Levels<T>, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let last = self.vessels.len() - 1;
        let before = self.levels;
        if let Some(watch) = watch {
            let rate_before = self.rates(&before, q.start, t)[last];
            let rate_after = self.rates(&next, q.end, t + h.value())[last];
            watch(&Stretch {
                h,
                before: before[last],
                after: next[last],
                rate_before,
                rate_after,
            });
        }
        self.levels = next;
        self.keep_within();
    }

    /// The part of the step after which the first level meets its rim; `None` where none does.
    fn first_rim(&self, next: &Levels<T>, h: T, q: Inflow<T>, t: f64) -> Option<T> {
        let above =
            |levels: &Levels<T>, i: usize| levels[i].value() - self.vessels[i].rim.level.value();
        let mut first: Option<(f64, usize)> = None;
        for (i, vessel) in self.vessels.iter().enumerate() {
            if vessel.spilling || above(next, i) <= 1e-12 * vessel.rim.level.value().abs() {
                continue;
            }
            // Illinois: regula falsi that does not stall.
            let (mut low, mut high) = ((0.0, above(&self.levels, i)), (1.0, above(next, i)));
            if low.1 >= 0.0 {
                // On the rim already and rising: settled as spilling next time.
                continue;
            }
            let mut side = 0;
            for _ in 0..40 {
                let s = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
                let part = T::constant(s);
                let value = above(&self.trial(h * part, q.part(T::constant(0.0), part), t), i);
                if value > 0.0 {
                    high = (s, value);
                    if side == 1 {
                        low.1 *= 0.5;
                    }
                    side = 1;
                } else {
                    low = (s, value);
                    if side == -1 {
                        high.1 *= 0.5;
                    }
                    side = -1;
                }
                if value.abs() <= 1e-14 * vessel.rim.level.value().abs() || high.0 - low.0 < 1e-15 {
                    break;
                }
            }
            let s = if low.1.abs() < high.1.abs() {
                low.0
            } else {
                high.0
            };
            if first.is_none_or(|(earlier, _)| s < earlier) {
                first = Some((s, i));
            }
        }
        let (s, i) = first?;
        // One Newton step in duals gives the instant its derivatives.
        let part = T::constant(s);
        let piece = q.part(T::constant(0.0), part);
        let at = self.trial(h * part, piece, t);
        let rate = self.rates(&at, piece.end, t + s * h.value())[i].value() * h.value();
        let miss = at[i] - self.vessels[i].rim.level;
        if rate <= 0.0 {
            return None;
        }
        let part = part - miss * (1.0 / rate);
        (part.value() < 1.0).then_some(part)
    }
}
