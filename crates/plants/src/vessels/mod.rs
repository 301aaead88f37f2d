//! The vessels, in series or connected by valves: their parameters, laws and present levels.
//!
//! [`balance`] contains the equations, [`losses`] the decay rates due to losses besides the outlets. [`parts`] cuts a step into parts,
//! [`rims`] finds the events in a part, and [`runge_kutta`], [`exponential`] and [`implicit`] integrate it. [`joined`] contains the valves
//! between tanks and the choice of the steps for them, [`exchange`] their implicit step, [`fed`] a measured disturbance into the lower of
//! two vessels.

mod balance;
mod exchange;
mod exponential;
mod fed;
mod implicit;
mod joined;
mod losses;
mod parts;
mod rims;
mod runge_kutta;
mod torricelli;

use crate::{
    Balance, Law, Outlet, Rim, Scalar, Side,
    inflow::{Feed, Inflow},
    limits::SERIES,
    linear::Propagators,
};

use exponential::LinearFlow;
pub(crate) use joined::Valves;
pub(crate) use torricelli::square_root;

pub(crate) type Levels<T, const N: usize> = [T; N];

/// Optional callback for the smooth segments of a level.
pub(crate) type Watch<'a, T> = Option<&'a mut dyn FnMut(&Stretch<T>)>;

/// The parameters of one vessel in its balance.
struct Vessel<T> {
    area: T,
    /// Inverse of the area.
    inverse: T,
    /// Inverse of the area, if it has no derivatives.
    plain_inverse: Option<f64>,
    outlet: Outlet,
    /// `alpha` for Torricelli, `offset` for a linear outlet.
    coefficient: T,
    rim: Rim<T>,
    spilling: bool,
    laws: VesselLaws,
}

/// Indices of the laws that act in a vessel, by the term that they change.
#[derive(Default)]
struct VesselLaws {
    head: Vec<usize>,
    outflow: Vec<usize>,
    net: Vec<usize>,
    /// The laws of `net` that depend on the level.
    by_level: Vec<usize>,
    area: Vec<usize>,
    /// The vessel has a law or a side tank.
    any: bool,
    /// The vessel has a law that changes a flow, a side tank, or a disturbance: not only a law that changes the surface.
    flows: bool,
    /// A measured disturbance flows into the vessel ([`Vessels::feed`]).
    fed: bool,
}

/// The vessels: at most [`SERIES`] in series, or three connected by valves. `N` is a compile-time constant, so that each kind is compiled
/// without the code of the other.
pub(crate) struct Vessels<T: Scalar, const N: usize> {
    vessels: Vec<Vessel<T>>,
    laws: Vec<Box<dyn Law<T>>>,
    pub(crate) levels: Levels<T, N>,
    /// The exact solution, for linear vessels.
    linear: Option<LinearFlow<T>>,
    /// A side tank of a single vessel; its level comes after the vessel's in `levels`.
    side: Option<Side<T>>,
    /// Number of state variables: the levels of the vessels and of the side tank.
    states: usize,
    /// Laws with a jump at a future time.
    switches: Vec<usize>,
    /// Beginning and length of the present step, if they have derivatives.
    clock: Option<(T, T)>,
    /// Decay rate of every vessel, if the present part is long against the time constants and is therefore an exponential step \[1/s\].
    damping: Option<Levels<T, N>>,
    /// At least one vessel has a rim.
    rims: bool,
    /// All vessels have Torricelli outflow, areas without derivatives, and no effects.
    bare: bool,
    /// The valves of joined vessels.
    valves: Option<Valves>,
    /// Additional inflow into the last vessel: of the second pump for joined vessels, a measured disturbance for two vessels in series.
    feed: Option<Feed<T>>,
    /// For joined vessels: a copy without derivatives, on which step lengths are chosen.
    values: Option<Box<Vessels<f64, N>>>,
    /// The vessel whose level is read by a sensor with a lag.
    watched: usize,
    /// Inverse of the shortest time constant of linear vessels; zero for other vessels \[1/s\].
    fastest: f64,
}

/// A time interval over which the level is smooth.
pub(crate) struct Stretch<T> {
    pub h: T,
    pub before: T,
    pub after: T,
    pub rate_before: T,
    pub rate_after: T,
}

impl<T: Scalar> Stretch<T> {
    /// A linear segment between two levels, for an implicit step, which gives only the level at its end.
    fn straight(h: T, before: T, after: T) -> Self {
        let rate = (after - before) / h;
        Self {
            h,
            before,
            after,
            rate_before: rate,
            rate_after: rate,
        }
    }
}

impl<T: Scalar, const N: usize> Vessels<T, N> {
    /// Whether the vessels are connected by valves.
    const JOINED: bool = N > SERIES;

    /// `parts`: area, outlet and its coefficient for each vessel; `laws`: each law with its vessel; then the vessel that is watched, and
    /// the valves of joined vessels.
    pub(crate) fn new(
        parts: Vec<(T, Outlet, T)>,
        laws: Vec<(usize, Box<dyn Law<T>>)>,
        levels: &[T],
        (watched, valves): (usize, Option<Valves>),
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
                laws: VesselLaws::default(),
            })
            .collect();
        let mut bound = Vec::with_capacity(laws.len());
        for (vessel, law) in laws {
            let vessel = &mut vessels[vessel];
            match law.rim() {
                Some(rim) => vessel.rim = rim,
                None => vessel.laws.any = true,
            }
            match law.changes() {
                Some(Balance::Head) => vessel.laws.head.push(bound.len()),
                Some(Balance::Outflow) => vessel.laws.outflow.push(bound.len()),
                Some(Balance::Net) => vessel.laws.net.push(bound.len()),
                Some(Balance::NetByLevel) => {
                    vessel.laws.net.push(bound.len());
                    vessel.laws.by_level.push(bound.len());
                }
                Some(Balance::Area) => vessel.laws.area.push(bound.len()),
                None => {}
            }
            bound.push(law);
        }
        let side = bound.iter().find_map(|law| law.side());
        let states = vessels.len() + usize::from(side.is_some());
        for VesselLaws {
            head,
            outflow,
            net,
            flows,
            ..
        } in vessels.iter_mut().map(|vessel| &mut vessel.laws)
        {
            let none = head.is_empty() && outflow.is_empty() && net.is_empty();
            *flows = !none || side.is_some();
        }
        let switches = (0..bound.len()).filter(|&law| bound[law].switch().is_some());
        let switches = switches.collect();
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
            fed: None,
            disturbed: vessels.iter().any(|v| v.laws.any),
        });
        let mut initial = [T::constant(0.0); N];
        for (level, given) in initial.iter_mut().zip(levels) {
            *level = *given;
        }
        let mut all = Self {
            vessels,
            laws: bound,
            levels: initial,
            linear,
            side,
            states,
            switches,
            clock: None,
            rims,
            bare,
            damping: None,
            valves,
            feed: None,
            values: None,
            watched,
            fastest,
        };
        all.keep_within();
        if states > all.vessels.len() {
            // In steady state, the level of a side tank equals that of its vessel.
            all.levels[states - 1] = all.levels[0];
        }
        all
    }

    /// Limits each level to the range between empty (for a Torricelli outlet) and the rim.
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

    fn accept(&mut self, next: Levels<T, N>, h: T, q: &Inflow<T>, t: f64, watch: &mut Watch<T>) {
        if let Some(watch) = watch {
            let watched = self.watched;
            let before = self.levels;
            let rate_before = self.rates(&before, q.start, t)[watched];
            let rate_after = self.rates(&next, q.end, t + h.value())[watched];
            watch(&Stretch {
                h,
                before: before[watched],
                after: next[watched],
                rate_before,
                rate_after,
            });
        }
        self.levels = next;
        self.keep_within();
    }
}
