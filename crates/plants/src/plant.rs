//! The plants of the model file: which vessels, which outflow law, which parameters are fitted.

use serde::{Deserialize, Serialize};

use crate::{Unit, structure::Scales};

/// A plant of the model file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plant {
    /// `S dH/dt = pump_gain u - alpha sqrt(H)`, `y = H`.
    SingleTank,
    /// `tau d(y - y0)/dt + (y - y0) = K (u - u0)`; `offset = y0 - K u0`.
    SingleTankLinear,
    /// Two tanks in series, each as `single-tank`, the lower one measured.
    CascadedTanks,
    /// Two first-order lags in series: `K`, `tau1`, `tau2`, `offset`.
    CascadedTanksLinear,
    /// `tau dy/dt + y = K u`.
    FirstOrder,
}

/// How a vessel lets its content out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outlet {
    /// `alpha sqrt(H)`.
    Torricelli,
    /// `H - offset`, the flow in units of the level; the vessel's area is then its time constant.
    Linear,
}

/// A parameter that a fit may change.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterInfo {
    /// Name, as the model file's `[start]` writes it.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
    /// What it is, in a few words.
    pub meaning: &'static str,
    /// The value at which an effect is absent; for a plant's own parameter it is not used (NaN).
    /// It is infinite for a threshold that is never reached.
    pub absent: f64,
    /// Smallest plausible value: a bound of the fit.
    pub lower: f64,
    /// Largest plausible value: a bound of the fit.
    pub upper: f64,
    /// Values from which a fit is worth starting, at least one.
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
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::SingleTank,
        Self::SingleTankLinear,
        Self::CascadedTanks,
        Self::CascadedTanksLinear,
        Self::FirstOrder,
    ];

    /// The model file's name.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::SingleTank => "single-tank",
            Self::SingleTankLinear => "single-tank-linear",
            Self::CascadedTanks => "cascaded-tanks",
            Self::CascadedTanksLinear => "cascaded-tanks-linear",
            Self::FirstOrder => "first-order",
        }
    }

    /// How many vessels it has; the last one is measured.
    #[must_use]
    pub fn vessels(self) -> usize {
        match self {
            Self::CascadedTanks | Self::CascadedTanksLinear => 2,
            _ => 1,
        }
    }

    /// How its vessels let their content out.
    #[must_use]
    pub fn outlet(self) -> Outlet {
        match self {
            Self::SingleTank | Self::CascadedTanks => Outlet::Torricelli,
            _ => Outlet::Linear,
        }
    }

    /// The name of a vessel where there are several: `upper` or `lower`.
    #[must_use]
    pub fn vessel_name(self, vessel: usize) -> Option<&'static str> {
        (self.vessels() > 1).then_some(if vessel == 0 { "upper" } else { "lower" })
    }

    /// The name of the level in a vessel.
    #[must_use]
    pub fn level_name(self, vessel: usize) -> &'static str {
        match self.vessel_name(vessel) {
            Some("upper") => "level_upper",
            Some(_) => "level_lower",
            None => "level",
        }
    }

    /// Two parameters that may be exchanged without any reading becoming another, once the first level of the vessel that nobody
    /// measures is fitted anew; an effect in one of the vessels tells them apart.
    #[must_use]
    pub fn interchangeable(self) -> Option<[&'static str; 2]> {
        (self == Self::CascadedTanksLinear).then_some(["tau1", "tau2"])
    }

    /// Its own fitted parameters, in the order in which the simulator takes them.
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
        // Time constants from a tenth of a sample (below it a vessel is over before it is read, whatever it is) to
        // thirty records; the rest follows from them, generously. No unit is preferred: nothing here has a size.
        let tau = (0.1 * scales.sample_interval, 30.0 * scales.duration);
        let level = positive(scales.largest_level());
        let input = positive(scales.input.1.abs().max(scales.input.0.abs()));
        let flow = |area: f64| (area * level / tau.1 * 1e-3, area * level / tau.0 * 1e3);
        let gain = |area: f64| {
            info(
                "pump_gain",
                GAIN,
                "inflow for one unit of the command",
                flow(area).0 / input,
                flow(area).1 / input,
            )
        };
        // Torricelli: tau = 2 S sqrt(H)/alpha = 2 S Q/alpha^2. The measured vessel, the last one, is the shortest at its
        // largest level; that bounds the throughput Q, and Q the upper vessel, whose level is not known.
        let last = self.vessels() - 1;
        let (low, high) = scales.level[last];
        let content = scales.area[last] * positive(low.abs().max(high.abs()));
        let alpha = |name, meaning, area: f64| {
            info(
                name,
                ALPHA,
                meaning,
                flow(area).0 / level.sqrt(),
                2.0 * (area * content).sqrt() / tau.0,
            )
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
        match self {
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
        }
    }
}

/// A size to divide by: one where there is none.
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
