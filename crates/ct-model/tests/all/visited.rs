//! Ranges that the data visit, from which the starts of effects follow.

use ct_model::effects::Span;

#[test]
fn thresholds_are_tried_at_quantiles_and_between_few_levels() {
    let shares = [0.9, 0.5, 0.1];
    let even: Vec<f64> = (0..=1000).map(f64::from).collect();
    let places = Span::of(&even).unwrap().thresholds(&shares);
    assert_eq!(places, [900.0, 500.0, 100.0]);
    // Of the levels 2, 5 and 10 the middle one is rare: all quantiles are ends of the range.
    let few = [[2.0; 70].as_slice(), &[5.0; 2], &[10.0; 28]].concat();
    let mut places = Span::of(&few).unwrap().thresholds(&shares);
    places.sort_by(f64::total_cmp);
    assert_eq!(places, [3.5, 6.25, 7.5]);
    // Noise on a level makes no further levels.
    let noisy: Vec<f64> = (0..100).map(|k| few[k] + 1e-3 * (k % 7) as f64).collect();
    let mut around = Span::of(&noisy).unwrap().thresholds(&shares);
    around.sort_by(f64::total_cmp);
    assert!(
        places
            .iter()
            .zip(&around)
            .all(|(a, b)| (a - b).abs() < 0.01),
        "{around:?}"
    );
    let constant = Span::of(&[3.0; 9]).unwrap().thresholds(&shares);
    assert_eq!(constant, [3.0; 3]);
}
