//! The page: blocks of text, tables and plots, written as one HTML file that needs nothing else.

use crate::plot::{Marker, Plot, Series, Style, thin};
use base64::Engine as _;
use serde_json::{Value, json};
use std::fmt::Write as _;

const PLOT_SCRIPT: &str = include_str!("../assets/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("../assets/uPlot.min.css");
const PAGE_SCRIPT: &str = include_str!("../assets/report.js");
const PAGE_STYLE: &str = include_str!("../assets/report.css");

/// More points than this per series are thinned: a browser stays fluent and the file small.
const MOST_POINTS: usize = 20_000;

/// The meaning of a highlighted sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// As it should be.
    Good,
    /// To be looked at.
    Caution,
    /// Wrong.
    Bad,
    /// Neither.
    Neutral,
}

/// A table of texts; columns of numbers align to the right by themselves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Above the table; may be empty.
    pub caption: String,
    /// Column titles.
    pub head: Vec<String>,
    /// Rows, each as long as the head.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with column titles and no rows.
    pub fn new<T: Into<String>>(head: impl IntoIterator<Item = T>) -> Self {
        Self { head: head.into_iter().map(Into::into).collect(), ..Self::default() }
    }
    /// Adds a row.
    pub fn row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }
    /// The same table with a caption.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }
}

/// One part of a page.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// A section heading.
    Section(String),
    /// A paragraph; text between backticks is set as code.
    Text(String),
    /// A list.
    List(Vec<String>),
    /// A highlighted sentence.
    Callout(Tone, String),
    /// A table.
    Table(Table),
    /// Plots side by side where the window is wide enough.
    Plots(Vec<Plot>),
    /// Preformatted text.
    Code(String),
    /// Folded away until its summary is clicked.
    Details(String, Vec<Block>),
}

/// A report in the making.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    title: String,
    blocks: Vec<Block>,
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }
    /// Adds any block.
    pub fn block(&mut self, block: Block) -> &mut Self {
        self.blocks.push(block);
        self
    }
    /// Adds a section heading.
    pub fn section(&mut self, heading: impl Into<String>) -> &mut Self {
        self.block(Block::Section(heading.into()))
    }
    /// Adds a paragraph; text between backticks is set as code.
    pub fn text(&mut self, text: impl Into<String>) -> &mut Self {
        self.block(Block::Text(text.into()))
    }
    /// Adds a highlighted sentence.
    pub fn callout(&mut self, tone: Tone, text: impl Into<String>) -> &mut Self {
        self.block(Block::Callout(tone, text.into()))
    }
    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.block(Block::Table(table))
    }
    /// Adds a plot over the full width.
    pub fn plot(&mut self, plot: Plot) -> &mut Self {
        self.block(Block::Plots(vec![plot]))
    }
    /// Adds plots side by side.
    pub fn plots(&mut self, plots: Vec<Plot>) -> &mut Self {
        self.block(Block::Plots(plots))
    }
    /// Adds blocks that are folded away until their summary is clicked.
    pub fn details(&mut self, summary: impl Into<String>, fill: impl FnOnce(&mut Self)) -> &mut Self {
        let mut inner = Self::new("");
        fill(&mut inner);
        self.block(Block::Details(summary.into(), inner.blocks))
    }

    /// The page as one HTML file: scripts, styles and data are inside, nothing is loaded from elsewhere.
    #[must_use]
    pub fn to_html(&self) -> String {
        let mut body = String::new();
        let mut plots = Data::default();
        write_blocks(&mut body, &self.blocks, &mut plots);
        let data = json!({ "arrays": plots.arrays, "plots": plots.specs }).to_string().replace("</", "<\\/");
        let title = escape(&self.title);
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n\
             <style>{PLOT_STYLE}\n{PAGE_STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{body}\
             <footer>Drag across a plot to zoom in, double-click to zoom out, hover to read values.</footer>\n\
             </main>\n<script type=\"application/json\" id=\"data\">{data}</script>\n\
             <script>{PLOT_SCRIPT}</script>\n<script>{PAGE_SCRIPT}</script>\n</body>\n</html>\n"
        )
    }
}

/// An array starts to count here where single precision would round its values together: times since 1970, for example.
fn origin(values: &[f64]) -> f64 {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if high - low < 1.0e-3 * low.abs().max(high.abs()) { finite().next().unwrap_or(0.0) } else { 0.0 }
}

/// Plot descriptions and the arrays they share.
#[derive(Default)]
struct Data {
    /// Where each begins to count, and its values from there in single precision, base64.
    arrays: Vec<(f64, String)>,
    originals: Vec<Vec<f64>>,
    specs: Vec<Value>,
}

impl Data {
    /// The index of an array, stored once however many series use it.
    fn array(&mut self, values: Vec<f64>) -> usize {
        let same = |stored: &Vec<f64>| {
            stored.len() == values.len() && stored.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits())
        };
        if let Some(at) = self.originals.iter().rposition(same) {
            return at;
        }
        let origin = origin(&values);
        let bytes: Vec<u8> = values.iter().flat_map(|value| ((value - origin) as f32).to_le_bytes()).collect();
        self.arrays.push((origin, base64::engine::general_purpose::STANDARD.encode(bytes)));
        self.originals.push(values);
        self.arrays.len() - 1
    }

    fn plot(&mut self, plot: &Plot) -> usize {
        let series: Vec<Value> = plot.series.iter().map(|series| self.series(series)).collect();
        let markers: Vec<Value> = plot
            .markers
            .iter()
            .map(|marker| match marker {
                Marker::Horizontal(at) => json!({ "y": at }),
                Marker::Vertical(at) => json!({ "x": at }),
            })
            .collect();
        self.specs.push(json!({
            "x": plot.x_label, "y": plot.y_label, "height": plot.height_px, "group": plot.cursor_group,
            "xRange": plot.x_range, "yRange": plot.y_range, "series": series, "markers": markers,
        }));
        self.specs.len() - 1
    }

    fn series(&mut self, series: &Series) -> Value {
        let style = match series.style {
            Style::Line => "line",
            Style::Steps => "steps",
            Style::Dots => "dots",
            Style::Curve => "curve",
        };
        let (x, y) = match series.style {
            Style::Line | Style::Steps => thin(&series.x, &series.y, MOST_POINTS),
            // Points without an order are thinned evenly.
            Style::Dots | Style::Curve => {
                let every = series.x.len().div_ceil(MOST_POINTS).max(1);
                let pick = |values: &[f64]| values.iter().copied().step_by(every).collect::<Vec<_>>();
                (pick(&series.x), pick(&series.y))
            }
        };
        json!({
            "name": series.name, "style": style, "dashed": series.dashed, "colour": series.colour,
            "x": self.array(x), "y": self.array(y),
        })
    }
}

fn write_blocks(html: &mut String, blocks: &[Block], data: &mut Data) {
    for block in blocks {
        // Writing to a String cannot fail.
        let _ = match block {
            Block::Section(heading) => writeln!(html, "<h2>{}</h2>", escape(heading)),
            Block::Text(text) => writeln!(html, "<p>{}</p>", inline(text)),
            Block::List(items) => {
                let items: String = items.iter().map(|item| format!("<li>{}</li>", inline(item))).collect();
                writeln!(html, "<ul>{items}</ul>")
            }
            Block::Callout(tone, text) => {
                let class = match tone {
                    Tone::Good => "good",
                    Tone::Caution => "caution",
                    Tone::Bad => "bad",
                    Tone::Neutral => "neutral",
                };
                writeln!(html, "<p class=\"callout {class}\">{}</p>", inline(text))
            }
            Block::Table(table) => {
                write_table(html, table);
                Ok(())
            }
            Block::Plots(plots) => {
                html.push_str("<div class=\"plots\">\n");
                for plot in plots {
                    let at = data.plot(plot);
                    let note = if plot.note.is_empty() {
                        String::new()
                    } else {
                        format!("<p class=\"note\">{}</p>", inline(&plot.note))
                    };
                    let title = escape(&plot.title);
                    let _ = writeln!(
                        html,
                        "<figure><figcaption>{title}</figcaption><div class=\"plot\" data-plot=\"{at}\" \
                         style=\"min-height:{}px\"></div>{note}</figure>",
                        plot.height_px
                    );
                }
                writeln!(html, "</div>")
            }
            Block::Code(text) => writeln!(html, "<pre>{}</pre>", escape(text)),
            Block::Details(summary, inner) => {
                let _ = writeln!(html, "<details><summary>{}</summary>", inline(summary));
                write_blocks(html, inner, data);
                writeln!(html, "</details>")
            }
        };
    }
}

fn write_table(html: &mut String, table: &Table) {
    let numeric: Vec<bool> = (0..table.head.len())
        .map(|column| {
            column > 0
                && table.rows.iter().filter_map(|row| row.get(column)).all(|cell| {
                    let numeric = |first: char| first.is_ascii_digit() || "+-−–±<>≥≤".contains(first);
                    // A sentence may begin with a number; it is still a sentence.
                    cell.chars().count() <= 20 && cell.chars().next().is_none_or(numeric)
                })
        })
        .collect();
    let class = |column: usize| if numeric.get(column) == Some(&true) { " class=\"number\"" } else { "" };
    // Outside the table: a caption inside would be as wide as the table, which may be wider than the window.
    if !table.caption.is_empty() {
        let _ = writeln!(html, "<p class=\"caption\">{}</p>", inline(&table.caption));
    }
    html.push_str("<div class=\"scroll\"><table>\n");
    let row = |cells: &[String], tag: &str| -> String {
        let cells = cells.iter().enumerate();
        cells.map(|(column, cell)| format!("<{tag}{}>{}</{tag}>", class(column), inline(cell))).collect()
    };
    let _ = writeln!(html, "<thead><tr>{}</tr></thead>\n<tbody>", row(&table.head, "th"));
    for cells in &table.rows {
        let _ = writeln!(html, "<tr>{}</tr>", row(cells, "td"));
    }
    html.push_str("</tbody></table></div>\n");
}

/// Text with what HTML would interpret made harmless.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Escaped text with `code` between backticks.
fn inline(text: &str) -> String {
    let mut parts = text.split('`');
    let mut html = parts.next().map(escape).unwrap_or_default();
    let rest: Vec<&str> = parts.collect();
    for pair in rest.chunks(2) {
        match pair {
            [code, after] => {
                let _ = write!(html, "<code>{}</code>{}", escape(code), escape(after));
            }
            // An odd backtick is a character like any other.
            [tail, ..] => {
                let _ = write!(html, "`{}", escape(tail));
            }
            [] => {}
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_files_cannot_become_markup() {
        let mut page = Page::new("<script>");
        page.text("a < b & `<b>` \"c\"").callout(Tone::Bad, "</p><script>alert(1)</script>");
        page.plot(Plot::new("t", "</script><script>", "y").with(Series::line("</script>", vec![0.0], vec![1.0])));
        let html = page.to_html();
        let own_scripts = 3;
        assert_eq!(html.matches("</script>").count(), own_scripts);
        assert!(html.contains("<code>&lt;b&gt;</code>"));
    }

    #[test]
    fn the_page_loads_nothing_from_elsewhere() {
        let html = Page::new("x").to_html();
        for reference in ["src=", "href=", "@import", "url(http"] {
            assert!(!html.contains(reference), "{reference}");
        }
    }

    #[test]
    fn series_that_share_their_time_store_it_once() {
        let mut data = Data::default();
        let t: Vec<f64> = (0..10).map(f64::from).collect();
        let plot = Plot::new("", "", "").with(Series::line("a", t.clone(), vec![1.0; 10])).with(Series::line(
            "b",
            t,
            vec![f64::NAN; 10],
        ));
        data.plot(&plot);
        data.plot(&plot);
        assert_eq!(data.arrays.len(), 3);
    }

    #[test]
    fn times_since_1970_stay_apart_by_a_millisecond() {
        let mut data = Data::default();
        let t: Vec<f64> = (0..1000).map(|k| 1.7e9 + 1.0e-3 * f64::from(k)).collect();
        data.array(t.clone());
        let (origin, text) = &data.arrays[0];
        let bytes = base64::engine::general_purpose::STANDARD.decode(text).expect("base64");
        for (stored, t) in bytes.chunks_exact(4).zip(&t) {
            let stored = origin + f64::from(f32::from_le_bytes([stored[0], stored[1], stored[2], stored[3]]));
            assert!((stored - t).abs() < 1.0e-6, "{stored} {t}");
        }
        // An ordinary array stays as it is.
        assert_eq!(super::origin(&[0.0, 1.0, 2.0]), 0.0);
    }

    #[test]
    fn an_odd_backtick_stays_a_backtick() {
        assert_eq!(inline("a `b` c ` d"), "a <code>b</code> c ` d");
    }
}
