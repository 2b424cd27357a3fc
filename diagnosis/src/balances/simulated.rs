//! Logs of the simulator, for tests.

use plant_model::{Effects, Inputs, Simulator};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Log, RigFile};

/// So many rows at 1 kHz of a rig with some effects, its valve driven by a command in V as a function of time in s.
pub(crate) fn simulated(file: &RigFile, effects: &Effects<f64>, rows: u32, command_v: impl Fn(f64) -> f64) -> Log {
    Log { p_sup_pa: None, ..with_supply(file, effects, rows, command_v) }
}

/// The same with the pressure of the supply.
pub(crate) fn with_supply(file: &RigFile, effects: &Effects<f64>, rows: u32, command_v: impl Fn(f64) -> f64) -> Log {
    with_drift(file, effects, rows, |t_s| (command_v(t_s), 0.0))
}

/// The same with a supply that is off its pressure; the function of time in s gives command in V and drift in Pa.
pub(crate) fn with_drift(file: &RigFile, effects: &Effects<f64>, rows: u32, at: impl Fn(f64) -> (f64, f64)) -> Log {
    let mut rig: Simulator<f64> = Simulator::new(&file.rig, effects).expect("a sound rig");
    let mut log = Log::default();
    for k in 0..rows {
        let t_s = 1.0e-3 * f64::from(k);
        let ((u_v, drift_pa), m) = (at(t_s), rig.measure());
        log.t_s.push(t_s);
        log.y_m.push(m.y_m);
        let pressures = [(&mut log.p_a_pa, m.p_a_pa), (&mut log.p_b_pa, m.p_b_pa), (&mut log.p_sup_pa, m.p_sup_pa)];
        for (column, value) in pressures.into_iter().chain([(&mut log.u_v, u_v)]) {
            column.get_or_insert_default().push(value);
        }
        let inputs = rig.plant().inputs(u_v);
        rig.advance_with(&Inputs { supply_pa: inputs.supply_pa + drift_pa, ..inputs }, 1.0e-3);
    }
    log
}

/// A slow command in V with rests, as a function of time in s: in twelve seconds a piston breaks away some twenty times.
pub(crate) fn stick_slip_v(t_s: f64) -> f64 {
    0.9 * (2.0 * t_s).sin() * (0.31 * t_s).sin().powi(2) + 0.1 * (9.0 * t_s).sin()
}

/// Every other row of a log.
pub(crate) fn every_other(log: &Log) -> Log {
    rows(log, |k| k % 2 == 0)
}

/// Those rows of a log that are wanted.
pub(crate) fn rows(log: &Log, wanted: impl Fn(usize) -> bool) -> Log {
    let rows = |signal: &[f64]| {
        let kept = signal.iter().enumerate().filter(|(k, _)| wanted(*k));
        kept.map(|(_, value)| *value).collect::<Vec<f64>>()
    };
    let column = |signal: &Option<Vec<f64>>| signal.as_deref().map(rows);
    Log {
        t_s: rows(&log.t_s),
        y_m: rows(&log.y_m),
        u_v: column(&log.u_v),
        p_a_pa: column(&log.p_a_pa),
        p_b_pa: column(&log.p_b_pa),
        p_sup_pa: column(&log.p_sup_pa),
        ..Log::default()
    }
}

/// Adds white noise of such standard deviations to the position, in m, and to all pressures, in Pa.
pub(crate) fn add_noise(log: &mut Log, position_m: f64, pressures_pa: f64) {
    let mut draws = StandardNormal.sample_iter(Xoshiro256PlusPlus::seed_from_u64(5));
    let pressures = [&mut log.p_a_pa, &mut log.p_b_pa, &mut log.p_sup_pa]
        .into_iter()
        .flatten()
        .map(|signal| (signal, pressures_pa));
    for (signal, noise) in std::iter::once((&mut log.y_m, position_m)).chain(pressures) {
        signal.iter_mut().zip(&mut draws).for_each(|(x, e): (&mut f64, f64)| *x += noise * e);
    }
}
