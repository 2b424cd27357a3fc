//! How fast the controller made for a rig file lets a chamber's pressure move.

use control::{AdcCode, Config, ControllerState, Inputs, Parameters, Position};
use plant_model::{Simulator, Stepper, Tolerance};
use rig_files::RigFile;
use rig_files::controller::parameters;

/// The controller armed, as a check of readings alone: what it drives the valve to is not used.
struct Checked {
    config: Config,
    state: ControllerState,
    rig: RigFile,
    supply_pa: f64,
}

impl Checked {
    fn new(rig: RigFile, noise_pa: f32) -> Self {
        let p = Parameters { pressure_noise_pa: noise_pa, ..parameters(&rig) };
        let config = Config::from_parameters(&p).expect("the paper's rigs are valid");
        Self { config, state: ControllerState::armed(), supply_pa: rig.rig.supply.pressure_pa, rig }
    }

    /// One tick; whether the pressures of A and B are believed.
    fn believes(&mut self, y_m: f64, pressures_pa: [f64; 2]) -> [bool; 2] {
        let pressure = self.rig.io.pressure();
        let codes = pressures_pa.map(|p| pressure.code(p));
        let [pressure_a, pressure_b] = codes.map(|code| AdcCode(code as u16));
        let inputs = Inputs {
            reference: Position::saturating_from_num(y_m),
            position: AdcCode(self.rig.io.position().code(y_m) as u16),
            pressure_a,
            pressure_b,
            supply: Some(AdcCode(pressure.code(self.supply_pa) as u16)),
            ..Inputs::default()
        };
        let seen = control::step(&self.config, &mut self.state, inputs).telemetry;
        let read = [seen.pressure_a, seen.pressure_b].map(|p| p.to_num::<f64>());
        [0, 1].map(|n| (read[n] - pressure.quantity(codes[n])).abs() < 1.0)
    }
}

/// The largest step of A and of B that is believed, Pa.
fn largest_steps(rig: &RigFile, y_m: f64, noise_pa: f32) -> [f64; 2] {
    [0, 1].map(|n| {
        let believed = |step_pa: f64| {
            let mut checked = Checked::new(rig.clone(), noise_pa);
            let mut pressures = [3.0e5; 2];
            assert_eq!(checked.believes(y_m, pressures), [true; 2]);
            pressures[n] += step_pa;
            checked.believes(y_m, pressures)[n]
        };
        let (mut low, mut high) = (0.0, 6.0e5);
        while high - low > 1.0 {
            let middle = 0.5 * (low + high);
            if believed(middle) { low = middle } else { high = middle }
        }
        low
    })
}

#[test]
fn a_step_is_believed_up_to_twice_what_the_widest_valve_makes_in_the_chambers_volume() {
    // n R T beta_exh (pi/2) (p_sup - p_atm), by hand: 1.4 * 84091 J/kg * 8.98105e-9 kg/(s Pa) * 1.570796 * 6e5 Pa = 996.5 W.
    let widest_w = 996.5;
    let [a, b, c] = [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()];
    // Volumes of A and B in m3, by V_0 ± A y.
    for (rig, y_m, volumes_m3) in [
        (&a, 0.0, [2.5e-4, 2.5e-4]),
        (&a, 0.3, [3.973e-4, 1.027e-4]),
        (&a, -0.4, [0.536e-4, 4.464e-4]),
        (&b, 0.0, [1.4e-3, 1.4e-3]),
        (&b, -0.2, [0.84e-3, 1.96e-3]),
        (&c, 0.05, [3.9e-4, 1.1e-4]),
    ] {
        let found = largest_steps(rig, y_m, 10.0e3);
        for (found_pa, volume_m3) in found.into_iter().zip(volumes_m3) {
            let expected_pa = 10.0e3 + 2.0 * widest_w / volume_m3 * 1.0e-3;
            // Two codes of the pressure, and the length's bits that the step drops.
            let allowed_pa = 31.0 + 0.01 * expected_pa;
            assert!((found_pa - expected_pa).abs() < allowed_pa, "{y_m} m: {found_pa} for {expected_pa} Pa");
        }
    }
}

#[test]
fn where_a_chamber_ends_and_under_the_papers_law_the_rate_that_is_set_bounds_a_step() {
    let set_pa = f64::from(Parameters::default().pressure_rate_pa_per_s) * 1.0e-3;
    for (rig, y_m, side) in
        [(RigFile::paper_a(), -0.5, 0), (RigFile::paper_b(), 0.5, 1), (RigFile::paper_c(), 0.0873, 1)]
    {
        let found_pa = largest_steps(&rig, y_m, 0.0)[side];
        assert!((found_pa - set_pa).abs() < 31.0, "{y_m} m: {found_pa} Pa");
    }
    let rig = RigFile::paper_a();
    let p = rig_files::controller::papers_parameters(&rig);
    let mut checked = Checked::new(rig, 0.0);
    checked.config = Config::from_parameters(&Parameters { pressure_noise_pa: 0.0, ..p }).expect("valid");
    assert_eq!(checked.believes(0.0, [3.0e5; 2]), [true; 2]);
    assert_eq!(checked.believes(0.0, [3.0e5 + 0.99 * set_pa, 3.0e5 + 1.01 * set_pa]), [true, false]);
}

/// From stop to stop, with a tenth more flow than the rig file says.
#[test]
fn no_pressure_of_a_rig_is_doubted_while_the_valve_swings_wide_open_and_the_piston_strikes_its_stops() {
    for (mut rig, stroke_m) in [(RigFile::paper_a(), 1.0), (RigFile::paper_b(), 1.0), (RigFile::paper_c(), 0.1746)] {
        // A piston that strikes its stop compresses beyond the paper's sensors.
        rig.io.pressure_range_pa = [0.0, 3.0e6];
        let mut plant_rig = rig.rig;
        plant_rig.valve.fill_coefficient_kg_per_s_pa *= 1.1;
        plant_rig.valve.exhaust_coefficient_kg_per_s_pa *= 1.1;
        let mut plant = Simulator::<f64>::new(&plant_rig, &rig.effects).expect("a valid rig");
        let mut checked = Checked::new(rig, 0.0);
        let (mut ends, mut fastest_pa) = ([false; 2], 0.0_f64);
        let mut last = plant.measure();
        for tick in 0..60_000_u32 {
            // Half periods of 0.1 to 3 s.
            let half_ticks = 100 + 29 * (tick / 6000 * 10);
            let wide = if tick / half_ticks % 2 == 0 { 5.0 } else { -5.0 };
            plant.advance(wide, 1.0e-3);
            let now = plant.measure();
            assert_eq!(
                checked.believes(now.y_m, [now.p_a_pa, now.p_b_pa]),
                [true; 2],
                "tick {tick}: {now:?} after {last:?}"
            );
            ends = [ends[0] || now.y_m < -0.499 * stroke_m, ends[1] || now.y_m > 0.499 * stroke_m];
            fastest_pa = fastest_pa.max((now.p_a_pa - last.p_a_pa).abs());
            last = now;
        }
        println!("{fastest_pa:.0} Pa in a tick");
        assert_eq!(ends, [true; 2], "the piston never strikes both stops");
        assert!(fastest_pa > 10.0e3, "{fastest_pa} Pa in a tick: no test");
    }
}

#[test]
fn a_full_chamber_that_is_emptied_at_its_end_is_believed() {
    for (rig, end_m) in [(RigFile::paper_a(), -0.5), (RigFile::paper_b(), -0.5), (RigFile::paper_c(), -0.0873)] {
        let plant = plant_model::Plant::new(&rig.rig, &rig.effects).expect("a valid rig");
        let supply_pa = rig.rig.supply.pressure_pa;
        // The piston rests at the end of A; what B holds keeps it there.
        let full = plant.state_at_rest(end_m, supply_pa, 7.2e5);
        let mut simulator = Simulator::<f64>::from_state(plant, full, Stepper::adaptive(&Tolerance::standard()));
        let mut checked = Checked::new(rig, 0.0);
        let mut last_pa = supply_pa;
        let mut fastest_pa = 0.0_f64;
        for tick in 0..100 {
            let now = simulator.measure();
            assert!(
                checked.believes(now.y_m, [now.p_a_pa, now.p_b_pa])[0],
                "tick {tick}: {} Pa after {last_pa}",
                now.p_a_pa
            );
            fastest_pa = fastest_pa.max(last_pa - now.p_a_pa);
            last_pa = now.p_a_pa;
            simulator.advance(-5.0, 1.0e-3);
        }
        println!("{end_m} m: {fastest_pa:.0} Pa in a tick");
        assert!(fastest_pa > 20.0e3, "{fastest_pa} Pa in a tick: no test");
    }
}
