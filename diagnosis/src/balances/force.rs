//! What drives the piston: the force of the chamber pressures as measured, and all others but friction (3.8).

use crate::data::record::{Moment, Record};
use crate::data::smoothing::Smoothed;
use crate::data::split::{Stretch, samples};
use plant_model::{Plant, Side};

/// The added force at a sample, N; 0 where none is added.
pub(super) fn added_at(record: &Record, timing: &Timing, added_n: &[f64], stretch: &Stretch, k: usize) -> f64 {
    if added_n.is_empty() {
        return 0.0;
    }
    timing.moment(record, stretch, k).map_or_else(|| added_n[k], |moment| moment.of(added_n))
}

/// What drives the piston at one instant.
#[derive(Clone, Copy)]
pub(super) struct Driving {
    /// Net force apart from friction, N.
    pub(super) force_n: f64,
    pub(super) p_a_pa: f64,
    pub(super) p_b_pa: f64,
}

impl Driving {
    /// The mean from here to the next instant, where the force's mean is so much more than that of a straight line.
    pub(super) fn mean_to(&self, next: &Self, bend_n: f64) -> Self {
        Self {
            force_n: 0.5 * (self.force_n + next.force_n) + bend_n,
            p_a_pa: 0.5 * (self.p_a_pa + next.p_a_pa),
            p_b_pa: 0.5 * (self.p_b_pa + next.p_b_pa),
        }
    }
}

/// Lag and delay of the sensors, by which pressures and position are brought to the same time.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    pressure_lag_s: f64,
    position_delay_s: f64,
}

impl Timing {
    pub(crate) fn of(plant: &Plant<f64>) -> Self {
        Self { pressure_lag_s: plant.added().pressure_lag.time_constant_s, position_delay_s: plant.position_delay_s() }
    }

    /// The moment at which the position of a sample was true: a delayed position belongs to earlier pressures. `None`
    /// without a delay.
    fn moment(&self, record: &Record, stretch: &Stretch, k: usize) -> Option<Moment> {
        (self.position_delay_s > 0.0).then(|| record.moment(k, -self.position_delay_s, stretch.range()))
    }
}

/// Forces and pressures at the samples of some stretches, in order, sensors' offsets included.
pub(crate) struct Forces {
    p_a_pa: Vec<f64>,
    p_b_pa: Vec<f64>,
    /// [`Record::bend_pa`] of both chambers.
    bends_pa: Vec<[f64; 2]>,
    /// Empty if not measured.
    external_n: Vec<f64>,
}

impl Forces {
    /// The bends of the pressures behind a place as a force, N.
    pub(super) fn bend_n(&self, plant: &Plant<f64>, place: usize) -> f64 {
        let [a, b] = self.bends_pa[place];
        a * plant.area_m2(Side::A) - b * plant.area_m2(Side::B)
    }
}

/// The measured pressures with the sensor's lag undone, and the measured force, within some stretches.
pub(crate) fn forces(record: &Record, timing: &Timing, stretches: &[Stretch]) -> Forces {
    let count = samples(stretches);
    let measured = if record.available.force { count } else { 0 };
    let mut out = Forces {
        p_a_pa: Vec::with_capacity(count),
        p_b_pa: Vec::with_capacity(count),
        bends_pa: Vec::with_capacity(count),
        external_n: Vec::with_capacity(measured),
    };
    for stretch in stretches {
        for k in stretch.range() {
            let late = timing.moment(record, stretch, k);
            let at = |x: &[f64]| late.as_ref().map_or_else(|| x[k], |moment| moment.of(x));
            let pressure = |smooth: &Smoothed| at(&smooth.value) + timing.pressure_lag_s * at(&smooth.slope);
            out.p_a_pa.push(pressure(&record.p_a_smooth));
            out.p_b_pa.push(pressure(&record.p_b_smooth));
            out.bends_pa.push([Side::A, Side::B].map(|side| record.bend_pa(side, k)));
            if measured > 0 {
                out.external_n.push(at(&record.f_ext_n));
            }
        }
    }
    out
}

/// What drives the piston at sample `k` of a stretch, which is number `place` of the forces.
pub(super) fn driving(
    plant: &Plant<f64>,
    forces: &Forces,
    place: usize,
    [y_m, v_m_per_s]: [f64; 2],
    added_n: f64,
) -> Driving {
    let p_a_pa = plant.pressure_behind_lag_pa(Side::A, forces.p_a_pa[place]);
    let p_b_pa = plant.pressure_behind_lag_pa(Side::B, forces.p_b_pa[place]);
    let external = forces.external_n.get(place).copied().unwrap_or(0.0);
    let force_n = plant.net_force_n(y_m, v_m_per_s, p_a_pa, p_b_pa) - added_n + external;
    Driving { force_n, p_a_pa, p_b_pa }
}
