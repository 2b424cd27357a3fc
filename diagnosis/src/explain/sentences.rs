//! Sentences for people: what speaks for a cause, and which experiment would settle what the log leaves open.

use plant_model::Effect;

/// One sentence that names the quantity a technician can check; `growth` is by what part of itself the misfit grows
/// without the effect.
pub(crate) fn evidence(effect: Effect, values: &[f64], growth: f64) -> String {
    let v = |k: usize| values.get(k).copied().unwrap_or(0.0);
    let finding = match effect {
        Effect::ValveDeadZone => format!(
            "Air starts to flow at {:+.3} V and {:+.3} V instead of where the rig file puts the dead zone",
            v(0),
            v(1)
        ),
        Effect::ValveLag => format!("The flow follows the command with a lag of {:.1} ms", v(0) * 1e3),
        Effect::ValveHysteresis => {
            format!("The valve answers {:.0} mV late whenever the command turns round, however slowly", v(0) * 1e3)
        }
        Effect::FillCoefficient => {
            format!("Chambers fill at {:.0} % of the nominal flow at all pressures", v(0) * 100.0)
        }
        Effect::ExhaustCoefficient => {
            format!(
                "Chambers exhaust at {:.0} % of the nominal flow at all pressures (silencer, fittings)",
                v(0) * 100.0
            )
        }
        Effect::ChokedFlow => format!(
            "The flow depends on the ratio of pressures, not on their difference, with a critical ratio of {:.2}",
            v(0)
        ),
        Effect::SupplyDroop => format!(
            "The supply gives way under flow: {:.2} bar at 1 g/s, recovering within {:.0} ms",
            v(0) * 1.0e-3 * 1.0e-5,
            v(1) * 1e3
        ),
        Effect::LeakCrossPiston => {
            format!(
                "Air crosses the piston: {:.3} g/s at 1 bar difference; what one chamber loses the other gains",
                v(0) * 1e8
            )
        }
        Effect::LeakChamberA | Effect::LeakChamberB => {
            let name = if effect == Effect::LeakChamberA { "A" } else { "B" };
            format!(
                "Chamber {name} loses air to atmosphere even with the valve closed: {:.3} g/s at 1 bar gauge",
                v(0) * 1e8
            )
        }
        Effect::LineDelay => format!("The valve acts {:.1} ms after its command, at every frequency", v(0) * 1e3),
        Effect::DeadVolume => format!("Both chambers hold {:.1} cm3 more than stated (hoses, fittings)", v(0) * 1e6),
        Effect::HeatTransfer => format!(
            "Pressures react as if the gas exchanged heat with the walls: polytropic exponent {:.3} instead of 1.4",
            v(0)
        ),
        Effect::PayloadMass => format!("The force needed to accelerate is that of {:.2} kg", v(0)),
        Effect::ConstantForce => {
            format!("A constant force of {:+.2} N opposes motion towards chamber B, in both directions of motion", v(0))
        }
        Effect::CoulombFriction => format!("Sliding friction is {:.0} % of nominal at all speeds", v(0) * 100.0),
        Effect::ViscousFriction => format!("The part of friction that grows with speed is {:.1} N s/m", v(0)),
        Effect::StaticFriction => {
            format!("Breaking away from standstill takes {:.1} N, while sliding takes what it should", v(0))
        }
        Effect::FrictionAsymmetry => {
            format!("Friction is {:+.0} % larger towards chamber B and as much smaller the other way", v(0) * 100.0)
        }
        Effect::FrictionPosition => {
            if v(1).abs() * 3.0 > v(0).abs() && v(2) > 0.0 {
                format!("Friction ripples along the stroke by {:.0} % every {:.1} mm", v(1).abs() * 100.0, v(2) * 1e3)
            } else {
                format!("Friction changes along the stroke by {:+.0} % from the middle to the B end", v(0) * 100.0)
            }
        }
        Effect::FrictionPressure => {
            format!("Friction grows with the chamber pressures: {:.2} N for each bar of their sum", v(0) * 1e5)
        }
        Effect::PositionScale => {
            format!("Positions read {:+.2} % too large for the volumes and forces they go with", (v(0) - 1.0) * 100.0)
        }
        Effect::PressureAOffset | Effect::PressureBOffset => {
            let name = if effect == Effect::PressureAOffset { "A" } else { "B" };
            format!("Pressure sensor {name} reads {:+.3} bar off, in the flow law and in the force alike", v(0) * 1e-5)
        }
        Effect::PressureLag => format!("Both pressure sensors follow with a lag of {:.1} ms", v(0) * 1e3),
        Effect::PositionDelay => format!("The position signal comes {:.1} ms after the pressures", v(0) * 1e3),
    };
    let grows = if growth < 1.0 {
        format!("grows by {:.1} %", 100.0 * growth)
    } else {
        format!("is {:.1} times as large", 1.0 + growth)
    };
    format!("{finding}; without it the misfit of the fitted part of the log {grows}.")
}

/// The recording that would tell two effects apart, or make an effect visible.
pub(crate) fn separate(one: Effect, other: Effect) -> &'static str {
    use Effect as E;
    let pair = |a: E, b: E| (one == a && other == b) || (one == b && other == a);
    if pair(E::ConstantForce, E::FrictionAsymmetry) {
        "Hold both chambers at equal pressure with the piston disconnected from its load, or turn the cylinder round: a \
         constant force stays with the surroundings, an asymmetric seal turns with the cylinder. A log alone cannot tell \
         them apart."
    } else if pair(E::CoulombFriction, E::FrictionPressure) {
        "Repeat a slow stroke at two mean chamber pressures, for example with the supply at 4 bar and at 7 bar."
    } else if pair(E::ConstantForce, E::PressureAOffset) || pair(E::ConstantForce, E::PressureBOffset) {
        "Vent both chambers to atmosphere for a few seconds: a pressure offset stays, a force does not show."
    } else if pair(E::ValveLag, E::LineDelay) {
        "Record small command sines from 1 Hz to the highest the valve follows with the piston blocked: a lag loses \
         amplitude, a delay only phase."
    } else if pair(E::HeatTransfer, E::DeadVolume) {
        "Repeat fast strokes near both ends and in the middle: a dead volume matters most where the chamber is smallest, \
         heat exchange everywhere alike."
    } else if pair(E::FillCoefficient, E::SupplyDroop) {
        "Record the supply pressure at the valve."
    } else {
        "Record the sequence of `plant-sim experiment`: it excites every effect of the catalogue by itself."
    }
}
