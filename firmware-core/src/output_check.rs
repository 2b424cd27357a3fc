//! Whether the valve output shows what was written to it: the code that the output converts, and the pin's voltage as another
//! converter reads it back. The model monitor sees an output that is stuck only by what the piston does; this sees it at once.

/// How far the pin may be from its code at mid, of 4096 codes: the offsets of both converters and their curvature make at most 24
/// (DS12288, characteristics of ADC and DAC without buffer); 32 are 0.08 V of the valve's ±5 V.
const AT_MID_CODES: u16 = 32;
/// And of the distance from mid, a sixteenth: the output stage pulls the pin towards mid by 3 % (docs/wiring.md), gains are within 1 %.
const SHARE: u16 = 16;
const MID: u16 = 2048;

/// How far the pin may be from the code that was written.
#[inline]
#[must_use]
pub fn tolerance(written: u16) -> u16 {
    AT_MID_CODES + written.abs_diff(MID) / SHARE
}

/// Ticks in a row until the output counts as faulty: one may be a spike on the pin.
const BAD_TICKS: u8 = 3;

/// What the output shows in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputSeen {
    /// The code that the output converts, latched when the tick began.
    pub latched: u16,
    /// The pin as a 12-bit code; `None` if it has not been converted in this tick.
    pub pin: Option<u16>,
}

/// Compares tick by tick.
#[derive(Clone, Debug, Default)]
pub struct OutputCheck {
    bad: u8,
}

impl OutputCheck {
    /// Whether the output is faulty. `written` is the code that the timer had to latch when this tick began. A tick that `began_late`
    /// may have latched an older one, and tells nothing.
    #[inline]
    pub fn faulty(&mut self, written: u16, seen: OutputSeen, began_late: bool) -> bool {
        if !began_late {
            let obeys =
                seen.latched == written && seen.pin.is_some_and(|pin| pin.abs_diff(written) <= tolerance(written));
            self.bad = if obeys { 0 } else { self.bad.saturating_add(1) };
        }
        self.bad >= BAD_TICKS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALLOWED: u16 = 91;

    #[test]
    fn an_output_is_faulty_after_three_wrong_ticks_in_a_row() {
        let right = OutputSeen { latched: 3000, pin: Some(3000 - ALLOWED) };
        let wrong = [
            OutputSeen { latched: 2999, ..right },
            OutputSeen { pin: Some(3000 - ALLOWED - 1), ..right },
            OutputSeen { pin: None, ..right },
        ];
        assert_eq!([tolerance(2048), tolerance(3000), tolerance(0)], [32, ALLOWED, 160]);
        let mut check = OutputCheck::default();
        assert!(!check.faulty(3000, right, false));
        for wrong in wrong {
            assert_eq!([(); 4].map(|()| check.faulty(3000, wrong, false)), [false, false, true, true]);
            assert!(!check.faulty(3000, right, false));
        }
        // One right tick in between, and ticks whose code came too late, which prove nothing.
        for (seen, late) in [(wrong[0], false), (wrong[0], false), (right, false), (wrong[1], false), (wrong[1], true)]
        {
            assert!(!check.faulty(3000, seen, late));
        }
        assert!(!check.faulty(3000, wrong[2], false));
        assert!(check.faulty(3000, wrong[2], false));
    }
}
