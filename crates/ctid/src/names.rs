//! The name that was probably meant.

use ct_signals::quoted;
use plants::{CATALOGUE, EffectInfo};

use crate::{Error, generic};

/// `; did you mean X?` if a name of the list is similar, else empty.
pub(crate) fn suggestion<'a>(written: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let written = written.to_lowercase().replace('-', "_");
    names
        .into_iter()
        .map(|name| {
            let plain = name.to_lowercase().replace('-', "_");
            (strsim::damerau_levenshtein(&written, &plain), name)
        })
        .filter(|(edits, name)| 5 * edits <= 2 * name.chars().count().max(3))
        .min_by_key(|(edits, _)| *edits)
        .map(|(_, name)| format!("; did you mean {name}?"))
        .unwrap_or_default()
}

/// The effect of that name.
pub(crate) fn effect(id: &str) -> Result<&'static EffectInfo, Error> {
    EffectInfo::find(id).ok_or_else(|| Error::UnknownEffect(unknown_effect(id)))
}

/// Message for a name that is not in the catalogue.
pub(crate) fn unknown_effect(id: &str) -> String {
    format!(
        "unknown effect \"{}\": `ctid effects` lists the catalogue{}",
        quoted(id),
        suggestion(id, CATALOGUE.iter().map(|effect| effect.id))
    )
}

/// Message for a name that no effect has, neither of tanks nor at the ports of models.
pub(crate) fn unknown_everywhere(written: &str) -> String {
    let name = written.split('(').next().unwrap_or_default();
    let tanks = CATALOGUE.iter().map(|effect| effect.id);
    format!(
        "unknown effect \"{}\": `ctid effects` lists the catalogue{}",
        quoted(written),
        suggestion(name, tanks.chain(generic::names()))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_mended_and_another_word_is_not() {
        let names = ["overflow", "pump_deadzone"];
        assert_eq!(suggestion("overflw", names), "; did you mean overflow?");
        assert_eq!(
            suggestion("Pump-Deadzone", names),
            "; did you mean pump_deadzone?"
        );
        assert_eq!(suggestion("gravity", names), "");
    }
}
