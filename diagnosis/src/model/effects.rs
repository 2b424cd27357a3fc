//! The effects of the catalogue as hypotheses on this rig: channels, parameters, prior. What is known of each effect is
//! in its own file in `plant-model`.

use super::parameter::{Parameter, Slot};
use crate::data::channel::Channels;
use crate::data::quality::Quality;
use plant_model::Effect;
use plant_model::effects::identification::LogQuality;
use rig_files::RigFile;

/// The channels an effect acts on, in the single-balance predictions.
pub(crate) fn channels(effect: Effect) -> Channels {
    effect.identification().balances.bits()
}

/// Whether an effect changes nominal values together with its own (a position scale does): then their initial values
/// follow from its value.
pub(crate) fn moves_nominal_values(effect: Effect) -> bool {
    !effect.identification().moves_in_step.is_empty()
}

/// Relative standard error that the value of an effect takes over from the nominal value it multiplies: only their
/// product shows.
pub(crate) fn inherited(effect: Effect, nominal: &[Parameter]) -> f64 {
    let keys = effect.identification().stands_for.inherits_tolerance_of();
    let multiplied = |p: &&Parameter| matches!(p.slot, Slot::Nominal(other) if keys.contains(&other.path));
    nominal.iter().find(multiplied).and_then(|p| Some(p.tolerance? / p.neutral.abs())).unwrap_or(0.0)
}

/// The parameters of an effect on this rig, for a log of this quality.
pub(crate) fn effect_parameters(
    rig: &RigFile,
    effect: Effect,
    judgeable: Channels,
    quality: &Quality,
) -> Vec<Parameter> {
    // A rig file may state an effect already; then that is where the hypothesis starts.
    let mut neutral = effect.neutral(&rig.rig);
    for (to, from) in neutral.iter_mut().zip(rig.effects.get(effect).unwrap_or_default()) {
        *to = *from;
    }
    let noise = quality.pressure_a.standard_deviation.hypot(quality.pressure_b.standard_deviation);
    let log = LogQuality { interval_s: quality.interval_s, force_noise_n: rig.rig.cylinder.mean_area_m2() * noise };
    let (least, most) = (effect.least(), effect.most(&rig.rig));
    let scales = effect.scales(&rig.rig, &neutral);
    let negligible = effect.negligible(&rig.rig, &neutral, &scales, &log);
    let all = 0..effect.parameter_count();
    all.map(|index| Parameter {
        slot: Slot::Effect(effect, index),
        neutral: neutral[index],
        scale: scales[index],
        negligible: negligible[index],
        tolerance: None,
        min: least[index].min(neutral[index]),
        max: most[index].max(neutral[index]),
        channels: channels(effect) & judgeable,
    })
    .collect()
}
