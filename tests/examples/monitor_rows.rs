//! Rows of a single tank in a loop in which nothing begins, as CSV on standard output:
//! `cargo run --release -p ctid-tests --example monitor_rows -- 1000000 > million.csv`, to time `ctid monitor` with.

use std::io::{self, BufWriter, Write};

use ctid_tests::onset::Onset;

fn main() -> io::Result<()> {
    let rows = std::env::args()
        .nth(1)
        .and_then(|rows| rows.parse().ok())
        .unwrap_or(1000);
    let onset = Onset::nothing(rows, 0.0, 0);
    let mut record = onset
        .run(true, 1)
        .ok_or_else(|| io::Error::other("the loop does not run"))?;
    let mut out = BufWriter::new(io::stdout().lock());
    writeln!(out, "t [s],r [cm],u [V],y [cm]")?;
    let reference = record.references.pop().map_or(Vec::new(), |r| r.values);
    for (k, r) in reference.iter().enumerate() {
        let (u, y) = (record.inputs[0].values[k], record.outputs[0].values[k]);
        writeln!(out, "{:.4},{r:.3},{u:.4},{y:.4}", record.time[k])?;
    }
    out.flush()
}
