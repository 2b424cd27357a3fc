//! The equations, transcribed line by line with the paper's symbols. Plain `f64` from the standard library throughout.

/// Positions of the state's components in the vector handed to the solver.
pub mod state {
    /// Position `y`, m.
    pub const Y: usize = 0;
    /// Velocity `v`, m/s.
    pub const V: usize = 1;
    /// Pressure `p_a`, Pa absolute.
    pub const P_A: usize = 2;
    /// Pressure `p_b`, Pa absolute.
    pub const P_B: usize = 3;
    /// Bristle deflection `z`, m.
    pub const Z: usize = 4;
    /// Spool position, V.
    pub const SPOOL: usize = 5;
    /// Supply pressure at the valve, Pa absolute.
    pub const P_SUP: usize = 6;
    /// Lagged pressure signal of A, Pa absolute.
    pub const M_A: usize = 7;
    /// Lagged pressure signal of B, Pa absolute.
    pub const M_B: usize = 8;
    /// Lagged position signal, m.
    pub const M_Y: usize = 9;
}

/// Number of components of the state vector.
pub const NUMBER_OF_STATES: usize = 10;

/// Parameters by the paper's symbols (Tables 1 and 2), then those of the additional effects. SI units.
///
/// States 5 to 9 follow their sources at once where their time constant is zero.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "the paper's symbols; the additional ones are commented below")]
pub struct Reference {
    pub p_sup: f64,
    pub p_atm: f64,
    pub r: f64,
    pub t: f64,
    pub gamma: f64,
    pub m: f64,
    pub beta_ench: f64,
    pub beta_esv: f64,
    pub sigma0: f64,
    pub sigma1: f64,
    pub sigma2: f64,
    pub f_c: f64,
    pub f_s: f64,
    pub v_s: f64,
    pub z_ba: f64,
    pub area: f64,
    pub stroke: f64,
    pub v_a0: f64,
    pub v_b0: f64,
    pub z_md: f64,
    pub z_me: f64,
    pub md: f64,
    pub me: f64,

    /// Spool time constant, s.
    pub tau_spool: f64,
    /// ISO 6358: critical ratio and conductance scale.
    pub iso: Option<(f64, f64)>,
    /// Supply droop `k`, Pa s/kg, and time constant, s.
    pub droop: Option<(f64, f64)>,
    /// Cross-piston leak, kg/(s Pa).
    pub leak_ab: f64,
    /// Leak of A to atmosphere, kg/(s Pa).
    pub leak_a: f64,
    /// Leak of B to atmosphere, kg/(s Pa).
    pub leak_b: f64,
    /// Constant force against positive motion, N.
    pub f_0: f64,
    /// Friction asymmetry `a`.
    pub asymmetry: f64,
    /// Relative change of friction from mid-stroke to the end.
    pub slope: f64,
    /// Amplitude and wavelength (m) of friction along the stroke.
    pub wave: Option<(f64, f64)>,
    /// Friction per pressure, N/Pa.
    pub k_pressure: f64,
    /// Time constant of both pressure signals, s.
    pub tau_pressure: f64,
    /// Position sensor time constant, s.
    pub tau_position: f64,
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

impl Reference {
    /// Table 1 with one column of Table 2; what the paper leaves out as in `docs/model.md`.
    fn table(area: f64, stroke: f64, volume: f64) -> Self {
        Self {
            p_sup: 7e5,
            p_atm: 1e5,
            r: 287.0,
            t: 293.0,
            gamma: 1.4,
            m: 10.125,
            beta_ench: 0.69501e-8,
            beta_esv: 0.898105e-8,
            sigma0: 0.5e6,
            sigma1: 400.0,
            sigma2: 46.532,
            f_c: 23.103,
            f_s: 24.0,
            v_s: 0.010,
            z_ba: 3.234e-5,
            area,
            stroke,
            v_a0: volume,
            v_b0: volume,
            z_md: 0.0,
            z_me: 0.0,
            md: 1.0,
            me: 1.0,
            tau_spool: 0.0,
            iso: None,
            droop: None,
            leak_ab: 0.0,
            leak_a: 0.0,
            leak_b: 0.0,
            f_0: 0.0,
            asymmetry: 0.0,
            slope: 0.0,
            wave: None,
            k_pressure: 0.0,
            tau_pressure: 0.0,
            tau_position: 0.0,
        }
    }

    /// Case (a): small bore, long stroke.
    #[must_use]
    pub fn case_a() -> Self {
        Self::table(4.91e-4, 1.0, 2.5e-4)
    }

    /// Case (b): large bore, long stroke.
    #[must_use]
    pub fn case_b() -> Self {
        Self::table(2.8e-3, 1.0, 1.4e-3)
    }

    /// Case (c): large bore, short stroke.
    #[must_use]
    pub fn case_c() -> Self {
        Self::table(2.8e-3, 0.1746, 2.5e-4)
    }

    /// At rest at mid-stroke, both chambers at the pressure where filling and exhausting balance.
    #[must_use]
    pub fn start(&self) -> [f64; NUMBER_OF_STATES] {
        let p = (self.beta_ench * self.p_sup + self.beta_esv * self.p_atm) / (self.beta_ench + self.beta_esv);
        [0.0, 0.0, p, p, 0.0, 0.0, self.p_sup, p, p, 0.0]
    }

    /// (3.1).
    #[must_use]
    pub fn dead_zone(&self, u: f64) -> f64 {
        if u >= self.z_md {
            self.md * (u - self.z_md)
        } else if u <= self.z_me {
            self.me * (u - self.z_me)
        } else {
            0.0
        }
    }

    /// ISO 6358: flow from `up` to `down` per opening, for the conductance `beta` at full pressure drop. Above a ratio
    /// of 0.999, where the standard's curve becomes infinitely steep, a straight line leads to zero flow.
    fn iso_flow(&self, beta: f64, critical: f64, scale: f64, up: f64, down: f64) -> f64 {
        if down > up {
            return -self.iso_flow(beta, critical, scale, down, up);
        }
        let conductance = scale * beta * (self.p_sup - self.p_atm) / self.p_sup;
        let ratio = down / up;
        let ellipse = |r: f64| (1.0 - ((r - critical) / (1.0 - critical)).powi(2)).sqrt();
        let psi = if ratio <= critical {
            1.0
        } else if ratio < 0.999 {
            ellipse(ratio)
        } else {
            ellipse(0.999) * (1.0 - ratio) / 0.001
        };
        conductance * up * psi
    }

    /// (3.2) and (3.3): `q_ma` into A, `q_mb` out of B, kg/s, for the effective command `w`.
    #[must_use]
    pub fn flows(&self, w: f64, p_a: f64, p_b: f64, p_sup: f64) -> (f64, f64) {
        let (g_1, g_2) = match self.iso {
            None => {
                let g_1 = if w >= 0.0 { (p_sup - p_a) * self.beta_ench } else { (p_a - self.p_atm) * self.beta_esv };
                let g_2 = if w < 0.0 { (p_sup - p_b) * self.beta_ench } else { (p_b - self.p_atm) * self.beta_esv };
                (g_1, g_2)
            }
            Some((b, s)) => {
                let fill = |p| self.iso_flow(self.beta_ench, b, s, p_sup, p);
                let exhaust = |p| self.iso_flow(self.beta_esv, b, s, p, self.p_atm);
                if w >= 0.0 { (fill(p_a), exhaust(p_b)) } else { (exhaust(p_a), fill(p_b)) }
            }
        };
        (g_1 * (2.0 * w).atan(), g_2 * (2.0 * w).atan())
    }

    /// (3.11) with the effects of direction, position and pressure.
    #[must_use]
    pub fn g_ss(&self, y: f64, v: f64, p_a: f64, p_b: f64) -> f64 {
        let stribeck = self.f_c + (self.f_s - self.f_c) * (-(v / self.v_s).powi(2)).exp();
        let loaded = stribeck + self.k_pressure * (p_a + p_b - 2.0 * self.p_atm);
        let wave = self.wave.map_or(0.0, |(a, wavelength)| a * (std::f64::consts::TAU * y / wavelength).sin());
        loaded * (1.0 + self.asymmetry * sign(v)) * (1.0 + self.slope * y / (self.stroke / 2.0) + wave)
    }

    /// (3.12), with the missing `+ 1/2` and absolute value. (3.13) demands `z_ba < z_max`; effects can lower `z_max`
    /// below a given `z_ba`, which then counts as 0.95 `z_max`.
    #[must_use]
    pub fn alpha(&self, z: f64, v: f64, g: f64) -> f64 {
        let z_max = g / self.sigma0;
        let z_ba = self.z_ba.min(0.95 * z_max);
        if sign(v) != sign(z) || z.abs() <= z_ba {
            0.0
        } else if z.abs() >= z_max {
            1.0
        } else {
            let argument = (z.abs() - (z_max + z_ba) / 2.0) / (z_max - z_ba);
            0.5 * (std::f64::consts::PI * argument).sin() + 0.5
        }
    }

    /// Rates of change at valve command `u` in V.
    pub fn right_hand_side(&self, u: f64, x: &[f64], rates: &mut [f64]) {
        let (y, v, p_a, p_b, z) = (x[state::Y], x[state::V], x[state::P_A], x[state::P_B], x[state::Z]);
        let w = self.dead_zone(if self.tau_spool > 0.0 { x[state::SPOOL] } else { u });
        let p_sup = if self.droop.is_some() { x[state::P_SUP] } else { self.p_sup };

        let (q_ma, q_mb) = self.flows(w, p_a, p_b, p_sup);
        let q_leak = self.leak_ab * (p_a - p_b);
        let q_a = q_ma - q_leak - self.leak_a * (p_a - self.p_atm);
        let q_b = q_mb - q_leak + self.leak_b * (p_b - self.p_atm);

        let v_a = self.v_a0 + self.area * y;
        let v_b = self.v_b0 - self.area * y;
        let g = self.g_ss(y, v, p_a, p_b);
        let z_rate = v - self.alpha(z, v, g) * self.sigma0 / g * v.abs() * z;
        let f_fric = self.sigma0 * z + self.sigma1 * z_rate + self.sigma2 * v;

        rates[state::Y] = v;
        rates[state::V] = (self.area * (p_a - p_b) - f_fric - self.f_0) / self.m;
        rates[state::P_A] = (-self.area * self.gamma * v * p_a + self.r * self.gamma * self.t * q_a) / v_a;
        rates[state::P_B] = (self.area * self.gamma * v * p_b - self.r * self.gamma * self.t * q_b) / v_b;
        rates[state::Z] = z_rate;
        rates[state::SPOOL] = if self.tau_spool > 0.0 { (u - x[state::SPOOL]) / self.tau_spool } else { 0.0 };
        rates[state::P_SUP] = self.droop.map_or(0.0, |(k, tau)| {
            let drawn = if w >= 0.0 { q_ma } else { -q_mb };
            (self.p_sup - k * drawn - x[state::P_SUP]) / tau
        });
        let lag = |tau: f64, x: f64, m: f64| if tau > 0.0 { (x - m) / tau } else { 0.0 };
        rates[state::M_A] = lag(self.tau_pressure, p_a, x[state::M_A]);
        rates[state::M_B] = lag(self.tau_pressure, p_b, x[state::M_B]);
        rates[state::M_Y] = lag(self.tau_position, y, x[state::M_Y]);
    }
}
