//! What changes together without a trace in any log: a common factor on the cross-section and all that goes with it
//! ([`plant_model::similarity`]), and an effect that takes nominal values in step with it.

use super::effects::moves_nominal_values;
use super::hypothesis::Hypothesis;
use super::parameter::{Parameter, Slot};
use nalgebra::DVector;
use plant_model::Effect;

impl Hypothesis {
    /// The directions of the parameters, in their scales, along which no log shows a change, only tolerances do: that of a common
    /// factor on the cross-section ([`plant_model::similarity`]), where an area is free, that of an effect that takes nominal values
    /// with it, and for each nominal value that an effect multiplies that of their product. Each is a change per logarithm of its
    /// factor.
    pub(crate) fn directions_without_trace(&self) -> Vec<DVector<f64>> {
        let along = |exponent: &dyn Fn(&Parameter) -> i8| {
            let pairs = self.parameters.iter().zip(&self.values);
            let changes = pairs.map(|(parameter, value)| f64::from(exponent(parameter)) * value / parameter.scale);
            DVector::from_iterator(self.values.len(), changes)
        };
        let size = self.has_free_area().then(|| along(&|parameter| self.size_exponent_of(parameter)));
        let moving = self.effects.iter().filter(|effect| moves_nominal_values(**effect));
        let in_step = moving.map(|effect| {
            along(&|parameter| {
                if parameter.slot == Slot::Effect(*effect, 0) { 1 } else { parameter.exponent_in_step(*effect) }
            })
        });
        let multiplied = self.parameters.iter().filter(|value| self.parameters.iter().any(|p| p.multiplies(value)));
        let products = multiplied.map(|value| {
            along(&|parameter| {
                if parameter.slot == value.slot { -1 } else { i8::from(parameter.multiplies(value)) }
            })
        });
        size.into_iter().chain(in_step).chain(products).collect()
    }

    /// The exponent with which a parameter changes with the cross-section, where a value changes that it multiplies.
    fn size_exponent_of(&self, parameter: &Parameter) -> i8 {
        let beside = self.parameters.iter().any(|value| parameter.multiplies(value));
        if beside { 0 } else { parameter.size_exponent() }
    }

    fn has_free_area(&self) -> bool {
        let is_area = |p: &Parameter| matches!(p.slot, Slot::Nominal(key) if key.name.ends_with("_m2"));
        self.effects.contains(&Effect::PistonArea) || self.parameters.iter().any(is_area)
    }

    /// Moves along similarity to where tolerances like the values best: no log tells a common factor on the cross-section.
    pub(crate) fn scale_to_likeliest_size(&mut self) {
        let sized: Vec<(usize, f64)> = (0..self.values.len())
            .map(|i| (i, f64::from(self.size_exponent_of(&self.parameters[i]))))
            .filter(|(i, exponent)| *exponent != 0.0 && self.values[*i] != 0.0)
            .collect();
        // The logarithm of the factor, as far as bounds allow.
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (i, exponent) in &sized {
            let p = &self.parameters[*i];
            let [a, b] = [p.min, p.max].map(|end| (end / self.values[*i]).max(f64::MIN_POSITIVE).ln() / exponent);
            (low, high) = (low.max(a.min(b).min(0.0)), high.min(a.max(b).max(0.0)));
        }
        let begun = self.values.clone();
        let at = |by: f64, i: usize, exponent: f64| begun[i] * (exponent * by).exp();
        let mut by = 0.0;
        // Within tolerances of a tenth the third step changes nothing that counts.
        for _ in 0..3 {
            let (mut slope, mut curvature) = (0.0, 0.0);
            for (i, exponent) in &sized {
                let p = &self.parameters[*i];
                let (value, Some(tolerance)) = (at(by, *i, *exponent), p.tolerance) else { continue };
                let change = exponent * value / tolerance;
                slope += (value - p.neutral) / tolerance * change;
                curvature += change * change;
            }
            if curvature > 0.0 {
                by = f64::clamp(by - slope / curvature, low, high);
            }
        }
        for (i, exponent) in &sized {
            let p = &self.parameters[*i];
            self.values[*i] = at(by, *i, *exponent).clamp(p.min, p.max);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig_files::RigFile;

    #[test]
    fn values_of_another_size_go_back_to_the_stated_one_also_from_a_bound() {
        let mut rig = RigFile::paper_a();
        assert!(rig.tolerance.set("cylinder.area_m2", 0.005) && rig.tolerance.set("load.mass_kg", 0.02));
        let nominal = crate::model::nominal::nominal_parameters(&rig, 0b0111, false, &[-5.0, 5.0]);
        let mut smaller = Hypothesis::null(&nominal);
        for (p, value) in smaller.parameters.iter().zip(&mut smaller.values) {
            *value *= 0.98_f64.powi(p.size_exponent().into());
        }
        let area = |h: &Hypothesis| {
            let place = h.parameters.iter().position(|p| p.slot.stated_key() == Some("cylinder.area_m2"));
            let place = place.expect("corrected");
            (h.parameters[place].is_at_bound(h.values[place]), h.values[place] / h.parameters[place].neutral)
        };
        assert!(area(&smaller).0);
        smaller.scale_to_likeliest_size();
        for (p, value) in smaller.parameters.iter().zip(&smaller.values).filter(|(p, _)| p.neutral != 0.0) {
            assert!((value / p.neutral - 1.0).abs() < 1e-6, "{:?}: {value} {}", p.slot, p.neutral);
        }
    }
}
