//! From a rig to the controller and the monitor made for it.

use control::Parameters;
use plant_model::{Cylinder, Friction, Gas, Load, Real, Rig, Supply, Valve};
use rig_files::{InputError, RigFile};
use std::path::Path;

/// The rig called `name`: `paper-a`, `paper-b`, `paper-c`, or a rig file relative to `folder`.
///
/// # Errors
/// The rig file cannot be read.
pub fn find(name: &str, folder: &Path) -> Result<RigFile, InputError> {
    match name {
        "paper-a" => Ok(RigFile::paper_a()),
        "paper-b" => Ok(RigFile::paper_b()),
        "paper-c" => Ok(RigFile::paper_c()),
        path => RigFile::read(&folder.join(path)),
    }
}

/// The controller's parameters for a rig: its converters, its supply and, for the inverse, its dead zone; everything
/// else as by default.
#[must_use]
pub fn parameters(rig: &RigFile) -> Parameters {
    let valve = &rig.rig.valve;
    Parameters {
        position_range_m: rig.io.position_range_m.map(|x| x as f32),
        pressure_range_pa: rig.io.pressure_range_pa.map(|x| x as f32),
        adc_bits: rig.io.adc_bits as u8,
        valve_range_v: rig.io.valve_range_v.map(|x| x as f32),
        dac_bits: rig.io.dac_bits as u8,
        tick_hz: rig.io.tick_hz,
        dead_zone_right_v: valve.dead_zone_right_v as f32,
        dead_zone_left_v: valve.dead_zone_left_v as f32,
        slope_right: valve.slope_right as f32,
        slope_left: valve.slope_left as f32,
        max_voltage_v: valve.max_voltage_v as f32,
        ..Parameters::default()
    }
}

/// The rig in another scalar type, as the board holds it.
#[must_use]
pub fn convert<S: Real>(rig: &Rig<f64>) -> Rig<S> {
    let (g, s, v, c, f) = (&rig.gas, &rig.supply, &rig.valve, &rig.cylinder, &rig.friction);
    Rig {
        gas: Gas {
            gas_constant_j_per_kg_k: S::of(g.gas_constant_j_per_kg_k),
            temperature_k: S::of(g.temperature_k),
            heat_capacity_ratio: S::of(g.heat_capacity_ratio),
        },
        supply: Supply { pressure_pa: S::of(s.pressure_pa), atmosphere_pa: S::of(s.atmosphere_pa) },
        valve: Valve {
            fill_coefficient_kg_per_s_pa: S::of(v.fill_coefficient_kg_per_s_pa),
            exhaust_coefficient_kg_per_s_pa: S::of(v.exhaust_coefficient_kg_per_s_pa),
            dead_zone_right_v: S::of(v.dead_zone_right_v),
            dead_zone_left_v: S::of(v.dead_zone_left_v),
            slope_right: S::of(v.slope_right),
            slope_left: S::of(v.slope_left),
            max_voltage_v: S::of(v.max_voltage_v),
        },
        cylinder: Cylinder {
            area_m2: S::of(c.area_m2),
            stroke_m: S::of(c.stroke_m),
            volume_a0_m3: S::of(c.volume_a0_m3),
            volume_b0_m3: S::of(c.volume_b0_m3),
        },
        load: Load { mass_kg: S::of(rig.load.mass_kg) },
        friction: Friction {
            stiffness_n_per_m: S::of(f.stiffness_n_per_m),
            damping_n_s_per_m: S::of(f.damping_n_s_per_m),
            viscous_n_s_per_m: S::of(f.viscous_n_s_per_m),
            coulomb_n: S::of(f.coulomb_n),
            static_n: S::of(f.static_n),
            stribeck_velocity_m_per_s: S::of(f.stribeck_velocity_m_per_s),
            breakaway_m: S::of(f.breakaway_m),
        },
    }
}
