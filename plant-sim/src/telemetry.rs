//! Telemetry of the board → log: decodes the defmt stream, turns codes into quantities, marks what is missing.

use control::{Position, Quantities, Quantity};
use defmt_decoder::{DecodeError, StreamDecoder, Table};
use firmware_core::{STOPPING, mode_from_number};
use rig_files::{Converter, InputError, Log};

/// Where in the stream something went wrong, or what the board said.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// The mode changed: time and the mode's word.
    Mode(f64, String),
    /// Records are missing: time of the last one before, how many.
    Lost(f64, u32),
    /// The board restarted; the log's time goes on.
    Restart(f64),
    /// The model monitor has begun to contradict the sensors.
    Disagreement(f64),
    /// What the positioning law has learned: time of the last record before, values.
    Learned(f64, Quantities),
    /// Any other line of the board.
    Text(String),
}

/// The last record, for a display.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latest {
    /// Time, s.
    pub t_s: f64,
    /// Position and setpoint, m.
    pub y_m: [f64; 2],
    /// p_a, p_b, p_sup, Pa.
    pub p_pa: [f64; 3],
    /// Valve command, V.
    pub u_v: f64,
    /// Core clock cycles from the interrupt's entry to the valve code; 0 where they are not measured.
    pub cycles: u32,
}

/// How far a recording has got.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Records taken.
    pub records: u64,
    /// Records missing by their sequence numbers.
    pub lost: u64,
    /// Frames that could not be decoded.
    pub malformed: u64,
    /// Records that came before the scales were known.
    pub unscaled: u64,
}

/// Bits of the codes in the stream, on every board.
const ADC_BITS: u32 = 16;
const DAC_BITS: u32 = 12;

/// What the board has said of its ticks and converters.
#[derive(Clone, Copy, Debug)]
struct BoardScales {
    hz: f64,
    position: Converter,
    /// p_a, p_b, p_sup.
    pressures: [Converter; 3],
    valve: Converter,
}

/// Takes lines of telemetry and collects a log.
#[derive(Debug, Default)]
pub struct Recorder {
    log: Log,
    scales: Option<BoardScales>,
    last: Option<(u32, u32)>,
    offset_s: f64,
    mode: Option<u16>,
    /// The newest record.
    pub latest: Latest,
    /// What has come and what has not.
    pub tally: Tally,
}

/// The number after `key=` in a line of words.
fn number<T: std::str::FromStr>(line: &str, key: &str) -> Option<T> {
    line.split_ascii_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('=')?.parse().ok())
}

/// The values of a line about what was learned.
fn learned(line: &str) -> Option<Quantities> {
    let mut values = Quantities::default();
    for (value, quantity) in values.iter_mut().zip(Quantity::ALL) {
        let told = number(line, quantity.name()).filter(|value: &f32| value.is_finite());
        // What older firmware does not tell is not known.
        *value = if quantity.is_newer() { told.unwrap_or(f32::NAN) } else { told? };
    }
    Some(values)
}

impl Recorder {
    /// An empty log.
    #[must_use]
    pub fn new() -> Self {
        let empty = || Some(Vec::new());
        Self {
            log: Log {
                u_v: empty(),
                p_a_pa: empty(),
                p_b_pa: empty(),
                p_sup_pa: empty(),
                y_ref_m: empty(),
                ..Log::default()
            },
            ..Self::default()
        }
    }

    /// Takes one line of the board.
    pub fn take(&mut self, line: &str, remarks: &mut Vec<Remark>) {
        if let Some(rest) = line.strip_prefix("scales ") {
            self.take_scales(rest);
        } else if line.starts_with("tick=") {
            if self.take_record(line, remarks).is_none() {
                self.tally.malformed += 1;
            }
        } else if let Some(rest) = line.strip_prefix("learned ") {
            match learned(rest) {
                Some(values) => remarks.push(Remark::Learned(self.latest.t_s, values)),
                None => self.tally.malformed += 1,
            }
        } else if line.starts_with("event ") {
            // Of the mode the record before has told already.
            if number(line, "disagreement") == Some(true) {
                remarks.push(Remark::Disagreement(self.latest.t_s));
            }
        } else {
            remarks.push(Remark::Text(line.to_owned()));
        }
    }

    fn take_scales(&mut self, line: &str) {
        let get = |key| number::<f64>(line, key).filter(|value| value.is_finite());
        let scales = (|| {
            let scales = BoardScales {
                hz: get("hz")?,
                position: Converter::new([get("y0")?, get("y1")?], ADC_BITS),
                pressures: [
                    Converter::new([get("a0")?, get("a1")?], ADC_BITS),
                    Converter::new([get("b0")?, get("b1")?], ADC_BITS),
                    Converter::new([get("s0")?, get("s1")?], ADC_BITS),
                ],
                valve: Converter::new([get("u0")?, get("u1")?], DAC_BITS),
            };
            (scales.hz > 0.0).then_some(scales)
        })();
        match scales {
            Some(scales) => self.scales = Some(scales),
            None => self.tally.malformed += 1,
        }
    }

    fn take_record(&mut self, line: &str, remarks: &mut Vec<Remark>) -> Option<()> {
        let (tick, sequence) = (number::<u32>(line, "tick")?, number::<u32>(line, "seq")?);
        let code = |key| number::<u16>(line, key);
        let (y, a, b, sup, held) = (code("y")?, code("a")?, code("b")?, code("sup")?, code("held")?);
        let (reference, mode) = (number::<i32>(line, "ref")?, code("mode")?);
        let Some(scales) = self.scales else {
            self.tally.unscaled += 1;
            return Some(());
        };
        if let Some((last_tick, last_sequence)) = self.last {
            let (ticks, records) = (tick.wrapping_sub(last_tick), sequence.wrapping_sub(last_sequence));
            let last_s = self.latest.t_s;
            if ticks == 0 || ticks > u32::MAX / 2 || records > u32::MAX / 2 {
                // How long a restart takes is not in the stream; a second is longer than any gap between records.
                remarks.push(Remark::Restart(last_s));
                self.gap(last_s + 0.5);
                self.offset_s = last_s + 1.0 - f64::from(tick) / scales.hz;
            } else if records > 1 {
                let missing = records - 1;
                self.tally.lost += u64::from(missing);
                remarks.push(Remark::Lost(last_s, missing));
                self.gap(last_s + f64::from(ticks) / scales.hz / f64::from(records));
            }
        }
        self.last = Some((tick, sequence));
        let t_s = self.offset_s + f64::from(tick) / scales.hz;
        self.latest = Latest {
            t_s,
            y_m: [scales.position.quantity(y.into()), f64::from(reference) / f64::from(1_u32 << Position::FRAC_NBITS)],
            p_pa: {
                let [p_a, p_b, p_sup] = scales.pressures;
                [p_a.quantity(a.into()), p_b.quantity(b.into()), p_sup.quantity(sup.into())]
            },
            u_v: scales.valve.quantity(held.into()),
            cycles: number(line, "c3").unwrap_or(0),
        };
        if self.mode != Some(mode) {
            self.mode = Some(mode);
            let word = mode_from_number(mode).map_or_else(|| format!("mode {mode}"), |mode| mode.to_string());
            let stopping = if mode & STOPPING != 0 { ", stopping" } else { "" };
            remarks.push(Remark::Mode(t_s, word + stopping));
        }
        let Latest { y_m: [y_m, y_ref_m], p_pa: [p_a, p_b, p_sup], u_v, .. } = self.latest;
        self.row(t_s, [y_m, u_v, p_a, p_b, p_sup, y_ref_m]);
        self.tally.records += 1;
        Some(())
    }

    /// A row without a sample: the reader sees a gap and does not bridge it.
    fn gap(&mut self, t_s: f64) {
        self.row(t_s, [f64::NAN; 6]);
    }

    fn row(&mut self, t_s: f64, [y, u, a, b, sup, reference]: [f64; 6]) {
        let log = &mut self.log;
        log.t_s.push(t_s);
        log.y_m.push(y);
        for (column, value) in [
            (&mut log.u_v, u),
            (&mut log.p_a_pa, a),
            (&mut log.p_b_pa, b),
            (&mut log.p_sup_pa, sup),
            (&mut log.y_ref_m, reference),
        ] {
            column.get_or_insert_default().push(value);
        }
    }

    /// The log so far.
    #[must_use]
    pub fn log(&self) -> &Log {
        &self.log
    }
}

/// Reads the format strings of a firmware file.
///
/// # Errors
/// The file is no firmware with defmt telemetry.
pub fn format_table(elf: &[u8], file: &str) -> Result<Table, InputError> {
    let remedy = "give the very file that runs on the board: target/thumbv7em-none-eabihf/firmware/firmware";
    let problem = |text: String| InputError::new(file, text, remedy);
    match Table::parse(elf) {
        Ok(Some(table)) => Ok(table),
        Ok(None) => Err(problem("holds no telemetry formats (no .defmt section)".into())),
        Err(error) => Err(problem(format!("is no firmware: {error}"))),
    }
}

/// Feeds raw bytes to a decoder and the decoded lines to a recorder.
pub fn decode(
    decoder: &mut (dyn StreamDecoder + Send + Sync + '_),
    bytes: &[u8],
    recorder: &mut Recorder,
    remarks: &mut Vec<Remark>,
) {
    decoder.received(bytes);
    loop {
        match decoder.decode() {
            Ok(frame) => recorder.take(&frame.display_message().to_string(), remarks),
            Err(DecodeError::UnexpectedEof) => return,
            // The encoding finds the next frame by itself.
            Err(DecodeError::Malformed) => recorder.tally.malformed += 1,
        }
    }
}
