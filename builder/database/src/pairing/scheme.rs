//! How output cycles are chosen.

use serde::{Deserialize, Serialize};

/// How output cycles are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Real cycles of similar actions, distributed by kernel weight.
    Spread,
    /// The outputs of `Spread` and of `Viterbi`, whose mean the core computes. Of a whole clip, the second is the clip most
    /// like the first.
    #[default]
    Both,
    /// The sequence of real cycles with the best fit and continuity.
    Viterbi,
    /// The real cycle that fits best.
    Nearest,
    /// Kernel averages around prototypes.
    Kernel,
    /// One average per class.
    Mean,
    /// The same cycle of the clip of the same take.
    Take,
}

impl Scheme {
    /// All schemes with their names.
    pub const ALL: [(&'static str, Scheme); 7] = [
        ("both", Self::Both),
        ("spread", Self::Spread),
        ("viterbi", Self::Viterbi),
        ("nearest", Self::Nearest),
        ("kernel", Self::Kernel),
        ("mean", Self::Mean),
        ("take", Self::Take),
    ];

    /// The scheme of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, s)| *s)
    }

    /// The scheme of the linear models' pairs.
    pub fn of_models(self) -> Self {
        if matches!(self, Self::Spread | Self::Both) { Self::Viterbi } else { self }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, s)| *s == self).map_or("", |(n, _)| n)
    }
}
