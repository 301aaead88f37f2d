//! The simple function closest to a polyline, and the effects of the catalogue with such a shape.

use nalgebra::{DMatrix, DVector};
use plants::{Domain, EffectInfo, Place, Variable};

use crate::{Primitive, result::SHAPES};

/// A simple function explains a polyline if its residual is below this share of the polyline's information.
const LEFT: f64 = 0.2;
/// Penalty of a location in the deviance, as in a likelihood ratio test with one degree of freedom at 1 %.
const LOCATION: f64 = 6.6;

/// A family of shapes: value of the shape at a point, for a location.
struct Family {
    name: &'static str,
    located: bool,
    columns: fn(f64, f64) -> [f64; 2],
}

const FAMILIES: [Family; SHAPES.len()] = [
    Family {
        name: "constant",
        located: false,
        columns: |_, _| [1.0, 0.0],
    },
    Family {
        name: "line",
        located: false,
        columns: |v, _| [v, 1.0],
    },
    Family {
        name: "square root",
        located: false,
        columns: |v, _| [v.max(0.0).sqrt(), 0.0],
    },
    Family {
        name: "parabola",
        located: false,
        columns: |v, _| [v * v, v],
    },
    Family {
        name: "threshold",
        located: true,
        columns: |v, c| [(v - c).max(0.0), 0.0],
    },
    Family {
        name: "end of a range",
        located: true,
        columns: |v, c| [(c - v).max(0.0), 0.0],
    },
    Family {
        name: "step",
        located: true,
        columns: |v, c| [f64::from(u8::from(v > c)), 0.0],
    },
    Family {
        name: "swing",
        located: true,
        columns: |v, period| {
            let turn = std::f64::consts::TAU * v / period;
            [turn.sin(), turn.cos()]
        },
    },
];

/// The closest simple function, weighted by the information, in which directions that the plant's own parameters explain have no weight;
/// `None` if none is close.
pub(super) fn nearest(
    domain: Domain,
    (place, variable): (Place, Variable),
    knots: &[f64],
    ordinates: &[f64],
    information: &DMatrix<f64>,
) -> Option<Primitive> {
    let a = DVector::from_row_slice(ordinates);
    let told = a.dot(&(information * &a));
    // The function is not significant beyond the part that the plant's parameters can explain.
    if told < LOCATION {
        return None;
    }
    let (low, high) = (*knots.first()?, *knots.last()?);
    let mut best: Option<(f64, f64, &Family, f64)> = None;
    for family in &FAMILIES {
        let in_time = variable == Variable::Time;
        // A root or a parabola in time, or an oscillation in another variable, is no physics of a tank.
        if match family.name {
            "swing" => !in_time,
            "square root" | "parabola" => in_time,
            _ => false,
        } {
            continue;
        }
        let places: Vec<f64> = if !family.located {
            vec![0.0]
        } else if family.name == "swing" {
            (4..80).map(|i| (high - low) * 2.0 / f64::from(i)).collect()
        } else {
            (1..24)
                .map(|i| low + (high - low) * f64::from(i) / 24.0)
                .collect()
        };
        for c in places {
            let mut columns = DMatrix::zeros(knots.len(), 2);
            for (row, v) in knots.iter().enumerate() {
                let [first, second] = (family.columns)(*v, c);
                columns[(row, 0)] = first;
                columns[(row, 1)] = second;
            }
            let used = if columns.column(1).amax() > 0.0 { 2 } else { 1 };
            let columns = columns.columns(0, used).into_owned();
            let weighted = information * &columns;
            let normal = columns.tr_mul(&weighted);
            // The part that the plant's parameters can explain has no weight.
            let Ok(inverse) = normal.clone().pseudo_inverse(1e-9 * normal.amax()) else {
                continue;
            };
            let solved = inverse * weighted.tr_mul(&a);
            let rest = &a - &columns * solved;
            let left = rest.dot(&(information * &rest));
            let cost = left + LOCATION * (used as f64 + f64::from(u8::from(family.located)));
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, left, family, c));
            }
        }
    }
    let (_, left, family, c) = best?;
    (left < LEFT * told).then(|| Primitive {
        name: family.name,
        at: family.located.then_some(c),
        effects: leaves(domain, (place, variable), family.name),
    })
}

/// The effects with this shape, among those of the domain.
fn leaves(domain: Domain, (place, variable): (Place, Variable), shape: &str) -> Vec<&'static str> {
    let known: &[&'static str] = match (place, variable, shape) {
        (Place::Vessel, Variable::Time, "step") => &["valve_step"],
        (Place::Vessel, Variable::Time, "line") => &["valve_drift"],
        (Place::Vessel, Variable::Time, "swing") => &["periodic_disturbance"],
        (Place::Vessel, _, "constant") => &["const_leak"],
        (Place::Vessel, Variable::Level, "line") => &["laminar_outflow"],
        (Place::Vessel, Variable::Level, "square root") => &["sqrt_outflow"],
        (Place::Vessel, Variable::Level, "threshold") => &["leak_at_height", "overflow"],
        (Place::Vessel, Variable::Level, "parabola") => &["area_varies"],
        (Place::Vessel, Variable::Rate, _) => &["area_varies", "coupled_tank"],
        (Place::Actuator, Variable::Time, "line") => &["pump_gain_drift"],
        (Place::Actuator, _, "constant" | "end of a range") => &["pump_deadzone"],
        (Place::Actuator, Variable::Input, "threshold") => &["pump_saturation", "pump_deadzone"],
        (Place::Actuator, Variable::Input, "parabola") => &["pump_nonlinearity"],
        (Place::Sensor, Variable::Time, "line") => &["sensor_drift"],
        (Place::Sensor, _, "constant") => &["sensor_offset"],
        (Place::Sensor, Variable::Level, "threshold") => &["sensor_saturation"],
        (Place::Sensor, Variable::Level, "parabola") => &["sensor_nonlinearity"],
        (Place::Sensor, Variable::Level, "step") => &["sensor_hysteresis"],
        _ => &[],
    };
    known
        .iter()
        .copied()
        .filter(|id| EffectInfo::find(id).is_some_and(|effect| domain.offers(effect)))
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The closest simple function to a function at 13 knots with standard errors of 0.05.
    fn of(variable: Variable, range: (f64, f64), f: impl Fn(f64) -> f64) -> Option<Primitive> {
        let knots: Vec<f64> = (0..13)
            .map(|i| range.0 + (range.1 - range.0) * f64::from(i) / 12.0)
            .collect();
        let ordinates: Vec<f64> = knots.iter().map(|v| f(*v)).collect();
        let information = DMatrix::identity(13, 13) * 400.0;
        nearest(
            Domain::Hydraulic,
            (Place::Vessel, variable),
            &knots,
            &ordinates,
            &information,
        )
    }

    #[test]
    fn every_shape_is_read_back_from_a_result() {
        assert_eq!(FAMILIES.map(|family| family.name), SHAPES);
    }

    #[test]
    fn outside_hydraulics_a_shape_names_general_effects_alone() {
        let at = |domain, shape| leaves(domain, (Place::Vessel, Variable::Level), shape);
        assert_eq!(at(Domain::General, "constant"), ["const_leak"]);
        assert!(at(Domain::General, "threshold").is_empty());
        assert_eq!(at(Domain::Hydraulic, "threshold").len(), 2);
    }

    #[test]
    fn every_simple_shape_is_named_where_it_is() {
        let level = |f: fn(f64) -> f64| of(Variable::Level, (4.0, 16.0), f).unwrap();
        assert_eq!(level(|_| -2.0).name, "constant");
        assert_eq!(level(|_| -2.0).effects, ["const_leak"]);
        assert_eq!(level(|h| 1.0 - 0.4 * h).name, "line");
        assert_eq!(level(|h| -0.7 * h.sqrt()).name, "square root");
        assert_eq!(level(|h| 0.1 * h * h - h).name, "parabola");
        let threshold = level(|h| -1.5 * (h - 10.0).max(0.0));
        assert_eq!((threshold.name, threshold.at), ("threshold", Some(10.0)));
        assert!(threshold.effects.contains(&"overflow"));
        assert_eq!(level(|h| (8.0 - h).max(0.0)).name, "end of a range");
        assert_eq!(level(|h| if h > 9.5 { 3.0 } else { 0.0 }).name, "step");
        let swing = of(Variable::Time, (0.0, 1000.0), |t| {
            (t / 400.0 * std::f64::consts::TAU).sin()
        });
        assert_eq!(
            (swing.as_ref().unwrap().name, swing.unwrap().at),
            ("swing", Some(400.0))
        );
        assert_eq!(of(Variable::Level, (4.0, 16.0), |h| (3.0 * h).sin()), None);
    }

    #[test]
    fn what_the_plant_imitates_is_not_seen() {
        // The plant's parameters explain any straight line: only the parabola of a parabola with a line is left.
        let knots: Vec<f64> = (0..13).map(f64::from).collect();
        let lines = DMatrix::from_fn(13, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let project = DMatrix::identity(13, 13)
            - &lines * (lines.tr_mul(&lines)).try_inverse().unwrap() * lines.transpose();
        let ordinates: Vec<f64> = knots.iter().map(|v| 0.05 * v * v + 3.0 * v - 7.0).collect();
        let information = &project * 400.0;
        let found = nearest(
            Domain::Hydraulic,
            (Place::Actuator, Variable::Input),
            &knots,
            &ordinates,
            &information,
        );
        assert_eq!(found.unwrap().name, "parabola");
        let line: Vec<f64> = knots.iter().map(|v| 3.0 * v - 7.0).collect();
        assert!(
            nearest(
                Domain::Hydraulic,
                (Place::Actuator, Variable::Input),
                &knots,
                &line,
                &information
            )
            .is_none()
        );
    }
}
