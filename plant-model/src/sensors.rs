//! What the sensors make of the state: gain, offsets, and a position signal that comes late. Lags are states of the plant.

use crate::effects::Added;
use crate::measurement::Measurement;
use crate::plant::State;
use crate::real::Real;
use heapless::Deque;

/// Past positions as far back as the position signal is late.
#[derive(Clone, Debug)]
pub(crate) struct Sensors<R, const N: usize> {
    delay_s: R,
    past: Deque<(R, R), N>,
}

impl<R: Real, const N: usize> Sensors<R, N> {
    pub(crate) fn new(delay_s: R) -> Self {
        Self { delay_s, past: Deque::new() }
    }

    /// Records the position behind its lag at the start of an interval of `dt` seconds.
    #[inline]
    pub(crate) fn record(&mut self, y_m: R, dt_s: R) {
        if self.delay_s <= R::ZERO {
            return;
        }
        if self.past.is_full() {
            self.past.pop_back();
        }
        // A place was freed above.
        let _ = self.past.push_front((dt_s, y_m));
    }

    /// The measurement of the present state.
    #[inline]
    pub(crate) fn measure(&self, added: &Added<R>, state: &State<R>) -> Measurement<R> {
        added.sense(Measurement {
            y_m: self.late_position(state.y_sensed_m),
            p_a_pa: state.p_a_sensed_pa,
            p_b_pa: state.p_b_sensed_pa,
            p_sup_pa: state.p_sup_pa,
        })
    }

    /// Linear interpolation between recorded positions; before the first record the piston stood there.
    fn late_position(&self, now_m: R) -> R {
        let mut later = now_m;
        let mut age = self.delay_s;
        for &(dt, earlier) in &self.past {
            if age <= dt {
                return later + (earlier - later) * (age / dt);
            }
            age -= dt;
            later = earlier;
        }
        later
    }
}
