//! Expressions over the variables of a model.

/// A variable of a model, by its position in [`crate::ModelSpec`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Variable {
    /// A parameter.
    Parameter(usize),
    /// An input.
    Input(usize),
    /// A state.
    State(usize),
    /// A named flow, which another expression defines.
    Flow(usize),
}

/// An operator between two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// `a + b`.
    Add,
    /// `a - b`.
    Subtract,
    /// `a * b`.
    Multiply,
    /// `a / b`.
    Divide,
    /// `a ^ b`.
    Power,
}

/// A function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is the function of its name")]
pub enum Function {
    Abs,
    Sign,
    Sqrt,
    Exp,
    Log,
    Log10,
    Sin,
    Cos,
    Tan,
    Tanh,
    Atan2,
    Min,
    Max,
    /// `play(x, b)`: backlash of half-width `b`; the result follows `x` from row to row at a distance of at most `b`.
    Play,
    /// `stick_slip(x, b, j, s)`: stiction; the result stays until `x` is further than `b (1 + j)` from it, and then moves to a distance of
    /// `b (1 - j)` from `x`: with `j = 0` a play, with `j = 1` it jumps to `x`. It begins at `x + s b (1 + j)`.
    StickSlip,
    /// `stay_between(a, b)`: the result keeps its value of the row before while this is between `a` and `b`, and follows the nearer one
    /// otherwise. A play of `x` stays between `x - b` and `x + b`.
    StayBetween,
    /// `quantise(x, d)`: the multiple of `d` that is nearest to `x`; `x` itself if `d` is zero.
    Quantise,
}

impl Function {
    /// List of all functions.
    pub const ALL: [Self; 17] = [
        Self::Abs,
        Self::Sign,
        Self::Sqrt,
        Self::Exp,
        Self::Log,
        Self::Log10,
        Self::Sin,
        Self::Cos,
        Self::Tan,
        Self::Tanh,
        Self::Atan2,
        Self::Min,
        Self::Max,
        Self::Play,
        Self::StickSlip,
        Self::StayBetween,
        Self::Quantise,
    ];

    /// Name of the function in a model text.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Abs => "abs",
            Self::Sign => "sign",
            Self::Sqrt => "sqrt",
            Self::Exp => "exp",
            Self::Log => "log",
            Self::Log10 => "log10",
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Tanh => "tanh",
            Self::Atan2 => "atan2",
            Self::Min => "min",
            Self::Max => "max",
            Self::Play => "play",
            Self::StickSlip => "stick_slip",
            Self::StayBetween => "stay_between",
            Self::Quantise => "quantise",
        }
    }

    /// Number of arguments of the function.
    #[must_use]
    pub fn arguments(self) -> usize {
        match self {
            Self::Atan2
            | Self::Min
            | Self::Max
            | Self::Play
            | Self::StayBetween
            | Self::Quantise => 2,
            Self::StickSlip => 4,
            _ => 1,
        }
    }
}

/// Comparison of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `a < b`.
    Less,
    /// `a <= b`.
    LessOrEqual,
    /// `a > b`.
    Greater,
    /// `a >= b`.
    GreaterOrEqual,
    /// `a == b`.
    Equal,
    /// `a <> b`.
    NotEqual,
}

/// A Boolean expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Condition {
    /// `true` or `false`.
    Constant(bool),
    /// Two numbers compared.
    Compare(Comparison, Box<Expression>, Box<Expression>),
    /// `not a`.
    Not(Box<Condition>),
    /// `a and b`.
    And(Box<Condition>, Box<Condition>),
    /// `a or b`.
    Or(Box<Condition>, Box<Condition>),
}

/// A numeric expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A constant in the text, zero or above.
    Number(f64),
    /// The time since the record began, in the unit of its time.
    Time,
    /// A variable.
    Variable(Variable),
    /// `-a`.
    Negative(Box<Expression>),
    /// Two operands with an operator.
    Binary(Operator, Box<Expression>, Box<Expression>),
    /// A function of its arguments.
    Call(Function, Vec<Expression>),
    /// `if c then a else b`.
    If(Box<Condition>, Box<Expression>, Box<Expression>),
    /// The expression with a dead time \[time\]; before the record it has its initial value.
    Delay(Box<Expression>, Box<Expression>),
}

impl Expression {
    /// A number of any sign: the literal numbers of a text have none.
    #[must_use]
    pub fn number(value: f64) -> Self {
        let size = Self::Number(value.abs());
        if value < 0.0 {
            Self::Negative(Box::new(size))
        } else {
            size
        }
    }

    /// Calls `each` for the expression and each of its parts.
    pub fn each_part<'a>(&'a self, each: &mut impl FnMut(&'a Self)) {
        each(self);
        match self {
            Self::Number(_) | Self::Time | Self::Variable(_) => {}
            Self::Negative(a) => a.each_part(each),
            Self::Binary(_, a, b) | Self::Delay(a, b) => {
                a.each_part(each);
                b.each_part(each);
            }
            Self::Call(_, arguments) => arguments.iter().for_each(|a| a.each_part(each)),
            Self::If(condition, a, b) => {
                condition.each_part(each);
                a.each_part(each);
                b.each_part(each);
            }
        }
    }

    /// Calls `each` for every occurrence of a variable.
    pub fn each_variable(&self, each: &mut impl FnMut(Variable)) {
        self.each_part(&mut |part| {
            if let Self::Variable(variable) = part {
                each(*variable);
            }
        });
    }

    /// Whether some part satisfies a test.
    pub fn any(&self, test: &impl Fn(&Self) -> bool) -> bool {
        let mut found = false;
        self.each_part(&mut |part| found |= test(part));
        found
    }

    /// The expression with other expressions substituted for its variables.
    #[must_use]
    pub fn with(&self, of: &impl Fn(Variable) -> Self) -> Self {
        let part = |a: &Self| Box::new(a.with(of));
        match self {
            Self::Number(_) | Self::Time => self.clone(),
            Self::Variable(variable) => of(*variable),
            Self::Negative(a) => Self::Negative(part(a)),
            Self::Binary(operator, a, b) => Self::Binary(*operator, part(a), part(b)),
            Self::Call(function, arguments) => {
                Self::Call(*function, arguments.iter().map(|a| a.with(of)).collect())
            }
            Self::If(condition, a, b) => Self::If(Box::new(condition.with(of)), part(a), part(b)),
            Self::Delay(a, by) => Self::Delay(part(a), part(by)),
        }
    }

    /// The expression with zero in place of all that a delay lets through.
    #[must_use]
    pub(crate) fn without_delayed(&self) -> Self {
        let part = |a: &Self| Box::new(a.without_delayed());
        match self {
            Self::Delay(..) => Self::Number(0.0),
            Self::Negative(a) => Self::Negative(part(a)),
            Self::Binary(operator, a, b) => Self::Binary(*operator, part(a), part(b)),
            Self::Call(function, arguments) => {
                let arguments = arguments.iter().map(Self::without_delayed);
                Self::Call(*function, arguments.collect())
            }
            Self::If(condition, a, b) => Self::If(condition.clone(), part(a), part(b)),
            Self::Number(_) | Self::Time | Self::Variable(_) => self.clone(),
        }
    }

    /// The value for these values of the variables; functions with memory return their first argument.
    #[must_use]
    pub fn value(&self, time: f64, of: &impl Fn(Variable) -> f64) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Time => time,
            Self::Variable(variable) => of(*variable),
            Self::Negative(a) => -a.value(time, of),
            Self::Binary(operator, a, b) => {
                let (a, b) = (a.value(time, of), b.value(time, of));
                match operator {
                    Operator::Add => a + b,
                    Operator::Subtract => a - b,
                    Operator::Multiply => a * b,
                    Operator::Divide => a / b,
                    Operator::Power => a.powf(b),
                }
            }
            Self::Call(function, arguments) => {
                let argument = |i: usize| arguments[i].value(time, of);
                let a = argument(0);
                match function {
                    Function::Abs => a.abs(),
                    // The sign of zero is zero, as in Modelica.
                    Function::Sign if a == 0.0 => 0.0,
                    Function::Sign => a.signum(),
                    Function::Sqrt => a.sqrt(),
                    Function::Exp => a.exp(),
                    Function::Log => a.ln(),
                    Function::Log10 => a.log10(),
                    Function::Sin => a.sin(),
                    Function::Cos => a.cos(),
                    Function::Tan => a.tan(),
                    Function::Tanh => a.tanh(),
                    Function::Atan2 => a.atan2(argument(1)),
                    Function::Min => a.min(argument(1)),
                    Function::Max => a.max(argument(1)),
                    Function::Play | Function::StickSlip | Function::StayBetween => a,
                    Function::Quantise => quantised(a, argument(1)),
                }
            }
            Self::If(condition, a, b) => {
                if condition.holds(time, of) {
                    a.value(time, of)
                } else {
                    b.value(time, of)
                }
            }
            Self::Delay(a, _) => a.value(time, of),
        }
    }
}

/// The multiple of a step that is nearest to a value; the value itself where the step is zero.
pub(crate) fn quantised(value: f64, step: f64) -> f64 {
    if step == 0.0 {
        value
    } else {
        step * (value / step).round()
    }
}

impl Condition {
    /// As [`Expression::with`].
    #[must_use]
    pub fn with(&self, of: &impl Fn(Variable) -> Expression) -> Self {
        let part = |a: &Self| Box::new(a.with(of));
        match self {
            Self::Constant(value) => Self::Constant(*value),
            Self::Compare(comparison, a, b) => {
                Self::Compare(*comparison, Box::new(a.with(of)), Box::new(b.with(of)))
            }
            Self::Not(a) => Self::Not(part(a)),
            Self::And(a, b) => Self::And(part(a), part(b)),
            Self::Or(a, b) => Self::Or(part(a), part(b)),
        }
    }

    /// As [`Expression::each_part`].
    pub fn each_part<'a>(&'a self, each: &mut impl FnMut(&'a Expression)) {
        match self {
            Self::Constant(_) => {}
            Self::Compare(_, a, b) => {
                a.each_part(each);
                b.each_part(each);
            }
            Self::Not(a) => a.each_part(each),
            Self::And(a, b) | Self::Or(a, b) => {
                a.each_part(each);
                b.each_part(each);
            }
        }
    }

    /// As [`Expression::each_variable`].
    pub fn each_variable(&self, each: &mut impl FnMut(Variable)) {
        self.each_part(&mut |part| {
            if let Expression::Variable(variable) = part {
                each(*variable);
            }
        });
    }

    /// As [`Expression::any`].
    pub fn any(&self, test: &impl Fn(&Expression) -> bool) -> bool {
        let mut found = false;
        self.each_part(&mut |part| found |= test(part));
        found
    }

    /// Whether the condition is true for these values of the variables.
    #[must_use]
    pub fn holds(&self, time: f64, of: &impl Fn(Variable) -> f64) -> bool {
        match self {
            Self::Constant(value) => *value,
            Self::Compare(comparison, a, b) => {
                let (a, b) = (a.value(time, of), b.value(time, of));
                match comparison {
                    Comparison::Less => a < b,
                    Comparison::LessOrEqual => a <= b,
                    Comparison::Greater => a > b,
                    Comparison::GreaterOrEqual => a >= b,
                    Comparison::Equal => a == b,
                    Comparison::NotEqual => a != b,
                }
            }
            Self::Not(a) => !a.holds(time, of),
            Self::And(a, b) => a.holds(time, of) && b.holds(time, of),
            Self::Or(a, b) => a.holds(time, of) || b.holds(time, of),
        }
    }
}
