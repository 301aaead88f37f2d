//! Visibility and minimum detectable size of the single effects.
//!
//! The signature of an effect is the derivative of the outputs with respect to its leading size, at the absent value: other sizes are
//! absent too, and shape parameters have their fitted values. It is whitened by the noise model of the last model's residual. The part that
//! the believed parameters and initial states do not compensate for gives the minimum detectable size ([`estimation::Signature`]).
//!
//! **Cost**: a simulation with the derivatives by the effect's own entries, for each effect that was fitted.

use ct_model::effects::{Candidate, EffectParameter, Role};
use estimation::{Noise, Rows, Signature, linearise};
use rayon::prelude::*;

use crate::Error;
use crate::fit::joined::Joined;
use crate::fit::node::{Context, Node};
use crate::search::ties::DEPENDENT;

/// The leading size of a candidate with a derivative at its absent value.
pub(crate) fn leading(candidate: &Candidate) -> Option<&EffectParameter> {
    let mut parameters = candidate.parameters.iter();
    let size = parameters.find(|own| own.role == Role::Size);
    size.filter(|_| candidate.is_smooth())
}

/// Visibility and minimum detectable size \[unit of the leading size\] of an effect.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Detectable {
    /// `None` without a derivative at the absent value.
    pub visibility: Option<f64>,
    /// `None` also if the believed parameters compensate for the effect.
    pub smallest: Option<f64>,
}

impl Context<'_> {
    /// For each single effect beside the believed model. `noise`: that of the last model's residual.
    pub fn detectable(&self, base: &Node, singles: &[Node], noise: &Noise) -> Vec<Detectable> {
        let setup = self.setup(&base.model).ok();
        let Some(known) = setup.and_then(|setup| estimation::rows(&setup, &base.fit.x)) else {
            return vec![Detectable::default(); singles.len()];
        };
        let each = singles.par_iter().map(|single| {
            let signature = self.signature(base, &known, single, noise).ok().flatten();
            Detectable {
                visibility: signature.map(Signature::visibility),
                smallest: signature.and_then(|one| one.smallest_detectable(DEPENDENT)),
            }
        });
        each.collect()
    }

    /// Signature of a single effect; `None` without a derivative at its absent value, or if its leading size is not fitted.
    fn signature(
        &self,
        base: &Node,
        known: &Rows,
        single: &Node,
        noise: &Noise,
    ) -> Result<Option<Signature>, Error> {
        let candidate = single.added.last().map(|&i| &self.candidates[i]);
        let Some((candidate, size)) = candidate.and_then(|one| Some((one, leading(one)?))) else {
            return Ok(None);
        };
        let scales = noise.sigmas();
        let sigma = scales[0];
        // Outputs are weighted by their noise, not by residuals that may contain the effect.
        let setup = self.setup(&single.model)?.with_scales(scales);
        let mut x = self.transfer(base, &single.model, &single.fit.x);
        let mut leading = None;
        for (at, parameter) in single.spec().parameters.iter().enumerate() {
            let mut sizes = candidate.parameters.iter();
            let own = sizes.find(|own| own.name == parameter.about.name);
            if let Some(own) = own.filter(|own| own.role == Role::Size) {
                x[at] = own.absent;
                if own.name == size.name {
                    leading = setup.free().iter().position(|&free| free == at);
                }
            }
        }
        let columns = self.columns_beside(base, &self.setup(&base.model)?, &setup);
        let triangle = Joined::at(&setup, known, &columns, &x)
            .and_then(|joined| linearise(&joined, &x, noise));
        Ok(leading
            .zip(triangle)
            .map(|(column, triangle)| triangle.signature(column, &columns.known(), sigma)))
    }
}
