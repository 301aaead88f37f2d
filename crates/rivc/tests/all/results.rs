//! An estimate is written as JSON and read again, and results cross threads.

use ct_signals::{excitation, noise};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rivc::{Data, Delay, Error, Estimate, Noise, Plant, Settings, Structure, estimate};

#[test]
fn an_estimate_is_read_again() {
    let u = excitation::prbs(600, 20, -1.0, 1.0, 3).unwrap();
    let decay = f64::exp(-1.0 / 8.0);
    let mut y = vec![20.0];
    for k in 0..u.len() - 1 {
        y.push(20.0 + decay * (y[k] - 20.0) + 2.0 * (1.0 - decay) * u[k]);
    }
    let v = noise::ar1(y.len(), 0.1, 0.7, &mut ChaCha8Rng::seed_from_u64(1));
    let y = y.iter().zip(v).map(|(y, v)| y + v).collect();
    let structure = Structure::new(1, [0]).with_delay(0, Delay::Estimated { most: 5.0 });
    let record = [Data::even(1.0, u, y)];
    for kind in [Noise::White, Noise::Autoregressive] {
        let found = estimate(&record, &structure, &Settings::new(kind)).unwrap();
        let text = serde_json::to_string(&found).unwrap();
        let again: Estimate = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&again).unwrap(), text);
        assert_eq!(again.parameters, found.parameters);
        assert_eq!(again.plant, found.plant);
    }
}

#[test]
fn what_is_no_estimate_is_refused() {
    let text = r#"{"coefficients":[1.5],"sigma":1.0}"#;
    let error = serde_json::from_str::<ct_signals::ArModel>(text).unwrap_err();
    assert!(error.to_string().contains("stationary"), "{error}");
}

const fn crosses<T: Send + Sync>() {}

const _: () = {
    crosses::<Estimate>();
    crosses::<Plant>();
    crosses::<Data>();
    crosses::<Structure>();
    crosses::<Settings>();
    crosses::<Error>();
};
