//! Derivatives by the parameters that act through the valve's opening alone, from a prediction
//! [linearised by the opening](crate::balances::linearised): a table has dozens of them.

use super::compensation::moved;
use super::likelihood::Residuals;
use super::problem::Problem;
use crate::constants;
use crate::data::channel::Channel;
use crate::model::hypothesis::Hypothesis;
use plant_model::Plant;

/// A parameter moved by a step.
pub(super) struct Moved {
    /// Its place.
    pub(super) index: usize,
    /// The plant with it.
    plant: Plant<f64>,
    /// One over the step in scales.
    per_scale: f64,
}

/// With fewer, difference quotients are cheaper: linearising takes three predictions, each parameter then a third of one (a rig
/// with a table and hoses, and the paper's case (b), both with warm walls).
const FEWEST_THROUGH_OPENING: usize = 6;

impl Problem<'_> {
    /// The wanted parameters that act through the valve's opening alone; none where there are so few that difference quotients
    /// are cheaper.
    pub(super) fn through_opening(
        &self,
        hypothesis: &Hypothesis,
        values: &[f64],
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<Moved> {
        let chambers = Channel::PressureA.bit() | Channel::PressureB.bit();
        let Some(plant) = hypothesis.plant(self.rig, values) else { return Vec::new() };
        if plant.added().supply_droop.droop_pa_s_per_kg > 0.0 {
            return Vec::new();
        }
        let through = |index: usize| {
            let parameter = &hypothesis.parameters[index];
            if !wanted(index) || parameter.channels & !chambers != 0 {
                return None;
            }
            let step = hypothesis.step(values, index, constants::step_smooth());
            let at = |step: f64| hypothesis.plant(self.rig, &moved(hypothesis, values, (index, step), &[]));
            let other = at(step).map(|plant| (plant, step)).or_else(|| at(-step).map(|plant| (plant, -step)));
            let (plant, step) = other.filter(|(other, _)| plant.differs_in_opening_only(other))?;
            Some(Moved { index, plant, per_scale: parameter.scale / step })
        };
        let all: Vec<Moved> = (0..values.len()).filter_map(through).collect();
        if all.len() < FEWEST_THROUGH_OPENING { Vec::new() } else { all }
    }

    /// The derivatives by parameters that act through the opening alone.
    pub(super) fn by_opening(&self, hypothesis: &Hypothesis, values: &[f64], parameters: &[Moved]) -> Vec<Residuals> {
        let plant = hypothesis.plant(self.rig, values);
        let Some(plant) = plant.filter(|_| !parameters.is_empty()) else { return Vec::new() };
        let wanted = parameters.iter().fold(0, |all, moved| all | hypothesis.parameters[moved.index].channels);
        let moved: Vec<Plant<f64>> = parameters.iter().map(|moved| moved.plant).collect();
        let changes = self.by_openings_of((&plant, &moved), &self.added(hypothesis, values), wanted & self.judgeable);
        let per_scale = |(mut change, moved): (Residuals, &Moved)| {
            change.channels.iter_mut().flatten().for_each(|e| *e *= moved.per_scale);
            change
        };
        changes.into_iter().zip(parameters).map(per_scale).collect()
    }
}
