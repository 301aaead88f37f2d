//! Saving and restoring the state of an estimator: the next updates give bit-identical results.
//!
//! Constraint rows are settings and are not saved: the types that can be saved have none. Default bounds follow from the
//! shortest step so far.

use ct_constrained::Bounds;
use nalgebra::SVector;
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Bounded, StabilizedOe};
use crate::hurwitz::is_hurwitz;
use crate::model::{Held, Model};
use crate::{Derivatives, Error, Gain};

/// What is written.
#[derive(Serialize, Deserialize)]
#[serde(rename = "StabilizedOe")]
struct Saved<const N: usize, const P: usize, G, D> {
    gain: G,
    derivatives: D,
    /// `y_m` to `y_m^(n-1)`.
    model: SVector<f64, N>,
    /// What the step under way began with: `theta^`, inputs, length in s; `None` before the first.
    held: Option<(SVector<f64, P>, SVector<f64, P>, f64)>,
    theta: SVector<f64, P>,
    theta_bounds: Option<Bounds<P>>,
    /// `None` before the first step.
    shortest: Option<f64>,
    slower: f64,
    filter_bounds: Bounds<N>,
    offset: bool,
    /// Of a run that has stopped as the model's output left the range of numbers: what was reached, `None` of NaN or infinity, and the step.
    diverged: Option<(Option<f64>, f64)>,
    bounded: Bounded,
}

impl<const N: usize, const P: usize, G, D> Serialize for StabilizedOe<N, P, G, D>
where
    G: Clone + Serialize,
    D: Clone + Serialize,
{
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let diverged = match &self.failure {
            None => None,
            Some(Error::ModelDiverged { value, dt }) => {
                Some((value.is_finite().then_some(*value), *dt))
            }
            Some(other) => {
                return Err(S::Error::custom(format_args!(
                    "the estimator has stopped, and is not saved: {other}"
                )));
            }
        };
        let held = self.model.held.as_ref();
        Saved {
            gain: self.gain.clone(),
            derivatives: self.derivatives.clone(),
            model: self.model.state.into(),
            held: held.map(|held| (held.theta.into(), held.inputs.into(), held.dt)),
            theta: self.theta,
            theta_bounds: self.theta_bounds,
            shortest: self.shortest.is_finite().then_some(self.shortest),
            slower: self.slower,
            filter_bounds: self.filter_bounds,
            offset: self.offset,
            diverged,
            bounded: self.bounded,
        }
        .serialize(serializer)
    }
}

impl<'de, const N: usize, const P: usize, G, D> Deserialize<'de> for StabilizedOe<N, P, G, D>
where
    G: Gain<N, P> + Deserialize<'de>,
    D: Derivatives<N> + Deserialize<'de>,
{
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        let saved = Saved::<N, P, G, D>::deserialize(deserializer)?;
        let nothing = (SVector::zeros(), SVector::zeros(), 0.0);
        let (theta, inputs, dt) = saved.held.unwrap_or(nothing);
        let numbers = saved.model.iter().chain(&theta).chain(&inputs);
        let mut numbers = numbers.chain(&saved.theta).chain([&dt, &saved.slower]);
        if !numbers.all(|number| number.is_finite()) {
            return Err(De::Error::custom(
                "the model has an entry that is not finite",
            ));
        }
        let steps = [saved.shortest, saved.held.map(|_| dt)];
        if steps
            .into_iter()
            .flatten()
            .any(|step| step.is_nan() || step <= 0.0)
        {
            return Err(De::Error::custom("a step is not above 0"));
        }
        if !is_hurwitz::<N>(saved.theta.as_slice()) {
            return Err(De::Error::custom("the model is not stable"));
        }
        if saved.offset && P <= N + 1 {
            return Err(De::Error::custom("there is no parameter for an offset"));
        }
        let fresh = Self::new(saved.gain, saved.derivatives).map_err(De::Error::custom)?;
        let diverged = saved.diverged.map(|(value, dt)| Error::ModelDiverged {
            value: value.unwrap_or(f64::NAN),
            dt,
        });
        Ok(Self {
            model: Model {
                state: saved.model.into(),
                held: saved.held.map(|_| Held {
                    theta: theta.into(),
                    inputs: inputs.into(),
                    dt,
                }),
            },
            theta: saved.theta,
            theta_bounds: saved.theta_bounds,
            shortest: saved.shortest.unwrap_or(f64::INFINITY),
            slower: saved.slower,
            filter_bounds: saved.filter_bounds,
            offset: saved.offset,
            failure: diverged,
            bounded: saved.bounded,
            ..fresh
        })
    }
}
