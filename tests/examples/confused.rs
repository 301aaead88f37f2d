//! Which effects are confused on the standard experiments: `cargo run --release -p ctid-tests --example confused` prints a table.
//!
//! Every effect, as the search would try it first (the middle of its starts), is built into a single tank with white noise, in open loop
//! and under a controller, and the record is diagnosed. An argument chooses the effects whose name holds it.

use std::{collections::BTreeMap, error::Error};

use ct_signals::Record;
use ctid_tests::{Drive, Rig};
use greybox::Setup;
use missing_effect::{Diagnosis, Options, diagnose};
use plants::{EffectInfo, Placed};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const SEED: u64 = 1;

fn main() -> Result<(), Box<dyn Error>> {
    println!("| built in | found in open loop | found in closed loop |\n|---|---|---|");
    let wanted = std::env::args().nth(1).unwrap_or_default();
    let effects = plants::CATALOGUE.iter();
    for effect in effects.filter(|effect| effect.id.contains(&wanted)) {
        let mut row = format!("| `{}` |", effect.id);
        for drive in [Drive::Open, Drive::Closed] {
            let rig = Rig {
                drive,
                ..Rig::single_tank()
            };
            let rig = if effect.sites(rig.plant, &rig.known()).next().is_some() {
                rig
            } else {
                Rig {
                    drive,
                    ..Rig::linear_tank()
                }
            };
            let record = with_effect(&rig, effect)?;
            let found = diagnose(&rig.problem(record), &Options::default(), &|_| {})?;
            row += &format!(" {} |", said(&found));
        }
        println!("{row}");
    }
    Ok(())
}

/// A record of the rig with the effect in the middle of what the search would try.
fn with_effect(rig: &Rig, effect: &'static EffectInfo) -> Result<Record, Box<dyn Error>> {
    let bare = [rig.run(&mut ChaCha8Rng::seed_from_u64(SEED))];
    let setup = Setup::from_records(rig.plant, rig.known(), &[], &bare, BTreeMap::new())?;
    let mut structure = setup.structure.clone();
    structure.scales = setup.scales_at(&[rig.theta.as_slice(), &rig.levels].concat())?;
    let parameters = structure.effect_parameters(Placed { effect, vessel: 0 });
    let middle = parameters
        .iter()
        .map(|info| info.starts[info.starts.len() / 2]);
    let rig = Rig {
        hidden: vec![(effect.id, 0, middle.collect())],
        ..rig.clone()
    };
    Ok(rig.run(&mut ChaCha8Rng::seed_from_u64(SEED)))
}

/// The groups; effects that were added one after the other are joined by a plus.
fn said(found: &Diagnosis) -> String {
    let groups = found.groups.iter().map(|group| group.join(", "));
    let groups: Vec<String> = groups.collect();
    if groups.is_empty() {
        format!("{:?}", found.verdict).to_lowercase()
    } else {
        groups.join(" + ")
    }
}
