//! The command on its way to the valve: whole ticks of delay, the remainder interpolated.

use parameter_table::ParameterError as MonitorError;

/// The longest delay that can be held, in ticks.
const CAPACITY: usize = 32;

/// Past commands, newest last written.
#[derive(Clone, Debug)]
pub(crate) struct CommandDelay {
    past: [f32; CAPACITY],
    newest: usize,
    whole: usize,
    part: f32,
}

impl CommandDelay {
    pub(crate) fn new(ticks: f32) -> Result<Self, MonitorError> {
        if !(ticks >= 0.0 && ticks <= (CAPACITY - 2) as f32) {
            return Err(MonitorError {
                key: "effects.line-delay.delay_s",
                value: f64::from(ticks),
                must:
                    "be at most 30 ticks for the monitor (value in ticks); leave the monitor off or lower the tick rate"
                        .into(),
            });
        }
        let whole = ticks as usize;
        Ok(Self { past: [0.0; CAPACITY], newest: 0, whole, part: ticks - whole as f32 })
    }

    /// As if the valve had been held at `u_v` for long.
    pub(crate) fn fill(&mut self, u_v: f32) {
        self.past = [u_v; CAPACITY];
    }

    /// Takes the command of this interval, returns the mean of what the valve saw during it.
    pub(crate) fn pass(&mut self, u_v: f32) -> f32 {
        self.newest = (self.newest + 1) % CAPACITY;
        let at = |age: usize| (self.newest + CAPACITY - age) % CAPACITY;
        let (later, earlier) = (at(self.whole), at(self.whole + 1));
        if let Some(slot) = self.past.get_mut(self.newest) {
            *slot = u_v;
        }
        let read = |index: usize| self.past.get(index).copied().unwrap_or(u_v);
        read(later) + (read(earlier) - read(later)) * self.part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_of_two_and_a_quarter_ticks_mixes_the_second_and_third_last_command() {
        let mut delay = CommandDelay::new(2.25).expect("within capacity");
        let out = [1.0, 2.0, 3.0, 4.0, 5.0].map(|u| delay.pass(u));
        assert_eq!(out, [0.0, 0.0, 0.75, 1.75, 2.75]);
        assert!(CommandDelay::new(63.0).is_err() && CommandDelay::new(f32::NAN).is_err());
    }
}
