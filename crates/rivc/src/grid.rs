//! A delayed input between the samples: the intervals on which it is linear.
//!
//! With a delay d the input is `u(t - d)`: its jumps and kinks lie between the samples, so that a step of the record is split into
//! intervals. Steps and intervals of the same length share one index, for which the filters are sampled once. Before the first sample the
//! input is assumed to have its first value.

use std::collections::HashMap;

use ct_lti::Hold;

/// Parts of a step that are shorter than this share of it are ignored.
const NEGLIGIBLE: f64 = 1e-9;

/// An interval on which an input is linear in time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    /// Index of its length.
    pub(crate) length: usize,
    /// Input at its beginning and end.
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// A delayed input over a record.
#[derive(Debug, Clone, Default)]
pub(crate) struct Path {
    stretches: Vec<Stretch>,
    /// Index of the first interval after each sample; one more entry than steps.
    begins: Vec<usize>,
    /// The input just before and just after each sample.
    limits: Vec<[f64; 2]>,
}

impl Path {
    /// Intervals from sample k to the next.
    pub(crate) fn step(&self, k: usize) -> &[Stretch] {
        &self.stretches[self.begins[k]..self.begins[k + 1]]
    }

    pub(crate) fn before(&self, k: usize) -> f64 {
        self.limits[k][0]
    }

    pub(crate) fn after(&self, k: usize) -> f64 {
        self.limits[k][1]
    }
}

/// Lengths of steps and intervals, each once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lengths {
    values: Vec<f64>,
    numbers: HashMap<u64, usize>,
}

impl Lengths {
    pub(crate) fn number(&mut self, length: f64) -> usize {
        *self.numbers.entry(length.to_bits()).or_insert_with(|| {
            self.values.push(length);
            self.values.len() - 1
        })
    }

    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }
}

/// A signal with its hold, and its times; `step` if they are even.
pub(crate) struct Held<'a> {
    pub(crate) time: &'a [f64],
    pub(crate) step: Option<f64>,
    pub(crate) values: &'a [f64],
    pub(crate) hold: Hold,
}

impl Held<'_> {
    /// Value of the input at a share of the step from sample i (none: before the first one).
    fn value(&self, i: Option<usize>, share: f64) -> f64 {
        let Some(i) = i else {
            return self.values[0];
        };
        match (self.hold, self.values.get(i + 1)) {
            (Hold::First, Some(next)) => self.values[i] + share * (next - self.values[i]),
            _ => self.values[i],
        }
    }

    /// Delayed by `delay`.
    pub(crate) fn delayed(&self, delay: f64, lengths: &mut Lengths) -> Path {
        match self.step {
            Some(step) => self.delayed_evenly(delay / step, step, lengths),
            None => self.delayed_unevenly(delay, lengths),
        }
    }

    /// Delay by a multiple of the step: every step has the same intervals.
    fn delayed_evenly(&self, delay: f64, step: f64, lengths: &mut Lengths) -> Path {
        let n = self.values.len();
        let mut whole = delay.floor();
        let mut part = delay - whole;
        if part < NEGLIGIBLE {
            part = 0.0;
        } else if part > 1.0 - NEGLIGIBLE {
            part = 0.0;
            whole += 1.0;
        }
        // Beyond the record one delay is as good as another.
        let whole = whole.min(n as f64) as usize;
        let second = lengths.number((1.0 - part) * step);
        let first = if part > 0.0 {
            lengths.number(part * step)
        } else {
            second
        };
        let mut path = Path::default();
        for k in 0..n {
            let now = k.checked_sub(whole);
            let last = k.checked_sub(whole + 1);
            let from_last = if part > 0.0 { 1.0 - part } else { 1.0 };
            let before = self.value(last, from_last);
            let after = if part > 0.0 {
                before
            } else {
                self.value(now, 0.0)
            };
            path.limits.push([before, after]);
            path.begins.push(path.stretches.len());
            if part > 0.0 {
                path.stretches.push(Stretch {
                    length: first,
                    from: before,
                    to: self.value(last, 1.0),
                });
            }
            path.stretches.push(Stretch {
                length: second,
                from: self.value(now, 0.0),
                to: self.value(now, 1.0 - part),
            });
        }
        path
    }

    fn delayed_unevenly(&self, delay: f64, lengths: &mut Lengths) -> Path {
        let time = self.time;
        let mut path = Path::default();
        // Number of samples at or before the instant.
        let mut passed: usize = 0;
        let share = |i: Option<usize>, at: f64| match i {
            Some(i) if i + 1 < time.len() => (at - time[i]) / (time[i + 1] - time[i]),
            _ => 0.0,
        };
        for (k, now) in time.iter().enumerate() {
            let begin = now - delay;
            let last = passed.checked_sub(1);
            let before = self.value(last, share(last, begin));
            let small = NEGLIGIBLE * time.get(k + 1).map_or(0.0, |next| next - now);
            while passed < time.len() && time[passed] <= begin + small {
                passed += 1;
            }
            let current = passed.checked_sub(1);
            path.limits
                .push([before, self.value(current, share(current, begin))]);
            path.begins.push(path.stretches.len());
            let Some(next) = time.get(k + 1) else {
                continue;
            };
            let (mut at, end) = (begin, next - delay);
            loop {
                let i = passed.checked_sub(1);
                let jump = time.get(passed).copied().filter(|t| *t < end - small);
                let to = jump.unwrap_or(end);
                // Without a delay the step keeps its exact length.
                let length = if at == begin && jump.is_none() {
                    next - now
                } else {
                    to - at
                };
                path.stretches.push(Stretch {
                    length: lengths.number(length),
                    from: self.value(i, share(i, at)),
                    to: self.value(i, share(i, to)),
                });
                if jump.is_none() {
                    break;
                }
                at = to;
                passed += 1;
            }
        }
        path.begins.push(path.stretches.len());
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integral(path: &Path, lengths: &Lengths, steps: usize) -> Vec<f64> {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for k in 0..steps {
            for stretch in path.step(k) {
                sum += lengths.values()[stretch.length] * 0.5 * (stretch.from + stretch.to);
            }
            sums.push(sum);
        }
        sums
    }

    /// The integral of a delayed signal is the delayed integral, on even and uneven times, for both holds.
    #[test]
    fn stretches_hold_the_delayed_signal() {
        let values: Vec<f64> = (0..40).map(|k| (0.7 * (k * k % 17) as f64).sin()).collect();
        let even: Vec<f64> = (0..40).map(|k| 0.5 * k as f64).collect();
        let uneven: Vec<f64> = (0..40)
            .map(|k| 0.5 * k as f64 + 0.2 * (1.3 * k as f64).sin())
            .collect();
        for (time, step) in [(&even, Some(0.5)), (&even, None), (&uneven, None)] {
            for hold in [Hold::Zero, Hold::First] {
                let held = Held {
                    time,
                    step,
                    values: &values,
                    hold,
                };
                let exact = |t: f64| {
                    // Fine sums of the undelayed signal from time[0].
                    let mut sum = values[0] * (t - time[0]).min(0.0);
                    for i in 0..time.len() - 1 {
                        let (a, b) = (time[i], time[i + 1].min(t));
                        if b <= a {
                            break;
                        }
                        let share = (b - a) / (time[i + 1] - a);
                        let end = match hold {
                            Hold::First => values[i] + share * (values[i + 1] - values[i]),
                            Hold::Zero => values[i],
                        };
                        sum += (b - a) * 0.5 * (values[i] + end);
                    }
                    sum
                };
                for delay in [0.0, 0.2, 0.5, 1.7, 3.0, 30.0] {
                    let mut lengths = Lengths::default();
                    let path = held.delayed(delay, &mut lengths);
                    let sums = integral(&path, &lengths, time.len() - 1);
                    for (k, found) in sums.iter().enumerate() {
                        let expected = exact(time[k] - delay) - exact(time[0] - delay);
                        assert!(
                            (found - expected).abs() < 1e-9,
                            "{hold:?} {step:?} {delay} {k}: {found} {expected}"
                        );
                    }
                }
            }
        }
    }
}
