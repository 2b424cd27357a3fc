//! Parameters in flash: one set per page, the pages in turn, so that a power cut leaves either the old set or the new one.
//!
//! ```text
//!   page │ seal: sequence number, length, check value of the set, check value of these three │ the set │ blank │
//! ```
//!
//! A save erases the page behind the newest set, writes the new set there, seals it last and reads it back. Whatever the page
//! held before (an older set, the rest of an interrupted save, another program's data) is erased first, and the newest set is
//! never touched. The newest sealed page is the one that counts. If its set does not fit its seal, it has changed since it was
//! saved: that is no power cut, and an older set is not silently taken instead.

use board_link::Parameter;
use control::{QUANTITIES, Quantity};
use embedded_storage_async::nor_flash::NorFlash;

use crate::check::CHECK;
use crate::settings::{Kept, Settings};

/// First byte of a set: raised when its layout changes. (New parameters do not change it: they keep their defaults.)
pub const LAYOUT: u8 = 1;
const ENTRY_BYTES: usize = 5;
/// Number of the entry with the check value that belongs to what was kept; behind it one entry for each learned quantity. No
/// parameter has such a number, and a firmware that keeps nothing passes them over.
const KEPT: u8 = 192;
const _: () = assert!(Parameter::ALL[Parameter::ALL.len() - 1].number() < KEPT);
const KEPT_ENTRIES: usize = 1 + QUANTITIES;
/// Longest set: layout byte, then number and value of every parameter, and what was kept.
pub const STORED_BYTES: usize = 1 + ENTRY_BYTES * (Parameter::ALL.len() + KEPT_ENTRIES);
/// Four numbers of 4 bytes: whole words of any flash up to 16 bytes.
const SEAL_BYTES: usize = 16;
/// Room for the set in whole words.
const SET_BYTES: usize = STORED_BYTES.next_multiple_of(SEAL_BYTES);
/// What a page holds.
const USED_BYTES: usize = SEAL_BYTES + SET_BYTES;
const BLANK: u8 = 0xFF;

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum Loaded {
    /// A set that passes every check.
    Stored(Settings),
    /// Nothing has ever been saved: defaults.
    Empty(Settings),
    /// Something is there, but it is unreadable, of another layout, out of range or inconsistent: defaults.
    Corrupt(Settings),
}

impl Loaded {
    /// The settings to run with.
    #[must_use]
    pub fn settings(self) -> Settings {
        match self {
            Self::Stored(settings) | Self::Empty(settings) | Self::Corrupt(settings) => settings,
        }
    }
}

/// The region of flash that holds the parameters.
pub struct ParameterStore<F: NorFlash> {
    flash: F,
    range: core::ops::Range<u32>,
}

/// A sealed page.
#[derive(Clone, Copy)]
struct Sealed {
    page: u32,
    sequence: u32,
    /// Its set is what was sealed.
    whole: bool,
}

impl<F: NorFlash> ParameterStore<F> {
    const PAGE: u32 = F::ERASE_SIZE as u32;

    /// Uses `range` of `flash`, at least two erasable pages. `None` if the range is not whole pages, or the flash has words of
    /// more than 16 bytes.
    #[must_use]
    pub fn new(flash: F, range: core::ops::Range<u32>) -> Option<Self> {
        let whole = range.start.is_multiple_of(Self::PAGE) && range.end.is_multiple_of(Self::PAGE);
        let fits = F::ERASE_SIZE >= USED_BYTES && SEAL_BYTES.is_multiple_of(F::WRITE_SIZE) && F::READ_SIZE == 1;
        let pages = range.end.checked_sub(range.start)? / Self::PAGE;
        (whole && fits && pages >= 2).then_some(Self { flash, range })
    }

    fn pages(&self) -> impl Iterator<Item = u32> + use<F> {
        self.range.clone().step_by(F::ERASE_SIZE)
    }

    /// Reads a page and looks for its seal. A page that cannot be read carries none.
    async fn read(&mut self, page: u32, bytes: &mut [u8; USED_BYTES]) -> Option<Sealed> {
        self.flash.read(page, bytes).await.ok()?;
        let (seal, set) = bytes.split_at(SEAL_BYTES);
        let word = |place: usize| Some(u32::from_le_bytes(seal.get(place..place + 4)?.try_into().ok()?));
        let whole = set.get(..word(4)? as usize).map(|set| CHECK.checksum(set)) == Some(word(8)?);
        let fits = CHECK.checksum(seal.get(..12)?) == word(12)?;
        fits.then_some(Sealed { page, sequence: word(0)?, whole })
    }

    /// The newest sealed page, and whether all pages are blank where a set would stand.
    async fn newest(&mut self, bytes: &mut [u8; USED_BYTES]) -> (Option<Sealed>, bool) {
        let (mut newest, mut blank) = (None::<Sealed>, true);
        for page in self.pages() {
            bytes.fill(0);
            let found = self.read(page, bytes).await;
            blank &= bytes.iter().all(|byte| *byte == BLANK);
            if let Some(found) = found
                && newest.is_none_or(|newest| found.sequence > newest.sequence)
            {
                newest = Some(found);
            }
        }
        (newest, blank)
    }

    /// Reads the stored set; never fails, but may return defaults.
    pub async fn load(&mut self) -> Loaded {
        let mut bytes = [0; USED_BYTES];
        let (newest, blank) = self.newest(&mut bytes).await;
        let Some(newest) = newest else {
            let settings = Settings::default();
            return if blank { Loaded::Empty(settings) } else { Loaded::Corrupt(settings) };
        };
        let sealed = self.read(newest.page, &mut bytes).await;
        let set = bytes.get(SEAL_BYTES..).and_then(|rest| rest.get(..length(&bytes)));
        match sealed.filter(|sealed| sealed.whole).and(set).and_then(decode) {
            Some(settings) => Loaded::Stored(settings),
            None => Loaded::Corrupt(Settings::default()),
        }
    }

    /// Writes a set. What was stored before stays valid until the new set is complete, and read back.
    ///
    /// # Errors
    /// If the flash refuses, or does not hold what was written; the old set is then still there.
    pub async fn save(&mut self, settings: &Settings) -> Result<(), SaveError> {
        let mut bytes = [0; USED_BYTES];
        let (newest, _) = self.newest(&mut bytes).await;
        let (page, sequence) = match newest {
            None => (self.range.start, 1),
            Some(newest) => {
                let next = newest.page + Self::PAGE;
                (if next < self.range.end { next } else { self.range.start }, newest.sequence.wrapping_add(1))
            }
        };
        self.flash.erase(page, page + Self::PAGE).await.map_err(|_| SaveError)?;
        fill(&mut bytes, settings, sequence);
        let (seal, set) = bytes.split_at(SEAL_BYTES);
        self.flash.write(page + SEAL_BYTES as u32, set).await.map_err(|_| SaveError)?;
        self.flash.write(page, seal).await.map_err(|_| SaveError)?;
        // A driver may lose an error of the flash; what stands there decides.
        let mut found = [0; USED_BYTES];
        self.flash.read(page, &mut found).await.map_err(|_| SaveError)?;
        if found == bytes { Ok(()) } else { Err(SaveError) }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }
}

/// The flash could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SaveError;

fn length(page: &[u8; USED_BYTES]) -> usize {
    let [_, _, _, _, l0, l1, l2, l3, ..] = *page;
    u32::from_le_bytes([l0, l1, l2, l3]) as usize
}

fn fill(page: &mut [u8; USED_BYTES], settings: &Settings, sequence: u32) {
    page.fill(BLANK);
    let (seal, rest) = page.split_at_mut(SEAL_BYTES);
    let length = encode(settings, rest);
    let check = CHECK.checksum(rest.get(..length).unwrap_or_default());
    let (numbers, seal_check) = seal.split_at_mut(12);
    for (place, word) in numbers.chunks_exact_mut(4).zip([sequence, length as u32, check]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    seal_check.copy_from_slice(&CHECK.checksum(numbers).to_le_bytes());
}

/// Writes a set, and returns its length.
fn encode(settings: &Settings, set: &mut [u8]) -> usize {
    let Some((layout, entries)) = set.split_first_mut() else { return 0 };
    *layout = LAYOUT;
    let parameters =
        Parameter::ALL.into_iter().map(|parameter| (parameter.number(), settings.get(parameter).to_le_bytes()));
    let kept = settings.kept.iter().flat_map(|kept| {
        let values = kept.values.iter().zip(Quantity::ALL);
        let values = values.map(|(value, quantity)| (KEPT + 1 + quantity.number(), value.to_le_bytes()));
        core::iter::once((KEPT, kept.rig.to_le_bytes())).chain(values)
    });
    let mut length = 1;
    for (entry, (number, value)) in entries.chunks_exact_mut(ENTRY_BYTES).zip(parameters.chain(kept)) {
        if let [first, rest @ ..] = entry {
            *first = number;
            rest.copy_from_slice(&value);
        }
        length += ENTRY_BYTES;
    }
    length
}

fn decode(set: &[u8]) -> Option<Settings> {
    let (layout, entries) = set.split_first()?;
    if *layout != LAYOUT || entries.len() % ENTRY_BYTES != 0 {
        return None;
    }
    let mut settings = Settings::default();
    for entry in entries.chunks_exact(ENTRY_BYTES) {
        let (number, value) = entry.split_first()?;
        let bytes = value.try_into().ok()?;
        let value = f32::from_le_bytes(bytes);
        // A number this firmware does not know was written by a newer one: its parameter does not exist here.
        if let Some(parameter) = Parameter::from_number(*number) {
            settings.set(parameter, value).ok()?;
        } else if let Some(place) = number.checked_sub(KEPT) {
            // What is missing is no number, and so beyond its limits.
            let kept = settings.kept.get_or_insert(Kept { rig: 0, values: [f32::NAN; QUANTITIES] });
            match place.checked_sub(1) {
                None => kept.rig = u32::from_le_bytes(bytes),
                Some(index) => {
                    if let Some(slot) = kept.values.get_mut(usize::from(index)) {
                        *slot = value;
                    }
                }
            }
        }
    }
    settings.check().ok()?;
    Some(settings)
}
