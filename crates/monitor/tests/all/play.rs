//! A pump after a valve with backlash: the state of the backlash may depend on commands before the stored rows.

use ct_signals::{excitation, noise};
use monitor::{Model, Monitor, Row, Settings, Units};
use plants::{EffectInfo, Known, Placed, Plant};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

const PLAY: f64 = 0.6;

#[test]
fn a_command_that_rests_within_the_play_raises_no_alarm() {
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    let lively = excitation::steps(1500, 15..=40, 3.0, 7.0, rng).unwrap();
    // Down through the backlash, and constant for longer than the run-up of a checkpoint.
    let rests = (0..8000).map(|k| [5.0, 4.5, 5.2, 4.7][k / 2000]);
    let command: Vec<f64> = lively.into_iter().chain(rests).collect();
    let noise = noise::white(command.len(), 0.05, rng);
    let known = Known {
        area: [Some(154.0), None, None],
        input_range: Some(10.0),
        ..Known::default()
    };
    let model = Model {
        effects: vec![Placed {
            effect: EffectInfo::find("stiction_backlash").unwrap(),
            vessel: 0,
        }],
        ..Model::new(Plant::SingleTank, known)
    };
    let mut monitor = Monitor::new(model, Settings::default(), Units::default()).unwrap();
    let (mut level, mut stem) = (16.0_f64, command[0]);
    for (k, (&u, noise)) in command.iter().zip(noise).enumerate() {
        let row = Row::new(2.0 * k as f64, u, &[level + noise]);
        let step = monitor.update(&row).unwrap();
        assert_eq!(step.alarm, None);
        stem = stem.clamp(u - 0.5 * PLAY, u + 0.5 * PLAY);
        for _ in 0..20 {
            let rate = |level: f64| (10.0 * stem - 12.5 * level.sqrt()) / 154.0;
            level += 0.1 * rate(level + 0.05 * rate(level));
        }
    }
    assert!(monitor.rows() > 9000 && !monitor.estimates().is_empty());
}
