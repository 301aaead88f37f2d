//! A text cut into words.

use super::error::{TextError, shown};

/// A word.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Word {
    /// A name or a keyword.
    Name(String),
    Number(f64),
    /// Text between quotes.
    Text(String),
    /// An operator or a bracket.
    Sign(&'static str),
    End,
}

/// A word and its position \[bytes\].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Token {
    pub(crate) word: Word,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// Longer ones first.
const SIGNS: [&str; 22] = [
    "<=", ">=", "<>", "==", ":=", "(", ")", "[", "]", "{", "}", ",", ";", ":", "=", "+", "-", "*",
    "/", "^", "<", ">",
];

/// All words of a text, the last one [`Word::End`].
pub(crate) fn words(text: &str) -> Result<Vec<Token>, TextError> {
    let bytes = text.as_bytes();
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &text[at..];
        let byte = bytes[at];
        let from = at;
        let word = if byte.is_ascii_whitespace() {
            at += 1;
            continue;
        } else if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
            continue;
        } else if let Some(comment) = rest.strip_prefix("/*") {
            let end = comment
                .find("*/")
                .ok_or_else(|| TextError::at(text, from, "a comment without an end: write `*/`"))?;
            at += end + 4;
            continue;
        } else if byte.is_ascii_alphabetic() || byte == b'_' {
            let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
            at += rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            Word::Name(text[from..at].to_string())
        } else if byte.is_ascii_digit() {
            at += number(rest);
            let value = text[from..at].parse::<f64>().ok().filter(|v| v.is_finite());
            let value = value.ok_or_else(|| {
                let words = shown(&text[from..at]);
                TextError::at(text, from, format!("{words} is too large for a number"))
            })?;
            if text[at..].starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
                let what = format!(
                    "{} begins with a digit: put an operator behind the number, or begin the name with a letter",
                    shown(rest.split_whitespace().next().unwrap_or_default())
                );
                return Err(TextError::at(text, from, what));
            }
            Word::Number(value)
        } else if byte == b'"' {
            let (word, length) = quoted(rest).ok_or_else(|| {
                TextError::at(
                    text,
                    from,
                    "a description without an end: write `\"` behind it",
                )
            })?;
            at += length;
            Word::Text(word)
        } else if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
            at += sign.len();
            Word::Sign(sign)
        } else {
            return Err(TextError::at(text, from, refused_character(rest)));
        };
        tokens.push(Token { word, from, to: at });
    }
    tokens.push(Token {
        word: Word::End,
        from: text.len(),
        to: text.len(),
    });
    Ok(tokens)
}

fn refused_character(rest: &str) -> String {
    let character = rest.chars().next().unwrap_or_default();
    let mend = match character {
        '.' => {
            "a number begins with a digit (0.5), and names of packages and operators such as `.*` are not supported"
        }
        '\'' => "names in quotes are not supported: use letters, digits and `_`",
        '!' | '&' | '|' => "write `not`, `and`, `or`, `<>`",
        _ => {
            "delete it; names have letters, digits and `_`, other characters are allowed in descriptions and comments"
        }
    };
    format!(
        "{} has no meaning here: {mend}",
        shown(&character.to_string())
    )
}

/// Length of the number that a text begins with: digits, a fraction, an exponent.
fn number(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    end
}

/// The text between the quotes at the beginning of `text`, and the length including the quotes; `None` if they are not closed.
fn quoted(text: &str) -> Option<(String, usize)> {
    let mut all = String::new();
    let mut characters = text.char_indices().skip(1);
    while let Some((at, character)) = characters.next() {
        match character {
            '"' => return Some((all, at + 1)),
            '\\' => all.push(match characters.next()?.1 {
                'n' => '\n',
                't' => '\t',
                other => other,
            }),
            other => all.push(other),
        }
    }
    None
}
