//! The numerical thresholds of a diagnosis: for its claims and for the extent of its search.

use serde::{Deserialize, Serialize};

/// The numerical thresholds that determine what a diagnosis claims and how widely it searches.
///
/// [`Thresholds::DEFAULT`] holds the values that a diagnosis uses unless it is given others. "Chosen" marks a value without a derivation.
/// `cargo run --release -p ctid-tests --example thresholds` shows the results of a diagnosis of simulated records with each value halved
/// and doubled; `cargo run --release -p ctid-tests --example library_study` measures the error rates for the whole set of values. "Chosen,
/// for time": the value limits the computation time.
///
/// Thresholds of a comparison that no search uses are constants in the file of their code, such as those for the fit in a loop whose model
/// lacks an effect ([`crate::Enclosed::depends_on_external_signals`]).
///
/// The criterion is BIC; a fall of the criterion is a difference of BIC, a fall of the deviance a difference of `-2 log likelihood`. Both
/// are dimensionless.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Thresholds {
    // The control loop of the records.
    /// Without a known controller, feedback through an input is reported if the p-value of its test, corrected for the number of tests, is
    /// below this (probability). Chosen, as [`Self::not_noise`].
    pub feedback: f64,
    /// Largest difference between the controller's commands and the measured ones, as a share of the standard deviation of the command (0
    /// to 1): the loop of a controller with a larger difference is not simulated; a smaller difference is a known input of the loop.
    /// Chosen.
    pub other_controller: f64,
    /// Largest share of rows without a reading of a controlled output with which a loop is simulated (0 to 1). Chosen.
    pub lacking_readings: f64,
    /// A loop cannot have produced the records, and is not simulated, if it grows by more than this number of factors e over the longest
    /// record, in addition to the growth of the model without controllers (0 or more). Chosen.
    pub loop_growth: f64,

    // The noise model.
    /// Largest order of the autoregressive noise model (1 or more). BIC selects the order up to this one. Chosen.
    pub noise_order: usize,
    /// Largest number of effects that the search with white noise adds before the noise model is estimated from its residual (1 or more):
    /// further effects would fit noise. Chosen.
    pub effects_before_noise: usize,
    /// Longest correlation time of the noise model with which effects are searched, as a share of the longest record (0 to 1): noise with a
    /// longer correlation time leaves fewer than about fifteen independent samples. Chosen.
    pub longest_memory: f64,
    /// Correlation time up to which noise is never called slow, however short the record \[samples\]. Chosen.
    pub memory_limit: f64,
    /// Records shorter than this many times [`Self::memory_limit`] are not tested for slow noise (1 or more): they are too short to
    /// distinguish slow physics from noise. Chosen.
    pub memory_times: f64,
    /// Two noise models whose coefficients differ by no more than this are the same, and the fits are not repeated with the second one (0
    /// or more). Chosen.
    pub same_noise: f64,

    // Scores of the candidates.
    /// Largest number of starts of a candidate that are scored (1 or more); of more starts, an evenly spaced selection is scored. Chosen,
    /// for time.
    pub scored_starts: usize,
    /// Number of best starts of a candidate with a threshold for which the model is linearised by all parameters, in addition to the
    /// best one of each choice, such as an upper or a lower limit (1 or more). Chosen, for time.
    pub linearised_starts: usize,
    /// Number of best starts from which a candidate is fitted, in addition to the best one of each choice (1 or more). Chosen, for time.
    pub kept_starts: usize,
    /// As [`Self::kept_starts`], for a candidate whose absent value is a limit, such as an RC pair (1 or more). Chosen, for time.
    pub kept_factor_starts: usize,
    /// Largest number of parameters of such a candidate that are scaled by the factor of its score: each further parameter triples the
    /// number of simulations. Chosen, for time.
    pub scaled_parameters: usize,

    // The search of sets.
    /// Number of single effects, those with the best scores, that are fitted in addition to the believed model (1 or more). Chosen, for
    /// time.
    pub first_refits: usize,
    /// Number of best single effects that are also fitted from starts of their own, if a parameter of the believed model is at a bound or
    /// not determined by the records. Chosen, for time.
    pub own_start_refits: usize,
    /// Number of starts of each of these fits (1 or more). Chosen, for time.
    pub own_starts: usize,
    /// Number of pairs of effects that are fitted, those with the best joint scores. Chosen, for time.
    pub pair_refits: usize,
    /// Smallest number of candidates that are scored in addition to larger sets, those with the best scores for the believed model; half of
    /// all candidates if that is more. Chosen, for time.
    pub kept_candidates: usize,
    /// Beam width: number of sets that are extended in parallel (1 or more). Chosen, for time.
    pub beam: usize,
    /// Number of best sets that are fitted to convergence before they are compared (1 or more). Chosen, for time.
    pub converged: usize,
    /// Largest number of effects that a beam adds; the floating search adds more. Chosen, for time.
    pub beam_effects: usize,
    /// Of two sets with as many effects only the better one is extended if the norm of the difference of their whitened residuals is below
    /// this share of the norm of the better one's (0 to 1). Chosen.
    pub same_residual: f64,
    /// A set of the beam is extended if its fall of the criterion is at least this share of the best set's fall (0 to 1). Chosen.
    pub beam_share: f64,
    /// Number of candidates, those with the best scores, that are fitted in addition to a set (1 or more). Chosen, for time.
    pub refits: usize,
    /// A candidate is fitted in addition to a set if this factor times its predicted fall of the deviance, plus [`Self::fall_margin`],
    /// exceeds its BIC penalty (1 or more): one Gauss-Newton step underestimates the fall for a strongly nonlinear effect. Chosen.
    pub fall_factor: f64,
    /// See [`Self::fall_factor`] \[deviance\]. Chosen.
    pub fall_margin: f64,
    /// The search continues, and a swapped set replaces another one, if the criterion falls by at least this \[BIC\]. 2 is the lower end of
    /// "positive" evidence in A. E. Raftery, Sociological Methodology 25 (1995) 111-163.
    pub growth_margin: f64,

    // Other minima of a set's fit.
    /// Number of starts with other values of an effect's thresholds, those with the lowest predicted cost, that are fitted (1 or more).
    /// Chosen, for time.
    pub minima_fitted: usize,
    /// Number of times that the effects of a set are tried one after another (1 or more). Chosen, for time.
    pub minima_rounds: usize,

    // The floating search.
    /// Number of best sets, for each noise model, from which the floating search may begin (1 or more). Chosen, for time.
    pub floating_seeds: usize,
    /// The floating search also begins from the best set with at most this many effects in addition to those of the model file. Chosen.
    pub floating_small_set: usize,
    /// Number of effects, those with the best scores, that are tried in place of another effect (swap step). Chosen, for time.
    pub floating_swaps: usize,
    /// Number of best sets that are compared with a noise model from each set's own residual. Chosen, for time.
    pub floating_compared: usize,

    // The acceptance test.
    /// An effect is accepted if the criterion falls by more than this \[BIC\]. 6 is the lower end of "strong" evidence in Raftery (1995).
    pub bic_margin: f64,
    /// ... and if the probability of so large a fall of the deviance by chance is below this, corrected for the number of candidates and
    /// starts (Bonferroni; probability). Chosen; `library_study --kinds clean` measures the rate of false claims.
    pub false_claim: f64,
    /// If one reading causes at least this share of an effect's fall of the deviance, the effect is fitted again without this reading and
    /// has to pass the acceptance test without it (0 to 1). Chosen.
    pub telling_reading: f64,
    /// The same holds for a function of time and this share of each record at its beginning (0 to 1), where the unknown past of the inputs and
    /// states acts. Chosen.
    pub beginning: f64,

    // Residual tests.
    /// A residual is not noise if the p-value of a test, corrected for the number of tests of its kind, is below this (probability).
    /// Chosen; `library_study --kinds clean` measures the rate of false alarms.
    pub not_noise: f64,
    /// An input is not tested against the residual if its past predicts it with an error below this share of its standard deviation (0 to
    /// 1): prewhitening would leave only its first samples and rounding errors. Chosen.
    pub predictable_input: f64,
    /// A smooth function explains a significant part of the residual if its corrected p-value is below this (probability). Larger than
    /// [`Self::not_noise`], because the functions are correlated, so that the correction for their number is conservative. Chosen.
    pub function_chance: f64,
    /// Number of parts of a residual whose spectra are compared (2 or more). Chosen.
    pub stationary_parts: usize,
    /// Number of spectral lines in the lowest band of these spectra (1 or more); each higher band has as many lines as all bands below it,
    /// because unmodelled physics is more often slow than fast. Chosen.
    pub stationary_lines: usize,
    /// Shortest part that is tested \[samples\]: four bands.
    pub stationary_part_samples: usize,

    // A part of the answer.
    /// This many effects or more are reported as a part of the answer only: together they may imitate one effect that is not a candidate.
    /// Chosen.
    pub many_effects: usize,
    /// An answer with more functions of time than this, beside further effects ([`Self::many_effects`]) or with correlated noise, may describe any
    /// slow disturbance (0 or more): it is replaced by a partial explanation, or by none. Chosen.
    pub functions_of_time: usize,
    /// Effects whose residual is not noise are reported as a part of the answer if they explain this share of the mean squared error above
    /// the noise level (0 to 1). Chosen.
    pub partial_share: f64,
    /// Effects are a part of the answer if they explain less than this share of the mean squared error above the innovations (0 to 1): the rest
    /// is correlated, and may be noise or unmodelled physics. Chosen.
    pub whole_share: f64,
    /// As [`Self::partial_share`], for an effect that depends on time only, which can imitate any slow disturbance (0 to 1). Chosen.
    pub partial_share_of_time: f64,
    /// Number of sets of each size that are tested, those with the smallest criterion (1 or more). Chosen, for time.
    pub partial_tested: usize,
    /// A larger set is preferred if each further effect reduces the error above the noise level to at most this share of the smaller set's
    /// (0 to 1). Chosen.
    pub partial_left: f64,
    /// Or if each further effect reduces the squared error in the cross-validation to at most this share of the smaller set's: one of the
    /// two criteria is sufficient (0 to 1). Chosen.
    pub partial_left_out: f64,
    /// In both cases each further effect must reduce the squared error of the fit to at most this share of the smaller set's (0 to 1).
    /// Chosen.
    pub partial_error: f64,
    /// Smallest share of the squared error, of several outputs of their geometric mean, that a set has to explain on parts of the records
    /// to which it was not fitted (0 to 1). Chosen.
    pub carried_over: f64,
    /// Number of folds of the cross-validation: parts of each record, each of which is left out in turn (2 or more). Chosen.
    pub folds: usize,
    /// Largest ratio of the innovation standard deviation with a set of effects to that without it (1 or more): a set that imitates a slow
    /// disturbance by its own dynamics makes the output rougher than the record. Chosen.
    pub innovation_ratio: f64,

    // Groups of effects that the data cannot distinguish.
    /// A candidate with no more parameters is an alternative if its deviance is within this of the best one's: the 99 % quantile of
    /// chi-square with two degrees of freedom.
    pub same_deviance: f64,
    /// A candidate is an alternative if its criterion is within this of the best one's \[BIC\]: the same margin as [`Self::bic_margin`].
    pub same_bic: f64,
    /// Number of alternatives that are fitted, those with the best scores. Chosen, for time.
    pub group_refits: usize,
    /// The fit of an alternative is continued to convergence if the criterion of its first fit is within this of the best one's \[BIC\].
    /// Chosen, for time.
    pub group_near: f64,
    /// An alternative is fitted if its predicted fall of the deviance exceeds this share of the effect's own fall, minus
    /// [`Self::group_predicted_margin`] (0 to 1). Chosen, for time.
    pub group_predicted_share: f64,
    /// See [`Self::group_predicted_share`] \[deviance\]. Chosen, for time.
    pub group_predicted_margin: f64,
    /// A user-defined candidate replaces an effect of the catalogue in the answer if their deviances differ by less than this. Chosen.
    pub same_effect: f64,
    /// A user-defined candidate is an alternative if it explains this share of what the effect explains, and its residual may be noise (0
    /// to 1). Chosen.
    pub own_candidate_share: f64,
    /// Where the better effect leaves white noise, such a candidate is left out if its criterion is higher by more than this.
    pub own_candidate_bic: f64,

    // The shape of the error that no candidate explains.
    /// Number of smooth functions that are fitted, those with the best scores (1 or more). Chosen, for time.
    pub shape_refits: usize,
    /// Number of these functions, the best ones, that are tested on parts of the records to which they were not fitted. Chosen, for time.
    pub shape_left_out: usize,
    /// Smallest share of the mean squared error that a function of a signal has to explain on those parts; below it, functions of time are
    /// candidates too (0 to 1). Chosen.
    pub shape_least_share: f64,
    /// Number of points at which the shape is reported (2 or more). Chosen.
    pub shape_points: usize,
}

impl Thresholds {
    /// The default values of a diagnosis.
    pub const DEFAULT: Self = Self {
        feedback: 1e-4,
        other_controller: 0.05,
        lacking_readings: 0.2,
        loop_growth: 1.0,
        noise_order: 6,
        effects_before_noise: 2,
        longest_memory: 1.0 / 30.0,
        memory_limit: 12.0,
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
        beam_effects: 4,
        converged: 6,
        same_residual: 0.15,
        beam_share: 0.6,
        refits: 8,
        fall_factor: 2.0,
        fall_margin: 6.0,
        growth_margin: 2.0,
        minima_fitted: 4,
        minima_rounds: 3,
        floating_seeds: 8,
        floating_small_set: 2,
        floating_swaps: 4,
        floating_compared: 4,
        bic_margin: 6.0,
        false_claim: 0.003,
        telling_reading: 0.5,
        beginning: 0.05,
        not_noise: 1e-4,
        predictable_input: 0.01,
        function_chance: 1e-3,
        stationary_parts: 4,
        stationary_lines: 2,
        stationary_part_samples: 50,
        many_effects: 3,
        functions_of_time: 1,
        partial_share: 0.38,
        whole_share: 0.8,
        partial_share_of_time: 0.9,
        partial_tested: 6,
        partial_left: 0.5,
        partial_left_out: 0.75,
        partial_error: 0.9,
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
        own_candidate_bic: 100.0,
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
