//! Every scenario under QEMU: the same DAC codes as on the desktop, and what a tick costs in instructions.
//!
//! Skipped with a message where QEMU or the target is missing, and without POSITIONER_TESTS=all.

use control::{Inputs, LawChoice, Mode, OperatorCommand, Position, Quantities};
use firmware_core::lockstep::Counts;
use firmware_core::{BenchPlant, mode_number};
use plant_sim::telemetry::{Recorder, Remark, decode, format_table};
use rig_files::Log;
use scenarios::qemu::{QemuTarget, guest};
use scenarios::{HostTarget, Sample, Scenario, Target, TargetError, TickOutput, host_target, listing, run_observed};
use std::path::{Path, PathBuf};
use std::sync::Once;
use test_stages::skipped;

/// The tick in which bench mode is armed: past the self-test.
const ARMED_AT: u32 = 1000;

fn pipes(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("positioner-qemu-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

fn on_the_host(scenario: &Scenario) -> Vec<Sample> {
    let mut host = host_target(scenario).expect("host target");
    let mut samples = Vec::new();
    run_observed(scenario, &mut host, |sample| samples.push(*sample)).expect("host run");
    samples
}

/// The mode's word: how long a self-test still takes is not transmitted.
fn word(sample: &Sample) -> (u16, String) {
    (sample.dac, sample.mode.to_string())
}

/// Compares figures with the last recorded ones.
fn recorded(file: &str, found: &[u64]) {
    let report = Path::new(env!("CARGO_MANIFEST_DIR")).join("bench").join(file);
    let text = std::fs::read_to_string(&report).unwrap_or_else(|error| panic!("{}: {error}", report.display()));
    for ((name, recorded), found) in text.lines().skip(1).filter_map(|line| line.split_once(',')).zip(found) {
        let recorded: u64 = recorded.trim().parse().unwrap_or_else(|_| panic!("{}: {name}", report.display()));
        // An unexplained improvement is a change, too: bounded on both sides.
        assert!(
            found * 100 <= recorded * 110 && found * 110 >= recorded * 100,
            "{name}: {found} instructions, recorded {recorded}; if the change is meant, write it to {}",
            report.display()
        );
    }
}

/// The guest's ELF file; says why where there is none.
fn guest_or_skip() -> Option<&'static Path> {
    static SAID: Once = Once::new();
    guest().inspect_err(|why| SAID.call_once(|| skipped("the control loop under QEMU", why))).ok()
}

/// Instructions over the ticks of several scenarios.
#[derive(Clone, Copy, Default)]
struct Sums {
    ticks: u64,
    tick: u64,
    all: u64,
    most: [u64; 2],
}

impl Sums {
    fn add(&mut self, counts: &Counts) {
        self.ticks += u64::from(counts.ticks);
        self.tick += u64::from(counts.tick[1]);
        self.all += u64::from(counts.all[1]);
        self.most[0] = self.most[0].max(u64::from(counts.tick[2]));
        self.most[1] = self.most[1].max(u64::from(counts.all[2]));
    }

    /// Mean and most of the tick, then with the monitor.
    fn figures(&self) -> [u64; 4] {
        let ticks = self.ticks.max(1);
        [self.tick / ticks, self.most[0], self.all / ticks, self.most[1]]
    }
}

#[test]
fn every_scenario_gives_the_same_codes_under_qemu_and_a_tick_costs_what_is_recorded() {
    let Some(elf) = guest_or_skip() else { return };
    // By law: sums over the ticks, and the most.
    let mut laws = [(LawChoice::Paper, Sums::default()), (LawChoice::Servo, Sums::default())];
    println!("{:60} {:>6}  tick: min mean max   with monitor: min mean max", "scenario", "ticks");
    for file in listing::files() {
        let scenario = Scenario::read(&file).unwrap_or_else(|error| panic!("{error}"));
        let host = on_the_host(&scenario);
        let name = listing::name(&file);
        let mut target =
            QemuTarget::start(elf, &scenario, &pipes(&name), None, false).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut tick = 0;
        run_observed(&scenario, &mut target, |sample| {
            assert_eq!(word(sample), word(&host[tick]), "{name}: tick {tick}");
            tick += 1;
        })
        .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(tick, host.len());
        let counts = target.finish().unwrap_or_else(|error| panic!("{name}: {error}"));
        println!(
            "{name:60} {:6} {:5} {:5} {:5}   {:5} {:5} {:5}",
            counts.ticks,
            counts.tick[0],
            counts.tick[1] / counts.ticks,
            counts.tick[2],
            counts.all[0],
            counts.all[1] / counts.ticks,
            counts.all[2]
        );
        let law = scenario.parameters(&file.to_string_lossy()).unwrap_or_else(|error| panic!("{error}")).law;
        for (_, sums) in laws.iter_mut().filter(|(one, _)| *one == law) {
            sums.add(&counts);
        }
    }
    let found = laws.map(|(law, sums)| {
        let found = sums.figures();
        println!(
            "{}: tick mean {} max {}, with monitor mean {} max {}",
            law.word(),
            found[0],
            found[1],
            found[2],
            found[3]
        );
        found
    });
    // Above these the tick is another one than docs/control-law.md and docs/firmware.md tell of.
    let [[_, papers, _, papers_all], [_, servos, _, servos_all]] = found;
    assert!(papers <= 1500 && papers_all <= 5000, "the paper's law has 1500 instructions, with the monitor 5000");
    assert!(servos <= 8500 && servos_all <= 9500, "the positioning law has 8500 instructions, with the monitor 9500");
    let found = found.concat();
    recorded("instructions_per_tick.csv", &found);
}

#[test]
fn a_recorded_stream_of_the_running_firmware_becomes_a_log_with_every_sample_and_losses_become_gaps() {
    let Some(elf) = guest_or_skip() else { return };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper_b_does_not_overshoot.toml");
    let scenario = Scenario::read(&file).unwrap_or_else(|error| panic!("{error}"));
    let stream = std::env::temp_dir().join(format!("positioner-telemetry-{}.bin", std::process::id()));
    let mut target = QemuTarget::start(elf, &scenario, &pipes("telemetry"), Some((&stream, 1)), false)
        .unwrap_or_else(|e| panic!("{e}"));
    let mut samples = Vec::new();
    run_observed(&scenario, &mut target, |sample| samples.push(*sample)).expect("run");
    target.finish().expect("end");
    let bytes = std::fs::read(&stream).expect("stream");
    let _ = std::fs::remove_file(&stream);

    let elf_bytes = std::fs::read(elf).expect("guest");
    let table = format_table(&elf_bytes, "firmware-qemu").expect("formats");
    let record = |bytes: &[u8]| {
        let mut decoder = table.new_stream_decoder();
        let (mut recorder, mut remarks) = (Recorder::new(), Vec::new());
        for chunk in bytes.chunks(1000) {
            decode(decoder.as_mut(), chunk, &mut recorder, &mut remarks);
        }
        (recorder, remarks)
    };

    let (whole, _) = record(&bytes);
    println!("{} bytes, {:?}", bytes.len(), whole.tally);
    assert_eq!(whole.tally.records as usize, samples.len());
    assert_eq!((whole.tally.lost, whole.tally.malformed), (0, 0));
    let log = Log::parse(whole.log().to_csv().into_bytes(), "recorded.csv").expect("a log that plant-sim reads");
    assert!(log.gaps().is_empty(), "{:?}", log.gaps());
    let io = &scenario.rig_file().expect("rig").io;
    for (row, sample) in samples.iter().enumerate() {
        assert_eq!(io.position().code(log.y_m[row]), u32::from(sample.codes[0]), "row {row}");
        let p_b = log.p_b_pa.as_ref().expect("p_b")[row];
        assert_eq!(io.pressure().code(p_b), u32::from(sample.codes[2]), "row {row}");
    }

    // Two kilobytes fall out of the stream: the records in them are missing, counted, and a gap in the log.
    let cut = [&bytes[..100_000], &bytes[102_000..]].concat();
    let (torn, remarks) = record(&cut);
    assert!(torn.tally.lost > 10, "{:?}", torn.tally);
    assert!(remarks.iter().any(|remark| matches!(remark, Remark::Lost(..))));
    assert!(torn.tally.records + torn.tally.lost >= samples.len() as u64 - 1);
    let log = Log::parse(torn.log().to_csv().into_bytes(), "torn.csv").expect("a log");
    assert!(!log.gaps().is_empty());
}

/// The loop on this computer, and what it had learned after each second.
struct Learning {
    host: HostTarget,
    tick_hz: u32,
    ticks: u32,
    seconds: Vec<Quantities>,
}

impl Target for Learning {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        let output = self.host.tick(inputs);
        self.ticks += 1;
        if self.ticks.is_multiple_of(self.tick_hz) {
            self.seconds.extend(self.host.learned().map(|learned| learned.values(self.tick_hz)));
        }
        output
    }

    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        self.host.watchdog_reset()
    }
}

#[test]
fn telemetry_tells_once_a_second_what_the_law_has_learned_as_on_the_host() {
    let Some(elf) = guest_or_skip() else { return };
    let text = "name = \"learning\"\nrig = \"paper-b\"\ndead_zone_v = 0.42\nduration_s = 3.5\n\
                reference = [{ at_s = 0.0, position_m = 0.045 }, { at_s = 1.5, position_m = -0.045 }]\n\
                control = { law = \"servo\" }\nexpect = {}\n";
    let scenario = Scenario::parse(text, "learning.toml", Path::new(".")).unwrap_or_else(|error| panic!("{error}"));
    let tick_hz = scenario.parameters("learning").expect("parameters").tick_hz;
    let host = host_target(&scenario).expect("host target");
    let mut learning = Learning { host, tick_hz, ticks: 0, seconds: Vec::new() };
    run_observed(&scenario, &mut learning, |_| ()).expect("host run");

    let stream = std::env::temp_dir().join(format!("positioner-learned-{}.bin", std::process::id()));
    let mut target = QemuTarget::start(elf, &scenario, &pipes("learned"), Some((&stream, 10)), false)
        .unwrap_or_else(|error| panic!("{error}"));
    run_observed(&scenario, &mut target, |_| ()).expect("run");
    target.finish().expect("end");
    let bytes = std::fs::read(&stream).expect("stream");
    let _ = std::fs::remove_file(&stream);
    let table = format_table(&std::fs::read(elf).expect("guest"), "firmware-qemu").expect("formats");
    let (mut recorder, mut remarks) = (Recorder::new(), Vec::new());
    decode(table.new_stream_decoder().as_mut(), &bytes, &mut recorder, &mut remarks);
    let told = remarks.into_iter().filter_map(|remark| match remark {
        Remark::Learned(_, values) => Some(values),
        _ => None,
    });
    let told: Vec<Quantities> = told.collect();
    println!("{told:?}");
    assert_eq!(told.len(), 3);
    assert_eq!(told, learning.seconds);
    assert!(told[0] != told[2], "the second move teaches more");
}

#[test]
fn bench_mode_simulates_the_same_rig_under_qemu_as_on_the_host_and_costs_what_is_recorded() {
    let Some(elf) = guest_or_skip() else { return };
    let mut found = [0, 0];
    for rig in ["paper-a", "paper-b", "paper-c"] {
        let text = format!(
            "name = \"bench\"\nrig = \"{rig}\"\ndead_zone_v = 0.42\nduration_s = 5.0\nstart = \"boot\"\n\
             monitor = {{ enabled = false }}\nexpect = {{}}\n"
        );
        let scenario = Scenario::parse(&text, "bench.toml", Path::new(".")).unwrap_or_else(|error| panic!("{error}"));
        let mut target = QemuTarget::start(elf, &scenario, &pipes(&format!("bench-{rig}")), None, true)
            .unwrap_or_else(|error| panic!("{rig}: {error}"));
        let parameters = scenario.parameters("bench").expect("parameters");
        let file = scenario.rig_file().expect("rig");
        let plant = BenchPlant::of_rig(&file.rig.convert(), &parameters).expect("a physical rig");
        let mut host = host_target(&scenario).expect("host target").on_the_bench(plant);
        let (mut nearest, mut farthest) = (u16::MAX, 0);
        for tick in 0..5000 {
            let reference = Position::saturating_from_num(if tick % 2000 < 1000 { 0.05 } else { -0.05 });
            let command = (tick == ARMED_AT).then_some(OperatorCommand::Arm);
            let inputs = Inputs { reference, command, ..Inputs::default() };
            let record = host.loop_tick(&inputs).record;
            let answer = target.tick(&inputs).unwrap_or_else(|e| panic!("{rig}: {e}"));
            assert_eq!((answer.dac.0, mode_number(answer.mode)), (record.dac, record.mode), "{rig}: tick {tick}");
            assert_eq!(answer.mode == Mode::Run, tick >= ARMED_AT, "{rig}: {} at tick {tick}", answer.mode);
            (nearest, farthest) = (nearest.min(record.codes[0]), farthest.max(record.codes[0]));
        }
        assert!(farthest - nearest > 2000, "{rig}: the simulated piston has hardly moved");
        let counts = target.finish().unwrap_or_else(|error| panic!("{rig}: {error}"));
        println!("{rig}: tick with simulated plant {} mean, {} most", counts.tick[1] / counts.ticks, counts.tick[2]);
        found = [found[0].max(counts.tick[1] / counts.ticks), found[1].max(counts.tick[2])];
    }
    recorded("bench_instructions_per_tick.csv", &found.map(u64::from));
}
