//! `plant-sim simulate`: open loop.

use super::{CliError, RigArgument};
use plant_model::Simulator;
use plant_sim::open_loop::{Command, initial_state, simulate, to_csv};
use rig_files::{InputError, write_file};
use std::path::PathBuf;

/// Drive a rig with a valve command and record what it does.
///
/// The input is a CSV with the columns t_s and u_v; each command is held until the next row. The columns f_ext_n (external
/// force) and p_sup_pa (supply pressure) are used where present, so that a log can be replayed. The output has one row per
/// input row: t_s,u_v,y_m,v_m_per_s,p_a_pa,p_b_pa,z_m (SI units, absolute pressures).
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    plant-sim simulate --rig rigs/paper-a.toml --input examples/inputs/steps-and-sine.csv --out out/steps.csv\n  \
    plant-sim plot out/steps.csv")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Valve command over time (CSV: t_s,u_v)
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    /// Where to write the result (CSV)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Start, e.g. "y_m=0.1,p_a_pa=3.6e5"; keys y_m, v_m_per_s, p_a_pa, p_b_pa, z_m.
    /// By default at rest at mid-stroke, both chambers at the equilibrium pressure p*
    #[arg(long, value_name = "STATE", default_value = "", hide_default_value = true)]
    initial: String,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    super::can_be_written(&arguments.out, [&*arguments.rig.rig, &*arguments.input])?;
    let rig = super::read_rig(&arguments.rig.rig)?;
    let command = Command::read(&arguments.input)?;
    let simulator = Simulator::new(&rig.rig, &rig.effects).map_err(|error| {
        InputError::new(arguments.rig.rig.display().to_string(), error.to_string(), "correct the value")
    })?;
    let limit_v = rig.rig.valve.max_voltage_v;
    let beyond = command.u_v.iter().filter(|u_v| u_v.abs() > limit_v).count();
    if beyond > 0 {
        let file = arguments.input.display();
        eprintln!(
            "warning: {file}: {beyond} commands exceed ±{limit_v} V, where the valve saturates; is u_v about mid?"
        );
    }
    let start = initial_state(&arguments.initial, &rig, &simulator)?;
    let rows = simulate(simulator, &start, &command);
    write_file(&arguments.out, |out| out.write_all(to_csv(&rows).as_bytes()))?;
    Ok(())
}
