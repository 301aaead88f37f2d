//! Events: changes of branches within a step. They are detected, their times are computed with derivatives, and the branches are switched.

use super::SimulationState;
use super::delays::Delays;
use super::drive::{Drive, Interval};
use super::step::Step;
use crate::scalar::Scalar;
use crate::tape::{Register, Registers, Tape};

/// If one guard has two events within this share of an interval, the next step has this length, to avoid chattering.
const SLIDE: f64 = 1e-2;
/// Tolerance of an event time, as a share of the step.
const EVENT: f64 = 1e-13;
/// A guard that is further from zero at its event than it moves in this share of an interval has jumped.
const JUMP: f64 = 1e-6;
/// Perturbation for the finite difference that gives the rate of a guard, as a share of the step.
const SPEED: f64 = 1e-4;

impl<T: Scalar> SimulationState<T> {
    /// For a step within which an equation has no value: the branch change before that point, for example of `sqrt(max(x, 0))` at zero, and
    /// the error of the step up to it. Without a branch change it is the whole step, if the equations have values at its end: intermediate
    /// values may lie beyond a limit, such as those of a level that rises from zero with a slope of zero. That step is the last one computed.
    pub(super) fn branch_before(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        h: T,
        delays: &Delays<T>,
    ) -> Option<(Option<Event<T>>, f64)> {
        self.work.registers.extended = true;
        self.work.begun = false;
        let mut error = self.attempt(tape, interval, h, delays);
        let is_finite = error.is_finite();
        let event = is_finite
            .then(|| self.first_event(tape, interval, h, delays))
            .flatten();
        if let Some(event) = &event {
            error = self.attempt(tape, interval, event.after, delays);
        }
        self.work.registers.extended = false;
        self.work.begun = false;
        let is_valid = is_finite
            && (event.is_some() || self.ends_with_values(tape, &Drive::new(interval, delays), h));
        is_valid.then_some((event, error))
    }

    /// Whether the slopes at the end of the last step are finite.
    fn ends_with_values(&mut self, tape: &Tape, drive: &Drive<'_, T>, h: T) -> bool {
        let next = self.work.next.clone();
        self.work.load(tape, drive, self.time + h, &next);
        self.work.evaluate_slopes(tape, drive);
        let values = &self.work.registers.values;
        let mut slopes = tape.derivatives.iter().map(|&i| values[i].value());
        slopes.all(f64::is_finite)
    }

    /// Switches branches at the end of a step that ends at an event; the registers hold the inputs and states at that time.
    pub(super) fn change(&mut self, tape: &Tape, drive: &Drive<'_, T>, change: Change) {
        let Step {
            sliding, registers, ..
        } = &mut self.work;
        let difference = match change {
            Change::Crossed(difference, positive) => {
                tape.answer(registers, difference, positive);
                sliding.add(tape, registers, difference);
                self.work.evaluate_slopes(tape, drive);
                let length = drive.interval.length;
                let Step {
                    sliding, registers, ..
                } = &self.work;
                if sliding.is_attractive(registers, length, &self.largest) {
                    self.put_back(tape, drive);
                } else {
                    let Step {
                        sliding, registers, ..
                    } = &mut self.work;
                    sliding.remove(tape, registers, sliding.len() - 1, positive);
                }
                difference
            }
            Change::LetGo(k, positive) => sliding.remove(tape, registers, k, positive),
            Change::None => return,
        };
        for (guard, changed) in tape.guards.iter().zip(&mut self.changed) {
            if guard.difference == difference {
                *changed = self.time.value();
            }
        }
    }

    /// Projects the states onto the switching surfaces on which they slide.
    pub(super) fn put_back(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        self.work.load(tape, drive, self.time, &self.state);
        self.work.evaluate_slopes(tape, drive);
        let Step {
            sliding, registers, ..
        } = &mut self.work;
        sliding.put_back(registers, &mut self.state);
    }

    /// Restores sliding after every guard was evaluated from the sign of its difference. Sliding ends for guards that an input has moved
    /// away from zero, and for guards to which no longer both sides lead.
    pub(super) fn slide_on(&mut self, tape: &Tape, drive: &Drive<'_, T>) {
        while !self.work.sliding.is_empty() {
            self.work.follow_sliding(tape);
            self.work.evaluate_slopes(tape, drive);
            let Step {
                sliding, registers, ..
            } = &mut self.work;
            let Some((k, positive)) = sliding.let_go(registers, drive.interval.length) else {
                break;
            };
            sliding.remove(tape, registers, k, positive);
            self.work.evaluate_slopes(tape, drive);
        }
    }

    /// The monitored quantity, which stays positive or negative as long as no event occurs, from the present registers.
    fn distance(&self, tape: &Tape, watched: Watched) -> T {
        let Step {
            sliding, registers, ..
        } = &self.work;
        match watched {
            Watched::Guard(guard) => {
                let difference = tape.guards[guard].difference;
                registers.values[difference]
            }
            Watched::Share(k, true) => T::constant(1.0 - sliding.share(k)),
            Watched::Share(k, false) => T::constant(sliding.share(k)),
        }
    }

    /// The first event within the step that was computed last.
    pub(super) fn first_event(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        h: T,
        delays: &Delays<T>,
    ) -> Option<Event<T>> {
        if tape.guards.is_empty() || h.value() <= 0.0 {
            return None;
        }
        tape.evaluate_guards(&mut self.work.registers);
        let Registers {
            values, answers, ..
        } = &self.work.registers;
        let guards = tape.guards.iter().zip(answers);
        let mut stays = guards
            .map(|(guard, &answer)| !guard.is_crossed(answer, values[guard.difference].value()));
        if self.work.sliding.is_empty() && stays.all(|stays| stays) {
            return None;
        }
        let answers = self.work.registers.answers.clone();
        let is_crossed = |watched: Watched, value: f64| match watched {
            Watched::Guard(i) => tape.guards[i].is_crossed(answers[i], value),
            Watched::Share(..) => value < 0.0,
        };
        let sliding = &self.work.sliding;
        let guards = (0..tape.guards.len()).map(Watched::Guard);
        let shares =
            (0..sliding.len()).flat_map(|k| [Watched::Share(k, false), Watched::Share(k, true)]);
        let crossed = guards.chain(shares).filter_map(|watched| {
            if let Watched::Guard(i) = watched
                && sliding.holds(tape.guards[i].difference)
            {
                return None;
            }
            let distance = self.distance(tape, watched).value();
            is_crossed(watched, distance).then_some((watched, distance))
        });
        let crossed: Vec<_> = crossed.collect();
        let at = |own: &mut Self, watched: Watched, share: f64| {
            let part = T::constant(h.value() * share);
            own.attempt(tape, interval, part, delays);
            tape.evaluate_guards(&mut own.work.registers);
            own.distance(tape, watched)
        };
        let mut first: Option<(f64, Watched, bool)> = None;
        for (watched, mut ends_with) in crossed {
            let mut end = 1.0;
            if let Some((share, ..)) = first {
                end = share;
                ends_with = at(self, watched, share).value();
            }
            if !is_crossed(watched, ends_with) {
                continue;
            }
            let begins_with = at(self, watched, 0.0).value();
            // The quantity may have been on the other side when the step began.
            let share = if is_crossed(watched, begins_with) || begins_with == 0.0 {
                0.0
            } else {
                let distance = |share: f64| at(self, watched, share).value();
                change_of_sign(distance, (0.0, begins_with), (end, ends_with))
            };
            first = Some((share, watched, ends_with > 0.0));
        }
        let (share, watched, positive) = first?;
        let mut after = T::constant(h.value() * share);
        let guard = match watched {
            // At the end of the range of the share, the slopes with and without sliding are equal, so the time needs no derivative.
            Watched::Share(k, upper) => {
                return Some(Event {
                    after,
                    change: Change::LetGo(k, upper),
                });
            }
            Watched::Guard(guard) => guard,
        };
        let difference = tape.guards[guard].difference;
        let slide = SLIDE * interval.length;
        let since = self.time.value() - self.changed[guard];
        if since < slide && share * h.value() < 1e-3 * slide {
            // Rounding makes the guard change back at once, repeatedly: one step of fixed length is taken instead.
            let after = T::constant(slide.min(h.value()));
            self.attempt(tape, interval, after, delays);
            tape.evaluate_guards(&mut self.work.registers);
            let there = self.distance(tape, watched).value();
            let change = if is_crossed(watched, there) {
                Change::Crossed(difference, there > 0.0)
            } else {
                Change::None
            };
            return Some(Event { after, change });
        }
        let speed = (at(self, watched, share + SPEED).value()
            - at(self, watched, share - SPEED).value())
            / (2.0 * SPEED * h.value());
        let here = at(self, watched, share);
        // A quantity that the last event has made jump, such as the difference of a maximum of branches, did not cross zero: it changes its
        // branch at that event, whatever its own slopes are.
        let away = here.value().abs() > JUMP * interval.length * speed.abs();
        if speed != 0.0 && speed.is_finite() && !away {
            after = T::with_slopes(after.value(), [(here, -1.0 / speed)]);
        }
        Some(Event {
            after,
            change: Change::Crossed(difference, positive),
        })
    }
}

/// The sign change of a function between two points, by the Illinois variant of regula falsi; returns the point after the change.
fn change_of_sign(
    mut f: impl FnMut(f64) -> f64,
    (mut a, mut fa): (f64, f64),
    (mut b, mut fb): (f64, f64),
) -> f64 {
    let far = fb.is_sign_positive();
    let mut last = None;
    for _ in 0..100 {
        if b - a <= EVENT {
            break;
        }
        let mut c = (a * fb - b * fa) / (fb - fa);
        if !(c > a && c < b) {
            c = 0.5 * (a + b);
        }
        let fc = f(c);
        if fc == 0.0 {
            return c;
        }
        let is_far = fc.is_sign_positive() == far;
        if is_far {
            (b, fb) = (c, fc);
        } else {
            (a, fa) = (c, fc);
        }
        if last == Some(is_far) {
            if is_far {
                fa *= 0.5;
            } else {
                fb *= 0.5;
            }
        }
        last = Some(is_far);
    }
    b
}

/// An event: a change of branches within a step.
pub(super) struct Event<T> {
    /// Time of the event after the beginning of the step.
    pub(super) after: T,
    pub(super) change: Change,
}

#[derive(Clone, Copy)]
pub(super) enum Change {
    None,
    /// A difference has changed its sign; `true`: it is now positive.
    Crossed(Register, bool),
    /// Sliding on a guard ends; `true`: the guard becomes positive.
    LetGo(usize, bool),
}

/// A quantity that is monitored for events after each step.
#[derive(Clone, Copy)]
enum Watched {
    Guard(usize),
    /// The share of a guard on which the states slide, monitored at the upper end (`true`) or the lower end of its range.
    Share(usize, bool),
}
