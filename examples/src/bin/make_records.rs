//! Writes the records of the tour into `examples/records`, and those of the models into `examples/models`.

use std::path::Path;

use ctid_examples::{model_records, tour_records};

fn main() -> tour_records::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("records");
    let [fitted, held_out] = tour_records::make()?;
    std::fs::write(folder.join("tour.csv"), fitted)?;
    std::fs::write(folder.join("tour-test.csv"), held_out)?;
    for record in model_records::make()? {
        let path = model_records::folder().join(record.name);
        std::fs::write(path.with_extension("csv"), record.csv)?;
    }
    Ok(())
}
