//! Flipped bits in what the control interrupt owns, while the piston moves: what becomes of the valve.

use std::fmt::Write as _;
use std::path::Path;

use board_link::{Command, Generator, Shape};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use stm32_emulator::memory::RAM;

use super::{Bench, elf, symbol};

/// Flips, each in a run of its own.
const FLIPS: usize = 1_900;
/// How long a run is watched behind the flip, s.
const WATCHED_S: f64 = 0.5;
/// Ticks at 1 kHz with wrong codes that the plant does not notice: a fifth of a millimetre at 10 mm/s.
const SHORT_TICKS: u32 = 20;
/// The valve's code at mid, and how near to an end of the range counts as full scale.
const MID: u16 = 2048;
const NEAR_END: u16 = 20;

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// Every code is that of an undisturbed loop.
    NoEffect,
    /// The valve went to mid or the chip was reset, and no wrong code came before it.
    SafeAtOnce,
    /// Wrong codes for at most 20 ms.
    WrongForShort,
    /// Wrong codes for longer.
    WrongForLong,
    /// The valve at an end of its range for more than 20 ms, and nothing tripped.
    FullScale,
}

impl Outcome {
    const ALL: [(Self, &str); 5] = [
        (Self::NoEffect, "every code right"),
        (Self::SafeAtOnce, "safe (valve at mid, or reset) before any wrong code"),
        (Self::WrongForShort, "wrong codes for at most 20 ms"),
        (Self::WrongForLong, "wrong codes for more than 20 ms"),
        (Self::FullScale, "full scale for more than 20 ms, untripped"),
    ];
}

/// A board that follows a sine, at several instants of its period.
fn moving(elf: &[u8]) -> Vec<Bench> {
    let mut bench = Bench::idle(elf);
    bench.done(Command::Generate(Generator::Hold { position_um: 0 }));
    bench.done(Command::Arm);
    let shape = Shape::Sine;
    bench.done(Command::Generate(Generator::Repeat { shape, centre_um: 0, amplitude_um: 50_000, period_ms: 1_000 }));
    assert_eq!(bench.run(0.5), None);
    let mut instants = Vec::new();
    for _ in 0..10 {
        assert_eq!(bench.run(0.1), None);
        instants.push(bench.copy());
    }
    bench.agrees();
    instants
}

/// Flips a bit at some time within two ticks and watches.
fn flip(from: &Bench, bit: usize, wait_s: f64) -> Outcome {
    let mut bench = from.copy();
    assert_eq!(bench.run(wait_s), None);
    bench.machine().chip.ram[bit / 8] ^= 1 << (bit % 8);
    let (mut wrong, mut full, mut stopped) = (0_u32, 0_u32, false);
    let ended = bench.run_and(WATCHED_S, |host, board| {
        let away = board != host && board != MID;
        wrong += u32::from(away);
        full += u32::from(away && !(NEAR_END..=4095 - NEAR_END).contains(&board));
        stopped = board == MID && host != MID;
    });
    // What the emulator does not model would be a bus fault or worse on the chip, never a normal tick.
    let stopped = stopped || !matches!(ended, Ok(None));
    match wrong {
        0 if stopped => Outcome::SafeAtOnce,
        0 => Outcome::NoEffect,
        1..=SHORT_TICKS => Outcome::WrongForShort,
        _ if full > SHORT_TICKS => Outcome::FullScale,
        _ => Outcome::WrongForLong,
    }
}

#[test]
fn flipped_bits_in_what_the_interrupt_owns_never_drive_the_valve_to_an_end() {
    let Some(elf) = elf() else { return };
    let (owned, bytes) = symbol(elf, "sampling::OWNED");
    let instants = moving(elf);
    let mut random = StdRng::seed_from_u64(1);
    let flips: Vec<(usize, usize, f64)> = (0..FLIPS)
        .map(|n| {
            let bit = random.random_range(0..bytes as usize * 8);
            (n % instants.len(), bit, random.random_range(0.0..0.002))
        })
        .collect();
    let outcomes: Vec<Outcome> = flips
        .par_iter()
        .map(|(instant, bit, wait_s)| flip(&instants[*instant], (owned - RAM) as usize * 8 + bit, *wait_s))
        .collect();
    let mut table = String::from("| what became of the run | runs | per 1,000 |\n| --- | ---: | ---: |\n");
    let count = |outcome| outcomes.iter().filter(|found| **found == outcome).count();
    for (outcome, words) in Outcome::ALL {
        let runs = count(outcome);
        let _ = writeln!(table, "| {words} | {runs} | {:.1} |", 1000.0 * runs as f64 / FLIPS as f64);
    }
    println!("{bytes} bytes\n{table}");
    for (outcome, (_, bit, wait_s)) in outcomes.iter().zip(&flips) {
        if *outcome >= Outcome::WrongForShort {
            println!("{outcome:?}: byte {:#x}, bit {}, after {wait_s:.6} s", bit / 8, bit % 8);
        }
    }
    let above = format!("{FLIPS} flips in {bytes} bytes, each watched for {WATCHED_S} s:");
    write_between("flips", &format!("{above}\n\n{table}"));
    assert_eq!(count(Outcome::FullScale), 0);
    let long = count(Outcome::WrongForLong);
    assert!(1000 * long <= 2 * FLIPS, "{long} of {FLIPS} runs went on with wrong codes");
}

/// Where UPDATE_DOCS is set: a table into `docs/fault-campaign.md`, between its two marks.
pub(super) fn write_between(mark: &str, table: &str) {
    // The tests of this file run side by side.
    static PAGE: std::sync::Mutex<()> = std::sync::Mutex::new(());
    if std::env::var_os("UPDATE_DOCS").is_none() {
        return;
    }
    let _alone = PAGE.lock();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/fault-campaign.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let (begin, end) = (format!("<!-- Measured: {mark} -->\n"), format!("<!-- End of {mark}. -->"));
    let (head, rest) = page.split_once(&begin).expect("where the table begins");
    let (_, tail) = rest.split_once(&end).expect("where the table ends");
    std::fs::write(&path, format!("{head}{begin}{table}\n{end}{tail}")).expect("the page can be written");
}
