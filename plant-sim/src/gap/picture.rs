//! The picture of the evidence: what a balance misses, against the quantity that betrays the cause.

use crate::charts::{BAR, MM};
use diagnosis::{CHAMBER_MEMORY_S, Diagnosis, Evidence};
use plant_model::Effect;
use report_html::{Marker, Plot, Series};
use rig_files::RigFile;

/// Half the window over which rates are taken, s.
const RATE_WINDOW_S: f64 = 0.02;
/// Points of a picture: each is the mean over as many samples as any other.
const BINS: usize = 24;
/// Fewer samples than this are no picture.
const LEAST_SAMPLES: usize = 240;
/// The extremes at either end that are left out.
const TRIMMED: f64 = 0.004;

const CHANNELS: [&str; 4] = ["p_a_pa", "p_b_pa", "y_m", "p_sup_pa"];

/// What a balance misses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Deficit {
    PressureA,
    PressureB,
    Position,
    Supply,
}

impl Deficit {
    const ALL: [Self; 4] = [Self::PressureA, Self::PressureB, Self::Position, Self::Supply];

    fn label(self) -> &'static str {
        match self {
            Self::PressureA => "rise of p_a beyond the prediction, bar/s",
            Self::PressureB => "rise of p_b beyond the prediction, bar/s",
            Self::Position => "measured − predicted y, mm",
            Self::Supply => "measured − predicted p_sup, bar",
        }
    }

    fn balance(self) -> &'static str {
        match self {
            Self::PressureA => "Air balance of chamber A",
            Self::PressureB => "Air balance of chamber B",
            Self::Position => "Force balance of the piston",
            Self::Supply => "Air supply",
        }
    }
}

/// What it is drawn against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Against {
    Command,
    CommandRate,
    Position,
    Velocity,
    Acceleration,
    PressureA,
    PressureB,
    Difference,
    Sum,
    RateA,
    Time,
}

impl Against {
    const ALL: [Self; 11] = [
        Self::Command,
        Self::CommandRate,
        Self::Position,
        Self::Velocity,
        Self::Acceleration,
        Self::PressureA,
        Self::PressureB,
        Self::Difference,
        Self::Sum,
        Self::RateA,
        Self::Time,
    ];

    fn label(self) -> &'static str {
        match self {
            Self::Command => "valve command u, V",
            Self::CommandRate => "rate of the valve command, V/s",
            Self::Position => "position y, mm",
            Self::Velocity => "velocity, mm/s",
            Self::Acceleration => "acceleration, m/s²",
            Self::PressureA => "p_a above atmosphere, bar",
            Self::PressureB => "p_b above atmosphere, bar",
            Self::Difference => "p_a − p_b, bar",
            Self::Sum => "p_a + p_b above atmosphere, bar",
            Self::RateA => "rate of p_a, bar/s",
            Self::Time => "time, s",
        }
    }
}

/// Which samples count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Only {
    All,
    /// Inside the rig file's dead zone, or close to mid position.
    ValveClosed,
    /// Around the dead zone.
    SmallCommand,
    Filling,
    Exhausting,
    Sliding,
}

/// Two curves instead of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Split {
    No,
    /// Command rising or falling.
    Command,
    /// Motion towards B or towards A.
    Motion,
}

#[derive(Clone, Copy, Debug)]
struct View {
    deficit: Deficit,
    against: Against,
    only: Only,
    split: Split,
    note: &'static str,
}

impl View {
    const fn new(deficit: Deficit, against: Against, note: &'static str) -> Self {
        Self { deficit, against, only: Only::All, split: Split::No, note }
    }
    const fn only(mut self, only: Only) -> Self {
        self.only = only;
        self
    }
    const fn split(mut self, split: Split) -> Self {
        self.split = split;
        self
    }
}

/// The views that betray an effect.
fn views(effect: Effect) -> Vec<View> {
    use Against as X;
    use Deficit as D;
    use Effect as E;
    let both = |against, only, note| {
        vec![View::new(D::PressureA, against, note).only(only), View::new(D::PressureB, against, note).only(only)]
    };
    match effect {
        E::ValveDeadZone => both(
            X::Command,
            Only::SmallCommand,
            "A step beside zero is a dead zone that opens elsewhere than the rig file says.",
        ),
        E::ValveHysteresis => {
            let note = "Two separate curves, one for each direction of the command, are play in the valve.";
            vec![
                View::new(D::PressureA, X::Command, note).only(Only::SmallCommand).split(Split::Command),
                View::new(D::PressureB, X::Command, note).only(Only::SmallCommand).split(Split::Command),
            ]
        }
        E::ValveLag | E::LineDelay => {
            both(X::CommandRate, Only::All, "An error that follows the rate of the command is a valve that acts late.")
        }
        E::FillCoefficient => vec![
            View::new(D::PressureA, X::PressureA, "While A fills: an error that grows with the pressure drop.")
                .only(Only::Filling),
            View::new(D::PressureB, X::PressureB, "While B fills.").only(Only::Exhausting),
        ],
        E::ExhaustCoefficient => vec![
            View::new(D::PressureA, X::PressureA, "While A exhausts: an error that grows with its pressure.")
                .only(Only::Exhausting),
            View::new(D::PressureB, X::PressureB, "While B exhausts.").only(Only::Filling),
        ],
        E::ChokedFlow => {
            let note = "A bent curve: the flow is not proportional to the pressure drop.";
            vec![
                View::new(D::PressureA, X::PressureA, note).only(Only::Filling),
                View::new(D::PressureA, X::PressureA, note).only(Only::Exhausting),
            ]
        }
        E::SupplyDroop => vec![
            View::new(D::Supply, X::Command, "The supply gives way when the valve opens, to either side."),
            View::new(D::PressureA, X::Command, "Chambers fill less than they should at large commands."),
        ],
        E::LeakCrossPiston => both(
            X::Difference,
            Only::ValveClosed,
            "Valve closed: a line through zero is air that crosses the piston; A loses what B gains.",
        ),
        E::LeakChamberA => vec![
            View::new(D::PressureA, X::PressureA, "Valve closed: a line through zero is a leak to atmosphere.")
                .only(Only::ValveClosed),
            View::new(D::PressureB, X::PressureB, "Chamber B for comparison.").only(Only::ValveClosed),
        ],
        E::LeakChamberB => vec![
            View::new(D::PressureB, X::PressureB, "Valve closed: a line through zero is a leak to atmosphere.")
                .only(Only::ValveClosed),
            View::new(D::PressureA, X::PressureA, "Chamber A for comparison.").only(Only::ValveClosed),
        ],
        E::DeadVolume | E::HeatTransfer => both(
            X::Velocity,
            Only::All,
            "A pressure that reacts less to compression than it should: added volume, or heat exchanged with the walls.",
        ),
        E::PayloadMass => {
            vec![View::new(D::Position, X::Acceleration, "A line through zero is a mass other than stated.")]
        }
        E::ConstantForce | E::FrictionAsymmetry => vec![
            View::new(
                D::Position,
                X::Velocity,
                "The same sign in both directions of motion: a constant force, or friction that differs by direction.",
            )
            .only(Only::Sliding),
        ],
        E::CoulombFriction => vec![View::new(
            D::Position,
            X::Velocity,
            "A step at zero, equal at all speeds: sliding friction. Behind the prediction means more friction.",
        )],
        E::ViscousFriction => {
            vec![View::new(D::Position, X::Velocity, "An error that grows with the speed: the viscous part.")]
        }
        E::StaticFriction => vec![View::new(
            D::Position,
            X::Velocity,
            "Errors only near standstill: breaking away takes another force than sliding.",
        )],
        E::FrictionPosition => vec![
            View::new(D::Position, X::Position, "Opposite errors in the two directions that change along the stroke.")
                .only(Only::Sliding)
                .split(Split::Motion),
        ],
        E::FrictionPressure => vec![
            View::new(
                D::Position,
                X::Sum,
                "Opposite errors in the two directions that grow with the chamber pressures: seal lips pressed on.",
            )
            .only(Only::Sliding)
            .split(Split::Motion),
        ],
        E::PositionScale => vec![
            View::new(D::PressureA, X::Velocity, "Compression that does not fit the motion read by the sensor."),
            View::new(D::Position, X::Acceleration, "Motion that does not fit the force."),
        ],
        E::PressureAOffset => vec![
            View::new(D::PressureA, X::Command, "The flow does not fit the pressure read, most at large openings."),
            View::new(D::Position, X::Velocity, "The force does not fit either, alike in both directions."),
        ],
        E::PressureBOffset => vec![
            View::new(D::PressureB, X::Command, "The flow does not fit the pressure read, most at large openings."),
            View::new(D::Position, X::Velocity, "The force does not fit either, alike in both directions."),
        ],
        E::PressureLag => vec![
            View::new(D::PressureA, X::CommandRate, "Pressures that follow late."),
            View::new(D::Position, X::RateA, "The force is late too: an error that follows the rate of the pressures."),
        ],
        E::PositionDelay => {
            vec![View::new(D::Position, X::Acceleration, "Motion that shows later than the force that makes it.")]
        }
    }
}

/// The signals of the evidence with their rates.
pub(super) struct Scene<'a> {
    evidence: &'a Evidence,
    rig: &'a RigFile,
    acceleration: Vec<f64>,
    command_rate: Vec<f64>,
    rate_a: Vec<f64>,
    nominal: [Vec<f64>; 4],
    extended: [Vec<f64>; 4],
    fastest: f64,
}

impl<'a> Scene<'a> {
    pub(super) fn new(diagnosis: &'a Diagnosis, rig: &'a RigFile) -> Self {
        let evidence = &diagnosis.evidence;
        let quality = &diagnosis.log.quality;
        let reach = ((RATE_WINDOW_S / quality.interval_s.max(1e-6)).round() as usize).max(1);
        let rate = |signal: &[f64]| rate(&evidence.t_s, signal, reach);
        let deficits = |errors: &[Vec<f64>; 4]| {
            let chamber = |errors: &[f64], sigma: f64| -> Vec<f64> {
                let smooth = mean_around(&evidence.t_s, errors, reach);
                let growth = rate(&smooth);
                // Undoing the observer's memory turns its error back into the rate at which air goes missing.
                smooth.iter().zip(&growth).map(|(e, g)| (g + e / CHAMBER_MEMORY_S) * sigma * BAR).collect()
            };
            [
                chamber(&errors[0], quality.pressure_a.standard_deviation),
                chamber(&errors[1], quality.pressure_b.standard_deviation),
                errors[2].iter().map(|e| e * quality.position.standard_deviation * MM).collect(),
                errors[3].iter().map(|e| e * quality.supply.standard_deviation * BAR).collect(),
            ]
        };
        let speeds = evidence.v_m_per_s.iter().map(|v| v.abs());
        Self {
            rig,
            acceleration: rate(&evidence.v_m_per_s),
            command_rate: rate(&evidence.u_v),
            rate_a: rate(&evidence.p_a_pa),
            nominal: deficits(&evidence.nominal),
            extended: deficits(&evidence.extended),
            fastest: speeds.fold(0.0, f64::max),
            evidence,
        }
    }

    fn quantity(&self, against: Against, k: usize) -> f64 {
        let e = self.evidence;
        let at = |signal: &[f64]| signal.get(k).copied().unwrap_or(f64::NAN);
        let atmosphere = self.rig.rig.supply.atmosphere_pa;
        match against {
            Against::Command => at(&e.u_v),
            Against::CommandRate => at(&self.command_rate),
            Against::Position => at(&e.y_m) * MM,
            Against::Velocity => at(&e.v_m_per_s) * MM,
            Against::Acceleration => at(&self.acceleration),
            Against::PressureA => (at(&e.p_a_pa) - atmosphere) * BAR,
            Against::PressureB => (at(&e.p_b_pa) - atmosphere) * BAR,
            Against::Difference => (at(&e.p_a_pa) - at(&e.p_b_pa)) * BAR,
            Against::Sum => (at(&e.p_a_pa) + at(&e.p_b_pa) - 2.0 * atmosphere) * BAR,
            Against::RateA => at(&self.rate_a) * BAR,
            Against::Time => at(&e.t_s),
        }
    }

    fn counts(&self, only: Only, k: usize) -> bool {
        let valve = &self.rig.rig.valve;
        let (left, right) = (valve.dead_zone_left_v, valve.dead_zone_right_v);
        let u = self.evidence.u_v.get(k).copied().unwrap_or(f64::NAN);
        match only {
            Only::All => true,
            Only::ValveClosed => u > left - 0.03 && u < right + 0.03,
            Only::SmallCommand => u > left - 1.0 && u < right + 1.0,
            Only::Filling => u > right + 0.3,
            Only::Exhausting => u < left - 0.3,
            Only::Sliding => self.evidence.v_m_per_s[k].abs() > (0.03 * self.fastest).max(2.0e-3),
        }
    }

    /// The picture of one cause.
    pub(super) fn of_cause(&self, id: &str) -> Vec<Plot> {
        let Some(effect) = Effect::from_id(id) else { return Vec::new() };
        views(effect).iter().filter_map(|view| self.plot(view)).collect()
    }

    /// Where an open balance still errs: the quantities that say most about the rest.
    pub(super) fn of_rest(&self, channel: &str) -> Vec<Plot> {
        let Some(deficit) = Deficit::ALL.into_iter().find(|d| CHANNELS[*d as usize] == channel) else {
            return Vec::new();
        };
        let mut ranked: Vec<(f64, Against)> = Against::ALL
            .into_iter()
            .filter_map(|against| {
                let view = View::new(deficit, against, "");
                let bins = self.bins(&view, &self.extended[deficit as usize], None)?;
                Some((bins.explained, against))
            })
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let note = "What remains with everything found so far; a flat line at zero would be nothing.";
        ranked.iter().take(2).filter_map(|(_, against)| self.plot(&View::new(deficit, *against, note))).collect()
    }

    fn plot(&self, view: &View) -> Option<Plot> {
        let index = view.deficit as usize;
        // Where a filter leaves too little, everything is shown rather than nothing.
        let view = if self.bins(view, &self.nominal[index], None).is_none() {
            &View { only: Only::All, ..*view }
        } else {
            view
        };
        let halves: &[(Option<bool>, &str)] = match view.split {
            Split::No => &[(None, "")],
            Split::Command => &[(Some(true), ", command rising"), (Some(false), ", command falling")],
            Split::Motion => &[(Some(true), ", towards B"), (Some(false), ", towards A")],
        };
        let title = format!("{}: against {}", view.deficit.balance(), view.against.label());
        let mut plot = Plot::new(title, view.against.label(), view.deficit.label()).marker(Marker::Horizontal(0.0));
        for (place, (half, suffix)) in halves.iter().enumerate() {
            let before = self.bins(view, &self.nominal[index], *half)?;
            let after = self.bins(view, &self.extended[index], *half)?;
            plot = plot
                .with(Series::curve(format!("rig file as given{suffix}"), before.x, before.y).colour(2 * place))
                .with(
                    Series::curve(format!("with the causes found{suffix}"), after.x, after.y)
                        .colour(2 * place + 1)
                        .dashed(),
                );
        }
        let which = match view.only {
            Only::All => "",
            Only::ValveClosed => " Only samples with the valve closed.",
            Only::SmallCommand => " Only small commands.",
            Only::Filling => " Only while the valve fills A and exhausts B.",
            Only::Exhausting => " Only while the valve exhausts A and fills B.",
            Only::Sliding => " Only while sliding.",
        };
        Some(plot.note(format!("{}{which}", view.note)).height_px(280))
    }

    /// Means over groups of samples that are neighbours in the quantity.
    fn bins(&self, view: &View, deficit: &[f64], half: Option<bool>) -> Option<Bins> {
        let direction = |k: usize| match view.split {
            Split::No => 1.0,
            Split::Command => self.command_rate.get(k).copied().unwrap_or(0.0),
            Split::Motion => self.evidence.v_m_per_s[k],
        };
        let mut points: Vec<(f64, f64)> = (0..deficit.len().min(self.evidence.t_s.len()))
            .filter(|&k| self.counts(view.only, k))
            .filter(|&k| half.is_none_or(|up| if up { direction(k) > 0.0 } else { direction(k) < 0.0 }))
            .map(|k| (self.quantity(view.against, k), deficit[k]))
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        if points.len() < LEAST_SAMPLES {
            return None;
        }
        points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let trimmed = (points.len() as f64 * TRIMMED) as usize;
        let points = &points[trimmed..points.len() - trimmed];
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
        let total = points.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>();
        let mut bins = Bins::default();
        let mut between = 0.0;
        for group in points.chunks(points.len().div_ceil(BINS)) {
            let n = group.len() as f64;
            let (x, y) = group.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
            between += n * (y - mean).powi(2);
            bins.x.push(x);
            bins.y.push(y);
        }
        bins.explained = if total > 0.0 { between / total } else { 0.0 };
        Some(bins)
    }
}

#[derive(Default)]
struct Bins {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Part of the variance that the groups' means make up.
    explained: f64,
}

/// Whether `k ± reach` lies within one uninterrupted stretch.
fn window(t_s: &[f64], k: usize, reach: usize) -> Option<(usize, usize)> {
    let (low, high) = (k.checked_sub(reach)?, k + reach);
    let usual = t_s.get(k + 1).map_or(0.0, |next| next - t_s[k]).max(1e-6);
    (high < t_s.len() && t_s[high] - t_s[low] < 3.0 * (2 * reach) as f64 * usual).then_some((low, high))
}

fn rate(t_s: &[f64], signal: &[f64], reach: usize) -> Vec<f64> {
    (0..signal.len())
        .map(|k| match window(t_s, k, reach) {
            Some((low, high)) => (signal[high] - signal[low]) / (t_s[high] - t_s[low]),
            None => f64::NAN,
        })
        .collect()
}

fn mean_around(t_s: &[f64], signal: &[f64], reach: usize) -> Vec<f64> {
    (0..signal.len())
        .map(|k| match window(t_s, k, reach) {
            Some((low, high)) => signal[low..=high].iter().sum::<f64>() / (high - low + 1) as f64,
            None => f64::NAN,
        })
        .collect()
}
