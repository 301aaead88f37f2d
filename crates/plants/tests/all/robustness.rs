//! For any values that a fit may try and a user may record, the output stays finite and the levels stay in their vessels.

use crate::support;
use crate::support::{Case, base, difference, effect, placements, random_sets, reference};
use plants::{Command, Dual, Outlet, Plant, Scalar, Simulator};
use proptest::prelude::*;

/// Somewhere between two bounds, by a share: on a scale of decades where both are positive and far apart.
fn between(lower: f64, upper: f64, share: f64) -> f64 {
    if lower > 0.0 && upper > 10.0 * lower {
        lower * (upper / lower).powf(share)
    } else {
        lower + (upper - lower) * share
    }
}

/// Runs a case and checks every level at every sample; returns the largest derivative.
fn run(case: &Case, input: &[(Command, f64)], substeps: usize) -> Result<f64, TestCaseError> {
    let variables: Vec<Dual<15>> = case
        .variables()
        .iter()
        .enumerate()
        .map(|(lane, &value)| Dual::variable(value, lane))
        .collect();
    let (theta, levels) = variables.split_at(case.theta.len());
    let mut simulator = Simulator::new(&case.structure, theta, levels, case.at_rest)
        .map_err(|error| TestCaseError::fail(error.to_string()))?;
    simulator.set_substeps(substeps);
    let plant = case.structure.plant;
    let names = case.structure.parameter_names();
    let rim = names
        .iter()
        .position(|name| name == "overflow.rim")
        .map(|i| case.theta[i]);
    let brim = case
        .structure
        .effects()
        .iter()
        .find(|p| p.effect.id == "overflow")
        .map(|p| p.vessel);
    let mut largest = 0.0_f64;
    for &(command, h) in input {
        let y = simulator.read(0);
        prop_assert!(
            y.re.is_finite(),
            "reading {} of {names:?} at {:?}",
            y.re,
            case.theta
        );
        for e in y.eps {
            prop_assert!(
                e.is_finite(),
                "derivative {e} of {names:?} at {:?}",
                case.theta
            );
            largest = largest.max(e.abs());
        }
        for (i, level) in simulator.levels().iter().enumerate().take(plant.vessels()) {
            prop_assert!(level.re.is_finite());
            // A rim below the bottom has no effect: the bottom comes first.
            if plant.outlet() == Outlet::Torricelli {
                prop_assert!(level.re >= 0.0, "level {}", level.re);
            }
            if let (Some(rim), Some(vessel)) = (rim, brim)
                && vessel == i
                && (plant.outlet() == Outlet::Linear || rim >= 0.0)
            {
                prop_assert!(level.re <= rim, "level {} above the rim {rim}", level.re);
            }
        }
        simulator.advance(command, h);
    }
    Ok(largest)
}

/// A set of effects, every parameter at a share of the way from its lower to its upper bound.
fn at_bounds(plant: Plant, set: &[(&str, usize)], shares: &[f64]) -> Case {
    let placed = |&(id, vessel): &(&str, usize)| plants::Placed {
        effect: effect(id),
        vessel,
    };
    let set: Vec<plants::Placed> = set.iter().map(placed).collect();
    let mut case = base(plant).with_interior(&set);
    let bounds = case.structure.parameters();
    for ((value, info), share) in case.theta.iter_mut().zip(bounds).zip(shares) {
        *value = between(info.lower, info.upper, *share);
    }
    case
}

/// A vessel that narrows towards its bottom and lets out in proportion to its level is fast where it is empty, although
/// nothing flows out of it there: a step must know it, or the derivative of the initial level grows a trillion times
/// with every step.
#[test]
fn an_empty_vessel_is_as_fast_as_one_with_a_little_in_it() {
    let outlets = [
        ("laminar_outflow", 1),
        ("const_leak", 0),
        ("area_varies", 1),
    ];
    let with_pump = [outlets[0], outlets[1], outlets[2], ("pump_nonlinearity", 0)];
    for (set, shares) in [
        (&with_pump[..], vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
        (&outlets[..], vec![0.0, 1.0, 0.0, 1.0, 1.0, 1.0]),
    ] {
        let mut case = at_bounds(Plant::CascadedTanks, set, &shares);
        case.levels.fill(0.0);
        let input = [(Command::held(0.0), 3.0); 40];
        for substeps in 1..4 {
            let largest = run(&case, &input, substeps).unwrap();
            assert!(largest <= 1.0, "what is empty stays empty: {largest}");
        }
    }
}

/// An empty vessel fills as its equation says, however fast it is when it begins.
#[test]
fn an_empty_vessel_with_a_laminar_outflow_fills() {
    for taper in [0.0, 0.4, 0.8] {
        let placed = [
            plants::Placed {
                effect: effect("laminar_outflow"),
                vessel: 1,
            },
            plants::Placed {
                effect: effect("area_varies"),
                vessel: 1,
            },
        ];
        let mut case = base(Plant::CascadedTanks).with_interior(&placed);
        let names = case.structure.parameter_names();
        for (value, name) in case.theta.iter_mut().zip(&names) {
            match name.as_str() {
                "laminar_outflow.slope" => *value = 15.0,
                "area_varies.taper" => *value = taper,
                _ => {}
            }
        }
        case.levels.fill(0.0);
        let input = [(Command::held(5.0), case.h); 100];
        let error = difference(&case.run(&input, 1), &reference::run(&case, &input));
        println!("{error:e} taper {taper}");
        assert!(error < 5e-3, "{error:e} taper {taper}");
    }
}

/// The given number of samples of a constant input.
fn steady(n: usize, h: f64) -> Vec<(Command, f64)> {
    vec![(Command::held(4.9), h); n]
}

/// A level that settles a little above a hole in the wall forgets faster by the hole than by its outlet: a step must know
/// it, or the derivatives grow by half with every sample.
#[test]
fn a_level_a_little_above_a_hole_settles() {
    let holes = [Plant::SingleTank, Plant::CascadedTanks].map(|plant| (plant, plant.vessels() - 1));
    for (plant, vessel) in holes {
        for above in [1e-5, 1e-3, 0.17] {
            let placed = ["const_leak", "leak_at_height"].map(|id| plants::Placed {
                effect: effect(id),
                vessel,
            });
            let mut case = base(plant).with_interior(&placed);
            // The level at rest without the hole; the hole is then put below it by this distance, and the level falls.
            let height = case.theta.len() - 1;
            case.theta[height] = 100.0;
            let settled = *case.run(&steady(4000, case.h), 1).last().unwrap();
            case.theta[height] = settled - above;
            for stretch in [10.0, 30.0, 130.0, 300.0] {
                let input = steady(60, stretch * case.h);
                let largest = run(&case, &input, 1).unwrap();
                // The step of the Dormand-Prince method shrinks to zero at a root; many short steps are as good.
                let fine = case.run_dual(&input, (8.0 * stretch) as usize);
                let coarse = case.run_dual(&input, 1);
                let values = |run: &[Dual<15>]| run.iter().map(|y| y.re).collect::<Vec<_>>();
                let error = difference(&values(&coarse), &values(&fine));
                let last = |run: &[Dual<15>]| run.last().unwrap().eps;
                let slopes = difference(&last(&coarse), &last(&fine));
                println!(
                    "{largest:8.1e} {error:8.1e} {slopes:8.1e} {above} {stretch} {}",
                    plant.id()
                );
                // The one sample that ends near the hole may have a large error: the outflow has a corner there.
                assert!(largest < 1e4, "a derivative of {largest}");
                assert!(slopes < 1e-4, "settled derivatives differ by {slopes:e}");
                assert!(error < 5e-3, "{error:e}");
            }
        }
    }
}

/// The same for a leaking tank, where the hole causes two thirds of the decay.
#[test]
fn a_hole_below_a_leak_settles() {
    let placed = [("const_leak", 0), ("leak_at_height", 1)].map(|(id, vessel)| plants::Placed {
        effect: effect(id),
        vessel,
    });
    let case = base(Plant::CascadedTanks).with_interior(&placed);
    let largest = run(&case, &steady(300, 129.0 * case.h), 1).unwrap();
    assert!(largest < 20.0, "a derivative of {largest}");
}

/// A tank with less inflow than its pipe can carry is nearly empty, and its outflow is a root of its level.
#[test]
fn a_joined_tank_that_a_pipe_keeps_all_but_empty_settles() {
    let placed = ["pipe_height", "const_leak"].map(|id| plants::Placed {
        effect: effect(id),
        vessel: 2,
    });
    let case = base(Plant::ThreeTank).with_interior(&placed);
    for stretch in [1.0, 3.0, 10.0, 34.984727, 100.0, 300.0] {
        let largest = run(&case, &steady(300, stretch * case.h), 1).unwrap();
        println!("{largest:8.1e} {stretch}");
        assert!(largest < 1e4, "a derivative of {largest} at {stretch}");
    }
}

/// A command: often zero, now and then negative or huge, held or ramped, over a sampling interval or a gap.
fn command(h: f64) -> impl Strategy<Value = (Command, f64)> {
    let u = prop_oneof![Just(0.0), 0.0..10.0_f64, -10.0..0.0_f64, Just(1e3)];
    let to = prop_oneof![Just(None), (0.0..10.0_f64).prop_map(Some), Just(Some(0.0))];
    let step = prop_oneof![8 => Just(h), 1 => 0.1 * h..2.0 * h, 1 => Just(40.0 * h)];
    (u, to, step).prop_map(|(from, to, h)| (Command { from, to }, h))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn anything_within_the_bounds_stays_finite(
        plant in 0..Plant::ALL.len(),
        seed in 0..100_000_u64,
        size in 0..6_usize,
        shares in proptest::collection::vec(prop_oneof![1 => Just(0.0), 1 => Just(1.0), 6 => 0.0..1.0_f64], 16),
        levels in proptest::collection::vec(prop_oneof![Just(0.0), 0.0..40.0_f64], 6),
        input in proptest::collection::vec(command(3.0), 40),
        substeps in 1..4_usize,
    ) {
        let plant = Plant::ALL[plant];
        let set = random_sets(plant, size, 1, seed).remove(0);
        let mut case = base(plant).with_interior(&set);
        prop_assume!(case.variables().len() <= 16);
        for ((value, info), share) in case.theta.iter_mut().zip(case.structure.parameters()).zip(&shares) {
            *value = between(info.lower, info.upper, *share);
        }
        let states = case.levels.len();
        case.levels.copy_from_slice(&levels[..states]);
        run(&case, &input, substeps)?;
    }

    /// Around believable numbers derivatives stay of the size that the plant can have: no step amplifies them.
    #[test]
    fn derivatives_do_not_run_away(
        plant in 0..Plant::ALL.len(),
        seed in 0..100_000_u64,
        size in 0..4_usize,
        stretch in 0.0..2.5_f64,
    ) {
        let plant = Plant::ALL[plant];
        let mut set = random_sets(plant, size, 1, seed).remove(0);
        // The hysteresis amplifies small differences into large ones.
        set.retain(|p| p.effect.id != "sensor_hysteresis");
        let mut case = base(plant);
        // Sampling from one to three hundred times as coarse, with a constant input: a decaying response must not grow.
        let h = case.h * 10.0_f64.powf(stretch);
        let input = steady(300, h);
        // Functions of time are made for the record's duration, and grow further after it.
        let duration = &mut case.structure.scales.duration;
        *duration = duration.max(input.len() as f64 * h);
        let case = case.with_interior(&set);
        prop_assume!(case.variables().len() <= 16);
        let largest = run(&case, &input, 1)?;
        prop_assert!(largest < 1e4, "a derivative of {largest}");
    }
}

#[test]
fn a_tank_that_runs_dry_and_fills_again_agrees_with_its_equation() {
    for plant in [Plant::SingleTank, Plant::CascadedTanks] {
        let case = base(plant);
        let input: Vec<(Command, f64)> = (0..400)
            .map(|k| {
                (
                    Command::held(if (k / 100) % 2 == 0 { 0.0 } else { 5.0 }),
                    case.h,
                )
            })
            .collect();
        let reference = reference::run(&case, &input);
        let one = case.run(&input, 1);
        assert!(one.iter().all(|&y| y >= 0.0));
        assert!(one.iter().any(|&y| y < 1e-3), "it runs dry");
        let errors = [1, 4, 16].map(|n| difference(&case.run(&input, n), &reference));
        println!("{errors:?} {}", plant.id());
        // While an empty tank fills, the outflow is a root of time: the order falls to one and a half, of a small error, until the root is
        // replaced by a parabola.
        assert!(
            errors[0] < 1e-3 && errors[1] < 0.2 * errors[0] && errors[2] < 0.2 * errors[1] + 1e-5,
            "{errors:?}"
        );
    }
}

#[test]
fn coarse_sampling_follows_the_equation() {
    for plant in Plant::ALL {
        for placed in placements(plant) {
            let mut case = base(plant);
            case.h *= 60.0;
            case.structure.scales.duration = 60.0 * case.h;
            let mut case = case.with_interior(&[placed]);
            // Intervals of one to two time constants; lags and dead times do not change.
            for (value, info) in case.theta.iter_mut().zip(case.structure.parameters()) {
                if info.unit == plants::Unit::TIME
                    && ["delay", "time_constant"].contains(&info.name)
                {
                    *value /= 60.0;
                }
            }
            if ["sensor_hysteresis", "coarse_quantisation"].contains(&placed.effect.id) {
                continue; // They show errors of the level many times, or as whole steps.
            }
            let input = support::input(support::DRIVES[0], 60, case.h, 77);
            let error = difference(&case.run(&input, 1), &reference::run(&case, &input));
            println!(
                "{error:8.1e} {}@{} {}",
                placed.effect.id,
                placed.vessel,
                plant.id()
            );
            assert!(
                error < 0.02,
                "{} {}: {error:e}",
                placed.effect.id,
                plant.id()
            );
        }
    }
}

#[test]
fn a_record_around_zero_has_no_operating_level_to_divide_by() {
    for plant in [
        Plant::SingleTankLinear,
        Plant::CascadedTanksLinear,
        Plant::FirstOrder,
    ] {
        for id in ["area_varies", "sqrt_outflow"] {
            let mut case = base(plant);
            case.structure.scales.operating_level = [0.0; 3];
            let placed = plants::Placed {
                effect: effect(id),
                vessel: 0,
            };
            let input = support::input(support::DRIVES[0], 60, case.h, 78);
            let absent = case.with_absent(&[placed]).run(&input, 1);
            assert_eq!(absent, case.run(&input, 1), "{id} {}", plant.id());
            assert!(
                case.with_interior(&[placed])
                    .run(&input, 1)
                    .iter()
                    .all(|y| y.is_finite())
            );
        }
    }
}

/// A tank that has run dry through a pipe of no height: the square of what is left in it is no number.
#[test]
fn a_pipe_below_a_tank_that_ran_dry_has_derivatives() {
    let plant = Plant::SingleTank;
    let pipe = placements(plant)
        .into_iter()
        .find(|placed| placed.effect.id == "pipe_height")
        .expect("an effect of this plant");
    let mut case = base(plant).with_interior(&[pipe]);
    case.theta.copy_from_slice(&[1e-5, 4000.0, 0.0]);
    case.levels[0] = 1e-200;
    let input = vec![(Command::held(0.0), case.h); 300];
    run(&case, &input, 1).expect("numbers");
}
