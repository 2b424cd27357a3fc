//! The list of effects: one line each.

/// The catalogue: hands `Name => file` of every effect to a macro, in the order in which effects are applied.
///
/// A crate that has something of its own to say about every effect passes a macro that declares `mod file;` and matches
/// on `Effect::Name`: then a missing file is a compile error, and nothing has to be listed twice.
#[macro_export]
macro_rules! for_each_effect {
    ($callback:ident) => {
        $callback! {
            ValveDeadZone => valve_dead_zone,
            OpeningCurve => opening_curve,
            ValveLag => valve_lag,
            ValveHysteresis => valve_hysteresis,
            FillCoefficient => fill_coefficient,
            ExhaustCoefficient => exhaust_coefficient,
            LineRestriction => line_restriction,
            Cushioning => cushioning,
            ChokedFlow => choked_flow,
            SupplyDroop => supply_droop,
            LeakCrossPiston => leak_cross_piston,
            LeakChamberA => leak_chamber_a,
            LeakChamberB => leak_chamber_b,
            LineDelay => line_delay,
            DeadVolume => dead_volume,
            HeatTransfer => heat_transfer,
            WallHeat => wall_heat,
            PayloadMass => payload_mass,
            ConstantForce => constant_force,
            CoulombFriction => coulomb_friction,
            ViscousFriction => viscous_friction,
            StaticFriction => static_friction,
            FrictionAsymmetry => friction_asymmetry,
            FrictionPosition => friction_position,
            FrictionPressure => friction_pressure,
            PositionScale => position_scale,
            PressureAOffset => pressure_a_offset,
            PressureBOffset => pressure_b_offset,
            PressureAGain => pressure_a_gain,
            PressureBGain => pressure_b_gain,
            PressureLag => pressure_lag,
            PositionDelay => position_delay,
            PistonArea => piston_area,
            PositionLag => position_lag,
        }
    };
}
