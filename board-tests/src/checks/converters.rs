//! The converters read what the output gives. The valve output (PA4) is wired to all four inputs (PA0, PA1, PC1, PC0); the loop
//! then settles where position and output agree, and setpoints move both. What the output gives is known by its code, so every
//! reading tells the error of output and converter together.

use crate::bench::{Bench, Failure, Outcome, Session, with_parameters_kept};
use board_link::{Command, Generator, Parameter};
use plant_sim::commission::observe;

/// Setpoints, um. With the gain below, the output reaches 60 % of them: codes 819 to 3277.
const SETPOINTS_UM: [i32; 9] = [-490_000, -380_000, -250_000, -120_000, 0, 120_000, 250_000, 380_000, 490_000];
/// With 10 V over 1 m the loop is `u = K (r − u / 10 V/m)`: stable up to 10 V/m, and 15 V/m would go round for ever.
const GAIN_V_PER_M: f32 = 6.0;
/// Error of output and converter together, in 12-bit steps: the unbuffered DAC's gain and offset (DS12288: ±0.5 %, that is 20
/// steps, and 5) and the converter's (5).
const TOLERANCE_STEPS: f64 = 30.0;
/// The same between neighbouring setpoints, where gain and offset nearly cancel: a missing bit would show here.
const STEP_TOLERANCE: f64 = 6.0;
/// Noise of a reading, in 16-bit codes.
const NOISE_CODES: f64 = 60.0;

/// See the file.
///
/// # Errors
/// A reading that is off, noisy, or of another channel's wire.
pub fn converters<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    if !bench.looped_back() {
        let wires =
            "PA4 is not said to be wired to PA0, PA1, PC1 and PC0 (A2 to A0, A1, A4, A5): POSITIONER_LOOP_BACK=1";
        return Ok(Outcome::Skipped(wires.into()));
    }
    with_parameters_kept(bench, |bench| {
        let mut session = Session::<B>::open(bench)?;
        if session.status()?.state == "run" {
            session.done(Command::Disarm)?;
        }
        session.done(Command::Bench { on: false })?;
        session.done(Command::Defaults)?;
        session.change(&[
            (Parameter::Gain, GAIN_V_PER_M),
            // What is read here is no cylinder.
            (Parameter::Monitor, 0.0),
            (Parameter::SupplyMinimum, 0.0),
            (Parameter::SetpointVelocity, 0.5),
            (Parameter::StuckTime, 1.0),
        ])?;
        if session.status()?.state.starts_with("safe") {
            session.done(Command::Acknowledge)?;
        }
        session.wait_for("idle")?;
        session.done(Command::Arm)?;
        let mut errors = Vec::new();
        let mut noise = 0.0_f64;
        for position_um in SETPOINTS_UM {
            session.done(Command::Generate(Generator::Hold { position_um }))?;
            // A metre takes two seconds; then it has settled.
            observe::ticks(session.client(), 1500)?;
            let seen = observe::ticks(session.client(), 300)?;
            if let Some(status) = seen.statuses.iter().find(|status| status.state != "run") {
                return Err(Failure(format!("at {position_um} um the board went to `{}`", status.state)));
            }
            let given =
                seen.statuses.iter().map(|status| f64::from(status.dac_code)).sum::<f64>() / seen.statuses.len() as f64;
            for channel in 0..4 {
                let read = seen.codes(channel);
                noise = noise.max(read.noise);
                let error = read.mean / 65_535.0 * 4095.0 - given;
                Failure::unless(error.abs() < TOLERANCE_STEPS, || {
                    format!("input {channel} reads {:.1} of 4095 where the output gives {given:.1}", given + error)
                })?;
                errors.push((channel, error));
            }
        }
        session.done(Command::Disarm)?;
        for channel in 0..4 {
            let of: Vec<f64> = errors.iter().filter(|(c, _)| *c == channel).map(|(_, error)| *error).collect();
            let jump = of.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            Failure::unless(jump < STEP_TOLERANCE, || {
                format!("input {channel}: the error jumps by {jump:.1} steps between two setpoints")
            })?;
        }
        Failure::unless(noise < NOISE_CODES, || format!("a reading is noisy: {noise:.1} codes of 65 536"))?;
        let worst = errors.iter().map(|(_, error)| error.abs()).fold(0.0, f64::max);
        Ok(Outcome::Passed(format!(
            "output and inputs agree within {worst:.2} of 4096 steps, noise {noise:.1} of 65 536"
        )))
    })
}
