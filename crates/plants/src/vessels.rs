//! The vessels' balances over one step: Runge-Kutta of order four in `f64` or duals, with the instant
//! at which a level meets its rim located, so that the step keeps its order and its derivatives.

use std::ops::Mul;

use crate::{
    Law, Outlet, Rim, Scalar, damped::Damped, linear::Propagators, structure::MAX_VESSELS,
};

/// Below this level Torricelli's root, whose slope is infinite at zero, gives way to a parabola \[level unit\].
const NEARLY_EMPTY: f64 = 1e-4;

/// What stands for an empty vessel where its slope is asked by outflow over content \[level unit\].
const A_LITTLE: f64 = 1e-3 * NEARLY_EMPTY;

/// `sqrt(level)`, zero for an empty vessel, with a finite slope at empty.
#[inline(always)]
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

/// The slope of [`square_root`].
fn slope_of_root<T: Scalar>(level: T) -> T {
    let one = T::constant(1.0);
    let h = level.value();
    if h >= NEARLY_EMPTY {
        one * 0.5 / level.sqrt()
    } else {
        let x = level.max(T::constant(0.0)) * (1.0 / NEARLY_EMPTY);
        (one * 1.5 - x) * (1.0 / NEARLY_EMPTY.sqrt())
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

pub(crate) type Levels<T> = [T; MAX_VESSELS];

/// Who wants to see the smooth stretches of the measured level, if anybody.
pub(crate) type Watch<'a, T> = Option<&'a mut dyn FnMut(&Stretch<T>)>;

/// Runge-Kutta is trusted while a step is shorter than this many time constants of every vessel.
const STEP_LIMIT: f64 = 1.0;
/// The same where a rim is near: then linear vessels too go by Runge-Kutta alone.
const STEP_LIMIT_AT_RIM: f64 = 0.125;
/// The most parts that a step of linear vessels is cut into for that.
const MOST_PARTS: usize = 256;
/// A step that is still too long for its vessels is cut into at most so many parts; beyond that it is taken implicitly.
const UNITS: usize = 32;
/// A long part may be as long as what has passed of its step, where no level will move by more than this share of
/// itself: the fast part of the motion has died away by then.
const SETTLING: f64 = 0.2;
/// One part is enough where no fast vessel will move by more than this share of its level. What is over before the next
/// reading leaves a trace only in the vessel that it flows into: the last one may move more.
const SETTLED: [f64; 2] = [1e-4, 1e-2];
/// Contacts with a rim that are looked for within a step.
const MOST_EVENTS: usize = 12;

/// One vessel as the balance sees it.
struct Vessel<T> {
    area: T,
    /// One over the area.
    inverse: T,
    /// The same, where it has no derivatives.
    plain_inverse: Option<f64>,
    outlet: Outlet,
    /// `alpha` for Torricelli, `offset` for a linear outlet.
    coefficient: T,
    rim: Rim<T>,
    spilling: bool,
    /// Positions of the laws that act here.
    laws: Vec<usize>,
}

/// Linear vessels have an exact flow; what effects add to it is integrated beside it, so that it vanishes with them.
struct LinearFlow<T> {
    whole: Propagators<T>,
    half: Propagators<T>,
    /// Effects act, so that the exact flow is not all.
    disturbed: bool,
}

/// The exact flow over one step.
struct Flow<T> {
    half: Levels<T>,
    whole: Levels<T>,
    /// Where there are two vessels.
    handed: Option<Handed<T>>,
}

/// What the second linear vessel gets from the first one.
#[derive(Clone, Copy)]
struct Handed<T> {
    /// In half a step, by a deviation of the first one's level at its beginning.
    deviation: T,
    /// In half a step, by a constant drive of the first one.
    drive: T,
    /// In a whole step, by a drive of `a + b s + c s^2`.
    whole: [T; 3],
}

/// The vessels in series.
pub(crate) struct Vessels<T: Scalar> {
    vessels: Vec<Vessel<T>>,
    laws: Vec<Box<dyn Law<T>>>,
    pub(crate) levels: Levels<T>,
    /// For linear vessels.
    linear: Option<LinearFlow<T>>,
    /// How fast every vessel forgets, where a part is long against that \[1/s\]: then it is taken exponentially.
    damping: Option<[T; MAX_VESSELS]>,
    /// Some vessel has a rim.
    rims: bool,
    /// All are Torricelli's, of areas without derivatives, and nothing acts in them.
    bare: bool,
    /// One over the shortest time constant of linear vessels; zero for others \[1/s\].
    fastest: f64,
}

/// A stretch of time over which the measured level moved smoothly.
pub(crate) struct Stretch<T> {
    pub h: T,
    pub before: T,
    pub after: T,
    pub rate_before: T,
    pub rate_after: T,
}

/// What ends a smooth stretch.
enum Event<T> {
    /// A vessel meets its rim after this part of the step.
    Rim(usize, T),
    /// A vessel stops spilling after this part of the step.
    Release(usize, T),
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
                inverse: T::constant(1.0) / area,
                plain_inverse: area
                    .same_derivatives(T::constant(0.0))
                    .then(|| 1.0 / area.value()),
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
        let mut bound = Vec::with_capacity(laws.len());
        for (vessel, law) in laws {
            match law.rim() {
                Some(rim) => vessels[vessel].rim = rim,
                None => vessels[vessel].laws.push(bound.len()),
            }
            bound.push(law);
        }
        let rims = vessels.iter().any(|v| v.rim.level.value() != f64::INFINITY);
        let bare = bound.is_empty()
            && vessels
                .iter()
                .all(|v| v.outlet == Outlet::Torricelli && v.plain_inverse.is_some());
        let linear = vessels.iter().all(|v| v.outlet == Outlet::Linear);
        let fastest = if linear {
            let rates = vessels.iter().map(|v| 1.0 / v.area.value().abs());
            rates.fold(0.0, f64::max)
        } else {
            0.0
        };
        let propagators =
            || Propagators::new(vessels.iter().map(|v| (v.area, v.coefficient)).collect());
        let linear = linear.then(|| LinearFlow {
            whole: propagators(),
            half: propagators(),
            disturbed: vessels.iter().any(|v| !v.laws.is_empty()),
        });
        let mut initial = [T::constant(0.0); MAX_VESSELS];
        for (level, given) in initial.iter_mut().zip(levels) {
            *level = *given;
        }
        let mut all = Self {
            vessels,
            laws: bound,
            levels: initial,
            linear,
            rims,
            bare,
            damping: None,
            fastest,
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

    /// What flows out of vessel `i` to the next one at a level.
    #[inline(always)]
    fn outflow(&self, i: usize, level: T, t: f64) -> T {
        let vessel = &self.vessels[i];
        let mut outflow = self.own_outflow(i, level);
        for &law in &vessel.laws {
            outflow = self.laws[law].outflow(level, outflow, t);
        }
        outflow
    }

    /// What flows out of vessel `i` to the next one, and its net inflow, at a level.
    #[inline(always)]
    fn balance(&self, i: usize, level: T, inflow: T, t: f64) -> (T, T) {
        let outflow = self.outflow(i, level, t);
        let mut net = inflow - outflow;
        for &law in &self.vessels[i].laws {
            net = self.laws[law].net(level, net, t);
        }
        (outflow, net)
    }

    /// Surface of vessel `i` at a level.
    #[inline]
    fn area(&self, i: usize, level: T) -> T {
        let vessel = &self.vessels[i];
        let mut area = vessel.area;
        for &law in &vessel.laws {
            area = self.laws[law].area(level, area);
        }
        area
    }

    /// The rate of vessel `i` at a level. The nominal area goes in as its inverse, and an area that is nominal as a
    /// factor of one, so that both ways give the same bits.
    #[inline(always)]
    fn rate(&self, i: usize, level: T, net: T) -> T {
        let vessel = &self.vessels[i];
        let rate = match vessel.plain_inverse {
            Some(inverse) => net * inverse,
            None => net * vessel.inverse,
        };
        if vessel.laws.is_empty() {
            rate
        } else {
            rate * (vessel.area / self.area(i, level))
        }
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
                // The level stands at the rim, and the net inflow spills; where it turns negative the mode ends.
                inflow = inflow + net * vessel.rim.fraction;
            } else {
                rates[i] = self.rate(i, level, net);
            }
        }
        rates
    }

    /// Rates of linear vessels without effects, written as in [`Vessels::rates`].
    fn linear_rates(&self, levels: &Levels<T>, q: T) -> Levels<T> {
        let mut rates = [T::constant(0.0); MAX_VESSELS];
        let mut inflow = q;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let outflow = levels[i] - vessel.coefficient;
            let net = inflow - outflow;
            inflow = outflow;
            rates[i] = net * vessel.inverse;
        }
        rates
    }

    /// `from + by h`.
    #[inline(always)]
    fn moved<H: Copy>(&self, from: &Levels<T>, by: &Levels<T>, h: H) -> Levels<T>
    where
        T: Mul<H, Output = T>,
    {
        let mut to = *from;
        for i in 0..self.vessels.len() {
            to[i] = to[i] + by[i] * h;
        }
        to
    }

    /// One Runge-Kutta step from the present levels, in the present modes.
    #[inline]
    fn trial(&self, h: T, q: Inflow<T>, t: f64) -> Levels<T> {
        let dt = h.value();
        if let Some(rates) = self.damping {
            self.damped_trial(rates, None, h, q, t)
        } else if !h.same_derivatives(T::constant(0.0)) {
            self.trial_by(h, dt, q, t)
        } else if !self.bare {
            self.trial_by(dt, dt, q, t)
        } else if let [only] = &self.vessels[..] {
            self.bare_trial([only], dt, q)
        } else if let [upper, lower] = &self.vessels[..] {
            self.bare_trial([upper, lower], dt, q)
        } else {
            self.trial_by(dt, dt, q, t)
        }
    }

    /// The same for Torricelli's vessels without effects, in the same order of operations and so with the same bits, for
    /// a fit spends most of its time here.
    #[inline]
    fn bare_trial<const N: usize>(
        &self,
        vessels: [&Vessel<T>; N],
        h: f64,
        q: Inflow<T>,
    ) -> Levels<T> {
        // Loops over places rather than arrays by value, which would be copied about.
        let zero = T::constant(0.0);
        let mut next = self.levels;
        let mut at = self.levels;
        let stages = [
            (q.start, 0.0, 1.0),
            (q.middle, 0.5, 2.0),
            (q.middle, 0.5, 2.0),
            (q.end, 1.0, 1.0),
        ];
        let mut rates = [zero; MAX_VESSELS];
        let mut sum = [zero; MAX_VESSELS];
        for (stage, (q, ahead, weight)) in stages.into_iter().enumerate() {
            if stage > 0 {
                for i in 0..N {
                    at[i] = self.levels[i] + rates[i] * (h * ahead);
                }
            }
            let mut inflow = q;
            for i in 0..N {
                let outflow = vessels[i].coefficient * square_root(at[i]);
                rates[i] = (inflow - outflow) * vessels[i].plain_inverse.unwrap_or(f64::NAN);
                inflow = outflow;
                sum[i] = sum[i] + rates[i] * weight;
            }
        }
        let sixth = h * (1.0 / 6.0);
        for i in 0..N {
            next[i] = next[i] + sum[i] * sixth;
        }
        next
    }

    /// The same, for a length `h` with or without derivatives.
    #[inline]
    fn trial_by<H: Copy + Mul<f64, Output = H>>(
        &self,
        h: H,
        dt: f64,
        q: Inflow<T>,
        t: f64,
    ) -> Levels<T>
    where
        T: Mul<H, Output = T>,
    {
        let half = h * 0.5;
        let middle = t + 0.5 * dt;
        let k1 = self.rates(&self.levels, q.start, t);
        let k2 = self.rates(&self.moved(&self.levels, &k1, half), q.middle, middle);
        let k3 = self.rates(&self.moved(&self.levels, &k2, half), q.middle, middle);
        let k4 = self.rates(&self.moved(&self.levels, &k3, h), q.end, t + dt);
        self.weighted(&self.levels, h, [&k1, &k2, &k3, &k4])
    }

    /// What is added to a flow, or to standing still, each vessel's own forgetting taken exactly.
    fn damped_trial(
        &self,
        rates: [T; MAX_VESSELS],
        flow: Option<&Flow<T>>,
        h: T,
        q: Inflow<T>,
        t: f64,
    ) -> Levels<T> {
        let n = self.vessels.len();
        let zero = [T::constant(0.0); MAX_VESSELS];
        let damped: [Damped<T>; MAX_VESSELS] = std::array::from_fn(|i| Damped::new(rates[i], h));
        let [begin, half, whole] = match flow {
            Some(flow) => [&self.levels, &flow.half, &flow.whole],
            None => [&self.levels; 3],
        };
        // What drives the deviation from the flow, but for its forgetting and what a linear vessel hands on.
        let driving = |at: &Levels<T>, deviation: &Levels<T>, q: T, t: f64| {
            let mut levels = *at;
            for i in 0..n {
                levels[i] = levels[i] + deviation[i];
            }
            let mut drive = self.rates(&levels, q, t);
            for i in 0..n {
                drive[i] = drive[i] + deviation[i] * rates[i];
            }
            if flow.is_some() {
                for (drive, own) in drive.iter_mut().zip(self.linear_rates(at, q)) {
                    *drive = *drive - own;
                }
                for i in 1..n {
                    drive[i] = drive[i] - deviation[i - 1] * self.vessels[i].inverse;
                }
            }
            drive
        };
        // What the first vessel's deviation, and its drive, bring to the second one in half a step and in a whole one.
        let handed = flow.and_then(|flow| flow.handed);
        let middle = t + 0.5 * h.value();
        let from_zero = |k: &Levels<T>| {
            let mut d = zero;
            for i in 0..n {
                d[i] = damped[i].half(k[i]);
            }
            if let Some(handed) = &handed {
                d[1] = d[1] + k[0] * handed.drive;
            }
            d
        };
        let k1 = driving(begin, &zero, q.start, t);
        let d2 = from_zero(&k1);
        let k2 = driving(half, &d2, q.middle, middle);
        let k3 = driving(half, &from_zero(&k2), q.middle, middle);
        let mut d4 = zero;
        for i in 0..n {
            d4[i] = damped[i].half_from(d2[i], k3[i] * 2.0 - k1[i]);
        }
        if let Some(handed) = &handed {
            d4[1] = d4[1] + d2[0] * handed.deviation + (k3[0] * 2.0 - k1[0]) * handed.drive;
        }
        let k4 = driving(whole, &d4, q.end, t + h.value());
        let mut next = *whole;
        for i in 0..n {
            next[i] = next[i] + damped[i].whole([k1[i], (k2[i] + k3[i]) * 0.5, k4[i]]);
        }
        if let Some(handed) = &handed {
            let drive = Inflow {
                start: k1[0],
                middle: (k2[0] + k3[0]) * 0.5,
                end: k4[0],
            };
            for (c, weight) in drive.coefficients().into_iter().zip(handed.whole) {
                next[1] = next[1] + c * weight;
            }
        }
        next
    }

    #[inline(always)]
    fn weighted<H: Copy + Mul<f64, Output = H>>(
        &self,
        from: &Levels<T>,
        h: H,
        [k1, k2, k3, k4]: [&Levels<T>; 4],
    ) -> Levels<T>
    where
        T: Mul<H, Output = T>,
    {
        let sixth = h * (1.0 / 6.0);
        let mut next = *from;
        for i in 0..self.vessels.len() {
            next[i] = next[i] + (k1[i] + k2[i] * 2.0 + k3[i] * 2.0 + k4[i]) * sixth;
        }
        next
    }

    /// One step of linear vessels: their exact flow, and beside it Runge-Kutta on what the effects add.
    fn linear_trial(&self, flow: &Flow<T>, h: T, q: Inflow<T>, t: f64) -> Levels<T> {
        let (whole, half) = (flow.whole, flow.half);
        let dt = h.value();
        if let Some(rates) = self.damping {
            return self.damped_trial(rates, Some(flow), h, q, t);
        }
        let added = |levels: &Levels<T>, flow: &Levels<T>, q: T, t: f64| {
            let mut rates = self.rates(levels, q, t);
            let linear = self.linear_rates(flow, q);
            for (rate, linear) in rates.iter_mut().zip(linear) {
                *rate = *rate - linear;
            }
            rates
        };
        let k1 = added(&self.levels, &self.levels, q.start, t);
        let k2 = added(
            &self.moved(&half, &k1, h * 0.5),
            &half,
            q.middle,
            t + 0.5 * dt,
        );
        let k3 = added(
            &self.moved(&half, &k2, h * 0.5),
            &half,
            q.middle,
            t + 0.5 * dt,
        );
        let k4 = added(&self.moved(&whole, &k3, h), &whole, q.end, t + dt);
        self.weighted(&whole, h, [&k1, &k2, &k3, &k4])
    }

    /// How many time constants of its fastest vessel a step of length `h` lasts, up to a factor of two: what
    /// Runge-Kutta must not be asked. It looks at values alone, so that derivatives follow one path.
    #[inline]
    fn stiffness(&self, h: f64, t: f64) -> f64 {
        let mut most = 0.0_f64;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let level = self.levels[i];
            match vessel.outlet {
                // The outflow bends downwards from zero, so its slope is less than outflow/level: half of it for a root.
                // An empty vessel is taken as one with a little in it: its slope is the same, and it may be about to fill.
                Outlet::Torricelli => {
                    let height = level.value().max(A_LITTLE);
                    let (outflow, content) = if vessel.laws.is_empty() {
                        let outflow = vessel.coefficient.value() * square_root(height);
                        (outflow, height * vessel.area.value())
                    } else {
                        let level = T::constant(height);
                        let outflow = self.outflow(i, level, t).value();
                        (outflow, height * self.area(i, level).value())
                    };
                    // Without the division in the common case.
                    if h * outflow > 2.0 * STEP_LIMIT * content {
                        most = most.max(0.5 * h * outflow / content);
                    }
                }
                Outlet::Linear if vessel.laws.is_empty() => {}
                // The vessel's own forgetting is exact; here it is what the effects add to it.
                Outlet::Linear => {
                    let own = 1.0 / vessel.area.value().abs();
                    let slope = self.slope(i, t).value().abs();
                    let added = if h * own > STEP_LIMIT {
                        slope - own
                    } else {
                        slope
                    };
                    most = most.max(0.5 * h * added);
                }
            }
        }
        most
    }

    /// What vessel `i` alone lets out at a level.
    #[inline(always)]
    fn own_outflow(&self, i: usize, level: T) -> T {
        let vessel = &self.vessels[i];
        match vessel.outlet {
            Outlet::Torricelli => vessel.coefficient * square_root(level),
            Outlet::Linear => level - vessel.coefficient,
        }
    }

    /// By how much a higher level slows its own rise \[1/s\]: what the effects add to it by a difference, so that it
    /// vanishes with them.
    fn slope(&self, i: usize, t: f64) -> T {
        let level = self.levels[i];
        let vessel = &self.vessels[i];
        let own = match vessel.outlet {
            Outlet::Torricelli => vessel.coefficient * slope_of_root(level),
            Outlet::Linear => T::constant(1.0),
        };
        if vessel.laws.is_empty() {
            return own * vessel.inverse;
        }
        let step = 1e-6 * (level.value().abs() + 1e-3);
        let added = |level: T| self.outflow(i, level, t) - self.own_outflow(i, level);
        let slope = own + (added(level + step) - added(level)) * (1.0 / step);
        slope * vessel.inverse * (vessel.area / self.area(i, level))
    }

    /// One step that cannot overshoot, whatever its length: implicit in each vessel's own level, of order one.
    fn relax(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let mut next = self.levels;
        let mut inflow = q.end;
        for (i, to) in next.iter_mut().enumerate().take(self.vessels.len()) {
            let level = self.levels[i];
            let (outflow, net) = self.balance(i, level, inflow, t);
            let slope = self.slope(i, t).max(T::constant(0.0));
            let damped = T::constant(1.0) / (h * slope + 1.0);
            *to = level + self.rate(i, level, net) * h * damped;
            let low = match self.vessels[i].outlet {
                Outlet::Torricelli => 0.0,
                Outlet::Linear => f64::NEG_INFINITY,
            };
            *to = (*to).max(T::constant(low)).min(self.vessels[i].rim.level);
            // What left the vessel is what its balance says; the rest of the step it is near its new level.
            inflow = if slope.value() * h.value() > 1.0 {
                self.outflow(i, *to, t)
            } else {
                outflow
            };
        }
        if let Some(watch) = watch {
            // The transient is over at once; what is left looks straight.
            let last = self.vessels.len() - 1;
            let (before, after) = (self.levels[last], next[last]);
            let rate = (after - before) / h;
            watch(&Stretch {
                h,
                before,
                after,
                rate_before: rate,
                rate_after: rate,
            });
        }
        self.levels = next;
    }

    /// Which vessels spill: those that stand at their rim with a positive net inflow, but for one that has just stopped.
    fn settle_modes(&mut self, q: T, t: f64, released: Option<usize>) {
        let mut inflow = q;
        for i in 0..self.vessels.len() {
            let (outflow, net) = self.balance(i, self.levels[i], inflow, t);
            let vessel = &mut self.vessels[i];
            vessel.spilling = self.levels[i].value() >= vessel.rim.level.value()
                && net.value() > 0.0
                && released != Some(i);
            inflow = outflow;
            if vessel.spilling {
                inflow = inflow + net * vessel.rim.fraction;
            }
        }
    }

    /// How fast each vessel forgets its level \[1/s\].
    fn forgetting(&self, t: f64) -> [T; MAX_VESSELS] {
        let mut rates = [T::constant(0.0); MAX_VESSELS];
        for (i, rate) in rates.iter_mut().enumerate().take(self.vessels.len()) {
            *rate = match self.linear {
                // Where the vessels' own forgetting is exact it alone is meant.
                Some(_) => self.vessels[i].inverse,
                None => self.slope(i, t).max(T::constant(0.0)),
            };
        }
        rates
    }

    /// How many of [`UNITS`] the next part may last although a vessel is faster than that, `done` of them over; zero
    /// where a level moves too far for its forgetting to be one number.
    fn calm(&self, rates: &[T; MAX_VESSELS], h: f64, q: &Inflow<T>, t: f64, done: usize) -> usize {
        let left = UNITS - done;
        let mut longest = left;
        let mut inflows = [Some(q.start), Some(q.end)];
        if q.start.value() == q.end.value() {
            inflows[1] = None;
        }
        for q in inflows.into_iter().flatten() {
            let moves = self.rates(&self.levels, q, t);
            for i in 0..self.vessels.len() {
                let fast = rates[i].value() * h > STEP_LIMIT;
                let time = if fast { 1.0 / rates[i].value() } else { h };
                let way = (moves[i].value() * time).abs();
                // What does not move is calm at any level, also at the bottom.
                let share = if way == 0.0 {
                    0.0
                } else {
                    way / self.levels[i].value().abs()
                };
                let settled = SETTLED[usize::from(i + 1 == self.vessels.len())];
                if share.is_nan() || share > SETTLING {
                    return 0;
                }
                if fast && share > settled {
                    longest = longest.min(done.max(1));
                }
            }
        }
        longest
    }

    /// Moves on by `h` from time `t`; `watch` sees every smooth stretch of the measured level in turn.
    pub(crate) fn step(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let wanted = self.fastest * h.value();
        if wanted > STEP_LIMIT {
            self.fast_linear_step(wanted, h, q, t, watch);
        } else if self.rims && wanted > STEP_LIMIT_AT_RIM {
            self.equal_parts(wanted / STEP_LIMIT_AT_RIM, h, q, t, watch);
        } else {
            self.part(h, q, t, watch);
        }
    }

    fn equal_parts(&mut self, wanted: f64, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let parts = (wanted.min(MOST_PARTS as f64).ceil() as usize).next_power_of_two();
        let share = 1.0 / parts as f64;
        let each = h * share;
        for k in 0..parts {
            let edge = |k: usize| T::constant(k as f64 * share);
            let begin = t + k as f64 * each.value();
            self.part(each, q.part(edge(k), edge(k + 1)), begin, watch);
        }
    }

    /// A step of linear vessels that is longer than a time constant, in parts that double: what a jump of the input sets
    /// off is over when they are long. Their lengths do not depend on effects, so that one at its absent value sees
    /// the parts of the base model.
    fn fast_linear_step(&mut self, wanted: f64, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let parts = (wanted.min(MOST_PARTS as f64).ceil() as usize).next_power_of_two();
        let share = 1.0 / parts as f64;
        let (mut done, mut length) = (0, 1);
        while done < parts {
            let (from, to) = (done as f64 * share, (done + length) as f64 * share);
            let part = h * (length as f64 * share);
            let q = q.part(T::constant(from), T::constant(to));
            let begin = t + h.value() * from;
            let quiet = !self.rims || self.quiet_part(part, q, begin, watch);
            if !self.rims {
                self.damping = Some(self.forgetting(begin));
                self.part(part, q, begin, watch);
                self.damping = None;
            } else if !quiet {
                // Something happens at a rim: here Runge-Kutta alone, in short steps.
                let wanted = self.fastest * part.value() / STEP_LIMIT_AT_RIM;
                self.equal_parts(wanted, part, q, begin, watch);
            }
            done += length;
            length = done;
        }
    }

    /// A part of linear vessels with rims, in one piece: `false`, and nothing is done, where something happens at a rim.
    fn quiet_part(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) -> bool {
        if self.stiffness(h.value(), t) > STEP_LIMIT {
            return false;
        }
        self.settle_modes(q.start, t, None);
        self.damping = Some(self.forgetting(t));
        // What stands at its rim drives the next vessel by a parabola: then the exponential step is exact.
        let next = if self.vessels.iter().any(|vessel| vessel.spilling) {
            self.trial(h, q, t)
        } else {
            self.flow(h, q, t)
        };
        let quiet = self.first_event(&next, h, q, t).is_none();
        if quiet {
            self.accept(next, h, q, t, watch);
        }
        self.damping = None;
        quiet
    }

    fn part(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if self.stiffness(h.value(), t) <= STEP_LIMIT {
            self.unit(h, q, t, watch);
            return;
        }
        let given = self.damping;
        let mut done = 0;
        while done < UNITS {
            let left = UNITS - done;
            let stiffness = self.stiffness(h.value(), t);
            let span = |from: usize, to: usize| {
                let edge = |k: usize| T::constant(k as f64 / UNITS as f64);
                let length = h * ((to - from) as f64 / UNITS as f64);
                let begin = t + h.value() * (from as f64 / UNITS as f64);
                (length, q.part(edge(from), edge(to)), begin)
            };
            // The longest that is short enough, in powers of two.
            let mut units = 1 << left.ilog2();
            while units > 1 && stiffness * units as f64 > STEP_LIMIT * UNITS as f64 {
                units /= 2;
            }
            let short = stiffness * units as f64 <= STEP_LIMIT * UNITS as f64;
            let (length, inflow, begin) = span(done, UNITS);
            let rates = self.forgetting(begin);
            let calm = if self.linear.is_some() {
                // What makes such a part too long is the effects' doing, which its vessels' forgetting does not cover.
                0
            } else {
                self.calm(&rates, length.value(), &inflow, begin, done)
            };
            if calm > units || (calm > 0 && !short) {
                let (length, q, begin) = span(done, done + calm);
                self.damping = Some(rates);
                self.unit(length, q, begin, watch);
                self.damping = given;
                done += calm;
                continue;
            }
            let (length, q, begin) = span(done, done + units);
            if short {
                self.unit(length, q, begin, watch);
            } else {
                self.relax(length, q, begin, watch);
            }
            done += units;
        }
    }

    /// A step that is short enough.
    fn unit(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if self.rims {
            self.step_with_rims(h, q, t, watch);
            return;
        }
        let next = self.flow(h, q, t);
        self.accept(next, h, q, t, watch);
    }

    /// The levels after a step without events.
    fn flow(&mut self, h: T, q: Inflow<T>, t: f64) -> Levels<T> {
        let Some(flow) = &mut self.linear else {
            return self.trial(h, q, t);
        };
        let whole = flow.whole.advance(&self.levels, h, q);
        if !flow.disturbed {
            return whole;
        }
        let first = q.part(T::constant(0.0), T::constant(0.5));
        let half = flow.half.advance(&self.levels, h * 0.5, first);
        let handed = (self.vessels.len() == 2 && h.value() > 0.0).then(|| {
            // A drive of the level is an inflow over the area.
            let area = self.vessels[0].area;
            let (deviation, [drive, ..]) = flow.half.second_from(h * 0.5);
            let (_, whole) = flow.whole.second_from(h);
            Handed {
                deviation,
                drive: drive * area,
                whole: whole.map(|weight| weight * area),
            }
        });
        let flow = Flow {
            half,
            whole,
            handed,
        };
        self.linear_trial(&flow, h, q, t)
    }

    fn step_with_rims(&mut self, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        let (mut h, mut q, mut t) = (h, q, t);
        let mut released = None;
        // Each vessel can meet its rim and leave it a few times within a step; more is chatter.
        for _ in 0..MOST_EVENTS {
            self.settle_modes(q.start, t, released);
            let next = self.trial(h, q, t);
            let Some(event) = self.first_event(&next, h, q, t) else {
                self.accept(next, h, q, t, watch);
                return;
            };
            let (Event::Rim(_, part) | Event::Release(_, part)) = event;
            let first = q.part(T::constant(0.0), part);
            let there = self.trial(h * part, first, t);
            self.accept(there, h * part, first, t, watch);
            released = match event {
                Event::Rim(i, _) => {
                    self.levels[i] = self.vessels[i].rim.level;
                    None
                }
                Event::Release(i, _) => Some(i),
            };
            t += (h * part).value();
            q = q.part(part, T::constant(1.0));
            h = h - h * part;
        }
        let next = self.trial(h, q, t);
        self.accept(next, h, q, t, watch);
    }

    fn accept(&mut self, next: Levels<T>, h: T, q: Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if let Some(watch) = watch {
            let last = self.vessels.len() - 1;
            let before = self.levels;
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

    /// The net inflow of vessel `i` at levels, in the present modes.
    fn net(&self, i: usize, levels: &Levels<T>, q: T, t: f64) -> T {
        let mut inflow = q;
        for (k, vessel) in self.vessels.iter().enumerate().take(i) {
            let (outflow, net) = self.balance(k, levels[k], inflow, t);
            inflow = outflow;
            if vessel.spilling {
                inflow = inflow + net * vessel.rim.fraction;
            }
        }
        self.balance(i, levels[i], inflow, t).1
    }

    /// The first thing to happen within the step that would lead to `next`, if anything does.
    fn first_event(&self, next: &Levels<T>, h: T, q: Inflow<T>, t: f64) -> Option<Event<T>> {
        let at = |s: f64| {
            let part = T::constant(s);
            let piece = q.part(T::constant(0.0), part);
            (self.trial(h * part, piece, t), piece.end, t + s * h.value())
        };
        let mut first: Option<(f64, usize)> = None;
        for (i, vessel) in self.vessels.iter().enumerate() {
            let rim = vessel.rim.level.value();
            if rim == f64::INFINITY {
                continue;
            }
            // Positive once the event has happened.
            let past = |levels: &Levels<T>, q: T, t: f64| {
                if vessel.spilling {
                    -self.net(i, levels, q, t).value()
                } else {
                    levels[i].value() - rim
                }
            };
            let low = past(&self.levels, q.start, t);
            let (mut end, mut high) = (1.0, past(next, q.end, t + h.value()));
            if low >= 0.0 {
                // Just released, or on the rim with a net inflow of nothing.
                continue;
            }
            if high <= 0.0 {
                if vessel.spilling {
                    continue;
                }
                // Above the rim in between? The top of the cubic through levels and rates says where to look.
                let Some(top) = self.top(i, next, h, q, t).filter(|&(_, level)| level > rim) else {
                    continue;
                };
                let (levels, q, t) = at(top.0);
                (end, high) = (top.0, past(&levels, q, t));
                if high <= 0.0 {
                    continue;
                }
            }
            let s = crossing((0.0, low), (end, high), |s| {
                let (levels, q, t) = at(s);
                past(&levels, q, t)
            });
            if first.is_none_or(|(earlier, _)| s < earlier) {
                first = Some((s, i));
            }
        }
        let (s, i) = first?;
        // One Newton step in duals gives the instant its derivatives: those of the steps as they are taken, not of the
        // flow that they approximate, hence the slope by a difference.
        let spilling = self.vessels[i].spilling;
        let past = |s: f64| {
            let (levels, q, t) = at(s);
            if spilling {
                -self.net(i, &levels, q, t)
            } else {
                levels[i] - self.vessels[i].rim.level
            }
        };
        let slope = (past(s + 1e-4).value() - past(s - 1e-4).value()) * 5e3;
        if slope <= 0.0 {
            return None;
        }
        let part = (T::constant(s) - past(s) * (1.0 / slope)).max(T::constant(0.0));
        (part.value() < 1.0).then_some(if spilling {
            Event::Release(i, part)
        } else {
            Event::Rim(i, part)
        })
    }

    /// Where within the step, and how high, the level of a vessel is highest; `None` where that is at an end.
    fn top(&self, i: usize, next: &Levels<T>, h: T, q: Inflow<T>, t: f64) -> Option<(f64, f64)> {
        let dt = h.value();
        let begin = self.rates(&self.levels, q.start, t)[i].value() * dt;
        let end = self.rates(next, q.end, t + dt)[i].value() * dt;
        if begin <= 0.0 || end >= 0.0 {
            return None;
        }
        let before = self.levels[i].value();
        let rise = next[i].value() - before;
        // Rates along the cubic: begin + b s + c s^2, from above zero to below: one root within.
        let b = 6.0 * rise - 4.0 * begin - 2.0 * end;
        let c = 3.0 * (begin + end - 2.0 * rise);
        let root = (b * b - 4.0 * begin * c).max(0.0).sqrt();
        let s = 2.0 * begin / (root - b);
        let level = before + s * (begin + s * (0.5 * b + s * c / 3.0));
        (s > 0.0 && s < 1.0).then_some((s, level))
    }
}

/// Where a function that is negative at `low` and positive at `high` changes its sign, by regula falsi that does not
/// stall (Illinois). Nine digits are enough: at a rim a Newton step follows, and a release is flat.
fn crossing(mut low: (f64, f64), mut high: (f64, f64), f: impl Fn(f64) -> f64) -> f64 {
    let mut last = f64::NAN;
    let mut side = 0;
    for _ in 0..60 {
        // Not `clamp`, which panics where a bound is not a number.
        let s = ((low.0 * high.1 - high.0 * low.1) / (high.1 - low.1))
            .max(low.0)
            .min(high.0);
        if (s - last).abs() < 1e-9 || high.0 - low.0 < 1e-9 {
            return s;
        }
        last = s;
        let value = f(s);
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
    }
    last
}
