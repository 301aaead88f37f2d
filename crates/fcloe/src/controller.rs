//! The controller of the loop, known.
//!
//! Model: `u = R/S (r - y)` (Baysse, Carrillo, Habbadi, (2)), proper. With a known sensor filter `zeta/(p + zeta)` in
//! front of the controller, `y` is the filtered signal, which is the one that is recorded; the loop then is the one
//! of `R' = zeta R`, `S' = S (p + zeta)`: [`Controller::r`] and [`Controller::s`] are these. Ignored, such a filter
//! biases the gain by 4 to 30 %.
//!
//! The digits matter: with a PI of rounded coefficients on data of the unrounded one (0.0021 for 1/480), a gain of 6

use ct_lti::{Polynomial, TransferFunction};

use crate::Error;

/// `R/S`, or none: in open loop u is the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// R and S without the sensor's filter.
    law: (Polynomial, Polynomial),
    filter: Polynomial,
    r: Polynomial,
    s: Polynomial,
}

impl Controller {
    /// `u = R/S (r - y)`. R = 0 is [`Controller::none`].
    ///
    /// # Errors
    /// [`Error::ImproperController`], [`Error::Lti`] for S = 0 or coefficients that are not finite.
    pub fn new(r: Polynomial, s: Polynomial) -> Result<Self, Error> {
        if r.is_zero() && !s.is_zero() {
            return Ok(Self::none());
        }
        let (degree_r, degree_s) = (r.degree().unwrap_or(0), s.degree().unwrap_or(0));
        if degree_r > degree_s {
            return Err(Error::ImproperController {
                r: degree_r,
                s: degree_s,
            });
        }
        // Rejects what is no transfer function.
        TransferFunction::new(r.clone(), s.clone())?;
        Ok(Self {
            law: (r.clone(), s.clone()),
            filter: Polynomial::one(),
            r,
            s,
        })
    }

    /// No controller, R = 0: the model is driven by the measured u, and the method is output error.
    pub fn none() -> Self {
        Self {
            law: (Polynomial::zero(), Polynomial::one()),
            filter: Polynomial::one(),
            r: Polynomial::zero(),
            s: Polynomial::one(),
        }
    }

    /// `Kp + Ki/p`.
    ///
    /// # Errors
    /// [`Error::Lti`] for numbers that are not finite.
    pub fn pi(kp: f64, ki: f64) -> Result<Self, Error> {
        Self::new(Polynomial::new([ki, kp])?, Polynomial::p())
    }

    /// `Kp + Ki/p + Kd p/(1 + Tf p)`, `Tf > 0` \[time\].
    ///
    /// # Errors
    /// [`Error::Setting`] for Tf, [`Error::Lti`] for numbers that are not finite.
    pub fn pid(kp: f64, ki: f64, kd: f64, tf: f64) -> Result<Self, Error> {
        positive("the derivative's time constant Tf", tf)?;
        Self::new(
            Polynomial::new([ki, kp + ki * tf, kp * tf + kd])?,
            Polynomial::new([0.0, 1.0, tf])?,
        )
    }

    /// The same controller after a sensor filter `zeta/(p + zeta)`, zeta in \[1/time\]; y is the filtered signal.
    ///
    /// # Errors
    /// [`Error::Setting`]; [`Error::FilterWithoutLoop`] in open loop.
    pub fn with_sensor_filter(mut self, zeta: f64) -> Result<Self, Error> {
        positive("the sensor filter's bandwidth zeta", zeta)?;
        if self.is_open_loop() {
            return Err(Error::FilterWithoutLoop { zeta });
        }
        let pole = Polynomial::new([zeta, 1.0])?;
        self.r = &self.r * zeta;
        self.s = &self.s * &pole;
        // The command before the filter: u = (p + zeta)/zeta times the signal that enters the product above.
        self.filter = &self.filter * &(&pole * (1.0 / zeta));
        Ok(self)
    }

    /// R of the loop, a sensor's filter absorbed.
    pub fn r(&self) -> &Polynomial {
        &self.r
    }

    /// S of the loop, a sensor's filter absorbed.
    pub fn s(&self) -> &Polynomial {
        &self.s
    }

    /// From `r - y`, y as recorded, to u: R/S as given, without the sensor's filter.
    ///
    /// # Errors
    /// None for a controller that was made here; the type is that of [`TransferFunction::new`].
    pub fn law(&self) -> Result<TransferFunction, Error> {
        Ok(TransferFunction::new(
            self.law.0.clone(),
            self.law.1.clone(),
        )?)
    }

    /// `(p + zeta)/zeta` of the sensor's filter, 1 without one.
    pub(crate) fn filter(&self) -> &Polynomial {
        &self.filter
    }

    /// Whether R = 0.
    pub fn is_open_loop(&self) -> bool {
        self.r.is_zero()
    }
}

pub(crate) fn positive(what: &'static str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::Setting {
        what,
        value,
        range: "finite and above 0",
    })
}
