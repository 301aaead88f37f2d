//! `stiction_backlash`: what the command moves has play, or sticks and slips.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "stiction_backlash",
    place: Place::Actuator,
    by_clock: false,
    physics: "What the command moves has play, or sticks until the command has moved on far enough and then slips.",
    equation: "pos stays while |u - pos| <= w (1 + j)/2, else pos = u - sign(u - pos) w (1 - j)/2; j = 0: backlash of width w, j = 1: stiction, it moves only when |u - pos| > w",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "Move the command up and down in small steps and watch the stem, or the jet: it stands still and then jumps.",
    source: "Q. P. He, J. Wang, M. Pottmann, S. J. Qin, A curve fitting method for detecting valve stiction in oscillating control loops, Ind. Eng. Chem. Res. 46, 2007.",
};

/// Widths that are tried, as shares of the range of the command: the least, how many, and the factor from one to the next. Where
/// it sticks the error is in plain sight only within a tenth of the true width, so the grid has to be this fine.
const WIDTHS: (f64, i32, f64) = (0.03, 15, 1.2);

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.input();
    let span = (high - low).max(f64::MIN_POSITIVE);
    vec![
        ParameterInfo {
            name: "width",
            unit: Unit::INPUT,
            meaning: "play, or how far the command must move before anything does",
            absent: 0.0,
            lower: 0.0,
            upper: 0.6 * span,
            starts: (0..WIDTHS.1).map(|i| WIDTHS.0 * WIDTHS.2.powi(i) * span).collect(),
        },
        ParameterInfo {
            name: "jump",
            unit: Unit::ONE,
            meaning: "share of the width by which it jumps when it moves; 0: backlash, 1: stiction",
            absent: f64::NAN,
            lower: 0.0,
            upper: 1.0,
            starts: vec![0.0, 1.0],
        },
    ]
}

/// How far a width is varied for its slope.
const VARIED: f64 = 0.05;

/// One element that sticks.
#[derive(Clone, Copy)]
struct Element<T> {
    width: f64,
    jump: f64,
    position: T,
}

impl<T: Scalar> Element<T> {
    fn follow(&mut self, u: T) {
        let gap = u.value() - self.position.value();
        if gap.abs() > 0.5 * self.width * (1.0 + self.jump) {
            self.position = u - gap.signum() * 0.5 * self.width * (1.0 - self.jump);
        }
    }
}

/// The slope of a position by its width is zero almost everywhere for an element that slips: the position changes where a slip is
/// won or lost. The slope is therefore that of a chord: an element a little narrower and one a little wider follow the same
/// command beside it. Which of the two it is, backlash or stiction, is a choice, made by the starts; it has no slope, and
/// a fit does not move it.
struct StictionBacklash<T> {
    width: T,
    element: Element<T>,
    narrower: Element<T>,
    wider: Element<T>,
    begun: bool,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let (width, jump) = (parameters[0].value(), parameters[1].value());
    let (low, high) = site.input();
    // At no width at all the chord is short and lies on the one side that there is.
    let reach = (VARIED * width).max(1e-6 * (high - low).abs());
    let at = |width: f64| Element { width: width.max(0.0), jump, position: T::constant(0.0) };
    StictionBacklash {
        width: parameters[0],
        element: at(width),
        narrower: at(width - reach),
        wider: at(width + reach),
        begun: false,
    }
}

impl<T: Scalar> Law<T> for StictionBacklash<T> {
    fn position(&mut self, u: T) -> Option<T> {
        let begun = std::mem::replace(&mut self.begun, true);
        for element in [&mut self.element, &mut self.narrower, &mut self.wider] {
            if begun {
                element.follow(u);
            } else {
                element.position = u;
            }
        }
        let apart = self.wider.position.value() - self.narrower.position.value();
        let chord = apart / (self.wider.width - self.narrower.width);
        Some((self.width - self.width.value()) * chord + self.element.position)
    }
}
