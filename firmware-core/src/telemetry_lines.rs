//! The lines of telemetry, as defmt messages. Their words are the format: people read them, `plant-sim record` parses them.

use control::Learned;

use crate::record::Record;
use crate::settings::Settings;

/// Ranges and rates, repeated now and then so that a host that attaches late learns them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Ticks per second.
    pub tick_hz: u32,
    /// Position (m), p_a, p_b, p_sup (Pa) at code 0 and 65 535, as calibrated.
    pub channels: [[f32; 2]; 4],
    /// Valve voltage at code 0 and 4095, V.
    pub valve_v: [f32; 2],
    /// One record every so many ticks.
    pub every: u32,
}

impl Scales {
    /// Those of the settings.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        Self::of_parameters(&settings.control_parameters(), settings.telemetry_every())
    }

    /// Those of a control law's parameters.
    #[must_use]
    pub fn of_parameters(parameters: &control::Parameters, every: u32) -> Self {
        Self {
            tick_hz: parameters.tick_hz,
            channels: parameters.calibrated_ranges().map(|ends| ends.map(|end| end as f32)),
            valve_v: parameters.valve_range_v,
            every,
        }
    }

    /// Sends them.
    pub fn send(&self) {
        let ([[y0, y1], [a0, a1], [b0, b1], [s0, s1]], [u0, u1]) = (self.channels, self.valve_v);
        defmt::info!(
            "scales hz={=u32} y0={=f32} y1={=f32} a0={=f32} a1={=f32} b0={=f32} b1={=f32} s0={=f32} s1={=f32} u0={=f32} u1={=f32} every={=u32}",
            self.tick_hz,
            y0,
            y1,
            a0,
            a1,
            b0,
            b1,
            s0,
            s1,
            u0,
            u1,
            self.every,
        );
    }
}

/// Sends one record; `lost` is how many the queue has refused so far.
pub fn send(record: &Record, lost: u32) {
    let [position, a, b, supply] = record.codes;
    let [sampled, controlled, written] = record.stamps;
    defmt::info!(
        "tick={=u32} seq={=u32} y={=u16} a={=u16} b={=u16} sup={=u16} dac={=u16} held={=u16} ref={=i32} mode={=u16} c1={=u16} c2={=u16} c3={=u16} lost={=u32}",
        record.tick,
        record.sequence,
        position,
        a,
        b,
        supply,
        record.dac,
        record.held,
        record.reference_bits,
        record.mode,
        sampled,
        controlled,
        written,
        lost,
    );
    if record.event {
        defmt::warn!(
            "event tick={=u32} mode={=u16} disagreement={=bool}",
            record.tick,
            record.mode,
            record.disagreement
        );
    }
}

/// Sends what the positioning law has learned up to `tick`, once a second or so.
pub fn send_learned(learned: &Learned, tick: u32, tick_hz: u32) {
    let [flow_right, flow_left, zone_right, zone_left, lag, coulomb, viscous, mass, load, bandwidth] =
        learned.values(tick_hz);
    defmt::info!(
        "learned tick={=u32} flow_right={=f32} flow_left={=f32} dead_zone_right_v={=f32} dead_zone_left_v={=f32} lag_s={=f32} coulomb_m_per_s2={=f32} viscous_per_s={=f32} mass={=f32} load_m_per_s2={=f32} bandwidth={=f32}",
        tick,
        flow_right,
        flow_left,
        zone_right,
        zone_left,
        lag,
        coulomb,
        viscous,
        mass,
        load,
        bandwidth,
    );
}
