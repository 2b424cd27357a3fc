use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, typical_scale};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, StartContext};
use super::terms::Term;
use crate::coefficients::{Coefficients, ValvePaths};
use crate::flow::Flow;
use crate::real::Real;
use crate::rig::Rig;
use crate::tube::Tube;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Critical ratio and conductance scale; absent for the linear law of the paper.
    pub law: Option<(R, R)>,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.law.is_some()
    }
}

impl<R: Real> Terms<R> {
    /// The law of a valve's paths, unless it is the linear one. On a valve that follows ISO 6358 by itself, the effect
    /// changes its numbers.
    pub(crate) fn on(&self, valve: &ValvePaths<R>, supply_pa: R, atmosphere_pa: R) -> Option<Iso6358<R>> {
        let scaled = |scale: R, fill_ratio: R, exhaust_ratio: R| Iso6358 {
            fill_ratio,
            exhaust_ratio,
            fill: valve.fill * scale,
            exhaust: valve.exhaust * scale,
        };
        match (self.law, valve.critical_ratios) {
            (None, None) => None,
            (None, Some([fill, exhaust])) => Some(scaled(R::ONE, fill, exhaust)),
            (Some((ratio, scale)), Some(_)) => Some(scaled(scale, ratio, ratio)),
            // With scale 1 the two laws agree at full pressure drop from supply to atmosphere.
            (Some((ratio, scale)), None) => Some(scaled(scale * (supply_pa - atmosphere_pa) / supply_pa, ratio, ratio)),
        }
    }
}

/// Parameters of the ISO 6358 law `q = C p_up psi(p_down / p_up)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iso6358<R> {
    /// Critical pressure ratio `b` of filling, 0 to below 1.
    pub fill_ratio: R,
    /// Critical pressure ratio `b` of exhausting, 0 to below 1.
    pub exhaust_ratio: R,
    /// `C` of filling, kg/(s Pa) per rad of opening.
    pub fill: R,
    /// `C` of exhausting, kg/(s Pa) per rad of opening.
    pub exhaust: R,
}

/// Above this pressure ratio the ISO law's infinite slope is replaced by a straight (laminar) line to zero flow.
const LAMINAR_RATIO: f64 = 0.999;

/// `psi(r)` of ISO 6358 and its derivative, laminar near `r = 1`.
#[inline]
#[must_use]
pub fn psi<R: Real>(ratio: R, critical: R) -> (R, R) {
    if ratio <= critical {
        return (R::ONE, R::ZERO);
    }
    let span = R::ONE - critical;
    let curve = |r: R| {
        let s = (r - critical) / span;
        let root = (R::ONE - s * s).at_least(R::ZERO).sqrt();
        (root, s)
    };
    let laminar = R::of(LAMINAR_RATIO);
    if ratio >= laminar {
        let (root, _) = curve(laminar);
        let slope = -root / (R::ONE - laminar);
        return ((R::ONE - ratio).at_least(R::ZERO) * -slope, slope);
    }
    let (root, s) = curve(ratio);
    (root, -s / (span * root))
}

/// `d ln psi / d b` at a ratio of pressures.
#[inline]
fn log_psi_by_critical<R: Real>(ratio: R, critical: R) -> R {
    if ratio <= critical {
        return R::ZERO;
    }
    // The laminar line scales with the curve's value where the two meet.
    let ratio = ratio.at_most(R::of(LAMINAR_RATIO));
    let span = R::ONE - critical;
    let s = (ratio - critical) / span;
    s * (R::ONE - ratio) / (span * span * (R::ONE - s * s))
}

/// Flow through one orifice from `up` to `down` by ISO 6358, positive that way, with derivatives by both.
#[inline]
fn iso_flow<R: Real>(conductance: R, critical: R, up: R, down: R) -> (R, R, R) {
    let backward = down > up;
    let (from, to) = if backward { (down, up) } else { (up, down) };
    let ratio = to / from;
    let (value, slope) = psi(ratio, critical);
    let (q, by_from, by_to) = (conductance * from * value, conductance * (value - slope * ratio), conductance * slope);
    if backward { (-q, -by_to, -by_from) } else { (q, by_from, by_to) }
}

impl<R: Real> Iso6358<R> {
    #[inline(always)]
    pub(crate) fn inflow(
        &self,
        hose: Option<&Tube<R>>,
        filling: bool,
        magnitude: R,
        p: R,
        supply: R,
        atmosphere: R,
    ) -> Flow<R> {
        let (full, ratio) = if filling { (self.fill, self.fill_ratio) } else { (self.exhaust, self.exhaust_ratio) };
        let (mut conductance, mut critical, mut opening_exponent) = (full * magnitude, ratio, R::ONE);
        if let Some(hose) = hose {
            let series = hose.behind(conductance, critical);
            (conductance, critical) = (series.conductance, series.critical_ratio);
            let (up, down) = if filling { (supply, p) } else { (p, atmosphere) };
            let ratio = if down > up { up / down } else { down / up };
            opening_exponent = series.exponent + log_psi_by_critical(ratio, critical) * series.ratio_by_log;
        }
        if filling {
            let (mass_flow, by_supply, by_chamber) = iso_flow(conductance, critical, supply, p);
            Flow { mass_flow, by_chamber, by_supply, by_distance: R::ZERO, opening_exponent }
        } else {
            let (out, by_chamber, _) = iso_flow(conductance, critical, p, atmosphere);
            Flow {
                mass_flow: -out,
                by_chamber: -by_chamber,
                by_supply: R::ZERO,
                by_distance: R::ZERO,
                opening_exponent,
            }
        }
    }
}

/// A plainly visible change of the conductance.
const VISIBLE_SCALE: f64 = 0.1;

pub(super) struct ChokedFlow;

impl Definition for ChokedFlow {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "choked-flow",
        title: "Choked valve flow",
        equation: "q = s C p_up psi(p_down/p_up) atan(2w), C = beta (p_sup - p_atm)/p_sup, psi = 1 up to b, sqrt(1 - ((r-b)/(1-b))^2) above",
        signature: "the flow error collapses on the pressure ratio p_down/p_up; a wrong coefficient does not",
        source: "ISO 6358-1:2013",
        parameters: &[
            ParameterInfo {
                name: "critical_ratio",
                key: "effects.choked-flow.critical_ratio",
                min: 0.0,
                max: 0.9,
                typical: 0.3,
                meaning: "critical pressure ratio b",
            },
            ParameterInfo {
                name: "conductance_scale",
                key: "effects.choked-flow.conductance_scale",
                min: 0.05,
                max: 10.0,
                typical: 1.0,
                meaning: "factor s on both conductances; 1 gives the linear law's flow at full pressure drop",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        starts_fitted: 2,
        replaces_a_law: true,
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::PressureA,
                    "A bent curve: the flow is not proportional to the pressure drop.",
                )
                .only(Only::Filling),
                Picture::new(
                    Balance::MassA,
                    Against::PressureA,
                    "A bent curve: the flow is not proportional to the pressure drop.",
                )
                .only(Only::Exhausting),
            ],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        let v = &rig.valve;
        if rig.follows_iso6358() {
            let ratios = v.fill_critical_ratio_a + v.exhaust_critical_ratio_a + v.fill_critical_ratio_b;
            return [R::of(0.25) * (ratios + v.exhaust_critical_ratio_b), R::ONE, R::ZERO];
        }
        // A critical ratio below zero stands for the linear law.
        [-R::ONE, R::ONE, R::ZERO]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { law: (values[0] >= R::ZERO).then_some((values[0], values[1])) }
    }

    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [typical_scale(Self::INFO.parameters[0].typical, neutral[0]), VISIBLE_SCALE, 1.0]
    }

    fn negligible(_context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        // A choked valve is another law, not more or less of the nominal one.
        [0.0; MAX_PARAMETERS]
    }

    fn starts(_context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // A sharp and a soft law: valves lie between.
        begin(&[0.25, 1.0]);
        begin(&[0.5, 0.9]);
    }

    fn visible(_neutral: &[f64; MAX_PARAMETERS], _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [0.3, 1.0, 0.0]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The flow depends on the ratio of pressures, not on their difference, with a critical ratio of {:.2}",
            values[0]
        )
    }
}
