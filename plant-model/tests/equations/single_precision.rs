//! The `f32` build: how far it strays from `f64`, and what micromath would save or cost against libm.
//! The figures are in `docs/decisions/math-library.md`.

use micromath::F32Ext;
use plant_model::{Effects, Plant, Real, Rig, Simulator, State, Stepper};
use std::f64::consts::{FRAC_PI_4, TAU};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `f32` with micromath's approximations in place of libm's functions.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
struct Micro(f32);

macro_rules! operators {
    ($($trait:ident $method:ident),+) => {
        $(impl $trait for Micro {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        })+
    };
}
operators!(Add add, Sub sub, Mul mul, Div div);

impl AddAssign for Micro {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl SubAssign for Micro {
    fn sub_assign(&mut self, other: Self) {
        self.0 -= other.0;
    }
}

impl Neg for Micro {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Micro {
    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    const HALF: Self = Self(0.5);
    const PI: Self = Self(core::f32::consts::PI);
    fn of(value: f64) -> Self {
        Self(value as f32)
    }
    fn to_f64(self) -> f64 {
        f64::from(self.0)
    }
    fn abs(self) -> Self {
        Self(f32::abs(self.0))
    }
    fn exp(self) -> Self {
        Self(F32Ext::exp(self.0))
    }
    fn atan(self) -> Self {
        Self(F32Ext::atan(self.0))
    }
    fn sin(self) -> Self {
        Self(F32Ext::sin(self.0))
    }
    fn cos(self) -> Self {
        Self(F32Ext::cos(self.0))
    }
    fn sqrt(self) -> Self {
        Self(F32Ext::sqrt(self.0))
    }
    fn is_finite(self) -> bool {
        f32::is_finite(self.0)
    }
}

/// Largest absolute error of an `f32` function over a range.
fn worst(range: (f64, f64), exact: fn(f64) -> f64, found: impl Fn(f32) -> f32) -> f64 {
    (0..=100_000)
        .map(|k| {
            let x = (range.0 + (range.1 - range.0) * f64::from(k) / 100_000.0) as f32;
            (f64::from(found(x)) - exact(f64::from(x))).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn libm_is_exact_to_single_precision_where_micromath_is_off_by_up_to_percents() {
    type Row = (&'static str, (f64, f64), fn(f64) -> f64, fn(f32) -> f32, fn(f32) -> f32, (f64, f64));
    // Ranges as the model uses them; all results are of the order of one. The last pair bounds micromath's error
    // from both sides: if a release of micromath improves, the choice is to be looked at again.
    let rows: [Row; 6] = [
        ("sqrt", (0.01, 1.0), f64::sqrt, Real::sqrt, F32Ext::sqrt, (0.02, 0.09)),
        ("atan", (0.0, 10.0), f64::atan, Real::atan, F32Ext::atan, (1.4e-3, 5.6e-3)),
        ("exp", (-40.0, 0.0), f64::exp, Real::exp, F32Ext::exp, (0.6e-3, 2.4e-3)),
        ("sin", (0.0, FRAC_PI_4), f64::sin, libm::sinf, F32Ext::sin, (0.5e-3, 2.2e-3)),
        ("cos", (0.0, TAU), f64::cos, libm::cosf, F32Ext::cos, (0.5e-3, 2.2e-3)),
        ("inverse", (0.5, 10.0), f64::recip, |x| 1.0 / x, F32Ext::inv, (0.08, 0.35)),
    ];
    for (name, range, exact, libm, micromath, (at_least, at_most)) in rows {
        let (precise, rough) = (worst(range, exact, libm), worst(range, exact, micromath));
        println!("{name:8} libm {precise:.1e}  micromath {rough:.1e}");
        assert!(precise < 2.5e-7, "{name}: libm is off by {precise:e}");
        assert!((at_least..=at_most).contains(&rough), "{name}: micromath is off by {rough:e}");
    }
}

#[test]
fn the_own_cube_root_is_exact_to_2e_14() {
    for k in -3000..3000 {
        let x = 1.07_f64.powi(k) * (1.0 + 1.0e-4 * f64::from(k));
        let exact = libm::cbrt(x);
        assert!((Real::cbrt(x) / exact - 1.0).abs() < 2.0e-14, "{x}: {} instead of {exact}", Real::cbrt(x));
    }
    for x in [0.0, -8.0, f64::INFINITY, 1.0e-310] {
        assert_eq!(Real::cbrt(x), libm::cbrt(x));
    }
    assert!(Real::cbrt(f64::NAN).is_nan());
}

#[test]
fn the_own_exponential_is_exact_to_2_units_in_the_last_place() {
    let mut worst = 0.0f64;
    for k in 0..=1_000_000 {
        let x = -f64::from(k) * 7.0e-5;
        worst = worst.max((Real::exp(x) / x.exp() - 1.0).abs());
    }
    assert!(worst <= 2.0 * f64::EPSILON, "relative error {worst:e}");
    assert!((Real::exp(0.0f64) - 1.0).abs() < f64::EPSILON);
}

fn trajectory<R: Real>(rig: &Rig<R>, stepper: Stepper<R>, sliding: bool) -> Vec<State<R>> {
    let plant = Plant::new(rig, &Effects::none()).unwrap();
    let p = rig.equilibrium_pressure_pa();
    let mut simulator = Simulator::<R>::from_state(plant, plant.state_at_rest(R::ZERO, p, p), stepper);
    (0..3000)
        .map(|k| {
            let t = f64::from(k) * 1.0e-3;
            let u = if sliding {
                0.8 * (TAU * t).cos() + 0.4 * (TAU * 2.3 * t + 0.4).sin()
            } else {
                0.06 * (TAU * 1.1 * t).sin()
            };
            simulator.advance(R::of(u), R::of(1.0e-3));
            *simulator.state()
        })
        .collect()
}

/// Largest differences to `f64` under the same stepper: position in m, pressures in Pa.
fn distance<R: Real>(found: &[State<R>], truth: &[State<f64>]) -> (f64, f64) {
    found.iter().zip(truth).fold((0.0, 0.0), |(y, p): (f64, f64), (f, t)| {
        let pressure = (f.p_a_pa.to_f64() - t.p_a_pa).abs().max((f.p_b_pa.to_f64() - t.p_b_pa).abs());
        (y.max((f.y_m.to_f64() - t.y_m).abs()), p.max(pressure))
    })
}

#[test]
fn single_precision_stays_within_20_um_of_double_over_3_s_and_micromath_does_not() {
    let singles = [Rig::<f32>::paper_a(), Rig::paper_b(), Rig::paper_c()];
    let micros = [Rig::<Micro>::paper_a(), Rig::paper_b(), Rig::paper_c()];
    let doubles = [Rig::<f64>::paper_a(), Rig::paper_b(), Rig::paper_c()];
    for i in 0..3 {
        for sliding in [true, false] {
            let truth = trajectory(&doubles[i], Stepper::equal_steps(2), sliding);
            let (y, p) = distance(&trajectory(&singles[i], Stepper::equal_steps(2), sliding), &truth);
            let (rough_y, rough_p) = distance(&trajectory(&micros[i], Stepper::equal_steps(2), sliding), &truth);
            println!(
                "case {i} sliding {sliding}: libm {y:.1e} m {p:.1e} Pa, micromath {rough_y:.1e} m {rough_p:.1e} Pa"
            );
            assert!(y < 2e-5 && p < 50.0, "case {i}, sliding {sliding}: {y} m, {p} Pa");
            assert!(rough_y > 10.0 * y, "micromath: {rough_y} m");
        }
    }
}
