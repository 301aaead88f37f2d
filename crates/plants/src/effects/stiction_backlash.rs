//! `stiction_backlash`: the actuator has backlash or stiction.

use super::{EffectInfo, Place, any_plant};
use crate::{Law, ParameterInfo, Scalar, Site, Unit};

pub(super) const INFO: EffectInfo = EffectInfo {
    id: "stiction_backlash",
    place: Place::Actuator,
    by_clock: false,
    physics: "What the command moves has play, or sticks until the command has moved on far enough and then slips.",
    general: Some("the actuator has play, or sticks and then slips"),
    at_ports: &["backlash(u)"],
    equation: "pos stays while |u - pos| <= w (1 + j)/2, else pos = u - sign(u - pos) w (1 - j)/2; j = 0: backlash of width w, j = 1: stiction, it moves only when |u - pos| > w; the record begins with pos = u + b w (1 + j)/2",
    applies: any_plant,
    parameters,
    confused_with: &[],
    confirm: "Move the command up and down in small steps and watch the stem, or the jet: it stands still and then jumps.",
    source: "Q. P. He, J. Wang, M. Pottmann, S. J. Qin, A curve fitting method for detecting valve stiction in oscillating control loops, Ind. Eng. Chem. Res. 46, 2007.",
};

/// Start values of the width, as shares of the range of the command, in two geometric grids: smallest value, number, and ratio. With
/// stiction, the cost has a visible minimum only within a tenth of the true width, so the grid is this fine. For widths near the range of
/// the command, the actuator moves only at extreme commands, and the grid is finer. The largest start is nearly twice the range: a valve
/// with so wide a band moves only if it begins near an end of the band.
const WIDTHS: [(f64, i32, f64); 2] = [(0.03, 14, 1.2), (0.38, 18, 1.1)];
/// Upper bound of the width, as a share of the range of the command. Beyond it, a sticking valve moves only if it begins at an end of its
/// band, and the width and the initial position cannot be identified separately.
const WIDEST: f64 = 2.2;

fn parameters(site: &Site) -> Vec<ParameterInfo> {
    let (low, high) = site.input();
    let span = (high - low).max(f64::MIN_POSITIVE);
    let shares = WIDTHS.iter().flat_map(|&(least, count, factor)| (0..count).map(move |i| least * factor.powi(i)));
    vec![
        ParameterInfo {
            name: "width",
            unit: Unit::INPUT,
            meaning: "play, or how far the command must move before anything does",
            absent: 0.0,
            lower: 0.0,
            upper: WIDEST * span,
            starts: shares.map(|share| share * span).collect(),
        },
        ParameterInfo {
            name: "jump",
            unit: Unit::ONE,
            meaning: "share of the width by which it jumps when it moves; 0: backlash, 1: stiction",
            absent: f64::NAN,
            lower: 0.0,
            upper: 1.0,
            starts: vec![0.0, 0.5, 1.0],
        },
        ParameterInfo {
            name: "begin",
            unit: Unit::ONE,
            meaning: "position within the band when the record begins; 0: at the command, -1 and 1: at an end of the band",
            absent: f64::NAN,
            lower: -1.0,
            upper: 1.0,
            starts: vec![-0.95, -0.5, 0.0, 0.5, 0.95],
        },
    ]
}

/// Perturbation for the derivatives by finite differences: of the width, relative; of `begin`, absolute.
const PERTURBATION: f64 = 0.05;

/// One element with stiction or backlash.
#[derive(Clone, Copy)]
struct Element<T> {
    width: f64,
    jump: f64,
    begin: f64,
    position: T,
}

impl<T: Scalar> Element<T> {
    /// Half the width of the band in which the element does not move.
    fn half_band(&self) -> f64 {
        0.5 * self.width * (1.0 + self.jump)
    }

    fn begin_at(&mut self, u: T) {
        self.position = u + self.begin * self.half_band();
    }

    fn follow(&mut self, u: T) {
        let gap = u.value() - self.position.value();
        if gap.abs() > self.half_band() {
            self.position = u - gap.signum() * 0.5 * self.width * (1.0 - self.jump);
        }
    }
}

/// Two elements, perturbed upwards and downwards in one parameter.
#[derive(Clone, Copy)]
struct Varied<T> {
    below: Element<T>,
    above: Element<T>,
    /// Inverse of the parameter's difference between the two elements.
    inverse: f64,
}

impl<T: Scalar> Varied<T> {
    fn chord(&self) -> f64 {
        (self.above.position.value() - self.below.position.value()) * self.inverse
    }
}

/// For an element with stiction, the derivative of the position by the width is zero almost everywhere: the position changes only where a
/// slip occurs or no longer occurs. A finite difference is used instead: a slightly narrower and a slightly wider element follow the same
/// command. The derivative by `begin` is computed in the same way. The choice between backlash and stiction is made by the starts; it has
/// no derivative, and a fit does not change it.
struct StictionBacklash<T> {
    width: T,
    begin: T,
    element: Element<T>,
    by_width: Varied<T>,
    by_begin: Varied<T>,
    begun: bool,
}

pub(super) fn bind<T: Scalar>(site: &Site, parameters: &[T]) -> impl Law<T> + use<T> {
    let [width, jump, begin] = [0, 1, 2].map(|i: usize| parameters[i].value());
    let (low, high) = site.input();
    let element = Element { width, jump, begin, position: T::constant(0.0) };
    // At a width of zero the difference is one-sided, with a small perturbation.
    let reach = (PERTURBATION * width).max(1e-6 * (high - low).abs());
    let (narrower, wider) = ((width - reach).max(0.0), width + reach);
    // At an end of the band the difference is one-sided.
    let (lower, upper) = ((begin - PERTURBATION).max(-1.0), (begin + PERTURBATION).min(1.0));
    StictionBacklash {
        width: parameters[0],
        begin: parameters[2],
        element,
        by_width: Varied {
            below: Element { width: narrower, ..element },
            above: Element { width: wider, ..element },
            inverse: 1.0 / (wider - narrower),
        },
        by_begin: Varied {
            below: Element { begin: lower, ..element },
            above: Element { begin: upper, ..element },
            inverse: 1.0 / (upper - lower),
        },
        begun: false,
    }
}

impl<T: Scalar> Law<T> for StictionBacklash<T> {
    fn position(&mut self, u: T) -> Option<T> {
        let begun = std::mem::replace(&mut self.begun, true);
        let Varied { below: narrower, above: wider, .. } = &mut self.by_width;
        let Varied { below: lower, above: upper, .. } = &mut self.by_begin;
        for element in [&mut self.element, narrower, wider, lower, upper] {
            if begun {
                element.follow(u);
            } else {
                element.begin_at(u);
            }
        }
        Some(
            (self.width - self.width.value()) * self.by_width.chord()
                + (self.begin - self.begin.value()) * self.by_begin.chord()
                + self.element.position,
        )
    }
}
