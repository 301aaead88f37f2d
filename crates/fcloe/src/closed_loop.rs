//! The loop of a plant and a controller.
//!
//! Equations (Baysse, Carrillo, Habbadi, (4), (10), (13)): `P = A S + B R`, `y = B R/P r`, `u = A R/P r`, and a
//! disturbance w of the output is seen as `A S/P w`. In open loop (R = 0, S = 1): `P = A`, `y = B/P u`.

use ct_lti::{Polynomial, TransferFunction};

use crate::{Controller, Error, PlantModel};

/// The polynomials of a loop.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    characteristic: Polynomial,
    output: Polynomial,
    input: Polynomial,
    disturbance: Polynomial,
}

impl ClosedLoop {
    /// Loop of this plant and this controller.
    ///
    /// # Errors
    /// [`Error::Lti`] where the direct terms of plant and controller leave the loop without a solution, or where
    /// products of coefficients leave the range of `f64`.
    pub fn new(plant: &PlantModel, controller: &Controller) -> Result<Self, Error> {
        let (a, b) = (plant.a_polynomial(), plant.b_polynomial());
        let (r, s) = (controller.r(), controller.s());
        let order = plant.orders().n + s.degree().unwrap_or(0);
        let characteristic = &(&a * s) + &(&b * r);
        if characteristic.degree() != Some(order) {
            let forward = plant.transfer_function()?.direct_term();
            let backward = r.coefficient(s.degree().unwrap_or(0)) / s.leading();
            return Err(ct_lti::Error::AlgebraicLoop {
                forward,
                backward,
                determinant: 1.0 + forward * backward,
            }
            .into());
        }
        let open = controller.is_open_loop();
        let output = if open { b } else { &b * r };
        let input = if open {
            characteristic.clone()
        } else {
            &(&a * r) * controller.filter()
        };
        let this = Self {
            output,
            input,
            disturbance: &a * s,
            characteristic,
        };
        // Rejects polynomials that overflowed.
        this.output()?;
        this.input()?;
        this.disturbance()?;
        Ok(this)
    }

    /// P = A S + B R, of degree `n + deg S`.
    pub fn characteristic(&self) -> &Polynomial {
        &self.characteristic
    }

    /// Whether all roots of P have a real part below 0, decided exactly.
    pub fn is_stable(&self) -> bool {
        self.characteristic.is_hurwitz()
    }

    /// Refuses a loop that is not stable.
    ///
    /// # Errors
    /// [`Error::UnstableLoop`].
    pub fn require_stable(&self) -> Result<(), Error> {
        if self.is_stable() {
            return Ok(());
        }
        let roots = self.characteristic.roots()?;
        Err(Error::UnstableLoop {
            real_part: roots.last().map_or(f64::NAN, |z| z.re),
        })
    }

    /// From r to y, `B R/P`; in open loop from u to y, `B/A`.
    ///
    /// # Errors
    /// [`Error::Lti`] for coefficients out of range.
    pub fn output(&self) -> Result<TransferFunction, Error> {
        Ok(TransferFunction::new(
            self.output.clone(),
            self.characteristic.clone(),
        )?)
    }

    /// From r to u, `A R/P`, before the sensor's filter where there is one; 1 in open loop.
    ///
    /// # Errors
    /// [`Error::Lti`] for coefficients out of range.
    pub fn input(&self) -> Result<TransferFunction, Error> {
        Ok(TransferFunction::new(
            self.input.clone(),
            self.characteristic.clone(),
        )?)
    }

    /// From a disturbance w that is added to the output inside the loop to y, `A S/P`; 1 in open loop.
    ///
    /// # Errors
    /// [`Error::Lti`] for coefficients out of range.
    pub fn disturbance(&self) -> Result<TransferFunction, Error> {
        Ok(TransferFunction::new(
            self.disturbance.clone(),
            self.characteristic.clone(),
        )?)
    }
}
