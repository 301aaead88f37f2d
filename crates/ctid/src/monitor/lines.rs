//! Splits bytes into lines of bounded length; a line that is too long is dropped up to its end. A line ends as in a file: at a line feed, a
//! carriage return, or both.

use ct_signals::LONGEST_LINE;

/// A line, or the rest of a line that is too long.
#[derive(Debug, PartialEq)]
pub(super) enum Cut<'a> {
    /// A line without its end.
    Line(&'a [u8]),
    /// Longer than [`LONGEST_LINE`]; reported once, at the end of the line.
    TooLong,
}

/// The part of a line that was received so far.
#[derive(Default)]
pub(super) struct Lines {
    part: Vec<u8>,
    too_long: bool,
    /// The preceding byte was a carriage return: a line feed after it does not end another line.
    returned: bool,
}

impl Lines {
    /// Cuts bytes into lines; stops at the first error of `each`.
    pub(super) fn push<E>(
        &mut self,
        mut bytes: &[u8],
        each: &mut impl FnMut(Cut) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some(end) = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')) {
            let (line, rest) = (&bytes[..end], &bytes[end + 1..]);
            let with_return = std::mem::replace(&mut self.returned, bytes[end] == b'\r');
            bytes = rest;
            if with_return && !self.returned && line.is_empty() {
                continue;
            }
            if !self.too_long && self.part.is_empty() && line.len() <= LONGEST_LINE {
                each(Cut::Line(line))?;
                continue;
            }
            self.keep(line);
            self.end(each)?;
        }
        self.returned &= bytes.is_empty();
        self.keep(bytes);
        Ok(())
    }

    /// The last line, which may have no end.
    pub(super) fn end<E>(&mut self, each: &mut impl FnMut(Cut) -> Result<(), E>) -> Result<(), E> {
        let too_long = std::mem::take(&mut self.too_long);
        let result = if too_long {
            each(Cut::TooLong)
        } else if self.part.is_empty() {
            Ok(())
        } else {
            each(Cut::Line(&self.part))
        };
        self.part.clear();
        result
    }

    fn keep(&mut self, bytes: &[u8]) {
        if self.too_long || self.part.len() + bytes.len() > LONGEST_LINE {
            self.too_long = true;
            self.part.clear();
        } else {
            self.part.extend_from_slice(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(chunks: &[&[u8]]) -> Vec<String> {
        let mut lines = Lines::default();
        let mut all = Vec::new();
        let mut each = |cut: Cut| {
            all.push(match cut {
                Cut::Line(line) => String::from_utf8(line.to_vec()).unwrap(),
                Cut::TooLong => "too long".to_string(),
            });
            Ok::<(), ()>(())
        };
        for chunk in chunks {
            lines.push(chunk, &mut each).unwrap();
        }
        lines.end(&mut each).unwrap();
        all
    }

    #[test]
    fn lines_may_come_in_pieces() {
        assert_eq!(cut(&[b"a,b\nc", b",d", b"\ne"]), ["a,b", "c,d", "e"]);
        assert!(cut(&[]).is_empty());
    }

    #[test]
    fn a_line_ends_as_in_a_file() {
        assert_eq!(cut(&[b"a\r\n\nb\n"]), ["a", "", "b"]);
        assert_eq!(
            cut(&[b"a\rb\nc\r", b"\nd\r", b"e"]),
            ["a", "b", "c", "d", "e"]
        );
        assert_eq!(cut(&[b"a\r\rb"]), ["a", "", "b"]);
    }

    #[test]
    fn a_line_without_an_end_is_not_kept() {
        let part = vec![b'1'; LONGEST_LINE / 2 + 1];
        assert_eq!(
            cut(&[b"a\n", &part, &part, b"\nb\n"]),
            ["a", "too long", "b"]
        );
        assert_eq!(cut(&[&part, &part, &part]), ["too long"]);
        let mut lines = Lines::default();
        for _ in 0..100 {
            lines.push(&part, &mut |_| Ok::<(), ()>(())).unwrap();
        }
        assert!(lines.part.capacity() <= 2 * LONGEST_LINE);
    }
}
