use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, one};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Picture, StartContext};
use super::terms::{ChamberFlow, Term};
use crate::chamber::{PressureRate, Volume};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Absent where the air stays as warm as the supply, as the paper has it.
    pub law: Option<Law<R>>,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.law.is_some()
    }
}

/// The energy balance of a chamber whose air has a temperature `T = T_s (1 + warmth)` of its own, `T_s` that of the supply and
/// of the walls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law<R> {
    /// Ratio of heat capacities, or the exponent that takes its place.
    exponent: R,
    /// `(n - 1) h T_s`, W/m2.
    heat: R,
}

/// Rate of a chamber's warmth in 1/s and its partial derivatives, as those of [`PressureRate`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WarmthRate<R> {
    pub(crate) rate: R,
    pub(crate) by_warmth: R,
    pub(crate) by_pressure: R,
    pub(crate) by_growth: R,
    pub(crate) by_displacement: R,
    pub(crate) by_mass_flow: R,
    /// Derivative of the pressure's rate by the warmth, Pa/s.
    pub(crate) pressure_by_warmth: R,
}

/// The walls of a chamber: the faces of piston and cover, and a barrel.
#[derive(Clone, Copy, Debug)]
pub struct Walls<R> {
    faces_m2: R,
    /// The barrel's surface over the volume, 1/m.
    barrel_per_m: R,
}

impl<R: Real> Walls<R> {
    /// Of a cylinder of this area.
    #[must_use]
    pub fn of(area_m2: R) -> Self {
        let two = R::ONE + R::ONE;
        Self { faces_m2: two * area_m2, barrel_per_m: two * (R::PI / area_m2).sqrt() }
    }

    /// Their surface over the volume, 1/m.
    #[inline(always)]
    #[must_use]
    pub fn surface_per_m(&self, inverse_volume_per_m3: R) -> R {
        self.faces_m2 * inverse_volume_per_m3 + self.barrel_per_m
    }
}

impl<R: Real> Law<R> {
    /// The factors of the mass flow of air as warm as the supply, and of the energy per mass: air leaves as warm as it is, and
    /// through the same opening in proportion to `1/sqrt(T)`.
    fn leaving(mass_flow: R, warmth: R) -> (R, R) {
        let warm = R::ONE + warmth;
        if mass_flow < R::ZERO { (R::ONE / warm.sqrt(), warm) } else { (R::ONE, R::ONE) }
    }

    /// Rates of pressure and warmth: `p' = (n R (T_s q_in - T q_out) - n p V' + (n-1) h S (T_s - T))/V` and
    /// `T' = T (p'/p + V'/V - R T q/(p V))`. `energy` is `R n T_s`, `flow` that of air as warm as the supply; the rest as in
    /// [`Volume::pressure_rate`].
    pub(crate) fn rates(
        &self,
        (volume, area_m2): (&Volume<R>, R),
        energy: R,
        p: R,
        growth: R,
        flow: &ChamberFlow<R>,
        warmth: R,
    ) -> (PressureRate<R>, WarmthRate<R>) {
        let inverse = volume.inverse_per_m3;
        let warm = R::ONE + warmth;
        let (thinner, carried) = Self::leaving(flow.mass_flow, warmth);
        let (q, by_p) = (flow.mass_flow * thinner, flow.by_chamber * thinner);
        let mut pressure = volume.pressure_rate(self.exponent, energy * carried, p, growth, q, by_p);
        pressure.by_mass_flow = pressure.by_mass_flow * thinner;
        let loss = self.heat * Walls::of(area_m2).surface_per_m(inverse);
        let faces = self.heat * (area_m2 + area_m2) * inverse;
        pressure.rate -= loss * warmth;
        pressure.by_displacement += faces * volume.area_m2 * inverse * warmth;

        // Over p: the rate of the pressure less that of the air's mass, plus that of the volume.
        let inverse_p = R::ONE / p;
        let per_flow = energy / self.exponent * inverse * inverse_p;
        let per_mass = per_flow * warm;
        let swept = volume.area_m2 * inverse;
        let growing = pressure.rate * inverse_p + swept * growth - per_mass * q;
        // Energy and volume of what leaves go with sqrt(T), what comes in takes no notice of T.
        let (energy_by_warmth, volume_by_warmth) = if flow.mass_flow < R::ZERO {
            (R::HALF * energy * q * inverse, R::HALF * per_flow * q)
        } else {
            (R::ZERO, per_flow * q)
        };
        let pressure_by_warmth = energy_by_warmth - loss;
        let warmth_rate = WarmthRate {
            rate: warm * growing,
            by_warmth: growing + warm * (pressure_by_warmth * inverse_p - volume_by_warmth),
            by_pressure: warm
                * (pressure.by_pressure * inverse_p - pressure.rate * inverse_p * inverse_p - per_mass * by_p
                    + per_mass * q * inverse_p),
            by_growth: warm * (pressure.by_growth * inverse_p + swept),
            by_displacement: warm
                * (pressure.by_displacement * inverse_p - swept * swept * growth + per_mass * q * swept),
            by_mass_flow: warm * (pressure.by_mass_flow * inverse_p - per_mass * thinner),
            pressure_by_warmth,
        };
        (pressure, warmth_rate)
    }

    /// The warmth of a chamber's air after the piston's motion has compressed it by this factor of pressure: to the second order
    /// of its difference from one, which is 3 % of the temperature at a factor of two.
    #[inline(always)]
    #[must_use]
    pub fn compressed(&self, warmth: R, factor: R) -> R {
        // p^(1-1/n)/T stays.
        let change = factor - R::ONE;
        let e = (self.exponent - R::ONE) / self.exponent;
        (R::ONE + warmth) * (R::ONE + e * change * (R::ONE + R::HALF * (e - R::ONE) * change)) - R::ONE
    }

    /// Pressure in Pa and warmth of a chamber's air after `dt_s` at a constant volume: a flow with its derivative by the pressure,
    /// and walls of this surface over the volume in 1/m. `pa_s_per_kg` is `R n T_s dt/V`.
    #[inline(always)]
    #[must_use]
    pub fn filled(
        &self,
        (p, warmth): (R, R),
        flow: &ChamberFlow<R>,
        pa_s_per_kg: R,
        surface_per_m: R,
        dt_s: R,
    ) -> (R, R) {
        let (thinner, carried) = Self::leaving(flow.mass_flow, warmth);
        let factor = pa_s_per_kg * carried * thinner;
        let gained = factor * flow.mass_flow / (R::ONE - R::HALF * factor * flow.by_chamber);
        let after = (p + gained).at_least(R::HALF * p);
        // The mass in units of p V/(R T_s): a flow at the supply's temperature adds 1/n of the pressure's gain.
        let before = p / (R::ONE + warmth);
        let mass = (before + (after - p) / (carried * self.exponent)).at_least(R::HALF * before);
        let warm = after / mass;
        let left = self.cooled(warm, after, surface_per_m, dt_s);
        (after * (R::ONE + left) / warm, left)
    }

    /// Warmth after a while of which only the pressures before and after are known. Compression, filling from a supply as warm
    /// as the air, and exhausting all change the temperature alike, as `p^(1-1/n)`; then the walls.
    #[must_use]
    pub fn meanwhile(&self, [before, after]: [R; 2], warmth: R, surface_per_m: R, dt_s: R) -> R {
        self.cooled(R::ONE + self.compressed(warmth, after / before), after, surface_per_m, dt_s)
    }

    /// Warmth that the walls leave after `dt_s` of air of a temperature over the supply's.
    #[inline(always)]
    fn cooled(&self, warm: R, p: R, surface_per_m: R, dt_s: R) -> R {
        // The rate is h S T (n-1)/(p V) while the mass stays.
        (warm - R::ONE) * (-self.heat * surface_per_m * warm / p * dt_s).exp()
    }
}

/// A plainly visible difference of the coefficient, W/(m2 K).
const VISIBLE_W_PER_M2_K: f64 = 20.0;

pub(super) struct WallHeat;

impl Definition for WallHeat {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "wall-heat",
        title: "Air cools and warms, and exchanges heat with the walls",
        equation: "p' = (n R (T_s q_in - T q_out) - n p V' + (n-1) h S (T_s - T))/V, T' = T (p'/p + V'/V - R T q/(p V)), q_out with sqrt(T_s/T)",
        signature: "a chamber that has exhausted or filled drifts on in pressure for a second while the valve is closed, and one that exhausts falls more slowly, because what leaves is cold",
        source: "energy balance of a chamber, Beater 2007, chapter 3; Carneiro and de Almeida 2006 measured 10 to 200 W/(m2 K)",
        parameters: &[ParameterInfo {
            name: "coefficient_w_per_m2_k",
            key: "effects.wall-heat.coefficient_w_per_m2_k",
            min: 0.0,
            max: 2000.0,
            typical: 30.0,
            meaning: "heat transfer coefficient h of walls as warm as the supply, W/(m2 K); 0: none, the air is adiabatic",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        replaces_a_law: true,
        starts_fitted: 2,
        confused_with: &[
            Confusion {
                with: Effect::HeatTransfer,
                kind: Likeness::Near,
                experiment: Some(
                    "Fill and exhaust a chamber in large steps and wait two seconds: air with a temperature of its own drifts on \
                     in pressure behind a closed valve, an exponent acts on motion and flow alone.",
                ),
            },
            Confusion {
                with: Effect::ExhaustCoefficient,
                kind: Likeness::Near,
                experiment: Some(
                    "Exhaust from the same pressure right after filling and after a rest of two seconds: a coefficient gives the \
                     same flow, cold air leaves more slowly.",
                ),
            },
        ],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Velocity,
                    "A pressure that drifts on behind every fast change: air that warms or cools at the walls.",
                ),
                Picture::new(
                    Balance::MassB,
                    Against::Velocity,
                    "A pressure that drifts on behind every fast change: air that warms or cools at the walls.",
                ),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        // A coefficient below zero stands for the paper's law: air that stays as warm as the supply.
        [-R::ONE, R::ZERO, R::ZERO]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], model: &Coefficients<R>) -> Terms<R> {
        let [coefficient, ..] = *values;
        let heat = (model.exponent - R::ONE) * coefficient * model.temperature_k;
        Terms { law: (coefficient >= R::ZERO).then_some(Law { exponent: model.exponent, heat }) }
    }

    fn scales(_rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_W_PER_M2_K)
    }

    fn negligible(_context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        // Air with a temperature is another law, not more or less of the nominal one.
        [0.0; MAX_PARAMETERS]
    }

    fn starts(_context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Still air at the wall and air stirred by the jet of the valve.
        begin(&[15.0]);
        begin(&[80.0]);
    }

    fn visible(_neutral: &[f64; MAX_PARAMETERS], _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [Self::INFO.parameters[0].typical, 0.0, 0.0]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The chambers' air cools and warms, and the walls give back its heat with {:.0} W/(m2 K)", values[0])
    }
}
