//! Single effects of a diagnosis of a user's own model, and their minimum detectable sizes.

use effect_search::{Diagnosis, Single};

use super::words::shown_unit;
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::sentences::with_unit;

/// Single effects that are listed.
const LISTED: usize = 8;
/// Effects whose minimum detectable size a sentence names.
const SHOWN: usize = 4;

/// Minimum detectable size of an effect, with the unit of its leading size.
fn detectable(single: &Single) -> Option<String> {
    let smallest = numbers::significant(single.smallest_visible?, 2);
    let unit = single.sizes.first().map_or("", |size| size.unit.as_str());
    Some(with_unit(&smallest, shown_unit(unit)))
}

/// Single effects whose falls of the criterion differ by less than this are one effect under several names.
const SAME_FALL: f64 = 0.01;

/// The minimum detectable sizes of the most likely effects.
pub(super) fn would_have_shown(diagnosis: &Diagnosis) -> Option<String> {
    let mut singles: Vec<&Single> = diagnosis.singles.iter().collect();
    singles.dedup_by(|next, kept| (next.bic_gain - kept.bic_gain).abs() < SAME_FALL);
    let sizes = singles.into_iter().filter_map(|single| {
        let size = detectable(single)?;
        Some(format!("{} of {size}", single.effect))
    });
    let sizes: Vec<String> = sizes.take(SHOWN).collect();
    (!sizes.is_empty()).then(|| {
        format!(
            "A test of one effect alone would have shown {} in nine of ten such records; a search among all candidates needs more.",
            sizes.join(", ")
        )
    })
}

/// The single effects, best first.
pub(super) fn table(diagnosis: &Diagnosis, look: Look) -> String {
    let mut text = format!(
        "{}\n",
        look.heading(&format!(
            "The best single effects of {} candidates, refitted",
            diagnosis.candidates
        ))
    );
    let head = ["effect", "fall of BIC", "detectable"];
    let mut rows = vec![head.map(str::to_string).to_vec()];
    for single in diagnosis.singles.iter().take(LISTED) {
        rows.push(vec![
            single.effect.clone(),
            numbers::significant(single.bic_gain, 3),
            detectable(single).unwrap_or_default(),
        ]);
    }
    text += &table_text(&[Side::Left, Side::Right, Side::Left], &rows);
    text.push('\n');
    text
}
