//! Kinds of canonical timelines.

use gestus_motion::corpus::Cycle;
use serde::{Deserialize, Serialize};

/// Knots of a gait cycle: left, right and left strike.
pub const GAIT_KNOTS: usize = 3;

/// The kind of an action's canonical timeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Cyclic, cut at foot strikes: walks, runs, turns.
    Gait,
    /// One timeline from the start of a clip to its end: kicks, waves.
    Whole,
}

impl Kind {
    /// The kind that a registered cycle is of: its number of knots says it.
    pub fn of_cycle(cycle: &Cycle) -> Kind {
        if cycle.knots.len() == GAIT_KNOTS { Kind::Gait } else { Kind::Whole }
    }

    /// The kind of an action, guessed by its name.
    pub fn of_action(action: &str) -> Kind {
        const GAITS: [&str; 8] = ["walk", "run", "jog", "turn", "march", "strut", "dash", "sneak"];
        let name = action.to_ascii_lowercase();
        // Whole words at the start, so that `run-turn` is a gait and `return` is none.
        let is_gait = name
            .split(|c: char| !c.is_alphabetic())
            .filter_map(|word| GAITS.iter().find_map(|gait| word.strip_prefix(gait)))
            .any(|ending| matches!(ending, "" | "s" | "ing" | "ning" | "ging" | "ting"));
        if is_gait { Kind::Gait } else { Kind::Whole }
    }
}
