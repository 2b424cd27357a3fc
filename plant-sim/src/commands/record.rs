//! `plant-sim record`: telemetry of the board → log.

use super::CliError;
use indicatif::{ProgressBar, ProgressStyle};
use plant_sim::learned;
use plant_sim::probe::{self, Choice};
use plant_sim::telemetry::{Recorder, Remark, decode, format_table};
use rig_files::InputError;
use std::io::{ErrorKind, Read};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

/// Turn the telemetry of a running board into a log.
///
/// Reads the raw bytes of RTT channel 0 (defmt) from the board's debug probe, a file or standard input, decodes them with the
/// format strings in the firmware file, and writes t_s,y_m,u_v,p_a_pa,p_b_pa,p_sup_pa,y_ref_m. u_v is what the valve holds from the row's
/// sample on. Lost records leave a row of blank fields: a gap, never bridged. Ends with the stream, or with Ctrl-C.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    Straight from the board (needs a plant-sim built with --features probe):\n  \
    plant-sim record --elf target/thumbv7em-none-eabihf/firmware/firmware --probe --out out/run.csv\n\n  \
    With OpenOCD serving the board's RTT channel on a local port (docs/commissioning.md):\n  \
    nc localhost 9090 | plant-sim record --elf target/thumbv7em-none-eabihf/firmware/firmware --out out/run.csv\n\n  \
    From a stream that was saved:\n  \
    plant-sim record --elf firmware.elf --from stream.bin --out out/run.csv")]
pub(crate) struct Arguments {
    /// The firmware file that runs on the board (its format strings are needed)
    #[arg(long, value_name = "FILE")]
    elf: PathBuf,
    /// The raw stream: a file, or - for standard input
    #[arg(long, value_name = "FILE", default_value = "-")]
    from: PathBuf,
    /// Read from the board's debug probe instead; with more than one, VID:PID:SERIAL chooses
    #[arg(long, value_name = "PROBE", num_args = 0..=1, conflicts_with = "from")]
    probe: Option<Option<String>>,
    /// The board's chip, for --probe
    #[arg(long, value_name = "CHIP", default_value = "STM32G474RETx", requires = "probe")]
    chip: String,
    /// Where to write the log (CSV)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Stop after so many seconds of telemetry
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
    /// No live view, only the remarks
    #[arg(long)]
    quiet: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(seconds) = arguments.seconds {
        super::in_range("--seconds", seconds, 0.0, 1.0e6, "seconds of telemetry")?;
    }
    super::can_be_written(&arguments.out, [&*arguments.elf, &*arguments.from])?;
    let elf_name = arguments.elf.display().to_string();
    let elf = std::fs::read(&arguments.elf).map_err(|error| InputError::unreadable(&elf_name, &error))?;
    let (from, input) = open(arguments, &elf)?;
    let table = format_table(&elf, &elf_name)?;
    let mut decoder = table.new_stream_decoder();

    let stop = Arc::new(AtomicBool::new(false));
    let on_interrupt = Arc::clone(&stop);
    ctrlc::set_handler(move || on_interrupt.store(true, Ordering::Relaxed))
        .map_err(|error| CliError::Failed(format!("cannot catch Ctrl-C: {error}")))?;

    let view = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
    let style = ProgressStyle::with_template("{spinner} {msg}");
    view.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    let mut recorder = Recorder::new();
    let chunks = pump(input);
    let mut first_s = None;
    let (mut broken, mut learned) = (None, None);
    while !stop.load(Ordering::Relaxed) {
        let bytes = match chunks.recv_timeout(PATIENCE) {
            Ok(Ok(bytes)) => bytes,
            Ok(Err(error)) => {
                broken = Some(error);
                break;
            }
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        let mut remarks = Vec::new();
        decode(decoder.as_mut(), &bytes, &mut recorder, &mut remarks);
        for remark in remarks {
            // Told once a second: the last one will do.
            if let Remark::Learned(..) = remark {
                learned = Some(remark);
                continue;
            }
            view.suspend(|| eprintln!("{}", sentence(&remark)));
        }
        view.set_message(line(&recorder));
        view.tick();
        if recorder.tally.records > 0 {
            let first = *first_s.get_or_insert(recorder.log().t_s.first().copied().unwrap_or(0.0));
            if arguments.seconds.is_some_and(|seconds| recorder.latest.t_s - first >= seconds) {
                break;
            }
        }
    }
    view.finish_and_clear();

    let tally = recorder.tally;
    if tally.records == 0 {
        if let Some(error) = broken {
            return Err(InputError::unreadable(&from, &error).into());
        }
        let remedy = if tally.unscaled > 0 {
            "record for longer than a second: the board repeats its ranges once a second"
        } else {
            "check that the board runs and that --elf is the very file that was flashed"
        };
        let problem = format!("holds no telemetry that can be used ({} frames unreadable)", tally.malformed);
        return Err(InputError::new(from, problem, remedy).into());
    }
    recorder.log().write(&arguments.out)?;
    eprintln!(
        "{} records, {} lost, {} unreadable frames, {} before the ranges were known → {}",
        tally.records,
        tally.lost,
        tally.malformed,
        tally.unscaled,
        arguments.out.display()
    );
    if let Some(learned) = &learned {
        eprintln!("{}", sentence(learned));
    }
    match broken {
        None => Ok(()),
        Some(error) => Err(CliError::Failed(format!("{from}: {error}; what came before is in the log"))),
    }
}

/// How long Ctrl-C may take to be noticed while nothing comes.
const PATIENCE: Duration = Duration::from_millis(100);

/// Reads in a thread of its own: a read that waits for a silent board would not hear Ctrl-C. The channel closes with the
/// stream.
fn pump(mut input: Box<dyn Read + Send>) -> Receiver<std::io::Result<Vec<u8>>> {
    let (sender, receiver) = sync_channel(64);
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        loop {
            let chunk = match input.read(&mut bytes) {
                Ok(0) => return,
                Ok(count) => Ok(bytes.get(..count).unwrap_or_default().to_vec()),
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => continue,
                Err(error) => Err(error),
            };
            let last = chunk.is_err();
            if sender.send(chunk).is_err() || last {
                return;
            }
        }
    });
    receiver
}

/// Where the bytes come from, and its name.
fn open(arguments: &Arguments, elf: &[u8]) -> Result<(String, Box<dyn Read + Send>), CliError> {
    if let Some(selector) = &arguments.probe {
        let choice = Choice { chip: &arguments.chip, selector: selector.as_deref() };
        let stream = probe::attach(&choice, elf).map_err(|error| CliError::Usage(error.to_string()))?;
        return Ok(("the probe".into(), stream));
    }
    let from = arguments.from.display().to_string();
    if from == "-" {
        return Ok(("standard input".into(), Box::new(std::io::stdin())));
    }
    let file = std::fs::File::open(&arguments.from).map_err(|error| InputError::unreadable(&from, &error))?;
    Ok((from, Box::new(file)))
}

pub(crate) fn sentence(remark: &Remark) -> String {
    match remark {
        Remark::Mode(t_s, word) => format!("{t_s:10.3} s  {word}"),
        Remark::Lost(t_s, count) => format!("{t_s:10.3} s  {count} records lost"),
        Remark::Restart(t_s) => format!("{t_s:10.3} s  the board has restarted"),
        Remark::Disagreement(t_s) => format!("{t_s:10.3} s  the readings contradict the board's model"),
        Remark::Learned(t_s, values) => format!("{t_s:10.3} s  learned {}", learned::words(values)),
        Remark::Text(text) => format!("              {text}"),
    }
}

fn line(recorder: &Recorder) -> String {
    let latest = &recorder.latest;
    let [y, reference] = latest.y_m.map(|metres| metres * 1000.0);
    let [a, b, supply] = latest.p_pa.map(|pascals| pascals * 1.0e-5);
    format!(
        "{:9.2} s  y {y:8.2} mm → {reference:8.2} mm  a {a:5.2} b {b:5.2} sup {supply:5.2} bar  u {:6.3} V  {} lost",
        latest.t_s, latest.u_v, recorder.tally.lost
    )
}
