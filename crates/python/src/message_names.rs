//! How messages name what the user gave: the arguments of the Python package.

use ctid::MessageNames;
use effect_search::design::NoExperiment;
use missing_effect::design::NoExperiment as NoPlantExperiment;

/// Names of arguments of fits, diagnoses and designs.
pub const PYTHON: MessageNames = MessageNames {
    fit: greybox::Names {
        records: ct_signals::Names {
            part: "of the frame, df.loc[FIRST:LAST]",
            in_columns: "in inputs=[...] or outputs=[...]",
            column,
            namer: "the model",
            // Frames are read whole, and missing samples are NaN: no call has arguments for the others.
            ..ct_signals::Names::LIBRARY
        },
        plants: plants::Names {
            plants_of: |effect| format!("leave {effect} out of effects=[...]"),
            effects: "",
            second_command: "name the columns of both commands, inputs=[..., ...]",
        },
        known: " in known={...}",
        prior: |parameter| format!("priors[\"{parameter}\"]"),
        reference: "name its column as reference in the model file, under its [controller.INPUT]",
        straight: "hold=\"first\"",
        held: "give hold=\"zero\", or delete [controller.INPUT] from the model file",
    },
    setting: "",
    controller: "the controller of the model file",
    diagnose: "`diagnose`",
    part_or_grid: "",
    experiment,
    plant_experiment,
};

/// Names of arguments of `identify`, which fits one output.
pub const IDENTIFY: MessageNames = MessageNames {
    fit: greybox::Names {
        records: ct_signals::Names {
            in_columns: "in inputs=[...] or output=\"...\"",
            column: column_of_identify,
            namer: "the argument",
            ..PYTHON.fit.records
        },
        ..PYTHON.fit
    },
    controller: "the argument controller",
    ..PYTHON
};

/// What gives the column of a role. The calls of a model have no argument for the reference.
fn column(role: &str) -> String {
    match role {
        "time" => "the index of the frame".to_string(),
        "reference" => "reference in the model file, under its [controller.INPUT]".to_string(),
        _ => format!("{role}s=[...]"),
    }
}

/// The argument of `identify` for the column of a role.
fn column_of_identify(role: &str) -> String {
    match role {
        "output" | "reference" => format!("{role}=\"...\""),
        _ => column(role),
    }
}

/// Where more time may help.
const MORE_TIME: &str = "effort=\"thorough\", or time_limit";

/// An experiment with a model of the user's own that cannot be proposed.
fn experiment(refused: &NoExperiment) -> String {
    match refused {
        NoExperiment::NoRange { input, .. } => {
            format!("{refused}, ranges={{\"{input}\": (LOW, HIGH)}}")
        }
        NoExperiment::OutOfTime => format!("{refused}: {MORE_TIME}"),
        _ => refused.to_string(),
    }
}

/// An experiment with a plant that cannot be proposed.
fn plant_experiment(refused: &NoPlantExperiment) -> String {
    use NoPlantExperiment as No;
    match refused {
        No::NoRange { .. } | No::Overfull { .. } => {
            format!("{refused}, ranges={{INPUT: (LOW, HIGH)}}")
        }
        No::OutOfTime => format!("{refused}: {MORE_TIME}"),
        _ => refused.to_string(),
    }
}
