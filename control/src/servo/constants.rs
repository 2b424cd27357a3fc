//! What is the same for every rig, in SI units, for the law in fixed point and its twin in f64. What the rig decides stands in the table of
//! parameters.

// The stream of targets.

/// Bandwidth with which the derivatives of a streamed target follow, rad/s. Half of it: a sine of 16 Hz on (c) is passed by 2.7 instead of 1.4 times its
/// amplitude; twice: a sine held for 20 ms, or sent with 20 um of noise, is followed to 7 to 9 instead of 0.3 to 0.5 mm on (a) and (b).
pub const STREAM_BANDWIDTH: f64 = 150.0;
/// The same of its jerk: one fifth, for it is the third derivative of a target that may come in codes.
pub const JERK_BANDWIDTH: f64 = 30.0;
/// Bandwidth with which derivatives follow times the time between changes of the target, at most. Held for 20 ms a sine of 50 mm and
/// 0.5 Hz is followed to 0.35 mm on (a), with 0.3 to 0.9 mm; with 0.7 already 5 ms lead it astray.
pub const MOST_PER_CHANGE: f64 = 0.45;
/// A standing target that changes by no more is the same, and so is a reference that is nearer, m: hold begins within it, so the piston would
/// not be moved for more.
pub const DEAD_BAND_M: f64 = HOLD_M[0];
/// Longest time that a streamed target may be held by a slow sender, s: 50 Hz and some delay. What is held for longer is a step.
pub const LONGEST_HOLD_S: f64 = 0.025;
/// Largest acceleration of a streamed target, over the reference's limit.
pub const MOST_ACCELERATION: f64 = 4.0;
/// Part of the limits that a target's own motion may take up and still be followed with all its derivatives; at [`NOT_FOLLOWED`]
/// none is left.
pub const FOLLOWED: f64 = 0.25;
/// See [`FOLLOWED`]. Half of it: a sine of 50 mm and 0.5 Hz on (a) errs by 7 instead of 0.1 mm; twice: a sine of 16 Hz on (c) is passed by 2.6
/// instead of 1.4 times its amplitude.
pub const NOT_FOLLOWED: f64 = 0.4;
/// How long a peak of that part counts, s: about a period of the slowest sine that takes up so much.
pub const PEAK_HELD_S: f64 = 1.0;

// The reference.

/// Reference: part of the jerk limit that the plan has but on the way to a new standing target: where the target moves, and once the
/// reference has arrived. With all of it a reference that a saturated valve pushes off its aim goes on around it.
pub const CALM_JERK: f64 = 0.85;
/// Reference: jerk that brings the motion back to its plan towards a standing target, over the plan's own.
pub const RESERVE: f64 = 1.2;
/// Flow over nominal flow, on the weaker side, from which the reference uses its limits whole: the gain of a nominal valve is
/// learned to some per cent. At 0.67 and 0.5 more of the rigs unlike their nominal values overshoot (docs/control-law.md).
pub const FULL_FLOW: f64 = 0.9;
/// Reference: distance from which it is put on its aim, beyond one tick's jerk, m: some times what the search for the jerk leaves, 11 nm
/// on (a) and in proportion to `A³/J²`. On (a) to (c) nothing, half and twice do as well.
pub const NEAR_M: f64 = 2e-6;
/// Reference: distance from its target at which it has arrived, m: that within which a move counts as settled. With 0.5 mm it is the
/// same.
pub const ARRIVED_M: f64 = 0.1e-3;
/// Reference: part of its acceleration limit beyond which it counts as braking. A tenth and a half do as well; without a bound the
/// sign of an acceleration of zero, along the speed limit, would decide.
pub const BRAKING: f64 = 0.25;
/// Reference: distance from the piston up to which it may brake as planned, m: the error that the bandwidth is made for. Without a
/// bound a sensor that reads garbage leads the piston 0.8 m astray, as nothing brings the reference back to it.
pub const ERROR_M: f64 = 0.5e-3;

// Valve, air and observer.

/// Delay of the loop by tick and output, ticks: a command acts one tick late, and stays for one, in the mean half a tick.
pub const TICK_DELAY: f64 = 1.5;
/// Hoses: most ticks of the command's delay; the ring that holds the commands has a power of two of places.
pub const MOST_HOSE_DELAY_TICKS: usize = 31;
/// Gain times dead time of the loop that brings the force to the friction fed forward: a phase margin of 61 degrees.
pub const GAIN_DELAY: f64 = 0.5;
/// Angle below which the dead zone is crossed on a straight line, rad: two codes of a DAC of 12 bits. A tenth, half, twice and ten
/// times of it do as well.
pub const BLEND: f64 = 0.01;
/// How fast the pressures behind stiffness and slopes follow the measured ones, 1/s. Half and twice do as well on (a) to (c); but with the
/// force's 375/s the tick and its f64 twin differ by more than 80 codes in more than one tick of 100 of a move on (b).
pub const PRESSURE_RATE: f64 = 250.0;
/// Least driving pressure of a flow over the supply: the noise of a nearly full or empty chamber must not take the slope, by which the law
/// divides, to zero. From a hundredth to five times of it moves on (a) to (c) are the same to the last digit.
pub const LEAST_DRIVE: f64 = 0.03;
/// Least length of a chamber over that at mid-stroke. Of a chamber without clearance, as case (b)'s, the last millimetres answer faster
/// than any valve: with 0.02 and 0.1 it never rests there, with 0.03 and 0.05 moves to 1 mm from the end settle within 0.7 s.
pub const LEAST_LENGTH: f64 = 0.03;
/// Observer: time after a run begins within which the piston still stands, s: delay and lag, and the time in which the force of the
/// wide open valve reaches the friction. 4 and 16 ms do, too; without it one of 400 moves of 1 mm on (b) takes 0.22 s.
pub const STANDING_S: f64 = 8e-3;
/// Without measured pressures: how fast the force takes up what the model does not explain, 1/s. With both sensors lost, half of it: the
/// valve is silent after 42 instead of 80 % of the random moves of (b)'s draws without leaks; twice: 58 instead of 62 % of (b)'s draws within
/// 0.6 s, of (c)'s 30 instead of 23 %.
pub const UNSEEN_RATE: f64 = 5.0;

// Learning.

/// Part of the nominal Coulomb friction that is compensated before any is learned. With 0.9, 0.92 and 0.95 moves of 1 mm on (b) take
/// 0.100, 0.097 and 0.087 s in the mean, and one of 100 moves of 45 mm on (c) without a dead zone rests 36, 32 and 38 um off or more.
pub const COULOMB_START: f64 = 0.92;
/// The same where the piston slips as it breaks away. With 0.95 long moves of the catalogue rigs pass their target by more.
pub const SLIPPING_COULOMB_START: f64 = 0.8;
/// The same in the first run without measured pressures, where too much is hardly unlearned: with 0.95 and one sensor lost 97.8 % of
/// the draws of (a) are stable and 98.2 % of those of (b), with 0.8 99.4 and 99.9 %.
pub const UNSEEN_COULOMB_START: f64 = 0.8;
/// Rates of learning, 1/s: gain; dead zone, lag and friction. Half of the gain's: overshoot of (a)'s draws 0.69 instead of 0.47 mm, and 97
/// instead of 99 % of (b)'s within 0.6 s; twice: 0.40 mm, 97.5 %. Half of the friction's: 96.5 % of (b)'s draws; half and twice of the dead
/// zone's and of the lag's do as well.
pub const LEARN: [f64; 2] = [10.0, 4.5];
/// Part of the friction's rate with which the mass is learned.
pub const MASS_PART: f64 = 0.2;
/// How fast the Coulomb friction is learned in slow motion towards a standing target, 1/s: a time
/// constant of 25 ms. With 20, 94 % of the
/// draws' moves of 1 mm on (a) settle within 0.6 s instead of 99 %; with 80, (c) takes three times the noise for friction.
pub const SLOW_LEARN: f64 = 40.0;
/// How fast the load is learned while the piston moves, 1/s; where friction is at its end it is [`SLOW_LEARN`]. With 0, 0.5, 1 and 2, 91,
/// 92, 94 and 95 % of moves of (a)'s draws under loads settle within 0.6 s, and without any 99.8, 99.5, 99.8 and 99.0 % of its moves of 45 mm.
pub const LOAD_RATE: f64 = 1.0;
/// Part of the Coulomb friction that is unlearned each time that the piston passes a standing target, and of the bandwidth where it swings.
pub const UNLEARN: f64 = 0.1;
/// How often a piston may pass its standing target until it counts as swinging. Friction that is half of what is compensated is unlearned
/// after six. With 4, one of 400 moves of 1 mm of (a)'s draws takes longer than a second; with 16, (c) rests 1.3 instead of 0.5 s after a
/// command that acts 3 ms late.
pub const MOST_SWINGS: u8 = 8;
/// Change of angle above which the force tells the lag, rad/s. Half and twice do as well.
pub const TURNING: f64 = 100.0;
/// Angle above which the flow tells the gain, rad.
pub const GAIN_ANGLE: f64 = 0.4;
/// Effective voltage below which the flow tells the dead zone, V.
pub const ZONE_V: f64 = 0.25;
/// Speed above which the disturbance tells the friction, m/s.
pub const SLIDING: f64 = 0.020;

// Noise.

/// How fast the noise of the position is learned, 1/s. Three times the noise, half of it: 58 instead of 76 % of (c)'s draws within 0.6 s, 30
/// instead of 2 of 300 moves end with a valve that moves; twice: 78 %, none.
pub const NOISE_RATE: f64 = 3.0;
/// Noise of a position code up to which the thresholds of hold and stick are not scaled, um. Three times the noise, half of it: the piston rests up to
/// 0.10 instead of 0.05 mm off; twice: it rests in none of 100 moves of 1 mm on (c).
pub const QUIET_UM: f64 = 30.0;
/// By how much more coarsely hold and stick judge where the piston slips as it breaks away. On the four catalogue rigs some
/// moves never end with 1.4, and rest up to 0.13 mm off with 1.8.
pub const SLIPPING: f64 = 1.6;
/// By how much more coarsely hold and stick judge a noisy position, at most.
pub const MOST_THRESHOLD_SCALE: f64 = 4.0;
/// From the mean size of a normal deviate to its standard deviation, `sqrt(π / 2)`.
pub const DEVIATION: f64 = 1.25;

// Hold.

/// Hold: enter below this error and leave beyond that, m.
pub const HOLD_M: [f64; 2] = [20e-6, 40e-6];
/// Hold: enter below this speed, m/s. Three times the noise, half of it: 12 instead of 2 of 300 moves on (c) end with a valve that moves;
/// twice and no such condition do as well on (a) to (c). With [`STICK_SPEED`] instead a piston of a fiftieth of the friction passes its
/// target by 0.11 mm on (a).
pub const HOLD_SPEED: f64 = 1.8e-3;
/// Hold: time of rest before entering, s; stick: time before the force is led. Half of it: 97.5 instead of 99 % of (b)'s draws within 0.6 s;
/// twice: the valve is silent after 93 instead of 98 % of the random moves of (c)'s draws without leaks.
pub const REST_S: f64 = 10e-3;
/// Hold: part of the Coulomb friction below it within which the piston counts as held. With 0.1 one of 600 moves of 200 mm on (b)
/// creeps on by 0.1 mm after it, with 0.15 the valve on (c) still moves after 5 % of the draws' random moves instead of 2 %.
pub const HELD: f64 = 0.12;
/// Hold: standard deviations of the disturbance within which the piston counts as held where friction is not told from noise.
pub const HELD_DEVIATIONS: f64 = 3.0;
/// Hold and stick: time over which error and speed are means, s. With 8 ms stick pushes a piston on that has already arrived:
/// the slowest of 400 moves of 1 mm takes 0.28 s on (b) instead of 0.15 s. 3 ms are as good as 4 ms.
pub const MEAN_S: f64 = 4e-3;
/// The same where the piston slips as it breaks away: its speed is a difference of positions, and noisier.
pub const SLIPPING_MEAN_S: f64 = 8e-3;
/// Hold: time over which the force is a mean, s.
pub const FORCE_MEAN_S: f64 = 8e-3;
/// Hold: time of the long mean of the error, s.
pub const LONG_MEAN_S: f64 = 64e-3;
/// Hold: time after entering until the force rests, s: four times the mean, within which a spool of 5 ms comes to rest, too.
pub const SETTLE_S: f64 = 32e-3;
/// Hold: time after entering within which the piston may still coast, s.
pub const COAST_S: f64 = 0.2;
/// Hold: time after entering within which the place is on trial, s: a piston that is held near the Coulomb friction creeps
/// on for some tenths.
pub const TRIAL_S: f64 = 0.5;
/// Hold: leave beyond the long mean, on trial and later, and beyond that error at once, over the error
/// to leave at.
pub const LEAVE: [f64; 3] = [0.9, 1.2, 2.0];
/// Hold: change of force that may have moved the piston, over the Coulomb friction.
pub const MOVING: f64 = 0.1;
/// Hold: how fast the noise of the force is learned, 1/s.
pub const FORCE_NOISE_RATE: f64 = 10.0;
/// Hold: standard deviations of the difference of two means of the force that count as noise: passed by noise once in two
/// hours. At three times the noise 17 of 1,800 moves are disturbed within 10 s with 4, one with 5.
pub const DOUBT: f64 = 5.0;
/// Hold: part of the Coulomb friction by which the force may drift. Half and twice: no clear difference.
pub const HOLD_DRIFT: f64 = 0.15;
/// Hold: time in which a pulse brings that back, s.
pub const PULSE_S: f64 = 0.010;

// Stick.

/// Stick: mean speed below which the piston sticks, and speed of the reference below which it stands, m/s. Half of it: 94.5 instead of 99 %
/// of (b)'s draws within 0.6 s, 48 instead of 76 % of (c)'s at three times the noise; twice: the slowest move of 1 mm takes 0.18 instead of
/// 0.14 s on (b), 0.10 instead of 0.06 s on (c).
pub const STICK_SPEED: f64 = 1.6e-3;
/// Stick: rate of force over that of the law. With 3 the slowest of 800 moves of 1 mm takes 0.14 s on (c), with 2 0.09 s.
pub const STICK_GAIN: f64 = 2.0;
/// The same where the piston slips as it breaks away. With 2, moves of the DSNU-25-100 take 0.61 s in the mean, with 3 0.26 s.
pub const SLIPPING_STICK_GAIN: f64 = 3.0;
/// Stick: feedback of the mean velocity over `w²`: twice the law's.
pub const STICK_CREEP: f64 = 6.0;
/// Stick: how fast the force follows, over the law's bandwidth. Half of it: an obstacle that gives way after half a second lets (c) pass its
/// target by 20 instead of 15 mm; twice: 13 mm. Moves and draws are the same.
pub const STICK_FORCE: f64 = 1.0 / 1.5;
/// Stick: farthest that the asked force may be from the force there is, over the Coulomb friction: from one end of it to the other.
pub const STICK_MOST: f64 = 2.0;

// Stall, and the controlled stop.

/// Stall: a piston that has moved by less stands, m: the seal gives by up to 0.1 mm before it slides, and an estimate of it errs by some
/// hundredths.
pub const STANDS_M: f64 = 0.2e-3;
/// Stall: time with more force than friction takes until the piston counts as blocked, s. At full flow (c), the quickest of the paper's
/// cylinders, takes 12 ms from breaking away to [`STANDS_M`]. With 15 ms an obstacle that gives way half a second later lets (c) pass its
/// target by 5 instead of 19 mm, but a piston of little friction is taken for blocked where it turns round.
pub const STALL_S: f64 = 30e-3;
/// Stall: part of [`STALL_S`] from which on neither friction nor load is learned. A piston that is free but slow to set out has moved by
/// then.
pub const SUSPECTED: f64 = 0.25;
/// Stall: time in which the force would grow to all that the supply gives, s. With 2.5, 5, 10 and 17 s an obstacle that gives way after a
/// second lets (a) pass its target by 193, 124, 107 and 81 mm; three times the friction that the rig file says is overcome as slowly.
pub const STALL_GROWTH_S: f64 = 5.0;
/// Controlled stop: how fast the chambers' forces come to balance, over the law's bandwidth. With 0.3 more is let out of what the
/// motion compresses, which brakes: in the reliability study a lost position reaches 3 mm out of its span instead of none, a supply
/// that is lost 6 mm; but a frozen noiseless position 63 mm instead of 73.
pub const EQUALISE: f64 = 0.15;
