//! Chamber pressures that a rig settles at in slow motion.

use crate::effects::Side;
use crate::plant::Plant;
use crate::real::Real;
use crate::rig::Rig;

impl<R: Real> Rig<R> {
    /// The pressures that chambers A and B settle at in slow motion, where the valve's filling and exhausting flows balance,
    /// Pa absolute; with equal areas and the paper's flow law, level, both are
    /// `p* = (beta_fill p_sup + beta_exh p_atm) / (beta_fill + beta_exh)`, 3.618 bar for Table 1.
    #[must_use]
    pub fn equilibrium_pressures_pa(&self) -> [R; 2] {
        let even = self.cylinder.area_a_m2 == self.cylinder.area_b_m2 && self.load.inclination_deg == R::ZERO;
        if self.follows_iso6358() || !even || self.cylinder.is_single_acting() {
            return Plant::unchecked(self).equilibrium_pressures_pa();
        }
        let (fill, exhaust) = (self.valve.fill_coefficient_kg_per_s_pa, self.valve.exhaust_coefficient_kg_per_s_pa);
        [(fill * self.supply.pressure_pa + exhaust * self.supply.atmosphere_pa) / (fill + exhaust); 2]
    }

    /// The mean of [`Rig::equilibrium_pressures_pa`].
    #[must_use]
    pub fn equilibrium_pressure_pa(&self) -> R {
        let [a, b] = self.equilibrium_pressures_pa();
        R::HALF * (a + b)
    }
}

impl<R: Real> Plant<R> {
    /// The chamber pressures A and B in Pa absolute at which the piston is balanced without friction and slow motion lets
    /// as much air in as out: the mean of both directions. Below a supply that cannot carry the load, the nearest to it.
    #[must_use]
    pub fn equilibrium_pressures_pa(&self) -> [R; 2] {
        let m = self.coefficients();
        let (supply, atmosphere) = (m.supply_pa, m.atmosphere_pa);
        if self.single_acting {
            // At mid-stroke against the spring.
            let force_n = m.spring_preload_n + m.spring_n_per_m * m.half_stroke_m + self.weight_n;
            return [(atmosphere + force_n / m.area_a_m2).limit(atmosphere, supply), atmosphere];
        }
        // At a small opening, where hoses hold nothing back.
        let magnitude = R::of(0.01);
        let balanced_b = |p_a: R| {
            let p_b = atmosphere + (m.area_a_m2 * (p_a - atmosphere) - self.weight_n) / m.area_b_m2;
            p_b.limit(atmosphere, supply)
        };
        // Speed at which a chamber's flow lets the piston move, up to a factor.
        let speed = |side: Side, filling: bool, p: R| {
            let flow = self.orifices(side).inflow(filling, magnitude, p, supply, atmosphere).mass_flow;
            flow / (p * self.area_m2(side))
        };
        let [mut sum_a, mut sum_b] = [R::ZERO; 2];
        for fills_a in [true, false] {
            let (mut low, mut high) = (atmosphere, supply);
            for _ in 0..48 {
                let p_a = R::HALF * (low + high);
                // Both fall as the pressures rise: what flows in less, what flows out more.
                let surplus = speed(Side::A, fills_a, p_a) + speed(Side::B, !fills_a, balanced_b(p_a));
                if surplus > R::ZERO { low = p_a } else { high = p_a }
            }
            let p_a = R::HALF * (low + high);
            sum_a += R::HALF * p_a;
            sum_b += R::HALF * balanced_b(p_a);
        }
        [sum_a, sum_b]
    }
}
