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

#[test]
fn magnitudes_are_those_of_both_signs() {
    let values: Vec<f64> = (-20..=100).map(f64::from).collect();
    let magnitudes = Span::of(&values).unwrap().magnitudes();
    assert_eq!((magnitudes.low, magnitudes.high), (1.0, 100.0));
    assert_eq!(magnitudes.first, 20.0);
    assert!(magnitudes.quantiles.is_sorted());
    // Pulses: half the rows are zero.
    let pulses = [[0.0; 60].as_slice(), &[10.0; 20], &[-30.0; 20]].concat();
    let magnitudes = Span::of(&pulses).unwrap().magnitudes();
    assert_eq!((magnitudes.low, magnitudes.high), (10.0, 30.0));
    assert_eq!(magnitudes.thresholds(&[0.1, 0.3])[0], 20.0);
    let below = Span::of(&[-5.0, -3.0, -4.0]).unwrap().magnitudes();
    assert_eq!((below.low, below.high), (3.0, 5.0));
    // Where only the range is known.
    let range = |low, high| Span {
        low,
        high,
        first: low,
        quantiles: Vec::new(),
    };
    let of = |span: Span| {
        let magnitudes = span.magnitudes();
        (magnitudes.low, magnitudes.high)
    };
    assert_eq!(of(range(-2.0, 1.0)), (0.0, 2.0));
    assert_eq!(of(range(-4.0, -1.0)), (1.0, 4.0));
}
