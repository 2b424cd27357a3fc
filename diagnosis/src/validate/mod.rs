//! What stands of the causes found: closure of the balances, hold-out, terms outside the catalogue, verdict.

pub(crate) mod closure;
pub(crate) mod confirmation;
pub(crate) mod foreign_terms;
pub(crate) mod hold_out;
pub(crate) mod support;
pub(crate) mod verdict;
