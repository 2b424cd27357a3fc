//! The command task: bytes of the virtual COM port ↔ requests, orders for the loop, parameters in flash.

use core::future::Future;
use core::pin::pin;
use core::sync::atomic::{AtomicU32, Ordering};

use board_link::{Accumulator, Admission, FRAME_BYTES, Refusal, Reply, Request, Response, Session, encode};
use cortex_m::peripheral::DWT;
use embassy_stm32::usart::{BufferedUart, BufferedUartRx, BufferedUartTx};
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use firmware_core::{Action, Desk, Kept, Order, OrderOutcome, Scales};

use crate::broken::{self, Fault};
use crate::ring::Writer;
use crate::sampling::{HOST_HEARD, ORDERS, SNAPSHOT};
use crate::storage::{self, Store};
use crate::{board, bootloader, telemetry};

/// Rounds of this task; wraps. It goes round without a host, too.
pub(crate) static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// Longest wait for bytes in one round, so that the rounds tell the supervisor that the task is alive.
const ROUND: Duration = Duration::from_millis(2);
/// Longest wait for the loop to take an order: it takes one per tick.
const ORDER_WAIT_MS: u32 = 10;
/// Rounds that the line has for taking an answer. The buffer ahead of it, 256 bytes, is empty after 22 ms at 115 200 baud.
const SEND_ROUNDS: u32 = 15;
/// Rounds that a save has: one erased page (22 ms, 25 ms at most) and some 40 double words of 82 us.
const SAVE_ROUNDS: u32 = 50;
/// Rounds until a restart: what is still in the buffer leaves the line.
const RESTART_ROUNDS: u32 = 15;

/// Everything the task owns.
pub(crate) struct CommandTask {
    /// Commands and their meaning.
    pub(crate) desk: Desk,
    /// Way to the loop.
    pub(crate) orders: Writer<Order, ORDERS>,
    /// Parameters in flash.
    pub(crate) store: Option<Store>,
}

/// Serves the virtual COM port.
#[embassy_executor::task]
pub(crate) async fn command_task(mut task: CommandTask, serial: BufferedUart<'static>) -> ! {
    let (mut transmit, mut receive): (BufferedUartTx<'static>, BufferedUartRx<'static>) = serial.split();
    let mut accumulator = Accumulator::new();
    let mut session = Session::new();
    let mut bad_frames = 0_u32;
    loop {
        alive();
        let mut bytes = [0; 32];
        let count = match with_timeout(ROUND, receive.read(&mut bytes)).await {
            Ok(Ok(count)) => count,
            // A line error: what was half received is worthless, and the frame's check would find out anyway.
            Ok(Err(_)) | Err(_) => continue,
        };
        for byte in bytes.iter().take(count) {
            match accumulator.push::<Request>(*byte) {
                None => {}
                Some(Err(_)) => bad_frames = bad_frames.wrapping_add(1),
                Some(Ok(request)) => {
                    let answer = match session.admit(&request, DWT::cycle_count()) {
                        Admission::Answer(answer) => answer,
                        Admission::Execute(command) => {
                            let decision = task.desk.decide(command, &SNAPSHOT, bad_frames);
                            let restart: Option<fn() -> !> = match decision {
                                Ok(Action::Restart) => Some(board::reset),
                                Ok(Action::Bootloader) => Some(bootloader::restart_into),
                                _ => None,
                            };
                            let result = task.carry_out(decision).await;
                            // A frame that is foreign, repeated or refused does not show that the host is in its right mind.
                            if result.is_ok() {
                                HOST_HEARD.store(true, Ordering::Relaxed);
                            }
                            let answer = session.answered(result);
                            if let Some(restart) = restart {
                                send(&mut transmit, &answer).await;
                                let _ = within(RESTART_ROUNDS, core::future::pending::<()>()).await;
                                restart();
                            }
                            answer
                        }
                    };
                    send(&mut transmit, &answer).await;
                }
            }
        }
    }
}

fn alive() {
    ROUNDS.store(ROUNDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// Waits for something that takes longer than a round, for so many rounds at most, and counts them: the supervisor would take a
/// task that waits in silence for dead, and one that waits for ever is.
async fn within<F: Future>(rounds: u32, future: F) -> Option<F::Output> {
    let mut future = pin!(future);
    for _ in 0..rounds {
        alive();
        if let Ok(output) = with_timeout(ROUND, future.as_mut()).await {
            return Some(output);
        }
    }
    None
}

async fn send(transmit: &mut BufferedUartTx<'static>, answer: &Response) {
    let mut buffer = [0; FRAME_BYTES];
    if let Ok(frame) = encode(answer, &mut buffer) {
        // The driver takes a frame as a whole or waits, without being woken when there is room: a new look in every round.
        // The host asks again if an answer is lost.
        let _ = within(SEND_ROUNDS, transmit.write_all(frame)).await;
    }
}

impl CommandTask {
    async fn carry_out(&mut self, decision: Result<Action, Refusal>) -> Result<Reply, Refusal> {
        match decision? {
            Action::Reply(reply) => Ok(reply),
            Action::Restart | Action::Bootloader => Ok(Reply::Done),
            Action::Samples => Ok(Reply::Samples(telemetry::RECENT.lock(|recent| recent.borrow_mut().take()))),
            Action::Order(order, outcome) => self.order(order, outcome).await,
            Action::Save => self.save(None).await,
            Action::Keep(kept) => self.save(Some(kept)).await,
        }
    }

    /// Writes all parameters, and `kept`, if given, in place of what was kept before.
    async fn save(&mut self, kept: Option<Option<Kept>>) -> Result<Reply, Refusal> {
        let store = self.store.as_mut().filter(|_| storage::two_banks()).ok_or(Refusal::Storage)?;
        let before = kept.map(|kept| self.desk.keep(kept));
        let saving = store.save(self.desk.settings());
        let saved = if broken::is(Fault::UnfedSave) { Some(saving.await) } else { within(SAVE_ROUNDS, saving).await };
        match (saved.and_then(Result::ok), before) {
            (Some(()), _) => {
                defmt::info!("parameters saved");
                Ok(Reply::Done)
            }
            (None, before) => {
                if let Some(before) = before {
                    self.desk.keep(before);
                }
                Err(Refusal::Storage)
            }
        }
    }

    async fn order(&mut self, order: Order, outcome: OrderOutcome) -> Result<Reply, Refusal> {
        let configured = matches!(order, Order::Configure(_));
        self.orders.enqueue(order).map_err(|_| Refusal::Busy)?;
        let before = SNAPSHOT.ticks();
        for _ in 0..ORDER_WAIT_MS {
            alive();
            Timer::after_millis(1).await;
            // Taken at the end of a tick, in force in the next one, and what comes of it is seen in the one behind that.
            if self.orders.is_empty() && SNAPSHOT.ticks().wrapping_sub(before) >= 3 {
                if configured {
                    telemetry::NEW_SCALES.signal(Scales::of(&self.desk.in_force()));
                }
                return if outcome.shown_by(SNAPSHOT.mode()) { Ok(Reply::Done) } else { Err(Refusal::State) };
            }
        }
        Err(Refusal::Busy)
    }
}

/// Rounds of both background tasks, for the supervisor.
pub(crate) fn background_rounds() -> [u32; 2] {
    [ROUNDS.load(Ordering::Relaxed), telemetry::ROUNDS.load(Ordering::Relaxed)]
}
