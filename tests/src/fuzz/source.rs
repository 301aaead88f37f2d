//! Random material: numbers in the formats of people and loggers, names, and damaged texts.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The random numbers of a case.
pub(super) struct Source(ChaCha8Rng);

/// Numbers at the edge of what can be computed with.
const EDGES: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "1e400",
    "1e30",
    "-1e30",
    "1e-30",
    "1e15",
    "1e-9",
    "99999999999999999999",
    "4294967296",
    "0.1",
    "3",
    "1000000",
];

/// Words in place of a number.
const WORDS: &[&str] = &[
    "",
    " ",
    "nan",
    "NaN",
    "inf",
    "-Infinity",
    "#N/A",
    "TRUE",
    "Bad",
    "null",
    "-",
    "1.2.3",
    "1,5",
    "0x1F",
    "1_000",
    "\"",
    "\"\"",
    "'",
    ";",
    "\t",
    "\u{661}",
    "12:30",
    "2024-01-01T00:00:00Z",
    "5.",
    ".5",
    "+5",
    "1e",
    "--1",
];

/// Lines that people type into a model file.
const LINES: &[&str] = &[
    "[",
    "]",
    "[[",
    "{",
    "[known]",
    "[effect]\noverflow = 1",
    "[effect.overflow]",
    "[effect.transport_delay]\nwhere = \"lower\"",
    "[start]\nalpha = 1e300",
    "[start]\npump_gain = 1e-300",
    "tank_height = 1e-9",
    "input_range = 1e300",
    "reference = \"y [cm]\"",
    "plant.x = 1",
    "hold = \"first\"",
    "[controller]\ntype = \"PI\"\ngain = 1e300\nintegral_time = 1e-300",
];

impl Source {
    pub fn new(number: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(number))
    }

    /// Below `n`; 0 where `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.random_range(0..n.max(1))
    }

    pub fn chance(&mut self, probability: f64) -> bool {
        self.0.random_bool(probability)
    }

    pub fn byte(&mut self) -> u8 {
        self.0.random()
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// From `low` to `high`, each power of ten with equal probability.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// Normally distributed, nearly: the sum of twelve uniform numbers.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform(-0.5, 0.5)).sum()
    }

    pub fn pick<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }

    /// A number as it may be written, of any size.
    pub fn number(&mut self) -> String {
        match self.below(6) {
            0 => self.pick(EDGES).to_string(),
            1 => format!("{:e}", self.scale(1e-12, 1e12)),
            2 => format!("-{}", self.scale(1e-3, 1e3)),
            3 => self.below(200).to_string(),
            _ => format!("{:.3}", self.scale(1e-2, 1e3)),
        }
    }

    /// A word in a cell by mistake.
    pub fn word(&mut self) -> String {
        match self.below(4) {
            0 => self.number(),
            _ => self.pick(WORDS).to_string(),
        }
    }

    /// A name, as a column's or a file's.
    pub fn name(&mut self) -> String {
        match self.below(8) {
            0 => "x".repeat(self.below(3000)),
            1 => "a\u{202e}b\u{2066}c\u{feff}d".to_string(),
            2 => "line\u{1b}[31mred\u{7}\u{9b}".to_string(),
            3 => "\u{65e5}\u{672c} \u{1f600}\u{ad}".repeat(self.below(200)),
            4 => "<script>alert(1)</script>".to_string(),
            5 => String::new(),
            _ => {
                let letters = [
                    "t",
                    "u",
                    "y",
                    "r",
                    "time",
                    "T1 [degC]",
                    "h (mm)",
                    "y_cm",
                    "plant.x",
                    "../../etc",
                ];
                self.pick(&letters).to_string()
            }
        }
    }

    /// One to three random changes of a text; `separator` separates its words.
    pub fn damaged(&mut self, text: &[u8], separator: char) -> Vec<u8> {
        let mut bytes = text.to_vec();
        for _ in 0..=self.below(3) {
            bytes = match self.below(4) {
                0 => self.damaged_bytes(bytes),
                1 => self.damaged_lines(&bytes),
                _ => self.damaged_words(&bytes, separator),
            };
        }
        bytes
    }

    fn damaged_bytes(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let at = self.below(bytes.len());
        match self.below(5) {
            0 if at < bytes.len() => bytes[at] ^= 1 << self.below(8),
            1 if at < bytes.len() => {
                bytes.remove(at);
            }
            2 => bytes.insert(at, self.byte()),
            3 => bytes.insert(at, b"\0\r\n\"',;#[]="[self.below(11)]),
            _ => bytes.truncate(at),
        }
        bytes
    }

    fn damaged_lines(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut lines: Vec<&[u8]> = bytes.split(|&b| b == b'\n').collect();
        let (a, b) = (self.below(lines.len()), self.below(lines.len()));
        match self.below(4) {
            0 => {
                lines.remove(a);
            }
            1 => lines.insert(b, lines[a]),
            2 => lines.swap(a, b),
            // A block is lost.
            _ => {
                lines.drain(a.min(b)..a.max(b));
            }
        }
        lines.join(&b'\n')
    }

    /// Words between separators: cells of a record, sides of an equation.
    fn damaged_words(&mut self, bytes: &[u8], separator: char) -> Vec<u8> {
        let text = String::from_utf8_lossy(bytes);
        let mut lines: Vec<String> = text.split('\n').map(str::to_string).collect();
        let at = self.below(lines.len());
        let word = if separator == '=' && self.chance(0.4) {
            self.pick(LINES).to_string()
        } else {
            self.word()
        };
        let column = self.below(3);
        match self.below(16) {
            0..4 => lines.insert(at, word),
            // One cell of every line.
            4..7 => {
                for line in &mut lines {
                    *line = replaced(line, separator, column, &word);
                }
            }
            _ => lines[at] = replaced(&lines[at], separator, column, &word),
        }
        lines.join("\n").into_bytes()
    }
}

fn replaced(line: &str, separator: char, column: usize, word: &str) -> String {
    let mut cells: Vec<&str> = line.split(separator).collect();
    if let Some(cell) = cells.get_mut(column) {
        *cell = word;
    }
    cells.join(&separator.to_string())
}
