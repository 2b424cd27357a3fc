//! Watchdog and light. The decision is `firmware_core::Supervisor`'s; here is what it needs and what it moves.

use core::sync::atomic::Ordering;

use control::Mode;
use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Ticker};
use firmware_core::{Progress, Supervisor, Verdict};

use crate::sampling::{CONTROLLED, SAMPLED, SNAPSHOT};
use crate::{board, commands, faults};

/// A quarter of the watchdog's period: three rounds may fail before it bites.
const ROUND: Duration = Duration::from_millis(5);

/// Feeds the watchdog while everything moves on.
#[embassy_executor::task]
pub(crate) async fn supervisor_task(mut light: Output<'static>) -> ! {
    let mut supervisor = Supervisor::default();
    let mut round = Ticker::every(ROUND);
    let mut rounds = 0_u32;
    loop {
        round.next().await;
        let progress = Progress {
            sampling: SAMPLED.load(Ordering::Relaxed),
            control: CONTROLLED.load(Ordering::Relaxed),
            communication: commands::background_rounds(),
        };
        match supervisor.check(progress) {
            Verdict::Feed => board::feed_watchdog(),
            Verdict::Wait => {}
            Verdict::LoopDead => faults::wait_for_the_watchdog(),
        }
        rounds = rounds.wrapping_add(1);
        // Steady while running, slow while idle, fast while safe: told apart from across the room.
        let on = match SNAPSHOT.mode() {
            Mode::Run => true,
            Mode::Safe(_) => rounds & 16 != 0,
            Mode::Boot | Mode::SelfTest { .. } | Mode::Idle => rounds & 128 != 0,
        };
        light.set_level(on.into());
    }
}
