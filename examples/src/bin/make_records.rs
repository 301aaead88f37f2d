//! Writes the records of the tour into `examples/records`.

use std::path::Path;

fn main() -> ctid_examples::tour_records::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("records");
    let [fitted, held_out] = ctid_examples::tour_records::make()?;
    std::fs::write(folder.join("tour.csv"), fitted)?;
    std::fs::write(folder.join("tour-test.csv"), held_out)?;
    Ok(())
}
