//! `plant-sim rig`: from data sheets to a rig file.

use super::CliError;
use plant_sim::datasheet::valves::VALVES;
use plant_sim::datasheet::{Flow, SetUp, commented};
use rig_files::write_file;
use std::io::{BufRead as _, IsTerminal as _, Write as _};
use std::path::PathBuf;

/// Write a rig file from what the data sheets of cylinder, valve, hoses and sensors say.
///
/// Every number stands in the file with its origin, how well it is known, and what that does to a motion. What no data sheet
/// states is marked as typical. At a terminal, whatever is needed and not given is asked for.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    plant-sim rig --bore 32 --rod 12 --stroke 200 --mass 4 --valve mpye-5-1/8-lf --hose-length 1 --hose-diameter 4 --out rig.toml\n  \
    plant-sim run --rig rig.toml")]
pub(crate) struct Arguments {
    /// Piston diameter
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = super::plain_number)]
    bore: Option<f64>,
    /// Rod diameter; 0 for a rodless cylinder
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = super::plain_number)]
    rod: Option<f64>,
    /// The rod comes out at both ends
    #[arg(long)]
    through_rod: bool,
    /// Stroke
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = super::plain_number)]
    stroke: Option<f64>,
    /// All that moves: load, piston, rod
    #[arg(long, value_name = "KG", allow_negative_numbers = true, value_parser = super::plain_number)]
    mass: Option<f64>,
    /// Direction in which the rod comes out, above the horizontal: 90 lifts, -90 lowers
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = super::plain_number)]
    inclination: f64,
    /// What is left of a chamber at its end of the stroke, hoses not included; by default a typical clearance
    #[arg(long, value_name = "CM3", allow_negative_numbers = true, value_parser = super::plain_number)]
    dead_volume: Option<f64>,
    /// A single-acting cylinder: force of its return spring with the rod in and with the rod out
    #[arg(long, value_name = "N", num_args = 2, conflicts_with = "through_rod", allow_negative_numbers = true, value_parser = super::plain_number)]
    spring: Vec<f64>,
    /// Length of the adjustable cushions at A's and at B's end; one number for both, none for bumpers
    #[arg(long, value_name = "MM", num_args = 1..=2, allow_negative_numbers = true, value_parser = super::plain_number)]
    cushion_length: Vec<f64>,
    /// Sonic conductance of the cushions' needles in l/(s bar); by default a tenth of the valve's exhaust
    #[arg(long, value_name = "C", requires = "cushion_length", allow_negative_numbers = true, value_parser = super::plain_number)]
    cushion_conductance: Option<f64>,
    /// Length of the hoses from the valve to A and to B; one number for both, none for a valve on the cylinder
    #[arg(long, value_name = "M", num_args = 1..=2, allow_negative_numbers = true, value_parser = super::plain_number)]
    hose_length: Vec<f64>,
    /// Inner diameter of the hoses
    #[arg(long, value_name = "MM", default_value_t = 4.0, allow_negative_numbers = true, value_parser = super::plain_number)]
    hose_diameter: f64,
    /// Valve by its type: mpye-5-m5, mpye-5-1/8-lf, mpye-5-1/8-hf, mpye-5-1/4 or mpye-5-3/8
    #[arg(long, value_name = "TYPE", conflicts_with_all = ["flow", "conductance"])]
    valve: Option<String>,
    /// Standard nominal flow of another valve, from 6 to 5 bar
    #[arg(long, value_name = "L_PER_MIN", conflicts_with = "conductance", allow_negative_numbers = true, value_parser = super::plain_number)]
    flow: Option<f64>,
    /// Sonic conductance of another valve in l/(s bar), filling and exhausting; one number for both
    #[arg(long, value_name = "C", num_args = 1..=2, requires = "critical_ratio", allow_negative_numbers = true, value_parser = super::plain_number)]
    conductance: Vec<f64>,
    /// Critical pressure ratio, filling and exhausting; one number for both
    #[arg(long, value_name = "B", num_args = 1..=2, requires = "conductance", allow_negative_numbers = true, value_parser = super::plain_number)]
    critical_ratio: Vec<f64>,
    /// Supply pressure, gauge
    #[arg(long, value_name = "BAR", default_value_t = 6.0, allow_negative_numbers = true, value_parser = super::plain_number)]
    supply: f64,
    /// Positions at the lowest and at the highest reading, from mid-stroke; by default the stroke
    #[arg(long, value_name = "MM", num_args = 2, allow_negative_numbers = true, value_parser = super::plain_number)]
    position_range: Vec<f64>,
    /// Pressures at the lowest and at the highest reading, gauge
    #[arg(long, value_name = "BAR", num_args = 2, allow_negative_numbers = true, default_values_t = [0.0, 10.0], value_parser = super::plain_number)]
    pressure_range: Vec<f64>,
    /// What the rig is called
    #[arg(long)]
    name: Option<String>,
    /// A line of comment for the top of the file, e.g. order numbers; several may be given
    #[arg(long, value_name = "TEXT")]
    note: Vec<String>,
    /// The rig file to write; by default to standard output
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(out) = &arguments.out {
        super::must_be_new(out)?;
    }
    let set_up = set_up(arguments)?;
    let (file, origins) = set_up.rig().map_err(CliError::Usage)?;
    let mut header = vec![format!("{}.", set_up.name)];
    header.extend(arguments.note.iter().cloned());
    header.push(format!("Written by: {}", command_line(&set_up)));
    let text = commented(&file, &origins, &header);
    let Some(out) = &arguments.out else {
        say!("{}", text.trim_end());
        return Ok(());
    };
    write_file(out, |file| file.write_all(text.as_bytes()))?;
    say!("{}: {}", out.display(), set_up.name);
    say!(
        "The largest doubts stand behind their numbers: \"moves the piston by … mm\". Weigh, measure or ask for those first."
    );
    Ok(())
}

fn set_up(arguments: &Arguments) -> Result<SetUp, CliError> {
    let bore_mm = number("--bore", arguments.bore, "Bore (piston diameter) in mm")?;
    let rod_mm = number("--rod", arguments.rod, "Rod diameter in mm (0: rodless)")?;
    let stroke_mm = number("--stroke", arguments.stroke, "Stroke in mm")?;
    let mass_kg = number("--mass", arguments.mass, "Moving mass in kg (load, piston, rod)")?;
    let flow = flow(arguments)?;
    let hose_m = match arguments.hose_length[..] {
        [both] => [both; 2],
        [a, b] => [a, b],
        _ => [0.0; 2],
    };
    let cushion_mm = match arguments.cushion_length[..] {
        [both] => [both; 2],
        [a, b] => [a, b],
        _ => [0.0; 2],
    };
    let spring_n = <[f64; 2]>::try_from(&arguments.spring[..]).ok();
    let half = 0.5 * stroke_mm;
    let valve = match flow {
        Flow::Type(valve) => valve.title.to_string(),
        Flow::Nominal(flow) => format!("a valve of {flow} l/min"),
        Flow::Iso6358 { conductances: [c, _], .. } => format!("a valve of {c} l/(s bar)"),
    };
    let rod = if rod_mm == 0.0 { "rodless".to_string() } else { format!("rod {rod_mm} mm") };
    let acting = if spring_n.is_some() { ", single-acting" } else { "" };
    let name = format!("Bore {bore_mm} mm{acting}, {rod}, stroke {stroke_mm} mm, {mass_kg} kg, behind {valve}");
    Ok(SetUp {
        name: arguments.name.clone().unwrap_or(name),
        bore_mm,
        rod_mm,
        through_rod: arguments.through_rod,
        stroke_mm,
        dead_volume_cm3: arguments.dead_volume,
        mass_kg,
        spring_n,
        cushion_mm,
        needle_l_per_s_bar: arguments.cushion_conductance,
        inclination_deg: arguments.inclination,
        hose_m,
        hose_mm: arguments.hose_diameter,
        supply_bar: arguments.supply,
        flow,
        position_mm: <[f64; 2]>::try_from(&arguments.position_range[..]).unwrap_or([-half, half]),
        pressure_bar: <[f64; 2]>::try_from(&arguments.pressure_range[..]).unwrap_or([0.0, 10.0]),
    })
}

fn flow(arguments: &Arguments) -> Result<Flow, CliError> {
    let both = |numbers: &[f64]| match *numbers {
        [one] => Some([one; 2]),
        [one, other] => Some([one, other]),
        _ => None,
    };
    if let (Some(conductances), Some(ratios)) = (both(&arguments.conductance), both(&arguments.critical_ratio)) {
        return Ok(Flow::Iso6358 { conductances, ratios });
    }
    if let Some(flow) = arguments.flow {
        return Ok(Flow::Nominal(flow));
    }
    let known = || VALVES.iter().map(|valve| valve.id).collect::<Vec<_>>().join(", ");
    let answer = match &arguments.valve {
        Some(valve) => valve.clone(),
        None => ask(&format!("Valve ({}), or its flow from 6 to 5 bar in l/min", known()))?.ok_or_else(|| {
            CliError::Usage(
                "--valve is missing; give its type, or --flow, or --conductance and --critical-ratio".into(),
            )
        })?,
    };
    let wanted = answer.to_ascii_lowercase();
    if let Some(valve) = VALVES.iter().find(|valve| wanted.starts_with(valve.id)) {
        return Ok(Flow::Type(valve));
    }
    if let Ok(flow) = wanted.parse() {
        return Ok(Flow::Nominal(flow));
    }
    Err(CliError::Usage(format!(
        "the valve `{answer}` is not known by name ({}); give its --flow in l/min from 6 to 5 bar, or --conductance and \
         --critical-ratio",
        known()
    )))
}

fn number(option: &str, given: Option<f64>, question: &str) -> Result<f64, CliError> {
    if let Some(value) = given {
        return Ok(value);
    }
    let Some(answer) = ask(question)? else {
        return Err(CliError::Usage(format!("{option} is missing: {question}")));
    };
    answer.parse().map_err(|_| CliError::Usage(format!("`{answer}` is not a number; {question}")))
}

/// Asks, if there is somebody to answer.
fn ask(question: &str) -> Result<Option<String>, CliError> {
    let input = std::io::stdin();
    if !input.is_terminal() {
        return Ok(None);
    }
    eprint!("{question}: ");
    let _ = std::io::stderr().flush();
    let mut line = String::new();
    let failed = |error: std::io::Error| CliError::Failed(format!("no answer could be read: {error}"));
    input.lock().read_line(&mut line).map_err(failed)?;
    Ok(Some(line.trim().to_string()))
}

/// The command that makes the same rig, answers included.
fn command_line(set_up: &SetUp) -> String {
    let SetUp { bore_mm, rod_mm, stroke_mm, mass_kg, supply_bar, .. } = set_up;
    let mut text = format!("plant-sim rig --bore {bore_mm} --rod {rod_mm} --stroke {stroke_mm} --mass {mass_kg}");
    if set_up.through_rod {
        text += " --through-rod";
    }
    match set_up.flow {
        Flow::Type(valve) => text += &format!(" --valve {}", valve.id),
        Flow::Nominal(flow) => text += &format!(" --flow {flow}"),
        Flow::Iso6358 { conductances: [c, d], ratios: [a, b] } => {
            text += &format!(" --conductance {c} {d} --critical-ratio {a} {b}");
        }
    }
    let [a, b] = set_up.hose_m;
    if a > 0.0 || b > 0.0 {
        text += &format!(" --hose-length {a} {b} --hose-diameter {}", set_up.hose_mm);
    }
    if let Some([inside, out]) = set_up.spring_n {
        text += &format!(" --spring {inside} {out}");
    }
    let [a, b] = set_up.cushion_mm;
    if a > 0.0 || b > 0.0 {
        text += &format!(" --cushion-length {a} {b}");
    }
    if let Some(needle) = set_up.needle_l_per_s_bar {
        text += &format!(" --cushion-conductance {needle}");
    }
    if set_up.inclination_deg != 0.0 {
        text += &format!(" --inclination {}", set_up.inclination_deg);
    }
    if let Some(dead) = set_up.dead_volume_cm3 {
        text += &format!(" --dead-volume {dead}");
    }
    let ([low, high], [from, to]) = (set_up.position_mm, set_up.pressure_bar);
    text += &format!(" --supply {supply_bar} --position-range {low} {high} --pressure-range {from} {to}");
    text
}
