//! `plant-sim import`: a foreign table becomes a log.

use super::CliError;
use plant_sim::import::{Imported, Mapping, suggest};
use rig_files::{Column, Log, RigFile, Short, write_file};
use std::path::{Path, PathBuf};

/// Turn a foreign table into the log format, by a small mapping file; or draft that file from the table.
///
/// The mapping says which column is what (by name, or by number from 1 where there is no header row), its unit, its sign,
/// an offset, and whether a pressure is gauge; how the table writes times and numbers, and what stands for a missing sample.
/// --suggest drafts it: each line with its reason, and a "?" where the table leaves a choice. docs/formats.md has all keys;
/// examples/mappings/ has mappings for the recordings in examples/.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim import --suggest examples/loggers/messung.csv --rig rigs/festo-dsbc-32-200.toml --out out/map.toml\n  \
    plant-sim import --map out/map.toml --from examples/loggers/messung.csv --out out/log.csv\n\n\
A MAPPING\n  \
    [source]\n  separator = \"semicolon\"      # comma, semicolon, tab, space\n  header = true\n  \
    decimal_comma = true\n  atmosphere_pa = 1.013e5\n  \
    [column.t_s]\n  from = \"Zeit\"\n  time = \"datetime\"            # or unit = \"ms\", time = \"clock\"\n  \
    [column.y_m]\n  from = 3                     # counted from 1\n  unit = \"mm\"\n  sign = -1\n  offset = 0.1                 # SI, added last\n  \
    [column.p_a_pa]\n  from = \"Druck A\"\n  unit = \"bar\"\n  gauge = true\n  \
    [column.u_v]\n  from = \"Ventil\"\n  points = [[4, -5], [20, 5]]  # 4 mA is -5 V")]
pub(crate) struct Arguments {
    /// Mapping file (TOML)
    #[arg(long, value_name = "FILE", required_unless_present = "suggest")]
    map: Option<PathBuf>,
    /// The foreign table
    #[arg(long, value_name = "FILE", required_unless_present = "suggest")]
    from: Option<PathBuf>,
    /// Draft the mapping of this table
    #[arg(long, value_name = "FILE", conflicts_with_all = ["map", "from"])]
    suggest: Option<PathBuf>,
    /// Where to write the log (CSV); or the draft (TOML), by default to standard output. A draft overwrites nothing
    #[arg(long, value_name = "FILE", required_unless_present = "suggest")]
    out: Option<PathBuf>,
    /// Rig file: warns of values the rig cannot have produced; tells a draft stroke, supply and command
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = arguments.rig.as_deref().map(super::read_rig).transpose()?;
    if let Some(table) = &arguments.suggest {
        return draft(table, rig.as_ref(), arguments.out.as_deref());
    }
    let (Some(map), Some(from), Some(out)) = (&arguments.map, &arguments.from, &arguments.out) else {
        return Err(CliError::Usage("--map, --from and --out are needed".into()));
    };
    super::can_be_written(out, [&**map, &**from].into_iter().chain(arguments.rig.as_deref()))?;
    let Imported { log, notes } = Mapping::read(map)?.import(from)?;
    if let Some(rig) = &rig {
        for suspicion in log.suspicions(rig) {
            eprintln!("warning: {suspicion}");
        }
    }
    log.write(out)?;
    say!("{}: {}", out.display(), describe(&log));
    say!("{}", notes.join("; "));
    Ok(())
}

fn draft(table: &Path, rig: Option<&RigFile>, out: Option<&Path>) -> Result<(), CliError> {
    if let Some(out) = out {
        super::must_be_new(out)?;
    }
    let draft = suggest::suggest(table, rig)?;
    match out {
        Some(out) => {
            write_file(out, |file| file.write_all(draft.text.as_bytes()))?;
            say!("{}: a mapping for {}", out.display(), table.display());
        }
        None => say!("{}", draft.text.trim_end()),
    }
    let name = out.map_or("the draft".into(), |out| out.display().to_string());
    for line in &draft.open {
        let text = draft.text.lines().nth(line - 1).unwrap_or_default();
        let (key, why) = text.split_once('#').unwrap_or((text, ""));
        eprintln!("{name}, line {line}: `{}`: {}", key.trim(), why.trim());
    }
    if let Some(error) = &draft.refused {
        eprintln!("warning: as it stands, the draft does not read the table: {error}");
    }
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
        "{} rows over {:.3} s, usually {:.2} ms apart, {gaps}; columns {}",
        log.len(),
        Short(span_s),
        Short(log.period_s() * 1e3),
        columns.join(", ")
    )
}
