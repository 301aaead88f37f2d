//! The signature of every effect of the catalogue for `docs/gallery.md`: `cargo run --release -p ctid --example gallery`.

fn main() {
    print!("{}", ctid::catalogue::gallery());
}
