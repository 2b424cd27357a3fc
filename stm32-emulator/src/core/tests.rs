//! Instructions by class, as tables: what stands in the registers before, what after.

use super::system::System;
use super::{Bus, Core, Trap};

/// Code at 0, data from [`DATA`], nothing elsewhere.
struct Memory {
    code: Vec<u16>,
    data: Vec<u8>,
    system: System,
}

const DATA: u32 = 0x2000_0000;
/// Where the stack begins.
const STACK: u32 = DATA + 0x200;

impl Bus for Memory {
    fn fetch(&mut self, address: u32) -> Result<u16, Trap> {
        self.code.get(address as usize / 2).copied().ok_or(Trap::Bus(address))
    }
    fn read(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        let at = address.wrapping_sub(DATA) as usize;
        if address < 0x1000 {
            // The vector table: every handler is at 0x100.
            return Ok(if address == 0 { STACK } else { 0x101 });
        }
        let slice = self.data.get(at..at.wrapping_add(bytes as usize)).ok_or(Trap::Bus(address))?;
        Ok(slice.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }
    fn write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        let at = address.wrapping_sub(DATA) as usize;
        let slice = self.data.get_mut(at..at.wrapping_add(bytes as usize)).ok_or(Trap::Bus(address))?;
        slice.copy_from_slice(&value.to_le_bytes()[..bytes as usize]);
        Ok(())
    }
    fn system(&mut self) -> &mut System {
        &mut self.system
    }
}

fn machine(code: &[u16]) -> (Core, Memory) {
    let mut memory = Memory { code: code.to_vec(), data: vec![0; 0x400], system: System::default() };
    memory.code.resize(0x200, 0xBF00);
    memory.system.cpacr = 0x00F0_0000;
    let mut core = Core::reset(&mut memory, 0).expect("there is a vector table");
    core.pc = 0;
    (core, memory)
}

/// Runs the code once with r0, r1, r2, r3 set.
fn run(code: &[u16], registers: [u32; 4]) -> (Core, Memory) {
    let (mut core, mut memory) = machine(code);
    core.r[..4].copy_from_slice(&registers);
    while (core.pc as usize) < 2 * code.len() {
        core.step(&mut memory).expect("the instruction is modelled");
    }
    (core, memory)
}

fn wide(instruction: u32) -> [u16; 2] {
    [(instruction >> 16) as u16, instruction as u16]
}

#[test]
fn additions_and_subtractions_set_all_flags() {
    // r0 = r1 op r2, flags N Z C V.
    for (name, code, x, y, value, flags) in [
        ("adds", 0x1888_u16, 1, 2, 3, "----"),
        ("adds", 0x1888, 0xFFFF_FFFF, 1, 0, "-ZC-"),
        ("adds", 0x1888, 0x7FFF_FFFF, 1, 0x8000_0000, "N--V"),
        ("subs", 0x1A88, 3, 5, 0xFFFF_FFFE, "N---"),
        ("subs", 0x1A88, 5, 5, 0, "-ZC-"),
        ("subs", 0x1A88, 0x8000_0000, 1, 0x7FFF_FFFF, "--CV"),
    ] {
        let (core, _) = run(&[code], [0, x, y, 0]);
        let set = |flag: bool, letter: &str| if flag { letter.to_owned() } else { "-".to_owned() };
        let got = set(core.n, "N") + &set(core.z, "Z") + &set(core.c, "C") + &set(core.v, "V");
        assert_eq!((core.r[0], got.as_str()), (value, flags), "{name} {x:#x}, {y:#x}");
    }
}

#[test]
fn products_and_divisions() {
    // Encodings with Rd = r0, Rn = r1, Rm = r2, Ra = r3.
    for (name, code, x, y, addend, value) in [
        ("mul", 0xFB01_F002_u32, 7, 6, 0, 42),
        ("mla", 0xFB01_3002, 7, 6, 8, 50),
        ("mls", 0xFB01_3012, 7, 6, 50, 8),
        ("smulbb", 0xFB11_F002, 0x0001_FFFF, 0x0005_0003, 0, (-3_i32) as u32),
        ("smultt", 0xFB11_F032, 0x0002_FFFF, 0x0005_0003, 0, 10),
        ("smlabb", 0xFB11_3002, 2, 3, 4, 10),
        ("smulwb", 0xFB31_F002, 0x0001_0000, 5, 0, 5),
        ("smmul", 0xFB51_F002, 0x8000_0000, 2, 0, u32::MAX),
        ("smmulr", 0xFB51_F012, 0x4000_0000, 2, 0, 1),
        ("smuad", 0xFB21_F002, 0x0002_0003, 0x0004_0005, 0, 23),
        ("sdiv", 0xFB91_F0F2, (-7_i32) as u32, 2, 0, (-3_i32) as u32),
        ("sdiv by zero", 0xFB91_F0F2, 7, 0, 0, 0),
        ("sdiv overflow", 0xFB91_F0F2, 0x8000_0000, u32::MAX, 0, 0x8000_0000),
        ("udiv", 0xFBB1_F0F2, 0xFFFF_FFFF, 16, 0, 0x0FFF_FFFF),
    ] {
        let (core, _) = run(&wide(code), [0, x, y, addend]);
        assert_eq!(core.r[0], value, "{name}");
    }
    // Rlo = r0, Rhi = r3.
    for (name, code, low, high, x, y, wanted) in [
        ("smull", 0xFB81_0302_u32, 0, 0, u32::MAX, 5, (-5_i64) as u64),
        ("umull", 0xFBA1_0302, 0, 0, u32::MAX, u32::MAX, 0xFFFF_FFFE_0000_0001),
        ("smlal", 0xFBC1_0302, 6, 0, u32::MAX, 5, 1),
        ("umlal", 0xFBE1_0302, u32::MAX, 0, 1, 1, 0x1_0000_0000),
        ("umaal", 0xFBE1_0362, 3, 4, 5, 6, 37),
    ] {
        let (core, _) = run(&wide(code), [low, x, y, high]);
        assert_eq!(u64::from(core.r[3]) << 32 | u64::from(core.r[0]), wanted, "{name}");
    }
}

#[test]
fn saturation_bit_fields_and_extensions() {
    for (name, code, x, before, value, q) in [
        ("ssat #16", 0xF301_000F_u32, 40_000, 0, 32_767, true),
        ("usat #8", 0xF381_0008, (-1_i32) as u32, 0, 0, true),
        ("usat #8 within", 0xF381_0008, 200, 0, 200, false),
        ("ubfx #4, #8", 0xF3C1_1007, 0xABCD, 0, 0xBC, false),
        ("sbfx #4, #8", 0xF341_1007, 0xABCD, 0, 0xFFFF_FFBC, false),
        ("bfi #8, #8", 0xF361_200F, 0x12, 0xFFFF_FFFF, 0xFFFF_12FF, false),
        ("bfc #8, #8", 0xF36F_200F, 0, 0xFFFF_FFFF, 0xFFFF_00FF, false),
        ("clz", 0xFAB1_F081, 0x0001_0000, 0, 15, false),
        ("rbit", 0xFA91_F0A1, 1, 0, 0x8000_0000, false),
        ("rev", 0xFA91_F081, 0x1122_3344, 0, 0x4433_2211, false),
        ("sxth", 0xFA0F_F081, 0x8000, 0, 0xFFFF_8000, false),
        ("uxtb ror 8", 0xFA5F_F091, 0x1234, 0, 0x12, false),
    ] {
        let (core, _) = run(&wide(code), [before, x, 0, 0]);
        assert_eq!((core.r[0], core.q), (value, q), "{name}");
    }
}

#[test]
fn the_parallel_additions_keep_their_lanes_apart() {
    for (name, code, x, y, value, ge) in [
        ("uadd8", 0xFA81_F042_u32, 0xFF01_80FF, 0x0101_8000, 0x0002_00FF, 0b1010),
        ("sadd16", 0xFA91_F002, 0x7FFF_0001, 0x0001_FFFF, 0x8000_0000, 0b1111),
        ("qadd16", 0xFA91_F012, 0x7FFF_8000, 0x0001_FFFF, 0x7FFF_8000, 0),
        ("uqsub8", 0xFAC1_F052, 0x0510_0000, 0x1005_0001, 0x000B_0000, 0),
        ("shadd16", 0xFA91_F022, 0x0004_FFFE, 0x0002_FFFE, 0x0003_FFFE, 0),
    ] {
        let (core, _) = run(&wide(code), [0, x, y, 0]);
        assert_eq!((core.r[0], core.ge), (value, ge), "{name}");
    }
}

#[test]
fn loads_and_stores_of_every_width_find_their_bytes() {
    // str r0, [r1]; ldrb r2, [r1, #1]; ldrsh r3, [r1, r2] with r2 = 2 afterwards.
    let (core, memory) = run(&[0x6008, 0x784A, 0x2202, 0x5E8B], [0x8765_4321, DATA + 8, 0, 0]);
    assert_eq!(memory.data[8..12], [0x21, 0x43, 0x65, 0x87]);
    assert_eq!(core.r[3], 0xFFFF_8765);
    // Two words with write-back: strd r2, r3, [r1], #8.
    let code = wide(0xE8E1_2302);
    let (core, memory) = run(&code, [0, DATA, 0x11, 0x22]);
    assert_eq!((core.r[1], memory.data[0], memory.data[4]), (DATA + 8, 0x11, 0x22));
    // push {r0, r1, lr}; pop {r2, r3}: the lowest register lies lowest.
    let (core, _) = run(&[0xB503, 0xBC0C], [5, 6, 0, 0]);
    assert_eq!((core.r[2], core.r[3], core.r[13]), (5, 6, STACK - 4));
}

#[test]
fn a_store_exclusive_fails_without_its_load() {
    // ldrex r2, [r1]; strex r3, r0, [r1]
    let mut code = wide(0xE851_2F00).to_vec();
    code.extend(wide(0xE841_0300));
    let (core, memory) = run(&code, [7, DATA, 0, 9]);
    assert_eq!((core.r[3], memory.data[0]), (0, 7));
    let (core, memory) = run(&wide(0xE841_0300), [7, DATA, 0, 9]);
    assert_eq!((core.r[3], memory.data[0]), (1, 0));
}

#[test]
fn an_if_then_block_runs_its_half_and_sets_no_flags() {
    // cmp r0, #0; ite eq; moveq r1, #1; movne r1, #2; and a flag that `movs` outside a block would set.
    for (r0, value) in [(0, 1), (5, 2)] {
        let (core, _) = run(&[0x2800, 0xBF0C, 0x2101, 0x2102], [r0, 0, 0, 0]);
        assert_eq!((core.r[1], core.z), (value, r0 == 0), "r0 = {r0}");
    }
}

#[test]
fn floating_point_rounds_once_or_twice_as_the_instruction_says() {
    // s0 = s0 op s1 · s2: VMLA rounds the product, VFMA does not.
    let (a, b) = (1.0_f32 + f32::EPSILON, 1.0_f32 - f32::EPSILON);
    for (name, code, s0, s1, s2, value) in [
        ("vadd", 0xEE30_0A81_u32, 0.0_f32, 1.5_f32, 2.25_f32, 3.75_f32),
        ("vsub", 0xEE30_0AC1, 0.0, 1.5, 2.25, -0.75),
        ("vmul", 0xEE20_0A81, 0.0, 1.5, 2.0, 3.0),
        ("vdiv", 0xEE80_0A81, 0.0, 1.0, 3.0, 1.0 / 3.0),
        ("vmla", 0xEE00_0A81, -1.0, a, b, a * b - 1.0),
        ("vfma", 0xEEA0_0A81, -1.0, a, b, a.mul_add(b, -1.0)),
        ("vmls", 0xEE00_0AC1, 10.0, 2.0, 3.0, 4.0),
        ("vsqrt", 0xEEB1_0AC1, 0.0, 0.0, 2.0, std::f32::consts::SQRT_2),
    ] {
        let (mut core, mut memory) = machine(&wide(code));
        (core.s[0], core.s[1], core.s[2]) = (s0.to_bits(), s1.to_bits(), s2.to_bits());
        core.step(&mut memory).expect("the instruction is modelled");
        assert_eq!(f32::from_bits(core.s[0]), value, "{name}");
    }
}

#[test]
fn conversions_to_integers_truncate_and_saturate() {
    // vcvt.s32.f32 s0, s2 and vcvt.u32.f32 s0, s2.
    for (code, value, wanted) in [
        (0xEEBD_0AC1_u32, -1.75_f32, (-1_i32) as u32),
        (0xEEBD_0AC1, 3e9, i32::MAX as u32),
        (0xEEBD_0AC1, f32::NAN, 0),
        (0xEEBC_0AC1, -1.0, 0),
        (0xEEBC_0AC1, 3e9, 3_000_000_000),
    ] {
        let (mut core, mut memory) = machine(&wide(code));
        core.s[2] = value.to_bits();
        core.step(&mut memory).expect("the instruction is modelled");
        assert_eq!(core.s[0], wanted, "{value}");
    }
}

#[test]
fn an_invalid_operation_gives_the_cores_own_not_a_number() {
    // vdiv s0, s1, s2: 0 / 0.
    let (mut core, mut memory) = machine(&wide(0xEE80_0A81));
    core.step(&mut memory).expect("the instruction is modelled");
    assert_eq!(core.s[0], 0x7FC0_0000);
}

#[test]
fn an_interrupt_saves_what_it_must_and_returns_to_where_it_was() {
    // movs r0, #1; movs r1, #2; handler at 0x100: movs r0, #9; bx lr
    let (mut core, mut memory) = machine(&[0x2001, 0x2102]);
    memory.code[0x80] = 0x2009;
    memory.code[0x81] = 0x4770;
    core.step(&mut memory).expect("modelled");
    memory.system.write(0xE000_E100, 4, 1).expect("modelled");
    memory.system.set_line(0, true);
    let taken = core.interrupts(&mut memory).expect("modelled").expect("it is the only one");
    assert_eq!((taken.number, core.pc, core.r[13]), (16, 0x100, STACK - 32));
    memory.system.set_line(0, false);
    core.step(&mut memory).expect("modelled");
    assert_eq!(core.r[0], 9);
    core.step(&mut memory).expect("modelled");
    assert_eq!((core.r[0], core.pc, core.r[13], memory.system.current()), (1, 2, STACK, 0));
}

#[test]
fn a_handler_that_uses_floats_saves_the_interrupted_ones_first() {
    // vmov.f32 s0, #1.0 in the handler; s0 holds 5 before.
    let (mut core, mut memory) = machine(&[0xBF00]);
    memory.code[0x80..0x82].copy_from_slice(&wide(0xEEB7_0A00));
    memory.code[0x82] = 0x4770;
    core.fp_active = true;
    core.s[0] = 5.0_f32.to_bits();
    memory.system.write(0xE000_E100, 4, 1).expect("modelled");
    memory.system.set_line(0, true);
    core.interrupts(&mut memory).expect("modelled");
    assert_eq!(core.r[13], STACK - 104, "space for the floats is reserved");
    assert_eq!(memory.data[0x200 - 72], 0, "and not yet written");
    memory.system.set_line(0, false);
    core.step(&mut memory).expect("modelled");
    assert_eq!(f32::from_bits(core.s[0]), 1.0);
    core.step(&mut memory).expect("modelled");
    assert_eq!((f32::from_bits(core.s[0]), core.r[13], core.fp_active), (5.0, STACK, true));
}

#[test]
fn priorities_and_masks_decide_who_comes_in() {
    for (basepri, primask, expected) in
        [(0, false, Some(17)), (0x40, false, Some(17)), (0x20, false, None), (0, true, None)]
    {
        let (mut core, mut memory) = machine(&[0xBF00]);
        memory.system.write(0xE000_E100, 4, 3).expect("modelled");
        memory.system.write(0xE000_E400, 1, 0x80).expect("modelled");
        memory.system.write(0xE000_E401, 1, 0x20).expect("modelled");
        memory.system.set_line(0, true);
        memory.system.set_line(1, true);
        (core.basepri, core.primask) = (basepri, primask);
        let taken = core.interrupts(&mut memory).expect("modelled").map(|exception| exception.number);
        assert_eq!(taken, expected, "BASEPRI {basepri:#x} PRIMASK {primask}");
    }
}

#[test]
fn an_access_to_nowhere_is_a_hard_fault_with_its_address() {
    // ldr r0, [r1]
    let (mut core, mut memory) = machine(&[0x6808]);
    core.r[1] = 0x1FFF_FFF0;
    core.step(&mut memory).expect("modelled");
    assert_eq!((memory.system.current(), memory.system.bfar, core.pc), (3, 0x1FFF_FFF0, 0x100));
    assert_eq!(memory.system.cfsr, 1 << 9 | 1 << 15);
}

#[test]
fn what_is_not_modelled_stops_with_address_and_instruction() {
    // bkpt #0
    let (mut core, mut memory) = machine(&[0xBF00, 0xBE00]);
    core.step(&mut memory).expect("a nop");
    let stop = core.step(&mut memory).expect_err("a breakpoint is not modelled");
    assert_eq!((stop.instruction_at, stop.instruction, stop.what.as_str()), (2, 0xBE00, "breakpoint"));
}
