//! What a hypothesis adds to the balances beside its plant: forces and flows of terms outside the catalogue, and the offset of
//! the supply's sensor.

/// What the terms of a hypothesis add to the balances, by sample; empty for nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Added {
    /// Force opposing positive motion, N.
    pub(crate) force_n: Vec<f64>,
    /// Mass flow into A, kg/s.
    pub(crate) flow_a_kg_per_s: Vec<f64>,
    /// Mass flow into B, kg/s.
    pub(crate) flow_b_kg_per_s: Vec<f64>,
    /// What the supply's sensor shows too much, Pa.
    pub(crate) supply_sensor_pa: f64,
}

impl Added {
    pub(crate) fn add(&mut self, other: &Self, factor: f64) {
        let sum = |to: &mut Vec<f64>, from: &[f64]| {
            to.resize(to.len().max(from.len()), 0.0);
            to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
        };
        sum(&mut self.force_n, &other.force_n);
        sum(&mut self.flow_a_kg_per_s, &other.flow_a_kg_per_s);
        sum(&mut self.flow_b_kg_per_s, &other.flow_b_kg_per_s);
        self.supply_sensor_pa += factor * other.supply_sensor_pa;
    }
}
