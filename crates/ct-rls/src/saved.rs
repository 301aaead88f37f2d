//! Saving and restoring the state of an estimator: the next updates give bit-identical results.
//!
//! `theta`, the factors of `P`, the settings, and what the guards have counted are written, alike for [`ContinuousRls`] and `DynamicRls`,
//! so that each reads what the other has saved. `P` is written as `U` and `D`: it is symmetric whatever is read. What is read is checked
//! like what a constructor is given: sizes, numbers that are not finite, pivots that are not above 0.

use core::fmt::{Formatter, Result as Written};
use core::marker::PhantomData;

use nalgebra::SMatrix;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::guard::{Counts, Guard};
use crate::integrator::sealed::{Capped, Covariance, Memory};
use crate::random_walk::check_intensity;
use crate::rls::check_theta;
use crate::settings::MAX_TRACE;
use crate::{ContinuousRls, Error, FactoredIntegrator, Guards, UdFactor, Weights};

/// A `bound` of the guards may be below the trace by as much, relative to it, by rounding.
const ROUNDING: f64 = 1e-6;

/// The saved fields, in vectors of any type.
#[derive(Serialize, Deserialize)]
#[serde(rename = "Rls")]
#[serde(bound(
    serialize = "V: Serialize, U: Serialize, I: FactoredIntegrator",
    deserialize = "V: Deserialize<'de>, U: Deserialize<'de>, I: FactoredIntegrator"
))]
struct Saved<V, U, I> {
    integrator: Name<I>,
    theta: V,
    /// Above the diagonal, by columns.
    u: U,
    d: V,
    /// Intensity of the random walk; `None` for an integrator without one.
    intensity: Option<V>,
    weights: Weights,
    guards: Guards,
    trace_bound: f64,
    counts: Counts,
}

/// The name of an integrator, which has to be that of the estimator that is restored.
struct Name<I>(PhantomData<I>);

impl<I: FactoredIntegrator> Serialize for Name<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(I::NAME)
    }
}

impl<'de, I: FactoredIntegrator> Deserialize<'de> for Name<I> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(Self(PhantomData))
    }
}

impl<I: FactoredIntegrator> Visitor<'_> for Name<I> {
    type Value = Self;

    fn expecting(&self, f: &mut Formatter) -> Written {
        write!(f, "an estimator saved with the integrator {}", I::NAME)
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Self, E> {
        if name == I::NAME {
            Ok(self)
        } else {
            Err(E::invalid_value(serde::de::Unexpected::Str(name), &self))
        }
    }
}

/// An array of `N` numbers.
struct Entries<const N: usize>([f64; N]);

/// The part of a matrix above its diagonal, by columns.
struct Above<const N: usize>([[f64; N]; N]);

impl<const N: usize> Serialize for Entries<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&self.0)
    }
}

impl<const N: usize> Serialize for Above<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeSeq;
        let mut entries = serializer.serialize_seq(Some(N * N.saturating_sub(1) / 2))?;
        for (j, column) in self.0.iter().enumerate() {
            for entry in &column[..j] {
                entries.serialize_element(entry)?;
            }
        }
        entries.end()
    }
}

/// Reads exactly as many numbers as the array has entries.
fn fill<'de, A: SeqAccess<'de>>(
    mut from: A,
    places: &mut dyn Iterator<Item = &mut f64>,
    expecting: &dyn serde::de::Expected,
) -> Result<(), A::Error> {
    let mut read = 0;
    for place in places {
        *place = from
            .next_element()?
            .ok_or_else(|| A::Error::invalid_length(read, expecting))?;
        read += 1;
    }
    match from.next_element::<f64>()? {
        Some(_) => Err(A::Error::invalid_length(read + 1, expecting)),
        None => Ok(()),
    }
}

struct Places<T>(PhantomData<T>);

impl<'de, const N: usize> Visitor<'de> for Places<Entries<N>> {
    type Value = Entries<N>;

    fn expecting(&self, f: &mut Formatter) -> Written {
        write!(f, "{N} numbers, one for each parameter")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, from: A) -> Result<Entries<N>, A::Error> {
        let mut entries = [0.0; N];
        fill(from, &mut entries.iter_mut(), &self)?;
        Ok(Entries(entries))
    }
}

impl<'de, const N: usize> Visitor<'de> for Places<Above<N>> {
    type Value = Above<N>;

    fn expecting(&self, f: &mut Formatter) -> Written {
        let entries = N * N.saturating_sub(1) / 2;
        write!(f, "{entries} numbers, the entries above the diagonal of U")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, from: A) -> Result<Above<N>, A::Error> {
        let mut entries = [[0.0; N]; N];
        let columns = entries.iter_mut().enumerate();
        let mut places = columns.flat_map(|(j, column)| &mut column[..j]);
        fill(from, &mut places, &self)?;
        Ok(Above(entries))
    }
}

impl<'de, const N: usize> Deserialize<'de> for Entries<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Places::<Self>(PhantomData))
    }
}

impl<'de, const N: usize> Deserialize<'de> for Above<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Places::<Self>(PhantomData))
    }
}

/// Whether these numbers are those of an estimator; `above`: the entries of `U` above its diagonal.
fn check<'a, I: FactoredIntegrator>(
    theta: &[f64],
    above: impl IntoIterator<Item = &'a f64>,
    d: &[f64],
    intensity: Option<&[f64]>,
) -> Result<(), &'static str> {
    check_theta(theta).map_err(|_| "theta has an entry that is not finite")?;
    if !above.into_iter().all(|x| x.is_finite()) {
        return Err("U has an entry that is not finite");
    }
    if !d.iter().all(|d| *d > 0.0 && d.is_finite()) {
        return Err(
            "P is not positive definite: D has an entry that is not a finite number above 0",
        );
    }
    match intensity {
        Some(_) if !I::WALKS => Err("an intensity is given, but the integrator has no random walk"),
        Some(q) => check_intensity(q).map_err(|_| "the intensity has an entry outside 0..=1e60"),
        None => Ok(()),
    }
}

/// The guards as they were saved, about a `P` with this trace.
fn restored_guard<M: Memory>(
    guards: Guards,
    (trace, parameters): (f64, usize),
    bound: f64,
    counts: Counts,
) -> Result<Guard, &'static str> {
    // The cap is one on the trace, or with directional forgetting one on each eigenvalue.
    let most = MAX_TRACE * parameters.max(1) as f64 * (1.0 + ROUNDING);
    if trace.is_nan() || trace > most {
        return Err("the trace of P is above 1e100");
    }
    if !(bound >= 0.0 && bound.is_finite()) {
        return Err("trace_bound is not a finite number of at least 0");
    }
    if M::RAISES && bound < trace * (1.0 - ROUNDING) {
        return Err("trace_bound is below the trace of P");
    }
    Guard::restored(guards, bound, counts).map_err(|_| "a guard's setting is outside its range")
}

impl<const P: usize, I: FactoredIntegrator> Serialize for ContinuousRls<P, I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let factor = self.factor();
        let mut intensity = [0.0; P];
        for (entry, q) in intensity.iter_mut().zip(self.state.intensity()) {
            *entry = *q;
        }
        let (trace_bound, counts) = self.guard.saved();
        Saved {
            integrator: Name::<I>(PhantomData),
            theta: Entries(self.theta.into()),
            u: Above(factor.u),
            d: Entries(factor.d),
            intensity: I::WALKS.then_some(Entries(intensity)),
            weights: self.weights,
            guards: self.guard.guards,
            trace_bound,
            counts,
        }
        .serialize(serializer)
    }
}

impl<'de, const P: usize, I: FactoredIntegrator> Deserialize<'de> for ContinuousRls<P, I> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved = Saved::<Entries<P>, Above<P>, I>::deserialize(deserializer)?;
        let (theta, u, d) = (saved.theta.0, saved.u.0, saved.d.0);
        let intensity = saved.intensity.map(|q| q.0);
        let q = intensity.as_ref().map(|q| q.as_slice());
        check::<I>(&theta, u.as_flattened(), &d, q).map_err(D::Error::custom)?;
        let refused = |_: Error| D::Error::custom("P is not positive definite");
        let mut state = I::State::<P>::from_matrix(&SMatrix::identity()).map_err(refused)?;
        *I::factor_mut(&mut state) = UdFactor { u, d };
        if let Some(q) = q {
            state.set_intensity(q);
        }
        let size = (state.trace(), P);
        let guard = restored_guard::<I>(saved.guards, size, saved.trace_bound, saved.counts)
            .map_err(D::Error::custom)?;
        Ok(Self {
            theta: theta.into(),
            state,
            weights: saved.weights,
            guard,
        })
    }
}

#[cfg(feature = "alloc")]
mod dynamic {
    extern crate alloc;

    use alloc::{vec, vec::Vec};

    use nalgebra::DVector;

    use super::*;
    use crate::dynamic::{DynamicRls, Factors};

    impl<I: FactoredIntegrator> Serialize for DynamicRls<I> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let (n, state) = (self.theta.len(), &self.state);
            let above: Vec<f64> = (0..n)
                .flat_map(|j| &state.u[j * n..j * n + j])
                .copied()
                .collect();
            let intensity = I::WALKS.then(|| match &state.q[..] {
                [] => vec![0.0; n],
                q => q.to_vec(),
            });
            let (trace_bound, counts) = self.guard.saved();
            Saved {
                integrator: Name::<I>(PhantomData),
                theta: self.theta.as_slice().to_vec(),
                u: above,
                d: state.d.clone(),
                intensity,
                weights: self.weights,
                guards: self.guard.guards,
                trace_bound,
                counts,
            }
            .serialize(serializer)
        }
    }

    impl<'de, I: FactoredIntegrator> Deserialize<'de> for DynamicRls<I> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let saved = Saved::<Vec<f64>, Vec<f64>, I>::deserialize(deserializer)?;
            let n = saved.theta.len();
            let triangle = n.saturating_mul(n.saturating_sub(1)) / 2;
            let walk = saved.intensity.as_ref().map_or(n, Vec::len);
            if (saved.d.len(), saved.u.len(), walk) != (n, triangle, n) {
                return Err(D::Error::custom(format_args!(
                    "theta has {n} entries, but d has {}, u {} instead of {triangle}, and the intensity {walk}",
                    saved.d.len(),
                    saved.u.len()
                )));
            }
            check::<I>(&saved.theta, &saved.u, &saved.d, saved.intensity.as_deref())
                .map_err(D::Error::custom)?;
            let mut u = vec![0.0; n * n];
            let mut above = saved.u.into_iter();
            for j in 0..n {
                for (place, entry) in u[j * n..j * n + j].iter_mut().zip(&mut above) {
                    *place = entry;
                }
            }
            let q = saved.intensity.unwrap_or_default();
            let state = Factors { u, d: saved.d, q };
            let size = (state.trace(), n);
            let guard = restored_guard::<I>(saved.guards, size, saved.trace_bound, saved.counts)
                .map_err(D::Error::custom)?;
            Ok(Self {
                theta: DVector::from_vec(saved.theta),
                state,
                scratch: [vec![0.0; n], vec![0.0; n]],
                weights: saved.weights,
                guard,
                integrator: PhantomData,
            })
        }
    }
}
