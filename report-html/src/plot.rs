//! What a plot shows, independent of how it is drawn.

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line over increasing x; NaN in y interrupts it.
    Line,
    /// A line over increasing x that holds each value until the next.
    Steps,
    /// Separate points, in any order of x.
    Dots,
    /// A line through the points in their order, x going where it likes (loops, characteristics).
    Curve,
}

/// One series of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Legend text.
    pub name: String,
    /// Abscissae; increasing for [`Style::Line`] and [`Style::Steps`].
    pub x: Vec<f64>,
    /// Ordinates, as many as `x`; NaN is a gap.
    pub y: Vec<f64>,
    /// How it is drawn.
    pub style: Style,
    /// Drawn dashed: references, bounds, the model against the measurement.
    pub dashed: bool,
    /// Index into the palette; by default the place of the series in the plot.
    pub colour: Option<usize>,
}

impl Series {
    fn new(style: Style, name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { name: name.into(), x, y, style, dashed: false, colour: None }
    }
    /// A line over increasing x.
    pub fn line(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(Style::Line, name, x, y)
    }
    /// A staircase over increasing x.
    pub fn steps(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(Style::Steps, name, x, y)
    }
    /// Separate points.
    pub fn dots(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(Style::Dots, name, x, y)
    }
    /// A line through points in their order.
    pub fn curve(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self::new(Style::Curve, name, x, y)
    }
    /// The same series dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }
    /// The same series in a colour of the palette.
    #[must_use]
    pub fn colour(mut self, index: usize) -> Self {
        self.colour = Some(index);
        self
    }
}

/// A straight line across the plot.
#[derive(Clone, Debug, PartialEq)]
pub enum Marker {
    /// At this ordinate.
    Horizontal(f64),
    /// At this abscissa.
    Vertical(f64),
}

/// A plot: title, axes, series.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Heading above the plot.
    pub title: String,
    /// Axis label with unit.
    pub x_label: String,
    /// Axis label with unit.
    pub y_label: String,
    /// A sentence under the plot; may be empty.
    pub note: String,
    /// The series, drawn in order.
    pub series: Vec<Series>,
    /// Thin grey lines for limits and events.
    pub markers: Vec<Marker>,
    /// Plots with the same name share their cursor.
    pub cursor_group: Option<String>,
    /// Height in the page, pixels.
    pub height_px: u32,
    /// Fixed range of x; by default that of the data.
    pub x_range: Option<[f64; 2]>,
    /// Fixed range of y; by default that of the data.
    pub y_range: Option<[f64; 2]>,
}

impl Plot {
    /// An empty plot.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            note: String::new(),
            series: Vec::new(),
            markers: Vec::new(),
            cursor_group: None,
            height_px: 300,
            x_range: None,
            y_range: None,
        }
    }
    /// The same plot with one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }
    /// The same plot with a sentence under it.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }
    /// The same plot with a thin line across it.
    #[must_use]
    pub fn marker(mut self, marker: Marker) -> Self {
        self.markers.push(marker);
        self
    }
    /// The same plot sharing its cursor with the others of the group.
    #[must_use]
    pub fn cursor_group(mut self, name: impl Into<String>) -> Self {
        self.cursor_group = Some(name.into());
        self
    }
    /// The same plot of another height.
    #[must_use]
    pub fn height_px(mut self, height_px: u32) -> Self {
        self.height_px = height_px;
        self
    }
    /// The same plot over a fixed range of x.
    #[must_use]
    pub fn x_range(mut self, low: f64, high: f64) -> Self {
        self.x_range = Some([low, high]);
        self
    }
    /// The same plot over a fixed range of y.
    #[must_use]
    pub fn y_range(mut self, low: f64, high: f64) -> Self {
        self.y_range = Some([low, high]);
        self
    }

    /// The extent of the finite data and the markers, or the fixed range; a unit range where there is nothing.
    pub(crate) fn ranges(&self) -> ([f64; 2], [f64; 2]) {
        let mut x = [f64::INFINITY, f64::NEG_INFINITY];
        let mut y = x;
        let widen = |range: &mut [f64; 2], value: f64| {
            if value.is_finite() {
                range[0] = range[0].min(value);
                range[1] = range[1].max(value);
            }
        };
        for series in &self.series {
            for (px, py) in series.x.iter().zip(&series.y) {
                if px.is_finite() && py.is_finite() {
                    let [low, high] = self.x_range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                    widen(&mut x, *px);
                    if (low..=high).contains(px) {
                        widen(&mut y, *py);
                    }
                }
            }
        }
        for marker in &self.markers {
            match marker {
                Marker::Horizontal(at) => widen(&mut y, *at),
                Marker::Vertical(at) => widen(&mut x, *at),
            }
        }
        let settle = |range: [f64; 2], pad: f64| {
            let [low, high] = if range[0] <= range[1] { range } else { [0.0, 1.0] };
            let width = high - low;
            let slack = if width > 0.0 { pad * width } else { 0.5 * high.abs().max(1e-6) };
            [low - slack, high + slack]
        };
        let x = self.x_range.unwrap_or_else(|| if x[0] < x[1] { x } else { settle(x, 0.0) });
        (x, self.y_range.unwrap_or_else(|| settle(y, 0.05)))
    }
}

/// Thins a line to at most about `limit` points, keeping the smallest and the largest of every stretch, so that no
/// peak is lost. Gaps (NaN) stay gaps.
#[must_use]
pub fn thin(x: &[f64], y: &[f64], limit: usize) -> (Vec<f64>, Vec<f64>) {
    let count = x.len().min(y.len());
    if count <= limit.max(4) {
        return (x[..count].to_vec(), y[..count].to_vec());
    }
    let stretch = count.div_ceil(limit.max(4) / 2);
    let (mut thin_x, mut thin_y) = (Vec::with_capacity(limit), Vec::with_capacity(limit));
    for start in (0..count).step_by(stretch) {
        let end = (start + stretch).min(count);
        let finite = (start..end).filter(|&i| y[i].is_finite());
        let lowest = finite.clone().min_by(|&a, &b| y[a].total_cmp(&y[b]));
        let highest = finite.max_by(|&a, &b| y[a].total_cmp(&y[b]));
        let (Some(low), Some(high)) = (lowest, highest) else {
            thin_x.push(x[start]);
            thin_y.push(f64::NAN);
            continue;
        };
        let (first, second) = (low.min(high), low.max(high));
        thin_x.push(x[first]);
        thin_y.push(y[first]);
        if let Some(gap) = (first..second).find(|&i| y[i].is_nan()) {
            thin_x.push(x[gap]);
            thin_y.push(f64::NAN);
        }
        if second != first {
            thin_x.push(x[second]);
            thin_y.push(y[second]);
        }
    }
    (thin_x, thin_y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_gaps_and_order() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|x| (x * 1e-3).sin()).collect();
        y[54_321] = 17.0;
        for value in &mut y[70_000..80_000] {
            *value = f64::NAN;
        }
        let (tx, ty) = thin(&x, &y, 2000);
        assert!(tx.len() <= 3100, "{}", tx.len());
        assert!(ty.contains(&17.0));
        assert!(ty.iter().any(|y| y.is_nan()));
        assert!(tx.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn a_plot_without_data_still_has_ranges() {
        let empty = Plot::new("", "", "").with(Series::line("", vec![1.0], vec![f64::NAN]));
        assert_eq!(empty.ranges().0, [0.0, 1.0]);
        let flat = Plot::new("", "", "").with(Series::line("", vec![0.0, 1.0], vec![2.0, 2.0]));
        let y = flat.ranges().1;
        assert!(y[0] < 2.0 && y[1] > 2.0);
    }
}
