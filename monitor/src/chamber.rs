//! One chamber's pressure balance, predicted and compared.
//!
//! Besides, the steps of its reading are summed up that no air can have made: further in one tick than the widest open valve
//! moves the pressure. They are the sensor's.

use crate::motion::Contribution;
use crate::parameters::MonitorParameters;
use crate::{Check, STRIKES};
use core::f32::consts::SQRT_2;
use plant_model::{Plant, Real, Side};

/// Part of the relative error that is allowed which the volume at mid-stroke has: 5 of 20 %. It grows as the chamber empties.
const VOLUME_PART: f32 = 0.25;
/// Part of the sum of flow and compression that is allowed for, where both act the same way, as each of them is alone: an exponent of
/// 1.1 instead of 1.4 makes both smaller by a fifth. On case (a) the largest residual of 5 min so is 1.10 of its threshold with 0, 0.96 with
/// 0.8, 0.88 with 0.9. With 1 a slow position of the reliability study (seed 4711) is found a tick later and no longer named.
const SUM_PART: f32 = 0.9;
/// Of the pressure error that is always allowed, what noise makes of a change: two readings differ by the root of two times one's noise.
const STEP_NOISE: f32 = SQRT_2;

/// What both chambers share between two samples, one tick apart.
pub(crate) struct Interval<'m> {
    pub(crate) plant: &'m Plant<f32>,
    pub(crate) parameters: &'m MonitorParameters,
    pub(crate) tick_s: f32,
    pub(crate) keep: f32,
    /// Mean spool position over the tick, V.
    pub(crate) spool_v: f32,
    pub(crate) supply_pa: f32,
}

/// The valve in one tick.
pub(crate) struct Valve {
    /// Magnitude, rad.
    pub(crate) opening: f32,
    /// By how much that may be wrong.
    pub(crate) opening_error: f32,
    pub(crate) fills_a: bool,
    /// Magnitude, rad, and whether it fills A, of a valve without lag; `None` where that is the valve.
    pub(crate) unlagged: Option<(f32, bool)>,
}

/// What one chamber sees in one tick.
pub(crate) struct Balance {
    /// Mean pressure over the tick, Pa.
    pub(crate) pressure_pa: f32,
    pub(crate) inverse_volume_per_m3: f32,
    /// The chamber's volume at mid-stroke, m3.
    pub(crate) middle_volume_m3: f32,
    /// 1 if the chamber grows towards B, −1 if it shrinks.
    pub(crate) towards_b: f32,
    pub(crate) side: Side,
    /// Distance of the piston from the chamber's end, m.
    pub(crate) distance_m: f32,
    /// Motion during the tick in the direction in which the chamber grows, m.
    pub(crate) step_m: f32,
    pub(crate) smoothed_step_m: f32,
    pub(crate) filling: bool,
    pub(crate) leak_kg_per_s: f32,
}

/// The difference between measured and predicted pressure, and how much of it is allowed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watch {
    residual_pa: f32,
    allowance_pa: f32,
    /// What the residual would be if the valve had no lag. One of twice the lag makes as much the other way.
    lag_pa: f32,
    stepped_pa: f32,
    since_step: u8,
}

impl Default for Watch {
    fn default() -> Self {
        Self { residual_pa: 0.0, allowance_pa: 0.0, lag_pa: 0.0, stepped_pa: 0.0, since_step: u8::MAX }
    }
}

/// What a tick makes of a chamber.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// Measured minus predicted pressure, Pa.
    pub(crate) check: Check,
    /// What of that difference came in steps that no air can have made, Pa.
    pub(crate) stepped_pa: f32,
    /// What of the threshold is for noise, Pa.
    pub(crate) noise_pa: f32,
    /// Whether one of them came in the ticks that make a disagreement.
    pub(crate) steps_now: bool,
    /// What both together say of the motion.
    pub(crate) contribution: Contribution,
}

impl Interval<'_> {
    /// `command_v` is what the spool follows with a lag, if it does.
    pub(crate) fn valve(&self, command_v: Option<f32>) -> Valve {
        let dead_zone = self.plant.dead_zone();
        let opening = self.plant.opening(self.spool_v);
        let w = opening.w;
        let error_v = self.parameters.opening_v;
        // Deep inside the dead zone the valve is closed for certain.
        let may_be_open = self.spool_v > dead_zone.right_v - error_v || self.spool_v < dead_zone.left_v + error_v;
        let slope = if w < 0.0 { dead_zone.slope_left } else { dead_zone.slope_right };
        let two_w = 2.0 * w;
        let error = if self.plant.opening_curve().is_some() {
            // Beside a kink of the curve the steeper side counts.
            let steepest = |w: f32| self.plant.gain_per_v(&self.plant.opening(w)).abs();
            slope * error_v * steepest(self.spool_v - error_v).at_least(steepest(self.spool_v + error_v))
        } else {
            2.0 * slope * error_v / (1.0 + two_w * two_w)
        };
        Valve {
            opening: opening.magnitude,
            opening_error: if may_be_open { error } else { 0.0 },
            fills_a: opening.fills_a,
            unlagged: command_v.map(|command_v| {
                let opening = self.plant.opening(command_v);
                (opening.magnitude, opening.fills_a)
            }),
        }
    }
}

impl Watch {
    /// One tick, in which the reading changed by `measured_step_pa`.
    pub(crate) fn advance(
        &mut self,
        interval: &Interval<'_>,
        valve: &Valve,
        balance: &Balance,
        measured_step_pa: f32,
    ) -> Found {
        let m = interval.plant.coefficients();
        let orifices = interval.plant.orifices(balance.side);
        let area_m2 = interval.plant.area_m2(balance.side);
        let p = balance.pressure_pa;
        let flow = |filling: bool, opening: f32| {
            orifices.inflow(filling, opening, p, interval.supply_pa, m.atmosphere_pa).mass_flow
        };
        let bore = flow(balance.filling, valve.opening);
        // How far the cushion's needle is open is unknown: all of the flow that it can hold back is allowed as error.
        let inflow = if orifices.cushion.is_some() {
            let (y, supply) = (balance.distance_m, interval.supply_pa);
            orifices.inflow_at(y, balance.filling, valve.opening, p, supply, m.atmosphere_pa).mass_flow
        } else {
            bore
        };
        let per_kg_per_s = interval.plant.energy_j_per_kg() * interval.tick_s * balance.inverse_volume_per_m3;
        let per_metre = m.exponent * area_m2 * p * balance.inverse_volume_per_m3;
        let by_flow = per_kg_per_s * (inflow + balance.leak_kg_per_s);
        let by_motion = -per_metre * balance.step_m;
        let unexplained_pa = measured_step_pa - by_flow - by_motion;
        self.residual_pa = (self.residual_pa + unexplained_pa) * interval.keep;
        let step_noise_pa = STEP_NOISE * interval.parameters.pressure_pa;
        // In next to no tick a reading changes by more than noise: the widest flow is worth its instructions there alone.
        let stepped = measured_step_pa.abs() > step_noise_pa && {
            let widest = per_kg_per_s * widest_kg_per_s(interval, balance);
            let by_air = widest + (per_metre * balance.smoothed_step_m).abs();
            measured_step_pa.abs() > step_noise_pa + (1.0 + interval.parameters.relative) * by_air
        };
        self.since_step = if stepped { 0 } else { self.since_step.saturating_add(1) };
        self.stepped_pa = (self.stepped_pa + if stepped { unexplained_pa } else { 0.0 }) * interval.keep;

        let doubt = if valve.opening_error > 0.0 {
            // About the break-point nobody knows which way the valve is open: the larger of both flows.
            flow(true, valve.opening_error).abs().at_least(flow(false, valve.opening_error).abs())
        } else {
            0.0
        };
        // In steady motion both are equal and opposite; the larger one sets the scale. Where a piston brakes they act the same way, and
        // an error of the exponent is in both.
        let by_smooth_motion = -per_metre * balance.smoothed_step_m;
        let sum = SUM_PART * (by_flow + by_smooth_motion);
        let activity = by_flow.abs().at_least(by_smooth_motion.abs()).at_least(sum.abs());
        // A chamber that is almost empty has a volume that the position's error is a large part of, and so is an error of its
        // volume at mid-stroke.
        let position_doubt = interval.parameters.position_m * area_m2 * balance.inverse_volume_per_m3;
        let emptier = (balance.middle_volume_m3 * balance.inverse_volume_per_m3 - 1.0).at_least(0.0);
        let relative = interval.parameters.relative * (1.0 + VOLUME_PART * emptier);
        let allowed_pa = (relative + position_doubt) * activity + per_kg_per_s * (doubt + (bore - inflow).abs());
        self.allowance_pa = (self.allowance_pa + allowed_pa) * interval.keep;
        // Summed up with its sign: a valve that acts late moves the flow in time, and what that makes is gone with the next reversal.
        let by_lag = valve.unlagged.map_or(0.0, |(opening, fills_a)| {
            let filling = fills_a == (balance.side == Side::A);
            per_kg_per_s * (flow(filling, opening) - bore)
        });
        self.lag_pa = (self.lag_pa + by_lag) * interval.keep;
        let noise_pa = interval.parameters.pressure_pa + interval.parameters.position_m * per_metre;
        let metres_per_pa = 1.0 / per_metre;
        let contribution = Contribution {
            // A chamber that has grown more than its sensor says has lost pressure.
            missing_m: -balance.towards_b * unexplained_pa * metres_per_pa,
            allowed_m: allowed_pa * metres_per_pa,
            by_lag_m: -balance.towards_b * by_lag * metres_per_pa,
            metres_per_pa,
        };
        let check = Check { residual: self.residual_pa, threshold: noise_pa + self.allowance_pa + self.lag_pa.abs() };
        Found { check, noise_pa, stepped_pa: self.stepped_pa, steps_now: self.since_step < STRIKES, contribution }
    }
}

/// What one radian of opening changes the pressure by in a tick, filling and exhausting, over the energy of the air: to compare both
/// chambers by.
#[cold]
#[inline(never)]
pub(crate) fn by_opening(interval: &Interval<'_>, balance: &Balance) -> [f32; 2] {
    let atmosphere_pa = interval.plant.coefficients().atmosphere_pa;
    let orifices = interval.plant.orifices(balance.side);
    [true, false].map(|filling| {
        let flow = orifices.inflow(filling, 1.0, balance.pressure_pa, interval.supply_pa, atmosphere_pa);
        flow.mass_flow.abs() * balance.inverse_volume_per_m3
    })
}

/// Flow into or out of the chamber through the valve at either end of its command, whichever is larger.
#[cold]
#[inline(never)]
fn widest_kg_per_s(interval: &Interval<'_>, balance: &Balance) -> f32 {
    let m = interval.plant.coefficients();
    let end = |u_v: f32| {
        let opening = interval.plant.opening(u_v);
        let filling = opening.fills_a == (balance.side == Side::A);
        let orifices = interval.plant.orifices(balance.side);
        let (p, supply) = (balance.pressure_pa, interval.supply_pa);
        orifices.inflow(filling, opening.magnitude, p, supply, m.atmosphere_pa).mass_flow.abs()
    };
    end(m.max_voltage_v).at_least(end(-m.max_voltage_v))
}
