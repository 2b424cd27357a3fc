//! Effects that are *not* in the catalogue: what a diagnosis must not name, because it has no name for it.

/// One effect outside the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Foreign {
    /// Air or grease drag that grows with the square of the velocity, `c v |v|`.
    QuadraticDrag,
    /// The air gets warmer or colder during the recording, at a constant rate.
    TemperatureDrift,
    /// The position sensor bows: `y + e (L/2) sin(pi y / (L/2))`.
    PositionBow,
    /// Play between the rod and a part of the load.
    Backlash,
    /// A part of the load hangs on a spring.
    ElasticLoad,
    /// Static friction grows while the piston rests.
    DwellStiction,
    /// The supply pulsates with the compressor.
    SupplyPulsation,
    /// Seals run in: friction falls exponentially during the recording.
    FrictionDrift,
    /// The spool moves at a limited rate.
    SpoolSlew,
}

/// Name, range and meaning of one parameter of a foreign effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForeignParameter {
    /// Name with unit.
    pub name: &'static str,
    /// Range of everyday strength.
    pub range: [f64; 2],
}

const fn parameter(name: &'static str, low: f64, high: f64) -> ForeignParameter {
    ForeignParameter { name, range: [low, high] }
}

impl Foreign {
    /// All that the catalogue has no name for.
    pub const ALL: [Self; 9] = [
        Self::QuadraticDrag,
        Self::TemperatureDrift,
        Self::PositionBow,
        Self::Backlash,
        Self::ElasticLoad,
        Self::DwellStiction,
        Self::SupplyPulsation,
        Self::FrictionDrift,
        Self::SpoolSlew,
    ];

    /// Identifier on the command line and in truth files.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::QuadraticDrag => "foreign-quadratic-drag",
            Self::TemperatureDrift => "foreign-temperature-drift",
            Self::PositionBow => "foreign-position-bow",
            Self::Backlash => "foreign-backlash",
            Self::ElasticLoad => "foreign-elastic-load",
            Self::DwellStiction => "foreign-dwell-stiction",
            Self::SupplyPulsation => "foreign-supply-pulsation",
            Self::FrictionDrift => "foreign-friction-drift",
            Self::SpoolSlew => "foreign-spool-slew",
        }
    }

    /// The effect with this identifier.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|foreign| foreign.id() == id)
    }

    /// Its two parameters with the range of everyday strength. Where a range spans both signs the middle third is left
    /// out when drawing. Lengths are relative to half the stroke, forces to `F_c`, so that rigs compare.
    #[must_use]
    pub const fn parameters(self) -> [ForeignParameter; 2] {
        let unused = parameter("unused", 0.0, 0.0);
        match self {
            // Relative to the Coulomb force, at half the rig's top speed.
            Self::QuadraticDrag => [parameter("force_ratio", 0.6, 2.0), unused],
            Self::TemperatureDrift => [parameter("total_k", -45.0, 45.0), unused],
            Self::PositionBow => [parameter("amplitude_ratio", -0.03, 0.03), unused],
            Self::Backlash => [parameter("gap_m", 0.5e-3, 2.0e-3), parameter("mass_share", 0.4, 0.7)],
            Self::ElasticLoad => [parameter("frequency_hz", 3.0, 9.0), parameter("mass_share", 0.3, 0.6)],
            Self::DwellStiction => [parameter("rise_ratio", 0.8, 2.0), parameter("time_constant_s", 0.2, 0.8)],
            Self::SupplyPulsation => [parameter("amplitude_pa", 2.0e4, 6.0e4), parameter("frequency_hz", 0.3, 2.0)],
            Self::FrictionDrift => [parameter("lost_ratio", 0.4, 0.7), parameter("time_constant_s", 8.0, 20.0)],
            Self::SpoolSlew => [parameter("rate_v_per_s", 60.0, 150.0), unused],
        }
    }
}
