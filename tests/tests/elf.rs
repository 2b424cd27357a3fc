//! What the linked firmware must not contain, and how much room it takes: read from the ELF file itself.
//!
//! The call graph is built from the branch instructions of the machine code (Thumb-2), function by function. Skipped with a
//! message where the target is not installed, and without POSITIONER_TESTS=all.

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// Three quarters of bank 1. Bank 2 holds the parameters.
const FLASH_LIMIT: u64 = 192 * 1024;
const RAM_LIMIT: u64 = 64 * 1024;
/// Stack that stays unused at the deepest call: room for what a change adds unseen.
const FREE_STACK: u64 = 4 * 1024;
/// Words pushed by the core when an interrupt is taken with floating-point context, and alignment.
const EXCEPTION_FRAME: u32 = 26 * 4 + 4;
/// The two places where the control interrupt may use floating point.
const FLOAT_IS_STATED: [&str; 2] = ["ControlLoop::watch", "BenchPlant::advance"];

#[derive(Default)]
struct Function {
    name: String,
    calls: BTreeSet<u32>,
    indirect: bool,
    float: bool,
    frame: u32,
}

struct Program {
    functions: BTreeMap<u32, Function>,
}

fn halfword(code: &[u8], at: usize) -> u32 {
    code.get(at..at + 2).map_or(0, |pair| u32::from(u16::from_le_bytes([pair[0], pair[1]])))
}

fn sign_extend(value: u32, bits: u32) -> i32 {
    ((value << (32 - bits)) as i32) >> (32 - bits)
}

/// ThumbExpandImm without rotation is enough for stack frames; rotations are decoded, too.
fn expand_immediate(imm12: u32) -> u32 {
    let byte = imm12 & 0xFF;
    match imm12 >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => ((byte & 0x7F) | 0x80).rotate_right(imm12 >> 7),
    }
}

/// Takes one instruction at `pc` into account; returns its length.
fn decode(function: &mut Function, own: std::ops::Range<u32>, pc: u32, first: u32, second: u32) -> u32 {
    let mut jump = |offset: i32, call: bool| {
        let target = pc.wrapping_add(4).wrapping_add(offset as u32);
        if call || !own.contains(&target) {
            function.calls.insert(target);
        }
    };
    if first >> 11 < 0b11101 {
        match first {
            h if h & 0xF800 == 0xE000 => jump(sign_extend((h & 0x7FF) << 1, 12), false),
            h if h & 0xFF87 == 0x4780 => function.indirect = true,
            h if h & 0xFF87 == 0x4700 && h >> 3 & 15 != 14 => function.indirect = true,
            h if h & 0xFE00 == 0xB400 => function.frame += 4 * (h & 0x1FF).count_ones(),
            h if h & 0xFF80 == 0xB080 => function.frame += 4 * (h & 0x7F),
            _ => {}
        }
        return 2;
    }
    if first & 0xF800 == 0xF000 && second & 0x8000 != 0 {
        let (s, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
        let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
        let far = sign_extend(s << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1, 25);
        match second & 0x5000 {
            0x5000 => jump(far, true),
            0x1000 => jump(far, false),
            0x0000 if first >> 6 & 0xE != 0xE => {
                let near = s << 20 | j2 << 19 | j1 << 18 | (first & 0x3F) << 12 | (second & 0x7FF) << 1;
                jump(sign_extend(near, 21), false);
            }
            _ => {}
        }
    } else if first == 0xE92D {
        function.frame += 4 * second.count_ones();
    } else if first == 0xF84D && second & 0xFFF == 0xD04 {
        function.frame += 4;
    } else if first & 0xFBEF == 0xF1AD && second & 0x8F00 == second & 0x0F00 && second >> 8 & 15 == 13 {
        function.frame += expand_immediate((first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF);
    } else if first & 0xFBFF == 0xF2AD && second >> 8 & 15 == 13 {
        function.frame += (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF;
    } else if first & 0xFFBF == 0xED2D {
        function.frame += 4 * (second & 0xFF);
    } else if first & 0xEF00 == 0xEE00 && second & 0x0E10 == 0x0A00 {
        function.float = true;
    }
    4
}

impl Program {
    fn read(elf: &[u8]) -> Self {
        let file = object::File::parse(elf).expect("an ELF file");
        let text = file.section_by_name(".text").expect("code");
        let (base, code) = (text.address() as u32, text.data().expect("code"));
        // Mapping symbols tell code from literal pools.
        let mut marks: BTreeMap<u32, bool> = BTreeMap::new();
        let mut sizes: BTreeMap<u32, (u32, String)> = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            if name.starts_with("$t") || name.starts_with("$d") {
                marks.insert(symbol.address() as u32, name.starts_with("$t"));
            } else if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                let name = format!("{:#}", rustc_demangle::demangle(name));
                sizes.insert(symbol.address() as u32 & !1, (symbol.size() as u32, name));
            }
        }
        let mut functions = BTreeMap::new();
        for (start, (size, name)) in sizes {
            let mut function = Function { name, ..Function::default() };
            let mut pc = start;
            while pc < start + size {
                if marks.range(..=pc).next_back().is_some_and(|(_, is_code)| !is_code) {
                    pc += 2;
                    continue;
                }
                let at = pc.wrapping_sub(base) as usize;
                pc += decode(&mut function, start..start + size, pc, halfword(code, at), halfword(code, at + 2));
            }
            functions.insert(start, function);
        }
        Self { functions }
    }

    fn find(&self, name: &str) -> u32 {
        let found = self.functions.iter().find(|(_, function)| function.name == name);
        *found.unwrap_or_else(|| panic!("no function {name} in the firmware")).0
    }

    /// Everything reachable, not looking into functions whose name contains one of `closed`.
    fn reachable(&self, root: u32, closed: &[&str]) -> BTreeSet<u32> {
        let (mut seen, mut open) = (BTreeSet::new(), vec![root]);
        while let Some(at) = open.pop() {
            if let Some(function) = self.functions.get(&at)
                && seen.insert(at)
                && !closed.iter().any(|part| function.name.contains(part))
            {
                open.extend(&function.calls);
            }
        }
        seen
    }

    /// Deepest stack below and including a function, in bytes; calls through pointers are not followed.
    fn depth(&self, at: u32, path: &mut Vec<u32>) -> u32 {
        let Some(function) = self.functions.get(&at) else { return 0 };
        if path.contains(&at) {
            return 0;
        }
        path.push(at);
        let below = function.calls.iter().map(|call| self.depth(*call, path)).max().unwrap_or(0);
        path.pop();
        function.frame + below
    }
}

#[test]
fn the_control_interrupt_cannot_panic_divide_64_bits_or_call_the_unknown_and_the_firmware_fits() {
    let elf = match test_stages::firmware::build_for_target("firmware") {
        Ok(path) => path,
        Err(why) => {
            return test_stages::skipped("what the linked firmware contains", &why);
        }
    };
    let bytes = std::fs::read(&elf).expect("firmware");
    let program = Program::read(&bytes);
    let interrupt = program.find("ADC1_2");
    let reachable = program.reachable(interrupt, &[]);
    println!("reachable from the control interrupt: {} functions", reachable.len());
    for at in &reachable {
        let function = &program.functions[at];
        println!("  {:5} B frame {} {}", function.frame, if function.float { "float" } else { "     " }, function.name);
    }
    for at in &reachable {
        let function = &program.functions[at];
        for forbidden in ["panic", "unwrap_failed", "expect_failed", "u64_div_rem", "ldivmod", "defmt"] {
            assert!(!function.name.contains(forbidden), "{} is reachable from the control interrupt", function.name);
        }
        assert!(!function.indirect, "{} calls through a pointer", function.name);
    }
    // Floating point only where it is stated: the model monitor behind the valve write, and bench mode.
    for at in program.reachable(interrupt, &FLOAT_IS_STATED) {
        let function = &program.functions[&at];
        let stated = FLOAT_IS_STATED.iter().any(|part| function.name.contains(part));
        let float = function.float || function.name.starts_with("__aeabi_d") || function.name.starts_with("__aeabi_f");
        assert!(stated || !float, "{} uses floating point in the control interrupt", function.name);
    }

    let of = |root: u32| program.depth(root, &mut Vec::new());
    let roots = |part: &str| {
        program.functions.iter().filter(|(_, function)| function.name.contains(part)).map(|(at, _)| of(*at)).max()
    };
    // The way from `main` to the tasks, which the executor calls through pointers.
    let way: u32 = program
        .functions
        .values()
        .filter(|f| {
            f.name == "main" || f.name.contains("__cortex_m_rt_main") || f.name.contains("thread::Executor::run")
        })
        .map(|f| f.frame)
        .sum();
    let thread = way + roots("::poll").unwrap_or(0);
    let background = ["TIM2", "LPUART1", "FLASH"].map(|name| of(program.find(name))).into_iter().max().unwrap_or(0);
    let control = of(interrupt);
    let stack = thread + background + control + 2 * EXCEPTION_FRAME;
    println!(
        "stack: thread {thread} + background interrupt {background} + control interrupt {control} + frames = {stack} B"
    );

    let file = object::File::parse(&*bytes).expect("an ELF file");
    let size = |name: &str| file.section_by_name(name).map_or(0, |section| section.size());
    let flash = size(".vector_table") + size(".text") + size(".rodata") + size(".data");
    let symbol = |name: &str| file.symbols().find(|s| s.name() == Ok(name)).map_or(0, |s| s.address());
    let region = symbol("_stack_start") - symbol("_stack_end");
    let ram = size(".data") + size(".bss") + size(".uninit") + region;
    println!("flash {flash} B of {FLASH_LIMIT}; RAM {ram} B of {RAM_LIMIT}, of which stack {region}");
    assert!(flash <= FLASH_LIMIT);
    assert!(ram <= RAM_LIMIT);
    assert!(
        u64::from(stack) + FREE_STACK <= region,
        "the stack may need {stack} B of {region}, {FREE_STACK} must stay free"
    );
    // Below RAM there is nothing: an overflow is a fault at its first access.
    assert_eq!(symbol("_stack_end"), 0x2000_0000);
}
