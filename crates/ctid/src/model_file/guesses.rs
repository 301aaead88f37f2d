//! First guesses and priors of parameters.

use std::collections::BTreeMap;

use ct_signals::quoted;
use greybox::PriorValue;
use plants::Structure;
use toml::Spanned;

use super::{
    ModelFile,
    effects::any_scales,
    raw::{Number, RawPrior},
    source::Source,
};
use crate::{Error, names};

impl Source<'_> {
    pub(super) fn start(
        &self,
        model: &mut ModelFile,
        raw: &BTreeMap<Spanned<String>, Spanned<Number>>,
    ) -> Result<(), Error> {
        let structure = model.structure(any_scales(model.columns.inputs.len() > 1))?;
        for (name, number) in raw {
            let value = self.parameter("start", &structure, name, number)?;
            model.start.insert(name.as_ref().clone(), value);
        }
        Ok(())
    }

    /// The side measurements; a fit begins at them unless there is another guess.
    pub(super) fn priors(
        &self,
        model: &mut ModelFile,
        raw: &BTreeMap<Spanned<String>, Spanned<RawPrior>>,
    ) -> Result<(), Error> {
        let structure = model.structure(any_scales(model.columns.inputs.len() > 1))?;
        for (name, prior) in raw {
            let RawPrior::ValueAndError([value, std_error]) = *prior.as_ref();
            let value = Spanned::new(prior.span(), value);
            let std_error = Spanned::new(prior.span(), std_error);
            if let Some(effect) = waits(&structure, name.as_ref()) {
                self.finite(name.as_ref(), &value)?;
                self.positive("the standard error", &std_error)?;
                model.waiting.push(format!("prior.{effect}"));
                continue;
            }
            let value = self.parameter("prior", &structure, name, &value)?;
            let key = name.as_ref();
            let std_error = self.positive(&format!("the standard error of {key}"), &std_error)?;
            if model.fixed.contains(key) {
                let what = format!("{key} has a prior and is fixed; keep one of the two");
                return Err(self.at(name.span().start, what));
            }
            model.start.entry(key.clone()).or_insert(value);
            model
                .priors
                .insert(key.clone(), PriorValue { value, std_error });
        }
        Ok(())
    }

    /// A value of a parameter of the model, from this table.
    fn parameter(
        &self,
        table: &str,
        structure: &Structure,
        name: &Spanned<String>,
        number: &Spanned<Number>,
    ) -> Result<f64, Error> {
        let names = structure.parameter_names();
        let key = name.as_ref();
        let Some(index) = names.iter().position(|known| known == key) else {
            return Err(self.at(
                name.span().start,
                format!(
                    "[{table}] has {}, which is not a parameter of this model; it has {}{}",
                    quoted(key),
                    names.join(", "),
                    names::suggestion(key, names.iter().map(String::as_str))
                ),
            ));
        };
        // Gains, outflow coefficients and time constants of the plant are positive for any data; the bounds of an effect follow from the
        // data.
        if structure.parameters()[index].lower > 0.0 && !key.contains('.') {
            self.positive(key, number)
        } else {
            self.finite(key, number)
        }
    }
}

/// The effect of a name such as `overflow.rim` that is not in the model.
fn waits<'n>(structure: &Structure, name: &'n str) -> Option<&'n str> {
    let (effect, _) = name.split_once('.')?;
    let own = format!("{effect}.");
    let on = structure
        .parameter_names()
        .iter()
        .any(|n| n.starts_with(&own));
    (!on && plants::EffectInfo::find(effect).is_some()).then_some(effect)
}
