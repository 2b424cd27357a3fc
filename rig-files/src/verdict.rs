//! The verdicts of `diagnosis.json`.

/// What a diagnosis concludes about the gap between rig file and log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The rig as given predicts the log as well as its noise allows.
    NoGap,
    /// Named causes close the gap.
    Explained,
    /// Named causes close a part of the gap; a significant rest remains.
    PartlyExplained,
    /// A gap is there, and no known effect closes it.
    Unexplained,
}

impl Verdict {
    /// The word in `diagnosis.json`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::NoGap => "no-gap",
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
        }
    }

    /// The verdict of this word.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        [Self::NoGap, Self::Explained, Self::PartlyExplained, Self::Unexplained].into_iter().find(|v| v.word() == word)
    }
}
