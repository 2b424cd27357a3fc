//! Figure 13: three cylinders positioned by a proportional controller.

use super::{Claim, Figure};
use crate::charts;
use crate::closed_loop::LoopSettings;
use crate::controller::papers_parameters;
use crate::metrics::StepObserver;
use crate::recording::Recording;
use crate::sensors::ConversionNoise;
use rig_files::RigFile;

const TARGET_M: f64 = 0.045;
const DURATION_S: f64 = 20.0;

pub(super) fn three_cylinders() -> Figure {
    let settings = LoopSettings { noise: ConversionNoise::NONE, ..LoopSettings::default() };
    let rigs = [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()];
    let runs: Vec<Recording> = rigs
        .iter()
        .map(|rig| {
            let ticks = (DURATION_S * f64::from(rig.io.tick_hz)) as usize;
            Recording::run(rig, &papers_parameters(rig), &settings, ticks, |_| TARGET_M).unwrap_or_default()
        })
        .collect();
    let [a, b, c] = [0, 1, 2].map(|at| runs[at].step_metrics(TARGET_M));
    let rise = |s: Option<f64>| s.unwrap_or(f64::NAN);
    let apart = runs[1].y_m.iter().zip(&runs[2].y_m).map(|(b, c)| (b - c).abs()).fold(0.0, f64::max);
    let apart_rms = {
        let count = runs[1].y_m.len().min(5000) as f64;
        let sum: f64 = runs[1].y_m.iter().zip(&runs[2].y_m).take(5000).map(|(b, c)| (b - c).powi(2)).sum();
        (sum / count).sqrt()
    };
    let oscillation = {
        let mut observer = StepObserver::new(0.0, TARGET_M, 5.0);
        for (t_s, y_m) in runs[0].t_s.iter().zip(&runs[0].y_m).take(5000) {
            observer.see(*t_s, *y_m);
        }
        observer.metrics().crossings
    };
    let named: Vec<(&str, &Recording)> = ["case (a)", "case (b)", "case (c)"].into_iter().zip(&runs).collect();
    let mut picture = charts::positions(&named, TARGET_M).x_range(0.0, 6.0);
    picture.title = "Fig. 13: positioning step to 45 mm, K_p = 4 V/m".into();
    let mut tail = charts::errors(&named, TARGET_M, 6.0);
    tail.title = "Fig. 13 continued: the error after 6 s".into();
    Figure {
        number: 13,
        title: "Positioning with three cylinders",
        setting: "The firmware's fixed-point law at 1 kHz, 16-bit position, 12-bit valve voltage, no noise, one tick of output delay. The paper does not give K_p; its statements hold together only for about 2 to 6 V/m. Both chambers start at p*.",
        plots: vec![picture, tail],
        claims: vec![
            Claim::new(
                "case (a) has the faster response",
                rise(a.rise_s) < 0.5 * rise(b.rise_s).min(rise(c.rise_s)),
                format!("rise {:.3} s, (b) {:.3} s, (c) {:.3} s", rise(a.rise_s), rise(b.rise_s), rise(c.rise_s)),
            ),
            Claim::new(
                "case (a) overshoots and oscillates",
                a.overshoot > 0.1 && oscillation >= 4,
                format!("overshoot {:.0} %, {oscillation} crossings of the target in 5 s", 100.0 * a.overshoot),
            ),
            Claim::in_part(
                "case (a) hunts around the target: oscillations caused by limit cycles",
                a.crossings > oscillation && a.hunting_m > 1e-4,
                format!(
                    "it hunts: {} crossings in {DURATION_S} s, still ±{:.2} mm in the last third; but the stick-slip slowly \
                     decays, which a limit cycle does not",
                    a.crossings,
                    1e3 * a.hunting_m
                ),
            ),
            Claim::in_part(
                "case (b) does not overshoot",
                b.overshoot < 1e-3,
                format!(
                    "it creeps past the target by {:.3} mm, {:.2} % of the step: nothing that the figure could show, but not \
                     nothing",
                    1e3 * b.overshoot * TARGET_M,
                    100.0 * b.overshoot
                ),
            ),
            Claim::new(
                "case (c) behaves like (b): chamber volume matters little here",
                apart_rms < 0.05 * TARGET_M,
                format!("{:.2} mm rms apart over 5 s, at most {:.2} mm", 1e3 * apart_rms, 1e3 * apart),
            ),
        ],
    }
}
