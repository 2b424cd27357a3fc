//! `plant-sim board`: commands to the board over its virtual COM port.

mod bench;
mod measure;
mod parameters;
mod tune;
mod update;

use super::{CliError, in_range};
use board_link::{Command, Generator, Parameter, Reply, Shape};
use plant_sim::board::{BoardError, Client};
use plant_sim::commission::calibrate::Channel;
use plant_sim::commission::dead_zone::Search;
use plant_sim::learned;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::time::Duration;
use tune::Tune;
use update::Update;

/// Talk to a board: state, setpoints, parameters.
///
/// The board answers only while its firmware runs; telemetry does not come this way (see `plant-sim record`).
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE: position the cylinder\n  \
    plant-sim board --port /dev/ttyACM0 status\n  \
    plant-sim board --port /dev/ttyACM0 arm\n  \
    plant-sim board --port /dev/ttyACM0 hold 0.045\n  \
    plant-sim board --port /dev/ttyACM0 disarm\n\n\
    The same without a board, the firmware on the emulated chip; commands come from standard input, one a line:\n  \
    plant-sim board --emulated target/thumbv7em-none-eabihf/firmware/firmware --rig rigs/real-mpye.toml")]
pub(crate) struct Arguments {
    /// The ST-LINK's virtual COM port, e.g. /dev/ttyACM0, /dev/cu.usbmodem…, COM3
    #[arg(long, value_name = "PORT", default_value = "/dev/ttyACM0")]
    port: String,
    /// No board: this firmware (ELF) on the emulated chip, a simulated cylinder at its pins. Reads commands from standard input, one a
    /// line; besides those below `wait SECONDS`, `push NEWTON`, `supply PASCAL`, `sensors on|off`, `meter`, `power-cycle`
    #[arg(long, value_name = "ELF", conflicts_with = "port")]
    emulated: Option<PathBuf>,
    /// The cylinder at the emulated board's pins (default: the paper's case a)
    #[arg(long, value_name = "FILE", requires = "emulated")]
    rig: Option<PathBuf>,
    /// Where to write the emulated board's telemetry as a log (CSV) at the end
    #[arg(long, value_name = "FILE", requires = "emulated")]
    log: Option<PathBuf>,
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(clap::Subcommand, Debug)]
enum Action {
    /// Firmware, board and tick rate
    Version,
    /// State, readings and counters
    Status,
    /// Idle → run; the piston holds its place
    Arm,
    /// Run → idle; valve to mid
    Disarm,
    /// Acknowledge a safe state: self-test, then idle
    Acknowledge,
    /// Hold a position
    Hold {
        /// From mid-stroke, m
        #[arg(allow_negative_numbers = true)]
        position_m: f64,
    },
    /// Square wave
    Step(Motion),
    /// Triangle wave
    Ramp(Motion),
    /// Sine
    Sine(Motion),
    /// The identification sequence made for the diagnosis
    Identify(Motion),
    /// Read one parameter, or all
    Get {
        /// Name, e.g. gain_v_per_m; all without
        name: Option<String>,
    },
    /// Change parameters until the next restart: several at once, or none of them
    Set {
        /// Name and value in SI units, e.g. gain_v_per_m 4; more of them where they belong together
        #[arg(required = true, num_args = 2.., value_names = ["NAME", "VALUE"], allow_negative_numbers = true)]
        values: Vec<String>,
    },
    /// Put the parameters of a file in force, all at once or none, until the next restart
    #[command(
        after_long_help = "A rig file (nominal, or extended by `plant-sim diagnose`) says converters, dead zone, limits \
        and the rig's own numbers; gain, monitor and times stay as they are. A file that `board parameters --out` wrote says \
        what it says."
    )]
    Apply {
        /// Rig file, or parameters of a board (TOML)
        file: PathBuf,
        /// Write them to flash, too
        #[arg(long)]
        save: bool,
    },
    /// Two-point calibration of a sensor: offset and gain from two known states
    #[command(after_long_help = "EXAMPLE: the piston first at one end stop, then at the other\n  \
        plant-sim board --port /dev/ttyACM0 calibrate position -0.25 0.25\n\
        EXAMPLE: a chamber open to the air, then at the supply pressure that a gauge shows\n  \
        plant-sim board --port /dev/ttyACM0 calibrate pressure-a 1.013e5 7.0e5")]
    Calibrate {
        /// Which sensor
        channel: measure::ChannelName,
        /// The two known values, m from mid-stroke or Pa absolute
        #[arg(num_args = 2, required = true, value_names = ["FIRST", "SECOND"], allow_negative_numbers = true)]
        values: Vec<f64>,
        /// Write the result to flash, too
        #[arg(long)]
        save: bool,
    },
    /// Search the valve's dead zone: small moves about where the piston stands, with the air on
    DeadZone {
        /// Largest voltage tried, V about mid
        #[arg(long, default_value_t = 1.0, value_name = "V")]
        limit: f64,
        /// Passes in each direction
        #[arg(long, default_value_t = 2, value_name = "N")]
        passes: usize,
        /// Let the controller compensate what was found, until the next start
        #[arg(long)]
        apply: bool,
        /// The same, and write it to flash
        #[arg(long)]
        save: bool,
    },
    /// Let the board find out about its rig: dead zone, mass, friction, flow; and step before and after
    #[command(
        after_long_help = "The piston moves about the middle of its range: first by small valve voltages, then by 2, 5 and 10 % of the \
        range, for a minute. The diagnosis tells what the log of it shows, and writes DIR/extended-rig.toml and DIR/report.html. \
        Without --apply or --save the board is left as it was."
    )]
    Tune(tune::Arguments),
    /// Write all parameters to flash
    Save,
    /// What the positioning law has learned, beside nominal values and limits
    Learned,
    /// Write what was learned to flash, with all parameters: from then on every start begins with it. Only while idle
    Keep,
    /// Forget what was kept, and write all parameters to flash: every start begins with nominal values
    Forget,
    /// Back to the defaults (not saved)
    Defaults,
    /// Bench mode: the on-board model in place of sensors and valve
    Bench {
        /// on or off
        #[arg(value_parser = ["on", "off"])]
        switch: String,
    },
    /// The message of the last panic or fault
    LastFault,
    /// Restart the board
    Restart,
    /// New firmware over the serial line; the parameters stay
    #[command(
        after_long_help = "The file is checked first: chip, board, protocol, layout of the parameters. The board leaves for the \
        bootloader in its ROM, with the valve at mid and the air off, and starts the new firmware when all of it has been read back."
    )]
    Update {
        /// What `cargo fw` makes: target/thumbv7em-none-eabihf/firmware/firmware
        file: PathBuf,
        /// The board waits in its bootloader already: an update that was cut, or BOOT0 tied to 3.3 V
        #[arg(long)]
        in_bootloader: bool,
        /// The new firmware stores parameters in another layout: they are lost
        #[arg(long)]
        new_parameters: bool,
    },
    /// List all parameters with range, default and meaning (no board needed), or write those of the board to a file
    Parameters {
        /// File for the board's present values; `board apply` takes it back
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
}

#[derive(clap::Args, Debug)]
struct Motion {
    /// Centre of the motion, m from mid-stroke
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_name = "M")]
    centre: f64,
    /// Half the peak-to-peak motion, m
    #[arg(long, default_value_t = 0.05, value_name = "M")]
    amplitude: f64,
    /// One period, s (for the identification sequence, all of it)
    #[arg(long, default_value_t = 40.0, value_name = "S")]
    period: f64,
}

/// Rounds to whole thousandths or millionths of a unit; a cast saturates, and the board checks the range.
fn whole(value: f64, per_unit: f64) -> i32 {
    (value * per_unit).round() as i32
}

impl Motion {
    fn generator(&self, shape: Shape) -> Result<Command, CliError> {
        for (option, value) in [("--centre", self.centre), ("--amplitude", self.amplitude), ("--period", self.period)] {
            if !value.is_finite() {
                return Err(CliError::Usage(format!("{option} must be a number")));
            }
        }
        Ok(Command::Generate(Generator::Repeat {
            shape,
            centre_um: whole(self.centre, 1.0e6),
            amplitude_um: whole(self.amplitude, 1.0e6),
            period_ms: (self.period * 1.0e3).round() as u32,
        }))
    }
}

fn parameter(name: &str) -> Result<Parameter, CliError> {
    Parameter::from_name(name).ok_or_else(|| {
        let known = Parameter::ALL.map(Parameter::name);
        let hint =
            rig_files::closest(name, known).map_or_else(String::new, |close| format!(" Did you mean `{close}`?"));
        CliError::Usage(format!("there is no parameter `{name}`.{hint} `plant-sim board parameters` lists them"))
    })
}

fn failed(error: BoardError) -> CliError {
    CliError::Failed(error.to_string())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    match (&arguments.emulated, &arguments.action) {
        (Some(elf), action) => bench::run(elf, arguments.rig.as_deref(), arguments.log.as_deref(), action.as_ref()),
        (None, Some(action)) => match task(action)? {
            None => Ok(()),
            Some(Task::Update(update)) => update.carry_out(&arguments.port),
            Some(task) => carry_out(task, &mut open(&arguments.port)?),
        },
        (None, None) => Err(CliError::Usage("say what to do, for example `status`; --help lists the commands".into())),
    }
}

/// What an action asks of the board; `None`: nothing, it is done. What is typed is judged before a board is looked for.
fn task(action: &Action) -> Result<Option<Task>, CliError> {
    Ok(Some(match action {
        Action::Parameters { out: None } => {
            parameters::list();
            return Ok(None);
        }
        Action::Parameters { out: Some(out) } => Task::Write(out.clone()),
        Action::Get { name: None } => Task::Show,
        Action::Set { values } => Task::Set(parameters::pairs(values)?),
        Action::Apply { file, save } => Task::Apply(file.clone(), parameters::read(file)?, *save),
        Action::Calibrate { channel, values, save } => match values[..] {
            [first, second] if first.is_finite() && second.is_finite() && first != second => {
                Task::Calibrate((*channel).into(), [first, second], *save)
            }
            _ => return Err(CliError::Usage("give two different values, m or Pa".into())),
        },
        Action::DeadZone { limit, passes, apply, save } => {
            in_range("--limit", *limit, 0.1, 5.0, "V")?;
            in_range("--passes", *passes as f64, 1.0, 20.0, "passes")?;
            Task::DeadZone(Search { limit_v: *limit, passes: *passes }, *apply, *save)
        }
        Action::Tune(arguments) => Task::Tune(Box::new(Tune::prepare(arguments)?)),
        Action::Update { file, in_bootloader, new_parameters } => {
            Task::Update(Update::read(file, *in_bootloader, *new_parameters)?)
        }
        other => Task::Ask(command(other)?),
    }))
}

fn carry_out<P: Read + Write>(task: Task, client: &mut Client<P>) -> Result<(), CliError> {
    match task {
        Task::Ask(command) => show(&client.ask(command).map_err(failed)?),
        Task::Show => parameters::show(client)?,
        Task::Set(changes) => parameters::set(client, &changes)?,
        Task::Apply(path, file, save) => parameters::apply(client, &path, &file, save)?,
        Task::Calibrate(channel, values, save) => {
            measure::calibrate(client, channel, values, save, measure::ask_person)?;
        }
        Task::DeadZone(search, apply, save) => measure::dead_zone(client, &search, apply, save)?,
        Task::Tune(tune) => tune.carry_out(client)?,
        Task::Write(out) => parameters::write(client, &out)?,
        Task::Update(_) => {
            return Err(CliError::Usage(
                "the emulated chip has no bootloader in its ROM; give --emulated the new file".into(),
            ));
        }
    }
    Ok(())
}

/// What is to be done with a board.
enum Task {
    /// One command, its answer shown.
    Ask(Command),
    /// All values.
    Show,
    /// New values.
    Set(Vec<plant_sim::commission::Change>),
    /// New values of a file.
    Apply(PathBuf, parameters::ToApply, bool),
    /// Two-point calibration.
    Calibrate(Channel, [f64; 2], bool),
    /// Search of the dead zone.
    DeadZone(Search, bool, bool),
    /// All values to a file.
    Write(PathBuf),
    /// The board finds out about its rig.
    Tune(Box<Tune>),
    /// New firmware.
    Update(Update),
}

fn open(port: &str) -> Result<Client<Box<dyn serialport::SerialPort>>, CliError> {
    let opened = serialport::new(port, 115_200).timeout(Duration::from_millis(50)).open().map_err(|error| {
        CliError::Failed(format!(
            "{port}: {error}; is the board plugged in, and may you use the port (Linux: group dialout)?"
        ))
    })?;
    Client::open(opened, std::process::id()).map_err(failed)
}

/// The command of an action that is one question and one answer.
fn command(action: &Action) -> Result<Command, CliError> {
    Ok(match action {
        Action::Version => Command::Version,
        Action::Arm => Command::Arm,
        Action::Disarm => Command::Disarm,
        Action::Acknowledge => Command::Acknowledge,
        Action::Hold { position_m } if position_m.is_finite() => {
            Command::Generate(Generator::Hold { position_um: whole(*position_m, 1.0e6) })
        }
        Action::Hold { .. } => return Err(CliError::Usage("the position must be a number (metres)".into())),
        Action::Step(motion) => motion.generator(Shape::Step)?,
        Action::Ramp(motion) => motion.generator(Shape::Ramp)?,
        Action::Sine(motion) => motion.generator(Shape::Sine)?,
        Action::Identify(motion) => motion.generator(Shape::Identification)?,
        Action::Get { name: Some(name) } => Command::Get(parameter(name)?),
        Action::Save => Command::Save,
        Action::Learned => Command::Learned,
        Action::Keep => Command::Keep,
        Action::Forget => Command::Forget,
        Action::Defaults => Command::Defaults,
        Action::Bench { switch } => Command::Bench { on: switch == "on" },
        Action::LastFault => Command::LastFault,
        Action::Restart => Command::Restart,
        // `run` has taken the others out.
        Action::Status
        | Action::Calibrate { .. }
        | Action::Tune(_)
        | Action::Update { .. }
        | Action::DeadZone { .. }
        | Action::Parameters { .. }
        | Action::Get { name: None }
        | Action::Set { .. }
        | Action::Apply { .. } => Command::Status,
    })
}

fn show(reply: &Reply) {
    match reply {
        Reply::Done => say!("done"),
        Reply::Value(value) => say!("{value}"),
        Reply::Learned(values) => {
            say!("{}", super::text_table(&learned::table(values)).trim_end());
            match (values.kept, values.refused) {
                (None, _) => say!("nothing kept: a start begins with nominal values"),
                (Some(_), None) => say!("a start begins with what is kept"),
                (Some(_), Some(why)) => say!("what is kept is not used: {}", why.words()),
            }
        }
        Reply::Samples(samples) => say!("{samples:?}"),
        Reply::Text(text) if text.is_empty() => say!("no fault on record"),
        Reply::Text(text) => say!("{text}"),
        Reply::Version(version) => {
            say!("firmware {} on {}, {} ticks per second", version.firmware, version.board, version.tick_hz);
        }
        Reply::Status(status) => {
            let [y, a, b, supply] = status.codes;
            say!("state        {}{}", status.state, if status.bench { " (bench)" } else { "" });
            say!("ticks        {}", status.ticks);
            say!("codes        position {y}, p_a {a}, p_b {b}, supply {supply}; valve {}", status.dac_code);
            say!("setpoint     {:.6} m", f64::from(status.setpoint_um) * 1.0e-6);
            say!(
                "tick         worst {} cycles; {} overruns, {} late, {} missed; {} against the model",
                status.worst_cycles,
                status.overruns,
                status.late_ticks,
                status.missed_ticks,
                status.disagreements
            );
            say!("lost         {} telemetry records, {} bad frames", status.telemetry_lost, status.bad_frames);
        }
    }
}
