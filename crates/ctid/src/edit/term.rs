//! Terms of the user's own, written into the model file.

use plants::{Fitted, Term};
use toml_edit::{Array, Item, Table, value};

use super::layout::push;
use super::{Edited, document, has_table, list};
use crate::model_file::ModelFile;
use crate::report::rounded;
use crate::term_file::TermFile;
use crate::{Error, model_file, term_file};

/// The text with a term whose table already exists.
pub(super) fn with_waiting_term(
    file: &str,
    text: &str,
    name: &str,
    model: &ModelFile,
) -> Result<Edited, Error> {
    if model.terms.iter().any(|on| on.term.name == name) {
        return Err(Error::File {
            file: file.to_string(),
            what: format!("{name} is in the model already; `ctid remove {name}` takes it out"),
        });
    }
    let mut document = document(file, text)?;
    push(&mut document, name);
    let text = document.to_string();
    let model = model_file::parse(file, &text)?;
    let done = format!("{file}: added {name}; effects = {}", list(&model));
    Ok(Edited { text, done })
}

/// The text of a model file with a term of the user's own; `from` names the file of its shape in messages.
///
/// # Errors
/// As [`super::add_from`].
pub fn with_term(
    file: &str,
    text: &str,
    name: &str,
    from: &str,
    shape: &TermFile,
) -> Result<Edited, Error> {
    let model = model_file::parse(file, text)?;
    let mut document = document(file, text)?;
    if has_table(&document, name) {
        return Err(Error::File {
            file: file.to_string(),
            what: if model.terms.iter().any(|on| on.term.name == name) {
                format!(
                    "{name} is in the model already; give another name, or `ctid remove {name}` and delete [term.{name}]"
                )
            } else {
                format!(
                    "[term.{name}] exists already; give another name, delete the table, or `ctid add {name}` alone"
                )
            },
        });
    }
    let refuse = |what: String| Error::File {
        file: from.to_string(),
        what,
    };
    let (place, vessel) =
        term_file::place_of(model.plant, &model.known, &shape.place).map_err(&refuse)?;
    let (at, values) = (knots(&shape.at), shortened(&shape.value));
    let term = Term {
        name: name.to_string(),
        place,
        vessel,
        variable: term_file::variable_of(&shape.variable).map_err(&refuse)?,
        knots: at.clone(),
        ordinates: values.clone(),
        fitted: Fitted::Scale,
    };
    term.check(model.plant)
        .map_err(|error| refuse(error.to_string()))?;
    let mut table = Table::new();
    table.insert("place", value(&shape.place));
    table.insert("variable", value(&shape.variable));
    table.insert("at", value(Array::from_iter(at)));
    table.insert("at_unit", value(&shape.at_unit));
    table.insert("value", value(Array::from_iter(values)));
    table.insert("unit", value(&shape.unit));
    table.decor_mut().set_prefix("\n");
    let mut tables = Table::new();
    tables.set_implicit(true);
    document
        .entry("term")
        .or_insert(Item::Table(tables))
        .as_table_like_mut()
        .ok_or_else(|| Error::File {
            file: file.to_string(),
            what: "[term] is not a table; make it one".to_string(),
        })?
        .insert(name, Item::Table(table));
    push(&mut document, name);
    let text = document.to_string();
    let model = model_file::parse(file, &text)?;
    let done = format!(
        "{file}: added {name}, a term in the {} with {} knots; effects = {}",
        shape.variable,
        shape.at.len(),
        list(&model)
    );
    Ok(Edited { text, done })
}

/// Rounds values to the digits that are shown.
fn shortened(values: &[f64]) -> Vec<f64> {
    values.iter().map(|&value| rounded(value, 6)).collect()
}

/// Rounds knots, if they still rise after rounding.
fn knots(at: &[f64]) -> Vec<f64> {
    let short = shortened(at);
    if short.windows(2).all(|pair| pair[0] < pair[1]) {
        short
    } else {
        at.to_vec()
    }
}
