//! `quantisation(y)`: the converter's steps are coarse.
//!
//! Noise before the rounding acts as dither: the mean reading is then a smooth function. The first six terms of its Fourier series are
//! accurate to 1e-3 of the step if the standard deviation of the noise is at least 0.08 steps; with less noise it is the rounded value.
//!
//! **Reference**: B. Widrow, I. Kollar, Quantization Noise, Cambridge 2008, ch. 4 and 19.

use crate::effects::{Effect, Place, Role, Starts};

pub(super) const EFFECT: Effect = Effect {
    id: "quantisation",
    place: Place::Output,
    text: r#"
model quantisation
  input Real y;
  constant Real width(unit="signal") = 1;
  final parameter Real dither(min=0, max=1) = 0 "standard deviation of the noise before the rounding, as a share of the step";
  parameter Real step(unit="port", min=0, max=width) = 0 "distance of two readings";
  output Real v(unit="port") = if step > 0 and dither > 0.08 then y - step/3.141592653589793*(exp(-2*(3.141592653589793*dither)^2)*sin(2*3.141592653589793*y/step) - exp(-8*(3.141592653589793*dither)^2)*sin(4*3.141592653589793*y/step)/2 + exp(-18*(3.141592653589793*dither)^2)*sin(6*3.141592653589793*y/step)/3 - exp(-32*(3.141592653589793*dither)^2)*sin(8*3.141592653589793*y/step)/4 + exp(-50*(3.141592653589793*dither)^2)*sin(10*3.141592653589793*y/step)/5 - exp(-72*(3.141592653589793*dither)^2)*sin(12*3.141592653589793*y/step)/6) else quantise(y, step);
end quantisation;
"#,
    parameters: &[
        // The scatter of readings that are rounded with noise depends on the reading: in a search, which takes it as constant, a smooth
        // staircase leads to false effects. The readings give the value, and not a fit.
        ("dither", Role::Choice, Starts::Values(&[0.0])),
        ("step", Role::Threshold, Starts::Widths(&[0.01, 0.03, 0.1])),
    ],
    physics: "The reading is rounded to steps that are not small compared with the noise.",
    confused_with: &["hysteresis(y)"],
    confirm: "List the values that the readings take: are they multiples of one step?",
    symptoms: &["stairs", "few different values", "coarse resolution"],
};
