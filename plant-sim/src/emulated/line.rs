//! The emulated serial line as a port.

use super::board::Board;
use std::io::{Error, ErrorKind, Read, Result, Write};
use stm32_emulator::analog::Analog;

/// How far a read lets the board run before it gives up: more than the longest command takes, a save with its erasures.
const PATIENCE_S: f64 = 1.0;
const SLICE_S: f64 = 0.001;

/// One end of the line; the board runs while this end waits for its bytes. No time of the computer is involved.
pub struct Line<'a, A> {
    board: &'a mut Board<A>,
}

impl<'a, A: Analog> Line<'a, A> {
    /// The line to a board.
    pub fn to(board: &'a mut Board<A>) -> Self {
        Self { board }
    }
}

impl<A: Analog> Read for Line<'_, A> {
    /// Waits for a whole answer: until the line has been silent for some bytes' time after the first one.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let mut bytes = Vec::new();
        let mut waited_s = 0.0;
        while waited_s < PATIENCE_S && bytes.len() < buffer.len() {
            let before = bytes.len();
            self.board.run(SLICE_S).map_err(|error| Error::other(error.to_string()))?;
            bytes.extend(self.board.take_sent());
            if before > 0 && bytes.len() == before {
                break;
            }
            waited_s += SLICE_S;
        }
        if bytes.is_empty() {
            return Err(ErrorKind::TimedOut.into());
        }
        // An answer is one frame, shorter than any reader's buffer; what is longer than it would be lost, and asked for again.
        let count = bytes.len().min(buffer.len());
        buffer[..count].copy_from_slice(&bytes[..count]);
        Ok(count)
    }
}

impl<A: Analog> Write for Line<'_, A> {
    fn write(&mut self, buffer: &[u8]) -> Result<usize> {
        self.board.send(buffer);
        Ok(buffer.len())
    }
    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
