//! New firmware through the bootloader in ROM, which is a model here (AN3155); the firmware that leaves for it and comes back is the
//! real one, on the emulated chip. Parts of it are skipped with a message without POSITIONER_TESTS=all.

use board_link::{Command, Parameter, Version};
use board_tests::emulated::Emulated;
use board_tests::rom_model::RomModel;
use board_tests::{Bench as _, Session};
use plant_sim::update::image::{FLASH, Image};
use plant_sim::update::rom::{CHIP, RomError};
use plant_sim::update::{PAGE_BYTES, write};
use std::sync::OnceLock;
use test_stages::firmware::build_for_target;
use test_stages::skipped;

fn elf() -> Option<&'static [u8]> {
    static ELF: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    let built = ELF.get_or_init(|| {
        let path = build_for_target("firmware")?;
        Ok(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    });
    built.as_deref().map_err(|why| skipped("update of the emulated board", why)).ok()
}

/// Something to write: the bytes of an image do not matter to the bootloader.
fn some_image() -> Image {
    let bytes = (0..40_000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    Image { bytes, board: "a-board".into(), firmware: "1.2.3".into(), parameters: 1, restart: FLASH + 0x400 }
}

/// Flash with an old program, and parameters at its end.
fn old_flash() -> Vec<u8> {
    let mut flash = vec![0x11; 512 << 10];
    flash[500 << 10..].fill(0x77);
    flash
}

#[test]
fn an_image_is_written_started_and_the_parameters_are_not_touched() {
    let (image, mut flash) = (some_image(), old_flash());
    let mut rom = RomModel::new(&mut flash, CHIP);
    write(&mut rom, &image, &mut |_| ()).expect("written");
    assert_eq!(rom.gone(), Some(image.restart));
    assert_eq!(flash[..image.bytes.len()], image.bytes);
    assert!(flash[image.bytes.len().next_multiple_of(PAGE_BYTES)..500 << 10].iter().all(|byte| *byte == 0x11));
    assert!(flash[500 << 10..].iter().all(|byte| *byte == 0x77));
    // Once more: the bootloader has been woken before.
    let mut rom = RomModel::new(&mut flash, CHIP);
    write(&mut rom, &image, &mut |_| ()).expect("written again");
}

#[test]
fn a_cut_anywhere_leaves_an_image_that_never_starts_or_the_whole_one_and_can_be_repeated() {
    let (image, mut seen) = (some_image(), [0, 0, 0]);
    // The whole update takes some 81,000 bytes of the host.
    for power in (0..90_000).step_by(1_499) {
        let mut flash = old_flash();
        let cut = write(RomModel::new(&mut flash, CHIP).with_power_for(power), &image, &mut |_| ());
        let old = flash[..8] == [0x11; 8] && flash.iter().take(image.bytes.len()).all(|byte| *byte == 0x11);
        let blank = flash[..8] == [0xFF; 8];
        let new = flash[..image.bytes.len()] == image.bytes;
        assert!(old || blank || new, "power for {power} bytes: {cut:?}");
        assert!(flash[500 << 10..].iter().all(|byte| *byte == 0x77));
        for (count, is) in seen.iter_mut().zip([old, blank, new]) {
            *count += u32::from(is);
        }
        write(RomModel::new(&mut flash, CHIP), &image, &mut |_| ()).expect("repeated");
        assert_eq!(flash[..image.bytes.len()], image.bytes);
    }
    println!("old, blank, new: {seen:?}");
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
}

#[test]
fn another_chip_and_flash_that_does_not_hold_are_told() {
    let image = some_image();
    let mut flash = old_flash();
    let before = flash.clone();
    let other = write(RomModel::new(&mut flash, 0x468), &image, &mut |_| ());
    assert_eq!(other, Err(RomError::Chip(0x468)));
    assert_eq!(flash, before, "nothing was written");
    let stuck = write(RomModel::new(&mut flash, CHIP).with_stuck_bits(0x10), &image, &mut |_| ());
    assert!(matches!(stuck, Err(RomError::Differs(_))), "{stuck:?}");
    assert_eq!(flash[..8], [0xFF; 8], "what does not hold is not started");
}

#[test]
fn what_is_no_firmware_for_this_chip_is_refused() {
    for (bytes, word) in [(&b"no firmware"[..], "no firmware for this chip"), (&[][..], "no firmware for this chip")] {
        let error = Image::of_elf(bytes, "f.elf").expect_err("refused").to_string();
        assert!(error.contains(word) && error.contains("cargo fw"), "{error}");
    }
    // This very program is an ELF file for another processor.
    let this = std::fs::read(std::env::current_exe().expect("a path")).expect("readable");
    assert!(Image::of_elf(&this, "f.elf").is_err());
}

#[test]
fn firmware_for_another_board_or_with_other_parameters_is_refused() {
    let image = some_image();
    let version = |board: &str, parameters| Version {
        firmware: "1.0.0".try_into().expect("short"),
        board: board.try_into().expect("short"),
        tick_hz: 1000,
        parameters,
    };
    assert_eq!(image.suits(&version("a-board", 1), false), Ok(()));
    let other = image.suits(&version("another-board", 1), true).expect_err("another board");
    assert!(other.contains("a-board") && other.contains("another-board"), "{other}");
    let lost = image.suits(&version("a-board", 2), false).expect_err("other parameters");
    assert!(lost.contains("--new-parameters"), "{lost}");
    assert_eq!(image.suits(&version("a-board", 2), true), Ok(()));
}

#[test]
fn the_emulated_board_leaves_for_the_bootloader_and_comes_back_with_its_parameters() {
    let Some(elf) = elf() else { return };
    let image = Image::of_elf(elf, "firmware").expect("a firmware");
    let mut bench = Emulated::power_up(elf).unwrap_or_else(|error| panic!("{error}"));
    let mut session = Session::<Emulated>::open(&mut bench).expect("answers");
    let version = plant_sim::commission::observe::version(session.client()).expect("answers");
    assert_eq!(image.suits(&version, false), Ok(()));
    session.change(&[(Parameter::Gain, 7.25), (Parameter::TelemetryEvery, 3.0)]).expect("accepted");
    session.done(Command::Save).expect("saved");
    session.done(Command::Bootloader).expect("granted");
    // The chip is reset, and the first thing it does is to read the ROM's vector table, which the emulator does not have.
    let stopped = bench.board().run(0.2).expect_err("the ROM is not modelled").to_string();
    assert!(stopped.contains("bootloader in ROM") && stopped.contains("0x1fff0000"), "{stopped}");
    let machine = bench.board().machine();
    assert_eq!(machine.resets.len(), 1, "one reset, and no watchdog: {:?}", machine.resets);

    let flash = &mut machine.chip.flash.bytes;
    let mut rom = RomModel::new(flash, CHIP);
    write(&mut rom, &image, &mut |_| ()).expect("written");
    assert_eq!(rom.gone(), Some(image.restart));
    // What the ROM jumps to: a stack, and code of the image.
    let vector = |at: usize| u32::from_le_bytes(flash[at..at + 4].try_into().expect("four bytes"));
    let at = (image.restart - FLASH) as usize;
    assert!((0x2000_0000..=0x2002_0000).contains(&vector(at)), "{:#x}", vector(at));
    assert!((FLASH..FLASH + image.bytes.len() as u32).contains(&vector(at + 4)), "{:#x}", vector(at + 4));
    bench.board().power_cycle().expect("starts");
    bench.pause(0.3);
    let settings = Session::<Emulated>::open(&mut bench).expect("answers").settings().expect("answers");
    assert_eq!((settings.get(Parameter::Gain), settings.get(Parameter::TelemetryEvery)), (7.25, 3.0));
}
