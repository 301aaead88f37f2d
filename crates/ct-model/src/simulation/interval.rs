//! Simulation over one sampling interval, with step-size control; steps end at jumps and events.

use super::delays::{Delays, POINTS};
use super::drive::{Drive, Interval};
use super::events::Event;
use super::explicit::Interpolation;
use super::implicit::Jacobian;
use super::{Method, NoSolution, SimulationState, explicit, implicit, order_four};
use crate::scalar::Scalar;
use crate::tape::Tape;

/// Tolerance of a step, as a share of the largest absolute value that a state has had, if no other is set. Derivatives are those of the
/// computed steps, and their error is larger: for a motor whose friction has a sharp bend, 1e-5 at a tolerance of 1e-8, and 1e-3 at 1e-6.
pub const TOLERANCE: f64 = 1e-10;
/// Shortest step, as a share of a sampling interval.
const SHORTEST: f64 = 1e-9;
/// Largest ratio of a step to the previous one.
const LONGER: f64 = 5.0;
/// If the step that the error allows, times this factor, reaches the end of the interval, the step goes to the end.
const STRETCH: f64 = 1.1;
/// Largest number of steps: the initial budget and the upper limit of what is left of it, ...
pub(super) const MOST_STEPS: usize = 50_000;
/// ... and the number that every interval adds to the budget. A simulation whose steps are always short therefore fails within seconds.
const STEPS_PER_INTERVAL: usize = 300;
/// After so many explicit steps in one interval, the model is tested for stiffness.
const MANY_STEPS: usize = 40;
/// After so many implicit steps, it is tested whether explicit ones may be as long.
const MANY_IMPLICIT_STEPS: u32 = 16;
/// The least tolerance for steps of order four.
const LEAST_FOR_ORDER_FOUR: f64 = 1e-8;
/// The most steps of order five before order four is attempted again.
const MOST_OF_ORDER_FIVE: u32 = 64;
/// The model is stiff if the step length times the largest absolute eigenvalue of the Jacobian is above this: stability, not accuracy, then
/// limits explicit steps.
const STABILITY: f64 = 1.5;

/// Ratio of the next attempt to a step whose error is too large; a NaN error asks for a much shorter step.
pub(super) fn reduction(error: f64) -> f64 {
    if error.is_finite() {
        (0.9 * error.powf(-0.2)).clamp(0.1, 0.9)
    } else {
        0.1
    }
}

/// Ratio of the next step to one whose error is acceptable.
pub(super) fn growth(error: f64) -> f64 {
    (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, LONGER)
}

impl<T: Scalar> SimulationState<T> {
    /// Evaluates the guards at the beginning of an interval, and stores the known values of delayed expressions.
    pub(super) fn begin_interval(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &mut Delays<T>,
    ) {
        let Interval { begin, from, .. } = interval;
        let first = !self.begun;
        let jumps = first || self.jumps(from);
        let bends = !interval.is_held();
        if !delays.all.is_empty() {
            if first {
                let drive = Drive::new(interval, delays);
                self.work.load(tape, &drive, self.time, &self.state);
                self.before_the_record(tape);
                for (delay, &(what, _)) in delays.all.iter_mut().zip(&tape.delays) {
                    delay.begin(self.time, self.work.registers.values[what]);
                }
            } else if jumps || bends {
                for delay in &mut delays.all {
                    delay.jump(self.time);
                }
            }
            let length = T::constant(until) - self.time;
            self.keep_past(tape, interval, length, delays, true);
            for delay in &mut delays.all {
                delay.forget(begin);
            }
        }
        self.begun = true;
        if !self.is_computed(from) {
            let drive = Drive::new(interval, delays);
            self.work.load(tape, &drive, self.time, &self.state);
            tape.evaluate_with_guards(&mut self.work.registers);
            self.remember(tape);
            self.slide_on(tape, &drive);
        }
        // The registers hold the inputs of this interval, whichever code has evaluated them.
        self.work.registers.held = !bends;
        self.work.keep_slope(tape, 0);
        self.work.begun = true;
    }

    /// Whether the registers hold the values for these inputs at the present sample.
    pub(super) fn is_computed(&self, inputs: &[f64]) -> bool {
        self.computed && self.read == inputs
    }

    /// Stores the values of delayed expressions: those that are known ahead for the whole next interval, all others for the last step.
    fn keep_past(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        length: T,
        delays: &mut Delays<T>,
        ahead: bool,
    ) {
        if length.value() <= 0.0 || delays.all.iter().all(|delay| delay.known_ahead != ahead) {
            return;
        }
        let count = delays.all.len();
        let mut values = vec![[T::constant(0.0); POINTS]; count];
        let inside = (!ahead && self.method != Method::Implicit).then(|| {
            let mut inside = Interpolation::new(tape.states);
            inside.over(&self.work, &self.state, length);
            inside
        });
        // What is made of held inputs is constant.
        let is_held = ahead
            && interval.is_held()
            && delays
                .all
                .iter()
                .zip(&tape.delays)
                .all(|(delay, &(what, _))| !delay.known_ahead || tape.of_inputs[what]);
        for point in 0..POINTS {
            if is_held && point > 0 {
                for values in &mut values {
                    values[point] = values[0];
                }
                continue;
            }
            let share = point as f64 / (POINTS - 1) as f64;
            let mut state = std::mem::take(&mut self.scratch);
            state.copy_from_slice(&self.state);
            if !ahead {
                match &inside {
                    None => {
                        for (i, x) in state.iter_mut().enumerate() {
                            *x = *x + (self.work.next[i] - *x) * share;
                        }
                    }
                    Some(inside) => inside.at(share, &mut state),
                }
            }
            let drive = Drive::new(interval, delays);
            self.work
                .load(tape, &drive, self.time + length * share, &state);
            if ahead {
                tape.evaluate_with_guards(&mut self.work.registers);
            } else {
                tape.evaluate(&mut self.work.registers);
            }
            self.scratch = state;
            for (values, &(what, _)) in values.iter_mut().zip(&tape.delays) {
                values[point] = self.work.registers.values[what];
            }
        }
        for (delay, values) in delays.all.iter_mut().zip(values) {
            if delay.known_ahead == ahead {
                delay.push(self.time, length, values);
            }
        }
    }

    pub(super) fn steps(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        until: f64,
        delays: &mut Delays<T>,
    ) -> Result<(), NoSolution> {
        let shortest = SHORTEST * interval.length;
        let mut taken = 0;
        let most = self.steps_left + STEPS_PER_INTERVAL;
        loop {
            let now = self.time.value();
            let left = T::constant(until) - self.time;
            // The end of the smooth part of the interval: the next sample, or a jump that leaves a delay.
            let mut limit = left;
            let mut out = None;
            for (i, delay) in delays.all.iter().enumerate() {
                if let Some(next) = delay.next_out() {
                    let distance = next - self.time;
                    if distance.value() < limit.value() {
                        limit = distance;
                        out = Some(i);
                    }
                }
            }
            if out.is_none() && left.value() <= 1e-14 * interval.length {
                // The remaining time has a derivative if the last step ended at an event.
                self.finish(tape, interval, left, delays);
                return Ok(());
            }
            taken += 1;
            self.look_for_accuracy();
            self.steps_left = (most - taken).min(MOST_STEPS);
            if taken == most {
                return Err(NoSolution { time: now });
            }
            let of_delays = delays.longest_step(self.method, interval.length / 50.0);
            let longest = self.length.min(of_delays);
            let whole = limit.value() <= longest * STRETCH;
            let mut h = if whole { limit } else { T::constant(longest) };
            self.order_four = whole && self.may_take_order_four(tape);
            let mut error = self.attempt(tape, interval, h, delays);
            if self.order_four {
                let is_accurate = error <= 1.0;
                self.note_order_four(is_accurate);
                if !is_accurate {
                    self.order_four = false;
                    error = self.attempt(tape, interval, h, delays);
                }
            }
            let mut beyond = None;
            if error.is_nan() {
                let found = self.branch_before(tape, interval, h, delays);
                if let Some((event, error_there)) = found {
                    h = event.as_ref().map_or(h, |event| event.after);
                    error = error_there;
                    beyond = event;
                }
            }
            if (error > 1.0 || error.is_nan()) && h.value() > shortest {
                self.length = (h.value() * reduction(error)).max(shortest);
                continue;
            }
            if !error.is_finite() {
                return Err(NoSolution { time: now });
            }
            let is_new = beyond.is_none();
            let event = beyond.or_else(|| self.first_event(tape, interval, h, delays));
            let is_short = !whole || error > 0.5 || self.length < h.value() * LONGER;
            if event.is_none() && is_short && !self.order_four {
                let grown = h.value() * growth(error);
                if !whole || error > 0.5 || grown > self.length {
                    self.length = grown.max(shortest);
                }
            }
            if let Some(Event { after, .. }) = event.as_ref().filter(|_| is_new) {
                h = *after;
                self.attempt(tape, interval, h, delays);
            }
            self.keep_past(tape, interval, h, delays, false);
            let sliding = !self.work.sliding.is_empty();
            self.work
                .go_on(event.is_none() && !sliding && self.method == Method::Explicit);
            self.state.copy_from_slice(&self.work.next);
            self.time = self.time + h;
            if self.method == Method::Implicit {
                let (count, longest) = self.implicit_steps;
                self.implicit_steps = (count + 1, longest.max(h.value()));
            }
            if sliding {
                self.put_back(tape, &Drive::new(interval, delays));
            }
            self.note_largest();
            if event.is_none() && whole && out.is_none() {
                let explicit = self.method == Method::Explicit;
                self.ended_within = explicit
                    && !sliding
                    && self.work.registers.held
                    && !tape.reads_time
                    && tape.plays.is_empty();
                return Ok(());
            }
            if let Some(Event { change, .. }) = event {
                let drive = Drive::new(interval, delays);
                self.work.load(tape, &drive, self.time, &self.state);
                self.change(tape, &drive, change);
                for delay in delays.all.iter_mut().filter(|delay| !delay.known_ahead) {
                    delay.jump(self.time);
                }
            } else if let Some(out) = out.filter(|_| whole) {
                delays.all[out].let_out();
                self.work.begun = false;
                // A branch may depend on the signal that jumps.
                let drive = Drive::new(interval, delays);
                self.work.load(tape, &drive, self.time, &self.state);
                tape.evaluate_with_guards(&mut self.work.registers);
                self.slide_on(tape, &drive);
                for (i, delay) in delays.all.iter_mut().enumerate() {
                    if i != out && !delay.known_ahead {
                        delay.jump(self.time);
                    }
                }
            }
            if taken % MANY_STEPS == 0 && self.method == Method::Explicit {
                self.look_for_stiffness(tape, h.value());
            }
        }
    }

    /// Adds the derivative of the remaining time if the last step ended at an event at the very end of the interval.
    fn finish(&mut self, tape: &Tape, interval: Interval<'_>, left: T, delays: &Delays<T>) {
        let drive = Drive::new(interval, delays);
        self.work.load(tape, &drive, self.time, &self.state);
        self.work.evaluate_slopes(tape, &drive);
        for (x, &register) in self.state.iter_mut().zip(&tape.derivatives) {
            *x = *x + left * self.work.registers.values[register];
        }
    }

    /// Whether the next step may be one of order four: not with the accuracy of results, nor where slopes depend on time, whose error its
    /// estimate does not contain.
    fn may_take_order_four(&mut self, tape: &Tape) -> bool {
        if self.method != Method::Explicit
            || self.tolerance < LEAST_FOR_ORDER_FOUR
            || tape.reads_time
            || !self.work.registers.held
        {
            return false;
        }
        let (waiting, _) = &mut self.order_five;
        *waiting = waiting.saturating_sub(1);
        *waiting == 0
    }

    /// After a step of order four that is not accurate enough, more and more steps of order five come before the next attempt.
    fn note_order_four(&mut self, is_accurate: bool) {
        let (waiting, after_failure) = &mut self.order_five;
        if is_accurate {
            *after_failure = 1;
        } else {
            *after_failure = (2 * *after_failure).min(MOST_OF_ORDER_FIVE);
            *waiting = *after_failure;
        }
    }

    pub(super) fn note_largest(&mut self) {
        for (largest, x) in self.largest.iter_mut().zip(&self.state) {
            *largest = largest.max(x.value().abs());
        }
    }

    /// Changes to implicit steps where stability limits the explicit ones.
    fn look_for_stiffness(&mut self, tape: &Tape, h: f64) {
        if let Some(jacobian) = &mut self.jacobian {
            jacobian.compute(tape, &self.work.registers);
            if self.length.min(h) * jacobian.spectral_radius() > STABILITY {
                self.method = Method::Implicit;
            }
        }
    }

    /// Changes to explicit steps where accuracy alone limits the implicit ones, which take longer and have the lower order.
    fn look_for_accuracy(&mut self) {
        let (count, longest) = self.implicit_steps;
        if count < MANY_IMPLICIT_STEPS {
            return;
        }
        self.implicit_steps = (0, 0.0);
        let radius = self.jacobian.as_ref().map(Jacobian::spectral_radius);
        if radius.is_some_and(|radius| longest * radius < STABILITY) {
            self.method = Method::Explicit;
        }
    }

    /// Computes a step with the present branches; returns its error relative to the tolerance.
    pub(super) fn attempt(
        &mut self,
        tape: &Tape,
        interval: Interval<'_>,
        h: T,
        delays: &Delays<T>,
    ) -> f64 {
        let drive = Drive::new(interval, delays);
        for (i, scale) in self.scale.iter_mut().enumerate() {
            let slope = self.work.slopes.get(i).map_or(0.0, |k| k.value().abs());
            let moved = if slope.is_finite() {
                slope * h.value()
            } else {
                0.0
            };
            *scale = self.tolerance * self.largest[i].max(moved).max(1e-30);
        }
        let at = (self.time, &self.state[..], h);
        match (&mut self.jacobian, self.method) {
            (Some(jacobian), Method::Implicit) => {
                let scale = (&self.scale[..], self.tolerance);
                implicit::step(tape, &mut self.work, jacobian, &drive, at, scale)
                    .unwrap_or(f64::NAN)
            }
            _ if self.order_four => {
                order_four::step(tape, &mut self.work, &drive, at);
                order_four::error(&self.work, h.value(), &self.scale)
            }
            _ => {
                explicit::step(tape, &mut self.work, &drive, at);
                explicit::error(&self.work, h.value(), &self.scale)
            }
        }
    }
}
