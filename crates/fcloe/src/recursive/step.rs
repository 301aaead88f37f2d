//! One step of the recursion: the update and its limits.

use ct_rls::RecursiveEstimator;
use ct_rls::{Innovation, Outcome, Weights};

use super::{Filter, HALVINGS, RecursiveFcloe, SMALL};

impl RecursiveFcloe {
    /// One Gauss-Newton step from the output error.
    pub(super) fn learn(&mut self, drive: f64, epsilon: f64, dt: f64) -> Innovation {
        let unused = |outcome| Innovation {
            epsilon,
            s: f64::NAN,
            outcome,
        };
        self.model.sensitivities(drive, &self.scale, &mut self.s);
        let l = self.forgetting_factor(dt);
        let eta = -l.ln() / dt;
        // eta/(1 - l), or 1/dt without forgetting.
        let c = if 1.0 - l > 1e-12 {
            eta / (1.0 - l)
        } else {
            1.0 / dt
        };
        let Ok(weights) = Weights::new(c, c, if 1.0 - l > 1e-12 { eta } else { 0.0 }) else {
            return unused(Outcome::BadStep);
        };
        let known: f64 = self.s.iter().zip(&self.delta).map(|(s, d)| s * d).sum();
        let innovation = self.rls.update_with(&self.s, epsilon + known, dt, &weights);
        let innovation = Innovation {
            epsilon,
            ..innovation
        };
        if !innovation.outcome.used() {
            return innovation;
        }
        let (sum, weight) = self.variance;
        self.variance = (l * sum + epsilon * epsilon, l * weight + 1.0);
        self.take_step();
        innovation
    }

    /// Step from `delta` towards the least-squares estimate, within the limits.
    fn take_step(&mut self) {
        let mut share = 1.0_f64;
        for ((step, new), old) in self
            .step
            .iter_mut()
            .zip(self.rls.theta().iter())
            .zip(&self.delta)
        {
            *step = new - old;
            let most = self.settings.step_limit * old.abs().max(SMALL);
            if step.abs() > most {
                share = share.min(most / step.abs());
            }
        }
        self.limited += u64::from(share < 1.0);
        let mut moved = false;
        for halving in 0..=HALVINGS {
            for (i, tried) in self.tried.iter_mut().enumerate() {
                *tried = self.scale[i] * (self.delta[i] + share * self.step[i]);
            }
            if self.allowed() {
                self.shortened += u64::from(halving > 0);
                moved = true;
                break;
            }
            share *= 0.5;
        }
        if moved {
            for (delta, step) in self.delta.iter_mut().zip(&self.step) {
                *delta += share * step;
            }
            self.theta.copy_from_slice(&self.tried);
            self.model
                .set(&self.theta, self.settings.filter == Filter::Adaptive);
        } else {
            self.refused += 1;
        }
        // The part of the update beyond the limits is dropped; the lengths agree, and the numbers are finite.
        let kept = self.rls.set_theta(&self.delta);
        debug_assert!(kept.is_ok());
    }

    /// Whether `tried` is an acceptable estimate. Updates `p`.
    fn allowed(&mut self) -> bool {
        let range = self.settings.range;
        let inside = self
            .tried
            .iter()
            .zip(&self.scale)
            .all(|(t, s)| t.abs() <= range * s);
        let (leading, scale) = (self.tried[self.orders.n - 1], self.scale[self.orders.n - 1]);
        let same_sign = leading * self.theta[self.orders.n - 1] > 0.0;
        if !inside || !same_sign || leading.abs() < scale / range {
            return false;
        }
        self.model.characteristic_at(&self.tried, &mut self.p);
        // P^(p - rate).
        let last = self.p.len() - 1;
        for from in 0..last {
            for i in (from..last).rev() {
                self.p[i] -= self.rate * self.p[i + 1];
            }
        }
        self.p[last] != 0.0 && ct_lti::is_hurwitz(&self.p)
    }
}
