//! The table of positioning goals, measured with the law in f64 on the simulated rig:
//! `cargo run --release -p plant-sim --example positioning [abc] [tick] [draws=200] [first=0] [moves=0]
//! [streams=0] [loads=0] [ends=0] [obstacles=0] [sines=0] [sine_hz=0.5]
//! [sent_ms=0] [sent_um=0] [sent_noise_um=0] [noise=1] [friction=1] [stiff=1] [valve_ms=0] [pressures_ms=0] [draws_mm=45] [hz=1000] [lost=0] [trace=45] [NAME=VALUE …]`. Constants were chosen on the first 20 seeds and 200 draws; `first=1000` measures on others.
//!
//! Set-up: valve lag 1.7 ms, dead zone ±0.42 V, noise of a code 20 um and 400 Pa, 16-bit codes over the stroke, 12-bit
//! DAC over ±5 V, 1 kHz, output one tick late.

use plant_model::Rig;
use plant_sim::servo::Tuning;
use plant_sim::servo::bench::{Driver, Lost, Move, Sent, sine, step};
use plant_sim::servo::trials::{
    Obstructed, Wave, bench, loaded_moves, obstructed, pushed, random_moves, stream, with_friction,
};
use rayon::prelude::*;

const LAG_S: f64 = 1.7e-3;
const ZONE_V: f64 = 0.42;
/// What can be given: the study, then constants of the law, most as a factor.
const NAMES: &str = "seeds draws draws_mm first noise friction stiff valve_ms pressures_ms bs hz lost moves loads ends obstacles streams sines sine_hz sent_ms sent_um sent_noise_um list trace seed drawn ticks every \
                     w wo J A V fr blend sg sf sv st he hl hs hf hb hm jt fc0 ul lg lz lf sr sm sn";

fn nominal(case: char) -> (Rig<f64>, f64) {
    let (mut rig, longest) = match case {
        'a' => (Rig::paper_a(), 0.3),
        'b' => (Rig::paper_b(), 0.2),
        _ => (Rig::paper_c(), 0.01),
    };
    rig.valve.dead_zone_right_v = ZONE_V;
    rig.valve.dead_zone_left_v = -ZONE_V;
    (rig, longest)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    for argument in &arguments {
        let known = match argument.split_once('=') {
            Some((name, number)) => {
                NAMES.split_whitespace().any(|known| known == name) && number.parse::<f64>().is_ok()
            }
            None => argument == "tick" || argument.chars().all(|case| "abc".contains(case)),
        };
        if !known {
            eprintln!("`{argument}` is not known; there are cases (`abc`), `tick`, and `NAME=NUMBER` of: {NAMES}");
            std::process::exit(2);
        }
    }
    let value =
        |name: &str| arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('=')?.parse::<f64>().ok());
    let in_tick = arguments.iter().any(|a| a == "tick");
    let cases = arguments.iter().find(|a| !a.contains('=') && *a != "tick").map_or("abc", String::as_str);
    let seeds = value("seeds").unwrap_or(20.0) as u64;
    let draws = value("draws").unwrap_or(200.0) as u64;
    let first = value("first").unwrap_or(0.0) as u64;
    let noise = value("noise").unwrap_or(1.0);
    let tick_s = 1.0 / value("hz").unwrap_or(1000.0);
    let lost = [Lost::None, Lost::A, Lost::Both][value("lost").unwrap_or(0.0) as usize % 3];
    for case in cases.chars() {
        let (rig, longest) = nominal(case);
        let mut tuning = Tuning::of(&rig, LAG_S, tick_s);
        // What the law takes for the rig, and what it is.
        let mut actual = rig;
        actual.friction = with_friction(&rig, value("friction").unwrap_or(1.0)).friction;
        let stiff = value("stiff").unwrap_or(1.0);
        actual.friction.stiffness_n_per_m *= stiff;
        actual.friction.breakaway_m /= stiff;
        tuning.bristle_stiffness *= value("bs").unwrap_or(1.0);
        for (name, place) in [
            ("w", &mut tuning.law_w),
            ("wo", &mut tuning.observer_w),
            ("J", &mut tuning.limits.jerk),
            ("A", &mut tuning.limits.acceleration),
            ("V", &mut tuning.limits.speed),
            ("fr", &mut tuning.force_rate),
            ("blend", &mut tuning.blend),
            ("sg", &mut tuning.stick_gain),
            ("sf", &mut tuning.stick_force_rate),
            ("sv", &mut tuning.stick_speed),
            ("he", &mut tuning.hold_m[0]),
            ("hs", &mut tuning.hold_speed),
            ("hf", &mut tuning.hold_force),
            ("hb", &mut tuning.hold_band),
            ("hm", &mut tuning.hold_margin),
            ("sr", &mut tuning.stall_rate),
            ("sm", &mut tuning.stall_force),
        ] {
            *place *= value(name).unwrap_or(1.0);
        }
        tuning.hold_m[1] *= value("hl").unwrap_or(1.0);
        tuning.coast_ticks = value("jt").map_or(tuning.coast_ticks, |ticks| ticks as u32);
        tuning.stick_ticks = value("st").map_or(tuning.stick_ticks, |ticks| ticks as u32);
        tuning.coulomb_start = value("fc0").unwrap_or(tuning.coulomb_start);
        tuning.stall_ticks = value("sn").map_or(tuning.stall_ticks, |ticks| ticks as u32);
        tuning.unlearn = value("ul").unwrap_or(tuning.unlearn);
        for (name, rate) in ["lg", "lz", "lf"].into_iter().zip(&mut tuning.learn) {
            *rate = value(name).unwrap_or(*rate);
        }
        let on = |drawn: bool, seed: u64| {
            let late = ["valve_ms", "pressures_ms"].map(|name| 1e-3 * value(name).unwrap_or(0.0));
            let bench = bench(&rig, &actual, tuning, drawn, noise, seed, lost).late(late[0], late[1]);
            if in_tick { bench.with_tick(Driver::Tick) } else { bench }
        };
        let ticks = (2.5 / tick_s) as u32;
        println!(
            "case {case}: w {:.1}, V {:.3}, A {:.2}, J {:.1}",
            tuning.law_w, tuning.limits.speed, tuning.limits.acceleration, tuning.limits.jerk
        );
        if let Some(mm) = value("trace") {
            let seed = value("seed").map_or(1, |s| s as u64);
            let mut bench = on(value("drawn").is_some(), seed);
            bench.obstacle(value("obstacles").map(|mm| 1e-3 * mm));
            for tick in 0..value("ticks").unwrap_or(1000.0) as u32 {
                let (y, _) = bench.tick(mm * 1e-3);
                if tick % value("every").unwrap_or(10.0) as u32 == 0 {
                    let (s, e, state) = (&bench.servo, &bench.servo.estimate, bench.state());
                    println!(
                        "{tick:5} y {:9.4} r {:9.4} v {:8.4} v^ {:8.4} vr {:8.4} a^ {:7.2} ar {:7.2} F {:7.2} F^ {:7.2} d {:7.2} z {:6.1} fc {:5.1} g {:4.2} {:4.2} zone {:5.3} {:5.3} codes {:?} {}",
                        y * 1e3,
                        s.motion.y * 1e3,
                        state.v_m_per_s,
                        e.v,
                        s.motion.v,
                        e.a,
                        s.motion.a,
                        rig.cylinder.mean_area_m2() * (state.p_a_pa - state.p_b_pa),
                        e.force,
                        e.disturbance,
                        e.bristle * 1e6,
                        s.body.coulomb,
                        s.valve.gain[0],
                        s.valve.gain[1],
                        s.valve.right,
                        s.valve.left,
                        bench.codes,
                        if s.hold.on { "hold" } else { "" }
                    );
                }
            }
            continue;
        }
        println!(
            "  move mm | settled mean / worst s | overshoot mm | rest error um | peak um | changes, most / moves with any"
        );
        for target in [1e-3, 0.045, longest] {
            let runs: Vec<Move> =
                (first..first + seeds).into_par_iter().map(|seed| step(&mut on(false, seed), target, ticks)).collect();
            let worst = |of: fn(&Move) -> f64| runs.iter().map(of).fold(0.0, f64::max);
            println!(
                "  {:7.0} | {:.3} / {:.3} | {:.3} | {:.0} | {:.1} | {:.0} / {}",
                target * 1e3,
                runs.iter().map(|run| run.settled_s).sum::<f64>() / seeds as f64,
                worst(|run| run.settled_s),
                worst(|run| run.overshoot_m) * 1e3,
                worst(|run| run.rest_error_m) * 1e6,
                worst(|run| run.rest_peak_m) * 1e6,
                worst(|run| f64::from(run.changes)),
                runs.iter().filter(|run| run.changes > 0).count(),
            );
        }
        let sent = Sent {
            every_s: 1e-3 * value("sent_ms").unwrap_or(0.0),
            code_m: 1e-6 * value("sent_um").unwrap_or(0.0),
            noise_m: 1e-6 * value("sent_noise_um").unwrap_or(0.0),
        };
        let amplitude = if case == 'c' { 0.03 } else { 0.05 };
        let (peak, rms) = sine(&mut on(false, 1), amplitude, 0.5, &sent);
        println!("  sine 0.5 Hz, {:.0} mm: peak {:.2} mm, rms {:.2} mm", amplitude * 1e3, peak * 1e3, rms * 1e3);
        let sines = value("sines").unwrap_or(0.0) as u64;
        for drawn in [false, true].into_iter().filter(|_| sines > 0) {
            let mut runs: Vec<(f64, f64)> = (first..first + sines)
                .into_par_iter()
                .map(|seed| sine(&mut on(drawn, seed), amplitude, value("sine_hz").unwrap_or(0.5), &sent))
                .collect();
            runs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mean = |of: fn(&(f64, f64)) -> f64| 1e3 * runs.iter().map(of).sum::<f64>() / sines as f64;
            println!(
                "  the same on {sines} {}: peak mean {:.2} mm, median {:.2} mm, 90th percentile {:.2} mm, worst {:.2} mm; rms {:.2} mm",
                if drawn { "draws" } else { "seeds" },
                mean(|run| run.0),
                runs[runs.len() / 2].0 * 1e3,
                runs[(0.9 * (runs.len() - 1) as f64) as usize].0 * 1e3,
                runs[runs.len() - 1].0 * 1e3,
                mean(|run| run.1),
            );
        }
        let drawn_mm = value("draws_mm").unwrap_or(45.0);
        let runs: Vec<Move> = (first..first + draws)
            .into_par_iter()
            .map(|seed| step(&mut on(true, seed), drawn_mm * 1e-3, ticks))
            .collect();
        if draws > 0 {
            let share = |good: &dyn Fn(&Move) -> bool| {
                100.0 * runs.iter().filter(|run| good(run)).count() as f64 / draws as f64
            };
            let mut over: Vec<f64> = runs.iter().map(|run| run.overshoot_m).collect();
            over.sort_by(f64::total_cmp);
            println!(
                "  {draws} draws of {drawn_mm} mm: stable {:.1} %, within 0.6 s {:.1} %, within 1 s {:.1} %; overshoot 95th percentile {:.2} mm, worst {:.2} mm",
                share(&|run| run.rest_peak_m < 2e-3 && run.furthest_m < 0.09),
                share(&|run| run.settled_s <= 0.6),
                share(&|run| run.settled_s <= 1.0),
                over[(0.95 * (draws - 1) as f64) as usize] * 1e3,
                over[draws as usize - 1] * 1e3,
            );
            if value("list").is_some() {
                for (seed, run) in runs.iter().enumerate().filter(|(_, run)| run.settled_s > 0.6) {
                    let (settled, over, peak) = (run.settled_s, run.overshoot_m * 1e3, run.rest_peak_m * 1e6);
                    println!(
                        "    {}: {settled:.2} s, {over:.2} mm over, {peak:.0} um, {} changes",
                        first + seed as u64,
                        run.changes
                    );
                }
            }
        }
        let moved = value("moves").unwrap_or(0.0) as u64;
        if moved > 0 {
            // The longest move takes about a second.
            let range = match case {
                'a' => 0.15,
                'b' => 0.1,
                _ => 0.07,
            };
            let runs: Vec<_> = (first..first + moved)
                .into_par_iter()
                .map(|seed| {
                    let mut bench = on(true, seed);
                    let run = random_moves(&mut bench, 50, range, seed);
                    if value("list").is_some() {
                        let (servo, (drawn, effects)) = (&bench.servo, plant_sim::servo::trials::draw(&rig, seed));
                        println!(
                            "    {seed}: late {} noisy {} lag {:.1} fc {:.2} vis {:.2} (true {:.2}) gains {:.2?} zones {:.3} {:.3} (true {:.3} {:.3}) M {:.2} (true {:.2}) lag (true {:.1})",
                            run.settled_s.iter().filter(|t| t.is_infinite()).count(),
                            run.changes.iter().filter(|n| **n > 0).count(),
                            servo.lag.seconds * 1e3,
                            servo.body.coulomb / rig.friction.coulomb_n,
                            servo.body.viscous / tuning.viscous,
                            drawn.friction.coulomb_n / rig.friction.coulomb_n,
                            servo.valve.gain,
                            servo.valve.right,
                            servo.valve.left,
                            drawn.valve.dead_zone_right_v,
                            drawn.valve.dead_zone_left_v,
                            servo.body.mass / rig.load.mass_kg,
                            drawn.load.mass_kg / rig.load.mass_kg,
                            effects.get(plant_model::Effect::ValveLag).map_or(0.0, |lag| lag[0] * 1e3),
                        );
                    }
                    run
                })
                .collect();
            let times: Vec<f64> = runs.iter().flat_map(|run| run.settled_s.iter().copied()).collect();
            let late = times.iter().filter(|time| time.is_infinite()).count();
            let whole = runs.iter().filter(|run| run.settled_s.iter().all(|time| time.is_finite())).count();
            // A leak moves the force for ever.
            let tight = |seed: u64| {
                plant_sim::servo::trials::draw(&rig, seed).1.get(plant_model::Effect::LeakChamberA).is_none()
            };
            let silent = |of: &dyn Fn(u64) -> bool| {
                let changes: Vec<u32> = (first..)
                    .zip(&runs)
                    .filter(|(seed, _)| of(*seed))
                    .flat_map(|(_, run)| run.changes.clone())
                    .collect();
                100.0 * changes.iter().filter(|changes| **changes == 0).count() as f64 / changes.len().max(1) as f64
            };
            let within =
                |limit: f64| 100.0 * times.iter().filter(|time| **time <= limit).count() as f64 / times.len() as f64;
            println!(
                "  {moved} draws x 50 random moves: {late} of {} not settled within 2 s, {whole} draws without such; within 0.6 s {:.1} %, within 1 s {:.1} %; valve silent in the last second of {:.1} %, without leaks of {:.1} %",
                times.len(),
                within(0.6),
                within(1.0),
                silent(&|_| true),
                silent(&tight),
            );
        }
        let loads = value("loads").unwrap_or(0.0) as u64;
        let most_n = rig.cylinder.mean_area_m2() * (rig.supply.pressure_pa - rig.supply.atmosphere_pa);
        let parts = [0.02, 0.05, 0.1, 0.2, 0.3, 0.45].into_iter().flat_map(|part| [(part, false), (part, true)]);
        for (part, drawn) in parts.filter(|_| loads > 0) {
            let targets_m = [0.045, 0.035, 0.036, -0.045, -0.035, -0.036, 0.0, 0.001, 0.02];
            let runs: Vec<(Vec<Move>, [Move; 2])> = (first..first + loads)
                .into_par_iter()
                .map(|seed| {
                    let load_n = if seed.is_multiple_of(2) { part * most_n } else { -part * most_n };
                    (loaded_moves(&mut on(drawn, seed).under(load_n), &targets_m), pushed(&mut on(drawn, seed), load_n))
                })
                .collect();
            let moves: Vec<Move> = runs.iter().flat_map(|run| run.0.iter().copied()).collect();
            let pushes: Vec<Move> = runs.iter().flat_map(|run| run.1).collect();
            let drawn = if drawn { ", draws" } else { "" };
            for (what, moves) in [("moves", moves), ("put on and off", pushes)] {
                let share = |good: &dyn Fn(&Move) -> bool| {
                    100.0 * moves.iter().filter(|run| good(run)).count() as f64 / moves.len() as f64
                };
                println!(
                    "  load {:.0} N{drawn}, {what}: within 0.6 s {:.1} %, 1 s {:.1} %, at all {:.1} %; silent {:.1} %; at rest {:.2} mm at most",
                    part * most_n,
                    share(&|run| run.settled_s <= 0.6),
                    share(&|run| run.settled_s <= 1.0),
                    share(&|run| run.settled_s.is_finite()),
                    share(&|run| run.changes == 0),
                    1e3 * moves.iter().map(|run| run.rest_peak_m).fold(0.0, f64::max),
                );
            }
        }
        let ends = value("ends").unwrap_or(0.0) as u64;
        for off_mm in [20.0, 10.0, 5.0, 3.0, 1.0].into_iter().filter(|_| ends > 0) {
            let target = rig.cylinder.stroke_m / 2.0 - 1e-3 * off_mm;
            let runs: Vec<Move> = (first..first + ends)
                .into_par_iter()
                .map(|seed| {
                    let mut bench = on(false, seed);
                    step(&mut bench, target - 0.03, 5 * ticks);
                    step(&mut bench, target, ticks)
                })
                .collect();
            let settled = runs.iter().filter(|run| run.settled_s.is_finite()).count();
            let worst = |of: fn(&Move) -> f64| runs.iter().map(of).fold(0.0, f64::max);
            println!(
                "  {off_mm} mm from the end: {settled} of {ends} settle, within {:.3} s; at rest {:.3} mm, {} silent",
                runs.iter().map(|run| run.settled_s).filter(|t| t.is_finite()).fold(0.0, f64::max),
                1e3 * worst(|run| run.rest_peak_m),
                runs.iter().filter(|run| run.changes == 0).count(),
            );
        }
        let obstacles = value("obstacles").unwrap_or(0.0) as u64;
        for blocked_s in [0.1, 0.2, 0.5, 1.0, 2.0].into_iter().filter(|_| obstacles > 0) {
            let runs: Vec<Obstructed> = (first..first + obstacles)
                .into_par_iter()
                .map(|seed| {
                    obstructed(
                        &mut on(value("drawn").is_some(), seed),
                        if case == 'c' { 0.03 } else { 0.045 },
                        blocked_s,
                    )
                })
                .collect();
            let worst = |of: fn(&Obstructed) -> f64| runs.iter().map(of).fold(0.0, f64::max);
            println!(
                "  obstacle for {blocked_s} s: force at most {:.0} % of the supply's, then {:.1} mm beyond the target at most; settled within {:.2} s",
                100.0 * worst(|run| run.force),
                1e3 * worst(|run| run.after.overshoot_m),
                worst(|run| run.after.settled_s),
            );
        }
        let streams = value("streams").unwrap_or(0.0) as u64;
        if streams > 0 {
            let waves = Wave::all(rig.cylinder.stroke_m);
            let runs: Vec<(usize, u64, (f64, f64))> = (0..waves.len() as u64 * streams)
                .into_par_iter()
                .map(|n| {
                    let (wave, seed) = ((n / streams) as usize, first + n % streams);
                    // Seed 0 is the nominal rig.
                    (wave, seed, stream(&mut on(n % streams != 0, seed), waves[wave], seed))
                })
                .collect();
            let far = runs.iter().map(|run| run.2.0).fold(0.0, f64::max);
            let late = runs.iter().filter(|run| run.2.1.is_infinite()).count();
            println!(
                "  {} streams on {streams} rigs: farthest {far:.2} times the amplitude; {late} of {} not at rest within 2 s after",
                waves.len(),
                runs.len()
            );
            for (wave, seed, (far, rest)) in runs.iter().filter(|run| run.2.0 > 1.5 || run.2.1.is_infinite()) {
                println!("    {:?} on {seed}: {far:.2}, rest {rest:.2} s", waves[*wave]);
            }
        }
    }
}
