//! `stiction_backlash`: what the command moves has play, or sticks and slips.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "stiction_backlash",
    place: Place::Actuator,
    physics: "What the command moves has play, or sticks until the command has moved on far enough and then slips.",
    equation: "pos stays while |u - pos| <= w (1 + j)/2, else pos = u - sign(u - pos) w (1 - j)/2; j = 0: backlash of width w, j = 1: stiction, it moves only when |u - pos| > w",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "Move the command up and down in small steps and watch the stem, or the jet: it stands still and then jumps.",
    source: "Q. P. He, J. Wang, M. Pottmann, S. J. Qin, A curve fitting method for detecting valve stiction in oscillating control loops, Ind. Eng. Chem. Res. 46, 2007.",
};

/// Widths that are tried, as shares of the range of the command. The position at one width says nothing of that at another
/// which is twice as large, and the slope of [`StictionBacklash::position`] reaches a twentieth of a width.
const WIDTHS: [f64; 6] = [0.02, 0.04, 0.08, 0.14, 0.22, 0.34];

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.scales.input;
    let span = (high - low).max(f64::MIN_POSITIVE);
    vec![
        ParameterInfo {
            name: "width",
            unit: Unit::INPUT,
            meaning: "play, or how far the command must move before anything does",
            absent: 0.0,
            lower: 0.0,
            upper: 0.6 * span,
            starts: WIDTHS.map(|share| share * span).to_vec(),
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
struct Element {
    width: f64,
    jump: f64,
    position: f64,
}

impl Element {
    fn follow(&mut self, u: f64) {
        let gap = u - self.position;
        if gap.abs() > 0.5 * self.width * (1.0 + self.jump) {
            self.position = u - gap.signum() * 0.5 * self.width * (1.0 - self.jump);
        }
    }
}

/// The slope of a position by its width is zero almost everywhere for an element that slips, and so is that by the jump: the
/// position changes where a slip is won or lost. The slopes are therefore those of a chord: elements a little narrower and
/// wider, and of a little less and more jump, follow the same command beside it.
struct StictionBacklash<T> {
    width: T,
    jump: T,
    /// The element itself, the narrower, the wider, that of less and that of more jump.
    elements: [Element; 5],
    begun: bool,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let (width, jump) = (parameters[0], parameters[1]);
    let (w, j) = (width.value(), jump.value());
    let (low, high) = site.scales.input;
    // At no width at all the chord is short and lies on the one side that there is.
    let reach = (VARIED * w).max(1e-6 * (high - low).abs());
    let at = |width: f64, jump: f64| Element { width: width.max(0.0), jump: jump.clamp(0.0, 1.0), position: 0.0 };
    let elements = [at(w, j), at(w - reach, j), at(w + reach, j), at(w, j - VARIED), at(w, j + VARIED)];
    StictionBacklash { width, jump, elements, begun: false }
}

impl<T: Scalar> Law<T> for StictionBacklash<T> {
    fn position(&mut self, u: f64) -> Option<T> {
        for element in &mut self.elements {
            if self.begun {
                element.follow(u);
            } else {
                element.position = u;
            }
        }
        self.begun = true;
        let [own, narrower, wider, less, more] = self.elements;
        let by_width = (wider.position - narrower.position) / (wider.width - narrower.width);
        let by_jump = (more.position - less.position) / (more.jump - less.jump);
        let (width, jump) = (self.width - self.width.value(), self.jump - self.jump.value());
        Some(width * by_width + jump * by_jump + own.position)
    }
}
