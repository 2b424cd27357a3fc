//! The command on its way: hoses delay what the valve does by whole ticks.

use super::constants::MOST_HOSE_DELAY_TICKS;
use crate::quantities::Voltage;

/// The last commands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Delay {
    ring: [Voltage; MOST_HOSE_DELAY_TICKS + 1],
    at: u8,
}

impl Delay {
    /// With one command for a long time.
    pub(crate) fn of(command: Voltage) -> Self {
        Self { ring: [command; MOST_HOSE_DELAY_TICKS + 1], at: 0 }
    }

    /// Takes this tick's command and returns that of some ticks ago.
    #[inline]
    pub(crate) fn after(&mut self, command: Voltage, ticks: u8) -> Voltage {
        if ticks == 0 {
            return command;
        }
        let place = |at: u8| usize::from(at) & MOST_HOSE_DELAY_TICKS;
        self.ring[place(self.at)] = command;
        let past = self.ring[place(self.at.wrapping_sub(ticks))];
        self.at = self.at.wrapping_add(1);
        past
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_comes_out_as_many_ticks_later_as_asked() {
        for ticks in [0, 1, 5, 31] {
            let mut delay = Delay::of(Voltage::ZERO);
            for tick in 0..600_u32 {
                let now = |tick: u32| Voltage::from_bits(tick as i32 + 1);
                let expected = tick.checked_sub(ticks.into()).map_or(Voltage::ZERO, now);
                assert_eq!(delay.after(now(tick), ticks), expected, "{ticks} at {tick}");
            }
        }
    }
}
