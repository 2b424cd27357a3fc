//! The tests of the plant's equations: one program, because linking and checking each file alone costs more than running it.

mod bought_rigs;
mod effect_catalogue;
mod errata;
mod one_balance_at_a_time;
mod paper_statements;
mod recorded_trajectories;
mod robustness;
mod similarity;
mod single_precision;
