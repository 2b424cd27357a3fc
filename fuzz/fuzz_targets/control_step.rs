#![no_main]
//! Any numbers as configuration, then any codes, commands and faults: no panic, no DAC code out of range, and nothing but
//! run moves the valve. `control/tests/any_input.rs` is the same property under proptest.
use control::{
    AdcCode, Config, ControllerState, ExternalFaults, Inputs, LawChoice, Mode, OperatorCommand, Parameters, Position, learn, step,
};
use libfuzzer_sys::fuzz_target;

/// Reads the fuzzer's bytes from the front; zero when they run out.
struct Bytes<'b>(&'b [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let n = N.min(self.0.len());
        taken[..n].copy_from_slice(&self.0[..n]);
        self.0 = &self.0[n..];
        taken
    }
    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }
    fn code(&mut self) -> AdcCode {
        AdcCode(u16::from_le_bytes(self.take()))
    }
    /// A default, or in one of four cases any f32 at all.
    fn number(&mut self, default: f32) -> f32 {
        if self.byte() & 3 == 0 { f32::from_le_bytes(self.take()) } else { default }
    }
    fn option(&mut self, default: f32) -> Option<f32> {
        (self.byte() & 1 == 0).then(|| self.number(default))
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = Bytes(bytes);
    let d = Parameters::default();
    let p = Parameters {
        position_range_m: d.position_range_m.map(|x| bytes.number(x)),
        pressure_range_pa: d.pressure_range_pa.map(|x| bytes.number(x)),
        position_offset_m: bytes.number(0.0),
        position_gain: bytes.number(1.0),
        pressure_b_offset_pa: bytes.number(0.0),
        supply_gain: bytes.number(1.0),
        adc_bits: 8 + bytes.byte() % 10,
        valve_range_v: d.valve_range_v.map(|x| bytes.number(x)),
        dac_bits: 8 + bytes.byte() % 10,
        tick_hz: u32::from_le_bytes(bytes.take()) % 21_000,
        gain_v_per_m: bytes.number(d.gain_v_per_m),
        setpoint_velocity_m_per_s: bytes.option(0.5),
        setpoint_acceleration_m_per_s2: bytes.option(5.0),
        dead_zone_right_v: bytes.number(0.4),
        dead_zone_left_v: bytes.number(-0.4),
        slope_right: bytes.number(1.0),
        slope_left: bytes.number(1.0),
        dead_zone_blend_v: bytes.option(0.01),
        max_voltage_v: bytes.number(5.0),
        safe_voltage_v: bytes.option(0.0),
        position_margin_m: bytes.number(0.0),
        position_rate_m_per_s: bytes.number(3.0),
        pressure_rate_pa_per_s: bytes.number(d.pressure_rate_pa_per_s),
        glitch_time_s: bytes.number(0.005),
        stuck_time_s: bytes.number(0.015),
        timing_fault_ticks: bytes.byte(),
        self_test_time_s: bytes.number(0.01),
        command_time_out_s: bytes.option(0.1),
        stop_time_s: bytes.number(0.1),
        law: if bytes.byte() & 1 == 0 { LawChoice::Paper } else { LawChoice::Servo },
        ..d
    };
    let Ok(config) = Config::from_parameters(&p) else { return };
    let mut state = if bytes.byte() & 1 == 0 { ControllerState::armed() } else { ControllerState::boot(None) };
    while !bytes.0.is_empty() {
        let flags = bytes.byte();
        let inputs = Inputs {
            reference: Position::from_bits(i32::from_le_bytes(bytes.take())),
            position: bytes.code(),
            pressure_a: bytes.code(),
            pressure_b: bytes.code(),
            supply: (flags & 1 == 0).then(|| bytes.code()),
            command: [
                None,
                None,
                None,
                None,
                None,
                Some(OperatorCommand::Arm),
                Some(OperatorCommand::Disarm),
                Some(OperatorCommand::ResetFault),
            ][usize::from(flags >> 1 & 7)],
            host_heard: flags & 16 == 0,
            faults: ExternalFaults {
                missed_ticks: flags >> 5 & 1,
                late_tick: flags & 64 != 0,
                overrun: flags & 128 != 0,
                model_disagreement: false,
                contradicts: None,
                valve_output: false,
            },
        };
        for _ in 0..1 + bytes.byte() % 64 {
            let outputs = step(&config, &mut state, inputs);
            learn(&config, &mut state);
            assert!(outputs.dac <= config.dac_scale().max_code());
            assert!(outputs.mode == Mode::Run || state.stopping() || outputs.dac == config.safe_code());
        }
    }
});
