//! A board finds out about its rig, and steps before and after.

use super::failed;
use super::measure::Interrupted;
use crate::commands::{CliError, RigArgument, diagnose, make_folder, text_table};
use board_link::{Command, Parameter};
use plant_sim::board::Client;
use plant_sim::commission::tune::{Step, apply, explore};
use plant_sim::commission::{observe, transfer};
use report_html::Table;
use rig_files::RigFile;
use std::io::{Read, Write};
use std::path::PathBuf;

/// What `board tune` is told.
#[derive(clap::Args, Clone, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Folder for log, report and extended rig file
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Keep what was found in force, until the next start
    #[arg(long)]
    apply: bool,
    /// The same, and write it to flash
    #[arg(long)]
    save: bool,
}

/// A rig file, read, and what to do with what comes of it.
pub(super) struct Tune {
    rig: RigFile,
    arguments: Arguments,
}

impl Tune {
    /// Reads the rig file and makes the folder.
    pub(super) fn prepare(arguments: &Arguments) -> Result<Self, CliError> {
        let rig = RigFile::read(&arguments.rig.rig)?;
        make_folder(&arguments.out)?;
        Ok(Self { rig, arguments: arguments.clone() })
    }

    /// Moves, diagnoses, steps, and keeps what was found if that is asked for.
    pub(super) fn carry_out<P: Read + Write>(&self, client: &mut Client<P>) -> Result<(), CliError> {
        let out = &self.arguments.out;
        let hand = Interrupted::watch()?;
        let abort = || hand.interrupted();
        say!("the piston will move about the middle of its range; Ctrl-C breaks off, the emergency stop always does");
        let found = explore(client, &self.rig, &abort, &mut |line| say!("{line}"))?;
        drop(hand);
        let (measured, log) = (out.join("measured-rig.toml"), out.join("log.csv"));
        found.rig.write(&measured)?;
        found.log.write(&log)?;
        say!("\n{} rows in {}; the diagnosis:\n", found.log.t_s.len(), log.display());
        diagnose::run(&diagnose::Arguments::plain(measured, log, out.clone()))?;
        let extended = RigFile::read(&out.join("extended-rig.toml"))?;

        let before = transfer::read(client).map_err(failed)?;
        let hand = Interrupted::watch()?;
        say!("\na step with what was found");
        let after = apply(client, &extended, &found.dead_zone, &|| hand.interrupted());
        if after.is_err() && observe::status(client).map_err(failed)?.state == "run" {
            client.ask(Command::Disarm).map_err(failed)?;
        }
        let keep = after.is_ok() && (self.arguments.apply || self.arguments.save);
        if !keep {
            transfer::change(client, &Parameter::ALL.map(|parameter| (parameter, before.get(parameter))))?;
        }
        say!("{}", text_table(&table(&[("rig file as given", found.before), ("what was found", after?)])).trim_end());
        match (keep, self.arguments.save) {
            (true, true) => {
                client.ask(Command::Save).map_err(failed)?;
                say!("in force, and saved");
            }
            (true, false) => say!("in force until the next start; `save` keeps it"),
            _ => say!("the board has the parameters it had; --apply keeps what was found"),
        }
        Ok(())
    }
}

fn table(steps: &[(&str, Step)]) -> Table {
    let mut table =
        Table::new(["parameters", "step, mm", "settled to 2 %, s", "overshoot, mm", "error at the end, mm"]);
    for (name, step) in steps {
        let millimetres = |metres: f64| format!("{:.3}", 1.0e3 * metres);
        table.row([
            (*name).to_string(),
            format!("{:.1}", 1.0e3 * step.length_m),
            step.settled_s.map_or("–".into(), |seconds| format!("{seconds:.2}")),
            millimetres(step.overshoot_m),
            millimetres(step.error_m),
        ]);
    }
    table
}
