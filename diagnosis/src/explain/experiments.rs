//! What to record next.

use crate::data::channel::Channel;
use crate::estimate::problem::Problem;
use crate::explain::residuals::Quantity;
use crate::outcome::{Balance, Cause};
use plant_model::Effect;
use rig_files::Verdict;

/// Whether an open balance of the air depends on the valve's command more than on anything else.
fn follows_the_command(balance: &Balance) -> bool {
    let most = balance.depends_on.iter().max_by(|a, b| a.extended.total_cmp(&b.extended));
    let air = [Channel::PressureA, Channel::PressureB].contains(&balance.channel);
    air && !balance.closed && most.is_some_and(|most| most.quantity == Quantity::Command.id())
}

/// The recording that would separate the ties, or show what this log cannot.
pub(crate) fn next_experiment(
    verdict: Verdict,
    (causes, balances): (&[Cause], &[Balance]),
    problem: &Problem<'_>,
) -> Option<String> {
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
    let unexplained = matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained);
    if unexplained && !problem.rig.rig.opening.is_empty() && balances.iter().any(follows_the_command) {
        out.push(
            "What is left of the air balances follows the command: measure the valve's opening in finer steps where the valve \
             works, above all where it begins to open. Between the points of `valve.opening` its curve is a guess, straight or smooth."
                .into(),
        );
    }
    if unexplained {
        out.push(
            "Record the sequence of `plant-sim experiment`, twice: what repeats is physics the catalogue lacks, what does \
             not is wear, drift or disturbance."
                .into(),
        );
    }
    out.dedup();
    (!out.is_empty()).then(|| out.join(" "))
}
