//! The valve's opening over its command as a table (`valve.opening`), in place of dead zone, slopes and arc tangent.
//!
//! A catalogue draws the flow over the command. Its curve differs from `atan(2 w)` by far more than a dead zone: the arc
//! tangent is half-way up where a proportional valve has just begun to open.

use crate::real::Real;

/// Most points of a table: enough for fifteen on either side of mid position and one between.
pub const OPENING_POINTS: usize = 32;

/// Command in V and relative opening by point, commands rising. The opening is positive where chamber A is filled and B
/// exhausted, negative the other way round, ±1 where the valve is fully open. Between points it is a straight line, or a
/// cubic as far as `valve.opening_smoothness` says; beyond the last ones it stays.
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
    /// The part that the cubic has of the curve between points; the rest is straight.
    smoothness: R,
}

impl<R: Real> OpeningPoints<R> {
    /// `None` without a table.
    pub(crate) fn of(table: &OpeningTable<R>, smoothness: R) -> Option<Self> {
        if table.is_empty() {
            return None;
        }
        let [left, right] = table.closed_v();
        let full = R::PI * R::HALF;
        let mut curve = Self { points: [[R::ZERO; 2]; OPENING_POINTS], positive: 0, count: 0, smoothness };
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
        let side = self.side(w >= R::ZERO);
        let distance = w.abs();
        let k = side.partition_point(|[after, _]| *after <= distance);
        // Not kept: a microcontroller has several plants, and few tables that are not straight.
        let beyond = || (side.last().map_or(R::ZERO, |last| last[1]), R::ZERO);
        Piece::of(side, k, self.smoothness).map_or_else(beyond, |piece| piece.at(distance))
    }

    /// The curve beyond one end of flow, piece by piece, up to the last point; there the opening stays. What evaluates it often
    /// keeps them.
    pub fn pieces(&self, positive: bool) -> impl Iterator<Item = Piece<R>> + '_ {
        let side = self.side(positive);
        (0..side.len()).filter_map(move |k| Piece::of(side, k, self.smoothness))
    }

    /// The same points with another part of the monotone cubic between them.
    #[must_use]
    pub fn with_smoothness(&self, smoothness: R) -> Self {
        Self { smoothness, ..*self }
    }

    fn side(&self, positive: bool) -> &[[R; 2]] {
        let (from, to) = if positive { (0, self.positive) } else { (self.positive, self.count) };
        self.points.get(usize::from(from)..usize::from(to)).unwrap_or(&[])
    }
}

/// The opening between two points of a table: a polynomial of the distance from the first one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<R> {
    /// Distance beyond the end of flow where it begins, V.
    pub from: R,
    /// Where it ends, V.
    pub to: R,
    /// Of the powers 0 to 3 of the distance in V from where it begins; rad.
    pub coefficients: [R; 4],
}

impl<R: Real> Piece<R> {
    /// The `k`-th piece of a side, with a part of the monotone cubic in it.
    fn of(side: &[[R; 2]], k: usize, smoothness: R) -> Option<Self> {
        let line = Line::of(side, k)?;
        let [from, opening] = line.begin;
        let mut coefficients = [opening, line.slope, R::ZERO, R::ZERO];
        if smoothness != R::ZERO {
            let [begins, ends] = [k, k + 1].map(|k| node_slope(side, k) - line.slope);
            let bend = smoothness / line.length;
            coefficients[1] += smoothness * begins;
            coefficients[2] = -bend * (begins + begins + ends);
            coefficients[3] = bend / line.length * (begins + ends);
        }
        Some(Self { from, to: line.end, coefficients })
    }

    /// Magnitude in rad at a distance beyond the end of flow in V, and its derivative in rad/V.
    #[inline]
    #[must_use]
    pub fn at(&self, distance: R) -> (R, R) {
        let x = distance - self.from;
        let [constant, first, second, third] = self.coefficients;
        let value = constant + x * (first + x * (second + x * third));
        (value, first + x * (second + second + three::<R>() * x * third))
    }
}

/// The slope of the monotone cubic where the `k`-th line of a side begins: of the parabola through the three points there, at most
/// three times that of the flatter line beside it (Hyman 1983; de Boor and Swartz 1977).
fn node_slope<R: Real>(side: &[[R; 2]], k: usize) -> R {
    let line = |k: usize| Line::of(side, k);
    let end = |near: Line<R>, far: Option<Line<R>>| {
        let bent = |far: Line<R>| near.slope + near.length * (near.slope - far.slope) / (near.length + far.length);
        far.map_or(near.slope, bent).at_least(R::ZERO)
    };
    match (k.checked_sub(1).and_then(line), line(k)) {
        (Some(before), Some(after)) => {
            let sum = after.length * before.slope + before.length * after.slope;
            let parabola = sum / (before.length + after.length);
            parabola.at_most(three::<R>() * before.slope.at_most(after.slope))
        }
        (None, Some(first)) => end(first, line(1)),
        (Some(last), None) => end(last, k.checked_sub(2).and_then(line)),
        (None, None) => R::ZERO,
    }
}

fn three<R: Real>() -> R {
    R::ONE + R::ONE + R::ONE
}

/// A line between two points of a side.
struct Line<R> {
    /// The point where it begins.
    begin: [R; 2],
    /// Distance where it ends, V.
    end: R,
    /// V.
    length: R,
    /// rad/V.
    slope: R,
}

impl<R: Real> Line<R> {
    /// The `k`-th line of a side: from the point before to point `k`, the end of flow being the first one's.
    fn of(side: &[[R; 2]], k: usize) -> Option<Self> {
        let end = *side.get(k)?;
        let begin = k.checked_sub(1).and_then(|before| side.get(before)).copied().unwrap_or([R::ZERO; 2]);
        let length = end[0] - begin[0];
        Some(Self { begin, end: end[0], length, slope: (end[1] - begin[1]) / length })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const POINTS: [[f64; 2]; 7] =
        [[-5.0, -1.0], [-2.0, -0.5], [-0.4, 0.0], [0.5, 0.0], [1.0, 0.1], [3.0, 0.8], [4.5, 1.0]];

    #[test]
    fn the_opening_passes_through_every_point_and_is_continuous_over_the_whole_range() {
        let table = OpeningTable::new(&POINTS).unwrap();
        assert_eq!(table.closed_v(), [-0.4, 0.5]);
        for (smoothness, steepest) in [(0.0, 0.351e-3), (0.5, 0.44e-3), (1.0, 0.53e-3)] {
            let curve = OpeningPoints::of(&table, smoothness).unwrap();
            let at = |u: f64| {
                let w = if u > 0.5 {
                    u - 0.5
                } else if u < -0.4 {
                    u + 0.4
                } else {
                    0.0
                };
                let (opening, slope) = curve.at(w);
                let full = core::f64::consts::FRAC_PI_2;
                (w.signum() * opening / full, if w == 0.0 { 0.0 } else { slope / full })
            };
            for [u, fraction] in POINTS {
                assert!((at(u).0 - fraction).abs() < 1e-12, "{u} V: {}", at(u).0);
            }
            let curve: Vec<(f64, f64)> = (-6000..6000).map(|k| at(f64::from(k) * 1e-3)).collect();
            assert!(curve.windows(2).all(|pair| (0.0..steepest).contains(&(pair[1].0 - pair[0].0))));
            // Between two points the slope is the derivative; a smooth curve has one in the points beyond the end of flow, too.
            for pair in curve.windows(2) {
                let (rise, slope) = ((pair[1].0 - pair[0].0) / 1e-3, 0.5 * (pair[0].1 + pair[1].1));
                let kinks = (pair[1].1 - pair[0].1).abs() > 2e-3;
                assert!(kinks || (rise - slope).abs() < 2e-4, "{rise} {slope}");
            }
            let kinks = curve.windows(2).filter(|pair| (pair[1].1 - pair[0].1).abs() > 2e-3).count();
            let expected = if smoothness == 1.0 { 4 } else { 7 };
            assert_eq!(kinks, expected, "ends of flow, of the table, and the points between unless it is smooth");
        }
    }

    #[test]
    fn points_of_a_rounded_corner_are_joined_more_closely_by_the_cubic_than_by_straight_lines() {
        // A corner rounded over 75 mV, read every 50 mV.
        let exact = |u: f64| {
            if u < 0.125 {
                0.0
            } else if u < 0.275 {
                (u - 0.125).powi(2) / 0.3
            } else {
                u - 0.2
            }
        };
        let mut points = vec![[-5.0, -1.0], [0.125, 0.0]];
        points.extend([0.175, 0.225, 0.275, 0.35, 0.5, 0.75, 1.2].map(|u| [u, exact(u)]));
        let table = OpeningTable::new(&points).unwrap();
        let worst = |smoothness: f64, range: core::ops::Range<i32>| {
            let curve = OpeningPoints::of(&table, smoothness).unwrap();
            let error = |u: f64| curve.at(u - 0.125).0 / core::f64::consts::FRAC_PI_2 - exact(u);
            range.map(|k| error(1e-3 * f64::from(k)).abs()).fold(0.0, f64::max)
        };
        let sagitta = 0.05_f64.powi(2) / 1.2;
        assert!((worst(0.0, 126..275) - sagitta).abs() < 1e-12);
        assert!(worst(1.0, 126..225) < 1e-12, "a parabola is kept as it is");
        assert!(worst(1.0, 225..1200) < 0.6 * sagitta, "the end of the rounding lies in a point");
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
