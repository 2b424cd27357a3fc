//! The last records, for a host that asks for them over the serial line.

use board_link::{SAMPLES, Sample, Samples};
use heapless::Deque;

use crate::record::Record;

/// Records kept: at 333 a second, a fifth of a second without a question.
const KEPT: usize = 64;

/// The records that nobody has asked for yet, the oldest first.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    kept: Deque<Sample, KEPT>,
}

impl Recent {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self { kept: Deque::new() }
    }

    /// Keeps a record; when there is no room, the oldest goes.
    pub fn push(&mut self, record: &Record) {
        if self.kept.is_full() {
            self.kept.pop_front();
        }
        let Record { tick, codes, held, mode, .. } = *record;
        // There is room now.
        let _ = self.kept.push_back(Sample { tick, codes, held, mode });
    }

    /// Takes as many of the oldest as an answer holds.
    pub fn take(&mut self) -> Samples {
        let mut taken = Samples::new();
        while taken.len() < SAMPLES {
            let Some(sample) = self.kept.pop_front() else { break };
            // There is room.
            let _ = taken.push(sample);
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_once_in_their_order_and_the_newest_are_kept() {
        let mut recent = Recent::new();
        let ticks =
            |samples: Samples| samples.iter().map(|sample| sample.tick).collect::<heapless::Vec<u32, SAMPLES>>();
        assert!(recent.take().is_empty());
        for tick in 1..=100 {
            recent.push(&Record { tick, ..Record::default() });
        }
        let first = ticks(recent.take());
        assert_eq!((first.first(), first.len()), (Some(&37), SAMPLES));
        let mut last = 0;
        while let Some(tick) = ticks(recent.take()).last() {
            last = *tick;
        }
        assert_eq!(last, 100);
    }
}
