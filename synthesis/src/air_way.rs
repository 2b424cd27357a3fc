//! The way of the air between the valve's ports and a chamber: valve and hose, by the paper's linear law or by ISO 6358.
//!
//! Written from the formulas alone, like all of this crate.

/// Air of the reference atmosphere ANR: kg/m3 and K.
const ANR: (f64, f64) = (1.185, 293.15);

/// How a valve's path passes air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Path {
    /// `q = beta (p_1 - p_2)` per radian of opening.
    Linear(f64),
    /// Sonic conductance in kg/(s Pa) per radian of opening, and critical ratio.
    Sonic(f64, f64),
}

/// A hose's or a throttle's sonic conductance in kg/(s Pa) and critical ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tube {
    pub(crate) conductance: f64,
    pub(crate) ratio: f64,
    /// Of a throttle behind a valve of the linear law: its resistance by that law, Pa s/kg. A hose follows ISO 6358 there, too.
    pub(crate) linear: Option<f64>,
}

/// kg/(s Pa) of m3/(s Pa).
pub(crate) fn mass_conductance(sonic: f64, temperature_k: f64) -> f64 {
    ANR.0 * sonic * (ANR.1 / temperature_k).sqrt()
}

impl Tube {
    /// A hose, unless it has no length.
    pub(crate) fn of(length: f64, diameter: f64, temperature_k: f64) -> Option<Self> {
        if length <= 0.0 {
            return None;
        }
        let sonic = 0.029 * diameter.powi(2) / (length / diameter.powf(1.25) + 510.0).sqrt();
        let ratio = 474.0 * sonic / diameter.powi(2);
        Some(Self { conductance: mass_conductance(sonic, temperature_k), ratio, linear: None })
    }

    /// A throttle. `full_drop` is `(p_sup - p_atm) / p_sup` of the rig, at which both laws let the same pass.
    pub(crate) fn throttle(conductance: f64, full_drop: f64) -> Self {
        Self { conductance, ratio: 0.3, linear: Some(full_drop / conductance) }
    }

    /// Flow by ISO 6358 with its infinite slope where no pressure drops, kg/s.
    fn flow(&self, up: f64, down: f64) -> f64 {
        let beyond = ((down / up - self.ratio) / (1.0 - self.ratio)).max(0.0);
        self.conductance * up * (1.0 - beyond.powi(2)).max(0.0).sqrt()
    }
}

/// Flow from `up` to `down` through a valve of the linear law and a hose, of which the valve is `upstream` or downstream, kg/s:
/// the pressure between them is where both let the same pass.
fn linear_and_hose(valve: f64, hose: &Tube, upstream: bool, up: f64, down: f64) -> f64 {
    if down > up {
        return -linear_and_hose(valve, hose, !upstream, down, up);
    }
    let (mut low, mut high) = (down, up);
    for _ in 0..60 {
        let between = 0.5 * (low + high);
        // More through the first of the two raises the pressure between them.
        let rises = if upstream {
            valve * (up - between) > hose.flow(between, down)
        } else {
            hose.flow(up, between) > valve * (between - down)
        };
        if rises { low = between } else { high = between }
    }
    let between = 0.5 * (low + high);
    if upstream { valve * (up - between) } else { valve * (between - down) }
}

/// Flow by ISO 6358 from `up` to `down`, kg/s.
fn sonic_flow(conductance: f64, critical: f64, up: f64, down: f64) -> f64 {
    if down > up {
        return -sonic_flow(conductance, critical, down, up);
    }
    let psi = |r: f64| {
        if r <= critical { 1.0 } else { (1.0 - ((r - critical) / (1.0 - critical)).powi(2)).max(0.0).sqrt() }
    };
    let r = down / up;
    // The last thousandth is laminar: a straight line to zero instead of an infinite slope.
    let psi = if r > 0.999 { psi(0.999) * (1.0 - r) / 0.001 } else { psi(r) };
    conductance * up * psi
}

impl Path {
    /// Flow from `up` to `down` at an opening in rad, of which pi/2 is full, kg/s; `tubes` in series, between valve and chamber,
    /// which is `filling` or not.
    pub(crate) fn flow(self, opening: f64, tubes: &[Tube], filling: bool, up: f64, down: f64) -> f64 {
        if opening <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Linear(beta) if tubes.is_empty() => opening * (beta * (up - down)),
            Self::Linear(beta) => {
                let lines: f64 = tubes.iter().filter_map(|tube| tube.linear).sum();
                let resistance = 1.0 / (beta * opening) + lines;
                match tubes.iter().find(|tube| tube.linear.is_none()) {
                    Some(hose) => linear_and_hose(1.0 / resistance, hose, filling, up, down),
                    None => (up - down) / resistance,
                }
            }
            Self::Sonic(per_rad, ratio) if tubes.is_empty() => opening * sonic_flow(per_rad, ratio, up, down),
            Self::Sonic(per_rad, ratio) => {
                let ways = tubes.iter().map(|tube| (tube.conductance, tube.ratio)).chain([(per_rad * opening, ratio)]);
                let cubes: f64 = ways.clone().map(|(c, _)| c.powi(-3)).sum();
                let lost: f64 = ways.map(|(c, b)| (1.0 - b) / c.powi(2)).sum();
                let all = cubes.powf(-1.0 / 3.0);
                sonic_flow(all, (1.0 - all * all * lost).max(0.0), up, down)
            }
        }
    }
}
