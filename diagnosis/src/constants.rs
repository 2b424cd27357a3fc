//! The numbers by which causes are searched, judged and named, given and not derived, in one table. What only one check or one
//! curve of the report uses stands beside it, with its reason.
//!
//! A constant is a function, so that `--features sensitivity` can halve and double it: `docs/diagnosis-constants.md` says how
//! the answers change then. Without the feature it is the number itself.

/// A constant with its place in the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Stage of the diagnosis.
    pub stage: &'static str,
    /// Name of the function.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// Unit; empty for a number.
    pub unit: &'static str,
    /// What it decides.
    pub meaning: &'static str,
    /// Where it is from.
    pub origin: &'static str,
    /// Whether it counts something: halved and doubled to whole numbers, no less than one.
    pub whole: bool,
}

/// A number that a constant can be.
trait Number: Copy {
    const WHOLE: bool;
    fn as_f64(self) -> f64;
    #[cfg(feature = "sensitivity")]
    fn times(self, factor: f64) -> Self;
}

impl Number for f64 {
    const WHOLE: bool = false;
    fn as_f64(self) -> f64 {
        self
    }
    #[cfg(feature = "sensitivity")]
    fn times(self, factor: f64) -> Self {
        self * factor
    }
}

impl Number for usize {
    const WHOLE: bool = true;
    fn as_f64(self) -> f64 {
        self as f64
    }
    #[cfg(feature = "sensitivity")]
    fn times(self, factor: f64) -> Self {
        (self as f64 * factor).round().max(1.0) as Self
    }
}

macro_rules! constants {
    ($($stage:literal { $($name:ident: $type:ty = $value:literal, $unit:literal, $meaning:literal, $origin:literal;)+ })+) => {
        $($(
            #[doc = $meaning]
            #[inline(always)]
            pub(crate) fn $name() -> $type {
                #[cfg(feature = "sensitivity")]
                {
                    Number::times($value, factor_of(stringify!($name)))
                }
                #[cfg(not(feature = "sensitivity"))]
                {
                    $value
                }
            }
        )+)+

        /// All of them, by stage.
        #[must_use]
        pub fn table() -> Vec<Constant> {
            vec![$($(Constant {
                stage: $stage,
                name: stringify!($name),
                value: <$type as Number>::as_f64($value),
                unit: $unit,
                meaning: $meaning,
                origin: $origin,
                whole: <$type as Number>::WHOLE,
            },)+)+]
        }
    };
}

/// The constants that are changed, and their factors. Set once, before the first diagnosis.
#[cfg(feature = "sensitivity")]
static CHANGED: std::sync::OnceLock<Vec<(String, f64)>> = std::sync::OnceLock::new();

/// Multiplies constants, for the rest of the process.
///
/// # Errors
/// The name of which there is no constant, or of all if some were changed already.
#[cfg(feature = "sensitivity")]
pub fn change(changes: Vec<(String, f64)>) -> Result<(), String> {
    match changes.iter().find(|(name, _)| table().iter().all(|c| c.name != name)) {
        Some((name, _)) => Err(name.clone()),
        None => CHANGED.set(changes).map_err(|_| "changed twice".into()),
    }
}

#[cfg(feature = "sensitivity")]
fn factor_of(name: &str) -> f64 {
    CHANGED.get().into_iter().flatten().find(|(changed, _)| changed == name).map_or(1.0, |(_, factor)| *factor)
}

constants! {
    "check" {
        unit_factor: f64 = 5.0, "",
            "Readings so many times beyond what the rig allows have another unit.",
            "between a sensor's reserve (2) and the smallest factor between units (10)";
        beyond_stroke: f64 = 0.25, "of half the stroke",
            "A position that reads farther beyond the stroke is not about mid-stroke.",
            "three times the largest everyday error of a position's scale";
        slowest_rows: f64 = 0.15, "s",
            "With rows farther apart no balance can be formed.",
            "half the shortest stretch";
        excerpt_s: f64 = 10.0, "s",
            "Mistakes of mapping are looked for in so much of the log.",
            "a stroke both ways; the check has to take about a second";
        suspect: f64 = 20.0, "times noise",
            "With less misfit of all balances together no mistake is looked for.",
            "a mapping mistake misses by more in every balance it touches";
        undone: f64 = 0.1, "",
            "A mistake that, undone, leaves less than this part of the misfit is one.",
            "an order of magnitude: everyday faults change by a few percent when a column is turned round";
        turned: f64 = 0.2, "",
            "A sign or a side is wrong if, put right, the valve's opening correlates with the flow so much better.",
            "of 46 logs of all classes, read rightly, none gained more than -0.1 by another reading; a wrong sign loses 0.4 or more";
        turns_alike: f64 = 0.65, "",
            "The least correlation of a reading that is right.",
            "the least of the same logs with motion: 0.68, most 0.9";
        gauge_within: f64 = 0.3, "of the atmosphere",
            "A supply that reads less than stated by the atmosphere, to within this, may be a gauge pressure.",
            "5 % of 6 bar: what a regulator's gauge is read to";
        frozen_s: f64 = 1.0, "s",
            "A column that keeps one value for longer, while others change, is frozen.",
            "a coarse converter rests on one code for less while a piston works";
        clipped_part: f64 = 0.03, "of the rows",
            "A column that reads its extreme value in a larger part of the rows is clipped.",
            "noise reaches its extreme once";
        uneven_rows: f64 = 0.35, "of the interval",
            "Times that vary by more are worth a word.",
            "above the jitter of a busy logger";
        least_command: f64 = 0.2, "of full voltage",
            "A command of less span shows little of the valve.",
            "chosen: less than the dead zones of a cheap valve";
    }
    "data" {
        outlier: f64 = 10.0, "",
            "A reading so far from a line through its four neighbours, in their own distance from it or the sensor's noise, is left out.",
            "the usual identifier takes 3 and leaves out noise; nothing that a piston or air does comes near 10";
        distant_rows: f64 = 0.005, "s",
            "Between rows farther apart a pressure may come and go.",
            "a sixth of the period of a piston on short chambers, 30 Hz";
        rare_readings: usize = 200, "",
            "There one reading in so many at either end of a column is left out of what the column spans.",
            "a log may rest most of the time: a twentieth took the span of its rest";
        beyond_span: f64 = 2.0, "spans",
            "And a reading that lies farther outside than this is left out.",
            "with one a pressure close to an end stop was";
        interruption: f64 = 2.5, "usual intervals",
            "A longer step of time interrupts the log.",
            "between one lost sample (2) and two (3)";
        chunks: usize = 16, "",
            "The log is cut into about this many chunks for fitting and for holding back.",
            "four pieces held back, from all parts of the log";
        held_back_every: usize = 4, "chunks",
            "Every so many chunks one is held back.",
            "a quarter held back: room for the longest horizon in each piece";
        shortest_stretch_s: f64 = 0.3, "s",
            "Shorter stretches are not judged.",
            "three times the settling time of the balances";
        least_in_a_stretch: usize = 8, "samples",
            "Nor are stretches of fewer samples.",
            "two averaged innovations";
        volume_reach: f64 = 0.007, "s",
            "Half the longest window of the local parabola that smooths the position for chamber volumes.",
            "15 samples at 1 kHz: leaves two fifths of the noise";
        velocity_reach: f64 = 0.015, "s",
            "The same for the velocity.",
            "31 samples at 1 kHz: 1.0 mm/s of error from 50 um of noise";
        pressure_reach: f64 = 0.009, "s",
            "The same for chamber pressures, in each of two passes.",
            "two passes of 41 to 61 ms together were best in grey-box trials, 21 ms hides a pressure lag";
        windows_apart: f64 = 3.0, "",
            "A window is shortened where what it makes of a signal lies more than so many standard errors from what a shorter one does.",
            "three standard errors: noise shortens one in some hundred windows";
        window_blend: usize = 3, "samples",
            "Over so many samples on either side the choice of windows is averaged.",
            "seven samples: no step between windows";
        position_noise_in_pressure: f64 = 0.5, "of the sensor's",
            "What the piston's motion makes of a pressure is taken out where the position's noise, as a pressure, is less than this.",
            "it adds a quarter to the power of the noise at most, before smoothing; with more an opening's smoothness of 0.8 was told as 0.34";
        least_reach: usize = 1, "samples",
            "Half a window holds no fewer samples: a parabola through three of them passes all noise and all motion.",
            "fewer have no slope";
        least_velocity_reach: usize = 2, "samples",
            "The same for the velocity.",
            "five samples: the least that averages the noise of a slope";
        close_rows: f64 = 0.00125, "s",
            "Where rows are farther apart no column is looked for that another clock stamped, and `check` says that little shows between them.",
            "a loop at 1 kHz with an irregular clock; a command that moved between rows looks late";
        longest_step: f64 = 0.002, "s",
            "Where rows are farther apart the balances run in steps between them, no longer than this.",
            "a tenth of the fastest time constant of a chamber, 20 ms";
        largest_play_v: f64 = 0.2, "V",
            "The command has gone through any likely hysteresis once it has changed by twice this.",
            "five times the 0.4 % of stroke of a catalogue's proportional valve";
        longest_unknown_past: f64 = 0.1, "of the log",
            "All counts as known after this part of the log.",
            "leaves nine tenths to be judged";
        window_alike: f64 = 3.75, "",
            "Errors of a smoothed signal are alike over its window divided by this.",
            "four of 15 samples: those averaged into one innovation at 1 kHz";
        leaning: f64 = 3.0, "static frictions",
            "A piston at rest against so many times its static friction leans on an end stop.",
            "three times what friction can hold";
        near_end: f64 = 0.15, "of half the stroke",
            "It must read within this part of half the stroke from there.",
            "chosen: a position scale 15 % off would be seen at once";
        least_noise: f64 = 1.0e-5, "of the range",
            "A signal with less noise repeats itself wherever it rests, so that repeats show no limit.",
            "a third of one code of 16 bits";
        railed_position_run: f64 = 0.02, "s",
            "A position that repeats its extreme for so long is at its sensor's limit.",
            "20 samples at 1 kHz, longer than a rest on one code";
        least_railed: usize = 3, "samples",
            "And in no fewer samples.",
            "noise that reaches its extreme three times in a row has an end there";
        railed_position_noise: f64 = 0.6, "steps",
            "If its noise is at least this, in smallest steps.",
            "with less noise a rest repeats itself";
        railed_pressure_run: f64 = 0.008, "s",
            "The same for a pressure, which peaks for a moment only.",
            "see the position's";
        railed_pressure_noise: f64 = 1.5, "steps",
            "The same for a pressure.",
            "see the position's";
        numerical_error_m: f64 = 5.0e-6, "m",
            "No position is judged more closely: what the force balance itself errs by.",
            "2 um left a false cause in logs without noise";
        numerical_error_pa: f64 = 10.0, "Pa",
            "No pressure is judged more closely.",
            "measured on logs without noise";
    }
    "model" {
        strained: f64 = 2.5, "tolerances",
            "A nominal value farther off is strained.",
            "once in eighty values by chance";
        weather_temperature: f64 = 0.017, "of the value",
            "Temperature is known no better, unless the rig file calls all values exact.",
            "5 K of 293 K: by two of them a workshop is colder in winter and warmer in summer";
        weather_atmosphere: f64 = 0.01, "of the value",
            "The same for atmospheric pressure.",
            "10 hPa: the standard deviation of weather at one place";
        gauge: f64 = 0.01, "of the value",
            "The same for a supply pressure that was not measured.",
            "a gauge of class 1.6 over 10 bar: 0.16 bar at most, about two standard deviations";
        weather_farthest: f64 = 2.0, "tolerances",
            "Temperature, atmosphere, supply and diameters of hoses are corrected by no more.",
            "they move one product, the flow: each by four would take up a coefficient that is 20 % off";
        regulator: f64 = 0.03, "of the value",
            "Where the supply is measured, the regulator may be off its setting by this.",
            "0.2 bar of 7 bar: a scale on the regulator";
        opening_curve: f64 = 0.05, "of the value",
            "A table of the valve's opening is known no better than this along its command, on each side.",
            "read off a catalogue's drawing, often of another size of the series; a side of 5 V off by 0.25 V";
        opening_point: f64 = 0.02, "of the value",
            "Each point of such a table is known no better.",
            "read off a drawing to a fiftieth";
        opening_read: f64 = 0.15, "of full opening",
            "A point that is less open is known as well as one at this opening.",
            "a drawing is read to 0.3 % of its height";
        sensors_late_s: f64 = 5.0e-5, "s",
            "Standard deviation of the time by which all sensors are late against the command; corrected by two of it at most.",
            "filters of 1.5 kHz and more; with twice of it a lag of 0.8 ms among a few missing rows is no longer named";
        stated_lag: f64 = 0.3, "of the value",
            "A lag of the valve that has no tolerance of its own is known no better, unless the rig file calls all values exact.",
            "a catalogue's switching time for a spool of any order and stroke; the shipped rig files state 0.3";
        corner_rounding: f64 = 0.02, "of max_voltage_v",
            "The square of valve.corner_rounding_v has this one's as its standard deviation where the rig file has a table of the opening; four of it at most.",
            "edges of spool and sleeve are broken by some um and have as much play, on a stroke of 1 mm: 1 to 2 % in all";
        exhaust_overlap: f64 = 0.005, "of max_voltage_v",
            "Standard deviation of valve.exhaust_overlap_v there.",
            "edges of spool and sleeve are ground to some um of a stroke of 1 mm";
        opening_smoothness: f64 = 0.5, "",
            "Standard deviation of valve.opening_smoothness there.",
            "any curve between straight lines and the cubic equally likely: root mean square from either, 0.58";
        between_points: f64 = 0.4, "of what the cubic differs from straight lines by",
            "How far a valve's curve between the points of a table is from any blend of both, wherever valve.opening_smoothness is adjusted.",
            "the best blends leave Fritsch-Butland's, Akima's and the natural spline 0.37 to 0.52 off through points of a data sheet, 0.11 to 0.24 through a smooth function's; with 0.2 and 0.8 balances of such a valve err 1.03 and 0.87 times their noise, with 0.4 0.96";
        from_point_to_point_s: f64 = 0.01, "s",
            "For how long the spool stays between two points of a table, and the curve's error the same.",
            "a stroke's command passes 15 points a side within 0.15 s; with 0.02 s the same balances err 0.92 times their noise, with 0.005 s 0.99";
        spool_inertia: f64 = 0.25, "",
            "Standard deviation of valve.spool_inertia where the rig file states the lag alone, corrected by four of it at most.",
            "damping ratios of spools lie about 0.7 and 1: 0.5 and 0.25; and of 0.5 at least: 1";
        hose_flow: f64 = 0.05, "of the diameter",
            "A hose's diameter is known no better, as far as it says what passes.",
            "at a tenth of choked flow a tube's coefficient of friction is 1.5 times the one of choked flow, for which the formula is: as if it were 7 % narrower";
        hose_delay: f64 = 0.577, "of the time of sound",
            "How well the delay by hoses is known; corrected down to none, never up by this.",
            "any part of it equally likely: root mean square from all of it, 1/sqrt(3)";
        supply_sensor: f64 = 0.005, "of the value",
            "Standard deviation of the supply sensor's offset.",
            "0.3 % of 10 bar: a usual transmitter";
        farthest_nominal: f64 = 4.0, "tolerances",
            "A nominal value is corrected by no more.",
            "once in 16,000 values by chance: beyond that it is a cause";
        largest_term: f64 = 20.0, "",
            "Largest such factor.",
            "twenty times friction or flow as stated";
    }
    "balances" {
        chamber_memory_s: f64 = 1.0, "s",
            "Time constant of the chamber's observer.",
            "long enough for leaks to build up, short enough to forget within a few strokes";
        settling_s: f64 = 0.1, "s",
            "The first part of every stretch is not judged, nor is the force balance for as long after an end stop.",
            "ten times a valve lag of 10 ms; several periods of the position observer";
        warmth_step_s: f64 = 0.005, "s",
            "Steps in which the temperature of a chamber's air is followed between two stretches.",
            "a fifth of the time of a fast filling";
        initial_warmth: f64 = 0.05, "of the temperature",
            "By so much the temperature of a chamber's air may differ from the supply's where a log begins.",
            "15 K: what a cylinder at work keeps up with walls of 30 W/(m2 K)";
        initial_warmth_s: f64 = 10.0, "s",
            "So long that difference is told from the errors of a chamber with a temperature of its own.",
            "three to ten times p V/((n-1) h S T) with 30 W/(m2 K) and 0.03 m from wall to wall: 1 to 3 s";
        chamber_settling_memory_s: f64 = 0.02, "s",
            "Time constant of the observer while it settles.",
            "a fifth of the settling time";
        chamber_clear: f64 = 0.5, "",
            "Where pressure noise is less than this part of what position noise makes, the prediction follows the measurement.",
            "equal shares are 0.7; a chamber where it is less everywhere is compared with its middle";
        slowest_observer: f64 = 15.0, "rad/s",
            "The position observer is no slower, however quiet the pressures are.",
            "it forgets within 0.3 s: a part of the log is 1.5 s long or less";
        observer_step: f64 = 0.5, "",
            "The position observer's bandwidth times the time between rows is no larger.",
            "at 0.5 its error decays by 0.87 from row to row; from 0.8 on it would grow";
        unseen_acceleration: f64 = 0.5, "m/s2",
            "Between rows the piston may accelerate by this without a trace in their pressures.",
            "a breakaway from 10 N of friction with 20 kg: 0.1 mm at 50 Hz, nothing at 1 kHz";
        rest_sigmas: f64 = 4.0, "standard errors",
            "A piston slower than so many standard errors of its velocity is at rest.",
            "once in 16,000 samples by chance";
        least_motion_s: f64 = 0.5, "s",
            "With less motion mechanics are not judged.",
            "one stroke";
        mispredicted: f64 = 6.0, "standard errors",
            "A prediction farther off while one piston rests and the other moves is given up.",
            "six standard errors: never by chance";
        fully_bent: f64 = 0.97, "of the limit",
            "Bristles are fully deflected from here on.",
            "numerical: 3 % of friction";
        bend_step: f64 = 0.2, "of the limit",
            "While they deflect a step moves them by no more.",
            "numerical: five steps over the presliding range";
        most_parts: f64 = 40.0, "",
            "An interval is divided into no more parts.",
            "numerical: bounds the cost";
        spool_travel: f64 = 0.005, "of full voltage",
            "A lagging spool that travels farther between two rows is followed in parts.",
            "numerical: the opening is straight over less";
        spool_parts: usize = 4, "",
            "So many parts.",
            "numerical: with one, lags of 0.9 ms at 1 kHz come out 0.15 ms too short";
        sliding_window_s: f64 = 0.08, "s",
            "The momentum of a sliding piston is judged over windows of this length.",
            "50 um and 600 Pa of noise then make 0.1 N each at 4 kg; longer ones leave no room in short strokes";
        sliding: f64 = 3.0, "Stribeck velocities",
            "Faster than this the piston slides.",
            "the Stribeck term is exp(-9), 1e-4 of itself";
    }
    "estimate" {
        robust_knee: f64 = 3.0, "standard deviations",
            "Innovations beyond this count less and less (pseudo-Huber loss).",
            "99 % efficient on normal errors; mispredicted stick-slip must not rule (Huber 1981)";
        averaged: f64 = 0.004, "s",
            "Innovations within this time are averaged into one.",
            "four samples at 1 kHz: they are white, so little is lost; a quarter of the cost of the normal matrix";
        dispersion_span: f64 = 0.05, "s",
            "The long-run variance is that of means over this time.",
            "50 samples at 1 kHz";
        least_spans: usize = 3, "",
            "With fewer means it is taken to be that of noise.",
            "a median needs three";
        subset_s: f64 = 8.0, "s",
            "Candidates are compared on about this much of the log.",
            "chosen: a candidate then costs a fifth of a run over 40 s";
        subset_piece_s: f64 = 1.5, "s",
            "Taken in pieces of this length from all of it.",
            "one and a half memories of the chamber's observer";
        step_rough: f64 = 0.02, "scales",
            "Step of difference quotients where the cost is not smooth: the force balance.",
            "larger than the jumps that single breakaways make";
        step_smooth: f64 = 1.0e-3, "scales",
            "Step of difference quotients where it is smooth: the air.",
            "near-cancelling directions need small steps";
        axis_reach: f64 = 10.0, "standard deviations",
            "A parabola along an axis is trusted up to here.",
            "standard deviations along a valley come out too small by this factor and more";
        same_cost: f64 = 1.0, "log-likelihood",
            "Costs that differ by no more are the same: of two fits of the same causes, and before and after a coordinate step.",
            "a sixth of a tie";
        converged: f64 = 0.1, "log-likelihood",
            "A step that gains less ends a fit.",
            "a sixtieth of a tie";
        converged_of_all: f64 = 1.0e-6, "of the cost",
            "And so does one that gains less than this part of it.",
            "numerical";
        converged_of_rest: f64 = 1.0e-4, "of the rest",
            "Between hypotheses that are compared, one that gains less than this part of what the fit leaves beyond noise.",
            "where a model is wrong by far, hypotheses differ by hundredths of that";
        kept_promise: f64 = 0.5, "of the promised gain",
            "After a step that gains less derivatives are computed anew, not corrected by it.",
            "a parabola that promises twice what there is has the wrong slope or curvature";
        iterations: usize = 20, "",
            "Most iterations of a full fit.",
            "bounds the time";
        coordinate_step: f64 = 0.4, "scales",
            "First step of coordinate search; a third of it next.",
            "a visible change";
        coordinate_trials: usize = 4, "",
            "Steps tried for each parameter.",
            "down to a hundredth of a scale";
        least_errors: usize = 100, "",
            "Fewer errors of prediction do not tell a sensor's noise.",
            "the median of 100 is known to a ninth";
        plainly_quieter: f64 = 0.93, "",
            "Noise is taken from predictions if that makes it less than this part.",
            "the scatter of a median of 1000 errors is 4 %";
        least_quieter: f64 = 0.4, "",
            "And no less than this part at once.",
            "differences of rows at 50 Hz told up to 2.4 times the noise";
        profile_rise: f64 = 2.0, "log-likelihood",
            "Rise of the profile likelihood at the end of an interval of two standard errors.",
            "2 = 2^2 / 2, the likelihood ratio at two standard errors";
        profile_rise_of_rest: f64 = 0.05, "of the rest",
            "And this part of what the fit leaves.",
            "single breakaways move by chance";
        profile_narrowest: f64 = 0.01, "scales",
            "Narrowest half-width told.",
            "the numerical error of the force balance";
        profile_widths: usize = 12, "",
            "Widths tried, each half as wide again as the one before.",
            "up to one scale";
        numerical_scale: f64 = 0.003, "scales",
            "Numerical error of a fitted parameter, added to its standard error.",
            "parameters from logs without noise come out right to this part";
    }
    "select" {
        penalty_per_cause: f64 = 8.0, "log-likelihood",
            "Penalty of a cause.",
            "four standard deviations of a nominal value: 8 = 4^2 / 2";
        penalty_per_parameter: f64 = 3.0, "log-likelihood",
            "Penalty of each of its parameters.",
            "between AIC (1) and BIC of 40,000 samples (5.3)";
        tie: f64 = 6.0, "log-likelihood",
            "Causes whose penalised cost is within this of another's are tied with it.",
            "odds of exp(6) = 400 to 1";
        share_of_noise: f64 = 0.008, "of the noise's cost",
            "A cause must gain this, too.",
            "numerical error of the balances";
        share_of_rest: f64 = 0.05, "of the rest",
            "And this part of what the fit leaves in its channels.",
            "single breakaways move by chance";
        share_of_rest_between_rows: f64 = 0.25, "of the rest",
            "The same where rows are so far apart that what is between them is interpolated.",
            "the rest is the error of that rather than chance: a cause that is a few percent off takes up a part of it";
        share_of_rest_in_step: f64 = 0.5, "of the rest",
            "The same for a cause that moves nominal values along with it.",
            "it changes mass and friction, too";
        open: f64 = 2.0, "times noise",
            "A balance of higher cost is open.",
            "see closure";
        wide_open: f64 = 6.0, "times noise",
            "A balance of higher cost is wide open.",
            "other first causes are tried there";
        hardly: f64 = 0.2, "of the negligible",
            "A cause between this part of a negligible deviation and the whole must gain beyond doubt; below, it is none.",
            "a lag of 0.2 ms at 1 kHz: what the balances err by in time";
        by_itself: f64 = 2.0, "standard errors",
            "Of a cause of several parameters one must be so far from neutral, or only what they do together is told.",
            "95 %; of two such logs an area of 0.7 % that was gains and offsets had 1.3, an opening curve that was one 3.0";
        sure: f64 = 4.0, "standard errors",
            "A cause's parameter must be this far from neutral.",
            "four standard errors, as for a nominal value";
        score_share: f64 = 0.4, "of the gain required",
            "A candidate of higher score is fitted.",
            "scores are linear: they miss by half";
        candidates_fitted: usize = 7, "",
            "Candidates fitted in each round, best score first.",
            "bounds the time";
        first_iterations: usize = 3, "",
            "Iterations after which candidates are compared.",
            "bounds the time";
        candidates_finished: usize = 3, "",
            "Candidates fitted to the end.",
            "bounds the time";
        candidates_strained: usize = 14, "",
            "The same where nominal values are strained: scores mislead there.",
            "half of it, a recorded scale of the position is missed: five nominal values take its place";
        beyond_doubt: f64 = 10.0, "times required",
            "A cause that gains this many times what it must is kept without a refit.",
            "an order of magnitude";
        alternatives: usize = 5, "",
            "Candidates tried in the place of each cause.",
            "bounds the time";
        rounds_alike: usize = 3, "",
            "Most full fits in a row of an effect that the cause is confused with.",
            "bounds the time; most converge in one";
        likelier: f64 = 4.0, "log-likelihood",
            "An exchange must gain this.",
            "odds of exp(4) = 55 to 1";
        correlated: f64 = 0.2, "",
            "What can do less than this part of what a cause does, to first order, is not fitted in its place.",
            "of 466 such fits those that came within a tie, or 1 % of the gain, had 0.38 and more";
        tie_of_gain: f64 = 0.003, "of the gain",
            "Beside a tie in log-likelihood: alternatives within this part of what the cause gains.",
            "numerical error of the balances; without it three of the recorded logs lose a tie";
        most_causes: usize = 4, "",
            "No more causes are composed.",
            "one more than is ever named";
        most_effort: f64 = 500.0, "million samples",
            "Once the balances have run over so many samples, no more causes are exchanged, and added only as long as each takes most of what is left.",
            "20 s of one core, 11 s on two; before fits took a sixth fewer samples: ended at 400, one of 24 triples got a wrong name and one none that end right at 600";
        most_effort_open: f64 = 330.0, "million samples",
            "While a balance is wide open no more are exchanged from here on, and no search begins anew from other first causes.",
            "13 s of one core; before fits took a sixth fewer samples: ended at 150 or 300 one of 24 triples stayed without a name that is found at 400";
        most_effort_supported: f64 = 150.0, "million samples",
            "What the extended rig should have besides is looked for with so much more.",
            "4 s of one core";
        level_step: f64 = 1.04, "",
            "Static friction and stiffness of the bristles are looked for in steps of this factor.",
            "valleys between breakaways are a few percent wide: the grid of the effect's own file";
        everyday: f64 = 0.2, "scales",
            "Standard deviation of what a rig has of each everyday effect, for the extended rig's fit.",
            "the geometric mean of a negligible change (0.04 scales) and a plainly visible one";
        most_supported: usize = 12, "",
            "Most effects of an extended rig.",
            "a rig with everything that data sheets leave out has about ten";
        support_iterations: usize = 6, "",
            "Iterations of fits of an extended rig before the last one.",
            "bounds the time";
        support_candidates: usize = 5, "",
            "Effects tried at once for it, best score first.",
            "bounds the time";
        most_screened: usize = 6, "",
            "Effects that screening hands on, surest first.",
            "three causes, and one more each that takes a part of the same trace";
        restarts: usize = 2, "",
            "Other first causes tried where a search ends wide open.",
            "the second or third best first cause led to the truth in the two logs that failed without";
        visible_change: f64 = 50.0, "log-likelihood",
            "An effect of visible strength that would change the predictions by more is visible in the log.",
            "ten standard deviations: 50 = 10^2 / 2";
        ripple_places: usize = 2048, "",
            "Positions are put into so many places along the stroke.",
            "0.5 mm of 1 m";
        ripple_shortest: f64 = 4.0, "places",
            "Shortest wavelength looked for.",
            "two samples a wave is the limit";
        ripple_strongest: usize = 4, "",
            "Wavelengths taken as initial values.",
            "bounds the time";
    }
    "validate" {
        closed_dispersion_mass: f64 = 2.5, "times noise",
            "A mass balance of less long-run variance is closed.",
            "chosen: above what right models leave";
        closed_dispersion_force: f64 = 4.0, "times noise",
            "The same for the force balance.",
            "breakaways err more than noise";
        closed_cost_mass: f64 = 3.0, "times noise",
            "And of less cost.",
            "chosen: above what right models leave";
        closed_cost_force: f64 = 5.0, "times noise",
            "The same for the force balance.",
            "breakaways err more than noise";
        like_noise: f64 = 1.25, "times noise",
            "A balance of less cost and long-run variance may be noise.",
            "causes fitted to it make it a little less than white";
        no_worse: f64 = 1.01, "times",
            "Squared errors on the part held back may grow by this with causes that nominal values far off would replace, else not at all.",
            "1 %: chance";
        little_worse: f64 = 1.1, "times",
            "By this where the balances there gain plainly.",
            "breakaways err by chance";
        plain_gain: f64 = 0.05, "of the noise's cost",
            "What a plain gain is.",
            "a spool 0.7 ms slower than stated, 24 standard errors, gains 0.066; what a dead volume gained in the place of a slewing spool, 0.01";
        chance: f64 = 2.0, "standard deviations",
            "So far above that of white noise a misfit is still noise.",
            "95 %; a volume of 7 l in a log without a gap took 0.04 from a balance at 1.04 and 0.13 of the other's noise";
        likely_rig: f64 = 3.1, "standard deviations",
            "Nominal values that are farther off all together leave no name.",
            "one rig in a thousand";
        least_excess: f64 = 0.2, "of the gain",
            "Part of what causes gain that must be misfit beyond noise, or strain of nominal values.",
            "chosen: a model that only suppresses noise is no cause; in a log where nothing moves a lag of 23 ms gained 4 %";
        most_named: usize = 3, "",
            "Most causes named at once.",
            "more are rather one that the catalogue lacks";
        trifle: f64 = 0.01, "of the gap",
            "Beside that many, a smaller share is a lead and casts no doubt.",
            "a hundredth";
        least_share: f64 = 1.0e-4, "of the gap",
            "A cause with a smaller share is not named, and casts no doubt.",
            "of right names on record the smallest share was 1.9e-4; a wrong one beside the true cause had 5e-5";
        least_share_beside_a_gap: f64 = 0.1, "of the gap",
            "Least share of a cause named while a balance stays open.",
            "a smaller one is as likely the gap's shadow";
        noise_floor_draws: usize = 8, "",
            "Draws of the sensors' noise that the noise floor is averaged over.",
            "one draw scatters by a quarter where the piston sticks, eight by a tenth";
        run_in_s: f64 = 0.15, "s",
            "The spool runs in for this long before each restart.",
            "ten times a valve lag of 10 ms";
        restart_s: f64 = 0.06, "s",
            "So much before a restart tells by how much the model that ran in is behind, and how fast it falls back.",
            "60 samples at 1 kHz: 0.4 mm/s of error from 50 um of noise, less than the centred window of the velocity";
        restart_pressure_s: f64 = 0.02, "s",
            "For pressures the mean of so much: a command that moved between rows makes their errors wander, and a slope means nothing.",
            "20 samples at 1 kHz: a quarter of the noise";
        least_restart_rows: usize = 4, "samples",
            "And no fewer samples.",
            "a line through three has one to spare";
        term_gain: f64 = 25.0, "log-likelihood",
            "A term outside the catalogue must gain this.",
            "three times a cause's penalty: no physics of its own speaks for it";
        least_term: f64 = 0.05, "of the misfit",
            "A term is told only if it takes so much of what the part held back would have without it.",
            "as the least gap that is told of: a twentieth of noise";
        most_terms: usize = 3, "",
            "Terms in one description.",
            "more cannot be read";
        chance_predictions: usize = 20, "",
            "One prediction in so many may err by chance.",
            "chosen: one of sixty did in a log without a gap";
        closed_hold_out: f64 = 1.75, "times noise",
            "Up to this error the whole model predicts the part held back as well as it can.",
            "right extended rigs reached 1.5 where the piston sticks and slips";
    }
    "explain" {
        calibrated_sigmas: f64 = 2.0, "standard errors",
            "A nominal value that moved less is not told as corrected.",
            "two standard errors";
    }
}
