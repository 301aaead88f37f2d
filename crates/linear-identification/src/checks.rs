//! Checks of records that all methods share.

use ct_signals::{Channel, Record};

use crate::{Error, MAX_ORDER, Order};

/// Checks a record that was built in code.
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
    setting: &'static str,
    unit: &'static str,
    value: Option<f64>,
) -> Result<(), Error> {
    match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => Err(Error::NotPositive {
            setting,
            unit,
            value,
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Method, Request, identify};

    fn record() -> Record {
        let steps = |k: usize| if (k / 20).is_multiple_of(2) { 1.0 } else { 3.0 };
        let u: Vec<f64> = (0..200).map(steps).collect();
        Record {
            name: "tank".to_owned(),
            time: (0..200).map(|k| k as f64).collect(),
            outputs: vec![Channel::new("y", "cm", u.clone())],
            inputs: vec![Channel::new("u", "V", u)],
            ..Record::default()
        }
    }

    const METHODS: [Method; 8] = [
        Method::StabilizedOe,
        Method::CtRls,
        Method::Ls,
        Method::Iv,
        Method::Fcloe,
        Method::RecursiveFcloe,
        Method::Srivc,
        Method::Rivc,
    ];

    /// Errors that all methods share.
    fn refused(record: &Record, order: Order) -> Vec<Error> {
        let refused = |method| identify(record, &Request::new(method, order)).unwrap_err();
        METHODS.map(refused).into()
    }

    #[test]
    fn what_is_no_record_is_refused_by_every_method() {
        let first = Order { n: 1, m: 0 };
        let without_input = Record {
            inputs: Vec::new(),
            ..record()
        };
        let kinds = refused(&without_input, first);
        let is_input = |error: &Error| matches!(error, Error::NoSignal { kind: "input", .. });
        assert!(kinds.iter().all(is_input), "{kinds:?}");
        let mut short = record();
        short.outputs[0].values.pop();
        let mismatched = refused(&short, first);
        let is_mismatch = |error: &Error| {
            let Error::Signals(error) = error else {
                return false;
            };
            matches!(error, ct_signals::Error::LengthMismatch { .. })
        };
        assert!(mismatched.iter().all(is_mismatch), "{mismatched:?}");
        assert_eq!(refused(&Record::default(), first).len(), METHODS.len());
    }

    #[test]
    fn an_order_that_no_model_has_is_refused_by_every_method() {
        for (n, m) in [(0, 0), (5, 0), (1, 2)] {
            let all = refused(&record(), Order { n, m });
            let is_order = |error: &Error| matches!(error, Error::WrongOrder { .. });
            assert!(all.iter().all(is_order), "{all:?}");
        }
    }
}
