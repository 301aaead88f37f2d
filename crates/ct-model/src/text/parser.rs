//! The grammar: a model of declarations and equations, expressions with Modelica's precedence.
//!
//! ```text
//! model       = "model" name [text] {declaration ";"} {["initial"] "equation" {equation ";"}} "end" name ";"
//! declaration = ["final"] ["constant" | "parameter" | "input" | "output"] "Real" variable {"," variable}
//! variable    = name ["(" attribute {"," attribute} ")"] ["=" expression] [text]
//! equation    = sum "=" expression [text]
//! expression  = "if" expression "then" expression {"elseif" expression "then" expression} "else" expression | or
//! or          = and {"or" and}          and = not {"and" not}         not = ["not"] relation
//! relation    = sum [("<" | "<=" | ">" | ">=" | "==" | "<>") sum]
//! sum         = ["+" | "-"] term {("+" | "-") term}
//! term        = factor {("*" | "/") factor}
//! factor      = primary ["^" primary]
//! primary     = number | "true" | "false" | name | name "(" expression {"," expression} ")" | "(" expression ")"
//! ```

mod expression;
mod words;

use self::words::{KEYWORDS, outside};
use super::{
    error::{TextError, shown},
    lexer::{Token, Word, words},
    syntax::{Attribute, Declaration, Equation, Kept, Kind, Node, Syntax},
};

/// Expressions with deeper nesting of operators and brackets are rejected.
const DEEPEST: usize = 200;
/// The longest text \[bytes\], and the most words in it.
const LONGEST: usize = 1024 * 1024;
const MOST_WORDS: usize = 200_000;

pub(crate) fn parse(text: &str) -> Result<Syntax, TextError> {
    if text.len() > LONGEST {
        let what = format!(
            "a text of {} bytes, and {LONGEST} are the most: is this a model?",
            text.len()
        );
        return Err(TextError::at(text, 0, what));
    }
    let tokens = words(text)?;
    if let Some(token) = tokens.get(MOST_WORDS) {
        let what = format!("more than {MOST_WORDS} words: is this a model?");
        return Err(TextError::at(text, token.from, what));
    }
    Parser {
        text,
        tokens,
        at: 0,
        brackets: 0,
    }
    .model()
}

/// Parses a single expression.
pub(crate) fn parse_expression(text: &str) -> Result<Node, TextError> {
    parse_part(text, |parser| parser.expression())
}

/// Parses a single equation, with or without its `;`.
pub(crate) fn parse_equation(text: &str) -> Result<Equation, TextError> {
    parse_part(text, |parser| {
        let (left, right) = parser.sides()?;
        parser.take_sign(";");
        Ok(Equation { left, right })
    })
}

fn parse_part<T>(
    text: &str,
    part: impl Fn(&mut Parser) -> Result<T, TextError>,
) -> Result<T, TextError> {
    let mut parser = Parser {
        text,
        tokens: words(text)?,
        at: 0,
        brackets: 0,
    };
    let part = part(&mut parser)?;
    if *parser.word() != Word::End {
        return parser.unexpected("the end of the expression");
    }
    Ok(part)
}

/// Builds the node of an operator from its two operands.
type Joins = fn(Box<Node>, Box<Node>) -> Kind;

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<Token>,
    at: usize,
    /// Depth of nested expressions.
    brackets: usize,
}

impl Parser<'_> {
    fn word(&self) -> &Word {
        &self.tokens[self.at].word
    }

    fn from(&self) -> usize {
        self.tokens[self.at].from
    }

    fn next(&mut self) -> Token {
        let token = self.tokens[self.at].clone();
        if self.at + 1 < self.tokens.len() {
            self.at += 1;
        }
        token
    }

    fn is_sign(&self, sign: &str) -> bool {
        matches!(self.word(), Word::Sign(own) if *own == sign)
    }

    fn is_name(&self, name: &str) -> bool {
        matches!(self.word(), Word::Name(own) if own == name)
    }

    fn take_sign(&mut self, sign: &str) -> bool {
        let is = self.is_sign(sign);
        if is {
            self.next();
        }
        is
    }

    fn take_name(&mut self, name: &str) -> bool {
        let is = self.is_name(name);
        if is {
            self.next();
        }
        is
    }

    fn error<T>(&self, what: impl Into<String>) -> Result<T, TextError> {
        Err(TextError::at(self.text, self.from(), what))
    }

    /// Error: the present word is not allowed here.
    fn unexpected<T>(&self, wanted: &str) -> Result<T, TextError> {
        let found = match self.word() {
            Word::End => "the end of the text".to_string(),
            _ => shown(&self.text[self.from()..self.tokens[self.at].to]),
        };
        if let Word::Name(name) = self.word()
            && let Some(mend) = outside(name)
        {
            return self.error(format!("{found}: {mend}"));
        }
        if self.is_sign("[") || self.is_sign("{") {
            return self.error(format!(
                "{found}: arrays are not supported; declare each element as a separate variable"
            ));
        }
        if self.is_sign(":=") {
            return self.error(format!("{found}: an equation is written with `=`"));
        }
        self.error(format!("{found} where {wanted} has to stand"))
    }

    fn expect_sign(&mut self, sign: &str, wanted: &str) -> Result<(), TextError> {
        if self.take_sign(sign) {
            return Ok(());
        }
        self.unexpected(wanted)
    }

    /// A name that may be a variable's or a model's.
    fn name(&mut self, wanted: &str) -> Result<(String, usize), TextError> {
        let from = self.from();
        match self.word() {
            Word::Name(name) if !KEYWORDS.contains(&name.as_str()) => {
                let name = name.clone();
                self.next();
                Ok((name, from))
            }
            _ => self.unexpected(wanted),
        }
    }

    fn description(&mut self) -> Result<String, TextError> {
        let mut all = String::new();
        while let Word::Text(text) = self.word() {
            all += text;
            self.next();
            if self.is_sign("+") {
                self.next();
                if !matches!(self.word(), Word::Text(_)) {
                    return self.unexpected("a description in quotes");
                }
            }
        }
        Ok(all)
    }

    fn model(&mut self) -> Result<Syntax, TextError> {
        if !self.take_name("model") {
            return self.unexpected("`model`, with which a model begins,");
        }
        let (name, _) = self.name("the model's name")?;
        let mut syntax = Syntax {
            name,
            description: self.description()?,
            declarations: Vec::new(),
            equations: Vec::new(),
            initial: Vec::new(),
        };
        while !["initial", "equation", "end"]
            .iter()
            .any(|word| self.is_name(word))
        {
            self.declarations(&mut syntax.declarations)?;
        }
        while !self.is_name("end") {
            let all = if self.take_name("initial") {
                &mut syntax.initial
            } else {
                &mut syntax.equations
            };
            if !self.take_name("equation") {
                return self.unexpected("`equation` or `end`");
            }
            while !["initial", "equation", "end"]
                .iter()
                .any(|word| self.is_name(word))
            {
                all.push(self.equation()?);
            }
        }
        self.next();
        let (end, from) = self.name("the model's name")?;
        if end != syntax.name {
            let what = format!(
                "{} ends here, but {} began: write the same name",
                shown(&end),
                shown(&syntax.name)
            );
            return Err(TextError::at(self.text, from, what));
        }
        self.expect_sign(";", "`;`")?;
        if *self.word() != Word::End {
            return self.unexpected("the end of the text");
        }
        Ok(syntax)
    }

    fn declarations(&mut self, all: &mut Vec<Declaration>) -> Result<(), TextError> {
        let is_final = self.take_name("final");
        let kept = match self.word() {
            Word::Name(word) => match word.as_str() {
                "constant" => Kept::Constant,
                "parameter" if is_final => Kept::FinalParameter,
                "parameter" => Kept::Parameter,
                "input" => Kept::Input,
                "output" => Kept::Output,
                _ => Kept::Plain,
            },
            _ => Kept::Plain,
        };
        if kept != Kept::Plain {
            self.next();
        }
        if is_final && !matches!(kept, Kept::FinalParameter | Kept::Constant) {
            return self.unexpected("`parameter`, behind `final`,");
        }
        if !self.take_name("Real") {
            if let Word::Name(name) = self.word()
                && outside(name).is_none()
                && !KEYWORDS.contains(&name.as_str())
            {
                return self.error(format!(
                    "{} is not a type of the subset: write `Real`, with the unit in brackets",
                    shown(name)
                ));
            }
            return self.unexpected("a declaration (`Real ...;`), `equation` or `end`");
        }
        loop {
            let declaration = self.variable(kept)?;
            all.push(declaration);
            if !self.take_sign(",") {
                break;
            }
        }
        self.expect_sign(";", "`;` or `,`")
    }

    fn variable(&mut self, kept: Kept) -> Result<Declaration, TextError> {
        let (name, from) = self.name("a variable's name")?;
        let mut attributes = Vec::new();
        if self.take_sign("(") {
            loop {
                let (attribute, place) = self.name("an attribute, such as unit,")?;
                self.expect_sign("=", "`=`")?;
                let value = if matches!(self.word(), Word::Text(_)) {
                    Attribute::Text(self.description()?)
                } else {
                    Attribute::Value(self.expression()?)
                };
                attributes.push((attribute, place, value));
                if !self.take_sign(",") {
                    break;
                }
            }
            self.expect_sign(")", "`)` or `,`")?;
        }
        let binding = if self.take_sign("=") {
            Some(self.expression()?)
        } else {
            None
        };
        Ok(Declaration {
            kept,
            name,
            from,
            attributes,
            binding,
            description: self.description()?,
        })
    }

    fn equation(&mut self) -> Result<Equation, TextError> {
        if self.is_name("if") {
            return self
                .error("equations within `if` are not supported: write `x = if c then a else b;`");
        }
        if let Word::Name(name) = self.word()
            && outside(name).is_some()
        {
            return self.unexpected("an equation");
        }
        let (left, right) = self.sides()?;
        self.description()?;
        self.expect_sign(";", "`;`")?;
        Ok(Equation { left, right })
    }

    fn sides(&mut self) -> Result<(Node, Node), TextError> {
        let left = self.sum()?;
        self.expect_sign("=", "`=`")?;
        Ok((left, self.expression()?))
    }
}
