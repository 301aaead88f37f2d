//! How messages name what the user gave: the options of the program and the tables of its model file. Libraries name their own arguments,
//! and the Python package names its own.

use effect_search::design::NoExperiment;
use missing_effect::design::NoExperiment as NoPlantExperiment;

/// Names of everything that messages refer to.
#[derive(Debug, Clone, Copy)]
pub struct MessageNames {
    /// Names in errors of fits, and of the records and plants in them.
    pub fit: greybox::Names,
    /// What stands before the name of a setting with which a message begins.
    pub setting: &'static str,
    /// Where the controller is given.
    pub controller: &'static str,
    /// What searches for what a model lacks.
    pub diagnose: &'static str,
    /// How a part of a record, or another grid, is chosen, after a message that advises it; empty for nothing.
    pub part_or_grid: &'static str,
    /// An experiment with a model of the user's own that cannot be proposed.
    pub experiment: fn(&NoExperiment) -> String,
    /// An experiment with a plant that cannot be proposed.
    pub plant_experiment: fn(&NoPlantExperiment) -> String,
}

impl MessageNames {
    /// Names of the program.
    pub const PROGRAM: Self = Self {
        fit: greybox::Names {
            records: ct_signals::Names {
                strict: "--strict",
                from: "--from",
                to: "--to",
                part: "with --from and --to",
                resample: "--resample",
                columns: "[columns]",
                in_columns: "under [columns]",
                column: |role| format!("{role} = \"...\" under [columns]"),
                namer: "the model",
            },
            plants: plants::Names {
                plants_of: |effect| format!("`ctid effects {effect}` names the plants it acts on"),
                effects: " (`ctid effects --model MODEL.toml` lists them)",
                second_command: "name the column of its command as input_2 under [columns]",
            },
            known: " under [known]",
            prior: |parameter| format!("[prior] {parameter}"),
            reference: "name its column as reference in the model file, under [columns] or, for a model of your own, under its [controller.INPUT]",
            straight: "hold = \"first\"",
            held: "write hold = \"zero\", or delete [controller] or, for a model of your own, [controller.INPUT]",
        },
        setting: "--",
        controller: "the controller of the model file",
        diagnose: "`ctid diagnose`",
        part_or_grid: ": --from and --to, or --resample",
        experiment,
        plant_experiment,
    };
}

/// Where more time may help.
const MORE_TIME: &str = "--effort thorough searches longer";

/// An experiment with a model of the user's own that cannot be proposed.
fn experiment(refused: &NoExperiment) -> String {
    use NoExperiment as No;
    match refused {
        // The message begins with the argument's name, which is the name of the option.
        No::SameEffect { .. }
        | No::UnknownInput { .. }
        | No::Range { .. }
        | No::Duration { .. }
        | No::Slew { .. } => format!("--{refused}"),
        No::NoRange { input, .. } => format!("{refused} with --input {input}=LOW..HIGH"),
        No::InModel { effect } => {
            format!("{refused}: `ctid remove '{effect}' --model M.toml`")
        }
        No::NoFit { effect } => needs(&refused.to_string(), effect),
        No::OutOfTime => format!("{refused}: {MORE_TIME}"),
        _ => refused.to_string(),
    }
}

/// An experiment with a plant that cannot be proposed.
fn plant_experiment(refused: &NoPlantExperiment) -> String {
    use NoPlantExperiment as No;
    let message = refused.worded("the model file");
    match refused {
        // The message begins with the argument's name, which is the name of the option.
        No::SameEffect { .. }
        | No::Range { .. }
        | No::TooWide { .. }
        | No::Beyond { .. }
        | No::Duration { .. }
        | No::TooLong { .. }
        | No::Slew { .. } => format!("--{message}"),
        No::NoRange { .. } | No::Overfull { .. } => format!("{message} with --range"),
        No::NoFit { effect } => needs(&message, effect),
        No::OutOfTime => format!("{message}: {MORE_TIME}"),
        _ => message,
    }
}

/// A message about an effect, with the command that says more of it.
fn needs(message: &str, effect: &str) -> String {
    format!("{message}; `ctid effects '{effect}'` says what it needs")
}
