//! Setting of the delay.

/// Setting of the delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DelayChoice {
    /// Known delay, s.
    Known(f64),
    /// The delay is estimated, up to a tenth of the record.
    Auto,
    /// The delay is estimated, up to this value, s.
    UpTo(f64),
}

impl std::str::FromStr for DelayChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "a delay is a number of seconds of at least 0, auto, or a range from 0 as in 0..30; found {text}"
            )
        };
        let number = |text: &str| {
            let value = text.trim().parse::<f64>().map_err(|_| wrong())?;
            match value.is_finite() && value >= 0.0 {
                true => Ok(value),
                false => Err(wrong()),
            }
        };
        match text.split_once("..") {
            None if text == "auto" => Ok(Self::Auto),
            None => Ok(Self::Known(number(text)?)),
            Some((from, to)) => match (number(from)?, number(to)?) {
                (0.0, to) if to > 0.0 => Ok(Self::UpTo(to)),
                _ => Err(wrong()),
            },
        }
    }
}
