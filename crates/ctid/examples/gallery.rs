//! The trace of every effect of the catalogue, as `docs/gallery.md` shows it:
//! `cargo run --release -p ctid --example gallery`.

fn main() {
    print!("{}", ctid::catalogue::gallery());
}
