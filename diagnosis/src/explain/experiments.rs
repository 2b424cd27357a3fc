//! What to record next.

use crate::data::channel::Channel;
use crate::estimate::problem::Problem;
use crate::outcome::Cause;
use plant_model::Effect;
use rig_files::Verdict;

/// The recording that would separate the ties, or show what this log cannot.
pub(crate) fn next_experiment(verdict: Verdict, causes: &[Cause], problem: &Problem<'_>) -> Option<String> {
    let mut out: Vec<String> = Vec::new();
    for cause in causes {
        for tie in &cause.ties {
            if let (Some(one), Some(other)) = (Effect::from_id(&cause.id), Effect::from_id(tie)) {
                out.push(format!("To tell {one} from {other}: {}", one.experiment_against(other)));
            }
        }
    }
    let has = &problem.record.available;
    if has.pressure_a && has.pressure_b && problem.judgeable & Channel::Position.bit() == 0 {
        out.push(
            "The piston hardly moves: record strokes, best the sequence of `plant-sim experiment`, and mechanics and \
             friction can be judged."
                .into(),
        );
    }
    if !(has.command && has.pressure_a && has.pressure_b) {
        out.push("Record the valve command and both chamber pressures: only then can every balance be judged.".into());
    }
    if matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained) {
        out.push(
            "Record the sequence of `plant-sim experiment`, twice: what repeats is physics the catalogue lacks, what does \
             not is wear, drift or disturbance."
                .into(),
        );
    }
    out.dedup();
    (!out.is_empty()).then(|| out.join(" "))
}
