//! `plant-sim plot`: a log as an interactive page.

use super::CliError;
use super::import::describe;
use plant_sim::charts;
use plant_sim::import::Imported;
use report_html::{Page, Tone, svg};
use rig_files::{Short, write_file};
use std::path::PathBuf;

/// Show a log as one HTML page with plots to zoom and hover.
#[derive(clap::Args, Debug)]
#[command(
    after_long_help = "EXAMPLE\n  plant-sim plot out/steps.csv\n  plant-sim plot measured.csv --rig rigs/paper-a.toml\n  \
    plant-sim plot --map examples/mappings/cylinder-vertical.toml examples/data/cylinder-vertical/strokes.csv --out out/strokes.html"
)]
pub(crate) struct Arguments {
    /// Log (CSV), or the output of simulate
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// Mapping file (TOML) if the log is a foreign table, as for `plant-sim import`
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Where to write the page; by default next to the log, with the ending .html
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Also write the plots as one picture (SVG)
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Rig file to check the log against
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = arguments.rig.as_deref().map(super::read_rig).transpose()?;
    let out = arguments.out.clone().unwrap_or_else(|| arguments.log.with_extension("html"));
    let inputs = || [Some(&arguments.log), arguments.map.as_ref(), arguments.rig.as_ref()].into_iter().flatten();
    for out in [Some(&out), arguments.svg.as_ref()].into_iter().flatten() {
        super::can_be_written(out, inputs().map(PathBuf::as_path))?;
    }
    let Imported { log, notes } = super::read_log(&arguments.log, arguments.map.as_deref())?;
    let mut page = Page::new(arguments.log.display().to_string());
    page.text(format!("{}.", describe(&log)));
    if !notes.is_empty() {
        page.text(format!("Of the import: {}.", notes.join("; ")));
    }
    for suspicion in rig.iter().flat_map(|rig| log.suspicions(rig)) {
        eprintln!("warning: {suspicion}");
        page.callout(Tone::Caution, suspicion);
    }
    let gaps = log.gaps();
    if !gaps.is_empty() {
        let shown: Vec<String> = gaps.iter().take(20).map(sentence).collect();
        let rest = gaps.len().saturating_sub(shown.len());
        let rest = if rest > 0 { format!(" and {rest} more") } else { String::new() };
        page.callout(Tone::Neutral, format!("Samples are missing: {}{rest}.", shown.join("; ")));
    }
    let plots = charts::log(&log);
    for plot in &plots {
        page.plot(plot.clone());
    }
    write_file(&out, |file| file.write_all(page.to_html().as_bytes()))?;
    say!("{}", out.display());
    if let Some(path) = &arguments.svg {
        let picture = svg(&plots, 1, 900).map_err(|error| CliError::Failed(error.to_string()))?;
        write_file(path, |file| file.write_all(picture.as_bytes()))?;
        say!("{}", path.display());
    }
    Ok(())
}

fn sentence(gap: &rig_files::Gap) -> String {
    let [from_s, to_s] = [gap.from_s, gap.to_s].map(Short);
    match gap.column {
        None => format!("rows from {from_s:.3} to {to_s:.3} s"),
        Some(column) => format!("`{}` from {from_s:.3} to {to_s:.3} s", column.name()),
    }
}
