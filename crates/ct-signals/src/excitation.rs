//! Inputs for an experiment: random steps, a maximal-length binary sequence, a multisine; and a limit on how fast they change.

use std::f64::consts::PI;

use rand::distr::uniform::SampleRange;
use rand::{Rng, RngExt};

use crate::Error;

/// Feedback taps of shift registers of length 2, 3, ... 20 that run through all their states.
const TAPS: [&[u32]; 19] = [
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
    &[19, 6, 2, 1],
    &[20, 17],
];

/// Random steps between many levels: `n` samples; each level is drawn evenly from `[low, high]`
/// (the actuator's unit) and held for a number of samples drawn evenly from `hold_samples`
/// (`20..=60`, say; a draw of 0 counts as 1).
///
/// # Errors
/// [`Error::InvalidSetting`] when `hold_samples` is empty, or `low < high` does not hold.
pub fn steps<H, R>(
    n: usize,
    hold_samples: H,
    low: f64,
    high: f64,
    rng: &mut R,
) -> Result<Vec<f64>, Error>
where
    H: SampleRange<usize> + Clone,
    R: Rng + ?Sized,
{
    check_limits(low, high)?;
    if hold_samples.is_empty() {
        return Err(Error::InvalidSetting {
            setting: "hold_samples",
            value: "an empty range".into(),
            range: "a range of samples such as 20..=60".into(),
        });
    }
    let mut u = Vec::with_capacity(n);
    while u.len() < n {
        let level = rng.random_range(low..=high);
        let hold = rng.random_range(hold_samples.clone()).max(1);
        u.resize(n.min(u.len().saturating_add(hold)), level);
    }
    Ok(u)
}

/// Given levels (the actuator's unit), each held for `hold` samples (`>= 1`), over and over: `n` samples.
///
/// # Errors
/// [`Error::InvalidSetting`] for a `hold` of 0, no levels, or a level that is not finite.
pub fn levels(n: usize, hold: usize, levels: &[f64]) -> Result<Vec<f64>, Error> {
    let setting = |setting, value: String, range: &str| {
        Err(Error::InvalidSetting {
            setting,
            value,
            range: range.into(),
        })
    };
    if hold == 0 {
        return setting("hold", "0".into(), "at least 1 sample");
    }
    if levels.is_empty() || levels.iter().any(|level| !level.is_finite()) {
        return setting("levels", format!("{levels:?}"), "finite, at least one");
    }
    Ok((0..n).map(|k| levels[(k / hold) % levels.len()]).collect())
}

/// A pseudo-random binary sequence of maximal length: `n` samples of `low` or `high` (the
/// actuator's unit), each bit held for `bit` samples (`>= 1`).
///
/// It repeats after `bit (2^register_length - 1)` samples, `register_length` from 2 to 20, and is
/// the same in every call.
///
/// # Errors
/// [`Error::InvalidSetting`] for a `bit` of 0, a register outside 2..=20, or unless `low < high`.
pub fn prbs(
    n: usize,
    bit: usize,
    low: f64,
    high: f64,
    register_length: u32,
) -> Result<Vec<f64>, Error> {
    check_limits(low, high)?;
    if bit == 0 {
        return Err(Error::InvalidSetting {
            setting: "bit",
            value: "0".into(),
            range: "at least 1 sample".into(),
        });
    }
    let taps = (register_length as usize)
        .checked_sub(2)
        .and_then(|row| TAPS.get(row))
        .ok_or_else(|| Error::InvalidSetting {
            setting: "register_length",
            value: register_length.to_string(),
            range: "from 2 to 20".into(),
        })?;
    let mask = (1u32 << register_length) - 1;
    let mut register = mask;
    let mut u = Vec::with_capacity(n);
    while u.len() < n {
        let output = (register >> (register_length - 1)) & 1;
        let level = if output == 1 { high } else { low };
        u.resize(n.min(u.len().saturating_add(bit)), level);
        let feedback = taps
            .iter()
            .fold(0, |sum, tap| sum ^ (register >> (tap - 1)))
            & 1;
        register = ((register << 1) | feedback) & mask;
    }
    Ok(u)
}

/// A sum of sines of equal amplitude with Schroeder's phases, which keep its peaks low: `n`
/// samples, one every `dt` \[s\], with `frequencies` \[Hz\] above 0 and below `1/(2 dt)`.
///
/// It is centred between `low` and `high` (the actuator's unit) and scaled so that it reaches one
/// of the two and passes neither.
///
/// Reference: M. R. Schroeder, *Synthesis of low-peak-factor signals and binary sequences with
/// low autocorrelation*, IEEE Trans. Information Theory 16 (1970) 85-89.
///
/// # Errors
/// [`Error::InvalidSetting`] when `dt` or a frequency is out of range, there is no frequency, or
/// unless `low < high`.
pub fn multisine(
    n: usize,
    dt: f64,
    frequencies: &[f64],
    low: f64,
    high: f64,
) -> Result<Vec<f64>, Error> {
    check_limits(low, high)?;
    if !(dt.is_finite() && dt > 0.0) {
        return Err(Error::InvalidSetting {
            setting: "dt",
            value: dt.to_string(),
            range: "a time above 0 s".into(),
        });
    }
    let nyquist = 0.5 / dt;
    if frequencies.is_empty() {
        return Err(Error::InvalidSetting {
            setting: "frequencies",
            value: "empty".into(),
            range: format!("at least one frequency between 0 and {nyquist} Hz"),
        });
    }
    if let Some(f) = frequencies.iter().find(|&&f| !(f > 0.0 && f < nyquist)) {
        return Err(Error::InvalidSetting {
            setting: "a frequency",
            value: format!("{f} Hz"),
            range: format!("between 0 and {nyquist} Hz, half the sampling frequency"),
        });
    }
    let lines = frequencies.len() as f64;
    let mut u: Vec<f64> = (0..n)
        .map(|k| {
            let t = k as f64 * dt;
            frequencies
                .iter()
                .enumerate()
                .map(|(i, f)| {
                    let i = i as f64;
                    (2.0 * PI * f * t - PI * i * (i + 1.0) / lines).cos()
                })
                .sum()
        })
        .collect();
    let peak = u.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
    let centre = 0.5 * (low + high);
    let scale = if peak > 0.0 {
        0.5 * (high - low) / peak
    } else {
        0.0
    };
    for v in &mut u {
        *v = (centre + scale * *v).clamp(low, high);
    }
    Ok(u)
}

/// Limits the change of a sequence to `most` (`> 0`, the actuator's unit) from one sample to the next: each value moves as far as permitted
/// towards its target. The result stays in the range of the sequence.
///
/// # Errors
/// [`Error::InvalidSetting`] unless `most > 0`.
pub fn limit_slew(values: &mut [f64], most: f64) -> Result<(), Error> {
    if most.is_nan() || most <= 0.0 {
        return Err(Error::InvalidSetting {
            setting: "most",
            value: most.to_string(),
            range: "above 0".into(),
        });
    }
    for k in 1..values.len() {
        let before = values[k - 1];
        let wanted = values[k] - before;
        if wanted.abs() > most {
            values[k] = before + most.copysign(wanted);
        }
    }
    Ok(())
}

fn check_limits(low: f64, high: f64) -> Result<(), Error> {
    if low.is_finite() && high.is_finite() && low < high {
        return Ok(());
    }
    Err(Error::InvalidSetting {
        setting: "low..high",
        value: format!("{low}..{high}"),
        range: "two finite values, low < high".into(),
    })
}
