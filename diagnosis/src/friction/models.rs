//! Models of friction from poor to rich, each judged by its own parameters and on recordings that took no part in its fit.

use super::regression::{Finding, NOTHING, proportional, regress};
use super::ripple::{RippleLine, phase};
use super::sliding::{FrictionRun, Run, Sample, mean_growth_with_speed};
use serde::Serialize;
use std::fmt;

/// Where the middle speeds of nine tenths of the samples differ by less than this factor, a recording has one speed.
const SPEEDS_APART: f64 = 1.3;
/// Difference of the Bayesian information criterion below which the evidence is not strong (Kass and Raftery 1995).
const STRONG: f64 = 6.0;

/// What a force may be that keeps its sign when the motion reverses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OffCentre {
    /// The same at every pressure: a constant force or a zero error of the force sensor.
    ConstantForce,
    /// In proportion to the pressure across the piston: an area, or a gain of a sensor, other than stated.
    Area,
    /// In proportion to friction: friction that differs by direction.
    Direction,
    /// A part that is the same at every pressure and one in proportion to it.
    AreaAndForce,
}

impl OffCentre {
    const ALL: [Self; 4] = [Self::ConstantForce, Self::Area, Self::Direction, Self::AreaAndForce];

    const fn model(self) -> &'static str {
        match self {
            Self::ConstantForce => "+ a constant force",
            Self::Area => "+ an area other than nominal",
            Self::Direction => "+ friction that differs by direction",
            Self::AreaAndForce => "+ an area other than nominal and a constant force",
        }
    }
}

impl fmt::Display for OffCentre {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ConstantForce => "a constant force, or a zero error of the force sensor",
            Self::Area => "an area, or a gain of the force or pressure sensor, other than stated",
            Self::Direction => "friction that differs by direction",
            Self::AreaAndForce => "an area other than stated together with a constant force",
        })
    }
}

/// Error of one model on the runs left out of its fit.
#[derive(Clone, Debug, Serialize)]
pub struct Stage {
    /// What the model contains beyond the one it is compared with, in words.
    pub model: &'static str,
    /// Root-mean-square error, N, over all runs, each predicted from the others.
    pub holdout_rmse_n: f64,
    /// Part of the error of the model before, as far as kept, that this one takes away; none for the first.
    pub gain: Option<f64>,
    /// Whether its parameters exceed the scatter between the recordings, at the 1 % level.
    pub established: bool,
    /// Whether it is kept: established, better on recordings left out, and the likeliest of its kind.
    pub kept: bool,
    /// Whether it would be kept but for another of its kind that is likelier, though not by much.
    pub tied: bool,
}

/// What a model contains.
#[derive(Clone, Copy, Default)]
struct Contents {
    pressure: bool,
    speed: bool,
    off_centre: Option<OffCentre>,
    ripple: bool,
}

/// The figures of the recordings, column by column.
struct Figures {
    pressure: Vec<f64>,
    difference: Vec<f64>,
    speed: Vec<f64>,
    friction: Vec<f64>,
    bias: Vec<f64>,
    inside: Finding,
    /// Whether the growth with speed is that inside the recordings.
    speed_inside: bool,
}

impl Figures {
    fn of(runs: &[FrictionRun]) -> Self {
        let column = |get: fn(&FrictionRun) -> f64| runs.iter().map(get).collect::<Vec<f64>>();
        Self {
            pressure: column(|r| r.pressure_pa),
            difference: column(|r| r.difference_pa),
            speed: column(|r| r.speed_m_per_s),
            friction: column(|r| r.friction_n),
            bias: column(|r| r.bias_n),
            inside: mean_growth_with_speed(runs),
            speed_inside: runs.iter().all(|run| run.speed_range_m_per_s[1] > SPEEDS_APART * run.speed_range_m_per_s[0]),
        }
    }

    /// Friction at no pressure and no speed, its growth with pressure and with speed, as far as the model has them.
    fn friction(&self, contents: Contents) -> [Finding; 3] {
        let at = |findings: &[Finding], k: usize| findings.get(k).copied().unwrap_or(NOTHING);
        let inside = contents.speed && self.speed_inside;
        // What grows inside the recordings is taken out before they are compared with each other.
        let friction: Vec<f64> = (self.friction.iter().zip(&self.speed))
            .map(|(friction, speed)| friction - if inside { self.inside.value * speed } else { 0.0 })
            .collect();
        let mut by: Vec<&[f64]> = Vec::new();
        if contents.pressure {
            by.push(&self.pressure);
        }
        if contents.speed && !inside {
            by.push(&self.speed);
        }
        let found = regress(&friction, &by);
        let pressure = if contents.pressure { at(&found, 1) } else { NOTHING };
        let speed = match (contents.speed, inside) {
            (false, _) => NOTHING,
            (true, true) => self.inside,
            (true, false) => at(&found, by.len()),
        };
        [at(&found, 0), pressure, speed]
    }

    /// Parameters of the force that keeps its sign, and the Bayesian information criterion.
    fn off_centre(&self, kind: OffCentre) -> (Vec<Finding>, f64) {
        let ones = vec![1.0; self.bias.len()];
        let columns: &[&[f64]] = match kind {
            OffCentre::ConstantForce => &[&ones],
            OffCentre::Area => &[&self.difference],
            OffCentre::Direction => &[&self.friction],
            OffCentre::AreaAndForce => &[&self.difference, &ones],
        };
        let (found, squares) = proportional(&self.bias, columns);
        let n = self.bias.len() as f64;
        (found, n * (squares / n).max(1e-12).ln() + columns.len() as f64 * n.ln())
    }
}

/// One model with its parameters.
struct Fitted {
    f0: f64,
    per_pa: f64,
    per_speed: f64,
    /// Constant force, N; force per pressure difference, N/Pa; share of friction.
    off_centre: [f64; 3],
}

impl Fitted {
    fn new(contents: Contents, runs: &[FrictionRun]) -> Self {
        let figures = Figures::of(runs);
        let [f0, per_pa, per_speed] = figures.friction(contents).map(|finding| finding.value);
        let off_centre = contents.off_centre.map_or([0.0; 3], |kind| {
            let (found, _) = figures.off_centre(kind);
            let value = |k: usize| found.get(k).map_or(0.0, |finding| finding.value);
            match kind {
                OffCentre::ConstantForce => [value(0), 0.0, 0.0],
                OffCentre::Area => [0.0, value(0), 0.0],
                OffCentre::Direction => [0.0, 0.0, value(0)],
                OffCentre::AreaAndForce => [value(1), value(0), 0.0],
            }
        });
        Self { f0, per_pa, per_speed, off_centre }
    }

    fn force(&self, s: &Sample) -> f64 {
        let friction = self.f0 + self.per_pa * s.sum_pa + self.per_speed * s.speed;
        let [constant, per_pa, share] = self.off_centre;
        s.direction * friction + constant + per_pa * s.difference_pa + share * friction
    }
}

/// Root-mean-square error of a model in N, each recording predicted from the others. The phase of a ripple depends on the
/// recording's zero: its first half gives it, the second half is predicted.
fn error_on_runs_left_out(runs: &[Run], contents: Contents, line: Option<&RippleLine>) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for (out, run) in runs.iter().enumerate() {
        let others: Vec<FrictionRun> =
            runs.iter().enumerate().filter(|(k, _)| *k != out).map(|(_, run)| run.summary.clone()).collect();
        let fitted = Fitted::new(contents, &others);
        let line = line.filter(|_| contents.ripple);
        let early: Vec<&Sample> = run.samples.iter().filter(|s| !s.late).collect();
        let (a, b) = line.map_or((0.0, 0.0), |line| phase(&early, line.wavelength_m, line.turns_with_motion));
        for s in run.samples.iter().filter(|s| s.late) {
            let ripple = line.map_or(0.0, |line| {
                let (sin, cos) = (core::f64::consts::TAU / line.wavelength_m * s.y).sin_cos();
                (a * sin + b * cos) * if line.turns_with_motion { s.direction } else { 1.0 }
            });
            square += (s.r - fitted.force(s) - ripple).powi(2);
            count += 1.0;
        }
    }
    (square / f64::max(count, 1.0)).sqrt()
}

/// The dependences found, and how.
pub(super) struct Models {
    pub(super) friction_n: Finding,
    pub(super) pressure_n_per_pa: Finding,
    pub(super) speed_n_s_per_m: Finding,
    pub(super) speed_inside_recordings: bool,
    pub(super) bias_n: Finding,
    pub(super) area_error: Finding,
    pub(super) asymmetry: Finding,
    pub(super) off_centre: Option<OffCentre>,
    pub(super) off_centre_ties: Vec<OffCentre>,
    pub(super) stages: Vec<Stage>,
}

impl Models {
    pub(super) fn new(runs: &[Run], area_m2: f64, line: Option<&RippleLine>) -> Self {
        let summaries: Vec<FrictionRun> = runs.iter().map(|run| run.summary.clone()).collect();
        let figures = Figures::of(&summaries);
        let mut contents = Contents::default();
        let mut error = error_on_runs_left_out(runs, contents, line);
        let mut stages = vec![Stage {
            model: "constant friction",
            holdout_rmse_n: error,
            gain: None,
            established: true,
            kept: true,
            tied: false,
        }];
        // A recording left out needs two others that show their scatter.
        let enough = runs.len() > 2;
        let mut tried = |model, richer: Contents, before: f64, established: bool| {
            let after = error_on_runs_left_out(runs, richer, line);
            let kept = enough && established && after < before;
            let gain = Some(1.0 - after / before.max(1e-12));
            stages.push(Stage { model, holdout_rmse_n: after, gain, established, kept, tied: false });
            (after, kept)
        };

        let with_pressure = Contents { pressure: true, ..contents };
        let mut pressure = figures.friction(with_pressure)[1];
        let (after, kept) = tried("+ growing with pressure", with_pressure, error, pressure.established);
        pressure.established = kept;
        if kept {
            (contents, error) = (with_pressure, after);
        }

        // Whether or not friction grows with pressure: the speeds of recordings may follow their pressures.
        let mut speed = figures.friction(Contents { pressure: true, speed: true, ..contents })[2];
        let with_speed = Contents { speed: true, ..contents };
        let (after, kept) = tried("+ growing with speed", with_speed, error, speed.established);
        speed.established = kept;
        if kept {
            (contents, error) = (with_speed, after);
        }

        let mut possible: Vec<(OffCentre, f64, f64)> = Vec::new();
        for kind in OffCentre::ALL {
            let (found, criterion) = figures.off_centre(kind);
            let established = found.iter().all(|finding| finding.established);
            let richer = Contents { off_centre: Some(kind), ..contents };
            let (after, kept) = tried(kind.model(), richer, error, established);
            if kept {
                possible.push((kind, criterion, after));
            }
        }
        possible.sort_by(|a, b| a.1.total_cmp(&b.1));
        let likeliest = possible.first().copied();
        let ties: Vec<OffCentre> = possible
            .iter()
            .skip(1)
            .filter(|(_, criterion, _)| likeliest.is_some_and(|(_, least, _)| criterion - least < STRONG))
            .map(|(kind, _, _)| *kind)
            .collect();
        let off_centre = likeliest.map(|(kind, _, _)| kind);
        if let Some((kind, _, after)) = likeliest {
            contents.off_centre = Some(kind);
            error = after;
        }
        if let Some(line) = line {
            tried("+ ripple along the stroke", Contents { ripple: true, ..contents }, error, line.holds(runs.len()));
        }
        for stage in &mut stages {
            // What a ripple gains is small beside the scatter between recordings: it is judged along the stroke.
            if stage.model.contains("ripple") {
                stage.kept = stage.established;
            }
            if let Some(kind) = OffCentre::ALL.into_iter().find(|kind| kind.model() == stage.model) {
                stage.kept = off_centre == Some(kind);
                stage.tied = ties.contains(&kind);
            }
        }

        // Of the likeliest model that has the parameter; else as the only one, to show how large it may be.
        let parameter = |kinds: [(OffCentre, usize); 2]| {
            let found = |(kind, k): (OffCentre, usize)| figures.off_centre(kind).0.get(k).copied().unwrap_or(NOTHING);
            let stands = |kind: &OffCentre| off_centre == Some(*kind) || ties.contains(kind);
            let shown = kinds.into_iter().find(|(kind, _)| off_centre == Some(*kind));
            let shown = shown.or(kinds.into_iter().find(|(kind, _)| stands(kind)));
            Finding { established: shown.is_some(), ..found(shown.unwrap_or(kinds[0])) }
        };
        let bias_n = parameter([(OffCentre::ConstantForce, 0), (OffCentre::AreaAndForce, 1)]);
        let per_pa = parameter([(OffCentre::Area, 0), (OffCentre::AreaAndForce, 0)]);
        let asymmetry = parameter([(OffCentre::Direction, 0); 2]);
        Self {
            friction_n: figures.friction(contents)[0],
            pressure_n_per_pa: pressure,
            speed_n_s_per_m: speed,
            speed_inside_recordings: figures.speed_inside,
            bias_n,
            area_error: Finding {
                value: -per_pa.value / area_m2,
                std_error: per_pa.std_error / area_m2,
                established: per_pa.established,
            },
            asymmetry,
            off_centre,
            off_centre_ties: ties,
            stages,
        }
    }
}
