//! The controlled stop outside the control law: air output, records, and a configuration that arrives meanwhile.

use control::{ControllerState, ExternalFaults, LawChoice, Mode, Parameters, Position, Reason};
use firmware_core::{ControlLoop, LoopTick, Order, STOPPING, Settings, Setup, mode_from_number, mode_number};

fn setup() -> Setup {
    Setup::new(&Parameters { law: LawChoice::Servo, ..Parameters::default() }, None, 1000).expect("valid")
}

/// Chamber A has more force than B; the target is ahead.
fn tick(control_loop: &mut ControlLoop, late_tick: bool) -> LoopTick {
    control_loop.hold(Position::from_num(0.1));
    let faults = ExternalFaults { late_tick, ..ExternalFaults::default() };
    let tick = control_loop.tick([32_768, 30_000, 23_700, 45_875], faults, true);
    control_loop.conclude();
    tick
}

/// A loop in the first tick of a stop, and that tick.
fn stopped() -> (ControlLoop, LoopTick) {
    let mut control_loop = ControlLoop::in_state(setup(), ControllerState::armed());
    for _ in 0..400 {
        tick(&mut control_loop, false);
    }
    assert_eq!((control_loop.mode(), control_loop.air_allowed()), (Mode::Run, true));
    loop {
        let tick = tick(&mut control_loop, true);
        if control_loop.mode() != Mode::Run {
            return (control_loop, tick);
        }
    }
}

#[test]
fn air_and_valve_end_in_the_same_tick_and_a_record_tells_the_beginning_and_the_end() {
    let (mut control_loop, mut last) = stopped();
    let reason = Mode::Safe(Reason::LateTick);
    let [stopping, safe] = [mode_number(reason) | STOPPING, mode_number(reason)];
    let mut events = Vec::new();
    for n in 0..300 {
        assert_eq!(control_loop.mode(), reason);
        assert_eq!(mode_from_number(last.record.mode), Some(reason), "the reason, whatever the valve does");
        let moves = last.valve != control_loop.safe_code();
        assert_eq!((moves, control_loop.air_allowed()), (n < 100, n < 100), "{n} ticks after the trip");
        if last.record.event {
            assert!(last.record_due);
            events.push((n, last.record.mode));
        }
        last = tick(&mut control_loop, false);
    }
    assert_eq!(events, [(0, stopping), (100, safe)]);
}

#[test]
fn in_bench_mode_the_real_valve_stands_and_no_air_is_let_to_it() {
    let mut control_loop = ControlLoop::new(setup(), None);
    control_loop.order(&Order::BenchOn(Settings::default().bench_plant().expect("a physical rig")));
    let mut stops = false;
    for n in 0..2000_u32 {
        if control_loop.mode() == Mode::Idle {
            control_loop.order(&Order::Command(control::OperatorCommand::Arm));
        }
        let tick = tick(&mut control_loop, n > 250);
        stops |= control_loop.state().stopping();
        assert_eq!((tick.valve, control_loop.air_allowed()), (control_loop.safe_code(), false));
    }
    assert!(stops, "the simulated valve goes through the stop");
}

#[test]
fn parameters_a_reset_of_the_chip_and_bench_mode_end_the_stop_at_once() {
    let orders: [fn(&mut ControlLoop); 3] = [
        |control_loop| control_loop.order(&Order::Configure(setup())),
        |control_loop| control_loop.reboot(Reason::WatchdogReset),
        |control_loop| control_loop.order(&Order::BenchOff),
    ];
    for order in orders {
        let (mut control_loop, _) = stopped();
        order(&mut control_loop);
        assert!(!control_loop.air_allowed());
        for _ in 0..200 {
            assert_eq!(tick(&mut control_loop, false).valve, control_loop.safe_code());
            assert!(!control_loop.air_allowed() && matches!(control_loop.mode(), Mode::Safe(_)));
        }
    }
}
