//! A hypothesis: a set of effects on top of nominal values that are known within their tolerance.

use super::effects::{channels, twins};
use super::parameter::{Parameter, Slot};
use crate::constants;
use crate::data::channel::Channels;
use plant_model::{Effect, Effects, Plant};
use rig_files::RigFile;

/// The parameter vector of a set of effects with its values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hypothesis {
    pub(crate) effects: Vec<Effect>,
    pub(crate) parameters: Vec<Parameter>,
    pub(crate) values: Vec<f64>,
}

impl Hypothesis {
    /// No effects: nominal values only.
    pub(crate) fn null(nominal: &[Parameter]) -> Self {
        Self { effects: Vec::new(), parameters: nominal.to_vec(), values: nominal.iter().map(|p| p.neutral).collect() }
    }

    /// The same with one more effect beside everything there is already.
    pub(crate) fn extended_by(&self, effect: Effect, parameters: Vec<Parameter>, start: &[f64]) -> Self {
        let mut out = self.clone();
        out.effects.push(effect);
        out.take_along(effect, &parameters, start);
        out.parameters.extend(parameters);
        out.values.extend(start);
        out
    }

    /// Moves what has to move with an effect that is about to be added at some values.
    fn take_along(&mut self, effect: Effect, parameters: &[Parameter], start: &[f64]) {
        if let (Effect::PositionScale, Some(parameter), Some(scale)) = (effect, parameters.first(), start.first()) {
            self.scale_lengths(scale / parameter.neutral);
        }
    }

    /// The same with one more term outside the catalogue, at no strength.
    pub(crate) fn with_term(&self, index: usize, channels: Channels) -> Self {
        let mut out = self.clone();
        out.parameters.push(Parameter {
            slot: Slot::Term(index),
            neutral: 0.0,
            scale: constants::term_scale(),
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

    /// The same with one more effect at the given values.
    ///
    /// An effect that changes what a nominal value already stands for takes over its correction: the value returns to
    /// nominal, and with a single twin it is fitted no more, because its tolerance then only pulls it there.
    ///
    /// Nominal values far beyond their tolerance, which stood in for what is missing, start `anew` or stay where they are.
    pub(crate) fn with(&self, effect: Effect, parameters: Vec<Parameter>, start: &[f64], anew: bool) -> Self {
        let mut out = Self { effects: self.effects.clone(), ..Self::default() };
        out.effects.push(effect);
        let twins = twins(effect);
        let mut start = start.to_vec();
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            let twin = match parameter.slot {
                Slot::Nominal(key) => twins.contains(&key.path),
                Slot::Effect(..) | Slot::Term(_) => false,
            };
            if twin {
                match effect {
                    Effect::FillCoefficient | Effect::ExhaustCoefficient | Effect::CoulombFriction => {
                        start[0] *= value / parameter.neutral;
                    }
                    Effect::DeadVolume => start[0] = (start[0] + 0.5 * (value - parameter.neutral)).max(0.0),
                    _ => start[0] += value - parameter.neutral,
                }
            }
            if !twin || twins.len() > 1 {
                let strained = anew
                    && parameter
                        .tolerance
                        .is_some_and(|t| (value - parameter.neutral).abs() > constants::strained() * t)
                    && parameter.channels & channels(effect) != 0;
                out.parameters.push(*parameter);
                out.values.push(if twin || strained { parameter.neutral } else { *value });
            }
        }
        if effect == Effect::CoulombFriction {
            let neutral = parameters.first().map_or(1.0, |p| p.neutral);
            out.scale_breakaway(neutral / start.first().copied().unwrap_or(neutral));
        }
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

    /// Takes a position that reads `factor` times too long out of the values fitted to it. Air and mass do not tell it from
    /// larger volumes and flows and a smaller mass; only tolerances and the end stops do. A fit would have to change all of
    /// them in step.
    fn scale_lengths(&mut self, factor: f64) {
        for (parameter, value) in self.parameters.iter().zip(&mut self.values) {
            let by = match parameter.slot {
                Slot::Nominal(key) => match key.path {
                    "valve.fill_coefficient_kg_per_s_pa"
                    | "valve.exhaust_coefficient_kg_per_s_pa"
                    | "cylinder.volume_a0_m3"
                    | "cylinder.volume_b0_m3" => 1.0 / factor,
                    "load.mass_kg" | "friction.viscous_n_s_per_m" => factor,
                    _ => 1.0,
                },
                Slot::Effect(effect, index) => match (effect, index) {
                    (
                        Effect::FillCoefficient
                        | Effect::ExhaustCoefficient
                        | Effect::LeakChamberA
                        | Effect::LeakChamberB
                        | Effect::LeakCrossPiston
                        | Effect::DeadVolume,
                        _,
                    )
                    | (Effect::FrictionPosition, 2) => 1.0 / factor,
                    (Effect::PayloadMass | Effect::ViscousFriction, _) | (Effect::SupplyDroop, 0) => factor,
                    _ => 1.0,
                },
                Slot::Term(_) => 1.0,
            };
            *value = (*value * by).clamp(parameter.min, parameter.max);
        }
    }

    /// Multiplies the nominal breakaway force, which a friction level carries with it, as far as its bounds allow.
    fn scale_breakaway(&mut self, factor: f64) {
        for (parameter, value) in self.parameters.iter().zip(&mut self.values) {
            if matches!(parameter.slot, Slot::Nominal(key) if key.path == "friction.static_n") {
                *value = (*value * factor).clamp(parameter.min, parameter.max);
            }
        }
    }

    /// The same without one effect; nominal values it stood in for are corrected again.
    pub(crate) fn without(&self, effect: Effect, nominal: &[Parameter]) -> Self {
        let mut out =
            Self { effects: self.effects.iter().copied().filter(|e| *e != effect).collect(), ..Self::default() };
        for (parameter, value) in self.parameters.iter().zip(&self.values) {
            if !matches!(parameter.slot, Slot::Effect(e, _) if e == effect) {
                out.parameters.push(*parameter);
                out.values.push(*value);
            }
        }
        let removed = self.values_of(effect).first().copied();
        let neutral = self.parameters.iter().find(|p| p.slot == Slot::Effect(effect, 0)).map(|p| p.neutral);
        if let (Effect::CoulombFriction, Some(scale)) = (effect, removed) {
            out.scale_breakaway(scale);
        }
        if let (Effect::PositionScale, Some(scale), Some(neutral)) = (effect, removed, neutral) {
            out.scale_lengths(neutral / scale);
        }
        for parameter in nominal {
            let Slot::Nominal(key) = parameter.slot else { continue };
            let (true, Some(removed)) = (twins(effect).contains(&key.path), removed) else { continue };
            let given_back = match effect {
                Effect::FillCoefficient | Effect::ExhaustCoefficient | Effect::CoulombFriction => {
                    parameter.neutral * removed
                }
                Effect::DeadVolume => parameter.neutral + removed,
                _ => removed,
            };
            if twins(effect).len() == 1 {
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

    /// The model takes the larger break-point of a dead zone as the right one; so do the values.
    pub(crate) fn put_in_order(&mut self) {
        let place = |wanted: usize| {
            self.parameters
                .iter()
                .position(|p| matches!(p.slot, Slot::Effect(Effect::ValveDeadZone, index) if index == wanted))
        };
        if let (Some(right), Some(left)) = (place(0), place(1))
            && self.values[right] < self.values[left]
        {
            self.values.swap(right, left);
        }
    }

    /// The same with the nominal values of strained channels back where they should be.
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

    /// Channels in which nominal values are strained.
    pub(crate) fn strained(&self) -> Channels {
        let pairs = self.parameters.iter().zip(&self.values);
        let strained =
            pairs.filter(|(p, v)| p.tolerance.is_some_and(|t| (**v - p.neutral).abs() > constants::strained() * t));
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
            match parameter.slot {
                Slot::Term(_) => {}
                Slot::Nominal(key) => key.set(&mut out.rig, *value),
                Slot::Effect(effect, index) => match slots.iter_mut().find(|(e, _)| *e == effect) {
                    Some((_, slot)) => slot[index] = *value,
                    None => {
                        let mut slot = [0.0; 4];
                        slot[index] = *value;
                        slots.push((effect, slot));
                    }
                },
            }
        }
        // Two nominal values that are corrected separately must stay in order.
        let friction = &mut out.rig.friction;
        friction.static_n = friction.static_n.max(friction.coulomb_n);
        friction.breakaway_m = friction.breakaway_m.min(0.95 * friction.coulomb_n / friction.stiffness_n_per_m);
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
