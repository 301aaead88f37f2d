//! The plants of the model file: their vessels, outflow laws and fitted parameters.

use serde::{Deserialize, Serialize};

use crate::{Unit, scales::Scales};

/// A plant of the model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plant {
    /// `S dH/dt = pump_gain u - alpha sqrt(H)`, `y = H`.
    SingleTank,
    /// `tau d(y - y0)/dt + (y - y0) = K (u - u0)`; `offset = y0 - K u0`.
    SingleTankLinear,
    /// Two tanks in series, each as `single-tank`; the level of the lower tank is measured.
    CascadedTanks,
    /// Two first-order lags in series: `K`, `tau1`, `tau2`, `offset`.
    CascadedTanksLinear,
    /// `tau dy/dt + y = K u`.
    FirstOrder,
    /// Three tanks in a row, T1, T3, T2, connected by valves, with an outlet at T2 and pumps into T1 and T2 (the DTS200 rig):
    /// ```text
    /// S1 dH1/dt = pump_gain_1 u1 - q13,   q13 = az13 s(H1 - H3)
    /// S3 dH3/dt = q13 - q32,              q32 = az32 s(H3 - H2)
    /// S2 dH2/dt = pump_gain_2 u2 + q32 - az20 sqrt(H2),   s(d) = sign(d) sqrt(|d|)
    /// ```
    /// If `S_n sqrt(2 g)` is known ([`crate::Known::orifice`]), `az` is multiplied by it. The vessels are numbered along the row: 0 is T1,
    /// 1 is T3, 2 is T2. [`crate::Known::measured`] lists the measured levels.
    ThreeTank,
}

/// The outflow law of a vessel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outlet {
    /// `alpha sqrt(H)`.
    Torricelli,
    /// `H - offset`: the flow in units of the level, so that the vessel's area is its time constant.
    Linear,
}

/// A parameter that a fit may change.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterInfo {
    /// Name in the `[start]` section of a model file.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
    /// What the parameter means, in a few words.
    pub meaning: &'static str,
    /// The value at which the effect is absent; NaN for a parameter of the plant itself, which does not use it. Infinite for a threshold
    /// that is never reached.
    pub absent: f64,
    /// Smallest plausible value: a bound of the fit.
    pub lower: f64,
    /// Largest plausible value: a bound of the fit.
    pub upper: f64,
    /// Start values for a fit, at least one.
    pub starts: Vec<f64>,
}

const GAIN: Unit = Unit {
    input: -1,
    ..Unit::FLOW
};
const ALPHA: Unit = Unit {
    level_halves: 1,
    area: 1,
    time: -1,
    ..Unit::ONE
};
const STATIC_GAIN: Unit = Unit {
    level_halves: 2,
    input: -1,
    ..Unit::ONE
};

impl Plant {
    /// All plants.
    pub const ALL: [Self; 6] = [
        Self::SingleTank,
        Self::SingleTankLinear,
        Self::CascadedTanks,
        Self::CascadedTanksLinear,
        Self::FirstOrder,
        Self::ThreeTank,
    ];

    /// Name in model files.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::SingleTank => "single-tank",
            Self::SingleTankLinear => "single-tank-linear",
            Self::CascadedTanks => "cascaded-tanks",
            Self::CascadedTanksLinear => "cascaded-tanks-linear",
            Self::FirstOrder => "first-order",
            Self::ThreeTank => "three-tank",
        }
    }

    /// Number of vessels; the level of the last one is measured, unless [`crate::Known::measured`] says otherwise.
    #[must_use]
    pub fn vessels(self) -> usize {
        match self {
            Self::CascadedTanks | Self::CascadedTanksLinear => 2,
            Self::ThreeTank => 3,
            _ => 1,
        }
    }

    /// The outflow law of the vessels.
    #[must_use]
    pub fn outlet(self) -> Outlet {
        match self {
            Self::SingleTank | Self::CascadedTanks | Self::ThreeTank => Outlet::Torricelli,
            _ => Outlet::Linear,
        }
    }

    /// Whether the vessels are side by side, connected by valves through which water flows in both directions, and not in series.
    #[must_use]
    pub fn joined(self) -> bool {
        self == Self::ThreeTank
    }

    /// Number of pumps; the second pump is off if the record has no command for it.
    #[must_use]
    pub fn pumps(self) -> usize {
        1 + usize::from(self.joined())
    }

    /// The name of a vessel if there are several: `upper` or `lower`; for three vessels, in their order: `T1`, `T3`, `T2`.
    #[must_use]
    pub fn vessel_name(self, vessel: usize) -> Option<&'static str> {
        let names: &[&str] = match self.vessels() {
            3 => &["T1", "T3", "T2"],
            2 => &["upper", "lower"],
            _ => &[],
        };
        names.get(vessel).copied()
    }

    /// The name of a pump if there are two: `pump_1` or `pump_2`.
    #[must_use]
    pub fn pump_name(self, pump: usize) -> Option<&'static str> {
        let names = ["pump_1", "pump_2"];
        names.get(pump).copied().filter(|_| self.pumps() > 1)
    }

    /// The name of the level in a vessel.
    #[must_use]
    pub fn level_name(self, vessel: usize) -> &'static str {
        match self.vessel_name(vessel) {
            Some("T1") => "level_1",
            Some("T2") => "level_2",
            Some("T3") => "level_3",
            Some("upper") => "level_upper",
            Some(_) => "level_lower",
            None => "level",
        }
    }

    /// The plant's own fitted parameters, in the order in which the simulator takes them. For a record with a measured disturbance
    /// ([`crate::Known::disturbance`]), the last one is `disturbance_gain`: inflow per unit of the disturbance or, for a linear plant, the
    /// static gain.
    #[must_use]
    pub fn parameters(self, scales: &Scales) -> Vec<ParameterInfo> {
        let info = |name, unit, meaning, lower: f64, upper: f64| ParameterInfo {
            name,
            unit,
            meaning,
            absent: f64::NAN,
            lower,
            upper,
            starts: vec![(lower * upper).abs().sqrt()],
        };
        // Time constants range from 0.1 sampling intervals (a shorter one cannot be identified) to thirty record lengths; the other bounds
        // follow, with wide margins. The bounds scale with the data, so they do not depend on the choice of units.
        let tau = (0.1 * scales.sample_interval, 30.0 * scales.duration);
        let level = positive(scales.largest_level());
        let largest = |(low, high): (f64, f64)| positive(high.abs().max(low.abs()));
        let input = largest(scales.input);
        let flow = |area: f64| (area * level / tau.1 * 1e-3, area * level / tau.0 * 1e3);
        let pump = |name, area: f64, input: f64| {
            info(
                name,
                GAIN,
                "inflow for one unit of the command",
                flow(area).0 / input,
                flow(area).1 / input,
            )
        };
        let gain = |area: f64| pump("pump_gain", area, input);
        // Torricelli: tau = 2 S sqrt(H)/alpha = 2 S Q/alpha^2. The shortest tau at the largest level of a measured vessel bounds the
        // throughput Q, and Q bounds alpha of the vessels whose levels are not measured. Of several measured vessels, the one with the
        // largest content counts.
        let contents = scales.outputs.iter().map(|output| {
            let (low, high) = scales.level[output.vessel];
            scales.area[output.vessel] * positive(low.abs().max(high.abs()))
        });
        let content = contents.fold(f64::MIN_POSITIVE, f64::max);
        let alpha = |name, meaning, area: f64| {
            info(
                name,
                ALPHA,
                meaning,
                flow(area).0 / level.sqrt(),
                2.0 * (area * content).sqrt() / tau.0,
            )
        };
        // The coefficient of a valve: as alpha, but divided by the flow through the orifice at one unit of head if that flow is known.
        let valve = |name, meaning, vessel: usize| {
            let mut valve = alpha(name, meaning, scales.area[vessel]);
            if let Some(orifice) = scales.orifice {
                valve.unit = Unit::ONE;
                valve.upper = (valve.upper / orifice).min(MOST_OF_AN_ORIFICE);
                valve.lower = (valve.lower / orifice).min(valve.upper);
            }
            valve
        };
        let lag = |name, meaning| info(name, Unit::TIME, meaning, tau.0, tau.1);
        let reach = 1e3 * level;
        let static_gain = || {
            info(
                "K",
                STATIC_GAIN,
                "rise of the level for one unit of the command",
                -reach / input,
                reach / input,
            )
        };
        let offset = || {
            info(
                "offset",
                Unit::LEVEL,
                "level at a command of zero",
                -reach,
                reach,
            )
        };
        let mut own = match self {
            Self::SingleTank => vec![
                gain(scales.area[0]),
                alpha("alpha", "outflow coefficient", scales.area[0]),
            ],
            Self::SingleTankLinear => vec![static_gain(), lag("tau", "time constant"), offset()],
            Self::CascadedTanks => vec![
                gain(scales.area[0]),
                alpha(
                    "alpha_upper",
                    "outflow coefficient of the upper tank",
                    scales.area[0],
                ),
                alpha(
                    "alpha_lower",
                    "outflow coefficient of the lower tank",
                    scales.area[1],
                ),
            ],
            Self::CascadedTanksLinear => vec![
                static_gain(),
                lag("tau1", "time constant of the upper tank"),
                lag("tau2", "time constant of the lower tank"),
                offset(),
            ],
            Self::FirstOrder => vec![static_gain(), lag("tau", "time constant")],
            Self::ThreeTank => {
                let mut all = vec![pump("pump_gain_1", scales.area[0], input)];
                if let Some(input) = scales.input_2 {
                    all.push(pump("pump_gain_2", scales.area[2], largest(input)));
                }
                all.extend([
                    valve("az13", "flow coefficient of the valve between T1 and T3", 0),
                    valve("az32", "flow coefficient of the valve between T3 and T2", 1),
                    valve("az20", "flow coefficient of the outlet of T2", 2),
                ]);
                all
            }
        };
        if let Some(input) = scales.input_2.filter(|_| !self.joined()) {
            let area = scales.area[..self.vessels()].iter().copied();
            let (unit, meaning, reach) = match self.outlet() {
                Outlet::Torricelli => (
                    GAIN,
                    "inflow for one unit of the disturbance",
                    flow(area.fold(0.0, f64::max)).1,
                ),
                Outlet::Linear => (
                    STATIC_GAIN,
                    "rise of the level for one unit of the disturbance",
                    reach,
                ),
            };
            let reach = reach / largest(input);
            own.push(ParameterInfo {
                // The measured flow may be an inflow or an outflow.
                starts: vec![0.0],
                ..info("disturbance_gain", unit, meaning, -reach, reach)
            });
        }
        own
    }
}

/// Largest flow coefficient of a valve whose orifice is known: Torricelli's law gives at most one, and the true cross-section may be twice
/// the documented one.
const MOST_OF_AN_ORIFICE: f64 = 2.0;

/// A value to divide by: one if `size` is not positive.
fn positive(size: f64) -> f64 {
    if size > 0.0 { size } else { 1.0 }
}

impl std::str::FromStr for Plant {
    type Err = crate::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|plant| plant.id() == name)
            .ok_or_else(|| crate::Error::UnknownPlant {
                name: name.to_string(),
            })
    }
}
