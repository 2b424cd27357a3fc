//! `plant-sim paper`: the paper's figures and whether its statements hold.

use super::CliError;
use plant_sim::paper::{Verdict, figures};
use report_html::{Page, Plot, Table, svg};
use rig_files::write_file;
use std::path::PathBuf;

/// Compute the paper's figures 5, 6, 8, 10, 11 and 13 anew and say, claim by claim, whether the simulation confirms it.
///
/// Writes one HTML page, and per figure one picture (SVG) and its curves (CSV: plot, curve, x, y).
#[derive(clap::Args, Debug)]
pub(crate) struct Arguments {
    /// Folder for the page, the pictures and the curves
    #[arg(long, value_name = "FOLDER", default_value = "out/paper")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    super::make_folder(&arguments.out)?;
    let mut page = Page::new("The paper's figures, simulated");
    page.text(
        "Valdiero, Ritter, Rios, Rafikov: Nonlinear Mathematical Modeling in Pneumatic Servo Position Applications, \
         Mathematical Problems in Engineering, 2011. Equation numbers are the paper's; where it is wrong or silent, \
         `docs/model.md` says what is used instead.",
    );
    let figures = figures();
    let total = |verdict: Verdict| {
        let claims = figures.iter().flat_map(|figure| &figure.claims);
        claims.filter(|claim| claim.verdict == verdict).count()
    };
    let tally = [Verdict::BorneOut, Verdict::InPart, Verdict::NotBorneOut]
        .map(|verdict| format!("{} {verdict}", total(verdict)))
        .join(", ");
    page.text(format!("The paper's statements about these figures: {tally}."));
    for figure in &figures {
        say!("Fig. {}: {}", figure.number, figure.title);
        page.section(format!("Fig. {}: {}", figure.number, figure.title)).text(figure.setting);
        let mut table = Table::new(["the paper says", "verdict", "evidence"]);
        for claim in &figure.claims {
            let verdict = claim.verdict.to_string();
            say!("  {verdict}: {} — {}", claim.statement, claim.evidence);
            table.row([claim.statement, &verdict, &claim.evidence]);
        }
        page.table(table);
        if figure.number == 13 {
            for plot in &figure.plots {
                page.plot(plot.clone());
            }
        } else {
            page.plots(figure.plots.clone());
        }
        let picture =
            svg(&figure.plots, figure.plots.len().min(2), 560).map_err(|error| CliError::Failed(error.to_string()))?;
        let path = arguments.out.join(format!("fig{:02}.svg", figure.number));
        write_file(&path, |out| out.write_all(picture.as_bytes()))?;
        let curves = curves(&figure.plots).map_err(|error| CliError::Failed(error.to_string()))?;
        write_file(&path.with_extension("csv"), |out| out.write_all(&curves))?;
    }
    let path = arguments.out.join("paper.html");
    write_file(&path, |out| out.write_all(page.to_html().as_bytes()))?;
    say!("\nThe paper's statements: {tally}.\nReport: {}", path.display());
    Ok(())
}

/// The points of all curves of a figure, one per row, as they are drawn and in the units of the axes.
fn curves(plots: &[Plot]) -> Result<Vec<u8>, csv::Error> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["plot", "curve", "x", "y", "x_label", "y_label"])?;
    for plot in plots {
        for series in &plot.series {
            for (x, y) in series.x.iter().zip(&series.y) {
                let (x, y) = (x.to_string(), y.to_string());
                table.write_record([&plot.title, &series.name, &x, &y, &plot.x_label, &plot.y_label])?;
            }
        }
    }
    table.into_inner().map_err(|error| error.into_error().into())
}
