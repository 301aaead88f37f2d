//! Whether a confirmed set of effects explains the data, depending on its residual.

use ct_signals::ArModel;
use greybox::{Fit, Noise, coloured};
use plants::{EffectInfo, Placed};
use rayon::prelude::*;

use crate::{
    Error, NotNoise, Problem, Step,
    accept::{
        groups::{Group, groups},
        ladder::ladder,
    },
    diagnostics::{residual_tests::not_noise, step},
    fit::{
        node::{FINE, Node, STOPPING, refine, without},
        noise_model::{NOISE_ORDER, longest_memory, residual_noise, slowness},
    },
    result::Floors,
    search::confirm::confirm,
};

/// If the residual is not noise, effects are the whole explanation if they explain at least this share of the excess error: the mean
/// squared simulation error above the noise floor.
///
/// The tests that confirm an effect assume that the residual is noise. If it is an unknown disturbance, their probabilities do not hold: an
/// effect that resembles the disturbance is significant. Over records with nine simulated disturbances such effects imitated up to 6/7 of
/// the excess error; a true effect beside a small unknown one explained 19/20 and more.
pub(crate) const WHOLE: f64 = 0.9;
/// Effects are a partial explanation from this share on.
pub(crate) const PART: f64 = 0.38;

/// A noise floor below this share of the error counts as zero.
const NEGLIGIBLE: f64 = 1e-9;

/// Grade of the explanation by a set of effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grade {
    /// The residual is noise, or the set explains [`WHOLE`] of the excess error.
    Whole,
    /// The set explains [`PART`] of the excess error.
    Part,
    /// Less.
    None,
}

/// Data for the acceptance test of a set.
pub(crate) struct AcceptanceTest<'s, 'a> {
    pub base: &'s Node<'a>,
    pub noise: &'s Noise,
    pub slow_noise: bool,
    /// The records come from a loop that is not simulated.
    pub in_loop: bool,
    /// Whether models are compared and shown by their simulation error.
    pub by_simulation: bool,
    /// Whether the set was cut to the permitted number of effects.
    pub stopped: bool,
    /// Structure of the residual after a level shift of the reading, if the structure is a level shift.
    pub shifted: Option<&'s NotNoise>,
    /// The single effects, with the weighting of their last refit.
    pub singles: &'s [Node<'a>],
    /// The sets that the search has fitted.
    pub searched: &'s [&'s Node<'a>],
}

/// Result of the acceptance test of a set.
pub(crate) struct AcceptanceResult<'a> {
    pub course: Course<'a>,
    pub grade: Grade,
    /// The share of the excess error that the set explains.
    pub share: f64,
    /// For an accepted set: the alternatives to each of its effects, and the places where each may act.
    pub groups: Vec<Group>,
    /// Effects that were removed from the set.
    pub dropped: Vec<Placed>,
}

impl<'a> AcceptanceTest<'_, 'a> {
    /// The accepted set, or the accepted part of it.
    ///
    /// If the residual is not noise, an effect that a function of time can replace is not accepted: an unknown disturbance may have caused
    /// both. This applies to that effect alone. The other effects stay if they are significant without it, and are accepted if they explain
    /// enough without it: effects that only compensated a rejected one are dropped too.
    pub fn run(&self, mut set: Node<'a>) -> Result<AcceptanceResult<'a>, Error> {
        let mut accepted = self.tested(&set, None)?;
        loop {
            let courses = accepted.courses_of_time();
            // If a set was cut, its unexplained part includes the effects that were cut off, and the result reports this.
            if self.stopped || courses.is_empty() || accepted.grade != Grade::Whole {
                return Ok(accepted);
            }
            for course in &courses {
                if let Some(position) = set.added.iter().position(|on| on == course) {
                    set = without(&set, position, self.noise, FINE)?;
                }
            }
            set = confirm(set, self.noise)?;
            let others =
                (!set.added.is_empty()).then(|| self.tested(&set, accepted.course.left.as_ref()));
            match others.transpose()? {
                Some(others) if others.grade == Grade::Whole => {
                    let mut dropped = accepted.dropped;
                    dropped.extend(courses);
                    accepted = AcceptanceResult { dropped, ..others };
                }
                // A function of time can be a part of the explanation only.
                _ => {
                    return Ok(AcceptanceResult {
                        grade: Grade::Part,
                        ..accepted
                    });
                }
            }
        }
    }

    /// `beside`: structure in the residual of a larger set. A noise model that absorbs this structure, and the part that the larger set
    /// explained, does not make it noise.
    fn tested(
        &self,
        set: &Node<'a>,
        beside: Option<&NotNoise>,
    ) -> Result<AcceptanceResult<'a>, Error> {
        let mut course = self.course(set)?;
        course.left = course.left.or_else(|| beside.cloned());
        let (share, grade) = match &course.left {
            Some(left) if !self.stopped && !course.last().added.is_empty() => {
                let share = explained(self.base, course.last(), &left.above(self.noise))?;
                let grade = match share {
                    share if share >= WHOLE => Grade::Whole,
                    share if share >= PART => Grade::Part,
                    _ => Grade::None,
                };
                (share, grade)
            }
            _ => (
                explained(self.base, course.last(), &stationary(self.noise))?,
                Grade::Whole,
            ),
        };
        let groups = if grade == Grade::Whole {
            self.groups(course.last())?
        } else {
            Vec::new()
        };
        Ok(AcceptanceResult {
            course,
            grade,
            share,
            groups,
            dropped: Vec::new(),
        })
    }

    /// The groups of a set's effects.
    pub fn groups(&self, last: &Node<'a>) -> Result<Vec<Group>, Error> {
        let white = last.setup.white_noise();
        let (metric, per_sample) = if self.by_simulation || self.stopped {
            let residuals = last.setup.disturbance(&last.fit.x)?;
            let noise = residual_noise(&last.setup, &residuals)?;
            let limited = noise.with_memory_at_most(longest_memory(&last.setup));
            (&white, slowness(&limited, last.setup.samples_per_output()))
        } else {
            (self.noise, 1.0)
        };
        let same_metric = self.by_simulation || !self.stopped || self.noise.order() == 0;
        let singles = same_metric.then_some(self.singles);
        groups(
            &refine(last, metric, &[])?,
            metric,
            per_sample,
            singles,
            self.searched,
            self.in_loop,
        )
    }

    /// The models from the base to a set.
    pub fn course(&self, set: &Node<'a>) -> Result<Course<'a>, Error> {
        let mut nodes = ladder(self.base, set, &set.setup.white_noise())?;
        let last = nodes.pop().unwrap_or_else(|| self.base.clone());
        let in_noise = if self.by_simulation || self.stopped {
            last.clone()
        } else {
            // The series of models is shorter if an effect could not be simulated together with the others.
            let whole = last.added.len() == set.added.len();
            let ends: Vec<_> = whole.then(|| last.fit.x.clone()).into_iter().collect();
            refine(set, self.noise, &ends)?
        };
        self.ending(nodes, last, in_noise.fit)
    }

    /// Adds one more model to the series, and fits it.
    pub fn longer(&self, nodes: Vec<Node<'a>>, last: Node<'a>) -> Result<Course<'a>, Error> {
        let fit = last.fit.clone();
        self.ending(nodes, last, fit)
    }

    /// `in_noise`: the last model's fit weighted by the noise model.
    fn ending(
        &self,
        mut nodes: Vec<Node<'a>>,
        mut last: Node<'a>,
        in_noise: Fit,
    ) -> Result<Course<'a>, Error> {
        let own = coloured(&last.setup, in_noise, NOISE_ORDER, STOPPING)?;
        // A slow drift of the residual is weaker evidence than an abrupt change.
        let left = match not_noise(&last, &own)? {
            Some(left) if !matches!(left, NotNoise::Slow { .. }) => Some(left),
            left => self.shifted.cloned().or(left),
        };
        // The last model is shown with the noise weighting, in which its parameters are most accurate. An incomplete model is not: a
        // weighting that treats the missing effect as noise would let its simulation drift.
        if !self.slow_noise && !self.stopped && left.is_none() {
            last.fit = own.clone().continuing(&last.fit);
        }
        nodes.push(last);
        Ok(Course { nodes, own, left })
    }
}

impl AcceptanceResult<'_> {
    /// Effects of a set that a function of time can replace, if the residual is not noise.
    fn courses_of_time(&self) -> Vec<Placed> {
        if self.grade != Grade::Whole || self.course.left.is_none() {
            return Vec::new();
        }
        let by_clock = |id: &String| EffectInfo::find(id).is_some_and(|effect| effect.by_clock);
        let added = self.course.last().added.iter().zip(&self.groups);
        added
            .filter(|(_, group)| group.members.iter().any(by_clock))
            .map(|(placed, _)| *placed)
            .collect()
    }
}

/// The models from the believed one to the last, and the residual structure of the last one.
pub(crate) struct Course<'a> {
    /// The models, at least the believed one.
    pub nodes: Vec<Node<'a>>,
    /// The last model with the noise model of its own residual.
    pub own: Fit,
    pub left: Option<NotNoise>,
}

impl<'a> Course<'a> {
    pub fn last(&self) -> &Node<'a> {
        &self.nodes[self.nodes.len() - 1]
    }

    /// Report of each model.
    pub fn steps(
        &self,
        floor: &Floors,
        problem: &Problem,
        widen: bool,
    ) -> Result<Vec<Step>, Error> {
        let noise = floor.noise()?;
        self.nodes
            .par_iter()
            .enumerate()
            .map(|(k, node)| {
                let bic = if k + 1 == self.nodes.len() {
                    self.own.bic()
                } else {
                    coloured(&node.setup, node.fit.clone(), NOISE_ORDER, STOPPING)?.bic()
                };
                step::report(node, bic, &noise, &problem.test, widen)
            })
            .collect()
    }
}

/// The share of the excess error, in mean square above the noise floor, that a model explains relative to its base; for several outputs
/// each error is divided by the floor of its output.
pub(crate) fn explained(base: &Node, last: &Node, floor: &[f64]) -> Result<f64, Error> {
    let series = |node: &Node| node.setup.disturbance(&node.fit.x);
    let (before, after) = (series(base)?, series(last)?);
    // With a noise floor of zero, all of the error is to be explained.
    let rms = base.setup.rms_per_output(&before);
    let least = |(floor, rms): (&f64, &f64)| floor.max(NEGLIGIBLE * rms).max(f64::MIN_POSITIVE);
    let scales: Vec<f64> = floor.iter().zip(&rms).map(least).collect();
    let mean_square = |series: &[Vec<f64>]| base.setup.weighted_rms(series, &scales).powi(2);
    let (before, after) = (mean_square(&before), mean_square(&after));
    // A slow noise may have a larger variance in the long run than in the record.
    let floor = after.min(1.0);
    Ok((before - after) / (before - floor).max(f64::MIN_POSITIVE))
}

/// Standard deviation of each output's noise.
fn stationary(noise: &Noise) -> Vec<f64> {
    noise.iter().map(ArModel::stationary_std).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{
        Options,
        base::believed::base,
        fit::{
            noise_model::noise_of,
            proposal::{Parent, propose, realise, singles},
        },
        simulated,
    };

    /// A saturating pump together with an oscillation of the reading that has no name; returns the estimate of the saturation and a drift
    /// of the sensor.
    fn accepted(swing: f64) -> (bool, Vec<&'static str>, Vec<&'static str>) {
        let read = |t: f64, level: f64| level + swing * (t / 150.0).sin();
        let problem = simulated::tank(|u| u.min(4.2), read, 0.0, 1);
        let (base, _) = base(&problem, &Options::default(), 1.0).unwrap();
        let white = Noise::white(1);
        let mut set = base.clone();
        for id in ["pump_saturation", "sensor_drift"] {
            let placed = Placed {
                effect: EffectInfo::find(id).unwrap(),
                vessel: 0,
            };
            let proposal = propose(&Parent::new(&set), placed, &white).unwrap();
            set = realise(proposal, &white, crate::fit::node::FINE).unwrap();
        }
        let accepted = AcceptanceTest {
            base: &base,
            noise: &noise_of(&set).unwrap(),
            slow_noise: true,
            in_loop: false,
            by_simulation: true,
            stopped: false,
            shifted: None,
            singles: &singles(&base, &white),
            searched: &[],
        }
        .run(set)
        .unwrap();
        assert!(accepted.course.left.is_some());
        let ids = |set: &[Placed]| set.iter().map(|placed| placed.effect.id).collect();
        let kept = ids(&accepted.course.last().added);
        (accepted.grade == Grade::Whole, kept, ids(&accepted.dropped))
    }

    #[test]
    fn a_course_of_time_is_taken_out_alone_where_the_others_explain_enough() {
        let (fair, kept, dropped) = accepted(0.15);
        assert!(fair);
        assert_eq!(
            (kept, dropped),
            (vec!["pump_saturation"], vec!["sensor_drift"])
        );
        // If the oscillation is as large as the effect of the saturation, the saturation is not accepted either.
        let (fair, ..) = accepted(1.0);
        assert!(!fair);
    }
}
