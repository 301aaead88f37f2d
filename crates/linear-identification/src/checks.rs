//! What is refused of any method.

use ct_signals::{Channel, Record};

use crate::{Error, MAX_ORDER, Order};

/// A record that was put together in code.
pub(crate) fn whole(record: &Record) -> Result<(), Error> {
    record.validate()?;
    for (channels, kind) in [(&record.inputs, "input"), (&record.outputs, "output")] {
        if channels.is_empty() {
            return Err(Error::NoSignal {
                record: record.name.clone(),
                kind,
            });
        }
    }
    Ok(())
}

pub(crate) fn possible(order: Order) -> Result<(), Error> {
    let Order { n, m } = order;
    if (1..=MAX_ORDER).contains(&n) && m <= n {
        return Ok(());
    }
    Err(Error::WrongOrder { order })
}

pub(crate) fn moves(record: &Record, signal: &Channel) -> Result<(), Error> {
    let (low, high) = signal.range();
    if high > low {
        return Ok(());
    }
    Err(Error::Constant {
        record: record.name.clone(),
        signal: signal.name.clone(),
        value: low,
    })
}

pub(crate) fn positive(
    option: &'static str,
    unit: &'static str,
    value: Option<f64>,
) -> Result<(), Error> {
    match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => Err(Error::NotPositive {
            option,
            unit,
            value,
        }),
        _ => Ok(()),
    }
}
