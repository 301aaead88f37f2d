//! Whether the residual of a set of effects is noise.

use estimation::Fit;
use greybox::ModelSetup;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::Error;
use crate::fit::node::{Context, Node};
use crate::residual_tests::energy::concentrated;
use crate::residual_tests::first_order::first_order_p;
use crate::residual_tests::stationarity::stationary_p;
use crate::residual_tests::white::{harmonics_p, instant, level_p, period, standardised};
use crate::residual_tests::{InputDependence, NotNoise};

impl Context<'_> {
    /// The first property of a set's residual that noise does not have, `None` if the residual is noise; `own` is the set's fit with the noise
    /// model of its own residual. In a simulated loop the residual on the measured inputs must not be noise either: a linearised plant takes
    /// out the noise that controllers feed back, and of a nonlinear plant a part remains. For a model that needs its loop it is the residual
    /// with the gain that suits this set.
    pub fn not_noise(&self, node: &Node, own: &Fit) -> Result<Option<NotNoise>, Error> {
        let found = self.property_unlike_noise(node, own)?;
        if found.is_none() {
            return Ok(None);
        }
        let other = match self.needs_loop() {
            true => self.following_anew(node)?,
            false => self.on_measured_inputs(),
        };
        if let Some(other) = other {
            let own = other.in_own_noise(node)?;
            if other.property_unlike_noise(node, &own)?.is_none() {
                return Ok(None);
            }
        }
        Ok(found)
    }

    /// The first property of a residual that noise does not have, on the inputs of this search.
    fn property_unlike_noise(&self, node: &Node, own: &Fit) -> Result<Option<NotNoise>, Error> {
        let setup = self.setup(&node.model)?;
        let Some(residuals) = estimation::residuals(&setup, &own.x) else {
            return Ok(None);
        };
        let Some(models) = setup.simulate(&own.x) else {
            return Ok(None);
        };
        let records = &self.problem.records;
        let outputs = records[0].outputs.len();
        let name = |i: usize| records[0].outputs[i % outputs].name.clone();
        let samples = |residual: &[f64]| residual.iter().filter(|e| !e.is_nan()).count();
        let dependence = InputDependence::of(&setup, &residuals, &self.thresholds);
        if let Some(of) = dependence.filter(|of| of.p < self.thresholds.not_noise) {
            return Ok(Some(NotNoise::Input {
                input: of.input,
                output: name(of.residual),
            }));
        }
        if let Some((period, i)) = self.harmonics(node, (&setup, own), &residuals) {
            return Ok(Some(NotNoise::Period {
                output: name(i),
                period: period * self.problem.time_unit,
            }));
        }
        let level = self.thresholds.not_noise / residuals.len() as f64;
        for (i, residual) in residuals.iter().enumerate() {
            if samples(residual) < 8 {
                continue;
            }
            let record = &records[i / outputs];
            if samples(residual) == residual.len()
                && let Some(cycles) = period(residual, level)?
            {
                return Ok(Some(NotNoise::Period {
                    output: name(i),
                    period: record.duration() / cycles as f64,
                }));
            }
            if let Some(largest) = self.largest_rounding_error(node, i % outputs) {
                // The other tests take the scatter as constant.
                if let Some(row) = residual.iter().position(|e| e.abs() > largest) {
                    return Ok(Some(NotNoise::Instant {
                        output: name(i),
                        record: record.name.clone(),
                        from: record.time[row],
                        to: record.time[row],
                    }));
                }
                continue;
            }
            let noise = own.noise.of_series(i);
            let white = standardised(noise, residual);
            if let Some((from, to)) = instant(&white, level) {
                return Ok(Some(NotNoise::Instant {
                    output: name(i),
                    record: record.name.clone(),
                    from: record.time[from],
                    to: record.time[to],
                }));
            }
            let interrupted = || self.limit.passed();
            if let Some(window) = concentrated(noise, residual, &white, interrupted) {
                return Ok(Some(NotNoise::Disturbance {
                    output: name(i),
                    record: record.name.clone(),
                    from: record.time[window.start],
                    to: record.time[window.end],
                }));
            }
            if level_p(&models[i], &white) < level {
                return Ok(Some(NotNoise::Level { output: name(i) }));
            }
            if stationary_p(noise, residual, &self.thresholds) < level {
                return Ok(Some(NotNoise::Spectrum {
                    output: name(i),
                    record: record.name.clone(),
                }));
            }
        }
        if let Some(function) = self.function(node, own) {
            return Ok(Some(function));
        }
        if let Some(o) = self.slow_output(&own.noise) {
            return Ok(Some(NotNoise::Slow { output: name(o) }));
        }
        let other = residuals
            .iter()
            .position(|residual| first_order_p(residual, own.x.len()) < level);
        Ok(other.map(|i| NotNoise::Correlation { output: name(i) }))
    }

    /// The smooth function that lowers the deviance of a set significantly, with the noise model of the set's own residual: a score test of each
    /// smooth function at each port.
    fn function(&self, node: &Node, own: &Fit) -> Option<NotNoise> {
        let (with_shapes, of) = self.with_shapes();
        let node = Node {
            fit: own.clone(),
            ..node.clone()
        };
        let trials = with_shapes.trials_among(&node, &of, &own.noise);
        let samples = self.samples();
        let scatter = self.scatter(&node);
        let least = trials
            .iter()
            .filter_map(|trial| {
                let candidate = &with_shapes.candidates[trial.candidate];
                let functions = candidate.fitted() as f64;
                let rest = samples - own.parameters as f64 - functions;
                // In a short record the fall is not chi-square distributed: the ratio of the variances has an F distribution.
                let fall = trial.fall.max(0.0) / scatter;
                let ratio = (fall / samples).exp_m1() * rest / functions;
                let p = FisherSnedecor::new(functions, rest).ok()?.sf(ratio);
                Some((p, candidate))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (p, candidate) = least?;
        (p * (of.len() as f64) < self.thresholds.function_chance).then(|| NotNoise::Function {
            effect: candidate.id.clone(),
            variable: self.variable_of(candidate).0,
        })
    }

    /// Half the period of a periodic effect of the set, if a residual contains its harmonics \[unit of the model's time\], and the number of the
    /// residual.
    fn harmonics(
        &self,
        node: &Node,
        (setup, own): (&ModelSetup, &Fit),
        residuals: &[Vec<f64>],
    ) -> Option<(f64, usize)> {
        let outputs = self.problem.records[0].outputs.len();
        let parameters = node
            .added
            .iter()
            .flat_map(|&i| &self.candidates[i].parameters);
        let named = parameters.filter(|parameter| parameter.short == "period");
        let periods: Vec<f64> = named
            .filter_map(|parameter| {
                let position = setup
                    .names()
                    .iter()
                    .position(|name| *name == parameter.name)?;
                Some(own.x[position])
            })
            .collect();
        let level = self.thresholds.not_noise / (residuals.len() * periods.len().max(1)) as f64;
        for period in periods {
            for (i, residual) in residuals.iter().enumerate() {
                let time = setup.model_time(i / outputs);
                let p = harmonics_p(&time, residual, period, self.thresholds.noise_order);
                if p.is_ok_and(|p| p < level) {
                    return Some((0.5 * period, i));
                }
            }
        }
        None
    }
}
