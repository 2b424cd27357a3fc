//! The controller as a co-process: one line in, one line out, one control tick each.
//!
//! In: `y_ref_m adc_position adc_p_a adc_p_b adc_p_sup` (codes are integers of `adc_bits`). Out: `dac_code state`, where
//! `state` is `run` or `safe:REASON`. A malformed line is answered `error …` and changes nothing. The line `learned` is no tick: it is
//! answered with what the positioning law has learned, as the board's telemetry tells it.
//!
//! Each tick is the firmware's own, model monitor included. Whoever sets it up should let the monitor warn only: it knows the
//! rig file, while the plant at the other end may be of other physics (another flow law, leaks, hoses), and what such a plant
//! was answered before there was a monitor it must be answered still.

use crate::closed_loop::reference;
use crate::learned;
use control::{ControllerState, ExternalFaults, Parameters, Position};
use firmware_core::{ControlLoop, Setup};
use rig_files::shorten;
use std::io::{BufRead, Write};

/// Longer lines are malformed; they are skipped without being stored.
const LONGEST_LINE: usize = 1024;

/// The controller behind the protocol, armed.
#[derive(Clone, Debug)]
pub struct Coprocess {
    control_loop: ControlLoop,
    top_code: u16,
    tick_hz: u32,
    ticks: u64,
    contradictions: u64,
}

impl Coprocess {
    /// An armed controller with a setup made of `parameters`.
    #[must_use]
    pub fn new(setup: Setup, parameters: &Parameters) -> Self {
        let top_code = u16::MAX >> (16 - u32::from(parameters.adc_bits).clamp(1, 16));
        let control_loop = ControlLoop::in_state(setup, ControllerState::armed());
        Self { control_loop, top_code, tick_hz: parameters.tick_hz, ticks: 0, contradictions: 0 }
    }

    /// The controller's state, for tests.
    #[must_use]
    pub fn state(&self) -> &ControllerState {
        self.control_loop.state()
    }

    /// Ticks so far, and in how many of them the model monitor found that the readings contradict each other.
    #[must_use]
    pub fn contradictions(&self) -> (u64, u64) {
        (self.ticks, self.contradictions)
    }

    /// Answers one line, without its line end.
    pub fn answer(&mut self, line: &str) -> String {
        if line.trim() == "learned" {
            return match self.control_loop.learned() {
                Some(learned) => {
                    format!("learned tick={} {}", self.ticks, learned::words(&learned.values(self.tick_hz)))
                }
                None => "error the paper's law learns nothing".to_owned(),
            };
        }
        match self.parse(line) {
            Ok((reference, codes)) => {
                self.control_loop.hold(reference);
                let tick = self.control_loop.tick(codes, ExternalFaults::default(), true);
                self.ticks += 1;
                self.contradictions += u64::from(self.control_loop.conclude());
                format!("{} {}", tick.valve, self.control_loop.mode())
            }
            Err(problem) => format!("error {problem}"),
        }
    }

    /// Setpoint and codes of a line.
    fn parse(&self, line: &str) -> Result<(Position, [u16; 4]), String> {
        const FIELDS: [&str; 5] = ["y_ref_m", "adc_position", "adc_p_a", "adc_p_b", "adc_p_sup"];
        let fields: Vec<&str> = line.split_ascii_whitespace().collect();
        if fields.len() != FIELDS.len() {
            return Err(format!("{} fields found, expected 5: {}", fields.len(), FIELDS.join(" ")));
        }
        let y_ref_m = fields[0].parse::<f64>().ok().filter(|value| value.is_finite());
        let y_ref_m = y_ref_m.ok_or_else(|| format!("y_ref_m `{}` is not a finite number", shorten(fields[0])))?;
        let mut codes = [0; 4];
        for ((code, field), name) in codes.iter_mut().zip(&fields[1..]).zip(&FIELDS[1..]) {
            let value = field.parse::<u16>().ok().filter(|value| *value <= self.top_code);
            let top = self.top_code;
            *code = value.ok_or_else(|| format!("{name} `{}` is not an integer from 0 to {top}", shorten(field)))?;
        }
        Ok((reference(y_ref_m), codes))
    }

    /// Serves lines until the input ends. `contradicted` is called once, with the number of the tick in which the model monitor
    /// first finds that the readings contradict each other.
    ///
    /// # Errors
    /// The streams fail; a reader that went away ends the service without an error.
    pub fn serve(
        &mut self,
        mut input: impl BufRead,
        mut output: impl Write,
        contradicted: impl FnOnce(u64),
    ) -> std::io::Result<()> {
        let mut contradicted = Some(contradicted).filter(|_| self.contradictions == 0);
        let mut line = Vec::with_capacity(LONGEST_LINE);
        while let Some(whole) = read_line(&mut input, &mut line)? {
            let answer = match std::str::from_utf8(&line) {
                Ok(text) if whole => self.answer(text),
                Ok(_) => format!("error the line is longer than {LONGEST_LINE} bytes"),
                Err(_) => "error the line is not UTF-8 text".to_string(),
            };
            if self.contradictions > 0
                && let Some(contradicted) = contradicted.take()
            {
                contradicted(self.ticks);
            }
            let sent = writeln!(output, "{answer}").and_then(|()| output.flush());
            match sent {
                Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
                other => other?,
            }
        }
        Ok(())
    }
}

/// Reads one line without its end into `line`; `Some(false)` for one that was too long and is cut, `None` at the end.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> std::io::Result<Option<bool>> {
    line.clear();
    let mut whole = true;
    let mut any = false;
    loop {
        let available = input.fill_buf()?;
        if available.is_empty() {
            return Ok(any.then_some(whole));
        }
        any = true;
        let end = available.iter().position(|&byte| byte == b'\n');
        let part = &available[..end.unwrap_or(available.len())];
        let room = LONGEST_LINE - line.len();
        whole &= part.len() <= room;
        line.extend_from_slice(&part[..part.len().min(room)]);
        let used = part.len() + usize::from(end.is_some());
        input.consume(used);
        if end.is_some() {
            if !whole {
                // A cut line may end inside a character; it is answered by its length alone.
                line.clear();
            }
            return Ok(Some(whole));
        }
    }
}
