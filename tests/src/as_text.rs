//! The problem of a built-in plant as that of a model as text.

use ct_model::{ModelSpec, TextError};
use effect_search::{Problem, ProblemBuilder};
use greybox::LoopController;

/// The plant's text with the first record, simulated in its loop if the controller is known and else on the measured command; and the model.
///
/// # Errors
/// As [`plants::Plant::spec_of`].
pub fn of_plant(
    kernel: &missing_effect::Problem,
) -> Result<(ModelSpec, ProblemBuilder), TextError> {
    let mut record = kernel.records[0].clone();
    let spec = kernel.plant.spec_of(&kernel.known, &mut record)?;
    let controller = kernel.controller.as_ref().map(|controller| LoopController {
        controller: controller.clone(),
        input: 0,
        reference: (!record.references.is_empty()).then_some(0),
    });
    if controller.is_none() {
        record.references.clear();
    }
    let builder = Problem::builder(spec.clone(), [record]);
    let builder = match controller {
        Some(controller) => builder.controller(controller),
        None => builder,
    };
    Ok((spec, builder))
}
