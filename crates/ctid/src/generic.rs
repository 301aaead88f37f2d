//! Effects at the ports of models of the user's own: their list, and the description of one, without a model.

use ct_model::effects::{DescribedParameter, Effect, Place, all_effects};

use crate::look::{Look, Side, table_text};
use crate::symptoms::{Sought, best};

/// An effect with the names of its port: `lag(u)`.
fn id(effect: &Effect) -> String {
    format!("{}({})", effect.id, effect.port_names())
}

/// Names without ports.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    all_effects().map(|effect| effect.id)
}

/// The effects of a name; with a port of the catalogue, as `lag(u)`, only the effect there.
pub(crate) fn matching(written: &str) -> Vec<&'static Effect> {
    let plain: String = written.chars().filter(|c| !c.is_whitespace()).collect();
    let name = plain.split('(').next().unwrap_or_default();
    let mut all: Vec<_> = all_effects().filter(|effect| effect.id == name).collect();
    if all.iter().any(|effect| id(effect) == plain) {
        all.retain(|effect| id(effect) == plain);
    }
    all
}

/// All effects, by place.
pub(crate) fn list(look: Look) -> String {
    let headings = [
        "models of your own, at an input",
        "models of your own, at an output",
        "models of your own, in the equation of a state",
        "models of your own, at a parameter or a named flow",
        "models of your own, between two places",
    ];
    let group = |effect: &Effect| match effect.place {
        Place::Input => 0,
        Place::Output | Place::LevelReading | Place::Terminal => 1,
        Place::Parameter | Place::ParameterAndSignal => 3,
        Place::States | Place::InputAndBalance | Place::TankAndTankBelow => 4,
        _ => 2,
    };
    let mut text = String::new();
    for (i, heading) in headings.into_iter().enumerate() {
        text += &format!("{}\n", look.heading(heading));
        let here: Vec<_> = all_effects().filter(|effect| group(effect) == i).collect();
        text += &rows(&here, look);
        text.push('\n');
    }
    text
}

/// The effects that match a description of a symptom, best first; empty if none does.
pub(crate) fn like(sought: &Sought, look: Look) -> String {
    rows(
        &best(all_effects(), |effect| sought.score_of_effect(effect)),
        look,
    )
}

fn rows(effects: &[&'static Effect], look: Look) -> String {
    let ids: Vec<String> = effects.iter().map(|effect| id(effect)).collect();
    let widest = ids.iter().map(String::len).max().unwrap_or(0);
    let row = |(id, effect): (&String, &&Effect)| {
        let first = format!("  {}{}  ", look.strong(id), " ".repeat(widest - id.len()));
        look.paragraph(&first, effect.physics)
    };
    ids.iter().zip(effects).map(row).collect()
}

/// Everything the catalogue knows of an effect.
pub(crate) fn description(effect: &'static Effect, look: Look) -> String {
    let row = |own: DescribedParameter| {
        let unit = match own.unit {
            "" => "1".to_string(),
            unit => unit.replace("port", "signal"),
        };
        [
            own.name.to_string(),
            unit,
            own.absent.to_string(),
            own.meaning.to_string(),
        ]
    };
    let sheet = Sheet {
        heading: id(effect),
        physics: effect.physics.to_string(),
        place: place(effect.place).to_string(),
        parameters: effect.described_parameters().into_iter().map(row).collect(),
        effect: Some(effect),
        confirm: Some(effect.confirm),
        add: format!(
            "ctid add '{}' --model MODEL.toml, with the names of your model",
            id(effect)
        ),
    };
    sheet.text(look)
}

pub(crate) fn place(place: Place) -> &'static str {
    match place {
        Place::Input => "at an input u: v takes its place",
        Place::Output => "at an output: v is the reading, y or u the reading without the effect",
        Place::LevelReading => {
            "at an output that reads a level: v is the reading, y the reading without the effect"
        }
        Place::Terminal => {
            "at an output that reads a voltage, y without the effect, with an input a that is a current: v is the reading"
        }
        Place::Balance => {
            "in the equation of a state x: v is added to its right-hand side; if v contains rate, this right-hand side, it takes its place"
        }
        Place::Motion => "in the equation of a speed x: v is added to its right-hand side",
        Place::Spring => {
            "in the equation of a speed that contains its position x: v is added to its right-hand side"
        }
        Place::MotionAndPosition => {
            "in the equation of a speed a, whose position is x: v is added to its right-hand side"
        }
        Place::Level => "in the equation of a level x: v is added to its right-hand side",
        Place::BalanceAndSignal => {
            "in the equation of a state, with a state or an input x: v is added to its right-hand side"
        }
        Place::BalanceAndSurrounding => {
            "in the equation of a temperature x, with the temperature a of its surroundings: v is added to its right-hand side"
        }
        Place::Parameter => "at a parameter or a named flow p: v takes its place",
        Place::ParameterAndSignal => {
            "at a parameter or a named flow p, with a state or an input x: v takes the place of p"
        }
        Place::States => {
            "between two states x1 and x2 of one unit: v leaves the first one and enters the second"
        }
        Place::InputAndBalance => {
            "from an input u to the equation of a state that it is not in: v is added to its right-hand side"
        }
        Place::TankAndTankBelow => {
            "between a level x1 and the level of the tank below: v leaves the first one, w enters the second"
        }
    }
}

/// Meaning of the constants whose values come from the data.
const FROM_DATA: [(&str, &str); 10] = [
    ("low", "smallest value of the signal"),
    ("high", "largest value of the signal"),
    ("middle", "middle of the signal's range"),
    ("width", "width of the signal's range"),
    ("first", "first value of the signal"),
    ("begin", "begin of the record"),
    ("duration", "length of the record"),
    ("interval", "time between two rows"),
    ("zero", "zero of the temperature's unit above absolute zero"),
    ("balance", "largest term of the equation"),
];

/// Description of an effect, of a model or in general.
pub(crate) struct Sheet {
    pub heading: String,
    pub physics: String,
    pub place: String,
    /// Name, unit, the value at which the effect is absent, meaning.
    pub parameters: Vec<[String; 4]>,
    /// The effect; `None` for a candidate of the model file.
    pub effect: Option<&'static Effect>,
    pub confirm: Option<&'static str>,
    /// The command that adds it.
    pub add: String,
}

impl Sheet {
    pub fn text(&self, look: Look) -> String {
        let entry = |name: &str, what: &str| {
            look.paragraph(&format!("  {}", look.faint(format!("{name:<14}"))), what)
        };
        let mut text = format!("{}\n", look.heading(&self.heading));
        text += &look.paragraph("  ", &self.physics);
        text.push('\n');
        let equations = self.effect.map_or(Vec::new(), Effect::equations);
        for (i, equation) in equations.iter().enumerate() {
            text += &entry(if i == 0 { "equation" } else { "" }, equation);
        }
        text += &entry("where", &self.place);
        let constants = self.effect.map_or(Vec::new(), Effect::constants);
        let said = constants.iter().map(|constant| {
            let known = FROM_DATA.iter().find(|(name, _)| name == constant);
            known.map_or(constant.clone(), |(name, meaning)| {
                format!("{name}: {meaning}")
            })
        });
        let said: Vec<String> = said.collect();
        if !said.is_empty() {
            text += &entry("constants", &said.join("; "));
        }
        text.push('\n');
        let heading = ["parameter", "unit", "absent at", "meaning"];
        let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
        rows.extend(self.parameters.iter().map(|row| row.to_vec()));
        let sides = [Side::Left, Side::Left, Side::Right, Side::Left];
        text += &table_text(&sides, &rows);
        text.push('\n');
        if let Some(effect) = self.effect {
            let confused = match effect.confused_with {
                [] => "nothing in the catalogue".to_string(),
                others => others.join(", "),
            };
            text += &entry("confused with", &confused);
        }
        if let Some(confirm) = self.confirm {
            text += &entry("confirm", confirm);
        }
        text + &entry("add it", &self.add)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_listed_and_described() {
        let look = Look::plain();
        let all = list(look);
        for effect in all_effects() {
            assert!(all.contains(&id(effect)), "{}", id(effect));
            let text = description(effect, look);
            for word in ["equation", "where", "absent at", effect.confused_with[0]] {
                assert!(text.contains(word), "{word}: {text}");
            }
            let plain: Vec<&str> = text.split_whitespace().collect();
            assert!(plain.join(" ").contains(effect.confirm), "{text}");
        }
        assert!(all.lines().all(|line| line.chars().count() <= 80), "{all}");
    }

    #[test]
    fn a_name_without_a_port_stands_for_every_place() {
        let places = |written: &str| -> Vec<Place> {
            let found = matching(written);
            found.iter().map(|effect| effect.place).collect()
        };
        assert_eq!(places("lag"), [Place::Input, Place::Output]);
        assert_eq!(places("lag( u )"), [Place::Input]);
        assert_eq!(places("lag(heater)"), [Place::Input, Place::Output]);
        assert_eq!(places("overfow"), []);
    }
}
