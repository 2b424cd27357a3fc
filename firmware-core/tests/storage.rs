//! Parameters survive power cuts at any byte, and rubbish in flash never reaches the control law.

use board_link::KeptError;
use board_link::Parameter;
use control::{Quantities, Quantity};
use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware_core::{Kept, Loaded, ParameterStore, Settings};

const PAGE: usize = 2048;
const PAGES: usize = 4;
const WORD: usize = 8;
const RANGE: core::ops::Range<u32> = 0..(PAGE * PAGES) as u32;

/// Flash as on the STM32G474: 2 KiB pages, words of 8 bytes that can be written once. Power fails after a number of
/// operations, in the midst of a word or of a page.
#[derive(Clone)]
struct Flash {
    bytes: Vec<u8>,
    operations_left: Option<usize>,
    /// Nothing is erased or written, and nobody says so.
    deaf: bool,
}

#[derive(Debug)]
struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn blank() -> Self {
        Self { bytes: vec![0xFF; PAGE * PAGES], operations_left: None, deaf: false }
    }

    /// `Some(true)`: the last operation before the cut, which stays half-done.
    fn spend(&mut self) -> Result<bool, PowerCut> {
        match &mut self.operations_left {
            None => Ok(false),
            Some(0) => Err(PowerCut),
            Some(left) => {
                *left -= 1;
                Ok(*left == 0)
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = PowerCut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;
    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        for page in (from as usize..to as usize).step_by(PAGE) {
            if self.deaf {
                continue;
            }
            let half = self.spend()?;
            // Cut in the midst, every second bit of the whole page has been set.
            self.bytes[page..page + PAGE].iter_mut().for_each(|byte| *byte |= if half { 0x55 } else { 0xFF });
            if half {
                return Err(PowerCut);
            }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        for (index, word) in bytes.chunks(WORD).enumerate() {
            if self.deaf {
                continue;
            }
            let half = self.spend()?;
            let start = offset as usize + index * WORD;
            let target = &mut self.bytes[start..start + WORD];
            // The G4 refuses a second write (RM0440, 3.3.7).
            assert!(target.iter().all(|byte| *byte == 0xFF), "word at {start} written twice");
            let kept = if half { WORD / 2 } else { WORD };
            target[..kept].copy_from_slice(&word[..kept]);
            if half {
                return Err(PowerCut);
            }
        }
        Ok(())
    }
}

fn with_gain(gain: f32) -> Settings {
    let mut settings = Settings::default();
    settings.set(Parameter::Gain, gain).expect("in range");
    settings
}

/// Learned values within the limits of the default parameters with the positioning law and a dead zone of ±0.42 V.
const LEARNED: Quantities = [0.8, 1.2, 0.4, 0.45, 2.0e-3, 2.0, 5.0, 1.1, -1.5, 0.8];

/// Settings under which something is learned.
fn of_the_positioning_law() -> Settings {
    let mut settings = Settings::default();
    for (parameter, value) in
        [(Parameter::Law, 1.0), (Parameter::DeadZoneRight, 0.42), (Parameter::DeadZoneLeft, -0.42)]
    {
        settings.set(parameter, value).expect("in range");
    }
    settings
}

/// Why what is kept is not begun with. Then the configuration is as if nothing was kept.
fn begun_with(settings: &Settings) -> Result<(), KeptError> {
    let result = settings.kept_fits();
    let config = settings.control_config();
    let mut without_kept = settings.clone();
    without_kept.kept = None;
    let nothing_kept = without_kept.control_config();
    assert_eq!(config == nothing_kept, result.is_err() || settings.kept.is_none());
    result
}

fn load(flash: &Flash) -> Loaded {
    block_on(ParameterStore::new(flash.clone(), RANGE).expect("whole pages").load())
}

fn save(flash: Flash, settings: &Settings) -> (Flash, bool) {
    let mut store = ParameterStore::new(flash, RANGE).expect("whole pages");
    let saved = block_on(store.save(settings)).is_ok();
    (store.into_flash(), saved)
}

#[test]
fn an_empty_flash_yields_the_defaults() {
    assert_eq!(load(&Flash::blank()), Loaded::Empty(Settings::default()));
}

#[test]
fn what_was_saved_is_loaded_however_often_it_is_saved() {
    let mut flash = Flash::blank();
    for count in 1..=200_u16 {
        let settings = with_gain(f32::from(count));
        let (after, saved) = save(flash, &settings);
        assert!(saved);
        flash = after;
        assert_eq!(load(&flash), Loaded::Stored(settings), "after {count} saves");
    }
}

#[test]
fn a_power_cut_at_any_write_leaves_the_old_or_the_new_set_and_a_store_that_works() {
    // Saves until the pages have been filled and erased several times, and cuts power at every single operation.
    let mut flash = Flash::blank();
    let mut cuts = 0;
    for round in 1..=24_u16 {
        let (old, new) = (with_gain(f32::from(round - 1)), with_gain(f32::from(round)));
        if round == 1 {
            flash = save(flash, &old).0;
        }
        for operations in 1.. {
            let interrupted = Flash { operations_left: Some(operations), ..flash.clone() };
            let (after, saved) = save(interrupted, &new);
            let rebooted = Flash { operations_left: None, ..after };
            let found = load(&rebooted);
            let expected = if saved { vec![&new] } else { vec![&old, &new] };
            assert!(
                matches!(&found, Loaded::Stored(settings) if expected.contains(&settings)),
                "round {round}, cut after {operations} operations: {found:?}"
            );
            let again = with_gain(1000.0);
            let (repaired, saved_again) = save(rebooted, &again);
            assert!(saved_again, "round {round}, cut after {operations} operations: the store must keep working");
            assert_eq!(load(&repaired), Loaded::Stored(again));
            if saved {
                break;
            }
            cuts += 1;
        }
        flash = save(flash, &new).0;
    }
    println!("{cuts} power cuts");
    assert!(cuts > 24 * 30);
}

#[test]
fn a_flash_that_does_not_change_and_says_nothing_is_found_out_and_the_old_set_stays() {
    for saves in 1..6_u16 {
        let mut flash = Flash::blank();
        for count in 1..=saves {
            flash = save(flash, &with_gain(f32::from(count))).0;
        }
        let (after, saved) = save(Flash { deaf: true, ..flash }, &with_gain(1000.0));
        assert!(!saved);
        assert_eq!(load(&after), Loaded::Stored(with_gain(f32::from(saves))));
    }
}

#[test]
fn a_wrong_bit_in_the_newest_set_is_no_reason_to_take_an_older_one() {
    let mut whole = with_gain(7.0);
    whole.kept = Some(Kept { rig: whole.rig_check(), values: LEARNED });
    let flash = save(save(Flash::blank(), &with_gain(3.0)).0, &whole).0;
    let set = PAGE + 16..PAGE + 16 + firmware_core::STORED_BYTES;
    for at in set {
        let mut wrong = flash.clone();
        wrong.bytes[at] ^= 1 << (at % 8);
        assert_eq!(load(&wrong), Loaded::Corrupt(Settings::default()), "at {at}");
        let (after, saved) = save(wrong, &with_gain(9.0));
        assert!(saved);
        assert_eq!(load(&after), Loaded::Stored(with_gain(9.0)));
    }
}

#[test]
fn rubbish_in_flash_yields_the_defaults_and_can_be_overwritten() {
    for seed in 0..50_u32 {
        let mut flash = Flash::blank();
        let mut random = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
        for byte in &mut flash.bytes {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (random >> 24) as u8;
        }
        assert_eq!(load(&flash).settings(), Settings::default());
        let settings = with_gain(7.0);
        let (after, saved) = save(flash, &settings);
        assert!(saved, "seed {seed}");
        assert_eq!(load(&after), Loaded::Stored(settings));
    }
}

#[test]
fn a_stored_value_out_of_range_or_a_set_that_does_not_fit_together_yields_the_defaults() {
    let mut flash = save(Flash::blank(), &with_gain(7.0)).0;
    // A gain of 7.0 is found in flash, and replaced by a negative one with a valid checksum: by way of a second store
    // that knows other limits. Here: the crossed ranges of a set that the desk would refuse.
    let mut crossed = Settings::default();
    crossed.set(Parameter::PositionLow, 0.6).expect("in range by itself");
    flash = save(flash, &crossed).0;
    assert_eq!(load(&flash), Loaded::Corrupt(Settings::default()));
}

#[test]
fn what_was_kept_is_found_beside_the_parameters_and_begun_with() {
    let mut settings = of_the_positioning_law();
    assert_eq!(begun_with(&settings), Ok(()), "nothing is kept");
    settings.kept = Some(Kept { rig: settings.rig_check(), values: LEARNED });
    let (flash, saved) = save(Flash::blank(), &settings);
    assert!(saved);
    let Loaded::Stored(loaded) = load(&flash) else { panic!("stored") };
    assert_eq!(loaded, settings);
    assert_eq!(begun_with(&loaded), Ok(()));
    // Parameters saved without it: as before there was anything to keep.
    settings.kept = None;
    assert_eq!(load(&save(flash, &settings).0), Loaded::Stored(settings));
}

#[test]
fn what_was_kept_with_other_parameters_of_the_rig_or_beyond_the_limits_is_not_begun_with() {
    let mut settings = of_the_positioning_law();
    let kept = |values| Some(Kept { rig: of_the_positioning_law().rig_check(), values });
    settings.kept = kept(LEARNED);
    // How fast the law moves and what is sent says nothing of the rig.
    for (parameter, value) in [(Parameter::ServoSpeed, 1.2), (Parameter::TelemetryEvery, 3.0), (Parameter::Gain, 5.0)] {
        settings.set(parameter, value).expect("in range");
        assert_eq!(begun_with(&settings), Ok(()), "{}", parameter.name());
    }
    for (parameter, value) in [
        (Parameter::Law, 0.0),
        (Parameter::TickHz, 2000.0),
        (Parameter::DeadZoneRight, 0.421),
        (Parameter::ServoFill, 1.2),
        (Parameter::ServoCoulomb, 2.3),
        (Parameter::ServoLag, 1.8e-3),
        (Parameter::ServoAreaB, 4.0e-5),
    ] {
        let mut other = settings.clone();
        other.set(parameter, value).expect("in range");
        assert_eq!(begun_with(&other), Err(KeptError::OtherParameters), "{}", parameter.name());
    }
    for quantity in Quantity::ALL {
        // A load may be zero, and what older firmware did not learn may be missing.
        let wrong = match quantity {
            Quantity::Load => [-100.0, 100.0, f32::INFINITY],
            _ if quantity.is_newer() => [0.0, 100.0, f32::INFINITY],
            _ => [0.0, 100.0, f32::NAN],
        };
        for wrong in wrong {
            let mut values = LEARNED;
            values[usize::from(quantity.number())] = wrong;
            settings.kept = kept(values);
            // It comes through flash, and is refused by the law's limits, not by the store.
            let Loaded::Stored(loaded) = load(&save(Flash::blank(), &settings).0) else { panic!("stored") };
            assert_eq!(begun_with(&loaded), Err(KeptError::Limits(quantity.number())), "{} {wrong}", quantity.name());
            assert!(loaded.setup().is_ok(), "the board runs with nominal values");
        }
    }
}

#[test]
fn what_a_firmware_kept_that_learned_less_is_begun_with_and_the_rest_is_nominal() {
    let mut settings = of_the_positioning_law();
    let mut values = LEARNED;
    for index in [9, 8] {
        values[index] = f32::NAN;
        settings.kept = Some(Kept { rig: settings.rig_check(), values });
        assert_eq!(begun_with(&settings), Ok(()));
    }
    // Nothing else may be missing.
    for index in 0..8 {
        let mut values = LEARNED;
        values[index] = f32::NAN;
        settings.kept = Some(Kept { rig: settings.rig_check(), values });
        assert_eq!(begun_with(&settings), Err(KeptError::Limits(index as u8)));
    }
}
