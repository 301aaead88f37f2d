//! Reads the parts of a cell one after the other.

use super::Fault;

/// A place in a cell.
pub(super) struct Scanner<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl Scanner<'_> {
    /// The next byte, or 0 at the end.
    #[inline]
    pub(super) fn peek(&self) -> u8 {
        self.bytes.get(self.at).copied().unwrap_or(0)
    }

    #[inline]
    pub(super) fn done(&self) -> bool {
        self.at >= self.bytes.len()
    }

    #[inline]
    pub(super) fn expect(&mut self, byte: u8) -> Result<(), Fault> {
        if self.peek() == byte {
            self.at += 1;
            Ok(())
        } else {
            Err(Fault::Form)
        }
    }

    /// A number of `least` to `most` digits; `most` is at most 9.
    #[inline]
    pub(super) fn number(&mut self, least: usize, most: usize) -> Result<u32, Fault> {
        let begin = self.at;
        let mut value = 0;
        while self.at - begin < most && self.peek().is_ascii_digit() {
            value = 10 * value + u32::from(self.peek() - b'0');
            self.at += 1;
        }
        if self.at - begin < least {
            return Err(Fault::Form);
        }
        Ok(value)
    }

    /// The digits after a decimal mark, as nanoseconds; further digits are dropped.
    #[inline]
    pub(super) fn fraction(&mut self) -> Result<u32, Fault> {
        let begin = self.at;
        let mut value = 0;
        let mut unit = 100_000_000;
        while self.peek().is_ascii_digit() {
            value += unit * u32::from(self.peek() - b'0');
            unit /= 10;
            self.at += 1;
        }
        if self.at == begin {
            return Err(Fault::Form);
        }
        Ok(value)
    }

    #[inline]
    pub(super) fn blanks(&mut self) {
        while self.peek() == b' ' {
            self.at += 1;
        }
    }

    /// Separator between date and time: `T`, or blanks with or without a comma before them.
    #[inline]
    pub(super) fn date_separator(&mut self) -> bool {
        if matches!(self.peek(), b'T' | b't') {
            self.at += 1;
            return true;
        }
        if self.peek() == b',' {
            self.at += 1;
        }
        let begin = self.at;
        self.blanks();
        self.at > begin
    }

    /// Whether the next letters are these, in small letters or capitals; they are passed over.
    fn word(&mut self, word: &str) -> bool {
        let end = self.at + word.len();
        let found = self
            .bytes
            .get(self.at..end)
            .is_some_and(|bytes| bytes.eq_ignore_ascii_case(word.as_bytes()));
        if found {
            self.at = end;
        }
        found
    }

    /// Whether `PM` follows (`false`: `AM`); `None` where neither does.
    #[inline]
    pub(super) fn half_day(&mut self) -> Option<bool> {
        if self.done() {
            return None;
        }
        let begin = self.at;
        self.blanks();
        if self.word("AM") {
            Some(false)
        } else if self.word("PM") {
            Some(true)
        } else {
            self.at = begin;
            None
        }
    }

    pub(super) fn month_name(&mut self) -> Result<u32, Fault> {
        const NAMES: [&str; 12] = [
            "January",
            "February",
            "March",
            "April",
            "May",
            "June",
            "July",
            "August",
            "September",
            "October",
            "November",
            "December",
        ];
        for (month, name) in (1..).zip(NAMES) {
            if self.word(name) || self.word(&name[..3]) {
                return Ok(month);
            }
        }
        Err(Fault::Form)
    }

    #[inline]
    pub(super) fn offset(&mut self) -> Result<i32, Fault> {
        let sign = match self.peek() {
            b'+' => 1,
            b'-' => -1,
            _ if self.word("Z") || self.word("UTC") || self.word("GMT") => return Ok(0),
            _ => return Err(Fault::Form),
        };
        self.at += 1;
        let hours = self.number(2, 2)?;
        let mut minutes = 0;
        if self.peek() == b':' {
            self.at += 1;
            minutes = self.number(2, 2)?;
        } else if self.peek().is_ascii_digit() {
            minutes = self.number(2, 2)?;
        }
        if hours > 23 || minutes > 59 {
            return Err(Fault::Range);
        }
        Ok(sign * (3600 * hours as i32 + 60 * minutes as i32))
    }
}
