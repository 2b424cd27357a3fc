//! `plant-sim import`: a foreign table becomes a log.

use super::CliError;
use plant_sim::import::Mapping;
use rig_files::{Column, Log, RigFile};
use std::path::PathBuf;

/// Turn a foreign table into the log format, by a small mapping file.
///
/// The mapping says which column is what (by name, or by number from 1 where there is no header row), its unit, its sign,
/// an offset, and whether a pressure is gauge. Separators, decimal commas, comment lines and leading lines are handled.
/// examples/mappings/ has one mapping for each of the recordings in examples/data/.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    plant-sim import --map examples/mappings/piston-friction.toml \\\n    \
    --from examples/data/piston-friction/circle_3bar.csv --out out/circle_3bar.csv\n\n\
A MAPPING\n  \
    [source]\n  separator = \"semicolon\"      # comma, semicolon, tab, space\n  header = true\n  \
    decimal_comma = true\n  atmosphere_pa = 1.013e5\n  \
    [column.t_s]\n  from = \"Zeit\"\n  unit = \"ms\"\n  \
    [column.y_m]\n  from = 3                     # counted from 1\n  unit = \"mm\"\n  sign = -1\n  offset = 0.1                 # SI, added last\n  \
    [column.p_a_pa]\n  from = \"Druck A\"\n  unit = \"bar\"\n  gauge = true")]
pub(crate) struct Arguments {
    /// Mapping file (TOML)
    #[arg(long, value_name = "FILE")]
    map: PathBuf,
    /// The foreign table
    #[arg(long, value_name = "FILE")]
    from: PathBuf,
    /// Where to write the log (CSV)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Rig file to check the log against: warns of values the rig cannot have produced
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = arguments.rig.as_deref().map(RigFile::read).transpose()?;
    let log = Mapping::read(&arguments.map)?.convert_file(&arguments.from)?;
    if let Some(rig) = &rig {
        for suspicion in log.suspicions(rig) {
            eprintln!("warning: {suspicion}");
        }
    }
    log.write(&arguments.out)?;
    say!("{}: {}", arguments.out.display(), describe(&log));
    Ok(())
}

/// A log in one sentence.
pub(crate) fn describe(log: &Log) -> String {
    let columns: Vec<_> =
        Column::ALL.into_iter().filter(|column| log.column(*column).is_some()).map(Column::name).collect();
    let span_s = log.t_s.last().copied().unwrap_or(0.0) - log.t_s.first().copied().unwrap_or(0.0);
    let gaps = match log.gaps().len() {
        0 => "no gaps".to_string(),
        1 => "1 gap".to_string(),
        count => format!("{count} gaps"),
    };
    format!(
        "{} rows over {span_s:.3} s, usually {:.2} ms apart, {gaps}; columns {}",
        log.len(),
        log.period_s() * 1e3,
        columns.join(", ")
    )
}
