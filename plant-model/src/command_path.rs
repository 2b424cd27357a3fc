//! The way of the command to the air: transport delay, one for each chamber, then the play operator of the valve's hysteresis. A delay
//! behind the spool, as that of a hose is, does the same as one before it.

use crate::effects::valve_hysteresis;
use crate::real::Real;
use heapless::Deque;

/// Commands under way, each with the time for which it will be felt.
#[derive(Clone, Debug)]
pub(crate) struct CommandPath<R, const N: usize> {
    /// By how much the commands in front of the queue are late, s: the later chamber feels them now.
    delay_s: R,
    /// How far ahead of it the chambers A and B are, s: zero for one of them.
    ahead_s: [R; 2],
    hysteresis: valve_hysteresis::Terms<R>,
    under_way: Deque<(R, R), N>,
    played_v: [R; 2],
}

impl<R: Real, const N: usize> CommandPath<R, N> {
    /// A path with the delays to chambers A and B, whose valve has stood at mid position for longer than those.
    pub(crate) fn new(delays_s: [R; 2], hysteresis: valve_hysteresis::Terms<R>) -> Self {
        let [a, b] = delays_s;
        let delay_s = a.at_least(b);
        let mut under_way = Deque::new();
        if delay_s > R::ZERO {
            // Capacity N is at least one, so the first entry always fits.
            let _ = under_way.push_back((delay_s, R::ZERO));
        }
        let ahead_s = delays_s.map(|own_s| delay_s - own_s);
        Self { delay_s, ahead_s, hysteresis, under_way, played_v: [R::ZERO; 2] }
    }

    /// The command that the spool sees, where both chambers feel it at once; else `None`.
    #[inline]
    pub(crate) fn pass(&mut self, u_v: R) -> Option<R> {
        (self.delay_s <= R::ZERO).then(|| {
            self.played_v[0] = self.hysteresis.play(self.played_v[0], u_v);
            self.played_v[0]
        })
    }

    /// Sends a command that is held for `dt` and calls `act(commands, duration)` for every pair of commands that chambers A and B
    /// feel meanwhile.
    pub(crate) fn send(&mut self, u_v: R, dt_s: R, mut act: impl FnMut([R; 2], R)) {
        self.enqueue(u_v, dt_s);
        let mut left = dt_s;
        while left > R::ZERO {
            // Only rounding can empty the queue early; the newest command then covers the rest.
            let [(a_v, a_s), (b_v, b_s)] = self.ahead_s.map(|ahead_s| self.felt(ahead_s).unwrap_or((u_v, left)));
            let now = a_s.at_most(b_s).at_most(left);
            let [played_a_v, played_b_v] = self.played_v;
            self.played_v = [self.hysteresis.play(played_a_v, a_v), self.hysteresis.play(played_b_v, b_v)];
            act(self.played_v, now);
            self.pass_by(now);
            left -= now;
        }
    }

    /// The command felt some time ahead of the front of the queue, and for how long it will be felt there.
    fn felt(&self, ahead_s: R) -> Option<(R, R)> {
        // What rounding leaves of a command that is over would stop the time; in front it is exact.
        let over_s = ahead_s * R::of(1.0e-6);
        let mut until_s = -ahead_s;
        self.under_way.iter().find_map(|(duration, u_v)| {
            until_s += *duration;
            (until_s > over_s).then_some((*u_v, until_s))
        })
    }

    /// Lets some time pass by the front of the queue.
    fn pass_by(&mut self, mut dt_s: R) {
        while let Some((duration, u_v)) = self.under_way.pop_front() {
            if duration > dt_s {
                // A place was freed just now, so this always fits.
                let _ = self.under_way.push_front((duration - dt_s, u_v));
                return;
            }
            dt_s -= duration;
        }
    }

    fn enqueue(&mut self, u_v: R, dt_s: R) {
        if let Some(newest) = self.under_way.back_mut()
            && newest.1 == u_v
        {
            newest.0 += dt_s;
            return;
        }
        // One place stays free for the remainder that is put back in front.
        if self.under_way.len() + 1 < N {
            let _ = self.under_way.push_back((dt_s, u_v));
        } else if let Some(newest) = self.under_way.back_mut() {
            // More changes are under way than the queue holds: the newest is stretched, never lost in time.
            *newest = (newest.0 + dt_s, u_v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// What A and B feel by time, of commands that are held for a millisecond each.
    fn felt(delays_s: [f64; 2], commands_v: &[f64]) -> Vec<(f64, [f64; 2])> {
        let mut path = CommandPath::<f64, 16>::new(delays_s, valve_hysteresis::Terms::default());
        let (mut out, mut now_s) = (Vec::new(), 0.0);
        for u_v in commands_v {
            path.send(*u_v, 1.0e-3, |felt_v, duration| {
                out.push((now_s, felt_v));
                now_s += duration;
            });
        }
        out
    }

    #[test]
    fn each_chamber_feels_a_command_after_its_own_delay() {
        let commands_v: Vec<f64> = (1..40).map(f64::from).collect();
        for delays_s in [[0.0, 2.3e-3], [2.3e-3, 0.7e-3], [1.0e-3, 3.0e-3], [1.0 / 3.0 * 1.0e-3, 1.0e-3], [0.4e-3; 2]] {
            let all = felt(delays_s, &commands_v);
            assert!(all.len() > commands_v.len() - 3 && all.len() < 3 * commands_v.len());
            for (n, (from_s, felt_v)) in all.iter().enumerate() {
                let until_s = all.get(n + 1).map_or(39.0e-3, |next| next.0);
                let middle_s = 0.5 * (from_s + until_s);
                for (felt_v, delay_s) in felt_v.iter().zip(delays_s) {
                    let sent = (middle_s - delay_s) / 1.0e-3;
                    let wanted_v = if sent < 0.0 { 0.0 } else { commands_v[sent as usize] };
                    assert_eq!(*felt_v, wanted_v, "{delays_s:?} at {middle_s} s");
                }
            }
        }
    }
}
