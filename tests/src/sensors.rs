//! Truth → codes with faults; noise and quantisation are those of the simulated closed loop.

use crate::fault::{Fault, Kind};
use control::Channel;
use plant_model::Measurement;
use plant_sim::CodeNoise;
use plant_sim::sensors::{SensorChannel, channels, quantities};
use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rig_files::Io;
use std::collections::VecDeque;

/// The four channels with what may be wrong with them.
pub(crate) struct FaultySensors {
    channels: [SensorChannel; 4],
    random: SmallRng,
    last: [u16; 4],
    lagged: [Option<f64>; 4],
    past: VecDeque<[f64; 4]>,
    depth: usize,
    tick_s: f64,
}

impl FaultySensors {
    pub(crate) fn new(io: &Io, noise: &CodeNoise, seed: u64, faults: &[Fault]) -> Self {
        let tick_s = io.tick_s();
        let longest = faults.iter().filter(|f| f.kind == Kind::Delayed).map(|f| f.delay_s).fold(0.0, f64::max);
        Self {
            channels: channels(io, noise),
            random: SmallRng::seed_from_u64(seed),
            last: [0; 4],
            lagged: [None; 4],
            past: VecDeque::new(),
            depth: (longest / tick_s).ceil() as usize + 1,
            tick_s,
        }
    }

    /// The codes of this tick.
    pub(crate) fn codes(&mut self, truth: &Measurement<f64>, t_s: f64, faults: &[Fault]) -> [u16; 4] {
        let truth = quantities(truth);
        self.past.push_front(truth);
        self.past.truncate(self.depth);
        let mut codes = [0; 4];
        for (index, channel) in Channel::ALL.into_iter().enumerate() {
            // Noise is drawn in every tick and for every channel, so that a fault does not change the others' noise.
            let gauss: f64 = StandardNormal.sample(&mut self.random);
            let random: u16 = self.random.random();
            let chance: f64 = self.random.random();
            let mut value = truth[index];
            let mut code = None;
            for fault in faults.iter().filter(|fault| fault.channel == Some(channel)) {
                if !fault.active(t_s) {
                    continue;
                }
                match fault.kind {
                    Kind::Off => code = Some(0),
                    Kind::Shorted => code = Some(self.channels[index].top_code()),
                    Kind::Stuck => code = Some(self.last[index]),
                    Kind::Garbage => code = Some(random & self.channels[index].top_code()),
                    Kind::Scale => value *= fault.factor,
                    Kind::Drift => value += fault.per_second * (t_s - fault.at_s),
                    Kind::Slow => {
                        let lagged = self.lagged[index].get_or_insert(value);
                        *lagged += (value - *lagged) * (self.tick_s / (self.tick_s + fault.time_constant_s));
                        value = *lagged;
                    }
                    Kind::Delayed => {
                        let age = (fault.delay_s / self.tick_s).round() as usize;
                        if let Some(earlier) = self.past.get(age).or(self.past.back()) {
                            value = earlier[index];
                        }
                    }
                    Kind::Intermittent if chance < fault.probability => code = Some(0),
                    _ => (),
                }
            }
            codes[index] = code.unwrap_or(self.channels[index].code(value, gauss));
        }
        self.last = codes;
        codes
    }
}
