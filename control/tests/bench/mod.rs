//! A controller with healthy sensors that a test can spoil one by one.
#![allow(dead_code, unreachable_pub)]

use control::{AdcCode, Config, ControllerState, Inputs, Mode, OperatorCommand, Outputs, Parameters, Position, step};

/// Codes of a resting piston at mid-stroke, 3.6 bar in the chambers, 7 bar supply, with noise of a chosen width.
pub struct Bench {
    pub config: Config,
    pub state: ControllerState,
    pub inputs: Inputs,
    pub noise_codes: u32,
    random: u32,
}

impl Bench {
    pub fn new(parameters: &Parameters, state: ControllerState) -> Self {
        let inputs = Inputs {
            reference: Position::from_num(0.1),
            position: AdcCode(32_768),
            pressure_a: AdcCode(23_700),
            pressure_b: AdcCode(23_700),
            supply: Some(AdcCode(45_875)),
            host_heard: true,
            ..Inputs::default()
        };
        Self { config: Config::from_parameters(parameters).unwrap(), state, inputs, noise_codes: 0, random: 1 }
    }

    pub fn armed() -> Self {
        Self::new(&Parameters::default(), ControllerState::armed())
    }

    pub fn noisy(mut self, codes: u32) -> Self {
        self.noise_codes = codes;
        self
    }

    fn noise(&mut self, code: AdcCode) -> AdcCode {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        let offset = self.random % (2 * self.noise_codes + 1);
        AdcCode((u32::from(code.0) + offset).saturating_sub(self.noise_codes).min(65_535) as u16)
    }

    /// One tick with noise on every channel, after `spoil` had its way.
    pub fn tick(&mut self, spoil: impl FnOnce(&mut Inputs)) -> Outputs {
        let mut inputs = self.inputs;
        inputs.position = self.noise(inputs.position);
        inputs.pressure_a = self.noise(inputs.pressure_a);
        inputs.pressure_b = self.noise(inputs.pressure_b);
        inputs.supply = inputs.supply.map(|code| self.noise(code));
        spoil(&mut inputs);
        step(&self.config, &mut self.state, inputs)
    }

    /// Healthy ticks.
    pub fn run(&mut self, ticks: usize) -> Mode {
        for _ in 0..ticks {
            self.tick(|_| ());
        }
        self.state.mode()
    }

    pub fn command(&mut self, command: OperatorCommand) -> Mode {
        self.tick(|inputs| inputs.command = Some(command)).mode
    }

    /// Spoils every tick until the mode is safe; the number of ticks it took and the mode's word.
    pub fn until_safe(&mut self, limit: usize, mut spoil: impl FnMut(usize, &mut Inputs)) -> (usize, String) {
        for n in 0..limit {
            let outputs = self.tick(|inputs| spoil(n, inputs));
            if let Mode::Safe(_) = outputs.mode {
                assert_eq!(outputs.dac, self.config.safe_code());
                return (n + 1, outputs.mode.to_string());
            }
        }
        (usize::MAX, self.state.mode().to_string())
    }
}
