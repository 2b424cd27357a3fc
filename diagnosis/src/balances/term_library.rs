//! Closed-form terms outside the catalogue: what a balance may lack, each known up to one factor.
//!
//! A term is a signal computed from the measured ones. It is added to a balance like a cause, but it only describes: in
//! which balance the gap is, and on what it depends.

use super::added::Added;
use super::opening;
use crate::data::channel::{Channel, Channels};
use crate::data::record::Record;
use plant_model::valve_flow::Flow;
use plant_model::{Plant, Side};

/// A term with its signal at a factor of one, by sample; empty where it does not act.
pub(crate) struct Term {
    /// Its physical meaning, in words.
    pub(crate) words: &'static str,
    /// The closed form, with `c` for the factor.
    pub(crate) formula: String,
    /// The balances it acts on.
    pub(crate) channels: Channels,
    signal: Added,
}

/// The sum of some terms, each times its factor.
pub(crate) fn sum<'a>(terms: &'a [Term], factors: impl Iterator<Item = (usize, f64)> + 'a) -> Added {
    let mut out = Added::default();
    for (index, factor) in factors {
        out.add(&terms[index].signal, factor);
    }
    out
}

/// The library for this log: forces against velocity, position, pressure and time, flows against opening, pressure
/// drop, position and time.
pub(crate) fn library(record: &Record, plant: &Plant<f64>, judgeable: Channels) -> Vec<Term> {
    let mut out = Vec::new();
    if judgeable & Channel::Position.bit() != 0 {
        forces(record, plant, &mut out);
    }
    let chambers = judgeable & (Channel::PressureA.bit() | Channel::PressureB.bit());
    if chambers != 0 {
        let air = Air { record, plant, openings: opening::openings(record, plant) };
        flows(&air, chambers, &mut out);
        gains(&air, judgeable, &mut out);
    }
    out
}

/// The nominal flows at the pressures measured.
struct Air<'a> {
    record: &'a Record,
    plant: &'a Plant<f64>,
    openings: opening::Openings,
}

impl Air<'_> {
    fn pressure_pa(&self, is_a: bool, k: usize) -> f64 {
        if is_a { self.record.p_a_smooth.value[k] } else { self.record.p_b_smooth.value[k] }
    }

    /// Flow into a chamber, and the pressure drop that drives it, Pa.
    fn inflow(&self, is_a: bool, k: usize) -> (Flow<f64>, f64) {
        let c = self.plant.coefficients();
        let p = self.pressure_pa(is_a, k);
        let side = if is_a { Side::A } else { Side::B };
        let opening = self.openings.of(side)[k];
        let fills = (opening >= 0.0) == is_a;
        let supply = self.record.p_sup_smooth.value.get(k).copied().unwrap_or(c.supply_pa);
        let y = self.record.y_smooth.value[k];
        let flow = self.plant.valve_inflow(side, y, fills, opening.abs(), p, supply);
        (flow, if fills { supply - p } else { p - c.atmosphere_pa })
    }
}

/// Pressure sensors whose reading is off in proportion: the flow and the force that the reading hides.
fn gains(air: &Air<'_>, judgeable: Channels, out: &mut Vec<Term>) {
    let (record, c) = (air.record, air.plant.coefficients());
    let (a, b) = (Channel::PressureA.bit(), Channel::PressureB.bit());
    for (words, sensors) in [
        ("pressure sensors of both chambers with another gain", a | b),
        ("a pressure sensor of A with another gain", a),
        ("a pressure sensor of B with another gain", b),
    ] {
        if sensors & judgeable != sensors {
            continue;
        }
        // Flow falls in proportion to the chamber's pressure, so the reading hides the flow at a pressure of zero.
        let hidden = |is_a: bool| -> Vec<f64> {
            let bit = if is_a { a } else { b };
            if sensors & bit == 0 {
                return Vec::new();
            }
            let at_zero = |k: usize| {
                let (flow, _) = air.inflow(is_a, k);
                flow.mass_flow - flow.by_chamber * air.pressure_pa(is_a, k)
            };
            (0..record.len()).map(at_zero).collect()
        };
        let force = |k: usize| {
            let push = |on: u8, p: &[f64]| if sensors & on != 0 { p[k] - c.atmosphere_pa } else { 0.0 };
            c.area_b_m2 * (push(a, &record.p_a_smooth.value) - push(b, &record.p_b_smooth.value))
        };
        let felt = judgeable & Channel::Position.bit() != 0;
        out.push(Term {
            words,
            formula: "c · p".to_string(),
            channels: sensors | (judgeable & Channel::Position.bit()),
            signal: Added {
                force_n: if felt { (0..record.len()).map(force).collect() } else { Vec::new() },
                flow_a_kg_per_s: hidden(true),
                flow_b_kg_per_s: hidden(false),
                ..Added::default()
            },
        });
    }
}

/// What terms are made of at one sample, each scaled to about -1 to 1.
struct At {
    /// Velocity over the log's usual top speed.
    v: f64,
    /// Direction of motion, smooth around standstill.
    direction: f64,
    /// One at standstill, zero in free motion.
    slow: f64,
    /// Position over half the stroke.
    y: f64,
    /// Time from the middle of the log over half its length.
    t: f64,
    /// Pressure difference over supply gauge pressure.
    difference: f64,
}

fn forces(record: &Record, plant: &Plant<f64>, out: &mut Vec<Term>) {
    let c = plant.coefficients();
    let top = top_speed(record);
    let slow = (3.0 * record.velocity_error_m_per_s()).max(0.02 * top);
    let unit = plant.friction_level(&plant_model::State::default()).force_n;
    let gauge = c.supply_pa - c.atmosphere_pa;
    let time = from_start_to_end(record);
    let at = |k: usize| {
        let v = record.motion.slope[k];
        At {
            v: v / top,
            direction: v / v.hypot(slow),
            slow: (-(v / (3.0 * slow)).powi(2)).exp(),
            y: record.y_smooth.value[k] / c.half_stroke_m,
            t: time(k),
            difference: (record.p_a_smooth.value[k] - record.p_b_smooth.value[k]) / gauge,
        }
    };
    let speed = format!("v/{top:.3} m/s");
    let half = format!("y/{:.3} m", c.half_stroke_m);
    let mut add = |words, formula: String, f: &dyn Fn(&At) -> f64| {
        let force_n = (0..record.len()).map(|k| unit * f(&at(k))).collect();
        out.push(Term {
            words,
            formula: format!("{unit:.1} N · c · {formula}"),
            channels: Channel::Position.bit(),
            signal: Added { force_n, ..Added::default() },
        });
    };
    add("drag that grows with the square of the speed", format!("({speed})² sign(v)"), &|x| x.v * x.v.abs());
    add("drag that grows with the third power of the speed", format!("({speed})³"), &|x| x.v.powi(3));
    add("a force that depends on the speed alone, not on the direction", format!("|{speed}|"), &|x| x.v.abs());
    add("a spring: a force proportional to position", format!("({half})"), &|x| x.y);
    add("a force that bends along the stroke", format!("({half})²"), &|x| x.y * x.y);
    add("a force that stiffens towards the ends", format!("({half})³"), &|x| x.y.powi(3));
    add("friction that grows towards both ends", format!("({half})² sign(v)"), &|x| x.direction * x.y * x.y);
    add("viscous drag that changes along the stroke", format!("({speed}) ({half})"), &|x| x.v * x.y);
    add("friction that changes during the recording", "t' sign(v), t' from -1 to 1".into(), &|x| x.direction * x.t);
    add("friction that settles during the recording", "exp(-2 (1 + t')) sign(v), t' from -1 to 1".into(), &|x| {
        x.direction * (-2.0 * (1.0 + x.t)).exp()
    });
    add("a force that drifts during the recording", "t', from -1 to 1".into(), &|x| x.t);
    add("friction around standstill", "exp(-(v/v_slow)²) sign(v)".into(), &|x| x.direction * x.slow);
    add("a share of the pressure force that is missing", "(p_a - p_b)/p_gauge".into(), &|x| x.difference);
    add("friction that grows with the pressure difference", "|p_a - p_b|/p_gauge sign(v)".into(), &|x| {
        x.direction * x.difference.abs()
    });
}

fn flows(air: &Air<'_>, chambers: Channels, out: &mut Vec<Term>) {
    let Air { record, plant, openings } = air;
    let c = plant.coefficients();
    let gauge = c.supply_pa - c.atmosphere_pa;
    // Nominal flow into a chamber with its pressure as measured, and the drop that drives it.
    let flow = |is_a: bool, k: usize| -> [f64; 2] {
        let (flow, drop) = air.inflow(is_a, k);
        [flow.mass_flow, drop]
    };
    // Mass flow that a change of volume at speed v would stand for.
    let swept = |is_a: bool, k: usize| -> f64 {
        let side = if is_a { -1.0 } else { 1.0 };
        side * c.exponent * air.pressure_pa(is_a, k) * c.area_b_m2 * record.motion.slope[k] / plant.energy_j_per_kg()
    };
    let y = |k: usize| record.y_smooth.value[k] / c.half_stroke_m;
    let t = from_start_to_end(record);
    let full = core::f64::consts::FRAC_PI_2;
    let opening = |is_a: bool, k: usize| openings.of(if is_a { Side::A } else { Side::B })[k];
    let mut add = |words, formula: &str, channels: Channels, f: &dyn Fn(bool, usize) -> f64| {
        let has = |channel: Channel| channels & chambers & channel.bit() != 0;
        let signal = |channel: Channel, is_a: bool| -> Vec<f64> {
            if has(channel) { (0..record.len()).map(|k| f(is_a, k)).collect() } else { Vec::new() }
        };
        let flow_a_kg_per_s = signal(Channel::PressureA, true);
        let flow_b_kg_per_s = signal(Channel::PressureB, false);
        if channels & chambers != 0 {
            out.push(Term {
                words,
                formula: formula.to_string(),
                channels: channels & chambers,
                signal: Added { flow_a_kg_per_s, flow_b_kg_per_s, ..Added::default() },
            });
        }
    };
    let both = Channel::PressureA.bit() | Channel::PressureB.bit();
    add("another opening curve of the valve", "c · q · (opening/fully open)", both, &|is_a, k| {
        flow(is_a, k)[0] * opening(is_a, k).abs() / full
    });
    add("another opening curve of the valve, near closed", "c · q · exp(-4 opening/fully open)", both, &|is_a, k| {
        flow(is_a, k)[0] * (-4.0 * opening(is_a, k).abs() / full).exp()
    });
    add("flow that bends with the pressure drop", "c · q · (drop/p_gauge)", both, &|is_a, k| {
        let [q, drop] = flow(is_a, k);
        q * drop / gauge
    });
    add("flow that changes during the recording", "c · q · t', t' from -1 to 1", both, &|is_a, k| {
        flow(is_a, k)[0] * t(k)
    });
    add("flow that differs between the two directions of the valve", "c · q · sign(u)", both, &|is_a, k| {
        flow(is_a, k)[0] * opening(is_a, k).signum()
    });
    for (chamber, side) in [(Channel::PressureA, 1.0), (Channel::PressureB, -1.0)] {
        // Exhaust is throttled where the chamber is small.
        add(
            "exhaust that is throttled near the end of the stroke",
            "c · q_exhaust · ((1 - y')/2)³, y' from -1 at this chamber's end to 1",
            chamber.bit(),
            &|is_a, k| {
                let [q, _] = flow(is_a, k);
                if q < 0.0 { q * (0.5 * (1.0 - side * y(k))).powi(3) } else { 0.0 }
            },
        );
    }
    add("a volume that changes otherwise than the measured position says", "c · p A v/(R T)", both, &swept);
    add("a position reading that bows along the stroke", "c · p A v cos(pi y/(L/2))/(R T)", both, &|is_a, k| {
        swept(is_a, k) * (core::f64::consts::PI * y(k)).cos()
    });
}

/// The time of a sample, from -1 at the start of the log to 1 at its end.
fn from_start_to_end(record: &Record) -> impl Fn(usize) -> f64 + '_ {
    let (first, last) = (record.t_s.first().copied().unwrap_or(0.0), record.t_s.last().copied().unwrap_or(1.0));
    move |k| 2.0 * (record.t_s[k] - first) / (last - first).max(1.0e-9) - 1.0
}

/// The speed that 95 % of the samples stay below, m/s.
fn top_speed(record: &Record) -> f64 {
    let mut speeds: Vec<f64> = record.motion.slope.iter().map(|v| v.abs()).collect();
    if speeds.is_empty() {
        return 1.0;
    }
    let place = (speeds.len() * 95 / 100).min(speeds.len() - 1);
    speeds.select_nth_unstable_by(place, f64::total_cmp).1.max(1.0e-3)
}
