//! `plant-sim experiment`: what to do with a rig so that a diagnosis can tell its effects apart.

use super::{CliError, RigArgument};
use rig_files::write_file;
use std::path::PathBuf;
use synthesis::{Law, identification, identification_parts};

/// Print the identification sequence recommended for a rig, part by part with its purpose; write it as a table.
///
/// The table has the columns t_s,y_ref_m,u_v. Where y_ref_m is given the position loop is closed and u_v is added to its
/// output; where it is blank, u_v alone is the valve command (0: valve at mid). Record t_s,u_v,y_m,p_a_pa,p_b_pa and, if
/// you can, p_sup_pa, all at 1 kHz, and pass the log to `plant-sim diagnose`.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    plant-sim experiment --rig rigs/paper-a.toml --out out/sequence.csv\n  \
    plant-sim synthesize --rig rigs/paper-a.toml --hidden --seed 7 --out out/log.csv   # the same on a synthetic rig")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Where to write the sequence (CSV: t_s,y_ref_m,u_v)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Duration; the parts are stretched or squeezed
    #[arg(long, value_name = "SECONDS", default_value_t = 40.0, value_parser = super::synthesize::duration, allow_negative_numbers = true)]
    duration: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(out) = &arguments.out {
        super::can_be_written(out, [&*arguments.rig.rig])?;
    }
    let rig = super::read_rig(&arguments.rig.rig)?;
    let law = Law::for_rig(&rig.rig, 1.0);
    say!("{}, {} s, starting at rest at mid-stroke\n", rig.name, arguments.duration);
    let mut from = 0.0;
    for part in identification_parts(&rig.rig, arguments.duration) {
        let to = from + part.segments.iter().map(|segment| segment.duration_s).sum::<f64>();
        say!("{from:5.1} to {to:5.1} s  {}", part.purpose);
        from = to;
    }
    say!(
        "\nPosition loop: u = {:.3} V/m (y_ref - y) - {:.3} V s/m v, with dead-zone compensation, within ±{} V.",
        law.position_gain,
        law.velocity_gain,
        law.max_v
    );
    say!("Open loop needs limit switches at ±{:.3} m that reverse the command.", law.turn_back_m);
    let Some(out) = &arguments.out else { return Ok(()) };

    let experiment = identification(&rig.rig, arguments.duration);
    let tick_s = rig.io.tick_s();
    let rows = (arguments.duration / tick_s).round() as usize;
    let mut player = experiment.play();
    write_file(out, |file| {
        writeln!(file, "t_s,y_ref_m,u_v")?;
        for row in 0..rows {
            let t_s = row as f64 * tick_s;
            let demand = player.demand(t_s, 0.0);
            let reference = demand.y_ref_m.map_or(String::new(), |y| format!("{y:.6}"));
            writeln!(file, "{t_s:.6},{reference},{:.5}", demand.added_v)?;
        }
        Ok(())
    })?;
    say!("{}: {rows} rows", out.display());
    Ok(())
}
