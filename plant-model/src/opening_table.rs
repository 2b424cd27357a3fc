//! The valve's opening over its command as a table (`valve.opening`), in place of dead zone, slopes and arc tangent.
//!
//! A catalogue draws the flow over the command. Its curve differs from `atan(2 w)` by far more than a dead zone: the arc
//! tangent is half-way up where a proportional valve has just begun to open.

use crate::real::Real;

/// Most points of a table: enough for fifteen on either side of mid position and one between.
pub const OPENING_POINTS: usize = 32;

/// Command in V and relative opening by point, commands rising. The opening is positive where chamber A is filled and B
/// exhausted, negative the other way round, ±1 where the valve is fully open. Between points it is a straight line,
/// beyond the last ones it stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpeningTable<R> {
    points: [[R; 2]; OPENING_POINTS],
    count: u8,
}

impl<R: Real> OpeningTable<R> {
    /// No table.
    #[must_use]
    pub const fn none() -> Self {
        Self { points: [[R::ZERO; 2]; OPENING_POINTS], count: 0 }
    }

    /// A table of commands in V and openings.
    ///
    /// # Errors
    /// What the table must be, as the end of the sentence "must …".
    pub fn new(points: &[[R; 2]]) -> Result<Self, &'static str> {
        if points.len() > OPENING_POINTS {
            return Err("have at most 32 points: leave out those on straight lines");
        }
        let table = Self::unchecked(points);
        table.check().map(|()| table)
    }

    /// The table of the first points that there is room for.
    pub(crate) fn unchecked(points: &[[R; 2]]) -> Self {
        let mut table = Self::none();
        for (to, from) in table.points.iter_mut().zip(points) {
            *to = *from;
            table.count += 1;
        }
        table
    }

    /// The points; none where there is no table.
    #[must_use]
    pub fn points(&self) -> &[[R; 2]] {
        self.points.get(..usize::from(self.count)).unwrap_or(&[])
    }

    /// Whether there is no table.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    pub(crate) fn check(&self) -> Result<(), &'static str> {
        let points = self.points();
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(()) };
        let most = R::of(1.0e3);
        // A NaN fails every comparison.
        if !points.iter().all(|[u, opening]| u.abs() <= most && opening.abs() <= R::ONE) {
            return Err("hold commands from −1000 to 1000 V and openings from −1 to 1");
        }
        if !points.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] <= pair[1][1]) {
            return Err("rise: every command above the one before, no opening below");
        }
        if first[1] < R::ZERO && last[1] > R::ZERO { Ok(()) } else { Err("open to both sides") }
    }

    /// The commands in V between which the valve is closed: the last one before the opening falls below zero and the first
    /// one beyond which it rises; one and the same where the curve passes through zero.
    #[must_use]
    pub fn closed_v(&self) -> [R; 2] {
        let points = self.points();
        let crossing =
            |inner: &[R; 2], outer: &[R; 2]| inner[0] - inner[1] * (outer[0] - inner[0]) / (outer[1] - inner[1]);
        let (mut left, mut right) = (R::ZERO, R::ZERO);
        for pair in points.windows(2) {
            let [before, after] = [&pair[0], &pair[1]];
            if before[1] < R::ZERO && after[1] >= R::ZERO {
                left = crossing(after, before);
                right = left;
            } else if before[1] == R::ZERO && after[1] >= R::ZERO {
                right = before[0];
            }
            if after[1] > R::ZERO && before[1] >= R::ZERO {
                break;
            }
        }
        [left, right]
    }

    /// The same table with its ends of flow at other commands, V: what lies beyond them moves along.
    #[must_use]
    pub fn moved_to(&self, left_v: R, right_v: R) -> Self {
        let [left, right] = self.closed_v();
        let mut moved = *self;
        for point in &mut moved.points[..usize::from(self.count)] {
            if point[1] > R::ZERO || point[0] >= right {
                point[0] += right_v - right;
            } else if point[1] < R::ZERO || point[0] <= left {
                point[0] += left_v - left;
            }
        }
        moved
    }

    /// Changes the opening of a point; beyond the last one nothing.
    pub fn set_opening(&mut self, point: usize, opening: R) {
        if let Some(point) = self.points[..usize::from(self.count)].get_mut(point) {
            point[1] = opening;
        }
    }

    /// The table in another scalar type.
    #[must_use]
    pub fn convert<S: Real>(&self) -> OpeningTable<S> {
        OpeningTable { points: self.points.map(|point| point.map(|x| S::of(x.to_f64()))), count: self.count }
    }
}

/// A table as the plant uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpeningPoints<R> {
    /// Distance beyond the end of flow in V and magnitude in rad, both positive and rising: first those of positive
    /// commands, then those of negative ones.
    points: [[R; 2]; OPENING_POINTS],
    positive: u8,
    count: u8,
}

impl<R: Real> OpeningPoints<R> {
    /// `None` without a table.
    pub(crate) fn of(table: &OpeningTable<R>) -> Option<Self> {
        if table.is_empty() {
            return None;
        }
        let [left, right] = table.closed_v();
        let full = R::PI * R::HALF;
        let mut curve = Self { points: [[R::ZERO; 2]; OPENING_POINTS], positive: 0, count: 0 };
        let mut push = |distance: R, opening: R| {
            if let Some(point) = curve.points.get_mut(usize::from(curve.count)) {
                *point = [distance, opening * full];
                curve.count += 1;
            }
        };
        for [u, opening] in table.points().iter().filter(|point| point[1] > R::ZERO) {
            push(*u - right, *opening);
        }
        let positive = table.points().iter().filter(|point| point[1] > R::ZERO).count();
        for [u, opening] in table.points().iter().rev().filter(|point| point[1] < R::ZERO) {
            push(left - *u, -*opening);
        }
        curve.positive = positive as u8;
        Some(curve)
    }

    /// Magnitude in rad at an effective command in V, and its derivative by the command's magnitude in rad/V.
    #[inline(never)]
    pub(crate) fn at(&self, w: R) -> (R, R) {
        let (from, to) = if w >= R::ZERO { (0, self.positive) } else { (self.positive, self.count) };
        let side = self.points.get(usize::from(from)..usize::from(to)).unwrap_or(&[]);
        let distance = w.abs();
        let [mut before, mut opening] = [R::ZERO; 2];
        for [after, wider] in side {
            if distance < *after {
                let slope = (*wider - opening) / (*after - before);
                return (opening + slope * (distance - before), slope);
            }
            [before, opening] = [*after, *wider];
        }
        (opening, R::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const POINTS: [[f64; 2]; 7] =
        [[-5.0, -1.0], [-2.0, -0.5], [-0.4, 0.0], [0.5, 0.0], [1.0, 0.1], [3.0, 0.8], [4.5, 1.0]];

    #[test]
    fn the_opening_passes_through_every_point_and_is_continuous_over_the_whole_range() {
        let table = OpeningTable::new(&POINTS).unwrap();
        assert_eq!(table.closed_v(), [-0.4, 0.5]);
        let curve = OpeningPoints::of(&table).unwrap();
        let opening = |u: f64| {
            let w = if u > 0.5 {
                u - 0.5
            } else if u < -0.4 {
                u + 0.4
            } else {
                0.0
            };
            w.signum() * curve.at(w).0 / core::f64::consts::FRAC_PI_2
        };
        for [u, fraction] in POINTS {
            assert!((opening(u) - fraction).abs() < 1e-12, "{u} V: {}", opening(u));
        }
        let steps: Vec<f64> = (-6000..6000).map(|k| opening(f64::from(k) * 1e-3)).collect();
        // The steepest part of the table, 0.35 per V.
        assert!(steps.windows(2).all(|pair| (0.0..0.36e-3).contains(&(pair[1] - pair[0]))));
    }

    #[test]
    fn a_curve_without_a_dead_zone_is_closed_where_its_line_crosses_zero() {
        let table = OpeningTable::new(&[[-2.0, -1.0], [2.0, 0.6]]).unwrap();
        let [left, right] = table.closed_v();
        assert_eq!(left, right);
        assert!((left - 0.5).abs() < 1e-12);
        let moved = table.moved_to(left + 0.25, right + 0.25);
        assert_eq!(moved.points(), &[[-1.75, -1.0], [2.25, 0.6]]);
    }

    #[test]
    fn a_table_that_falls_or_opens_to_one_side_only_is_refused() {
        for bad in [
            &[[-1.0, -1.0], [0.0, 0.5], [1.0, 0.4]][..],
            &[[-1.0, -1.0], [-1.0, 0.0], [1.0, 1.0]],
            &[[0.0, 0.0], [1.0, 1.0]],
            &[[-1.0, -1.0], [1.0, 1.5]],
            &[[-1.0, -1.0], [1.0, f64::NAN]],
        ] {
            assert!(OpeningTable::new(bad).is_err(), "{bad:?}");
        }
    }
}
