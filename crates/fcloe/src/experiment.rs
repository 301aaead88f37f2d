//! Closed-loop data: a plant under a controller, with noise in the loop or on the record, and quantisation.
//!
//! A continuous controller is simulated exactly: everything is linear, so y and u are sums of the responses to r and to
//! the noise w, `y = B R/P r + A S/P w`, `u = A R/P (r - w)`, each held between samples. A sampled controller runs R/S
//! as it is under a held error, and its command is held; between its instants the plant is exact too.

use ct_lti::{Hold, Polynomial, Sampled, Simulator, StateSpace, TransferFunction};
use ct_signals::noise;
use rand::Rng;

use crate::{ClosedLoop, Controller, Error, LoopSimulator, PlantModel};

/// Point where noise enters the loop. One value for each sample, unit of y, held until the next.
#[derive(Debug, Clone, Copy)]
pub enum Noise<'a> {
    /// No noise.
    None,
    /// Noise is added to the output that the controller reads: it is fed back, and the record contains `A S/P w`.
    InLoop(&'a [f64]),
    /// Noise is added to the recorded y alone: the controller does not read it.
    OnRecord(&'a [f64]),
}

/// The signals of a simulated experiment, deviations from the operating point.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopData {
    /// Output as recorded.
    pub y: Vec<f64>,
    /// Input of the plant.
    pub u: Vec<f64>,
}

/// A loop with a continuous controller, from rest; `hold` is the hold of `r`.
///
/// In open loop (R = 0) r is the input itself.
///
/// # Errors
/// [`Error::UnstableLoop`], [`Error::Lti`], [`Error::NoiseLength`].
pub fn continuous_loop(
    plant: &PlantModel,
    controller: &Controller,
    step: f64,
    r: &[f64],
    hold: Hold,
    noise: Noise,
) -> Result<LoopData, Error> {
    let closed = ClosedLoop::new(plant, controller)?;
    closed.require_stable()?;
    let mut simulator = LoopSimulator::new(plant, controller, hold, step)?;
    let (mut y, mut u) = simulator.outputs_and_inputs(r);
    match noise {
        Noise::None => {}
        Noise::OnRecord(w) => {
            check_length(w, r)?;
            y.iter_mut().zip(w).for_each(|(y, w)| *y += w);
        }
        Noise::InLoop(w) => {
            check_length(w, r)?;
            let response = |of: TransferFunction| -> Result<Vec<f64>, Error> {
                let mut simulator = Simulator::new(StateSpace::controllable(&of)?, Hold::Zero);
                let outputs = w.iter().map(|w| simulator.update(*w, step));
                Ok(outputs.collect::<Result<_, _>>()?)
            };
            let (of_y, of_u) = (response(closed.disturbance()?)?, response(closed.input()?)?);
            y.iter_mut().zip(of_y).for_each(|(y, v)| *y += v);
            if !controller.is_open_loop() {
                u.iter_mut().zip(of_u).for_each(|(u, v)| *u -= v);
            }
        }
    }
    Ok(LoopData { y, u })
}

/// A loop with a sampled controller: it runs `periods` times in each sampling interval of the record, on the output at that instant; r and
/// w are held over the interval. From rest. The loop may be unstable although the continuous loop is stable: then the signals grow.
///
/// A direct term of the plant passes on the command of the period before: the controller cannot act on what its own
/// command does at once.
///
/// # Errors
/// [`Error::Setting`] for no periods, [`Error::Lti`], [`Error::NoiseLength`], [`Error::Diverged`].
pub fn sampled_loop(
    plant: &PlantModel,
    controller: &Controller,
    step: f64,
    periods: usize,
    r: &[f64],
    noise: Noise,
    quantiser: Option<&Quantiser>,
) -> Result<LoopData, Error> {
    if periods == 0 {
        return Err(Error::Setting {
            what: "the controller's periods per sample",
            value: 0.0,
            range: "at least 1",
        });
    }
    if let Noise::InLoop(w) | Noise::OnRecord(w) = noise {
        check_length(w, r)?;
    }
    let period = step / periods as f64;
    // The sensor's filter is continuous, between plant and sampler.
    let sensor = TransferFunction::new(Polynomial::one(), controller.filter().clone())?;
    let mut process = Held::new(&plant.transfer_function()?.series(&sensor)?, period)?;
    let mut law = Held::new(&controller.law()?, period)?;
    let quantise = |v: f64| quantiser.map_or(v, |quantiser| quantiser.value(v));
    let (mut y, mut u) = (Vec::with_capacity(r.len()), Vec::with_capacity(r.len()));
    let mut command = 0.0;
    for (k, &r) in r.iter().enumerate() {
        let (in_loop, on_record) = match noise {
            Noise::None => (0.0, 0.0),
            Noise::InLoop(w) => (w[k], 0.0),
            Noise::OnRecord(w) => (0.0, w[k]),
        };
        for i in 0..periods {
            let output = process.output(command) + in_loop;
            command = if controller.is_open_loop() {
                r
            } else {
                let error = r - quantise(output);
                let command = quantise(law.output(error));
                law.advance(error);
                command
            };
            process.advance(command);
            if i == 0 {
                y.push(quantise(output + on_record));
                u.push(command);
            }
        }
    }
    match y.iter().chain(&u).all(|v| v.is_finite()) {
        true => Ok(LoopData { y, u }),
        false => Err(Error::Diverged { period }),
    }
}

/// A system under an input that is held over a period.
struct Held {
    system: StateSpace,
    sampled: Sampled,
    state: Vec<f64>,
}

impl Held {
    fn new(of: &TransferFunction, period: f64) -> Result<Self, Error> {
        let system = StateSpace::controllable(of)?;
        Ok(Self {
            sampled: system.sampled(Hold::Zero, period)?,
            state: vec![0.0; system.order()],
            system,
        })
    }

    fn output(&self, input: f64) -> f64 {
        self.system.output(&self.state, input)
    }

    fn advance(&mut self, input: f64) {
        self.state = self.sampled.held_step(&self.state, input);
    }
}

/// White Gaussian noise whose power is `snr` decibels below that of a noise-free signal about its mean.
///
/// # Errors
/// [`Error::Setting`] for an SNR that is not finite.
pub fn noise_at_snr<R: Rng + ?Sized>(
    noise_free: &[f64],
    snr: f64,
    rng: &mut R,
) -> Result<Vec<f64>, Error> {
    if !snr.is_finite() {
        return Err(Error::Setting {
            what: "the signal-to-noise ratio [dB]",
            value: snr,
            range: "finite",
        });
    }
    let n = noise_free.len().max(1) as f64;
    let mean = noise_free.iter().sum::<f64>() / n;
    let power = noise_free.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    let sigma = power.sqrt() * 10.0_f64.powf(-snr / 20.0);
    Ok(noise::white(noise_free.len(), sigma, rng))
}

fn check_length(w: &[f64], r: &[f64]) -> Result<(), Error> {
    if w.len() == r.len() {
        return Ok(());
    }
    Err(Error::NoiseLength {
        expected: r.len(),
        found: w.len(),
    })
}

/// A converter: `2^bits` levels from `low` to `high`, with saturation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    low: f64,
    high: f64,
    level: f64,
}

impl Quantiser {
    /// From 1 to 52 bits over the range, in the signal's unit.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new(low: f64, high: f64, bits: u32) -> Result<Self, Error> {
        let setting = |what, value, range| Err(Error::Setting { what, value, range });
        if !(1..=52).contains(&bits) {
            return setting("the converter's bits", f64::from(bits), "between 1 and 52");
        }
        let span = high - low;
        if !(span > 0.0 && span.is_finite()) {
            return setting("the converter's range", span, "finite and above 0");
        }
        let level = span / ((1_u64 << bits) - 1) as f64;
        Ok(Self { low, high, level })
    }

    /// The level that is nearest.
    pub fn value(&self, v: f64) -> f64 {
        let steps = ((v.clamp(self.low, self.high) - self.low) / self.level).round();
        self.low + steps * self.level
    }
}
