//! Parameters in flash: all of them as one item, so that a power cut leaves either the old set or the new one.

use board_link::Parameter;
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::settings::Settings;

/// The only key of the map.
const KEY: u8 = 1;
/// First byte of the item: raised when its layout changes. (New parameters do not change it: they keep their defaults.)
const LAYOUT: u8 = 1;
const ENTRY_BYTES: usize = 5;
/// Longest item: layout byte, then number and value of every parameter.
pub const STORED_BYTES: usize = 1 + ENTRY_BYTES * Parameter::ALL.len();
/// The item, its key, and room for alignment to the flash word.
const BUFFER_BYTES: usize = (STORED_BYTES + 1 + 32) / 32 * 32;

/// Loading happens once and saving by hand: a cache would cost RAM for nothing.
type NoCache = Cache<Uncached, Uncached, Uncached, u8>;

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
    map: MapStorage<u8, F, NoCache>,
}

impl<F: NorFlash> ParameterStore<F> {
    /// Uses `range` of `flash`, at least two erasable pages. `None` if the range is not whole pages.
    #[must_use]
    pub fn new(flash: F, range: core::ops::Range<u32>) -> Option<Self> {
        let config = MapConfig::try_new(range).ok()?;
        Some(Self { map: MapStorage::new(flash, config, Cache::new_uncached()) })
    }

    /// Reads the stored set; never fails, but may return defaults.
    pub async fn load(&mut self) -> Loaded {
        let mut buffer = [0; BUFFER_BYTES];
        match self.map.fetch_item::<&[u8]>(&mut buffer, &KEY).await {
            Ok(Some(item)) => match decode(item) {
                Some(settings) => Loaded::Stored(settings),
                None => Loaded::Corrupt(Settings::default()),
            },
            Ok(None) => Loaded::Empty(Settings::default()),
            Err(_) => Loaded::Corrupt(Settings::default()),
        }
    }

    /// Writes a set. What was stored before stays valid until the new set is complete.
    ///
    /// # Errors
    /// If the flash refuses; the old set is then still there.
    pub async fn save(&mut self, settings: &Settings) -> Result<(), SaveError> {
        let mut item = [0; STORED_BYTES];
        encode(settings, &mut item);
        let mut buffer = [0; BUFFER_BYTES];
        match self.map.store_item(&mut buffer, &KEY, &item.as_slice()).await {
            Ok(()) => Ok(()),
            Err(sequential_storage::Error::Storage { .. }) => Err(SaveError),
            // The pages hold something that is no store (another program's data): start afresh, once.
            Err(_) => {
                self.map.erase_all().await.map_err(|_| SaveError)?;
                self.map.store_item(&mut buffer, &KEY, &item.as_slice()).await.map_err(|_| SaveError)
            }
        }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.map.destroy().0
    }
}

/// The flash could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SaveError;

fn encode(settings: &Settings, item: &mut [u8; STORED_BYTES]) {
    let (layout, entries) = item.split_at_mut(1);
    layout.fill(LAYOUT);
    for (entry, parameter) in entries.chunks_exact_mut(ENTRY_BYTES).zip(Parameter::ALL) {
        if let [number, value @ ..] = entry {
            *number = parameter.number();
            value.copy_from_slice(&settings.get(parameter).to_le_bytes());
        }
    }
}

fn decode(item: &[u8]) -> Option<Settings> {
    let (layout, entries) = item.split_first()?;
    if *layout != LAYOUT || entries.len() % ENTRY_BYTES != 0 {
        return None;
    }
    let mut settings = Settings::default();
    for entry in entries.chunks_exact(ENTRY_BYTES) {
        let (number, value) = entry.split_first()?;
        let value = f32::from_le_bytes(value.try_into().ok()?);
        // A number this firmware does not know was written by a newer one: its parameter does not exist here.
        if let Some(parameter) = Parameter::from_number(*number) {
            settings.set(parameter, value).ok()?;
        }
    }
    settings.check().ok()?;
    Some(settings)
}
