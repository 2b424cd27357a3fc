//! The picture of the evidence: what a balance misses, against the quantity that betrays the cause.

use crate::charts::{BAR, MM, scaled};
use diagnosis::{Channel, Diagnosis, Model, Quantity, Residuals};
use plant_model::Effect;
use plant_model::effects::identification::{Against, Balance, Only, Picture, Split};
use report_html::{Marker, Plot, Series};
use rig_files::RigFile;

const HEIGHT_PX: u32 = 280;
/// The two curves of every picture.
const MODELS: [(&str, Model); 2] = [("rig file, adjusted", Model::Nominal), ("with the causes found", Model::Extended)];
/// Frequencies shown at first, Hz; the rest is a double-click away.
const FREQUENCIES_HZ: f64 = 100.0;

/// What a balance misses, and the factor to the unit it is drawn in.
fn lacking(channel: Channel) -> (&'static str, f64) {
    match channel {
        Channel::PressureA => ("rise of p_a missed, bar/s", BAR),
        Channel::PressureB => ("rise of p_b missed, bar/s", BAR),
        Channel::Position => ("measured − predicted y, mm", MM),
        Channel::Supply => ("measured − predicted p_sup, bar", BAR),
    }
}

/// The balance that predicts a channel.
pub(super) fn balance_name(channel: Channel) -> &'static str {
    match channel {
        Channel::PressureA => "air balance of chamber A",
        Channel::PressureB => "air balance of chamber B",
        Channel::Position => "force balance of the piston",
        Channel::Supply => "air supply",
    }
}

/// The label of an axis and how a quantity is drawn on it: its value less the first figure, times the second.
fn axis(against: Quantity, atmosphere_pa: f64) -> (&'static str, f64, f64) {
    match against {
        Quantity::Command => ("valve command u, V", 0.0, 1.0),
        Quantity::CommandRate => ("rate of the valve command, V/s", 0.0, 1.0),
        Quantity::Position => ("position y, mm", 0.0, MM),
        Quantity::Velocity => ("velocity, mm/s", 0.0, MM),
        Quantity::Acceleration => ("acceleration, m/s²", 0.0, 1.0),
        Quantity::PressureA => ("p_a above atmosphere, bar", atmosphere_pa, BAR),
        Quantity::PressureB => ("p_b above atmosphere, bar", atmosphere_pa, BAR),
        Quantity::RatioA => ("pressure ratio across the valve to A", 0.0, 1.0),
        Quantity::RatioB => ("pressure ratio across the valve to B", 0.0, 1.0),
        Quantity::Difference => ("p_a − p_b, bar", 0.0, BAR),
        Quantity::Sum => ("p_a + p_b above atmosphere, bar", 2.0 * atmosphere_pa, BAR),
        Quantity::RateA => ("rate of p_a, bar/s", 0.0, BAR),
        Quantity::RateB => ("rate of p_b, bar/s", 0.0, BAR),
        Quantity::Time => ("time, s", 0.0, 1.0),
    }
}

/// The channel that a balance predicts.
fn channel(balance: Balance) -> Channel {
    match balance {
        Balance::MassA => Channel::PressureA,
        Balance::MassB => Channel::PressureB,
        Balance::Force => Channel::Position,
        Balance::Supply => Channel::Supply,
    }
}

/// The quantity of the log that the catalogue speaks of.
fn quantity(against: Against) -> Quantity {
    match against {
        Against::Command => Quantity::Command,
        Against::CommandRate => Quantity::CommandRate,
        Against::Position => Quantity::Position,
        Against::Velocity => Quantity::Velocity,
        Against::Acceleration => Quantity::Acceleration,
        Against::PressureA => Quantity::PressureA,
        Against::PressureB => Quantity::PressureB,
        Against::RateA => Quantity::RateA,
        Against::Difference => Quantity::Difference,
        Against::Sum => Quantity::Sum,
    }
}

/// What is drawn of a balance's errors.
#[derive(Clone, Copy, Debug)]
struct View {
    of: Channel,
    against: Quantity,
    only: Only,
    split: Split,
    note: &'static str,
}

impl View {
    const fn new(of: Channel, against: Quantity, note: &'static str) -> Self {
        Self { of, against, only: Only::All, split: Split::No, note }
    }

    fn of(picture: &Picture) -> Self {
        let Picture { of, against, only, split, note } = *picture;
        Self { of: channel(of), against: quantity(against), only, split, note }
    }
}

/// What is drawn: the errors of the balances on the rig as given.
pub(super) struct Scene<'a> {
    residuals: Residuals<'a>,
    rig: &'a RigFile,
    velocities: &'a [f64],
    fastest: f64,
}

impl<'a> Scene<'a> {
    pub(super) fn new(diagnosis: &'a Diagnosis, rig: &'a RigFile) -> Self {
        let velocities = &diagnosis.evidence.v_m_per_s;
        Self {
            residuals: Residuals::new(&diagnosis.evidence, &diagnosis.log.quality, &rig.rig),
            rig,
            velocities,
            fastest: velocities.iter().map(|v| v.abs()).fold(0.0, f64::max),
        }
    }

    fn counts(&self, only: Only, k: usize) -> bool {
        let valve = &self.rig.rig.valve;
        let (left, right) = (valve.dead_zone_left_v, valve.dead_zone_right_v);
        let u = self.residuals.at(Quantity::Command, k);
        match only {
            Only::All => true,
            Only::ValveClosed => u > left - 0.03 && u < right + 0.03,
            Only::SmallCommand => u > left - 1.0 && u < right + 1.0,
            Only::Filling => u > right + 0.3,
            Only::Exhausting => u < left - 0.3,
            Only::Sliding => self.velocities[k].abs() > (0.03 * self.fastest).max(2.0e-3),
        }
    }

    /// Whether a sample belongs to one half of a split view.
    fn belongs(&self, split: Split, half: bool, k: usize) -> bool {
        let direction = match split {
            Split::No => return true,
            Split::Command => self.residuals.at(Quantity::CommandRate, k),
            Split::Motion => self.velocities[k],
        };
        if half { direction > 0.0 } else { direction < 0.0 }
    }

    /// The picture of one cause.
    pub(super) fn of_cause(&self, id: &str) -> Vec<Plot> {
        let Some(effect) = Effect::from_id(id) else { return Vec::new() };
        effect.identification().pictures.iter().filter_map(|picture| self.plot(&View::of(picture))).collect()
    }

    /// Where an open balance still errs: the quantities that say most about the rest.
    pub(super) fn of_rest(&self, channel: Channel) -> Vec<Plot> {
        let curve = |against| self.residuals.curve(channel, Model::Extended, against, |_| true);
        let mut ranked: Vec<(f64, Quantity)> =
            Quantity::of(channel).iter().filter_map(|against| Some((curve(*against)?.explained, *against))).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let note = "What remains with everything found so far; a flat line at zero would be nothing.";
        ranked.iter().take(2).filter_map(|(_, against)| self.plot(&View::new(channel, *against, note))).collect()
    }

    /// A balance's errors against every quantity, by the parity of what depends on velocity, and over frequency.
    pub(super) fn everywhere(&self, channel: Channel) -> Vec<Plot> {
        let of = |against: &Quantity| self.plot(&View::new(channel, *against, ""));
        let mut plots: Vec<Plot> = Quantity::of(channel).iter().filter_map(of).collect();
        plots.extend(self.parity(channel));
        plots.extend(self.spectrum(channel));
        plots
    }

    fn parity(&self, channel: Channel) -> Option<Plot> {
        let (label, unit) = lacking(channel);
        let mut plot = Plot::new(titled(channel, "by its parity in velocity"), "speed, mm/s", label)
            .marker(Marker::Horizontal(0.0))
            .note(
                "Even: alike in both directions of motion, such as a constant force. Odd: opposite in the two directions, \
                 such as friction.",
            )
            .height_px(HEIGHT_PX);
        for (name, model) in MODELS {
            let parts = self.residuals.parity(channel, model)?;
            for (place, (part, word)) in parts.into_iter().zip(["even", "odd"]).enumerate() {
                let series = Series::curve(format!("{word}, {name}"), scaled(&part.x, MM), scaled(&part.y, unit));
                plot = plot.with(styled(series, model, place));
            }
        }
        Some(plot)
    }

    fn spectrum(&self, channel: Channel) -> Option<Plot> {
        let mut plot = Plot::new(titled(channel, "over frequency"), "frequency, Hz", "power over that of noise, dB")
            .marker(Marker::Horizontal(0.0))
            .note("0 dB at all frequencies is white noise of the sensor's strength: nothing left to explain.")
            .height_px(HEIGHT_PX);
        for (name, model) in MODELS {
            let spectrum = self.residuals.spectrum(channel, model)?;
            let last = spectrum.hz.last().copied().unwrap_or(FREQUENCIES_HZ);
            let db = spectrum.power.iter().map(|power| 10.0 * power.max(1.0e-6).log10()).collect();
            plot = plot
                .with(styled(Series::curve(name, spectrum.hz, db), model, 0))
                .x_range(0.0, last.min(FREQUENCIES_HZ));
        }
        Some(plot)
    }

    fn plot(&self, view: &View) -> Option<Plot> {
        let curve = |model, only, half| {
            let keep = |k| self.counts(only, k) && self.belongs(view.split, half, k);
            self.residuals.curve(view.of, model, view.against, keep)
        };
        // Where a filter leaves too little, everything is shown rather than nothing.
        let all = self.residuals.curve(view.of, Model::Nominal, view.against, |k| self.counts(view.only, k));
        let only = if all.is_none() { Only::All } else { view.only };
        let halves: &[(bool, &str)] = match view.split {
            Split::No => &[(true, "")],
            Split::Command => &[(true, ", command rising"), (false, ", command falling")],
            Split::Motion => &[(true, ", towards B"), (false, ", towards A")],
        };
        let (x_label, zero, x_unit) = axis(view.against, self.rig.rig.supply.atmosphere_pa);
        let (y_label, y_unit) = lacking(view.of);
        let title = titled(view.of, &format!("against {x_label}"));
        let mut plot = Plot::new(title, x_label, y_label).marker(Marker::Horizontal(0.0));
        for (place, (half, suffix)) in halves.iter().enumerate() {
            for (name, model) in MODELS {
                let drawn = curve(model, only, *half)?;
                let x = drawn.x.iter().map(|x| (x - zero) * x_unit).collect();
                let y = scaled(&drawn.y, y_unit);
                plot = plot.with(styled(Series::curve(format!("{name}{suffix}"), x, y), model, place));
            }
        }
        let which = match only {
            Only::All => "",
            Only::ValveClosed => " Only samples with the valve closed.",
            Only::SmallCommand => " Only small commands.",
            Only::Filling => " Only while the valve fills A and exhausts B.",
            Only::Exhausting => " Only while the valve exhausts A and fills B.",
            Only::Sliding => " Only while sliding.",
        };
        Some(plot.note(format!("{}{which}", view.note).trim_start()).height_px(HEIGHT_PX))
    }
}

/// Before: a full line; after: a dashed one in the next colour.
fn styled(series: Series, model: Model, place: usize) -> Series {
    match model {
        Model::Nominal => series.colour(2 * place),
        Model::Extended => series.colour(2 * place + 1).dashed(),
    }
}

fn titled(channel: Channel, how: &str) -> String {
    let mut letters = balance_name(channel).chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}: {how}", letters.as_str())
}
