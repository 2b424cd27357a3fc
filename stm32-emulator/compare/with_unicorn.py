"""Lets Unicorn (QEMU's core, GPL: a tool beside this project, never linked) execute what the emulator has executed.

    python3 -m venv venv && venv/bin/pip install unicorn
    cargo run --release -p stm32-emulator --example semantics -- ELF 20 > states.bin
    venv/bin/python stm32-emulator/compare/with_unicorn.py states.bin

Compared are all registers, flags, saturation and greater-or-equal bits, the If-Then state, floats with their rounding and
not-a-numbers, and all of the memory. Exit status 1 if an unaltered instruction of the firmware differs.
"""

import collections
import struct
import sys

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError, arm_const as arm
from unicorn import unicorn_const as uc

R = [getattr(arm, f"UC_ARM_REG_R{n}") for n in range(13)] + [arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR]
S = [getattr(arm, f"UC_ARM_REG_S{n}") for n in range(32)]
NAMES = [f"r{n}" for n in range(13)] + ["sp", "lr", "pc", "xpsr"] + [f"s{n}" for n in range(32)] + ["fpscr"]
STATE = struct.Struct("<50I")
# msr apsr_nzcvqg, r0; mrs r0, apsr
HELPERS = bytes.fromhex("80f3008c eff30080")
NOT_EXECUTABLE = (uc.UC_ERR_FETCH_UNMAPPED, uc.UC_ERR_FETCH_PROT, uc.UC_ERR_EXCEPTION)


def main(path):
    data = open(path, "rb").read()
    at, code, code_bytes, ram, ram_bytes = struct.unpack_from("<5I", data)
    place = 20
    code_image = data[place:place + code_bytes]
    place += code_bytes
    ram_image = data[place:place + ram_bytes]
    place += ram_bytes

    machine = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
    machine.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
    machine.mem_map(code, code_bytes)
    machine.mem_map(ram, ram_bytes)
    machine.mem_write(code, code_image)
    helpers = at - 0x1800
    machine.mem_write(helpers, HELPERS)
    enable_floats(machine)

    count = collections.Counter()
    differing = collections.defaultdict(list)
    while place < len(data):
        flipped, instructions, halves = struct.unpack_from("<3I", data, place)
        place += 12
        piece = data[place:place + 2 * halves]
        place += 2 * halves
        before = STATE.unpack_from(data, place)
        after = STATE.unpack_from(data, place + STATE.size)
        place += 2 * STATE.size
        (changes,) = struct.unpack_from("<I", data, place)
        memory = bytearray(ram_image)
        for n in range(changes):
            (change,) = struct.unpack_from("<I", data, place + 4 + 4 * n)
            memory[change >> 8] = change & 0xFF
        place += 4 + 4 * changes

        kind = "flipped" if flipped else "firmware"
        try:
            got, got_memory = execute(machine, helpers, at, piece, instructions, before, ram, ram_image)
        except UcError as error:
            count[kind, "refused"] += 1
            differing[kind, "refused"].append((piece, str(error)))
            continue
        wrong = [
            f"{name}: {here:#x}, there {there:#x}"
            for name, here, there in zip(NAMES, after, got)
            if here != there
        ]
        if got_memory != memory:
            wrong.append("memory")
        count[kind, "differs" if wrong else "equal"] += 1
        if wrong:
            differing[kind, "differs"].append((piece, "; ".join(wrong)))
        machine.mem_write(at, code_image[at - code:at - code + len(piece)])

    for kind, title in (("firmware", "instructions of the firmware"), ("flipped", "the same with one bit flipped")):
        equal, differ, refused = (count[kind, word] for word in ("equal", "differs", "refused"))
        print(f"{title}: {equal + differ} comparisons, {differ} differences, {refused} that Unicorn refuses")
        for word in ("differs", "refused"):
            seen = set()
            for piece, text in differing[kind, word]:
                shown = piece.hex(" ", 2)
                if shown not in seen and len(seen) < 40:
                    seen.add(shown)
                    words = " ".join(f"{half:04x}" for (half,) in struct.iter_unpack("<H", piece))
                    print(f"  {word} {words}: {text}")
    return 1 if count["firmware", "differs"] + count["firmware", "refused"] else 0


def enable_floats(machine):
    # The coprocessor register of the chip's system space is not mapped here; Unicorn offers it as a register.
    machine.reg_write(arm.UC_ARM_REG_FPEXC, 0x40000000)


def execute(machine, helpers, at, piece, instructions, before, ram, ram_image):
    machine.mem_write(at, piece)
    machine.ctl_remove_cache(at, at + 64)
    machine.mem_write(ram, ram_image)
    # Unicorn does not let XPSR's greater-or-equal bits through: the instructions made for that do.
    machine.reg_write(R[0], before[16])
    machine.emu_start(helpers | 1, 0xFFFFFFFE, count=1)
    for register, value in zip(R, before):
        machine.reg_write(register, value)
    for register, value in zip(S, before[17:49]):
        machine.reg_write(register, value)
    machine.reg_write(arm.UC_ARM_REG_FPSCR, before[49])
    end = at + len(piece)
    try:
        if instructions == 1:
            machine.emu_start(at | 1, 0xFFFFFFFE, count=1)
        else:
            # Unicorn does not count what a condition leaves out: a block ends where it is left.
            leave = machine.hook_add(uc.UC_HOOK_CODE, lambda m, pc, *_: at <= pc < end or m.emu_stop())
            try:
                machine.emu_start(at | 1, 0xFFFFFFFE)
            finally:
                machine.hook_del(leave)
    except UcError as error:
        # The instruction has jumped to where nothing is; that it did is compared.
        pc = machine.reg_read(arm.UC_ARM_REG_PC)
        if error.errno not in NOT_EXECUTABLE or at <= pc < end:
            raise
    got = [machine.reg_read(register) for register in R]
    got.append(machine.reg_read(arm.UC_ARM_REG_PC) & ~1)
    it = machine.reg_read(arm.UC_ARM_REG_XPSR) & 0x0600FC00
    floats = [machine.reg_read(register) for register in S]
    floats.append(machine.reg_read(arm.UC_ARM_REG_FPSCR) & 0xF0000000)
    machine.emu_start(helpers + 4 | 1, 0xFFFFFFFE, count=1)
    got.append(machine.reg_read(R[0]) & 0xF80F0000 | it)
    got.extend(floats)
    return got, machine.mem_read(ram, len(ram_image))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
