//! The firmware's desk and control loop around a simulated cylinder, as a port: time passes with every request.

use board_link::{Accumulator, Admission, FRAME_BYTES, Refusal, Reply, Request, Session, encode};
use control::ExternalFaults;
use firmware_core::{Action, ControlLoop, Desk, Recent, Settings, Snapshot};
use plant_model::{Inputs, Plant, Simulator, Stepper, Tolerance};
use plant_sim::sensors::quantities;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rand_distr::{Distribution, StandardNormal};
use rig_files::{Converter, RigFile};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read, Result as IoResult, Write};
use std::rc::Rc;

/// Ticks that pass with a request: what its two frames take on the line at 115 200 baud.
const TICKS_PER_REQUEST: u32 = 8;
const TICKS_PER_SAMPLES: u32 = 22;

/// A board with its rig.
pub(crate) struct Simulated {
    desk: Desk,
    control_loop: ControlLoop,
    session: Session,
    accumulator: Accumulator,
    snapshot: Snapshot,
    recent: Recent,
    /// The cylinder.
    pub(crate) plant: Simulator<f64>,
    /// Offset and gain by which each sensor reads: `shown = offset + gain · true`.
    pub(crate) sensors: [[f64; 2]; 4],
    /// Standard deviation of a code of each sensor, in its unit.
    pub(crate) noise: [f64; 4],
    converters: [Converter; 4],
    /// What a code makes the valve do.
    pub(crate) valve: Converter,
    code: u16,
    random: Xoshiro256PlusPlus,
    answers: VecDeque<u8>,
    supply_pa: f64,
    /// What a restart finds.
    pub(crate) flash: Settings,
}

impl Simulated {
    pub(crate) fn new(rig: &RigFile) -> Self {
        let plant = Plant::new(&rig.rig, &rig.effects).expect("a rig");
        let [p_a, p_b] = rig.rig.equilibrium_pressures_pa();
        let state = plant.state_at_rest(0.0, p_a, p_b);
        let settings = Settings::default();
        let control_loop = ControlLoop::new(settings.setup().expect("defaults"), None);
        let mut board = Self {
            code: control_loop.safe_code(),
            control_loop,
            desk: Desk::new(settings.clone(), "simulated", "0.0.0", "".try_into().expect("empty")),
            session: Session::new(),
            accumulator: Accumulator::new(),
            snapshot: Snapshot::new(),
            recent: Recent::new(),
            plant: Simulator::from_state(plant, state, Stepper::adaptive(&Tolerance::standard())),
            sensors: [[0.0, 1.0]; 4],
            noise: [5.0e-5, 600.0, 600.0, 600.0],
            converters: [rig.io.position(), rig.io.pressure(), rig.io.pressure(), rig.io.pressure()],
            valve: rig.io.valve(),
            random: Xoshiro256PlusPlus::seed_from_u64(7),
            answers: VecDeque::new(),
            supply_pa: rig.rig.supply.pressure_pa,
            flash: settings,
        };
        board.run(300);
        board
    }

    /// Power off and on: the piston stays where it is.
    pub(crate) fn restart(&mut self) {
        let settings = self.flash.clone();
        self.control_loop = ControlLoop::new(settings.setup().expect("saved as it fits together"), None);
        self.code = self.control_loop.safe_code();
        self.desk = Desk::new(settings, "simulated", "0.0.0", "".try_into().expect("empty"));
        self.snapshot = Snapshot::new();
        self.run(300);
    }

    pub(crate) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let truth = quantities(&self.plant.measure());
            let mut codes = [0; 4];
            for (channel, code) in codes.iter_mut().enumerate() {
                let normal: f64 = StandardNormal.sample(&mut self.random);
                let [offset, gain] = self.sensors[channel];
                let shown = offset + gain * truth[channel] + self.noise[channel] * normal;
                *code = self.converters[channel].code(shown) as u16;
            }
            let tick = self.control_loop.tick(codes, ExternalFaults::default(), true);
            self.control_loop.conclude();
            self.snapshot.publish(&tick.record, &self.control_loop);
            if tick.record_due {
                self.recent.push(&tick.record);
            }
            // The timer hands a code to the pin with the next tick.
            let u_v = self.valve.quantity(self.code.into());
            self.plant.advance_with(&Inputs { u_v, external_force_n: 0.0, supply_pa: self.supply_pa }, 1.0e-3);
            self.code = tick.valve;
        }
    }

    /// Bytes of the host.
    pub(crate) fn take(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(Ok(request)) = self.accumulator.push::<Request>(*byte) {
                self.answer(&request);
            }
        }
    }

    /// Bytes for the host, so many at most.
    pub(crate) fn give(&mut self, most: usize) -> Vec<u8> {
        let count = self.answers.len().min(most);
        self.answers.drain(..count).collect()
    }

    /// The piston held at `y_m` with both chambers at these pressures, as if by hand.
    pub(crate) fn place(&mut self, rig: &RigFile, y_m: f64, p_pa: [f64; 2]) {
        let plant = Plant::new(&rig.rig, &rig.effects).expect("a rig");
        let state = plant.state_at_rest(y_m, p_pa[0], p_pa[1]);
        self.plant = Simulator::from_state(plant, state, Stepper::adaptive(&Tolerance::standard()));
        self.run(10);
    }

    fn answer(&mut self, request: &Request) {
        let answer = match self.session.admit(request, 77) {
            Admission::Answer(answer) => answer,
            Admission::Execute(command) => {
                let result = self.desk.decide(command, &self.snapshot, 0).and_then(|action| match action {
                    Action::Reply(reply) => Ok(reply),
                    Action::Order(order, outcome) => {
                        self.control_loop.order(&order);
                        self.run(2);
                        if outcome.shown_by(self.snapshot.mode()) { Ok(Reply::Done) } else { Err(Refusal::State) }
                    }
                    Action::Samples => Ok(Reply::Samples(self.recent.take())),
                    Action::Save => {
                        self.flash = self.desk.settings().clone();
                        Ok(Reply::Done)
                    }
                    Action::Keep(kept) => {
                        self.desk.keep(kept);
                        self.flash = self.desk.settings().clone();
                        Ok(Reply::Done)
                    }
                    Action::Restart => {
                        self.restart();
                        Ok(Reply::Done)
                    }
                    Action::Bootloader => Ok(Reply::Done),
                });
                self.session.answered(result)
            }
        };
        // An answer full of records is longer.
        self.run(if matches!(answer.result, Ok(Reply::Samples(_))) { TICKS_PER_SAMPLES } else { TICKS_PER_REQUEST });
        self.answers.extend(encode(&answer, &mut [0; FRAME_BYTES]).expect("fits"));
    }
}

/// The line to a board; the test keeps another hold of it.
pub(crate) struct Line(pub(crate) Rc<RefCell<Simulated>>);

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
        let bytes = self.0.borrow_mut().give(buffer.len());
        buffer[..bytes.len()].copy_from_slice(&bytes);
        if bytes.is_empty() { Err(Error::from(ErrorKind::TimedOut)) } else { Ok(bytes.len()) }
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> IoResult<usize> {
        self.0.borrow_mut().take(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> IoResult<()> {
        Ok(())
    }
}
