//! The equations of the catalogue as its files write them, integrated without the crate's own laws: Dormand-Prince
//! restarted at every corner of the input where nothing overflows, else fine Runge-Kutta steps with every contact
//! with a rim bisected.

use ode_solvers::dopri5::Dopri5;
use ode_solvers::{DVector, OutputType, System};
use plants::{Command, Outlet, Plant};

use super::Case;

/// A pump, and what acts on its command.
#[derive(Clone, Copy)]
struct Pump {
    gain: f64,
    /// Change and time constant.
    warm_up: (f64, f64),
    /// Width, jump and where in its band it begins.
    sticks: (f64, f64, f64),
    delay: f64,
    threshold: f64,
    limit: f64,
    bend: f64,
    lag: Option<f64>,
    at_rest: f64,
}

impl Default for Pump {
    fn default() -> Self {
        Self {
            gain: 0.0,
            warm_up: (0.0, 1.0),
            sticks: (0.0, 0.0, 0.0),
            delay: 0.0,
            threshold: 0.0,
            limit: f64::INFINITY,
            bend: 0.0,
            lag: None,
            at_rest: 0.0,
        }
    }
}

/// Places of the states behind the levels: the pumps', the sensor's, a side tank's.
const PUMPS: [usize; 2] = [3, 6];
const SENSOR: usize = 4;
const SIDE: usize = 5;

/// Parameters by name; what is missing is absent.
#[derive(Clone, Default)]
struct Equations {
    linear: bool,
    n: usize,
    measured: usize,
    area: [f64; 3],
    /// `alpha`, or the offset of a linear outlet.
    outlet: [f64; 3],
    leak: [f64; 3],
    laminar: [f64; 3],
    curvature: [f64; 3],
    pipe: [f64; 3],
    drift: [f64; 3],
    /// Change and instant.
    step: [(f64, f64); 3],
    backflow: f64,
    /// Share of the surface and time constant.
    side: Option<[f64; 2]>,
    hole: [(f64, f64); 3],
    /// Sine, cosine, period.
    swing: [[f64; 3]; 3],
    duration: f64,
    taper: [f64; 3],
    operating: [f64; 3],
    rim: [f64; 3],
    fraction: [f64; 3],
    pumps: [Pump; 2],
    /// The vessel into which the second input flows.
    second_into: usize,
    input_range: f64,
    /// The heads of valves between tanks are parabolas of degree five within it; zero where there are none.
    width: f64,
    sensor_lag: Option<f64>,
    offset: f64,
    sensor_drift: f64,
    sensor_bend: f64,
    sensor_range: f64,
    quantum: f64,
    rounded_noise: f64,
    hysteresis: Option<[f64; 4]>,
    largest_reading: f64,
}

impl Equations {
    fn new(case: &Case) -> Self {
        let structure = &case.structure;
        let theta = &case.theta;
        let scales = &structure.scales;
        let mut e = Self {
            linear: structure.plant.outlet() == Outlet::Linear,
            n: structure.plant.vessels(),
            measured: scales.outputs[0].vessel,
            area: scales.area,
            operating: scales.operating_level,
            rim: [f64::INFINITY; 3],
            largest_reading: f64::INFINITY,
            input_range: scales.input_range,
            duration: scales.duration,
            swing: [[0.0, 0.0, 1.0]; 3],
            ..Self::default()
        };
        e.pumps[0].gain = theta[0];
        e.pumps[0].at_rest = case.at_rest;
        match structure.plant {
            Plant::SingleTank => e.outlet[0] = theta[1],
            Plant::CascadedTanks => e.outlet[..2].copy_from_slice(&theta[1..3]),
            Plant::SingleTankLinear => (e.area[0], e.outlet[0]) = (theta[1], theta[2]),
            Plant::CascadedTanksLinear => {
                e.area[..2].copy_from_slice(&theta[1..3]);
                e.outlet[1] = theta[3];
            }
            Plant::FirstOrder => e.area[0] = theta[1],
            Plant::ThreeTank => {
                e.pumps[1].gain = theta[1];
                e.pumps[1].at_rest = (case.second)(Command::held(case.at_rest)).from;
                e.second_into = 2;
                e.outlet.copy_from_slice(&theta[2..5]);
                e.width = 1e-4 * scales.level[scales.outputs[0].vessel].1;
            }
        }
        let names = structure.parameter_names();
        let vessel = |id: &str| {
            let placed = structure.effects().iter().find(|p| p.effect.id == id);
            placed.map_or(0, |p| p.vessel)
        };
        let (low, high) = scales.level[scales.outputs[0].vessel];
        e.sensor_range = high;
        let own = structure.plant.parameters(scales).len();
        if let Some(vessel) = structure.known.disturbance {
            e.second_into = vessel;
            e.pumps[1].gain = theta[own - 1];
        }
        for (name, &value) in names.iter().zip(theta).skip(own) {
            let (id, parameter) = name.split_once('.').expect("effect.parameter");
            let v = vessel(id);
            match (id, parameter) {
                ("transport_delay", _) => e.pumps[v].delay = value,
                ("pump_deadzone", _) => e.pumps[v].threshold = value,
                ("pump_saturation", _) => e.pumps[v].limit = value,
                ("pump_nonlinearity", _) => e.pumps[v].bend = value,
                ("pump_lag", _) => e.pumps[v].lag = Some(value),
                ("sqrt_outflow", _) => e.curvature[v] = value,
                ("laminar_outflow", _) => e.laminar[v] = value,
                ("const_leak", _) => e.leak[v] = value,
                ("area_varies", _) => e.taper[v] = value,
                ("overflow", "rim") => e.rim[v] = value,
                ("overflow", _) => e.fraction[v] = value,
                ("sensor_lag", _) => e.sensor_lag = Some(value),
                ("sensor_offset", _) => e.offset = value,
                ("sensor_hysteresis", "step") => {
                    e.hysteresis = Some([value, 0.0, 0.0, 0.015 * (high - low)]);
                }
                ("sensor_hysteresis", "drop") => {
                    e.hysteresis.as_mut().expect("step first")[1] = value
                }
                ("sensor_hysteresis", _) => e.hysteresis.as_mut().expect("step first")[2] = value,
                ("sensor_saturation", _) => e.largest_reading = value,
                ("stiction_backlash", "width") => e.pumps[v].sticks.0 = value,
                ("stiction_backlash", "jump") => e.pumps[v].sticks.1 = value,
                ("stiction_backlash", _) => e.pumps[v].sticks.2 = value,
                ("pump_gain_drift", "change") => e.pumps[v].warm_up.0 = value,
                ("pump_gain_drift", _) => e.pumps[v].warm_up.1 = value,
                ("pipe_height", _) => e.pipe[v] = value,
                ("valve_drift", _) => e.drift[v] = value,
                ("valve_step", "change") => e.step[v].0 = value,
                ("valve_step", _) => e.step[v].1 = value,
                ("coupled_tank", "backflow") => e.backflow = value,
                ("coupled_tank", "share") => e.side = Some([value, 1.0]),
                ("coupled_tank", _) => e.side.as_mut().expect("share first")[1] = value,
                ("leak_at_height", "coefficient") => e.hole[v].0 = value,
                ("leak_at_height", _) => e.hole[v].1 = value,
                ("periodic_disturbance", "sine") => e.swing[v][0] = value,
                ("periodic_disturbance", "cosine") => e.swing[v][1] = value,
                ("periodic_disturbance", _) => e.swing[v][2] = value,
                ("sensor_drift", _) => e.sensor_drift = value,
                ("sensor_nonlinearity", _) => e.sensor_bend = value,
                ("coarse_quantisation", "step") => e.quantum = value,
                ("coarse_quantisation", _) => e.rounded_noise = value,
                _ => panic!("`{name}` has no reference: write its equation here"),
            }
        }
        e
    }

    /// Static part of an actuator.
    fn command(&self, pump: usize, u: f64) -> f64 {
        let pump = &self.pumps[pump];
        let beyond = (u.abs() - pump.threshold).max(0.0) * u.signum();
        let limited = if beyond > pump.limit {
            pump.limit
        } else {
            beyond
        };
        limited + pump.bend * limited * (limited - self.input_range) / self.input_range
    }

    /// The outflow of vessel `i` at a time, its level and the next vessel's given; `late`: after the step of its valve.
    fn outflow(&self, i: usize, levels: &[f64], t: f64, late: bool) -> f64 {
        let feels = if i + 1 < self.n { self.backflow } else { 0.0 };
        let level = if self.width > 0.0 && i + 1 < self.n {
            levels[i] - levels[i + 1]
        } else {
            levels[i] - feels * levels.get(i + 1).copied().unwrap_or(0.0)
        };
        let own = if self.width > 0.0 && i + 1 < self.n {
            let x = level / self.width;
            let root = if x.abs() >= 1.0 {
                level.signum() * level.abs().sqrt()
            } else {
                self.width.sqrt() * (45.0 * x - 18.0 * x.powi(3) + 5.0 * x.powi(5)) / 32.0
            };
            self.outlet[i] * root
        } else if self.linear {
            level - self.outlet[i]
        } else {
            self.outlet[i] * (level + self.pipe[i]).max(0.0).sqrt()
        };
        let root = self.operating[i].sqrt();
        let curved = if self.curvature[i] == 0.0 {
            0.0
        } else {
            2.0 * root * (level.sqrt() - root) - (level - self.operating[i])
        };
        let step = if late { self.step[i].0 } else { 0.0 };
        let valve = (1.0 + self.drift[i] * t / self.duration) * (1.0 + step);
        // Linear and curved part are one outflow.
        valve * (own + self.laminar[i] * level + self.curvature[i] * curved)
    }

    fn gain(&self, pump: usize, t: f64) -> f64 {
        let (change, settle) = self.pumps[pump].warm_up;
        let done = |t: f64| 1.0 - (-t / settle).exp();
        self.pumps[pump].gain * (1.0 + change * done(t) / done(self.duration))
    }

    /// Where what a pump moves stands before the record begins.
    fn rests(&self, pump: usize) -> f64 {
        let Pump {
            at_rest, sticks, ..
        } = self.pumps[pump];
        let (width, jump, begin) = sticks;
        at_rest + begin * 0.5 * width * (1.0 + jump)
    }

    /// The commands that act behind what sticks.
    fn moved(&self, pump: usize, input: &[(Command, f64)]) -> Vec<(Command, f64)> {
        let (width, jump, _) = self.pumps[pump].sticks;
        let (breaks, left) = (0.5 * width * (1.0 + jump), 0.5 * width * (1.0 - jump));
        let mut position = self.rests(pump);
        let mut follow = |u: f64| {
            if u > position + breaks {
                position = u - left;
            } else if u < position - breaks {
                position = u + left;
            }
            position
        };
        input
            .iter()
            .map(|&(command, h)| {
                let from = follow(command.from);
                let to = command.to.map(&mut follow);
                (Command { from, to }, h)
            })
            .collect()
    }

    /// Rates of (levels, pump's state, sensor's state) for the command that arrives, and each vessel's net inflow.
    fn rates(&self, x: &[f64], arriving: [f64; 2], at: Instant) -> ([f64; 7], [f64; 3]) {
        let Instant { t, late, spilling } = at;
        let mut dx = [0.0; 7];
        let mut net = [0.0; 3];
        let mut fed = [0.0; 2];
        for (pump, at) in PUMPS.into_iter().enumerate() {
            let acting = match self.pumps[pump].lag {
                Some(lag) => {
                    dx[at] = (arriving[pump] - x[at]) / lag;
                    x[at]
                }
                None => arriving[pump],
            };
            fed[pump] = self.gain(pump, t) * acting;
        }
        let mut inflow = fed[0];
        for i in 0..self.n {
            if i == self.second_into {
                inflow += fed[1];
            }
            let out = self.outflow(i, &x[..self.n], t, late[i]);
            let (hole, height) = self.hole[i];
            let [sine, cosine, period] = self.swing[i];
            let angle = 2.0 * std::f64::consts::PI * t / period;
            net[i] = inflow - out - self.leak[i] - hole * (x[i] - height).max(0.0).sqrt()
                + sine * angle.sin()
                + cosine * angle.cos();
            if let Some([share, time_constant]) = self.side {
                net[i] -= share * self.area[i] * (x[i] - x[SIDE]) / time_constant;
                dx[SIDE] = (x[i] - x[SIDE]) / time_constant;
            }
            let width = 1.0 + self.taper[i] * (x[i] - self.operating[i]) / self.operating[i];
            assert!(width > 0.1, "the reference has no narrowest width");
            inflow = out;
            if spilling[i] {
                inflow += self.fraction[i] * net[i].max(0.0);
            } else {
                dx[i] = net[i] / (self.area[i] * width * width);
            }
        }
        if let Some(lag) = self.sensor_lag {
            dx[SENSOR] = (x[self.measured] - x[SENSOR]) / lag;
        }
        (dx, net)
    }
}

/// What a rate depends on beside the state: the time, whether each valve has made its step, whether each vessel spills.
#[derive(Clone, Copy)]
struct Instant {
    t: f64,
    late: [bool; 3],
    spilling: [bool; 3],
}

/// The commands as functions of time, delayed and shaped, with their corners.
struct Signal<'a> {
    equations: &'a Equations,
    /// Of each pump: beginning, length and command of each interval.
    pieces: [Vec<(f64, f64, Command)>; 2],
}

impl Signal<'_> {
    /// The command as given at a time within piece `k` (or before all).
    fn raw(&self, pump: usize, k: Option<usize>, t: f64) -> f64 {
        let Some(k) = k else {
            return self.equations.rests(pump);
        };
        let (begin, h, command) = self.pieces[pump][k];
        match command.to {
            None => command.from,
            Some(to) => command.from + (to - command.from) * (t - begin) / h,
        }
    }

    /// Times at which what arrives jumps or has a corner.
    fn corners(&self) -> Vec<f64> {
        let e = self.equations;
        let mut all = vec![0.0];
        for (change, instant) in e.step {
            if change != 0.0 {
                all.push(instant);
            }
        }
        for (pump, pieces) in e.pumps.iter().zip(&self.pieces) {
            let (delay, threshold) = (pump.delay, pump.threshold);
            for &(begin, h, command) in pieces {
                all.push(begin);
                all.push(begin + delay);
                if let Some(to) = command.to {
                    for kink in [threshold, -threshold, pump.limit + threshold] {
                        let s = (kink - command.from) / (to - command.from);
                        if s > 0.0 && s < 1.0 {
                            all.push(begin + s * h + delay);
                        }
                    }
                }
            }
        }
        all.sort_by(f64::total_cmp);
        all
    }

    /// The piece that arrives in the middle of a stretch.
    fn piece(&self, pump: usize, middle: f64) -> Option<usize> {
        let t = middle - self.equations.pumps[pump].delay;
        let after = self.pieces[pump].partition_point(|&(begin, _, _)| begin <= t);
        after.checked_sub(1)
    }
}

struct Stretch<'a, 'b> {
    signal: &'a Signal<'b>,
    piece: [Option<usize>; 2],
    /// Each valve has made its step.
    late: [bool; 3],
}

impl Stretch<'_, '_> {
    fn arriving(&self, t: f64) -> [f64; 2] {
        let e = self.signal.equations;
        [0, 1].map(|pump| {
            let given = t - e.pumps[pump].delay;
            e.command(pump, self.signal.raw(pump, self.piece[pump], given))
        })
    }

    fn rates(&self, x: &[f64], t: f64, spilling: [bool; 3]) -> ([f64; 7], [f64; 3]) {
        let late = self.late;
        let at = Instant { t, late, spilling };
        self.signal.equations.rates(x, self.arriving(t), at)
    }
}

impl System<f64, DVector<f64>> for Stretch<'_, '_> {
    fn system(&self, t: f64, x: &DVector<f64>, dx: &mut DVector<f64>) {
        let (rates, _) = self.rates(x.as_slice(), t, [false; 3]);
        dx.copy_from_slice(&rates);
    }
}

/// Readings before each command.
pub fn run(case: &Case, input: &[(Command, f64)]) -> Vec<f64> {
    let equations = Equations::new(case);
    let e = &equations;
    let mut t = 0.0;
    let second: Vec<(Command, f64)> = input
        .iter()
        .map(|&(command, h)| ((case.second)(command), h))
        .collect();
    let mut pieces = [Vec::new(), Vec::new()];
    for (of_first, of_second) in e.moved(0, input).into_iter().zip(e.moved(1, &second)) {
        let h = of_first.1;
        pieces[0].push((t, h, of_first.0));
        pieces[1].push((t, h, of_second.0));
        t += h;
    }
    let end = t;
    let signal = Signal {
        equations: e,
        pieces,
    };
    let mut x = [0.0; 7];
    let (levels, before) = case.levels.split_at(e.n);
    for (i, (to, &level)) in x.iter_mut().zip(levels).enumerate() {
        *to = level.min(e.rim[i]);
    }
    for (pump, at) in PUMPS.into_iter().enumerate() {
        x[at] = e.command(pump, e.rests(pump));
    }
    x[SENSOR] = x[e.measured];
    // What stood behind a lag decays for a sample before the record begins.
    let lags = [
        (PUMPS[0], e.pumps[0].lag),
        (PUMPS[1], e.pumps[1].lag),
        (SENSOR, e.sensor_lag),
    ];
    let lags = lags.into_iter().filter_map(|(i, lag)| Some((i, lag?)));
    for ((i, lag), before) in lags.zip(before) {
        x[i] += before * (-case.structure.scales.sample_interval / lag).exp();
    }
    x[SIDE] = x[0];
    let mut corners = signal.corners();
    corners.push(end);
    let mut readings = Vec::new();
    let mut stuck = 0.0_f64;
    let mut from = 0.0;
    let mut sample = 0;
    let overflows = e.rim.iter().any(|rim| rim.is_finite());
    for corner in corners {
        if corner > end {
            break;
        }
        if corner > from {
            let stretch = Stretch {
                signal: &signal,
                piece: [0, 1].map(|pump| signal.piece(pump, 0.5 * (from + corner))),
                late: e.step.map(|(_, instant)| 0.5 * (from + corner) > instant),
            };
            x = if overflows {
                bisected(e, &stretch, x, from, corner)
            } else {
                smooth(stretch, x, from, corner)
            };
            from = corner;
        }
        while sample < input.len() && signal.pieces[0][sample].0 <= from {
            let behind = if e.sensor_lag.is_some() {
                x[SENSOR]
            } else {
                x[e.measured]
            };
            let bent = behind + e.sensor_bend * behind * (behind / e.sensor_range - 1.0);
            let t = signal.pieces[0][sample].0;
            let mut y = bent + e.offset + e.sensor_drift * t / e.duration;
            if let Some([step, drop, rise, width]) = e.hysteresis {
                let up = ((y - drop) / rise).clamp(0.0, 1.0);
                let down = ((y - drop) / width).clamp(0.0, 1.0);
                stuck = stuck.max(up).min(down.max(up));
                y += step * stuck;
            }
            let limited = y.min(e.largest_reading);
            readings.push(if e.quantum > 0.0 && e.rounded_noise > 0.0 {
                mean_reading(limited, e.quantum, e.rounded_noise)
            } else if e.quantum > 0.0 {
                e.quantum * (limited / e.quantum).round()
            } else {
                limited
            });
            sample += 1;
        }
    }
    readings
}

fn smooth(stretch: Stretch, x: [f64; 7], from: f64, to: f64) -> [f64; 7] {
    if to - from < 1e-9 {
        // Two corners that rounding has parted: one Euler step is exact here.
        let (rates, _) = stretch.rates(&x, from, [false; 3]);
        return std::array::from_fn(|i| x[i] + rates[i] * (to - from));
    }
    let mut solver = Dopri5::new(
        stretch,
        from,
        to,
        to - from,
        DVector::from_column_slice(&x),
        1e-12,
        1e-12,
    );
    solver.set_output(OutputType::Sparse);
    solver.integrate().expect("the reference integrates");
    let last = solver.y_out().last().expect("a last point");
    let end = solver.x_out().last().expect("an end");
    assert!((end - to).abs() <= 1e-15 * to, "{end} instead of {to}");
    std::array::from_fn(|i| last[i])
}

/// Fine Runge-Kutta steps; where a level meets a rim or a net inflow changes sign at one, the instant is bisected.
fn bisected(e: &Equations, stretch: &Stretch, mut x: [f64; 7], from: f64, to: f64) -> [f64; 7] {
    let step = |x: [f64; 7], t: f64, h: f64, spilling: [bool; 3]| -> [f64; 7] {
        let f = |x: [f64; 7], t: f64| stretch.rates(&x, t, spilling).0;
        let add = |x: [f64; 7], k: [f64; 7], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
        let k1 = f(x, t);
        let k2 = f(add(x, k1, 0.5 * h), t + 0.5 * h);
        let k3 = f(add(x, k2, 0.5 * h), t + 0.5 * h);
        let k4 = f(add(x, k3, h), t + h);
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let modes = |x: [f64; 7], t: f64| -> [bool; 3] {
        let mut spilling = [false; 3];
        for i in 0..e.n {
            let net = stretch.rates(&x, t, spilling).1;
            spilling[i] = x[i] >= e.rim[i] && net[i] > 0.0;
        }
        spilling
    };
    // Whether the modes have been left by a state.
    let left = |x: [f64; 7], t: f64, spilling: [bool; 3]| {
        let net = stretch.rates(&x, t, spilling).1;
        (0..e.n).any(|i| {
            if spilling[i] {
                net[i] < 0.0
            } else {
                x[i] > e.rim[i]
            }
        })
    };
    let n = 100;
    let fine = (to - from) / f64::from(n);
    let mut t = from;
    for k in 1..=n {
        let until = if k == n {
            to
        } else {
            from + fine * f64::from(k)
        };
        let mut spilling = modes(x, t);
        let mut arrived = false;
        for _ in 0..6 {
            let h = until - t;
            let next = step(x, t, h, spilling);
            if !left(next, until, spilling) {
                x = next;
                arrived = true;
                break;
            }
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if left(step(x, t, h * middle, spilling), t + h * middle, spilling) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            x = step(x, t, h * high, spilling);
            t += h * high;
            for i in 0..e.n {
                if !spilling[i] {
                    x[i] = if x[i] >= e.rim[i] { e.rim[i] } else { x[i] };
                }
            }
            spilling = modes(x, t);
        }
        assert!(arrived, "the reference chatters");
        t = until;
    }
    x
}

/// Mean of a level that is rounded with noise: the Fourier series of the sawtooth, each term times the noise's characteristic function.
fn mean_reading(level: f64, step: f64, noise: f64) -> f64 {
    let angle = 2.0 * std::f64::consts::PI;
    let term = |n: i32| {
        let n = f64::from(n);
        let less = (-0.5 * (angle * n * noise / step).powi(2)).exp();
        let sign = if n % 2.0 == 0.0 { 1.0 } else { -1.0 };
        sign * 2.0 / (angle * n) * less * (angle * n * level / step).sin()
    };
    level + step * (1..200).map(term).sum::<f64>()
}
