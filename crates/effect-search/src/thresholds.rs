//! The numbers that decide what a diagnosis claims and how widely it searches.

use serde::{Deserialize, Serialize};

/// What decides what a diagnosis claims, and how widely it searches.
///
/// [`Thresholds::DEFAULT`] has the values of every diagnosis that does not ask for others. "Chosen" marks a value without a derivation;
/// `cargo run --release -p ctid-tests --example thresholds` shows what a diagnosis says of simulated records when each value is halved and
/// doubled, and `cargo run --release -p ctid-tests --example library_study` measures the rates of the whole set of values.
///
/// A fall of the criterion is a difference of BIC, a fall of the deviance one of `-2 log likelihood`: both have no unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thresholds {
    // The noise model.
    /// Largest order of the autoregressive noise model (1 or more). BIC chooses the order up to it. Chosen.
    pub noise_order: usize,
    /// Largest number of effects that the search in white noise adds before the noise model is taken from its residual (1 or more): further
    /// effects would explain noise. Chosen.
    pub effects_before_noise: usize,
    /// Longest memory of the noise model in whose metric effects are searched, as a part of the longest record (0 to 1): noise with a longer
    /// memory leaves fewer than about ten independent samples. Chosen.
    pub longest_memory: f64,
    /// Memory of noise that is never called slow, however short the record \[samples\]. Chosen.
    pub ordinary_memory: f64,
    /// Records shorter than this many times [`Self::ordinary_memory`] are not asked whether their noise is slow (1 or more): they do not tell
    /// slow physics from noise. Chosen.
    pub memory_times: f64,
    /// Two noise models whose coefficients differ by no more than this are the same, and the search is not moved to the second one's metric
    /// (0 or more). Chosen.
    pub same_noise: f64,

    // Scores of the candidates.
    /// Largest number of starts of a candidate that are scored (1 or more); more are thinned out evenly. Chosen, for time.
    pub scored_starts: usize,
    /// Best starts of a candidate with a threshold that are linearised by all parameters (1 or more). Chosen, for time.
    pub linearised_starts: usize,
    /// Best starts from which a candidate is fitted (1 or more). Chosen, for time.
    pub kept_starts: usize,
    /// The same for a candidate whose absence is a limit, such as an RC pair (1 or more). Chosen, for time.
    pub kept_factor_starts: usize,
    /// Largest number of parameters of such a candidate that are scaled by the factor of its score: each one more triples the simulations.
    /// Chosen, for time.
    pub scaled_parameters: usize,

    // The search of sets.
    /// Single effects that are fitted beside the believed model, those with the best scores (1 or more). Chosen, for time.
    pub first_refits: usize,
    /// Single effects, the best, that are fitted also from starts of their own, where the believed model has an open parameter. Chosen, for
    /// time.
    pub own_start_refits: usize,
    /// Starts of each of these fits (1 or more). Chosen, for time.
    pub own_starts: usize,
    /// Pairs that are fitted, those with the best joint scores. Chosen, for time.
    pub pair_refits: usize,
    /// Candidates that are scored beside larger sets at least, the best beside the believed model; half of all where that is more. Chosen, for
    /// time.
    pub kept_candidates: usize,
    /// Sets that grow side by side: width of the beam (1 or more). Chosen, for time.
    pub beam: usize,
    /// A set of the beam grows where its fall of the criterion is at least this share of the best one's (0 to 1). Chosen.
    pub beam_share: f64,
    /// Candidates that are fitted beside a set, those with the best scores (1 or more). Chosen, for time.
    pub refits: usize,
    /// A candidate is fitted beside a set where this many times its predicted fall of the deviance, plus [`Self::fall_margin`], exceeds its BIC
    /// penalty (1 or more): one step of Gauss-Newton predicts too small a fall where an effect is far from linear. Chosen.
    pub fall_factor: f64,
    /// See [`Self::fall_factor`] \[deviance\]. Chosen.
    pub fall_margin: f64,
    /// The search goes on, and a swapped set replaces another, where the criterion falls by this \[BIC\]. 2 is the lower end of "positive"
    /// evidence in A. E. Raftery, Sociological Methodology 25 (1995) 111-163.
    pub growth_margin: f64,

    // The floating search.
    /// Best sets of each metric from which the floating search may begin (1 or more). Chosen, for time.
    pub floating_seeds: usize,
    /// The floating search begins once from the best set with no more effects than this. Chosen.
    pub floating_small_set: usize,
    /// Effects, those with the best scores, that are tried in the place of another. Chosen, for time.
    pub floating_swaps: usize,
    /// Best sets that are compared with the noise model of their own residual. Chosen, for time.
    pub floating_compared: usize,

    // The acceptance test.
    /// An effect is accepted where the criterion falls by more than this \[BIC\]. 6 is the lower end of "strong" evidence in Raftery (1995).
    pub bic_margin: f64,
    /// ... and where chance would let so large a fall of the deviance happen less often than this, over all candidates and their starts
    /// (Bonferroni; probability). Chosen; its rate of false claims is measured by
    /// `library_study --kinds clean`.
    pub false_claim: f64,
    /// An effect is fitted again without the reading that makes at least this share of its fall of the deviance, and has to pass without it
    /// (0 to 1). Chosen.
    pub telling_reading: f64,

    // Residual tests.
    /// A residual is not noise where the p-value of a test, corrected for the number of tests of its kind, is below this (probability).
    /// Chosen; its rate of false alarms is measured by `library_study --kinds clean`.
    pub not_noise: f64,
    /// An input whose past predicts all but this share of its standard deviation is not tested against the residual (0 to 1): prewhitening
    /// leaves only its first samples and rounding. Chosen.
    pub predictable_input: f64,
    /// A smooth function explains more of the residual than chance where its corrected p-value is below this (probability). Larger than
    /// [`Self::not_noise`]: the functions are correlated, and the correction by their number is too strict. Chosen.
    pub function_chance: f64,
    /// Parts of a residual whose spectra are compared (2 or more). Chosen.
    pub stationary_parts: usize,
    /// Lines of the lowest band of these spectra (1 or more); each band above has as many as all below it, as what physics leaves is slow more
    /// often than fast. Chosen.
    pub stationary_lines: usize,
    /// Shortest part that is tested \[samples\]: four bands.
    pub stationary_part_samples: usize,

    // A part of the answer.
    /// So many effects or more are called a part of the answer: together they may imitate one that no candidate holds. Chosen.
    pub many_effects: usize,
    /// Effects that leave more than noise are a part of the answer where they explain this share of the mean squared error above the noise
    /// (0 to 1). Chosen.
    pub partial_share: f64,
    /// The same for an effect that follows time alone, which imitates any slow disturbance (0 to 1). Chosen.
    pub partial_share_of_time: f64,
    /// Sets of one size that are tested, those with the least criterion (1 or more). Chosen, for time.
    pub partial_tested: usize,
    /// A larger set is taken where each further effect leaves at most this part of what a smaller set leaves of the error above the noise
    /// (0 to 1). Chosen.
    pub partial_left: f64,
    /// A set explains at least this share of the mean squared error on parts of the records that it was not fitted to (0 to 1). Chosen.
    pub carried_over: f64,
    /// Parts of each record, of which each is left out in turn: folds of the cross-validation (2 or more). Chosen.
    pub folds: usize,
    /// Largest innovation standard deviation beside a set over that beside the model without it (1 or more): what imitates a slow course by
    /// moves of its own is rougher than the record. Chosen.
    pub innovation_ratio: f64,

    // Groups of what the data cannot tell apart.
    /// A candidate with no more parameters can stand in where its deviance is within this of the best: the 99 % quantile of chi-square with
    /// two degrees of freedom.
    pub same_deviance: f64,
    /// A candidate can stand in where its criterion is within this of the best \[BIC\]: the same margin as [`Self::bic_margin`].
    pub same_bic: f64,
    /// Stand-ins that are fitted, those with the best scores. Chosen, for time.
    pub group_refits: usize,
    /// A stand-in is fitted to the end where the criterion of its first fit is within this of the best \[BIC\]. Chosen, for time.
    pub group_near: f64,
    /// A stand-in is fitted where its predicted fall of the deviance is above this share of the effect's own, less
    /// [`Self::group_predicted_margin`] (0 to 1). Chosen, for time.
    pub group_predicted_share: f64,
    /// See [`Self::group_predicted_share`] \[deviance\]. Chosen, for time.
    pub group_predicted_margin: f64,
    /// A candidate of the user's own replaces an effect of the catalogue in the answer where the deviances differ by less. Chosen.
    pub same_effect: f64,
    /// A candidate of the user's own stands in where it explains this share of what the effect does, and what it leaves may be noise
    /// (0 to 1). Chosen.
    pub own_candidate_share: f64,

    // The shape of what no candidate explains.
    /// Smooth functions that are fitted, those with the best scores (1 or more). Chosen, for time.
    pub shape_refits: usize,
    /// Of these, the best are tested on parts of the records that they were not fitted to. Chosen, for time.
    pub shape_left_out: usize,
    /// A function of a signal explains this share of the mean squared error there, or functions of time take part too (0 to 1). Chosen.
    pub shape_least_share: f64,
    /// Points at which the shape is given (2 or more). Chosen.
    pub shape_points: usize,
}

impl Thresholds {
    /// The values that a diagnosis has where nothing else is asked for.
    pub const DEFAULT: Self = Self {
        noise_order: 6,
        effects_before_noise: 2,
        longest_memory: 1.0 / 15.0,
        ordinary_memory: 12.0,
        memory_times: 10.0,
        same_noise: 0.05,
        scored_starts: 24,
        linearised_starts: 3,
        kept_starts: 2,
        kept_factor_starts: 3,
        scaled_parameters: 4,
        first_refits: 28,
        own_start_refits: 16,
        own_starts: 4,
        pair_refits: 8,
        kept_candidates: 40,
        beam: 4,
        beam_share: 0.6,
        refits: 8,
        fall_factor: 2.0,
        fall_margin: 6.0,
        growth_margin: 2.0,
        floating_seeds: 8,
        floating_small_set: 2,
        floating_swaps: 4,
        floating_compared: 4,
        bic_margin: 6.0,
        false_claim: 0.003,
        telling_reading: 0.5,
        not_noise: 1e-4,
        predictable_input: 0.01,
        function_chance: 1e-3,
        stationary_parts: 4,
        stationary_lines: 2,
        stationary_part_samples: 50,
        many_effects: 3,
        partial_share: 0.38,
        partial_share_of_time: 0.9,
        partial_tested: 6,
        partial_left: 0.5,
        carried_over: 0.3,
        folds: 4,
        innovation_ratio: 1.05,
        same_deviance: 9.21,
        same_bic: 6.0,
        group_refits: 20,
        group_near: 60.0,
        group_predicted_share: 0.3,
        group_predicted_margin: 10.0,
        same_effect: 0.1,
        own_candidate_share: 0.75,
        shape_refits: 10,
        shape_left_out: 5,
        shape_least_share: 0.2,
        shape_points: 25,
    };
}

impl Default for Thresholds {
    fn default() -> Self {
        Self::DEFAULT
    }
}
