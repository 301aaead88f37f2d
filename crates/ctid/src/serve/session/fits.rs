//! Fits of a session, and which of them belong together.

use axum::body::Bytes;
use missing_effect::PerOutput;
use std::sync::Arc;

use super::{MOST_MODELS, Session};
use crate::model_file::ModelFile;

/// A model that was fitted to the records, ready to be drawn.
#[derive(Debug)]
pub(crate) struct Fitted {
    pub id: u64,
    pub model: ModelFile,
    /// Version of the records that were fitted.
    pub data: u64,
    /// Whether the fit uses the measured command although the loop could be simulated.
    pub measured: bool,
    /// Simulation error of each output, on the fitted and on the held-out records.
    pub errors: PerOutput,
    pub errors_test: Option<PerOutput>,
    pub bic: f64,
    /// Whether the residual looks like noise.
    pub adequate: bool,
    /// JSON for the page.
    pub body: Bytes,
}

impl Session {
    /// Stores a fitted model; drops the oldest one if there are too many.
    pub(crate) fn keep(&mut self, fitted: Fitted) {
        let again =
            |other: &Fitted| other.model == fitted.model && other.measured == fitted.measured;
        self.models.retain(|other| !again(other));
        self.models.push_back(Arc::new(fitted));
        if self.models.len() > MOST_MODELS {
            self.models.pop_front();
        }
    }

    /// The fit of this model to these records.
    pub(crate) fn fit_of(&self, model: &ModelFile) -> Option<&Arc<Fitted>> {
        let of = |fitted: &&Arc<Fitted>| self.is_comparable(fitted) && same(&fitted.model, model);
        self.models.iter().find(of)
    }

    fn is_comparable(&self, fitted: &Fitted) -> bool {
        fitted.data == self.data && fitted.measured == self.measured
    }

    /// The fits to these records of models that differ from this one in their effects and terms only.
    pub(crate) fn kin(&self, model: &ModelFile) -> Vec<&Arc<Fitted>> {
        let bare = without_effects(model);
        let kin = |fitted: &&Arc<Fitted>| {
            self.is_comparable(fitted) && without_effects(&fitted.model) == bare
        };
        self.models.iter().filter(kin).collect()
    }

    /// The fits of the model with its first effects, from none to all, and then with its first terms, as far as they exist.
    pub(crate) fn trail(&self, model: &ModelFile) -> Vec<&Arc<Fitted>> {
        let kin = self.kin(model);
        let (effects, terms) = (model.effects.as_slice(), model.terms.as_slice());
        let first_effects = (0..=effects.len()).map(|count| (&effects[..count], &terms[..0]));
        let first_terms = (1..=terms.len()).map(|count| (effects, &terms[..count]));
        first_effects
            .chain(first_terms)
            .filter_map(|(effects, terms)| {
                let of = |fitted: &&&Arc<Fitted>| {
                    fitted.model.effects == effects && fitted.model.terms == terms
                };
                kin.iter().find(of).copied()
            })
            .collect()
    }
}

/// Whether two files have the same fitted content.
pub(crate) fn same(a: &ModelFile, b: &ModelFile) -> bool {
    let bare = |model: &ModelFile| ModelFile {
        waiting: Vec::new(),
        ..model.clone()
    };
    bare(a) == bare(b)
}

/// The model without its effects and terms, and without the settings of their parameters.
pub(super) fn without_effects(model: &ModelFile) -> ModelFile {
    let mut bare = model.clone();
    let effects = model.effects.iter().map(|placed| placed.effect.id);
    let terms = model.terms.iter().map(|own| own.term.name.as_str());
    for name in effects.chain(terms) {
        let own = format!("{name}.");
        bare.start.retain(|name, _| !name.starts_with(&own));
        bare.fixed.retain(|name| !name.starts_with(&own));
        bare.priors.retain(|name, _| !name.starts_with(&own));
    }
    bare.effects.clear();
    bare.terms.clear();
    bare.waiting.clear();
    bare
}
