//! Inversion of the valve: from the rate of force asked for to the command, through flow, arc tangent and dead zone.

use super::air::Air;
use control::servo::constants::FULL_FLOW;
use rig_files::tuning::Pneumatics;

/// The valve as the law knows it; gains and dead zones are learned, one for each side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveModel {
    /// Dead zone towards filling A, V above the middle.
    pub right: f64,
    /// Dead zone towards filling B, V below the middle, positive.
    pub left: f64,
    /// Flow over nominal flow, filling A and filling B.
    pub gain: [f64; 2],
    /// Largest command, V.
    pub most: f64,
    /// Middle of the dead zone, V.
    pub centre: f64,
    /// How far it is open behind the dead zone.
    pub known: Pneumatics,
}

impl ValveModel {
    /// Effective voltage of a spool position, V.
    #[must_use]
    pub fn effective(&self, spool: f64) -> f64 {
        let from = spool - self.centre;
        if from > self.right {
            from - self.right
        } else if from < -self.left {
            from + self.left
        } else {
            0.0
        }
    }

    /// Angle of a spool position, rad: `atan(2 w)`, or by the rig's table.
    #[must_use]
    pub fn angle(&self, spool: f64) -> f64 {
        self.known.angle(self.effective(spool))
    }

    /// Force slope on the side of an angle, N/(s rad).
    #[must_use]
    pub fn slope(&self, theta: f64, air: &Air) -> f64 {
        if theta >= 0.0 { self.gain[0] * air.slope_fill_a } else { self.gain[1] * air.slope_fill_b }
    }

    /// The part of its limits that the reference uses: what the flow holds up, speed, acceleration and jerk alike, is
    /// proportional to it. All of them while nine tenths of the nominal flow are there: a gain is learned to some per cent.
    #[must_use]
    pub fn part_of_limits(&self) -> f64 {
        (self.gain[0].min(self.gain[1]) / FULL_FLOW).min(1.0)
    }

    /// The largest angle towards either side.
    #[must_use]
    pub fn most_angle(&self) -> f64 {
        self.known.angle(self.most - self.centre.abs() - self.right.max(self.left))
    }

    /// The angle that gives a rate of force, N/s, as far as the valve goes.
    #[must_use]
    pub fn angle_for(&self, rate: f64, air: &Air) -> f64 {
        let most = self.most_angle();
        (rate / self.slope(rate, air)).clamp(-most, most)
    }

    /// The command for an angle; `blend` is the angle below which the dead zone is crossed on a straight line.
    #[must_use]
    pub fn command(&self, theta: f64, blend: f64) -> f64 {
        let (w, _) = self.known.voltage(theta);
        let part = (theta.abs() / blend).min(1.0);
        let zone = if theta >= 0.0 { self.right } else { -self.left };
        (self.centre + w + part * zone).clamp(-self.most, self.most)
    }
}
