//! The paper's figures, computed anew, and whether the simulation bears out what the text says of them.

mod friction;
mod positioning;
mod pressures;
mod valve;

use report_html::Plot;

/// Whether a statement holds in the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It does.
    BorneOut,
    /// It does within limits that the paper does not state, or not to the letter; the evidence says which.
    InPart,
    /// It does not.
    NotBorneOut,
}

/// A statement of the paper with what the simulation says to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// What the paper says.
    pub statement: &'static str,
    /// Whether it holds.
    pub verdict: Verdict,
    /// The figures behind the verdict.
    pub evidence: String,
}

impl Claim {
    fn new(statement: &'static str, holds: bool, evidence: impl Into<String>) -> Self {
        let verdict = if holds { Verdict::BorneOut } else { Verdict::NotBorneOut };
        Self { statement, verdict, evidence: evidence.into() }
    }

    /// A statement that can hold at most in part, for the reason the evidence gives.
    fn in_part(statement: &'static str, holds: bool, evidence: impl Into<String>) -> Self {
        let mut claim = Self::new(statement, holds, evidence);
        if holds {
            claim.verdict = Verdict::InPart;
        }
        claim
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::BorneOut => "borne out",
            Self::InPart => "in part",
            Self::NotBorneOut => "NOT borne out",
        })
    }
}

/// One figure of the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Its number in the paper.
    pub number: u32,
    /// What it shows.
    pub title: &'static str,
    /// How it was computed here, where the paper leaves it open.
    pub setting: &'static str,
    /// The picture.
    pub plots: Vec<Plot>,
    /// What the text claims of it.
    pub claims: Vec<Claim>,
}

/// Figures 5, 6, 8, 10, 11 and 13.
#[must_use]
pub fn figures() -> Vec<Figure> {
    vec![
        valve::dead_zone(),
        valve::flow(),
        pressures::open_valve(),
        friction::steady_state(),
        friction::stiction(),
        positioning::three_cylinders(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_statement_of_the_paper_holds_but_three_only_in_part() {
        let mut in_part = Vec::new();
        for figure in figures() {
            assert!(!figure.claims.is_empty() && !figure.plots.is_empty(), "figure {}", figure.number);
            for claim in figure.claims {
                let place = format!("figure {}: {}: {}", figure.number, claim.statement, claim.evidence);
                assert_ne!(claim.verdict, Verdict::NotBorneOut, "{place}");
                if claim.verdict == Verdict::InPart {
                    in_part.push((figure.number, claim.statement));
                }
            }
        }
        assert_eq!(
            in_part,
            [
                (11, friction::NO_CREEP),
                (13, "case (a) hunts around the target: oscillations caused by limit cycles"),
                (13, "case (b) does not overshoot"),
            ]
        );
    }
}
