//! Whether the watchdog may be fed: only when sampling, control *and* communication have all moved on.
//!
//! A watchdog fed by the control loop alone misses a dead background; one fed by the background alone misses a dead loop.

/// Counters that only a living part advances. They may wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Conversions read.
    pub sampling: u32,
    /// Control steps finished.
    pub control: u32,
    /// Rounds of the command task and of the telemetry task.
    pub communication: [u32; 2],
}

/// What the supervisor decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Everything has moved on since the last time the watchdog was fed.
    Feed,
    /// Something has not moved on yet: leave the watchdog alone.
    Wait,
    /// Nothing has been sampled for [`DEAD_CHECKS`] checks: put the valve to mid at once, and let the watchdog bite. Final: a
    /// loop that comes to life again no longer knows where the piston is.
    LoopDead,
}

/// Checks without a conversion until the loop counts as dead: at one check every 5 ms, 10 ms.
pub const DEAD_CHECKS: u8 = 2;

/// Remembers what had been reached when the watchdog was last fed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supervisor {
    fed_at: Progress,
    last: Progress,
    checks_without_sample: u8,
    dead: bool,
}

impl Supervisor {
    /// Judges the present counters; to be called every 5 ms.
    pub fn check(&mut self, now: Progress) -> Verdict {
        let loop_moved = now.sampling != self.last.sampling && now.control != self.last.control;
        self.checks_without_sample = if loop_moved { 0 } else { self.checks_without_sample.saturating_add(1) };
        self.last = now;
        self.dead |= self.checks_without_sample >= DEAD_CHECKS;
        if self.dead {
            return Verdict::LoopDead;
        }
        let all_moved = now.sampling != self.fed_at.sampling
            && now.control != self.fed_at.control
            && now.communication[0] != self.fed_at.communication[0]
            && now.communication[1] != self.fed_at.communication[1];
        if all_moved {
            self.fed_at = now;
            Verdict::Feed
        } else {
            Verdict::Wait
        }
    }
}
