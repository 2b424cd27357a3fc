//! The way of the command to the spool: transport delay, then the play operator of the valve's hysteresis.

use crate::effects::valve_hysteresis;
use crate::real::Real;
use heapless::Deque;

/// Commands under way, each with the time for which the valve will see it.
#[derive(Clone, Debug)]
pub(crate) struct CommandPath<R, const N: usize> {
    delay_s: R,
    hysteresis: valve_hysteresis::Terms<R>,
    under_way: Deque<(R, R), N>,
    played_v: R,
}

impl<R: Real, const N: usize> CommandPath<R, N> {
    /// A path whose valve has stood at mid position for longer than the delay.
    pub(crate) fn new(delay_s: R, hysteresis: valve_hysteresis::Terms<R>) -> Self {
        let mut under_way = Deque::new();
        if delay_s > R::ZERO {
            // Capacity N is at least one, so the first entry always fits.
            let _ = under_way.push_back((delay_s, R::ZERO));
        }
        Self { delay_s, hysteresis, under_way, played_v: R::ZERO }
    }

    /// The command that the spool sees, where it arrives at once; else `None`.
    #[inline]
    pub(crate) fn pass(&mut self, u_v: R) -> Option<R> {
        (self.delay_s <= R::ZERO).then(|| self.play(u_v))
    }

    /// Sends a command that is held for `dt` and calls `act(command, duration)` for every command that reaches the
    /// spool meanwhile.
    pub(crate) fn send(&mut self, u_v: R, dt_s: R, mut act: impl FnMut(R, R)) {
        self.enqueue(u_v, dt_s);
        let mut left = dt_s;
        while left > R::ZERO {
            let Some((duration, command)) = self.under_way.pop_front() else {
                // Only rounding can empty the queue early; the newest command then covers the rest.
                let command = self.play(u_v);
                act(command, left);
                return;
            };
            let now = duration.at_most(left);
            if duration > left {
                // A place was freed just now, so this always fits.
                let _ = self.under_way.push_front((duration - left, command));
            }
            let command = self.play(command);
            act(command, now);
            left -= now;
        }
    }

    fn enqueue(&mut self, u_v: R, dt_s: R) {
        if let Some(newest) = self.under_way.back_mut()
            && newest.1 == u_v
        {
            newest.0 += dt_s;
            return;
        }
        // One place stays free for the remainder that `send` puts back in front.
        if self.under_way.len() + 1 < N {
            let _ = self.under_way.push_back((dt_s, u_v));
        } else if let Some(newest) = self.under_way.back_mut() {
            // More changes are under way than the queue holds: the newest is stretched, never lost in time.
            *newest = (newest.0 + dt_s, u_v);
        }
    }

    #[inline]
    fn play(&mut self, u_v: R) -> R {
        self.played_v = self.hysteresis.play(self.played_v, u_v);
        self.played_v
    }
}
