//! A user-defined term for a part that the model lacks: a polyline in one variable.
//!
//! `f(v) = s sum_i a_i hat_i(v)`: ordinates `a_i` at knots of the variable `v`, linear in between, constant beyond the outermost knots,
//! because nothing is known there. It is added
//! - at the actuator to the command \[input unit\]; `v` is the command or the time;
//! - in a vessel to the net inflow \[flow\]; `v` is the level, the net inflow itself (sign and magnitude of the level's rate) or the time;
//! - at the sensor to the reading \[level unit\]; `v` is the reading or the time.
//!
//! **Fitted parameter**: by default only the scale `s`: one if the shape is right as given, zero if the term is absent. Free ordinates
//! would not be identifiable: a change of the pump gain is a line in the command, and a change of the outflow coefficient is close to any
//! smooth shape in the level. The scale also tests the shape on any other record. [`Fitted::Ordinates`] fits the shape itself; the user
//! then has to remove this ambiguity.

use crate::{
    Balance, Error, Law, ParameterInfo, Place, Plant, Scalar, Scales, Structure, Unit, effects,
};

/// Largest number of knots of a term.
pub const MOST_KNOTS: usize = 512;

/// The variable of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Variable {
    /// The level of the vessel, or the reading at the sensor \[level unit\].
    Level,
    /// The net inflow of the vessel \[flow\]; its sign is the sign of the level's rate.
    Rate,
    /// The command \[input unit\].
    Input,
    /// Time since the record began \[s\].
    Time,
}

impl Variable {
    /// All variables.
    pub const ALL: [Self; 4] = [Self::Level, Self::Rate, Self::Input, Self::Time];

    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Level => "level",
            Self::Rate => "rate",
            Self::Input => "input",
            Self::Time => "time",
        }
    }

    /// The variables on which a term may depend at a place.
    #[must_use]
    pub fn at(place: Place) -> &'static [Self] {
        match place {
            Place::Actuator => &[Self::Input, Self::Time],
            Place::Vessel => &[Self::Level, Self::Rate, Self::Time],
            Place::Sensor => &[Self::Level, Self::Time],
        }
    }

    /// The unit of the variable.
    #[must_use]
    pub fn unit(self) -> Unit {
        match self {
            Self::Level => Unit::LEVEL,
            Self::Rate => Unit::FLOW,
            Self::Input => Unit::INPUT,
            Self::Time => Unit::TIME,
        }
    }
}

/// Which parameters of a term a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fitted {
    /// One common factor of all ordinates.
    Scale,
    /// Every ordinate.
    Ordinates,
}

/// A user-defined term.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Name: letters, digits and underscores; not a name of the catalogue.
    pub name: String,
    /// The place where the term acts.
    pub place: Place,
    /// Index of the vessel or, at the sensor, of the output; zero for the actuator.
    pub vessel: usize,
    /// The variable of the term.
    pub variable: Variable,
    /// Knots in increasing order, 1 to [`MOST_KNOTS`] of them \[unit of the variable\].
    pub knots: Vec<f64>,
    /// Ordinates at the knots, in [`Term::unit`].
    pub ordinates: Vec<f64>,
    /// The fitted parameters.
    pub fitted: Fitted,
}

impl Term {
    /// The unit of the ordinates.
    #[must_use]
    pub fn unit(&self) -> Unit {
        match self.place {
            Place::Actuator => Unit::INPUT,
            Place::Vessel => Unit::FLOW,
            Place::Sensor => Unit::LEVEL,
        }
    }

    /// The value of the term for a scale of one.
    #[must_use]
    pub fn value(&self, at: f64) -> f64 {
        polyline(&self.knots, &self.ordinates, at)
    }

    /// The parameters, in the order in which the simulator takes them.
    #[must_use]
    pub fn parameters(&self, scales: &Scales) -> Vec<ParameterInfo> {
        if self.fitted == Fitted::Scale {
            return vec![ParameterInfo {
                name: "scale",
                unit: Unit::ONE,
                meaning: "factor on the shape",
                absent: 0.0,
                lower: -1.0,
                upper: 3.0,
                starts: vec![1.0],
            }];
        }
        let reach = 1e3
            * match self.place {
                Place::Actuator => scales.input_range.abs(),
                Place::Vessel => scales.flow.abs(),
                Place::Sensor => scales.largest_level(),
            };
        let ordinate = |name: &'static String| ParameterInfo {
            name,
            unit: self.unit(),
            meaning: "value at a knot",
            absent: 0.0,
            lower: -reach,
            upper: reach,
            starts: vec![0.0],
        };
        ORDINATES
            .iter()
            .take(self.knots.len())
            .map(ordinate)
            .collect()
    }

    /// Checks that the term is valid for a plant.
    ///
    /// # Errors
    /// If its name, place, variable or numbers are not valid.
    pub fn check(&self, plant: Plant) -> Result<(), Error> {
        let refuse = |what: String| {
            Err(Error::Term {
                term: self.name.clone(),
                what,
            })
        };
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !self.name.starts_with(|c: char| c.is_ascii_alphabetic())
            || !self.name.chars().all(letter)
        {
            return refuse(
                "a name begins with a letter and holds letters, digits and underscores alone"
                    .into(),
            );
        }
        if effects::EffectInfo::find(&self.name).is_some() || self.name == "none" {
            return refuse("the catalogue has an effect of that name: give another".into());
        }
        if !Variable::at(self.place).contains(&self.variable) {
            let may: Vec<_> = Variable::at(self.place).iter().map(|v| v.name()).collect();
            return refuse(format!(
                "at the {} a term cannot depend on {}: take one of {}",
                self.place.name(),
                self.variable.name(),
                may.join(", ")
            ));
        }
        if self.vessel >= plant.vessels() || (self.place == Place::Actuator && self.vessel != 0) {
            return refuse(format!(
                "it cannot act there: plant `{}` has {} of vessels",
                plant.id(),
                plant.vessels()
            ));
        }
        let (knots, ordinates) = (self.knots.len(), self.ordinates.len());
        if knots != ordinates || knots == 0 || knots > MOST_KNOTS {
            return refuse(format!(
                "{knots} knots and {ordinates} values: as many of both, from 1 to {MOST_KNOTS}"
            ));
        }
        if let Some(value) = self
            .knots
            .iter()
            .chain(&self.ordinates)
            .find(|v| !v.is_finite())
        {
            return refuse(format!("{value} is not a finite number"));
        }
        if let Some(pair) = self.knots.windows(2).find(|pair| pair[0] >= pair[1]) {
            return refuse(format!(
                "knot {} follows {}: knots have to rise",
                pair[1], pair[0]
            ));
        }
        Ok(())
    }
}

static ORDINATES: std::sync::LazyLock<Vec<String>> =
    std::sync::LazyLock::new(|| (1..=MOST_KNOTS).map(|i| format!("at_{i}")).collect());

/// The polyline through the ordinates at a point, constant beyond the outermost knots.
fn polyline<T: Scalar>(knots: &[f64], ordinates: &[T], at: T) -> T {
    let above = knots.partition_point(|knot| *knot <= at.value());
    match (
        above.checked_sub(1).map(|i| ordinates[i]),
        ordinates.get(above),
    ) {
        (Some(low), Some(high)) => {
            let from = knots[above - 1];
            low + (*high - low) * ((at - from) * (1.0 / (knots[above] - from)))
        }
        (Some(end), None) => end,
        (None, Some(end)) => *end,
        (None, None) => T::constant(0.0),
    }
}

struct TermLaw<T> {
    variable: Variable,
    knots: Vec<f64>,
    ordinates: Vec<T>,
}

/// The law of a term with numerical parameters, in the order of [`Term::parameters`].
pub(crate) fn bind<T: Scalar>(term: &Term, parameters: &[T]) -> Box<dyn Law<T>> {
    let ordinates = match term.fitted {
        Fitted::Ordinates => parameters.to_vec(),
        Fitted::Scale => term.ordinates.iter().map(|a| parameters[0] * *a).collect(),
    };
    Box::new(TermLaw {
        variable: term.variable,
        knots: term.knots.clone(),
        ordinates,
    })
}

impl<T: Scalar> TermLaw<T> {
    /// `own`: the signal to which the term is added.
    fn value(&self, own: T, level: T, t: T) -> T {
        let at = match self.variable {
            Variable::Level => level,
            Variable::Rate | Variable::Input => own,
            Variable::Time => t,
        };
        polyline(&self.knots, &self.ordinates, at)
    }
}

impl<T: Scalar> Law<T> for TermLaw<T> {
    fn command(&mut self, u: T, t: f64) -> T {
        u + self.value(u, u, T::constant(t))
    }
    fn changes(&self) -> Option<Balance> {
        Some(match self.variable {
            Variable::Level => Balance::NetByLevel,
            _ => Balance::Net,
        })
    }
    fn net(&self, level: &T, net: &mut T, t: &T) {
        *net = *net + self.value(*net, *level, *t);
    }
    fn reading(&mut self, y: T, t: f64) -> T {
        y + self.value(y, y, T::constant(t))
    }
}

impl Structure {
    /// The active user-defined terms; they act after the catalogue's effects at their place.
    #[must_use]
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// The same structure with one more term.
    ///
    /// # Errors
    /// If [`Term::check`] rejects the term, or a term of that name exists.
    pub fn with_term(&self, term: Term) -> Result<Self, Error> {
        term.check(self.plant)?;
        let outputs = self.scales.outputs.len();
        if term.place == Place::Sensor && term.vessel >= outputs {
            return Err(Error::Term {
                what: format!(
                    "it cannot act at output {}: there are {outputs}",
                    term.vessel + 1
                ),
                term: term.name,
            });
        }
        if self.terms.iter().any(|on| on.name == term.name) {
            return Err(Error::Term {
                term: term.name,
                what: "it is listed twice: delete one of them".to_string(),
            });
        }
        let mut with = self.clone();
        with.terms.push(term);
        Ok(with)
    }
}
