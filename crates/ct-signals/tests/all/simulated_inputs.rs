//! Records on whose inputs a model is simulated.

use ct_signals::{Columns, Error, ReadOptions, Reading, read_csv, read_inputs_csv};

fn columns() -> Columns {
    Columns {
        time: Some("t [s]".into()),
        inputs: vec!["u [V]".into()],
        outputs: vec!["y1 [cm]".into(), "y2 [cm]".into()],
        ..Columns::default()
    }
}

fn read(text: &str, columns: &Columns) -> (Result<Reading, Error>, Result<Reading, Error>) {
    // A name for each thread: tests run side by side.
    let name = format!("ctid-inputs-{:?}.csv", std::thread::current().id());
    let path = std::env::temp_dir().join(name.replace(['(', ')'], "-"));
    std::fs::write(&path, text).unwrap();
    let options = ReadOptions::default();
    let both = (
        read_inputs_csv(&path, columns, &options),
        read_csv(&path, columns, &options),
    );
    std::fs::remove_file(&path).unwrap();
    both
}

#[test]
fn outputs_that_are_not_there_have_no_sample_and_keep_their_place() {
    let (inputs, fit) = read("t [s],u [V],y2 [mm]\n0,0,10\n1,0,20\n2,0,\n", &columns());
    let record = inputs.unwrap().record;
    assert_eq!((record.len(), record.outputs.len()), (3, 2));
    assert!(record.outputs[0].values.iter().all(|y| y.is_nan()));
    assert_eq!(
        (
            record.outputs[0].name.as_str(),
            record.outputs[0].unit.as_str()
        ),
        ("y1", "cm")
    );
    // Converted as everywhere.
    assert_eq!(record.outputs[1].values[..2], [1.0, 2.0]);
    assert!(record.outputs[1].values[2].is_nan());
    // An input may be constant at zero.
    assert_eq!(record.inputs[0].values, [0.0; 3]);
    assert!(fit.unwrap_err().to_string().contains("y1 [cm]"));
    // No output is named, and none exists.
    let unnamed = Columns {
        outputs: Vec::new(),
        ..columns()
    };
    let (inputs, _) = read("t [s],u [V]\n0,1\n1,2\n", &unnamed);
    assert!(inputs.unwrap().record.outputs.is_empty());
    let (inputs, _) = read("t [s],u [V],y [cm]\n0,1,3\n1,2,3\n", &unnamed);
    assert_eq!(inputs.unwrap().record.outputs[0].values, [3.0, 3.0]);
}

#[test]
fn inputs_are_needed() {
    let refused = |text: &str, word: &str| {
        let (inputs, _) = read(text, &columns());
        let message = inputs.unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    };
    refused(
        "t [s],y1 [cm]\n0,1\n1,2\n",
        "no column \"u [V]\" for the input",
    );
    refused("t [s],u [V]\n0,1\n", "1 row");
    refused(
        "t [s],u [V]\n0,\n1,\n",
        "the samples of all 2 rows are missing",
    );
    refused("t [s],u [V]\n0,1\n0,2\n", "column \"t [s]\"");
    refused("t [s],u [V]\n0,1\n1,1e200\n", "too large");
}
