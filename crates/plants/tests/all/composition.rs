//! Effects compose: a permitted set of effects, added in any order, is one chain; other sets are rejected.

use crate::support::{DRIVES, base, effect, input, label, placements, random_sets};
use plants::{Error, Placed, Plant, Simulator, Structure};
use proptest::prelude::*;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

#[test]
fn the_order_of_adding_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for plant in Plant::ALL {
        let base = base(plant);
        let input = input(DRIVES[2], 80, base.h, 9);
        for size in 2..=7 {
            for set in random_sets(plant, size, 6, size as u64) {
                let case = base.with_interior(&set);
                let mut shuffled = set.clone();
                shuffled.shuffle(&mut rng);
                let other = base.with_interior(&shuffled);
                assert_eq!(case.structure, other.structure);
                assert_eq!(case.theta, other.theta);
                let (a, b) = (case.run(&input, 1), other.run(&input, 1));
                assert_eq!(a, b, "{}", label(&set, plant));
                assert!(a.iter().all(|y| y.is_finite()));
            }
        }
    }
}

#[test]
fn removing_an_effect_undoes_adding_it() {
    for plant in Plant::ALL {
        let base = base(plant).structure;
        for set in random_sets(plant, 3, 8, 5) {
            let add = |s: Structure, p: &Placed| s.with(*p).expect("it applies");
            let with = set.iter().fold(base.clone(), add);
            assert_eq!(with.effects().len(), 3);
            let without = set.iter().fold(with.clone(), |s, p| s.without(p.effect));
            assert_eq!(without, base);
            // An effect in the model is no candidate; every other effect is.
            let candidates = with.candidates();
            assert!(
                candidates
                    .iter()
                    .all(|c| set.iter().all(|on| on.effect.id != c.effect.id))
            );
            assert!(candidates.iter().all(|c| with.with(*c).is_ok()));
        }
    }
}

#[test]
fn names_units_and_values_line_up() {
    for plant in Plant::ALL {
        let base = base(plant).structure;
        for placed in placements(plant) {
            let with = base.with(placed).expect("it applies");
            assert_eq!(with.parameters().len(), with.parameter_names().len());
            for info in with.effect_parameters(placed) {
                let name = format!("{}.{} on {}", placed.effect.id, info.name, plant.id());
                assert!(info.lower < info.upper, "{name}: {info:?}");
                assert!(!info.starts.is_empty(), "{name}: no start");
                for start in &info.starts {
                    assert!(
                        (info.lower..=info.upper).contains(start),
                        "{name}: start {start} out of {info:?}"
                    );
                }
                if info.absent.is_finite() {
                    assert!(
                        (info.lower..=info.upper).contains(&info.absent),
                        "{name}: absent out of {info:?}"
                    );
                }
            }
            for other in placed.effect.confused_with {
                assert!(
                    plants::EffectInfo::find(other).is_some(),
                    "{}: no `{other}`",
                    placed.effect.id
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// For any ranges of a record a fit can begin: bounds in order, starts and the absent value between them.
    #[test]
    fn bounds_are_in_order_for_any_record(
        u in (-20.0..20.0_f64, 0.0..20.0_f64),
        y in (-50.0..50.0_f64, 0.001..50.0_f64),
        h in 0.01..60.0_f64,
        samples in 10.0..5000.0_f64,
    ) {
        for plant in Plant::ALL {
            let scales = plants::Scales::from_ranges((u.0, u.0 + u.1), (y.0, y.0 + y.1), h, samples * h);
            let structure = Structure::new(plant, plants::Known::default(), scales);
            let own = structure.parameters();
            let all = own.iter().cloned().chain(
                placements(plant).into_iter().flat_map(|p| structure.effect_parameters(p)),
            );
            for info in all {
                prop_assert!(info.lower <= info.upper, "{}: {info:?}", plant.id());
                for start in &info.starts {
                    prop_assert!((info.lower..=info.upper).contains(start), "{}: {info:?}", plant.id());
                }
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let tank = base(Plant::SingleTank).structure;
    let at = |id: &str, vessel| Placed {
        effect: effect(id),
        vessel,
    };
    let once = tank.with(at("overflow", 0)).expect("it applies");
    assert_eq!(
        once.with(at("overflow", 0)),
        Err(Error::EffectTwice { effect: "overflow" })
    );
    assert_eq!(
        tank.with(at("sqrt_outflow", 0)),
        Err(Error::EffectDoesNotApply {
            effect: "sqrt_outflow",
            plant: "single-tank",
            why: "whose outflow follows another law",
        })
    );
    assert_eq!(
        tank.with(at("const_leak", 1)),
        Err(Error::NoSuchVessel {
            effect: "const_leak",
            plant: "single-tank"
        })
    );
    let two = base(Plant::CascadedTanks).structure;
    assert!(two.with(at("const_leak", 1)).is_ok());
    assert!(matches!(
        two.with(at("const_leak", 2)),
        Err(Error::NoSuchVessel { .. })
    ));
    assert!(matches!(
        two.with(at("pump_lag", 1)),
        Err(Error::NoSuchVessel { .. })
    ));
    assert!(two.with(at("laminar_outflow", 0)).is_ok());
    let linear = base(Plant::CascadedTanksLinear).structure;
    assert!(matches!(
        linear.with(at("laminar_outflow", 0)),
        Err(Error::EffectDoesNotApply { .. })
    ));
    let count = |theta: &[f64], levels: &[f64]| Simulator::new(&two, theta, levels, 0.0).err();
    assert_eq!(
        count(&[1.0; 2], &[1.0; 2]),
        Some(Error::Count {
            what: "parameters",
            given: 2,
            needed: 3
        })
    );
    assert_eq!(
        count(&[1.0; 3], &[1.0]),
        Some(Error::Count {
            what: "initial levels, and an excess for each lag",
            given: 1,
            needed: 2
        })
    );
    assert_eq!(count(&[1.0; 3], &[1.0; 2]), None);
    assert!(matches!(
        "cascade".parse::<Plant>(),
        Err(Error::UnknownPlant { .. })
    ));
    for plant in Plant::ALL {
        assert_eq!(plant.id().parse::<Plant>(), Ok(plant));
    }
}

#[test]
fn bounds_follow_the_unit_of_the_command_and_the_shortest_time_constant() {
    let (h, high) = (2.0, 22.0);
    let bounds = |unit: f64, name: &str| {
        let scales = plants::Scales::from_ranges((2.0 * unit, 7.0 * unit), (7.0, high), h, 1800.0);
        let parameters = Plant::CascadedTanks.parameters(&scales);
        let info = parameters.iter().find(|info| info.name == name).unwrap();
        (info.lower, info.upper)
    };
    let (volt, tiny) = (bounds(1.0, "pump_gain"), bounds(1e-13, "pump_gain"));
    assert!((tiny.0 * 1e-13 / volt.0 - 1.0).abs() < 1e-12);
    assert!((tiny.1 * 1e-13 / volt.1 - 1.0).abs() < 1e-12);
    // tau = 2 S sqrt(H)/alpha of the measured tank at its largest level, S = 1.
    let shortest = 2.0 * high.sqrt() / bounds(1.0, "alpha_lower").1;
    assert!((shortest - 0.1 * h).abs() < 1e-12);
}
