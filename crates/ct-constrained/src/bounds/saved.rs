//! Bounds as a record; JSON has no number for those that are infinite.

use nalgebra::SVector;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Bounds, Keep};

#[derive(Serialize, Deserialize)]
#[serde(rename = "Bounds")]
struct Saved<const P: usize> {
    lower: SVector<Option<f64>, P>,
    upper: SVector<Option<f64>, P>,
    keep: Keep,
}

impl<const P: usize> Serialize for Bounds<P> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let finite = |bound: f64| bound.is_finite().then_some(bound);
        Saved {
            lower: self.lower.map(finite),
            upper: self.upper.map(finite),
            keep: self.keep,
        }
        .serialize(serializer)
    }
}

impl<'de, const P: usize> Deserialize<'de> for Bounds<P> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let saved = Saved::<P>::deserialize(deserializer)?;
        let lower = saved.lower.map(|bound| bound.unwrap_or(f64::NEG_INFINITY));
        let upper = saved.upper.map(|bound| bound.unwrap_or(f64::INFINITY));
        Self::new(lower.into(), upper.into())
            .and_then(|bounds| bounds.kept_by(saved.keep))
            .map_err(D::Error::custom)
    }
}
