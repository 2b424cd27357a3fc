//! Every kind of block and series on one page: `cargo run -p report-html --example gallery`.

use report_html::{Marker, Page, Plot, Series, Table, Tone};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let t: Vec<f64> = (0..3000).map(|i| f64::from(i) * 1e-3).collect();
    let wave = |f: f64| t.iter().map(|t| 0.045 * (1.0 - (-2.0 * t).exp() * (f * t).cos())).collect::<Vec<_>>();
    let mut gap = wave(9.0);
    gap[1000..1200].fill(f64::NAN);
    let step = Plot::new("Position", "time, s", "y, m")
        .with(Series::line("measured", t.clone(), gap))
        .with(Series::line("model", t.clone(), wave(10.0)).dashed())
        .marker(Marker::Horizontal(0.045))
        .marker(Marker::Vertical(1.5))
        .cursor_group("time")
        .note("A gap stays a gap.");
    let angle: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.05).collect();
    let spiral = |f: fn(f64) -> f64| angle.iter().map(|a| f(*a) * a * 1e4).collect::<Vec<_>>();
    let codes: Vec<f64> = t.iter().map(|t| (t * 8.0).floor()).collect();
    let mut page = Page::new("Gallery");
    page.callout(Tone::Good, "Good.").callout(Tone::Caution, "Caution.").callout(Tone::Bad, "Bad.");
    page.callout(Tone::Neutral, "Neutral with `code`.");
    let mut table = Table::new(["rig", "rise, s", "comment"]).caption("A table");
    table.row(["(a)", "0.31", "fast"]).row(["(b)", "–", "slow"]);
    page.section("Table").table(table).section("Plots").plot(step.clone());
    page.plots(vec![
        Plot::new("Loop", "x, Pa", "y, Pa").with(Series::curve("loop", spiral(f64::cos), spiral(f64::sin))),
        Plot::new("Cloud", "x, Pa", "y, m").with(Series::dots("dots", spiral(f64::cos), wave(3.0)[..400].to_vec())),
        Plot::new("Codes", "time, s", "code").with(Series::steps("steps", t.clone(), codes)).cursor_group("time"),
    ]);
    page.details("Folded", |inner| {
        inner.text("Inside.").plot(step.clone());
    });
    std::fs::create_dir_all("out")?;
    std::fs::write("out/gallery.html", page.to_html())?;
    std::fs::write("out/gallery.svg", report_html::svg(&[step.clone(), step], 2, 560)?)?;
    println!("out/gallery.html, out/gallery.svg");
    Ok(())
}
