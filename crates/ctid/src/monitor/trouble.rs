//! Messages about bad rows with a limited rate: the first ones in full, then occasional ones with a count.

/// Messages in a row that are printed in full.
const IN_FULL: u64 = 5;
/// After this number of good rows, a bad row is reported in full again.
const FORGOTTEN: u64 = 1000;

/// Counts bad rows.
#[derive(Default)]
pub(super) struct Trouble {
    /// Number of bad rows.
    pub bad: u64,
    recent: u64,
    good: u64,
}

impl Trouble {
    /// A good row.
    pub(super) fn good(&mut self) {
        self.good += 1;
        if self.good == FORGOTTEN {
            self.recent = 0;
        }
    }

    /// Counts a bad row; returns the message to print, if any.
    pub(super) fn bad(&mut self, message: impl FnOnce() -> String) -> Option<String> {
        self.good = 0;
        self.bad += 1;
        self.recent += 1;
        let recent = self.recent;
        // The 10th, 100th, 1000th ... message contains the count.
        let power = recent >= 10 && 10_u64.checked_pow(recent.ilog10()) == Some(recent);
        if recent <= IN_FULL {
            let last = if recent == IN_FULL {
                " (further ones are only counted)"
            } else {
                ""
            };
            Some(message() + last)
        } else if power {
            Some(format!("{} ({recent} such rows by now)", message()))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_counted() {
        let mut trouble = Trouble::default();
        let printed = (0..100_000)
            .filter_map(|_| trouble.bad(|| "bad".into()))
            .count();
        assert_eq!(printed, 5 + 5);
        assert_eq!(trouble.bad, 100_000);
        for _ in 0..FORGOTTEN {
            trouble.good();
        }
        assert_eq!(trouble.bad(|| "bad".into()), Some("bad".into()));
    }
}
