//! `plant-sim synthesize`: a log with chosen or hidden effects.

use super::{CliError, RigArgument};
use rand::rngs::Xoshiro256PlusPlus;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rig_files::{Column, RigFile, Short, write_file};
use std::path::PathBuf;
use synthesis::{Case, Cause, Chain, Family, Foreign, Law, Which, strength, true_rig};

/// Make a log of a synthetic rig, with effects you choose or that stay hidden from you.
///
/// The synthetic rig has its own equations and integrator, independent of those that the diagnosis fits. It runs a
/// realistic experiment and is recorded with noise, 12-bit pressures over 10 bar, and on request jitter and losses. The
/// diagnosis sees the rig file; --nominal-error lets the true rig differ from it.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim synthesize --rig rigs/paper-a.toml --effect leak-cross-piston:conductance_kg_per_s_pa=2e-10 --out leak.csv\n  \
    plant-sim synthesize --rig rigs/paper-c.toml --effect valve-lag --effect payload-mass --seed 3 --out two.csv\n  \
    plant-sim synthesize --rig rigs/paper-b.toml --hidden --out hidden.csv --truth answer.toml\n\n\
An effect without values gets everyday strength, drawn from the seed. Effects that the rig file states under [effects]\n\
are in the log as well, with the file's values; those chosen or hidden come in addition. Identifiers beginning with\n\
foreign- are outside the catalogue: a diagnosis must not name anything for them.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Where to write the log (CSV)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// An effect, e.g. valve-lag or valve-lag:time_constant_s=0.01; may be repeated
    #[arg(long = "effect", value_name = "ID[:NAME=VALUE,...]")]
    effects: Vec<String>,
    /// Hide this many effects, drawn at random from the catalogue
    #[arg(long, value_name = "COUNT", num_args = 0..=1, default_missing_value = "1", allow_negative_numbers = true)]
    hidden: Option<u8>,
    /// Strength of drawn effects: 1 is everyday, 0.25 weak
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = positive, allow_negative_numbers = true)]
    strength: f64,
    /// Write the hidden effects to this file (TOML); without it they are written nowhere
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Seed of everything random; printed, and drawn if not given
    #[arg(long, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// identification, everyday, mixed, poor-still, poor-one-way, poor-small
    #[arg(long, value_name = "FAMILY", default_value = "mixed", value_parser = family)]
    experiment: Family,
    /// Duration
    #[arg(long, value_name = "SECONDS", default_value_t = 40.0, value_parser = duration, allow_negative_numbers = true)]
    duration: f64,
    /// Relative standard error of flow coefficients, volumes, mass and friction in the rig file
    #[arg(long, value_name = "RATIO", default_value_t = 0.0, value_parser = ratio, allow_negative_numbers = true)]
    nominal_error: f64,
    /// Standard deviation of pressure noise
    #[arg(long, value_name = "PA", default_value_t = 600.0, value_parser = not_negative, allow_negative_numbers = true)]
    pressure_noise: f64,
    /// Standard deviation of position noise
    #[arg(long, value_name = "M", default_value_t = 0.05e-3, value_parser = not_negative, allow_negative_numbers = true)]
    position_noise: f64,
    /// Bits of the pressure converter over 10 bar
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(4..=24), allow_negative_numbers = true)]
    pressure_bits: u32,
    /// Bits of the position converter over the rig file's range
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(4..=24), allow_negative_numbers = true)]
    position_bits: u32,
    /// Standard deviation of the sampling period, relative
    #[arg(long, value_name = "RATIO", default_value_t = 0.0, value_parser = ratio, allow_negative_numbers = true)]
    jitter: f64,
    /// Stretches of missing rows per second
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    lost_rows: f64,
    /// Stretches of blank fields per second and column
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    blanks: f64,
    /// Cut this much off the beginning, so that the log begins while the rig is at work
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    begins: f64,
    /// Columns to record in addition to t_s and y_m
    #[arg(long, value_delimiter = ',', value_parser = column, default_value = "u_v,p_a_pa,p_b_pa,p_sup_pa,y_ref_m")]
    columns: Vec<Column>,
}

fn number(text: &str, accepted: impl Fn(f64) -> bool, must: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| value.is_finite() && accepted(*value))
        .ok_or_else(|| format!("must be {must}"))
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0 && value <= 10.0, "a number above 0, up to 10")
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |value| value >= 0.0, "a number, zero or greater")
}

fn ratio(text: &str) -> Result<f64, String> {
    number(text, |value| (0.0..=0.3).contains(&value), "a ratio from 0 to 0.3; write 2 % as 0.02")
}

pub(crate) fn duration(text: &str) -> Result<f64, String> {
    number(text, |value| (1.0..=3600.0).contains(&value), "from 1 to 3600 seconds")
}

fn family(text: &str) -> Result<Family, String> {
    Family::from_id(text).ok_or_else(|| {
        let known: Vec<_> = Family::GOOD.into_iter().chain(Family::POOR).map(Family::id).collect();
        format!("must be one of {}", known.join(", "))
    })
}

fn column(text: &str) -> Result<Column, String> {
    let recordable = [Column::U, Column::PA, Column::PB, Column::PSup, Column::YRef];
    recordable.into_iter().find(|column| column.name() == text).ok_or_else(|| {
        let names: Vec<_> = recordable.into_iter().map(Column::name).collect();
        format!("must be one of {}", names.join(", "))
    })
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    if arguments.begins > arguments.duration - 1.0 {
        let message = "--begins must leave a second of --duration to record";
        return Err(CliError::Usage(message.into()));
    }
    for out in std::iter::once(&arguments.out).chain(&arguments.truth) {
        super::can_be_written(out, [&*arguments.rig.rig])?;
    }
    let rig_file = super::read_rig(&arguments.rig.rig)?;
    let seed = arguments.seed.unwrap_or_else(|| rand::rng().random());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let truth = true_rig(&rig_file.rig, arguments.nominal_error, &mut rng);

    let stated = |id: &str| states(&rig_file, id);
    let mut causes: Vec<Cause> = Vec::new();
    for text in &arguments.effects {
        let draw = |which| strength::draw(which, &truth, arguments.strength, &mut rng);
        let cause = Cause::parse(text, draw).map_err(|error| CliError::Usage(error.to_string()))?;
        if stated(cause.id()) || causes.iter().any(|other| other.id() == cause.id()) {
            return Err(CliError::Usage(twice(cause.id(), arguments, &rig_file)));
        }
        causes.push(cause);
    }
    if let Some(count) = arguments.hidden {
        let all = plant_model::Effect::ALL.into_iter().map(Which::Catalogue);
        let pool: Vec<Which> =
            all.filter(|which| !stated(which.id()) && causes.iter().all(|cause| cause.id() != which.id())).collect();
        if usize::from(count) > pool.len() {
            let message = format!("--hidden {count}: only {} effects are left to hide", pool.len());
            return Err(CliError::Usage(message));
        }
        for which in pool.sample(&mut rng, usize::from(count)) {
            causes.push(strength::draw(*which, &truth, arguments.strength, &mut rng));
        }
    }
    let experiment = arguments.experiment.draw(&truth, arguments.duration, &mut rng);
    let law = Law::for_rig(&rig_file.rig, rng.random_range(0.8..1.6));
    let chain = chain(arguments, &rig_file);
    let case = Case { rig_file, truth, causes, experiment, law, chain, seed };
    let present = case.present();
    plant_model::Plant::new(&case.truth, &Cause::effects(&present))
        .map_err(|error| CliError::Usage(error.to_string()))?;
    let (log, _) = case.record();
    if log.is_empty() {
        let message = format!("--lost-rows {} loses every row; give fewer", Short(arguments.lost_rows));
        return Err(CliError::Usage(message));
    }
    log.write(&arguments.out)?;
    if let Some(path) = &arguments.truth {
        write_file(path, |file| file.write_all(case.truth_toml().as_bytes()))?;
    }
    say!("{}: {} rows, experiment {}, seed {seed}", arguments.out.display(), log.len(), case.experiment.name);
    if arguments.hidden.is_none() {
        for cause in &present {
            say!("  {}", cause.describe());
        }
    }
    if case.causes.iter().any(|cause| matches!(cause, Cause::Foreign(Foreign::SupplyPulsation, _)))
        && arguments.columns.contains(&Column::PSup)
    {
        eprintln!("warning: p_sup_pa is recorded, so the pulsating supply is visible; leave it out with --columns");
    }
    Ok(())
}

/// Whether a rig file states an effect.
fn states(rig_file: &RigFile, id: &str) -> bool {
    rig_file.effects.iter().any(|(effect, _)| effect.id() == id)
}

/// An effect that would be there twice.
fn twice(id: &str, arguments: &Arguments, rig_file: &RigFile) -> String {
    let rig = arguments.rig.rig.display();
    if states(rig_file, id) {
        format!(
            "--effect {id}: {rig} states it already, under [effects.{id}], and the log has it with these values. For other \
             values synthesize from a copy of {rig} without [effects.{id}]"
        )
    } else {
        format!("--effect {id} is given twice: give it once")
    }
}

fn chain(arguments: &Arguments, rig_file: &RigFile) -> Chain {
    let mut chain = Chain::standard(rig_file.io.position_range_m);
    chain.pressure_noise_pa = arguments.pressure_noise;
    chain.position_noise_m = arguments.position_noise;
    chain.pressure.1 = arguments.pressure_bits;
    chain.position.1 = arguments.position_bits;
    chain.jitter = arguments.jitter;
    chain.lost_rows_per_s = arguments.lost_rows;
    chain.begins_s = arguments.begins;
    chain.blanks_per_s = arguments.blanks;
    chain.columns.clone_from(&arguments.columns);
    chain
}
