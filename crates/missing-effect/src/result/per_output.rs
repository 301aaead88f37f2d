//! A number for each output.

use ct_signals::Channel;
use serde::{Deserialize, Deserializer, Serialize};

/// A number for each output, by its name, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PerOutput(pub Vec<(String, f64)>);
impl PerOutput {
    /// Values in the order of the outputs.
    pub(crate) fn of(outputs: &[Channel], values: &[f64]) -> Self {
        let names = outputs.iter().map(|output| output.name.clone());
        Self(names.zip(values.iter().copied()).collect())
    }

    /// The numbers in order.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|(_, value)| *value)
    }
}

impl Serialize for PerOutput {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de> Deserialize<'de> for PerOutput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(InOrder)
    }
}

/// Reads a [`PerOutput`] in the order in which it was written.
struct InOrder;
impl<'de> serde::de::Visitor<'de> for InOrder {
    type Value = PerOutput;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a number for each output, by its name")
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<PerOutput, A::Error> {
        let mut all = Vec::new();
        while let Some((name, value)) = map.next_entry::<String, Option<f64>>()? {
            all.push((name, value.unwrap_or(f64::NAN)));
        }
        Ok(PerOutput(all))
    }
}
