//! How far the synthetic valve's paths are open with its spool at a place.
//!
//! Written from the formulas alone, like all of this crate.

use crate::physics::{Nodes, Physics};
use std::f64::consts::FRAC_PI_2;

/// The two sides of a table, positive commands first.
pub(crate) fn sides(points: &[[f64; 2]]) -> [Nodes; 2] {
    let [left, right] = closed(points);
    let side = |sign: f64, end: f64| {
        let mut nodes = vec![[0.0; 3]];
        let open = points.iter().filter(|[_, opening]| sign * opening > 0.0);
        nodes.extend(open.map(|[u, opening]| [sign * (u - end), sign * opening, 0.0]));
        nodes.sort_by(|one, other| one[0].total_cmp(&other[0]));
        with_slopes(nodes)
    };
    [side(1.0, right), side(-1.0, left)]
}

/// Slopes of the parabola through each three neighbours, in its middle point or at its outer one, kept from falling and from three
/// times the flatter neighbour.
fn with_slopes(mut nodes: Nodes) -> Nodes {
    let secant = |one: [f64; 3], other: [f64; 3]| (other[1] - one[1]) / (other[0] - one[0]);
    let parabola = |at: f64, three: [[f64; 3]; 3]| {
        let [a, b, c] = three;
        let bend = (secant(b, c) - secant(a, b)) / (c[0] - a[0]);
        secant(a, b) + bend * (2.0 * at - a[0] - b[0])
    };
    let last = nodes.len() - 1;
    let slope = |k: usize| {
        if last < 2 {
            return secant(nodes[0], nodes[last]);
        }
        let middle = k.clamp(1, last - 1);
        let three = [nodes[middle - 1], nodes[middle], nodes[middle + 1]];
        let slope = parabola(nodes[k][0], three).max(0.0);
        if middle == k { slope.min(3.0 * secant(three[0], three[1]).min(secant(three[1], three[2]))) } else { slope }
    };
    let slopes: Vec<f64> = (0..=last).map(slope).collect();
    nodes.iter_mut().zip(slopes).for_each(|(node, slope)| node[2] = slope);
    nodes
}

/// The commands between which a table is closed, V.
fn closed(points: &[[f64; 2]]) -> [f64; 2] {
    let zero = |inside: [f64; 2], outside: [f64; 2]| {
        inside[0] + (outside[0] - inside[0]) * inside[1] / (inside[1] - outside[1])
    };
    let first_open = points.iter().position(|[_, opening]| *opening > 0.0);
    let last_open = points.iter().rposition(|[_, opening]| *opening < 0.0);
    match (last_open, first_open) {
        (Some(left), Some(right)) => [zero(points[left + 1], points[left]), zero(points[right - 1], points[right])],
        _ => [0.0; 2],
    }
}

impl Physics {
    /// Openings in rad of the paths from the supply and of those to atmosphere with the spool at `u` in V; positive where A is filled
    /// and B exhausted.
    pub(crate) fn openings(&self, u: f64) -> [f64; 2] {
        let supply = self.opening(u, 0.0);
        [supply, if self.exhaust_overlap_v == 0.0 { supply } else { self.opening(u, self.exhaust_overlap_v) }]
    }

    /// The opening of paths whose break-points lie further out by `overlap`: `atan(2 w)`, the table's or the parabola's.
    fn opening(&self, u: f64, overlap: f64) -> f64 {
        let overlap = overlap.max(0.5 * (self.left_v - self.right_v));
        let r = self.rounding_v;
        // The mean of a sharp corner, over as far as it is rounded.
        let beyond = |x: f64| {
            let area = |x: f64| x.max(0.0).powi(2);
            if r > 0.0 { (area(x + r) - area(x - r)) / (4.0 * r) } else { x.max(0.0) }
        };
        let w =
            self.slope_right * beyond(u - self.right_v - overlap) - self.slope_left * beyond(self.left_v - overlap - u);
        if let Some([c, right, left]) = self.bent {
            let x = if w > 0.0 { w / right } else { -w / left }.min(1.0);
            return FRAC_PI_2 * (x - c * x * (1.0 - x)).copysign(w);
        }
        let side = &self.sides[usize::from(w < 0.0)];
        if side.is_empty() { (2.0 * w).atan() } else { FRAC_PI_2 * self.between(side, w.abs()).copysign(w) }
    }

    /// The opening of a side of the table at a distance from its end of flow, V.
    fn between(&self, side: &Nodes, distance: f64) -> f64 {
        let next = side.partition_point(|[at, ..]| *at <= distance);
        let (Some(from), Some(to)) = (next.checked_sub(1).map(|k| side[k]), side.get(next)) else {
            return side[side.len() - 1][1];
        };
        let span = to[0] - from[0];
        let s = (distance - from[0]) / span;
        let straight = from[1] + s * (to[1] - from[1]);
        // Hermite's basis.
        let cubic = (1.0 + 2.0 * s) * (1.0 - s).powi(2) * from[1]
            + s * (1.0 - s).powi(2) * span * from[2]
            + s * s * (3.0 - 2.0 * s) * to[1]
            - s * s * (1.0 - s) * span * to[2];
        (1.0 - self.smoothness) * straight + self.smoothness * cubic
    }

    /// Radians of opening per volt beyond the dead zone: of the arc tangent at its steepest, of a table from end to end.
    pub(crate) fn opening_per_volt(&self) -> f64 {
        match self.sides.each_ref().map(|side| side.last()) {
            [Some(right), Some(left)] => FRAC_PI_2 * (right[1] + left[1]) / (right[0] + left[0]),
            _ => 2.0,
        }
    }
}
