//! Random states before and after each instruction of a firmware file, for `compare/with_unicorn.py`, which lets another
//! implementation of the core execute the same and counts differences.
//!
//! `cargo run --release -p stm32-emulator --example semantics -- ELF STATES > out/states.bin`
//!
//! Every distinct instruction of the file's code is taken, each with so many random states, and as often with one bit of the
//! instruction flipped. An If-Then instruction brings the instructions of its block along. Left out is what has no meaning
//! outside the chip: exceptions, sleep, masks and special registers.

use std::collections::BTreeSet;
use std::io::Write;

use object::{Object, ObjectSection, ObjectSymbol};
use stm32_emulator::core::system::System;
use stm32_emulator::core::{Bus, Core, Trap};

/// Where the instruction stands, in the middle of rubbish that loads relative to it may read.
const CODE: u32 = 0x0800_0000;
const CODE_BYTES: usize = 0x6000;
const AT: u32 = CODE + 0x3000;
/// Memory that registers point to.
const DATA: u32 = 0x2000_0000;
const DATA_BYTES: usize = 0x1000;

struct Memory {
    code: Vec<u8>,
    data: Vec<u8>,
    system: System,
}

fn slice(memory: &[u8], at: u32, base: u32, bytes: u32) -> Option<&[u8]> {
    let at = at.wrapping_sub(base) as usize;
    memory.get(at..at.wrapping_add(bytes as usize))
}

impl Bus for Memory {
    fn fetch(&mut self, address: u32) -> Result<u16, Trap> {
        Ok(self.read(address, 2)? as u16)
    }
    fn read(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        let found = slice(&self.code, address, CODE, bytes).or_else(|| slice(&self.data, address, DATA, bytes));
        let found = found.ok_or(Trap::Bus(address))?;
        Ok(found.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }
    fn write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        let at = address.wrapping_sub(DATA) as usize;
        let place = self.data.get_mut(at..at.wrapping_add(bytes as usize)).ok_or(Trap::Bus(address))?;
        place.copy_from_slice(&value.to_le_bytes()[..bytes as usize]);
        Ok(())
    }
    fn system(&mut self) -> &mut System {
        &mut self.system
    }
}

/// SplitMix64: any generator does that mixes its bits.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 32) as u32
    }

    fn below(&mut self, limit: u32) -> u32 {
        self.next() % limit
    }

    /// Pointers, corners, small numbers and anything.
    fn word(&mut self) -> u32 {
        const CORNERS: [u32; 8] = [0, 1, 2, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x8000, 0x7FFF];
        match self.below(8) {
            0..3 => DATA + 0x400 + 4 * self.below(0x200),
            3 => DATA + 0x400 + self.below(0x800),
            4 => CORNERS[self.below(8) as usize],
            5 => self.below(40),
            _ => self.next(),
        }
    }

    /// Floats of all kinds, so near to each other that rounding matters.
    fn float(&mut self) -> u32 {
        const CORNERS: [u32; 12] = [
            0,
            0x8000_0000,
            0x3F80_0000,
            0x7F80_0000,
            0xFF80_0000,
            0x7FC0_0000,
            0x7FA0_0001,
            1,
            0x007F_FFFF,
            0x7F7F_FFFF,
            0x4F00_0000,
            0xCF00_0000,
        ];
        match self.below(6) {
            0 => CORNERS[self.below(12) as usize],
            1 => self.next(),
            2 => (self.next() as i32 as f32).to_bits(),
            _ => self.next() & 0x80FF_FFFF | (110 + self.below(40)) << 23,
        }
    }
}

/// An instruction, or an If-Then block with its first one.
type Piece = Vec<u16>;

fn is_it(first: u16) -> bool {
    first & 0xFF00 == 0xBF00 && first & 15 != 0
}

fn pieces(elf: &[u8]) -> BTreeSet<Piece> {
    let file = object::File::parse(elf).expect("an ELF file");
    let text = file.section_by_name(".text").expect("code");
    let (base, bytes) = (text.address() as u32, text.data().expect("code"));
    // Marks of the compiler: from here on instructions ($t), from here on data ($d).
    let mut marks: Vec<(u32, bool)> = file
        .symbols()
        .filter_map(|symbol| {
            let name = symbol.name().ok()?;
            let code = name.starts_with("$t");
            (code || name.starts_with("$d")).then_some((symbol.address() as u32, code))
        })
        .collect();
    marks.sort_unstable();
    let half = |at: u32| {
        let at = (at - base) as usize;
        bytes.get(at..at + 2).map(|two| u16::from_le_bytes([two[0], two[1]]))
    };
    let mut found = BTreeSet::new();
    let ends = marks.iter().skip(1).map(|(at, _)| *at).chain([base + bytes.len() as u32]);
    for ((begin, code), end) in marks.iter().zip(ends) {
        let mut at = *begin;
        if !code || at < base {
            continue;
        }
        while at < end {
            let mut piece = Vec::new();
            let mut left = 1;
            while left > 0
                && at < end
                && let Some(first) = half(at)
            {
                piece.push(first);
                at += 2;
                if first >= 0xE800 {
                    piece.extend(half(at));
                    at += 2;
                }
                left -= 1;
                if is_it(first) {
                    left = 4 - (first & 15).trailing_zeros();
                }
            }
            if !piece.is_empty() {
                found.insert(piece);
            }
        }
    }
    found
}

/// Exceptions, sleep, masks, special registers, barriers, coprocessors: not of the core's arithmetic.
fn left_out(piece: &[u16]) -> bool {
    let mut rest = piece;
    while let [first, tail @ ..] = rest {
        let narrow =
            matches!(first, 0xBE00..=0xBEFF | 0xDE00..=0xDFFF | 0xB660..=0xB67F | 0xBF10..=0xBFF0) && !is_it(*first);
        let wide = *first >= 0xE800
            && tail.first().is_some_and(|second| first & 0xFF00 == 0xF300 && second & 0x8000 != 0 && first & 0x80 != 0);
        if narrow || wide {
            return true;
        }
        rest = if *first >= 0xE800 { tail.get(1..).unwrap_or(&[]) } else { tail };
    }
    false
}

fn instructions_of(piece: &[u16]) -> u32 {
    let (mut at, mut count) = (0, 0);
    while at < piece.len() {
        at += if piece[at] >= 0xE800 { 2 } else { 1 };
        count += 1;
    }
    count
}

fn put(out: &mut Vec<u8>, words: impl IntoIterator<Item = u32>) {
    out.extend(words.into_iter().flat_map(u32::to_le_bytes));
}

fn state(core: &Core) -> Vec<u32> {
    let flags = core.xpsr(0) & 0xFE0F_FC00;
    core.r[..15].iter().copied().chain([core.pc, flags]).chain(core.s).chain([core.fpscr & 0xF000_0000]).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, path, states] = &arguments[..] else {
        eprintln!("usage: semantics ELF STATES");
        std::process::exit(2);
    };
    let elf = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let states: u32 = states.parse().expect("a number of states");
    let mut random = Random(1);
    let code: Vec<u8> = (0..CODE_BYTES).map(|_| random.next() as u8).collect();
    let data: Vec<u8> = (0..DATA_BYTES).map(|_| random.next() as u8).collect();
    let mut out = Vec::new();
    put(&mut out, [AT, CODE, CODE_BYTES as u32, DATA, DATA_BYTES as u32]);
    out.extend(&code);
    out.extend(&data);
    let (mut written, mut faults, mut unknown, mut skipped) = (0_u32, 0_u32, 0_u32, 0_u32);
    let pieces = pieces(&elf);
    for original in &pieces {
        if left_out(original) {
            skipped += 1;
            continue;
        }
        for n in 0..2 * states {
            let mut piece = original.clone();
            let flipped = n >= states;
            if flipped {
                // Of an If-Then block only what follows changes.
                let from = u32::from(is_it(piece[0]));
                let at = from + random.below(piece.len() as u32 - from);
                piece[at as usize] ^= 1 << random.below(16);
                let new_block = is_it(piece[0]) && !is_it(original[0]);
                if new_block || left_out(&piece) || instructions_of(&piece) != instructions_of(original) {
                    continue;
                }
            }
            let mut memory = Memory { code: code.clone(), data: data.clone(), system: System::default() };
            for (n, half) in piece.iter().enumerate() {
                let at = (AT - CODE) as usize + 2 * n;
                memory.code[at..at + 2].copy_from_slice(&half.to_le_bytes());
            }
            memory.system.cpacr = 0x00F0_0000;
            // Where a fault goes does not matter; that it is one does.
            memory.system.vectors = CODE;
            let mut core = Core::reset(&mut memory, CODE).expect("there is a word");
            core.pc = AT;
            for register in 0..15 {
                core.r[register] = random.word();
            }
            core.r[13] = DATA + 0x400 + 4 * random.below(0x200);
            for register in &mut core.s {
                *register = random.float();
            }
            let flags = random.next();
            (core.n, core.z, core.c, core.v) = (flags & 1 != 0, flags & 2 != 0, flags & 4 != 0, flags & 8 != 0);
            core.q = flags & 16 != 0;
            core.ge = flags >> 8 & 15;
            core.fpscr = flags & 0xF000_0000;
            let before = state(&core);
            let mut ended = true;
            for _ in 0..instructions_of(&piece) {
                if core.step(&mut memory).is_err() {
                    unknown += 1;
                    ended = false;
                    break;
                }
                if memory.system.handling() || memory.system.cfsr != 0 {
                    faults += 1;
                    ended = false;
                    break;
                }
            }
            // A jump to where a return from an exception is asked for: there is none to return from.
            if ended && core.pc >> 28 == 0xF {
                faults += 1;
                ended = false;
            }
            if !ended {
                continue;
            }
            written += 1;
            put(&mut out, [u32::from(flipped), instructions_of(&piece), piece.len() as u32]);
            out.extend(piece.iter().flat_map(|half| half.to_le_bytes()));
            put(&mut out, before);
            put(&mut out, state(&core));
            let changed: Vec<usize> = (0..DATA_BYTES).filter(|at| memory.data[*at] != data[*at]).collect();
            put(&mut out, [changed.len() as u32]);
            put(&mut out, changed.into_iter().map(|at| (at as u32) << 8 | u32::from(memory.data[at])));
        }
    }
    std::io::stdout().write_all(&out).expect("the states can be written");
    eprintln!(
        "{} distinct instructions, {skipped} left out; {written} states; {faults} ended in a fault, {unknown} are not modelled",
        pieces.len()
    );
}
