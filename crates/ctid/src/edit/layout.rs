//! Changes of a model file's text that keep its layout: its list of effects, and the place of an effect.

use toml_edit::{Array, DocumentMut, Item, Table, Value, value};

use crate::Error;

/// The text as a document with its layout; `file` is its name in messages.
pub(crate) fn document(file: &str, text: &str) -> Result<DocumentMut, Error> {
    text.parse()
        .map_err(|error: toml_edit::TomlError| Error::File {
            file: file.to_string(),
            what: error.message().replace('\n', "; "),
        })
}

/// Appends to the list in the list's layout; creates the list if there is none.
pub(super) fn push(document: &mut DocumentMut, id: &str) {
    let Some(effects) = document.get_mut("effects").and_then(Item::as_array_mut) else {
        document.insert("effects", value(Array::from_iter([id])));
        return;
    };
    let trailing = effects.trailing().as_str().unwrap_or_default().to_string();
    let multiline = trailing.contains('\n') && !effects.is_empty();
    if !multiline {
        effects.push(id);
        return;
    }
    // One effect per line: a comment after the last effect stays after it.
    let indent = effects
        .iter()
        .last()
        .and_then(|last| last.decor().prefix()?.as_str())
        .and_then(|prefix| prefix.rsplit('\n').next())
        .unwrap_or_default();
    let comma = effects.trailing_comma();
    let newline = trailing.rfind('\n').unwrap_or(0);
    let item = Value::from(id).decorated(format!("{}\n{indent}", &trailing[..newline]), "");
    effects.push_formatted(item);
    effects.set_trailing(&trailing[newline..]);
    effects.set_trailing_comma(comma);
}

/// Removes an effect from the list. Text before an entry may be the comment of the entry above it, so the text is moved to the next entry.
pub(super) fn take_out(effects: &mut Array, id: &str) -> bool {
    let Some(index) = effects.iter().position(|on| on.as_str() == Some(id)) else {
        return false;
    };
    let removed = effects.remove(index);
    let prefix = removed.decor().prefix().and_then(|prefix| prefix.as_str());
    let before = prefix.unwrap_or_default().to_string();
    let joined = |after: &str| match (before.contains('#'), after.contains('#')) {
        (true, true) => format!("{}{after}", before.trim_end()),
        (false, true) => after.to_string(),
        (_, false) => before.clone(),
    };
    if let Some(next) = effects.get_mut(index) {
        let after = next.decor().prefix().and_then(|prefix| prefix.as_str());
        let prefix = joined(after.unwrap_or_default());
        next.decor_mut().set_prefix(prefix);
    } else if before.contains('#') {
        let trailing = effects.trailing().as_str().unwrap_or_default();
        let trailing = format!("{}{trailing}", before.trim_end());
        effects.set_trailing(trailing);
    }
    if effects.is_empty() {
        effects.set_trailing_comma(false);
    }
    true
}

/// Writes `where = "..."` into the `[effect.X]` table, which is created if necessary.
pub(super) fn set_place(document: &mut DocumentMut, id: &str, word: &str) -> Option<()> {
    let mut tables = Table::new();
    tables.set_implicit(true);
    let mut settings = Table::new();
    settings.decor_mut().set_prefix("\n");
    document
        .entry("effect")
        .or_insert(Item::Table(tables))
        .as_table_like_mut()?
        .entry(id)
        .or_insert(Item::Table(settings))
        .as_table_like_mut()?
        .insert("where", value(word));
    Some(())
}
