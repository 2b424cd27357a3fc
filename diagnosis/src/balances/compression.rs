//! What the piston's motion does to the air of a chamber from each sample to the next.

use crate::data::record::Record;
use crate::data::split::{Stretch, samples};
use plant_model::{FirstOrderLag, Plant, Side};

/// The parameters that the effect of the motion on a chamber's air depends on.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Geometry {
    volume_0_m3: f64,
    /// Signed: the volume grows with it times the position.
    area_m2: f64,
    smallest_m3: f64,
    position_lag: FirstOrderLag<f64>,
    position_delay_s: f64,
    /// The true position at three readings of the sensor: alike for sensors that are alike.
    sensor_m: [f64; 3],
    exponent: f64,
    energy_j_per_kg: f64,
}

/// The polytropic compression of a chamber's air from a sample to the next, as factors that do not depend on the pressure.
pub(crate) struct Stroke {
    /// Growth of the pressure over the first half of the piston's way, as a factor; air is exchanged between the
    /// halves.
    pub(super) first_half: f64,
    /// The same over the second half.
    pub(super) second_half: f64,
    /// Pressure per mass flow at the volume between, Pa s/kg.
    pub(super) pa_s_per_kg: f64,
    /// Position between, m.
    pub(super) y_m: f64,
}

/// Where the piston is at a sample, and what volume that leaves to a chamber.
#[derive(Clone, Copy)]
pub(super) struct Place {
    y_m: f64,
    volume_m3: f64,
}

impl Geometry {
    pub(crate) fn of(plant: &Plant<f64>, side: Side) -> Self {
        let c = plant.coefficients();
        let (volume_0_m3, grows) = if side == Side::A { (c.volume_a0_m3, 1.0) } else { (c.volume_b0_m3, -1.0) };
        Self {
            volume_0_m3,
            area_m2: grows * plant.area_m2(side),
            smallest_m3: plant.minimum_volume_m3(side),
            position_lag: plant.added().position_lag,
            position_delay_s: plant.position_delay_s(),
            sensor_m: [-0.5, 0.1, 0.5].map(|part| plant.true_position_m(part * c.half_stroke_m)),
            exponent: c.exponent,
            energy_j_per_kg: plant.energy_j_per_kg(),
        }
    }

    /// The piston's place at sample `k`.
    pub(super) fn place(&self, record: &Record, plant: &Plant<f64>, k: usize) -> Place {
        let y_m = plant.true_position_m(self.position_m(record, k));
        Place { y_m, volume_m3: (self.volume_0_m3 + self.area_m2 * y_m).max(self.smallest_m3) }
    }

    /// What the position sensor would show at sample `k` without lag and delay.
    fn position_m(&self, record: &Record, k: usize) -> f64 {
        let ahead = |k| record.position_ahead_m(k, &self.position_lag);
        if self.position_delay_s > 0.0 {
            record.moment(k, self.position_delay_s, 0..record.len()).of_each(|k| [ahead(k)])[0]
        } else {
            ahead(k)
        }
    }

    /// The compression on the way from one place to another within `dt_s`.
    #[inline(always)]
    pub(super) fn stroke(&self, from: Place, to: Place, dt_s: f64) -> Stroke {
        let middle = 0.5 * (from.volume_m3 + to.volume_m3);
        Stroke {
            first_half: polytropic(from.volume_m3 / middle, self.exponent),
            second_half: polytropic(middle / to.volume_m3, self.exponent),
            pa_s_per_kg: self.energy_j_per_kg / middle * dt_s,
            y_m: 0.5 * (from.y_m + to.y_m),
        }
    }
}

/// The compression from each sample of some stretches to the next, in order. The entry of a stretch's last sample is not used.
pub(crate) fn compression(record: &Record, plant: &Plant<f64>, g: &Geometry, stretches: &[Stretch]) -> Vec<Stroke> {
    let mut out = Vec::with_capacity(samples(stretches));
    for stretch in stretches {
        let mut here = g.place(record, plant, stretch.start);
        for k in stretch.range() {
            let next = g.place(record, plant, (k + 1).min(stretch.end - 1));
            out.push(g.stroke(here, next, record.interval_s(k)));
            here = next;
        }
    }
    out
}

/// `x^n` for `x` close to one.
fn polytropic(x: f64, n: f64) -> f64 {
    let e = x - 1.0;
    1.0 + n * e * (1.0 + 0.5 * (n - 1.0) * e * (1.0 + (n - 2.0) / 3.0 * e))
}
