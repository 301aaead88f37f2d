//! The vessels, in series or joined by valves: their parts, their laws and their present levels.
//!
//! [`balance`] has the equations, [`losses`] how fast they become by what leaves beside the outlets, [`parts`] cuts a step,
//! [`rims`] finds what happens in a part, [`runge_kutta`], [`exponential`] and [`implicit`] take it. [`joined`] has the valves between
//! tanks, and how steps are cut there, [`exchange`] the implicit one, [`fed`] a measured disturbance into the lower of two vessels.

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
    linear::Propagators,
    structure::SERIES,
};

use exponential::LinearFlow;
pub(crate) use joined::Valves;
pub(crate) use torricelli::square_root;

pub(crate) type Levels<T, const N: usize> = [T; N];

/// Who wants to see the smooth stretches of a level, if anybody.
pub(crate) type Watch<'a, T> = Option<&'a mut dyn FnMut(&Stretch<T>)>;

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
    laws: VesselLaws,
}

/// Positions of the laws that act in a vessel, by what they change.
#[derive(Default)]
struct VesselLaws {
    head: Vec<usize>,
    outflow: Vec<usize>,
    net: Vec<usize>,
    /// Those of `net` that differ from level to level.
    by_level: Vec<usize>,
    area: Vec<usize>,
    /// Any of them, or a side tank.
    any: bool,
    /// Any of them that changes a flow, a side tank, or a disturbance: the surface alone is not enough.
    flows: bool,
    /// A measured disturbance flows in ([`Vessels::feed`]).
    fed: bool,
}

/// The vessels: at most [`SERIES`] in series, or three joined by valves. `N` is known at compile time, so that neither pays for the
/// other.
pub(crate) struct Vessels<T: Scalar, const N: usize> {
    vessels: Vec<Vessel<T>>,
    laws: Vec<Box<dyn Law<T>>>,
    pub(crate) levels: Levels<T, N>,
    /// For linear vessels.
    linear: Option<LinearFlow<T>>,
    /// A side tank of an only vessel; its level follows the vessel's in `levels`.
    side: Option<Side<T>>,
    /// Levels that move: the vessels' and the side tank's.
    states: usize,
    /// Laws that switch over at an instant that is still to come.
    switches: Vec<usize>,
    /// Beginning and length of the present step, where they have derivatives.
    clock: Option<(T, T)>,
    /// How fast every vessel forgets, where a part is long against that \[1/s\]: then it is taken exponentially.
    damping: Option<Levels<T, N>>,
    /// Some vessel has a rim.
    rims: bool,
    /// All are Torricelli's, of areas without derivatives, and nothing acts in them.
    bare: bool,
    /// Of vessels that are joined: their valves.
    valves: Option<Valves>,
    /// What flows into the last vessel beside what the one before lets out: of vessels that are joined from the second pump, of two in
    /// series a measured disturbance.
    feed: Option<Feed<T>>,
    /// The same vessels without derivatives, where they are joined: how a step is cut is found on them.
    values: Option<Box<Vessels<f64, N>>>,
    /// The vessel whose level a lagging sensor reads.
    watched: usize,
    /// One over the shortest time constant of linear vessels; zero for others \[1/s\].
    fastest: f64,
}

/// A stretch of time over which the level moved smoothly.
pub(crate) struct Stretch<T> {
    pub h: T,
    pub before: T,
    pub after: T,
    pub rate_before: T,
    pub rate_after: T,
}

impl<T: Scalar> Stretch<T> {
    /// From a level to another in a straight line, as after an implicit step, of which only the end is known.
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
    /// The vessels are joined by valves.
    const JOINED: bool = N > SERIES;

    /// `parts`: area, outlet and its coefficient for each vessel; `laws`: the vessel each acts in, and the law; then the vessel that is
    /// watched, and the valves of vessels that are joined.
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
            // At rest a side tank stands as high as its vessel.
            all.levels[states - 1] = all.levels[0];
        }
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
