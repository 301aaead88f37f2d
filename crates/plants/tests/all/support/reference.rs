//! The equations of the catalogue as its files write them, integrated without the crate's own laws: Dormand-Prince
//! restarted at every corner of the input where nothing overflows, else fine Runge-Kutta steps with every contact
//! with a rim bisected.

mod equations;

use ode_solvers::dopri5::Dopri5;
use ode_solvers::{DVector, OutputType, System};
use plants::Command;

use self::equations::{Equations, PUMPS, SENSOR, SIDE};
use super::Case;

/// Discrete state of the rates: the time, whether each valve has stepped, whether each vessel overflows.
#[derive(Clone, Copy)]
struct Instant {
    t: f64,
    late: [bool; 3],
    spilling: [bool; 3],
}

/// The commands as functions of time, delayed and shaped, with their corners.
struct Signal<'a> {
    equations: &'a Equations,
    /// For each pump: start, length and command of each interval.
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

    /// The interval of the command that arrives in the middle of a step.
    fn piece(&self, pump: usize, middle: f64) -> Option<usize> {
        let t = middle - self.equations.pumps[pump].delay;
        let after = self.pieces[pump].partition_point(|&(begin, _, _)| begin <= t);
        after.checked_sub(1)
    }
}

struct Stretch<'a, 'b> {
    signal: &'a Signal<'b>,
    piece: [Option<usize>; 2],
    /// Whether each valve has stepped.
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
    // The initial state of a lag decays for a sample before the record begins.
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
        // Two corners separated only by rounding: one Euler step is exact here.
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
    // Whether a state has left the present modes.
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
