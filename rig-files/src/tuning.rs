//! The one rule from a rig's nominal numbers to the limits and bandwidths of the positioning law; `docs/control-law.md` derives it.

use crate::rig_file::RigFile;
use control::servo::constants::{ERROR_M, TICK_DELAY};
use control::{OPENING_KNOTS, OPENING_STEP_V};
use plant_model::{Effect, Plant, Rig, Side};
use std::f64::consts::FRAC_PI_2;

/// How many voltages describe the valve's opening.
const KNOTS: usize = OPENING_KNOTS.len();

/// Lag of a fast proportional valve, for a rig file that has no effect `valve-lag`, s.
pub const USUAL_LAG_S: f64 = 1.7e-3;

/// Lag of the valve's spool as the rig file has it, else [`USUAL_LAG_S`], s.
#[must_use]
pub fn lag_s(rig: &RigFile) -> f64 {
    rig.effects.get(Effect::ValveLag).map_or(USUAL_LAG_S, |values| values[0])
}

/// Part of the hoses' delay that bounds the bandwidth as a lag does: what the law's lead and the observer's delay line leave
/// of it. On the catalogue rigs (`catalogue_rigs.rs`) a bandwidth lower by 13 % takes the DSNU 0.43 s in the mean instead of 0.26 s,
/// and one higher by 15 % lets the SMC swing.
const DELAY_PART: f64 = 0.7;

/// Whether the piston slips as it breaks away: the static friction exceeds the Coulomb friction by more than a tenth. Less
/// than that the law's learning of friction covers.
#[must_use]
pub fn stick_slip(rig: &Rig<f64>) -> bool {
    rig.friction.static_n > 1.1 * rig.friction.coulomb_n
}

/// Parts that the reference uses of the speed `v` that the flow holds up, of `v w_n` and of `v w_n²`, `w_n` being the piston's natural
/// frequency on its air. What they decide: docs/control-law.md.
pub const LIMIT_PARTS: [f64; 3] = [0.85, 0.58, 0.60];
/// The law's bandwidth times what delays its loop: tick, spool, hoses.
const BANDWIDTH_TIMES_DELAY: f64 = 0.32;
/// Bandwidth of the observer over the law's.
pub const OBSERVER_RATIO: f64 = 1.7;

/// Stiffness of the seal's bristles as the law takes it, over the rig file's. No log tells the stiffness well, and too little of it is a
/// limit cycle where too much costs a few milliseconds: on a seal ten times as stiff as its rig file says a move of 45 mm on (a) takes
/// 0.84 s with 1, 0.25 s with 1.5 and 2, and one of 1 mm on a seal as stated 0.099, 0.104 and 0.107 s in the mean.
pub const STIFFER: f64 = 1.5;

/// Limits and bandwidths for a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Highest speed of the reference, m/s.
    pub speed: f64,
    /// Highest acceleration of the reference, m/s2.
    pub acceleration: f64,
    /// Highest jerk of the reference, m/s3.
    pub jerk: f64,
    /// Bandwidth of the law that delay and lag allow, and that the air's jerk allows, rad/s.
    pub bandwidths: [f64; 2],
    /// Bandwidth of the law, rad/s.
    pub law_w: f64,
    /// Bandwidth of the observer, rad/s.
    pub observer_w: f64,
    /// Time by which the force that the air's stiffness makes of the motion is led, s.
    pub lead_s: f64,
}

impl Rule {
    /// For a valve whose spool lags by `lag_s`, at a tick of `tick_s`.
    #[must_use]
    pub fn of(rig: &Rig<f64>, lag_s: f64, tick_s: f64) -> Self {
        Self::with(rig, &Pneumatics::of(rig), lag_s, tick_s)
    }

    /// The same where the rig's pneumatics are known already.
    #[must_use]
    pub fn with(rig: &Rig<f64>, air: &Pneumatics, lag_s: f64, tick_s: f64) -> Self {
        let (gas, valve) = (&rig.gas, &rig.valve);
        let stiffness: f64 = std::array::from_fn::<f64, 2, _>(|n| {
            gas.heat_capacity_ratio * air.areas_m2[n] * air.areas_m2[n] * air.rest_pa[n] / air.volumes_m3[n]
        })
        .iter()
        .sum();
        let natural_w = (stiffness / rig.load.mass_kg).sqrt();
        let centre_v = (valve.dead_zone_right_v + valve.dead_zone_left_v) / 2.0;
        let half_v = (valve.dead_zone_right_v - valve.dead_zone_left_v) / 2.0;
        let angle = air.angle(valve.max_voltage_v - centre_v.abs() - half_v);
        // What the flow holds up, to the side where it is less, and the jerk it gives.
        let held = |n: usize| {
            let flow = gas.gas_constant_j_per_kg_k * gas.temperature_k * air.fill[n];
            flow * air.filling_pa(rig.supply.pressure_pa, air.rest_pa[n]) * angle / (air.areas_m2[n] * air.rest_pa[n])
        };
        let speed = held(0).min(held(1));
        let jerk = speed * natural_w * natural_w;
        let bandwidths =
            [BANDWIDTH_TIMES_DELAY / (TICK_DELAY * tick_s + lag_s + DELAY_PART * air.delay_s), (jerk / ERROR_M).cbrt()];
        let law_w = bandwidths[0].min(bandwidths[1]);
        let [part_v, part_a, part_j] = LIMIT_PARTS;
        Self {
            speed: part_v * speed,
            acceleration: part_a * speed * natural_w,
            jerk: part_j * jerk,
            bandwidths,
            law_w,
            observer_w: OBSERVER_RATIO * law_w,
            // Without hoses it is not needed: the rule's margins were measured without.
            lead_s: if air.delay_s > 0.0 { air.delay_s + lag_s + tick_s } else { 0.0 },
        }
    }
}

/// What the positioning law knows of valve, hoses and chambers; chamber A first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pneumatics {
    /// Areas of the piston, m2.
    pub areas_m2: [f64; 2],
    /// Volumes at mid-stroke, hoses included, m3.
    pub volumes_m3: [f64; 2],
    /// Flow into a chamber per radian of opening, kg/(s Pa): of pressure drop, or by ISO 6358 of supply pressure while choked.
    pub fill: [f64; 2],
    /// The same out of a chamber; by ISO 6358 of the chamber's pressure.
    pub exhaust: [f64; 2],
    /// Critical pressure ratios of filling and exhausting, where the valve follows ISO 6358.
    pub critical: Option<[f64; 2]>,
    /// Effective voltages at which the valve is open by [`OPENING_KNOTS`], where its opening is not the arc tangent, V.
    pub opening_v: Option<[f64; KNOTS]>,
    /// Delay of the command by the hoses, s.
    pub delay_s: f64,
    /// Pressures at rest, Pa absolute.
    pub rest_pa: [f64; 2],
}

impl Pneumatics {
    /// Of a rig, its hoses in series with the valve.
    #[must_use]
    pub fn of(rig: &Rig<f64>) -> Self {
        let plant = Plant::unchecked(rig);
        let known = plant.coefficients();
        let sides = [Side::A, Side::B].map(|side| *plant.orifices(side));
        let most_v = rig.valve.max_voltage_v;
        let hoses = sides.iter().any(|orifices| orifices.hose.is_some());
        let nominal = Self {
            areas_m2: [known.area_a_m2, known.area_b_m2],
            volumes_m3: [known.volume_a0_m3, known.volume_b0_m3],
            fill: sides.map(|orifices| orifices.fill),
            exhaust: sides.map(|orifices| orifices.exhaust),
            critical: rig.follows_iso6358().then(|| {
                let valve = &rig.valve;
                let mean = |a: f64, b: f64| 0.5 * (a + b);
                [
                    mean(valve.fill_critical_ratio_a, valve.fill_critical_ratio_b),
                    mean(valve.exhaust_critical_ratio_a, valve.exhaust_critical_ratio_b),
                ]
            }),
            opening_v: None,
            delay_s: plant.mean_line_delay_s(),
            rest_pa: rig.equilibrium_pressures_pa(),
        };
        if rig.cylinder.is_single_acting() {
            // The law does not drive a single chamber; its numbers are those of a cylinder alike on both sides.
            return Self {
                areas_m2: [rig.cylinder.mean_area_m2(); 2],
                volumes_m3: [known.volume_a0_m3; 2],
                fill: [nominal.fill[0]; 2],
                exhaust: [nominal.exhaust[0]; 2],
                rest_pa: [rig.equilibrium_pressure_pa(); 2],
                ..nominal
            };
        }
        if !hoses && rig.opening.is_empty() {
            return nominal;
        }
        let p = rig.supply.pressure_pa;
        // Into a chamber without pressure, and out of one against none: as much as flows at all, kg/(s Pa). Behind a valve of the
        // linear law a hose holds back the more the more flows: there half-way between supply and atmosphere, near rest.
        let atmosphere = rig.supply.atmosphere_pa;
        let (filled, emptied, outside) = if hoses && nominal.critical.is_none() {
            let middle = 0.5 * (p + atmosphere);
            (middle, middle, atmosphere)
        } else {
            (0.0, p, 0.0)
        };
        let fills =
            |n: usize, magnitude: f64| sides[n].inflow(true, magnitude, filled, p, outside).mass_flow / (p - filled);
        let exhausts = |n: usize, magnitude: f64| {
            -sides[n].inflow(false, magnitude, emptied, p, outside).mass_flow / (emptied - outside)
        };
        let widest = [most_v, -most_v].map(|u| plant.opening(u).magnitude).into_iter().fold(0.0, f64::max);
        let full = |flow: &dyn Fn(usize, f64) -> f64| [0, 1].map(|n| flow(n, widest) / FRAC_PI_2);
        let (fill, exhaust) = (full(&fills), full(&exhausts));
        // Relative to its widest opening, the mean of the four paths; a hose lets less and less pass of what the valve opens.
        let opening = |magnitude: f64| {
            let part = |n: usize| fills(n, magnitude) / fill[n] + exhausts(n, magnitude) / exhaust[n];
            (part(0) + part(1)) / (4.0 * FRAC_PI_2)
        };
        let zone = plant.dead_zone();
        let knot = |part: f64| {
            let side = |edge_v: f64, slope: f64, end_v: f64| {
                let (mut low, mut high) = (edge_v, end_v);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    if opening(plant.opening(middle).magnitude) < part { low = middle } else { high = middle }
                }
                // By the sharp corner, which the law's inverse dead zone has.
                (slope * (high - edge_v)).abs()
            };
            0.5 * (side(zone.right_v, zone.slope_right, most_v) + side(zone.left_v, zone.slope_left, -most_v))
        };
        let mut opening_v = OPENING_KNOTS.map(knot);
        let mut last = 0.0;
        for volts in &mut opening_v {
            // The law divides by what lies between two of them.
            *volts = volts.max(last + OPENING_STEP_V);
            last = *volts;
        }
        // The hose changes the critical ratio, too: that of the widest opening, from the flow at a ratio of 0.8.
        let behind = |ratio: f64, flow_at: f64| {
            let root = (1.0 - flow_at * flow_at).max(0.0).sqrt();
            if hoses { ((0.8 - root) / (1.0 - root)).max(0.0) } else { ratio }
        };
        let critical = nominal.critical.map(|[filling, exhausting]| {
            let at = |flow: f64, full: f64| flow / (full * FRAC_PI_2 * p);
            let [a, b] = [0, 1].map(|n| {
                let into = sides[n].inflow(true, widest, 0.8 * p, p, 0.0).mass_flow;
                let out = -sides[n].inflow(false, widest, p, p, 0.8 * p).mass_flow;
                [behind(filling, at(into, fill[n])), behind(exhausting, at(out, exhaust[n]))]
            });
            [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
        });
        Self { fill, exhaust, critical, opening_v: Some(opening_v), ..nominal }
    }

    /// The angle that an effective voltage opens the valve by, rad.
    #[must_use]
    pub fn angle(&self, w: f64) -> f64 {
        let Some(knots) = &self.opening_v else { return (2.0 * w).atan() };
        let (size, mut from) = (w.abs(), [0.0, 0.0]);
        for (volts, part) in knots.iter().zip(OPENING_KNOTS) {
            if size < *volts {
                let along = (size - from[0]) / (volts - from[0]);
                return (FRAC_PI_2 * (from[1] + along * (part - from[1]))).copysign(w);
            }
            from = [*volts, part];
        }
        FRAC_PI_2.copysign(w)
    }

    /// The effective voltage that opens the valve by an angle, V, and its derivative, V/rad.
    #[must_use]
    pub fn voltage(&self, theta: f64) -> (f64, f64) {
        let Some(knots) = &self.opening_v else {
            let w = theta.tan() / 2.0;
            return (w, (1.0 + 4.0 * w * w) / 2.0);
        };
        let (part, mut from) = (theta.abs() / FRAC_PI_2, [0.0, 0.0]);
        let mut found = (0.0, 0.0);
        for (volts, knot) in knots.iter().zip(OPENING_KNOTS) {
            let per_part = (volts - from[0]) / (knot - from[1]);
            found = (from[0] + per_part * (part.min(knot) - from[1]), per_part / FRAC_PI_2);
            if part < knot {
                break;
            }
            from = [*volts, knot];
        }
        (found.0.copysign(theta), found.1)
    }

    /// What drives the flow into a chamber, Pa: the drop of pressure, or by ISO 6358 `p_up ψ(p_down / p_up)`.
    #[must_use]
    pub fn filling_pa(&self, supply_pa: f64, p: f64) -> f64 {
        self.critical.map_or(supply_pa - p, |[ratio, _]| iso6358_pa(supply_pa, p, ratio))
    }

    /// The same out of a chamber.
    #[must_use]
    pub fn exhausting_pa(&self, p: f64, atmosphere_pa: f64) -> f64 {
        self.critical.map_or(p - atmosphere_pa, |[_, ratio]| iso6358_pa(p, atmosphere_pa, ratio))
    }
}

/// `p_up ψ(p_down / p_up) = sqrt(p_up² − x²)` with `x = (p_down − b p_up)/(1 − b)`, which counts where it is positive; 0 against a
/// higher pressure.
fn iso6358_pa(up: f64, down: f64, critical: f64) -> f64 {
    let x = ((down - critical * up) / (1.0 - critical)).max(0.0);
    ((up - x).max(0.0) * (up + x)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hose_behind_the_linear_valve_is_in_the_coefficients_and_in_the_opening_of_the_law() {
        let mut rig = Rig::<f64>::paper_a();
        let bare = Pneumatics::of(&rig);
        let h = &mut rig.hoses;
        (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.0, 4.0e-3, 1.0, 4.0e-3);
        let (plant, law) = (Plant::unchecked(&rig), Pneumatics::of(&rig));
        let share = law.fill[0] / bare.fill[0];
        assert!((0.8..0.9).contains(&share), "the open valve's flow falls by a seventh, not by two fifths: {share}");
        let (supply, p) = (rig.supply.pressure_pa, law.rest_pa[0]);
        for w in [0.05, 0.2, 0.5, 1.0, 3.0] {
            let flows = plant.orifices(Side::A).inflow(true, plant.opening(w).magnitude, p, supply, 1.0e5).mass_flow;
            let known = law.fill[0] * law.angle(w) * law.filling_pa(supply, p);
            // One curve for four paths, and straight lines between its points.
            assert!((known / flows - 1.0).abs() < 0.05, "{w} V: {known} {flows}");
        }
    }
}
