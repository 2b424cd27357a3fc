//! The controlled stop, stop category 1 of IEC 60204-1: after a trip the valve goes on moving for a bounded time, so that the forces
//! of both chambers come to balance, and only then goes to the safe voltage.
//!
//! A valve that closes at once (stop category 0) keeps the difference of pressures of that moment in the chambers, and it moves the
//! piston on. To let it out takes neither a velocity nor a trusted position, but a supply, a valve that obeys and at least one
//! pressure. So one cause alone permits it:
//!
//! | what is wrong | the stop |
//! | --- | --- |
//! | one sensor: range, rate, stuck | goes on without it |
//! | supply pressure low, timing, silent host | goes on |
//! | readings that contradict each other, where the monitor names the sensor | goes on without it |
//! | any other contradiction, a valve output that is not what was written | at once |
//! | a second of these at the trip, or in the stop | at once |
//!
//! It begins under the positioning law alone, and not while hold keeps the valve silent: the piston rests then, and the force may
//! carry a load that no rig file knows. The law's part is `servo::equalise`.

/// What is wrong in a tick, one bit for each source.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Causes(u8);

impl Causes {
    /// The position sensor.
    pub(crate) const POSITION: Self = Self(1);
    /// The pressure sensor of chamber A.
    pub(crate) const PRESSURE_A: Self = Self(1 << 1);
    /// The pressure sensor of chamber B.
    pub(crate) const PRESSURE_B: Self = Self(1 << 2);
    /// The supply or its sensor.
    pub(crate) const SUPPLY: Self = Self(1 << 3);
    /// Ticks or samples, missing or late.
    pub(crate) const TIMING: Self = Self(1 << 4);
    /// A host that is silent.
    pub(crate) const HOST: Self = Self(1 << 5);
    /// Faults after which the valve must close at once (stop category 0).
    pub(crate) const AT_ONCE: Self = Self(1 << 6);

    /// The same and `cause`, where it `applies`.
    #[inline]
    pub(crate) fn and(self, cause: Self, applies: bool) -> Self {
        if applies { Self(self.0 | cause.0) } else { self }
    }

    /// Whether one of these spoils what the law learns: a reading or the valve.
    #[inline]
    pub(crate) fn spoil_learning(self) -> bool {
        self.contain(Self(!(Self::SUPPLY.0 | Self::TIMING.0 | Self::HOST.0)))
    }

    #[inline]
    fn contain(self, cause: Self) -> bool {
        self.0 & cause.0 != 0
    }
}

/// How far the stop is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stop {
    ticks_left: u16,
    causes: Causes,
}

impl Stop {
    /// At a trip; over at once unless one cause alone permits more.
    #[inline]
    pub(crate) fn begin(ticks: u16, causes: Causes) -> Self {
        let permitted = causes.0.is_power_of_two() && causes != Causes::AT_ONCE;
        if permitted { Self { ticks_left: ticks, causes } } else { Self::default() }
    }

    /// A tick after the trip, `missed` ticks after the last one; another cause ends it.
    #[inline]
    pub(crate) fn advance(&mut self, missed: u8, causes: Causes) {
        let ticks_left = self.ticks_left.saturating_sub(1 + u16::from(missed));
        if ticks_left == 0 || causes.contain(Causes(!self.causes.0)) {
            *self = Self::default();
        } else {
            self.ticks_left = ticks_left;
        }
    }

    /// Whether the valve still moves.
    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        self.ticks_left > 0
    }

    /// Whether it goes on in spite of `cause`; of a sensor nothing counts then.
    #[inline]
    pub(crate) fn is_for(&self, cause: Causes) -> bool {
        self.causes.contain(cause)
    }
}
