//! A hypothesis: a set of effects on top of nominal values that are known within their tolerance.

use super::effects::{channels, moves_nominal_values};
use super::parameter::{Parameter, Slot};
use crate::constants;
use crate::data::channel::Channels;
use plant_model::effects::identification::StandsFor;
use plant_model::{Effect, Effects, Plant, hose};
use rig_files::RigFile;

/// The parameter vector of a set of effects with its values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hypothesis {
    pub(crate) effects: Vec<Effect>,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) values: Vec<f64>,
}

/// Whether a value hides an effect that moves what it belongs to: points of a table bend about a break-point that lies elsewhere.
pub(crate) fn hides(effect: Effect, parameter: &Parameter) -> bool {
    effect == Effect::ValveDeadZone && parameter.slot.is_fine()
}

/// Least step of the difference quotient of a rounding's square, scales: 14 % of a rounding of one tolerance.
const ROUNDING_STEP: f64 = 0.02;

/// Derivatives of the air's balances are kept while values move by no more than this part of a scale, which is a tolerance: 0.5 % of a
/// value known to 2 %. With 0.1, 0.5 and 1 two logs had the same names, values within a tenth of their errors, and took as long within 5 %.
const NEAR: f64 = 0.25;

impl Hypothesis {
    /// No effects: nominal values only.
    pub(crate) fn null(nominal: &[Parameter]) -> Self {
        Self { effects: Vec::new(), parameters: nominal.to_vec(), values: nominal.iter().map(|p| p.neutral).collect() }
    }

    /// The same without what joins a fit last, because it leads one astray that begins far away: the points of the table of the opening
    /// and what data sheets leave out of a valve's shape, which stay as stated.
    pub(crate) fn coarse(&self) -> Self {
        let pairs = self.parameters.iter().zip(&self.values);
        let (parameters, values) = pairs.filter(|(p, _)| !p.slot.is_fine()).unzip();
        Self { effects: self.effects.clone(), parameters, values }
    }

    /// The same with the values of a coarse fit; shapes, which that has not, begin [where they should](Parameter::begin).
    pub(crate) fn refining(&self, coarse: &Self) -> Self {
        let mut out = self.with_values_of(coarse);
        let pairs = out.parameters.iter().zip(&mut out.values);
        pairs.filter(|(p, _)| p.slot.is_shape()).for_each(|(p, value)| *value = p.begin());
        out
    }

    /// The same with the values of another hypothesis, as far as that has them.
    pub(crate) fn with_values_of(&self, other: &Self) -> Self {
        let value = |(p, value): (&Parameter, &f64)| other.value(p.slot).unwrap_or(*value);
        let values = self.parameters.iter().zip(&self.values).map(value).collect();
        Self { values, ..self.clone() }
    }

    /// The same with one more effect; all other parameters stay free and keep their values. What the rig file states for that
    /// effect then acts no more.
    pub(crate) fn extended_by(&self, effect: Effect, parameters: Vec<Parameter>, start: &[f64]) -> Self {
        let mut out = self.clone();
        out.effects.push(effect);
        out.take_along(effect, &parameters, start);
        out.parameters.extend(parameters);
        out.values.extend(start);
        out
    }

    /// Changes the values that have to change in proportion with an effect that is about to be added.
    fn take_along(&mut self, effect: Effect, parameters: &[Parameter], start: &[f64]) {
        if let (Some(parameter), Some(value)) = (parameters.first(), start.first()) {
            self.move_in_step(effect, value / parameter.neutral);
        }
    }

    /// The same with one more term outside the catalogue, its factor zero.
    pub(crate) fn with_term(&self, index: usize, channels: Channels) -> Self {
        let mut out = self.clone();
        out.parameters.push(Parameter {
            slot: Slot::Term(index),
            neutral: 0.0,
            scale: 1.0,
            negligible: 0.0,
            tolerance: None,
            min: -constants::largest_term(),
            max: constants::largest_term(),
            channels,
        });
        out.values.push(0.0);
        out
    }

    /// The factors of its terms by their place in the library.
    pub(crate) fn factors<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (usize, f64)> + 'a {
        self.parameters.iter().zip(values).filter_map(|(p, value)| match p.slot {
            Slot::Term(index) => Some((index, *value)),
            _ => None,
        })
    }

    /// What the supply's sensor shows too much, Pa.
    pub(crate) fn supply_sensor_pa(&self, values: &[f64]) -> f64 {
        let place = self.parameters.iter().position(|p| p.slot == Slot::SupplySensor);
        place.map_or(0.0, |place| values[place])
    }

    /// The same with one more effect at the given values.
    ///
    /// An effect may change the same quantity as a nominal value. Then it takes over that value's correction, and the
    /// value returns to nominal. If there is a single such value it is no longer fitted: the data would not determine
    /// it, and its prior would only hold it at nominal.
    ///
    /// Strained nominal values may have compensated for the missing effect. With `anew` they return to nominal,
    /// otherwise they keep their values.
    pub(crate) fn with(&self, effect: Effect, parameters: Vec<Parameter>, start: &[f64], anew: bool) -> Self {
        let mut out = Self { effects: self.effects.clone(), ..Self::default() };
        out.effects.push(effect);
        let identification = effect.identification();
        let stands_for = &identification.stands_for;
        let mut start = start.to_vec();
        // Where both sides are corrected, what they have in common is where the factor begins: the fit is there already.
        let common = self.common_factor(stands_for);
        if let (Some(common), Some(first), Some(parameter)) = (common, start.first_mut(), parameters.first()) {
            *first = parameter.neutral * common;
        }
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            let taken = common.filter(|_| is_side_of(parameter, stands_for)).unwrap_or(1.0);
            let value = &(value / taken).clamp(parameter.min, parameter.max);
            let replacing = match parameter.slot {
                Slot::Nominal(key) => stands_for.parameter_of(key.path),
                Slot::Stated(stated, _) if stated == effect => continue,
                Slot::Effect(..)
                | Slot::Stated(..)
                | Slot::Term(_)
                | Slot::Opening(_)
                | Slot::Rounding
                | Slot::SupplySensor => None,
            };
            if let Some(place) = replacing {
                start[place] = stands_for.take_over(start[place], *value, parameter.neutral);
            }
            let replaced = replacing.is_some();
            if !replaced || !stands_for.is_single() {
                let strained = anew && is_strained(parameter, *value) && parameter.channels & channels(effect) != 0;
                let hides = anew && hides(effect, parameter);
                out.parameters.push(*parameter);
                out.values.push(if replaced || strained || hides { parameter.begin() } else { *value });
            }
        }
        let neutral = parameters.first().map_or(1.0, |p| p.neutral);
        out.scale_keys(identification.carries_along, neutral / start.first().copied().unwrap_or(neutral));
        out.take_along(effect, &parameters, &start);
        out.parameters.extend(parameters);
        out.values.extend(start);
        out
    }

    /// Multiplies the value of a parameter, within its bounds.
    pub(crate) fn scale(&mut self, slot: Slot, factor: f64) {
        for (parameter, value) in self.parameters.iter().zip(&mut self.values).filter(|(p, _)| p.slot == slot) {
            *value = (*value * factor).clamp(parameter.min, parameter.max);
        }
    }

    /// Changes the parameters that compensate a change of the effect by `factor` in the air balances and the inertia.
    /// The cost has a long curved valley there, along which a fit converges slowly.
    fn move_in_step(&mut self, effect: Effect, factor: f64) {
        if !moves_nominal_values(effect) {
            return;
        }
        for (parameter, value) in self.parameters.iter().zip(&mut self.values) {
            let exponent = parameter.exponent_in_step(effect);
            let by = match exponent {
                0 => 1.0,
                ..0 => 1.0 / factor,
                1.. => factor,
            };
            *value = (*value * by).clamp(parameter.min, parameter.max);
        }
    }

    /// Multiplies some nominal values, as far as their bounds allow.
    fn scale_keys(&mut self, keys: &[&str], factor: f64) {
        for (parameter, value) in self.parameters.iter().zip(&mut self.values) {
            if matches!(parameter.slot, Slot::Nominal(key) if keys.contains(&key.path)) {
                *value = (*value * factor).clamp(parameter.min, parameter.max);
            }
        }
    }

    /// What the values of a rig's two sides have in common of their correction, where an effect is a factor on both: the geometric
    /// mean. `None` where they are not corrected side by side.
    fn common_factor(&self, stands_for: &StandsFor) -> Option<f64> {
        let pairs = self.parameters.iter().zip(&self.values).filter(|(p, _)| is_side_of(p, stands_for));
        let (sum, count) = pairs.fold((0.0, 0), |(sum, count), (p, value)| (sum + (value / p.neutral).ln(), count + 1));
        (count > 0).then(|| (sum / f64::from(count)).exp())
    }

    /// The same without one effect; nominal values that it replaced are fitted again, from an equivalent value.
    pub(crate) fn without(&self, effect: Effect, nominal: &[Parameter]) -> Self {
        let mut out =
            Self { effects: self.effects.iter().copied().filter(|e| *e != effect).collect(), ..Self::default() };
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            if !matches!(parameter.slot, Slot::Effect(e, _) if e == effect) {
                out.parameters.push(*parameter);
                out.values.push(*value);
            }
        }
        let removed = self.values_of(effect);
        let neutral = self.parameters.iter().find(|p| p.slot == Slot::Effect(effect, 0)).map(|p| p.neutral);
        let identification = effect.identification();
        let stands_for = &identification.stands_for;
        if let (Some(neutral), Some(first)) = (neutral, removed.first()) {
            out.scale_keys(identification.carries_along, first / neutral);
            out.move_in_step(effect, neutral / first);
        }
        if let Some(factor) = removed.first() {
            let sides = out.parameters.iter().zip(&mut out.values).filter(|(p, _)| is_side_of(p, stands_for));
            sides.for_each(|(p, value)| *value = (*value * factor).clamp(p.min, p.max));
        }
        for parameter in nominal {
            if matches!(parameter.slot, Slot::Stated(stated, _) if stated == effect) {
                out.parameters.insert(0, *parameter);
                out.values.insert(0, parameter.neutral);
            }
            let Slot::Nominal(key) = parameter.slot else { continue };
            let Some(removed) = stands_for.parameter_of(key.path).and_then(|place| removed.get(place)) else {
                continue;
            };
            let given_back = stands_for.give_back(*removed, parameter.neutral);
            if stands_for.is_single() {
                out.parameters.insert(0, *parameter);
                out.values.insert(0, given_back.clamp(parameter.min, parameter.max));
                continue;
            }
            let same = |p: &Parameter| matches!(p.slot, Slot::Nominal(other) if other.path == key.path);
            if let Some(place) = out.parameters.iter().position(same) {
                let value = out.values[place] + given_back - parameter.neutral;
                out.values[place] = value.clamp(parameter.min, parameter.max);
            }
        }
        out
    }

    /// Swaps values that are in the wrong order, such as the break-points of a dead zone: the model sorts them, so the
    /// fit may have exchanged their roles.
    pub(crate) fn put_in_order(&mut self) {
        for effect in self.effects.clone() {
            let Some(ordered) = effect.identification().ordered else { continue };
            let place = |index: usize| self.parameters.iter().position(|p| p.slot == Slot::Effect(effect, index));
            if let [Some(larger), Some(smaller)] = ordered.map(place)
                && self.values[larger] < self.values[smaller]
            {
                self.values.swap(larger, smaller);
            }
        }
    }

    /// Values that must be in order and are not become equal: a step has gone across the point where they meet.
    pub(crate) fn meet_in_order(&self, values: &mut [f64]) {
        for [larger, smaller] in self.ordered_places() {
            if values[larger] < values[smaller] {
                let mean = 0.5 * (values[larger] + values[smaller]);
                (values[larger], values[smaller]) = (mean, mean);
            }
        }
    }

    /// Whether values that act on some channels are where they were before, as far as smooth derivatives there show: within [`NEAR`].
    pub(crate) fn is_near(&self, values: &[f64], before: &[f64], channels: Channels) -> bool {
        let all = self.parameters.iter().zip(values.iter().zip(before));
        all.filter(|(p, _)| p.channels & channels != 0).all(|(p, (now, before))| (now - before).abs() <= NEAR * p.scale)
    }

    /// The step of a parameter's difference quotient, `relative` to its scale, to the side where it does not leave its bounds. Few samples
    /// lie in a narrow rounding: its steps are no smaller than shows.
    pub(crate) fn step(&self, values: &[f64], index: usize, relative: f64) -> f64 {
        let parameter = &self.parameters[index];
        let relative = if parameter.slot == Slot::Rounding { relative.max(ROUNDING_STEP) } else { relative };
        let step = relative * parameter.scale;
        let passes = values[index] + step > parameter.max || self.open_side(values, index, step) < 0.0;
        if passes { -step } else { step }
    }

    /// The direction in which a parameter can move without passing one that it must stay above or below: 1, −1, or 0 where it
    /// is free within `step`.
    fn open_side(&self, values: &[f64], index: usize, step: f64) -> f64 {
        for [larger, smaller] in self.ordered_places() {
            if (index == larger || index == smaller) && values[larger] - values[smaller] < step.abs() {
                return if index == larger { 1.0 } else { -1.0 };
            }
        }
        0.0
    }

    /// The places of values of which the first must not be the smaller one.
    fn ordered_places(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.effects.iter().filter_map(|effect| {
            let place = |index: usize| self.parameters.iter().position(|p| p.slot == Slot::Effect(*effect, index));
            match effect.identification().ordered?.map(place) {
                [Some(larger), Some(smaller)] => Some([larger, smaller]),
                _ => None,
            }
        })
    }

    /// The same with all nominal values of strained channels back at nominal.
    pub(crate) fn relaxed(&self) -> Self {
        let strained = self.strained();
        let mut out = self.clone();
        for (parameter, value) in self.parameters.iter().zip(&mut out.values) {
            if parameter.tolerance.is_some() && parameter.channels & strained != 0 {
                *value = parameter.neutral;
            }
        }
        out
    }

    /// Channels on which strained nominal values act: corrected by more than `constants::strained` tolerances.
    pub(crate) fn strained(&self) -> Channels {
        let pairs = self.parameters.iter().zip(&self.values);
        let strained = pairs.filter(|(p, value)| is_strained(p, **value));
        strained.fold(0, |all, (p, _)| all | p.channels)
    }

    /// The value of one parameter; `None` if it is not fitted.
    pub(crate) fn value(&self, slot: Slot) -> Option<f64> {
        self.parameters.iter().position(|p| p.slot == slot).map(|place| self.values[place])
    }

    /// Values of one effect; zero for parameters left out.
    pub(crate) fn values_of(&self, effect: Effect) -> Vec<f64> {
        let mut out = vec![0.0; effect.parameter_count()];
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            match parameter.slot {
                Slot::Effect(e, index) if e == effect => out[index] = *value,
                _ => {}
            }
        }
        out
    }

    /// The same with only some parameters of an effect; the others stay zero, where they must be neutral.
    pub(crate) fn only(&self, effect: Effect, kept: &[usize]) -> Self {
        let mut out = Self { effects: self.effects.clone(), ..Self::default() };
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            if !matches!(parameter.slot, Slot::Effect(e, index) if e == effect && !kept.contains(&index)) {
                out.parameters.push(*parameter);
                out.values.push(*value);
            }
        }
        out
    }

    /// The rig file the parameter vector describes: nominal values corrected, effects added to those it had.
    pub(crate) fn rig(&self, base: &RigFile, values: &[f64]) -> RigFile {
        let mut out = base.clone();
        let mut slots: Vec<(Effect, [f64; 4])> = Vec::new();
        for (parameter, value) in self.parameters.iter().zip(values) {
            let (effect, index, rest) = match parameter.slot {
                Slot::Term(_) | Slot::SupplySensor => continue,
                Slot::Nominal(key) => {
                    key.set(&mut out.rig, *value);
                    continue;
                }
                Slot::Rounding => {
                    out.rig.valve.corner_rounding_v = parameter.slot.as_stated(*value);
                    continue;
                }
                Slot::Opening(point) => {
                    out.rig.opening.set_opening(point, *value);
                    continue;
                }
                Slot::Effect(effect, index) => (effect, index, None),
                Slot::Stated(effect, index) => (effect, index, base.effects.get(effect)),
            };
            let place = slots.iter().position(|(e, _)| *e == effect).unwrap_or_else(|| {
                let mut slot = [0.0; 4];
                slot.iter_mut().zip(rest.unwrap_or_default()).for_each(|(to, from)| *to = *from);
                slots.push((effect, slot));
                slots.len() - 1
            });
            slots[place].1[index] = *value;
        }
        // A diameter is corrected as far as a hose throttles: its volume is as the rig file says, counted to the chamber.
        let (stated, hoses, cylinder) = (&base.rig.hoses, &out.rig.hoses, &mut out.rig.cylinder);
        let lost_m3 = |stated_m: f64, corrected_m: f64, length_m: f64| {
            hose::volume_m3(length_m, stated_m) - hose::volume_m3(length_m, corrected_m)
        };
        cylinder.volume_a0_m3 += lost_m3(stated.a_diameter_m, hoses.a_diameter_m, hoses.a_length_m);
        cylinder.volume_b0_m3 += lost_m3(stated.b_diameter_m, hoses.b_diameter_m, hoses.b_length_m);
        // Two nominal values that are corrected separately must stay in order.
        let valve = &mut out.rig.valve;
        valve.dead_zone_left_v = valve.dead_zone_left_v.min(valve.dead_zone_right_v);
        let friction = &mut out.rig.friction;
        friction.static_n = friction.static_n.max(friction.coulomb_n);
        // So it is where an effect lowers the level of friction: else it would allow what the level as a nominal value does not, and take
        // the place of one that is off within its tolerance.
        let lowered =
            slots.iter().find(|(effect, _)| *effect == Effect::CoulombFriction).map_or(1.0, |(_, [scale, ..])| *scale);
        let level_n = lowered.min(1.0) * friction.coulomb_n;
        friction.breakaway_m = friction.breakaway_m.min(0.95 * level_n / friction.stiffness_n_per_m);
        let mut effects: Effects<f64> = out.effects;
        for (effect, slot) in &slots {
            effects.set(*effect, &slot[..effect.parameter_count()]);
        }
        out.effects = effects;
        out
    }

    /// The model of the parameter vector; `None` where its values contradict each other.
    pub(crate) fn plant(&self, base: &RigFile, values: &[f64]) -> Option<Plant<f64>> {
        let rig = self.rig(base, values);
        Plant::new(&rig.rig, &rig.effects).ok()
    }
}

/// Whether a nominal value is corrected by more than [`constants::strained`] tolerances.
fn is_strained(parameter: &Parameter, value: f64) -> bool {
    parameter.tolerances_off(value).is_some_and(|off| off.abs() > constants::strained())
}

/// Whether a parameter corrects the value of one side of the rig that an effect changes on both.
fn is_side_of(parameter: &Parameter, stands_for: &StandsFor) -> bool {
    matches!(parameter.slot, Slot::Nominal(key)
        if matches!(stands_for, StandsFor::FactorOn(_))
            && key.both_sides().is_some_and(|both| stands_for.parameter_of(both.path).is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::quality::Quality;
    use crate::model::effects::effect_parameters;

    #[test]
    fn bristles_break_away_no_later_for_an_effect_on_friction_s_level_than_for_that_level() {
        let file = RigFile::paper_a();
        let f = file.rig.friction;
        let breakaway_m = |scale: f64| {
            let parameters = effect_parameters(&file, Effect::CoulombFriction, 0b0100, &Quality::default());
            let h = Hypothesis { effects: vec![Effect::CoulombFriction], parameters, values: vec![scale] };
            h.rig(&file, &h.values).rig.friction.breakaway_m
        };
        assert_eq!([1.0, 1.5].map(breakaway_m), [f.breakaway_m; 2]);
        assert!((breakaway_m(0.5) - 0.95 * 0.5 * f.coulomb_n / f.stiffness_n_per_m).abs() < 1.0e-12);
    }

    #[test]
    fn break_points_that_a_step_takes_past_each_other_meet_and_part_only_to_their_own_sides() {
        let parameters = effect_parameters(&RigFile::paper_a(), Effect::ValveDeadZone, 0b0011, &Quality::default());
        let h = Hypothesis { effects: vec![Effect::ValveDeadZone], parameters, values: vec![0.1, 0.1] };
        let mut crossed = vec![0.1, 0.3];
        h.meet_in_order(&mut crossed);
        assert_eq!(crossed, [0.2, 0.2]);
        let mut apart = vec![0.3, 0.1];
        h.meet_in_order(&mut apart);
        assert_eq!(apart, [0.3, 0.1]);
        assert_eq!([0, 1].map(|index| h.open_side(&h.values, index, 0.01)), [1.0, -1.0]);
        assert_eq!([0, 1].map(|index| h.open_side(&apart, index, 0.01)), [0.0, 0.0]);
    }

    #[test]
    fn a_position_scale_takes_the_conductances_of_both_sides_with_it() {
        let rig = RigFile::read(std::path::Path::new("../rigs/festo-dgc-25-500.toml")).expect("a shipped rig");
        let nominal = crate::model::nominal::nominal_parameters(&rig, 0b0111, true, &[-5.0, 5.0]);
        let effect = Effect::PositionScale;
        let parameters = effect_parameters(&rig, effect, 0b0111, &Quality::default());
        let with = Hypothesis::null(&nominal).with(effect, parameters, &[1.01], false);
        let sides = ["a", "b"].map(|side| format!("valve.fill_conductance_{side}_m3_per_s_pa"));
        for side in sides {
            let of = |(p, _): &(&Parameter, &f64)| p.slot.stated_key() == Some(&side);
            let (p, value) = with.parameters.iter().zip(&with.values).find(of).expect("corrected");
            assert!((value * 1.01 / p.neutral - 1.0).abs() < 1e-9, "{side}: {value} {}", p.neutral);
        }
    }

    #[test]
    fn a_factor_on_both_sides_begins_with_what_they_have_in_common_and_gives_it_back() {
        let rig = RigFile::read(std::path::Path::new("../rigs/festo-dgc-25-500.toml")).expect("a shipped rig");
        let nominal = crate::model::nominal::nominal_parameters(&rig, 0b0011, true, &[-5.0, 5.0]);
        let sides = ["a", "b"].map(|side| format!("valve.exhaust_conductance_{side}_m3_per_s_pa"));
        let is = |p: &Parameter, path: &str| p.slot.stated_key() == Some(path);
        let mut strained = Hypothesis::null(&nominal);
        let places = sides.map(|path| nominal.iter().position(|p| is(p, &path)).expect("corrected"));
        for (place, factor) in places.into_iter().zip([0.8, 0.9]) {
            strained.values[place] = factor * nominal[place].neutral;
        }
        let factors = |h: &Hypothesis| {
            places.map(|place| {
                let of = |p: &Parameter| p.slot == nominal[place].slot;
                let found = h.parameters.iter().position(of).expect("kept");
                h.values[found] / nominal[place].neutral
            })
        };
        let effect = Effect::ExhaustCoefficient;
        let parameters = effect_parameters(&rig, effect, 0b0011, &Quality::default());
        let with = strained.with(effect, parameters, &[0.8], false);
        let common = (0.8_f64 * 0.9).sqrt();
        assert!((with.values_of(effect)[0] - common).abs() < 1e-12);
        for (found, factor) in factors(&with).into_iter().zip([0.8, 0.9]) {
            assert!((found - factor / common).abs() < 1e-12, "{found}");
        }
        for (found, factor) in factors(&with.without(effect, &nominal)).into_iter().zip([0.8, 0.9]) {
            assert!((found - factor).abs() < 1e-12, "{found}");
        }
    }
}
