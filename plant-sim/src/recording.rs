//! A closed-loop run kept tick by tick, for plots and logs.

use crate::closed_loop::{ClosedLoop, LoopError, LoopRecord, LoopSettings};
use crate::metrics::{StepMetrics, StepObserver};
use board_link::LearnedValues;
use control::{Mode, Parameters};
use rig_files::{Column, Io, Log, RigFile};

/// Everything a run showed, one entry per tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Setpoint, m.
    pub y_ref_m: Vec<f64>,
    /// True position, m.
    pub y_m: Vec<f64>,
    /// True velocity, m/s.
    pub v_m_per_s: Vec<f64>,
    /// True pressure of chamber A, Pa absolute.
    pub p_a_pa: Vec<f64>,
    /// True pressure of chamber B, Pa absolute.
    pub p_b_pa: Vec<f64>,
    /// Bristle deflection, m.
    pub z_m: Vec<f64>,
    /// Valve command, V.
    pub u_v: Vec<f64>,
    /// Position as the controller read it, m.
    pub y_read_m: Vec<f64>,
    /// Pressures A, B and supply as the controller read them, Pa absolute.
    pub p_read_pa: [Vec<f64>; 3],
    /// Position code.
    pub adc_position: Vec<f64>,
    /// DAC code.
    pub dac: Vec<f64>,
    /// The controller's mode after the last tick.
    pub mode: Mode,
    /// When the controller's model monitor first found that the readings contradict each other, s.
    pub contradicted_s: Option<f64>,
    /// What the positioning law had learned by the end; `None` under the paper's law.
    pub learned: Option<LearnedValues>,
}

impl Recording {
    /// Runs a positioner for `ticks` with a setpoint that is a function of time.
    ///
    /// # Errors
    /// Plant or controller refuse a parameter.
    pub fn run(
        rig: &RigFile,
        parameters: &Parameters,
        settings: &LoopSettings,
        ticks: usize,
        setpoint_m: impl Fn(f64) -> f64,
    ) -> Result<Self, LoopError> {
        let mut positioner = ClosedLoop::new(rig, parameters, settings)?;
        let mut kept = Self::default();
        for tick in 0..ticks {
            let y_ref_m = setpoint_m(tick as f64 * positioner.tick_s());
            kept.push(&rig.io, y_ref_m, &positioner.tick(y_ref_m));
        }
        kept.learned = positioner.learned();
        Ok(kept)
    }

    /// Appends a tick.
    pub fn push(&mut self, io: &Io, y_ref_m: f64, seen: &LoopRecord) {
        let (position, pressure) = (io.position(), io.pressure());
        self.t_s.push(seen.t_s);
        self.y_ref_m.push(y_ref_m);
        self.y_m.push(seen.plant.y_m);
        self.v_m_per_s.push(seen.plant.v_m_per_s);
        self.p_a_pa.push(seen.plant.p_a_pa);
        self.p_b_pa.push(seen.plant.p_b_pa);
        self.z_m.push(seen.plant.z_m);
        self.u_v.push(seen.u_v);
        self.y_read_m.push(position.quantity(u32::from(seen.adc[0])));
        for (read, code) in self.p_read_pa.iter_mut().zip(&seen.adc[1..]) {
            read.push(pressure.quantity(u32::from(*code)));
        }
        self.adc_position.push(f64::from(seen.adc[0]));
        self.dac.push(f64::from(seen.dac));
        self.mode = seen.mode;
        if seen.disagreement {
            self.contradicted_s.get_or_insert(seen.t_s);
        }
    }

    /// The figures of the recorded step from rest to `target_m`.
    #[must_use]
    pub fn step_metrics(&self, target_m: f64) -> StepMetrics {
        let start_m = self.y_m.first().copied().unwrap_or(0.0);
        let duration_s = self.t_s.last().copied().unwrap_or(0.0);
        let mut observer = StepObserver::new(start_m, target_m, duration_s);
        for (t_s, y_m) in self.t_s.iter().zip(&self.y_m) {
            observer.see(*t_s, *y_m);
        }
        observer.metrics()
    }

    /// The log a data logger on the controller would have written.
    #[must_use]
    pub fn to_log(&self) -> Log {
        let mut log = Log { t_s: self.t_s.clone(), ..Log::default() };
        let [p_a, p_b, p_sup] = self.p_read_pa.clone();
        for (column, values) in [
            (Column::U, self.u_v.clone()),
            (Column::Y, self.y_read_m.clone()),
            (Column::PA, p_a),
            (Column::PB, p_b),
            (Column::PSup, p_sup),
            (Column::YRef, self.y_ref_m.clone()),
        ] {
            log.set(column, Some(values));
        }
        log
    }

    /// What no sensor knows: the true states of the plant at the same times, in the columns that `simulate` writes.
    #[must_use]
    pub fn to_true_log(&self) -> Log {
        let mut log = Log { t_s: self.t_s.clone(), ..Log::default() };
        for (column, values) in [
            (Column::U, &self.u_v),
            (Column::Y, &self.y_m),
            (Column::PA, &self.p_a_pa),
            (Column::PB, &self.p_b_pa),
            (Column::V, &self.v_m_per_s),
            (Column::Z, &self.z_m),
        ] {
            log.set(column, Some(values.clone()));
        }
        log
    }
}
