//! Known constants of a plant: areas, heights, and the measured levels.

use ct_signals::quoted;
use plants::{Known, MAX_VESSELS, Plant};
use toml::Spanned;

use super::Source;
use crate::Error;
use crate::model_file::raw::{Number, RawKnown, Words};

impl Source<'_> {
    pub(crate) fn known(
        &self,
        plant: Plant,
        raw: &RawKnown,
        outputs: usize,
    ) -> Result<Known, Error> {
        let id = plant.id();
        let of_one = [("area", &raw.area)];
        let of_two = [
            ("area_upper", &raw.area_upper),
            ("area_lower", &raw.area_lower),
        ];
        let of_three = [
            ("area_1", &raw.area_1),
            ("area_3", &raw.area_3),
            ("area_2", &raw.area_2),
            ("pipe_area", &raw.pipe_area),
            ("gravity", &raw.gravity),
        ];
        let (foreign, mend): (Vec<_>, _) = match plant.vessels() {
            1 => (
                of_two.iter().chain(&of_three).collect(),
                "has one vessel; write area",
            ),
            2 => (
                of_one.iter().chain(&of_three).collect(),
                "has two vessels; write area_upper and area_lower",
            ),
            _ => (
                of_two.iter().collect(),
                "has three tanks; write area, or area_1, area_2 and area_3,",
            ),
        };
        for (key, number) in foreign {
            let Some(number) = number else { continue };
            let what = if matches!(*key, "pipe_area" | "gravity") {
                format!("plant {id} has no joined tanks; delete {key}")
            } else {
                format!("plant {id} {mend} instead of {key}")
            };
            return Err(self.at(number.span().start, what));
        }
        let take = |key: &str, number: &Option<Spanned<Number>>| {
            number.as_ref().map(|n| self.positive(key, n)).transpose()
        };
        if let (Some(only), None) | (None, Some(only)) = (&raw.area_upper, &raw.area_lower) {
            return Err(self.at(
                only.span().start,
                "one area alone does not say how the levels compare; give both area_upper and area_lower, or neither",
            ));
        }
        let area = match plant.vessels() {
            1 => [take("area", &raw.area)?, None, None],
            2 => [
                take("area_upper", &raw.area_upper)?,
                take("area_lower", &raw.area_lower)?,
                None,
            ],
            _ => self.areas_of_three(raw)?,
        };
        Ok(Known {
            area,
            measured: self.measured(plant, raw.measured.as_ref(), outputs)?,
            disturbance: self.disturbance(plant, raw.disturbance.as_ref())?,
            orifice: self.orifice(raw, area[0].is_some())?,
            tank_height: take("tank_height", &raw.tank_height)?,
            input_range: take("input_range", &raw.input_range)?,
        })
    }

    /// The areas of three tanks, as given: one for all, or one for each.
    fn areas_of_three(&self, raw: &RawKnown) -> Result<[Option<f64>; MAX_VESSELS], Error> {
        let each = [
            ("area_1", &raw.area_1),
            ("area_3", &raw.area_3),
            ("area_2", &raw.area_2),
        ];
        let given = each.iter().find_map(|(_, number)| number.as_ref());
        if let Some(area) = &raw.area {
            if let Some(own) = given {
                return Err(self.at(
                    own.span().start,
                    "area is that of all three tanks; give it, or area_1, area_2 and area_3, not both",
                ));
            }
            return Ok([Some(self.positive("area", area)?); MAX_VESSELS]);
        }
        let mut areas = [None; MAX_VESSELS];
        let Some(given) = given else {
            return Ok(areas);
        };
        for (area, (key, number)) in areas.iter_mut().zip(each) {
            let Some(number) = number else {
                return Err(self.at(
                    given.span().start,
                    format!("{key} is missing; give area_1, area_2 and area_3, or area where all are alike"),
                ));
            };
            *area = Some(self.positive(key, number)?);
        }
        Ok(areas)
    }

    /// The vessels whose levels are the outputs, in their order. The default is the last one; for joined tanks, and for several outputs,
    /// the file has to name them.
    fn measured(
        &self,
        plant: Plant,
        words: Option<&Spanned<Words>>,
        outputs: usize,
    ) -> Result<Vec<usize>, Error> {
        let names: Vec<&str> = (0..plant.vessels())
            .filter_map(|vessel| plant.vessel_name(vessel))
            .collect();
        let written = |names: &[&str]| {
            let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            quoted.join(", ")
        };
        if outputs > plant.vessels() {
            let what = format!(
                "[columns] names {outputs} outputs, but plant {} has {}; name a column for each level that is measured",
                plant.id(),
                match plant.vessels() {
                    1 => "one level".to_string(),
                    levels => format!("{levels} levels"),
                }
            );
            return Err(self.at(self.text.find("output").unwrap_or(0), what));
        }
        let Some(words) = words else {
            let what = if outputs > 1 {
                format!(
                    "[columns] names {outputs} outputs, but nothing says which levels they are; write measured = [{}] under [known], in the order of the outputs",
                    written(&names[..outputs])
                )
            } else if plant.joined() {
                format!(
                    "nothing says in which tank the level is measured; write measured = {} under [known]",
                    "\"T1\", \"T2\" or \"T3\""
                )
            } else {
                return Ok(Vec::new());
            };
            return Err(Error::File {
                file: self.file.to_string(),
                what,
            });
        };
        let at = words.span().start;
        let words = words.as_ref().all();
        if names.is_empty() {
            let what = format!("plant {} has one level; delete measured", plant.id());
            return Err(self.at(at, what));
        }
        let mut vessels: Vec<usize> = Vec::new();
        for word in words {
            let Some(vessel) = names.iter().position(|name| name == word) else {
                let what = format!(
                    "measured = \"{}\" is not a tank; write one of {}",
                    quoted(word),
                    written(&names)
                );
                return Err(self.at(at, what));
            };
            if vessels.contains(&vessel) {
                let what = format!("measured names {word} twice; name each tank once");
                return Err(self.at(at, what));
            }
            vessels.push(vessel);
        }
        if vessels.len() != outputs.max(1) {
            let what = format!(
                "measured names {} of the tanks, but [columns] names {} of the outputs; as many of both, in the same order",
                vessels.len(),
                outputs.max(1)
            );
            return Err(self.at(at, what));
        }
        // Changes in the lower tank do not affect the level of the upper one.
        let last = plant.vessels() - 1;
        if !plant.joined() && !vessels.contains(&last) {
            let what = format!(
                "the level of the {} tank is not among the outputs, so nothing shows how it behaves; take plant = \"single-tank\" for the tank that is measured",
                names[last]
            );
            return Err(self.at(at, what));
        }
        Ok(vessels)
    }

    /// The vessel into which a measured disturbance flows.
    fn disturbance(
        &self,
        plant: Plant,
        word: Option<&Spanned<String>>,
    ) -> Result<Option<usize>, Error> {
        let Some(word) = word else { return Ok(None) };
        let at = word.span().start;
        if plant.joined() {
            let what = format!(
                "plant {} takes no measured disturbance: its second input is the second pump; delete disturbance",
                plant.id()
            );
            return Err(self.at(at, what));
        }
        let name = word.as_ref();
        let found = (0..plant.vessels()).find(|&vessel| match plant.vessel_name(vessel) {
            Some(known) => known == name,
            None => name == ONLY,
        });
        found.map(Some).ok_or_else(|| {
            self.at(
                at,
                format!(
                    "disturbance = \"{}\" is not a tank; write {}",
                    quoted(name),
                    disturbed(plant).join(" or ")
                ),
            )
        })
    }

    /// Flow through a valve at one unit of head with a flow coefficient of one.
    fn orifice(&self, raw: &RawKnown, area_known: bool) -> Result<Option<f64>, Error> {
        match (&raw.pipe_area, &raw.gravity) {
            (None, None) => Ok(None),
            (Some(pipe), Some(gravity)) => {
                if !area_known {
                    return Err(self.at(
                        pipe.span().start,
                        "pipe_area has no effect on the levels without the area of the tanks; give area too, in the same unit",
                    ));
                }
                let section = self.positive("pipe_area", pipe)?;
                let gravity = self.positive("gravity", gravity)?;
                Ok(Some(section * (2.0 * gravity).sqrt()))
            }
            (Some(only), None) | (None, Some(only)) => Err(self.at(
                only.span().start,
                "pipe_area and gravity make flow coefficients pure numbers together; give both (gravity = 981 where levels are in cm, 9.81 in m), or neither",
            )),
        }
    }
}

/// Name of the vessel of a plant with a single vessel, in `disturbance`.
const ONLY: &str = "tank";

/// Allowed values of `disturbance`, in quotes.
pub(super) fn disturbed(plant: Plant) -> Vec<String> {
    let names = (0..plant.vessels()).map(|vessel| plant.vessel_name(vessel).unwrap_or(ONLY));
    names.map(|name| format!("\"{name}\"")).collect()
}
