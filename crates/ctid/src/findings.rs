//! What a diagnosis says of its parts, for the terminal and the page alike.

use missing_effect::{Diagnosis, Score};

/// This effect, in this tank, is one of those that were added.
pub(crate) fn is_added(diagnosis: &Diagnosis, score: &Score) -> bool {
    diagnosis
        .steps
        .iter()
        .any(|step| step.added.as_ref() == Some(&score.effect) && step.place == score.place)
}

/// It was not added, but these data cannot tell it from one that was. A group names no tanks: the added effect in the
/// other tank is none of them.
pub(crate) fn fits_as_well(diagnosis: &Diagnosis, score: &Score) -> bool {
    !diagnosis.effects.contains(&score.effect)
        && diagnosis
            .groups
            .iter()
            .any(|group| group.contains(&score.effect))
}

/// The tank of the added effect of this index, where the plant has two.
pub(crate) fn tank(diagnosis: &Diagnosis, index: usize) -> Option<&str> {
    diagnosis.steps.get(index + 1)?.place.as_deref()
}
