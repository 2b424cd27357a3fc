//! The same plots as one SVG picture, for documents.

use crate::plot::{Marker, Plot, Series, Style, thin};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::fmt;

/// Points per line beyond which a picture is thinned.
const MOST_POINTS: usize = 1500;
/// Okabe and Ito: told apart by colour-blind readers too; the same as in the interactive plots.
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(51, 51, 51),
];
const INK: RGBColor = RGBColor(27, 31, 36);
const SOFT: RGBColor = RGBColor(140, 149, 159);
const FONT: &str = "sans-serif";

/// The drawing library gave up.
#[derive(Debug)]
pub struct SvgError(String);

impl fmt::Display for SvgError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot draw the picture: {}", self.0)
    }
}

impl std::error::Error for SvgError {}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws plots as a grid of `columns`, each `width_px` by its own height (the largest of its row).
///
/// # Errors
/// The drawing library refuses; not known to happen with finite ranges.
pub fn svg(plots: &[Plot], columns: usize, width_px: u32) -> Result<String, SvgError> {
    let rows: Vec<&[Plot]> = plots.chunks(columns.max(1)).collect();
    let heights: Vec<u32> = rows.iter().map(|row| row.iter().map(|plot| plot.height_px).max().unwrap_or(300)).collect();
    let size = (width_px * columns.max(1) as u32, heights.iter().sum::<u32>().max(1));
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|error| SvgError(error.to_string()))?;
        let mut rest = root.clone();
        for (row, height) in rows.into_iter().zip(heights) {
            let (strip, below) = rest.split_vertically(height);
            rest = below;
            let mut rest_of_row = strip;
            for plot in row {
                let (cell, right) = rest_of_row.split_horizontally(width_px);
                rest_of_row = right;
                draw(&cell, plot).map_err(|error| SvgError(error.to_string()))?;
            }
        }
        root.present().map_err(|error| SvgError(error.to_string()))?;
    }
    Ok(text)
}

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

fn draw(cell: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>, plot: &Plot) -> Drawn {
    let (x, y) = plot.ranges();
    let mut chart = ChartBuilder::on(cell)
        .margin(12)
        .caption(&plot.title, (FONT, 17).into_font().color(&INK))
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(x[0]..x[1], y[0]..y[1])?;
    let (x_width, y_width) = (x[1] - x[0], y[1] - y[0]);
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(234, 238, 242))
        .axis_style(SOFT)
        .label_style((FONT, 13).into_font().color(&INK))
        .axis_desc_style((FONT, 14).into_font().color(&INK))
        .x_labels(if tick(x[1], x_width).len() > 8 { 4 } else { 8 })
        .y_labels(7)
        .x_desc(&plot.x_label)
        .y_desc(&plot.y_label)
        .x_label_formatter(&|value| tick(*value, x_width))
        .y_label_formatter(&|value| tick(*value, y_width))
        .draw()?;
    for marker in &plot.markers {
        let ends = match marker {
            Marker::Horizontal(at) => [(x[0], *at), (x[1], *at)],
            Marker::Vertical(at) => [(*at, y[0]), (*at, y[1])],
        };
        chart.draw_series(DashedLineSeries::new(ends, 5, 4, SOFT.stroke_width(1)))?;
    }
    for (place, series) in plot.series.iter().enumerate() {
        draw_series(&mut chart, series, PALETTE[series.colour.unwrap_or(place) % PALETTE.len()], x)?;
    }
    if plot.series.iter().any(|series| !series.name.is_empty()) && plot.series.len() > 1 {
        chart
            .configure_series_labels()
            .position(emptiest_corner(plot, x, y))
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(216, 222, 228))
            .label_font((FONT, 13).into_font().color(&INK))
            .draw()?;
    }
    Ok(())
}

/// The corner where the legend hides the fewest points.
fn emptiest_corner(plot: &Plot, x: [f64; 2], y: [f64; 2]) -> SeriesLabelPosition {
    let mut counts = [0_usize; 4];
    for series in &plot.series {
        for (px, py) in series.x.iter().zip(&series.y) {
            let (right, up) = ((px - x[0]) / (x[1] - x[0]), (py - y[0]) / (y[1] - y[0]));
            let corners = [
                (right > 0.65, up > 0.65),
                (right < 0.35, up > 0.65),
                (right > 0.65, up < 0.35),
                (right < 0.35, up < 0.35),
            ];
            let inside = (0.0..=1.0).contains(&right) && (0.0..=1.0).contains(&up);
            for (count, (across, along)) in counts.iter_mut().zip(corners) {
                *count += usize::from(inside && across && along);
            }
        }
    }
    let positions = [
        SeriesLabelPosition::UpperRight,
        SeriesLabelPosition::UpperLeft,
        SeriesLabelPosition::LowerRight,
        SeriesLabelPosition::LowerLeft,
    ];
    let best = counts.iter().enumerate().min_by_key(|(_, count)| **count).map_or(0, |(at, _)| at);
    positions.into_iter().nth(best).unwrap_or(SeriesLabelPosition::UpperRight)
}

fn draw_series(chart: &mut Chart<'_, '_>, series: &Series, colour: RGBColor, range: [f64; 2]) -> Drawn {
    let visible = |x: f64| series.style == Style::Curve || (range[0]..=range[1]).contains(&x);
    let (mut xs, mut ys): (Vec<f64>, Vec<f64>) =
        series.x.iter().zip(&series.y).filter(|(x, _)| x.is_finite() && visible(**x)).unzip();
    if matches!(series.style, Style::Line | Style::Steps) {
        (xs, ys) = thin(&xs, &ys, MOST_POINTS);
    }
    let width = if series.dashed { 1 } else { 2 };
    if series.style == Style::Dots {
        let every = xs.len().div_ceil(4 * MOST_POINTS).max(1);
        let points = xs.iter().zip(&ys).step_by(every).filter(|(_, y)| y.is_finite());
        chart
            .draw_series(points.map(|(x, y)| Circle::new((*x, *y), 2, colour.mix(0.6).filled())))?
            .label(&series.name)
            .legend(move |(x, y)| Circle::new((x + 10, y), 3, colour.filled()));
        return Ok(());
    }
    let mut first = true;
    for stretch in xs.iter().copied().zip(ys.iter().copied()).collect::<Vec<_>>().split(|(_, y)| !y.is_finite()) {
        let points = if series.style == Style::Steps { stairs(stretch) } else { stretch.to_vec() };
        let style = colour.stroke_width(width);
        let drawn = if series.dashed {
            chart.draw_series(DashedLineSeries::new(points, 7, 4, style))?
        } else {
            chart.draw_series(LineSeries::new(points, style))?
        };
        if first && !stretch.is_empty() {
            drawn.label(&series.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], style));
            first = false;
        }
    }
    Ok(())
}

/// A staircase that holds each value until the next.
fn stairs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut stairs = Vec::with_capacity(2 * points.len());
    for (at, point) in points.iter().enumerate() {
        if at > 0 {
            stairs.push((point.0, points[at - 1].1));
        }
        stairs.push(*point);
    }
    stairs
}

/// A tick label with as many digits as the width of the axis asks for.
fn tick(value: f64, width: f64) -> String {
    if value.abs() < 1e-9 * width {
        return "0".to_string();
    }
    let size = value.abs().max(width);
    // Times since 1970 differ behind the digits that a power of ten would show.
    let far_out = size >= 1e6 && width < 0.01 * size;
    if !(1e-3..1e6).contains(&size) && !far_out {
        let text = format!("{value:.2e}");
        return text.replace(".00e", "e").replace("0e", "e");
    }
    let digits = (2.0 - width.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_every_style_is_drawn_gaps_included() {
        let t: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.02).collect();
        let mut y: Vec<f64> = t.iter().map(|t| t.sin()).collect();
        y[25] = f64::NAN;
        let mut plot = Plot::new("Title & more", "time, s", "y, m").marker(Marker::Horizontal(0.5));
        for series in [Series::line, Series::steps, Series::dots, Series::curve] {
            plot = plot.with(series("s".to_string(), t.clone(), y.clone()));
        }
        let text = svg(&[plot.clone(), plot], 2, 500).expect("drawn");
        assert!(text.contains("Title &amp; more") && text.contains("<polyline"));
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn ticks_read_like_a_person_wrote_them() {
        assert_eq!(tick(0.25, 1.0), "0.25");
        assert_eq!(tick(0.0, 1.0), "0");
        assert_eq!(tick(100.0, 500.0), "100");
        assert_eq!(tick(2.0e6, 5.0e6), "2e6");
        assert_eq!(tick(2.0e-5, 5.0e-5), "2e-5");
        assert_eq!(tick(1_700_000_001.5, 5.0), "1700000001.5");
    }
}
