//! Open loop: a recorded or designed valve command drives the plant, nothing else.

use plant_model::{Inputs, Simulator, State};
use rig_files::{Expected, InputError, RigFile, Short, Table, closest};
use std::fmt::Write as _;
use std::path::Path;

/// A command over time; each value is held until the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// Times, s, increasing.
    pub t_s: Vec<f64>,
    /// Valve command about mid position, V.
    pub u_v: Vec<f64>,
    /// External force along +y, N; absent: none.
    pub f_ext_n: Option<Vec<f64>>,
    /// Supply pressure, Pa absolute; absent: nominal.
    pub p_sup_pa: Option<Vec<f64>>,
}

/// The columns an input may have: `t_s` and `u_v` are required and used, `f_ext_n` and `p_sup_pa` are used where present,
/// the other columns of a log are allowed (so that a log can be replayed) and ignored.
const COLUMNS: [Expected; 10] = {
    const fn optional(name: &'static str) -> Expected {
        Expected { name, required: false, blanks: true }
    }
    [
        Expected { name: "t_s", required: true, blanks: false },
        Expected { name: "u_v", required: true, blanks: false },
        Expected { name: "f_ext_n", required: false, blanks: false },
        Expected { name: "p_sup_pa", required: false, blanks: false },
        optional("y_m"),
        optional("p_a_pa"),
        optional("p_b_pa"),
        optional("y_ref_m"),
        optional("v_m_per_s"),
        optional("z_m"),
    ]
};

impl Command {
    /// Reads a command from CSV with at least `t_s` and `u_v`.
    ///
    /// # Errors
    /// See [`Table::parse`].
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let mut columns = Table::read(path, &COLUMNS)?.columns.into_iter();
        let mut next = || columns.next().flatten();
        let (t_s, u_v) = (next().unwrap_or_default(), next().unwrap_or_default());
        Ok(Self { t_s, u_v, f_ext_n: next(), p_sup_pa: next() })
    }
}

/// One row of the answer: what sensors without noise would show, and the velocity and bristle deflection behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Command from this row on, V.
    pub u_v: f64,
    /// Position, m.
    pub y_m: f64,
    /// Velocity, m/s.
    pub v_m_per_s: f64,
    /// Pressure of chamber A, Pa absolute.
    pub p_a_pa: f64,
    /// Pressure of chamber B, Pa absolute.
    pub p_b_pa: f64,
    /// Bristle deflection, m.
    pub z_m: f64,
}

/// Runs the plant under a command from a given state; one row per row of the command.
#[must_use]
pub fn simulate(mut simulator: Simulator<f64>, start: &State<f64>, command: &Command) -> Vec<Row> {
    simulator.set_state(*start);
    let nominal = simulator.plant().inputs(0.0);
    let mut rows = Vec::with_capacity(command.t_s.len());
    for (at, (&t_s, &u_v)) in command.t_s.iter().zip(&command.u_v).enumerate() {
        let (sensed, state) = (simulator.measure(), simulator.state());
        rows.push(Row {
            t_s,
            u_v,
            y_m: sensed.y_m,
            v_m_per_s: state.v_m_per_s,
            p_a_pa: sensed.p_a_pa,
            p_b_pa: sensed.p_b_pa,
            z_m: state.z_m,
        });
        if let Some(next_s) = command.t_s.get(at + 1) {
            let inputs = Inputs {
                u_v,
                external_force_n: command.f_ext_n.as_ref().map_or(nominal.external_force_n, |force| force[at]),
                supply_pa: command.p_sup_pa.as_ref().map_or(nominal.supply_pa, |pressure| pressure[at]),
            };
            simulator.advance_with(&inputs, next_s - t_s);
        }
    }
    rows
}

/// The rows as CSV: `t_s,u_v,y_m,v_m_per_s,p_a_pa,p_b_pa,z_m`.
#[must_use]
pub fn to_csv(rows: &[Row]) -> String {
    let mut text = String::with_capacity(rows.len() * 100);
    text.push_str("t_s,u_v,y_m,v_m_per_s,p_a_pa,p_b_pa,z_m\n");
    for Row { t_s, u_v, y_m, v_m_per_s, p_a_pa, p_b_pa, z_m } in rows {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{t_s},{u_v},{y_m},{v_m_per_s},{p_a_pa},{p_b_pa},{z_m}");
    }
    text
}

const START_KEYS: [&str; 5] = ["y_m", "v_m_per_s", "p_a_pa", "p_b_pa", "z_m"];

/// The start of a simulation from text like `y_m=0,p_a_pa=3.6e5`; what is not named is at rest at mid-stroke with both
/// chambers at p*.
///
/// # Errors
/// An unknown or repeated key, no number, or a state that the rig cannot be in.
pub fn initial_state(text: &str, rig: &RigFile, simulator: &Simulator<f64>) -> Result<State<f64>, InputError> {
    let fail = |problem: String, remedy: String| Err(InputError::new("--initial", problem, remedy));
    let mut values: [Option<f64>; 5] = [None; 5];
    for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        let Some((key, value)) = part.split_once('=') else {
            return fail(format!("`{part}` is not KEY=VALUE"), "write it like y_m=0.1,p_a_pa=3.6e5".to_string());
        };
        let (key, value) = (key.trim(), value.trim());
        let Some(at) = START_KEYS.iter().position(|known| *known == key) else {
            let near = closest(key, START_KEYS).map(|near| format!("did you mean `{near}`?"));
            return fail(
                format!("`{key}` is not a state"),
                near.unwrap_or_else(|| format!("use {}", START_KEYS.join(", "))),
            );
        };
        let number = value.parse::<f64>().ok().filter(|number| number.is_finite());
        let Some(number) = number else {
            return fail(format!("`{key}` = `{value}` is not a finite number"), "write a plain number".to_string());
        };
        if values[at].replace(number).is_some() {
            return fail(format!("`{key}` is given twice"), "remove one of them".to_string());
        }
    }
    let [equilibrium_a, equilibrium_b] = rig.rig.equilibrium_pressures_pa();
    let [y, v, p_a, p_b, z] = values;
    let half = rig.rig.cylinder.stroke_m / 2.0;
    let y_m = y.unwrap_or(0.0);
    if y_m.abs() > half {
        return fail(format!("y_m = {} is beyond the end stops", Short(y_m)), format!("stay within ±{half} m"));
    }
    for (key, pressure) in [("p_a_pa", p_a), ("p_b_pa", p_b)] {
        if let Some(pressure) = pressure.filter(|p| !(1.0e3..=1.0e8).contains(p)) {
            let remedy = "give an absolute pressure in Pa; 1 bar is 1e5".to_string();
            return fail(format!("{key} = {} is not plausible", Short(pressure)), remedy);
        }
    }
    let v_m_per_s = v.unwrap_or(0.0);
    if v_m_per_s.abs() > 100.0 {
        return fail(format!("v_m_per_s = {} is not plausible", Short(v_m_per_s)), "give it in m/s".to_string());
    }
    // The paper's invariant set: the bristles never deflect by more than F_s / sigma0.
    let most_m = rig.rig.friction.static_n / rig.rig.friction.stiffness_n_per_m;
    let z_m = z.unwrap_or(0.0);
    if z_m.abs() > most_m {
        return fail(
            format!("z_m = {} is more than the bristles deflect", Short(z_m)),
            format!("stay within ±{most_m:e} m"),
        );
    }
    let rest = simulator.plant().state_at_rest(y_m, p_a.unwrap_or(equilibrium_a), p_b.unwrap_or(equilibrium_b));
    Ok(State { v_m_per_s, z_m, ..rest })
}
