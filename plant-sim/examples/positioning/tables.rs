//! The tables, one function each.

use crate::draws::{draw, random_moves};
use crate::study::Study;
use crate::trials::{Obstructed, Wave, loaded_moves, obstructed, pushed, stream};
use plant_model::Effect;
use plant_sim::servo::bench::{Move, Sent, sine, step};
use rayon::prelude::*;

/// The largest of one figure of all runs.
fn worst<T>(runs: &[T], of: impl Fn(&T) -> f64) -> f64 {
    runs.iter().map(of).fold(0.0, f64::max)
}

/// How many percent of all runs are good.
fn share<T>(runs: &[T], good: impl Fn(&T) -> bool) -> f64 {
    100.0 * runs.iter().filter(|run| good(run)).count() as f64 / runs.len() as f64
}

/// A move, tick by tick.
pub(crate) fn trace(study: &Study<'_>, mm: f64) {
    let seed = study.arguments.or("seed", 1.0) as u64;
    let mut bench = study.on(study.arguments.value("drawn").is_some(), seed);
    bench.obstacle(study.arguments.value("obstacles").map(|mm| 1e-3 * mm));
    for tick in 0..study.arguments.or("ticks", 1000.0) as u32 {
        let (y, _) = bench.tick(mm * 1e-3);
        if tick % study.arguments.or("every", 10.0) as u32 == 0 {
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
                study.rig.cylinder.mean_area_m2() * (state.p_a_pa - state.p_b_pa),
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
}

/// Moves of three lengths on the nominal rig.
pub(crate) fn moves(study: &Study<'_>) {
    let seeds = study.arguments.or("seeds", 20.0) as u64;
    println!(
        "  move mm | settled mean / worst s | overshoot mm | rest error um | peak um | changes, most / moves with any"
    );
    for target in [1e-3, 0.045, study.longest] {
        let runs = study.each(seeds, |seed| step(&mut study.on(false, seed), target, study.ticks()));
        let worst = |of: fn(&Move) -> f64| worst(&runs, of);
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
}

/// A sine on the nominal rig, and on as many seeds and draws as asked for.
pub(crate) fn sines(study: &Study<'_>) {
    let sent = Sent {
        every_s: 1e-3 * study.arguments.or("sent_ms", 0.0),
        code_m: 1e-6 * study.arguments.or("sent_um", 0.0),
        noise_m: 1e-6 * study.arguments.or("sent_noise_um", 0.0),
    };
    let amplitude = if study.case == 'c' { 0.03 } else { 0.05 };
    let (peak, rms) = sine(&mut study.on(false, 1), amplitude, 0.5, &sent);
    println!("  sine 0.5 Hz, {:.0} mm: peak {:.2} mm, rms {:.2} mm", amplitude * 1e3, peak * 1e3, rms * 1e3);
    let sines = study.count("sines");
    for drawn in [false, true].into_iter().filter(|_| sines > 0) {
        let hz = study.arguments.or("sine_hz", 0.5);
        let mut runs = study.each(sines, |seed| sine(&mut study.on(drawn, seed), amplitude, hz, &sent));
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
}

/// A move on draws of the rig.
pub(crate) fn draws(study: &Study<'_>) {
    let draws = study.arguments.or("draws", 200.0) as u64;
    let drawn_mm = study.arguments.or("draws_mm", 45.0);
    let runs = study.each(draws, |seed| step(&mut study.on(true, seed), drawn_mm * 1e-3, study.ticks()));
    if draws > 0 {
        let share = |good: fn(&Move) -> bool| share(&runs, good);
        let mut over: Vec<f64> = runs.iter().map(|run| run.overshoot_m).collect();
        over.sort_by(f64::total_cmp);
        println!(
            "  {draws} draws of {drawn_mm} mm: stable {:.1} %, within 0.6 s {:.1} %, within 1 s {:.1} %; overshoot 95th percentile {:.2} mm, worst {:.2} mm",
            share(|run| run.rest_peak_m < 2e-3 && run.furthest_m < 0.09),
            share(|run| run.settled_s <= 0.6),
            share(|run| run.settled_s <= 1.0),
            over[(0.95 * (draws - 1) as f64) as usize] * 1e3,
            over[draws as usize - 1] * 1e3,
        );
        if study.arguments.value("list").is_some() {
            for (seed, run) in runs.iter().enumerate().filter(|(_, run)| run.settled_s > 0.6) {
                let (settled, over, peak) = (run.settled_s, run.overshoot_m * 1e3, run.rest_peak_m * 1e6);
                println!(
                    "    {}: {settled:.2} s, {over:.2} mm over, {peak:.0} um, {} changes",
                    study.first + seed as u64,
                    run.changes
                );
            }
        }
    }
}

/// Random moves on draws of the rig.
pub(crate) fn random(study: &Study<'_>) {
    let moved = study.count("moves");
    if moved > 0 {
        // The longest move takes about a second.
        let range = match study.case {
            'a' => 0.15,
            'b' => 0.1,
            _ => 0.07,
        };
        let runs = study.each(moved, |seed| {
            let mut bench = study.on(true, seed);
            let run = random_moves(&mut bench, 50, range, seed);
            if study.arguments.value("list").is_some() {
                let (servo, (drawn, effects)) = (&bench.servo, draw(&study.rig, seed));
                println!(
                    "    {seed}: late {} noisy {} lag {:.1} fc {:.2} vis {:.2} (true {:.2}) gains {:.2?} zones {:.3} {:.3} (true {:.3} {:.3}) M {:.2} (true {:.2}) lag (true {:.1})",
                    run.settled_s.iter().filter(|t| t.is_infinite()).count(),
                    run.changes.iter().filter(|n| **n > 0).count(),
                    servo.lag.seconds * 1e3,
                    servo.body.coulomb / study.rig.friction.coulomb_n,
                    servo.body.viscous / study.tuning.viscous,
                    drawn.friction.coulomb_n / study.rig.friction.coulomb_n,
                    servo.valve.gain,
                    servo.valve.right,
                    servo.valve.left,
                    drawn.valve.dead_zone_right_v,
                    drawn.valve.dead_zone_left_v,
                    servo.body.mass / study.rig.load.mass_kg,
                    drawn.load.mass_kg / study.rig.load.mass_kg,
                    effects.get(Effect::ValveLag).map_or(0.0, |lag| lag[0] * 1e3),
                );
            }
            run
        });
        let times: Vec<f64> = runs.iter().flat_map(|run| run.settled_s.iter().copied()).collect();
        let late = times.iter().filter(|time| time.is_infinite()).count();
        let whole = runs.iter().filter(|run| run.settled_s.iter().all(|time| time.is_finite())).count();
        // A leak moves the force for ever.
        let tight = |seed: u64| draw(&study.rig, seed).1.get(Effect::LeakChamberA).is_none();
        let silent = |of: &dyn Fn(u64) -> bool| {
            let changes: Vec<u32> = (study.first..)
                .zip(&runs)
                .filter(|(seed, _)| of(*seed))
                .flat_map(|(_, run)| run.changes.clone())
                .collect();
            100.0 * changes.iter().filter(|changes| **changes == 0).count() as f64 / changes.len().max(1) as f64
        };
        let within = |limit: f64| share(&times, |time| *time <= limit);
        println!(
            "  {moved} draws x 50 random moves: {late} of {} not settled within 2 s, {whole} draws without such; within 0.6 s {:.1} %, within 1 s {:.1} %; valve silent in the last second of {:.1} %, without leaks of {:.1} %",
            times.len(),
            within(0.6),
            within(1.0),
            silent(&|_| true),
            silent(&tight),
        );
    }
}

/// Moves under loads, and loads put on and off.
pub(crate) fn loads(study: &Study<'_>) {
    let loads = study.count("loads");
    let most_n = study.rig.cylinder.mean_area_m2() * (study.rig.supply.pressure_pa - study.rig.supply.atmosphere_pa);
    let parts = [0.02, 0.05, 0.1, 0.2, 0.3, 0.45].into_iter().flat_map(|part| [(part, false), (part, true)]);
    for (part, drawn) in parts.filter(|_| loads > 0) {
        let targets_m = [0.045, 0.035, 0.036, -0.045, -0.035, -0.036, 0.0, 0.001, 0.02];
        let runs = study.each(loads, |seed| {
            let load_n = if seed.is_multiple_of(2) { part * most_n } else { -part * most_n };
            (
                loaded_moves(&mut study.on(drawn, seed).under(load_n), &targets_m),
                pushed(&mut study.on(drawn, seed), load_n),
            )
        });
        let moves: Vec<Move> = runs.iter().flat_map(|run| run.0.iter().copied()).collect();
        let pushes: Vec<Move> = runs.iter().flat_map(|run| run.1).collect();
        let drawn = if drawn { ", draws" } else { "" };
        for (what, moves) in [("moves", moves), ("put on and off", pushes)] {
            let share = |good: fn(&Move) -> bool| share(&moves, good);
            println!(
                "  load {:.0} N{drawn}, {what}: within 0.6 s {:.1} %, 1 s {:.1} %, at all {:.1} %; silent {:.1} %; at rest {:.2} mm at most",
                part * most_n,
                share(|run| run.settled_s <= 0.6),
                share(|run| run.settled_s <= 1.0),
                share(|run| run.settled_s.is_finite()),
                share(|run| run.changes == 0),
                1e3 * worst(&moves, |run| run.rest_peak_m),
            );
        }
    }
}

/// Moves to near the end of the stroke.
pub(crate) fn ends(study: &Study<'_>) {
    let ends = study.count("ends");
    for off_mm in [20.0, 10.0, 5.0, 3.0, 1.0].into_iter().filter(|_| ends > 0) {
        let target = study.rig.cylinder.stroke_m / 2.0 - 1e-3 * off_mm;
        let runs = study.each(ends, |seed| {
            let mut bench = study.on(false, seed);
            step(&mut bench, target - 0.03, 5 * study.ticks());
            step(&mut bench, target, study.ticks())
        });
        let settled = runs.iter().filter(|run| run.settled_s.is_finite()).count();
        println!(
            "  {off_mm} mm from the end: {settled} of {ends} settle, within {:.3} s; at rest {:.3} mm, {} silent",
            runs.iter().map(|run| run.settled_s).filter(|t| t.is_finite()).fold(0.0, f64::max),
            1e3 * worst(&runs, |run| run.rest_peak_m),
            runs.iter().filter(|run| run.changes == 0).count(),
        );
    }
}

/// Moves into an obstacle that gives way.
pub(crate) fn obstacles(study: &Study<'_>) {
    let obstacles = study.count("obstacles");
    for blocked_s in [0.1, 0.2, 0.5, 1.0, 2.0].into_iter().filter(|_| obstacles > 0) {
        let (drawn, target) = (study.arguments.value("drawn").is_some(), if study.case == 'c' { 0.03 } else { 0.045 });
        let runs = study.each(obstacles, |seed| obstructed(&mut study.on(drawn, seed), target, blocked_s));
        let worst = |of: fn(&Obstructed) -> f64| worst(&runs, of);
        println!(
            "  obstacle for {blocked_s} s: force at most {:.0} % of the supply's, then {:.1} mm beyond the target at most; settled within {:.2} s",
            100.0 * worst(|run| run.force),
            1e3 * worst(|run| run.after.overshoot_m),
            worst(|run| run.after.settled_s),
        );
    }
}

/// Streamed targets, and what becomes of the piston after them.
pub(crate) fn streams(study: &Study<'_>) {
    let streams = study.count("streams");
    if streams > 0 {
        let waves = Wave::all(study.rig.cylinder.stroke_m);
        let runs: Vec<(usize, u64, (f64, f64))> = (0..waves.len() as u64 * streams)
            .into_par_iter()
            .map(|n| {
                let (wave, seed) = ((n / streams) as usize, study.first + n % streams);
                // Seed 0 is the nominal rig.
                (wave, seed, stream(&mut study.on(n % streams != 0, seed), waves[wave], seed))
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
