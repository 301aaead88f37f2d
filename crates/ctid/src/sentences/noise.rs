//! Where a noise floor comes from.

use missing_effect::{NoiseFloor, NoiseSource};

/// The residual that a noise floor was estimated from.
#[must_use]
pub fn of_noise_source(floor: &NoiseFloor) -> String {
    let residual = match floor.source {
        NoiseSource::BelievedModel => "the residual of the believed model",
        NoiseSource::FinalModel => "the residual of the final model",
        NoiseSource::RichestModel => "the residual of the richest model that was tried",
        NoiseSource::LastModel => "the residual of the last model",
        NoiseSource::OnlyModel => "the residual",
    };
    if floor.of_innovation {
        format!("innovation of {residual}: the part that its past does not predict")
    } else {
        residual.to_owned()
    }
}
